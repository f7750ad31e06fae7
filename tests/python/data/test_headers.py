"""Which column is which channel, by headers as drives and tools write them; in doubt none, never another quantity."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.cli import main
from gaident.data.guess import Guess, guess_channels
from gaident.data.listing import ColumnInfo

# Columns of a trace, the time aside -> what is taken for (command, velocity, torque, position, position_command).
HEADERS: dict[str, tuple[str | None, ...]] = {
    # German
    "Drehzahlsollwert [1/min];Drehzahlistwert [1/min];Drehmomentsollwert [%]": ("c", "v", "t"),
    "n_soll [1/min];n_ist [1/min] (geglättet);M_ist [%]": ("c", "v", "t"),
    "Drehzahlsollwert [1/min]": ("c",),
    "Lagesollwert;Lageistwert;Stromistwert": ("pc", "p", "t"),
    "r62: Drehzahlsollwert nach Filter;r63: Drehzahlistwert geglättet;r80: Momentenistwert": ("c", "v", "t"),
    "Solldrehzahl;Istdrehzahl;Sollmoment": ("c", "v", "t"),
    "Geschwindigkeitssollwert;Geschwindigkeitsistwert;Kraftsollwert": ("c", "v", "t"),
    "Drehzahl-/Geschwindigkeitsistwert Motor;Momenten-/Kraft-Sollwert (begrenzt)": ("v", "t"),
    "S-0-0036 Drehzahl-Sollwert;S-0-0040 Drehzahl-Istwert;S-0-0084 Drehmoment-Istwert": ("c", "v", "t"),
    "v_soll;v_ist;Schleppfehler;I_ist": ("c", "v", None, "t"),
    # English
    "r0062 Speed setpoint after filter;r0063 Speed actual value;r0080 Torque actual value": ("c", "v", "t"),
    "S-0-0047 Position command value;S-0-0051 Position feedback value;S-0-0084 Torque feedback value": ("pc", "p", "t"),
    "S-0-0036 Velocity command value;S-0-0040 Velocity feedback value": ("c", "v"),
    "Motor speed;Speed command;Torque command": ("v", "c", "t"),
    "Servo motor speed [r/min];Speed command [r/min];Torque [%];Droop pulses": ("v", "c", "t", None),
    "Feedback speed [r/min];Reference speed [r/min];Torque reference [%]": ("v", "c", "t"),
    "Velocity demand value;Velocity actual value averaged;Torque actual value averaged": ("c", "v", "t"),
    "Position demand value [inc];Position actual value [inc];Current actual value": ("pc", "p", "t"),
    "Target velocity;Actual velocity;Actual torque": ("c", "v", "t"),
    "Act. Velocity;Ref. Velocity;Act. Current": ("v", "c", "t"),
    "Velocity setpoint controller input (64 bit);Speed / velocity act. Value motor (32 bit);Following Error (64 bit)": (
        *("c", "v"),
        None,
    ),
    # names in programs
    "Axis1.SetVelo;Axis1.ActVelo;Axis1.ActTorque": ("c", "v", "t"),
    "fSetVelo;fActVelo;fActTorque": ("c", "v", "t"),
    "lrSetVelocity;lrActVelocity;lrActTorque": ("c", "v", "t"),
    "MC_Velocity.Setpoint;MC_Velocity.Actual": ("c", "v"),
    "axis0.controller.vel_setpoint;axis0.encoder.vel_estimate;axis0.controller.torque_setpoint": ("c", "v", "t"),
    "axis0.controller.input_vel;axis0.encoder.vel_estimate": (None, "v"),
    "velocity_setpoint;velocity_estimate;Iq_measured": ("c", "v", "t"),
    "joint.0.motor-pos-cmd;joint.0.motor-pos-fb;joint.0.torque": ("pc", "p", "t"),
    "VelCmd;VelFbk;TrqCmd": ("c", "v", "t"),
    "PosRef;PosFbk;IqRef": ("pc", "p", "t"),
    "PCMD;PFB;VCMD;VFB;ICMD": ("pc", "p", "c", "v", "t"),
    "speed_ref_rpm;speed_rpm;torque_Nm": ("c", "v", "t"),
    "omega_ref;omega_m;T_e": ("c", "v", None),
    "w_ref;w;M": ("c", "v", "t"),
    "r;w;u": ("c", "v", "t"),
    "q;qd;tau": ("p", "v", "t"),
    # French, Italian, Spanish, romanised Japanese
    "consigne de vitesse [tr/min];vitesse mesurée [tr/min];couple [Nm]": ("c", "v", "t"),
    "velocità di riferimento;velocità attuale;coppia": ("c", "v", "t"),
    "velocidad de consigna;velocidad real;par": ("c", "v", "t"),
    "sokudo shirei;sokudo;toruku": ("c", "v", "t"),
    # what is no channel, or open
    "Lagesollwert;Drehzahlvorsteuerung;Stromistwert": ("pc", None, "t"),
    "Iq setpoint;Speed feedforward;Actual speed": ("t", None, "v"),
    "Speed 1;Speed 2;Torque": (None, None, "t"),
    "Acceleration;Jerk;Temperature": (None, None, None),
}
CHANNELS = {"c": "command", "v": "velocity", "t": "torque", "p": "position", "pc": "position_command"}


@pytest.mark.parametrize("header", HEADERS)
def test_a_header_says_the_channels(header: str, tmp_path: Path) -> None:
    names = header.split(";")
    rng = np.random.default_rng(1)
    rows = "\n".join(";".join(f"{x:.4f}" for x in (1e-3 * k, *rng.normal(size=len(names)))) for k in range(30))
    (tmp_path / "log.csv").write_text(f"Time [s];{header}\n{rows}\n", encoding="utf-8")
    found = guess_channels(ga.columns(tmp_path / "log.csv")).channels
    expected = {CHANNELS[key]: name for key, name in zip(HEADERS[header], names, strict=True) if key is not None}
    assert {channel: column.name for channel, column in found.items()} == expected


SAMPLES = Path(__file__).parents[1] / "support" / "samples" / "headers.txt"
TOOLS = [
    "SINAMICS", "TwinCAT", "IndraWorks", "MR Configurator2", "SigmaWin+", "EPOS Studio", "ODrive", "LinuxCNC", "CODESYS",
    "dSPACE", "ROS", "Heidenhain", "German", "French", "Italian", "Spanish", "romanised Japanese", "the time",
]  # fmt: skip


def headers_of(tool: str) -> list[tuple[str, ...]]:
    """(header, channel, kind of a torque, unit) of one tool, as the sample file lists them."""
    section = SAMPLES.read_text(encoding="utf-8").partition(f"\n## {tool}")[2].partition("\n## ")[0]
    return [tuple(cell.strip() for cell in line.rsplit("|", 3)) for line in section.splitlines()[1:] if line]


def test_the_sample_holds_hundreds_of_headers() -> None:
    listed = [header for tool in TOOLS for header in headers_of(tool)]
    lines = [line for line in SAMPLES.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    assert len(listed) == len(lines) > 400 and len({row[0] for row in listed}) > 400


def looked_at(header: str, is_time: bool, folder: Path) -> tuple[ColumnInfo, Guess]:
    """The column of a log that contains it alone, beside a time, and what is taken for what."""
    head = f"{header};a" if is_time else f"Time [s];{header}"
    rows = "".join(f"{k};{np.sin(k):.4f}\n" for k in range(30))
    (folder / "log.csv").write_text(f"{head}\n{rows}", encoding="utf-8")
    listing = ga.columns(folder / "log.csv")
    return listing.columns[0 if is_time else 1], guess_channels(listing)


@pytest.mark.parametrize("tool", TOOLS)
def test_headers_of_drives_and_tools(tool: str, tmp_path: Path) -> None:
    """Each by itself: its channel, what kind of torque it is, its unit; where only the user knows, it is asked for."""
    rows = headers_of(tool)
    assert len(rows) >= 10
    for header, channel, kind, unit in rows:
        column, guess = looked_at(header, channel == "time", tmp_path)
        assert (column.unit or "-") == unit, header
        if channel == "time":
            assert column.is_time, header
            continue
        taken = {name: c.name for name, c in guess.channels.items()}
        assert taken == ({} if channel in "-?" else {channel: column.name}), header
        if channel == "?":
            assert any(column in open_ for open_ in guess.undecided.values()), header
        if channel == "torque":
            assert (column.torque_is or "-") == kind, header


def test_what_only_the_user_knows_is_marked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rows = "".join(f"{k};{np.sin(k):.4f};{np.cos(k):.4f}\n" for k in range(30))
    Path("log.csv").write_text(f"time_ms;axis0.controller.input_vel;tau_J_d\n{rows}")
    assert main(["init", "log.csv"]) == 0
    marked = [line for line in Path("drive.toml").read_text().splitlines() if "FILL IN" in line and line.startswith("# ")]
    assert any(line.startswith("# velocity") and '"axis0.controller.input_vel"?' in line for line in marked)
    assert any(line.startswith("# torque") and '"tau_J_d"?' in line for line in marked)


def test_init_keeps_a_german_position_and_its_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rows = "".join(f"{k};{np.sin(k):.4f};{np.sin(k - 0.1):.4f};{np.cos(k):.4f}\n" for k in range(30))
    Path("log.csv").write_text(f"t/ms;x_soll [mm];x_ist [mm];F_ist [N]\n{rows}")
    assert main(["init", "log.csv"]) == 0
    text = Path("drive.toml").read_text()
    for line in ('position_command = "x_soll [mm]"', 'position = "x_ist [mm]"', 'torque = "F_ist [N]"', 'axis = "linear"'):
        assert line in text


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("n_ist [1/min] (geglättet)", "1/min"),
        ("vitesse [tr/min]", "tr/min"),
        ("speed_rpm", "rpm"),
        ("torque_Nm", "Nm"),
        ("Speed rad/s", "rad/s"),
        ("pos_cmd_deg", "deg"),
        ("theta-rad", "rad"),
        ("x_act_mm", "mm"),
        ("vel_rad_s", "rad/s"),
        ("vel_deg_per_s", "deg/s"),
        ("v_m_s", "m/s"),
        ("PosAct/mm", "mm"),
        ("IqAct/A", "A"),
        ("Axis1/Speed", None),
        ("feed mm_min", "mm/min"),
        ("omega_radps", "rad/s"),
        ("torque_pct", "%"),
        ("enc_counts", "counts"),
        ("i_a", None),
        ("deg", None),
        ("Torque [% of rated torque]", "% of rated torque"),
        ("M [‰]", "‰"),
        ("turn count", None),
        ("w_m", None),
        ("axis[0]", None),
    ],
)
def test_a_unit_in_the_name(name: str, unit: str | None, tmp_path: Path) -> None:
    rows = "".join(f"{k};{np.sin(k):.4f}\n" for k in range(30))
    (tmp_path / "log.csv").write_text(f"t;{name}\n{rows}", encoding="utf-8")
    assert ga.columns(tmp_path / "log.csv").columns[1].unit == unit


def test_a_unit_in_the_name_of_an_array_and_what_init_makes_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No unit is asked for that the name says; it is read in that unit."""
    monkeypatch.chdir(tmp_path)
    t = 1e-3 * np.arange(400)
    angle = 90.0 * np.sin(6.0 * t)
    np.savez("log.npz", time=t, pos_cmd_deg=np.roll(angle, -2), pos_deg=angle)
    assert main(["init", "log.npz"]) == 0
    text = Path("drive.toml").read_text()
    assert 'position_command = "deg"' in text and 'position = "deg"' in text
    rec = ga.read("log.npz", columns={"position": "pos_deg", "position_command": "pos_cmd_deg"})
    assert rec.position is not None and rec.position == pytest.approx(np.radians(angle))


def test_per_mille_of_the_rated_torque(tmp_path: Path) -> None:
    rows = "".join(f"{k};{k};{10 * k}\n" for k in range(30))
    (tmp_path / "log.csv").write_text(f"t_ms;w_rpm;M [‰]\n{rows}", encoding="utf-8")
    rec = ga.read(tmp_path / "log.csv", columns={"velocity": "w_rpm", "torque": "M [‰]"}, rated_torque=2.4)
    assert rec.torque is not None and rec.torque[10] == pytest.approx(0.24)
