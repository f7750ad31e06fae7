"""Writes how-to/drive-parameters.md from the table of drives: `python docs/tools/drive_parameters.py`."""

from __future__ import annotations

from pathlib import Path

from gaident.control.drive_parameters import CONSTANTS, DRIVES, DriveParameter, DriveRow

PAGE = Path(__file__).resolve().parents[1] / "how-to/drive-parameters.md"

HEAD = """\
# Where to find it in your drive

`python docs/tools/drive_parameters.py` writes this page from `gaident/control/drive_parameters.py`, and a test compares the two.

A drive shows the gains of its controllers in units of its own.
`PI.from_drive` takes them as they are shown, and whatever else a `PI` takes:

    velocity = ga.PI.from_drive("sinamics", p1460=0.02, p1462=10.0, torque_limit=4.0)
    position = ga.P.from_drive("ax5000", s_0_0104=1.5)
    drive = ga.Cascade(velocity=velocity, position=position, period=125e-6)

The same in a `drive.toml`; what belongs to the motor stands above the first section:

    torque_constant = 0.12       # N m/A
    [controller]
    drive = "el72xx"
    velocity_loop_proportional_gain = 150
    velocity_loop_integral_time = 150
    torque_limit = 2.4           # N m, as without `drive`

kp is in N m s/rad and ki in N m/rad; with an integral time Tn, ki = kp/Tn.
What a source says of the integration rule and of limits is told here and not set: give `rule` and `anti_windup` where the log has
a line for each of the controller's samples.
For a drive that is not here, convert by hand and give kp and ki.
A current times the torque constant is a torque only where both count the ampere alike, as peak or as rms.
"""

DRIVE = """
## {title}: `"{name}"`

{loop}.

| parameter | unit | what the drive calls it |
|---|---|---|
{parameters}
{formulas}
Source: {sources}
"""


def page() -> str:
    """The page's text."""
    return HEAD + "".join(_drive(name, row) for name, row in DRIVES.items())


def _drive(name: str, row: DriveRow) -> str:
    formulas = [f"    kp = {row.kp.text}", f"    ki = {row.ki.text}"]
    if row.position_gain is not None:
        formulas.append(f"    position gain [1/s] = {row.position_gain.text}")
    return DRIVE.format(
        name=name,
        title=row.title,
        loop=row.loop,
        parameters="".join(map(_line, (*row.velocity, *row.position))),
        formulas="\n".join(formulas) + "\n",
        sources=", ".join(f"<{s}>" if s.startswith("http") and " " not in s else s for s in row.sources),
    )


def _line(p: DriveParameter) -> str:
    where = " (in a drive.toml: at the top)" if p.name in CONSTANTS else ""
    return f"| `{p.name}` | {p.unit} | {p.meaning}{where} |\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
