"""How a log is written: names of columns, commas of two meanings, letters of 16 bits; what is read of it.

What a header leaves open has to stay open, and a file of two meanings has to be refused.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga
from gaident.data.guess import guess_channels

__all__ = ["headers", "header_read"]

ROWS = 60
CHANNELS = {"c": "command", "v": "velocity", "t": "torque", "p": "position", "pc": "position_command"}
NAMES: dict[str, str] = {
    "Solldrehzahl;Istdrehzahl;Sollmoment": "c v t",
    "Lagesollwert;Lageistwert;Stromistwert": "pc p t",
    "Speed command [rpm];Speed feedback [rpm];Torque [Nm]": "c v t",
    "Axis1.SetVelo;Axis1.ActVelo;Axis1.ActTorque": "c v t",
    "w_ref;w;M": "c v t",
    "r;w;u": "c v t",
    "q;qd;tau": "p v t",
    "pid.x.output;pid.x.velocity": "- v",
    "a [rad/s];b [Nm];c [rad]": "v t p",
    "x soll [rpm];x ist [rpm];position [Nm]": "c v -",
    "position command;speed command value;speed [rad/s]": "pc c v",
    "speed;w [rad/s];M": "- v t",
    "arm.n.value;arm.M": "- t",
    "Solldrehwert;Drehzahlist;Stromsoll": "- v t",
    "Lagesollwert;Drehzahlvorsteuerung;Stromistwert": "pc - t",
    "Position command velocity [rpm];Motor speed [rpm]": "- v",
    "Speed 1;Speed 2;Torque": "- - t",
    "Acceleration;Jerk;Temperature": "- - -",
    "Following error;Motor load;Drive status": "- - -",
}
"""Header -> the channel of each column, or none."""


def named(rng: np.random.Generator, header: str) -> Result:
    """What is taken for which channel."""
    columns = header.split(";")
    rows = "\n".join(";".join(f"{x:.4f}" for x in (1e-3 * k, *rng.normal(size=len(columns)))) for k in range(ROWS))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_text(f"Time [s];{header}\n{rows}\n", encoding="utf-8")
        listing = ga.columns(path)
        found = guess_channels(listing)
    places = {column.name: n for n, column in enumerate(listing.columns)}
    taken = {channel: places[column.name] for channel, column in found.channels.items()}
    truth = {CHANNELS[k]: n for n, k in enumerate(NAMES[header].split(), 1) if k != "-"}
    wrong = {k: n for k, n in taken.items() if truth.get(k) != n}
    called = "right" if taken == truth else "wrong" if wrong else "missed"
    return Result(called, ", ".join(f"{k} {n}" for k, n in sorted(taken.items())), digest(sorted(found.undecided)))


def commas(rng: np.random.Generator, numbers: int, decimals: float, names: int) -> Result:
    """Rows of commas: so many numbers, of which a share has a decimal comma; columns that the header names."""
    lines = []
    for k in range(ROWS):
        row = [str(k), *(str(v) for v in rng.integers(100, 999, numbers - 1))]
        split = [f"{v},{rng.integers(10, 99)}" if n and rng.random() < decimals else v for n, v in enumerate(row)]
        lines.append(",".join(split))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_text(",".join("abcdef"[:names]) + "\n" + "\n".join(lines) + "\n")
        try:
            width = len(ga.columns(path).columns)
        except ga.GaidentError as refusal:
            return Result("right" if decimals else "false alarm", "refused", digest(type(refusal).__name__))
    return Result("missed" if decimals else "right", f"{width} columns", "")


def letters(rng: np.random.Generator, order: str, foreign: int) -> Result:
    """A text of 16 bits a letter without a mark at its start, with so many letters beyond Latin in its header."""
    title = "".join(chr(int(c)) for c in rng.integers(0x3041, 0x3090, foreign))
    rows = "\n".join(f"{1e-3 * k:.4f};{x:.4f};{0.1 * x:.4f}" for k, x in enumerate(rng.normal(size=ROWS)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_bytes(f"Time [s];w [rad/s];M [Nm] {title}\n{rows}\n".encode(order))
        try:
            found = guess_channels(ga.columns(path))
        except ga.GaidentError as refusal:
            return Result("refused", type(refusal).__name__, "")
    return Result("right" if set(found.channels) == {"velocity", "torque"} else "missed", ", ".join(found.channels), "")


MAKERS: dict[str, Callable[[np.random.Generator], Result]] = {
    **{f"named/{header}": lambda g, h=header: named(g, h) for header in NAMES},
    **{f"commas/{n}/{d:g}/{k}": lambda g, n=n, d=d, k=k: commas(g, n, d, k)
       for n, d, k in ((3, 0.0, 3), (3, 1.0, 3), (3, 0.03, 3), (3, 0.08, 3), (3, 0.15, 3), (3, 0.5, 3), (3, 0.9, 5))},
    **{f"letters/{order}/{n}": lambda g, o=order, n=n: letters(g, o, n)
       for order in ("utf-16-le", "utf-16-be") for n in (0, 20, 40, 90)},
}  # fmt: skip
"""Name -> what draws such a log and says what came of it."""


def headers(count: int, seed: int) -> list[Case]:
    return [Case("headers", f"{name}/{seed}/{n}", name, n + 1000 * seed) for n in range(count) for name in MAKERS]


def header_read(case: Case) -> Result:
    return MAKERS[case.what](np.random.default_rng([case.number, len(case.what)]))
