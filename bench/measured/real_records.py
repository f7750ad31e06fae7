"""The measured records of bench/real.py: a table of what they are, how they are cut, and what is known about them.

Sources and licences stand in the README of the recorded data (`GAIDENT_DATA`) and in docs/diagnosis.md.
A case is a drive, a variation of its record, and the truth: groups of effect names of which each has to be found,
or None where the record decides nothing. What may stand beside them is in `allowed`.
"""

from __future__ import annotations

import csv
import os
import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import gaident as ga

Vector = NDArray[np.float64]

FRICTION = frozenset(
    {"coulomb_friction", "stribeck_friction", "asymmetric_friction", "presliding_friction", "lugre_friction",
     "position_friction", "friction_drift", "load_dependent_friction", "square_root_drag"}
)  # fmt: skip
GRAVITY = frozenset({"unbalance"})
LOAD = frozenset({"load_torque"})

EMPS_GAIN = 35.15065188248547  # N/V
JOINT_GAINS = {1: 10.0, 2: 10.6956, 6: 10.1232}  # N m/A
ACTUATOR_GAINS = {1: 1.0, 2: 1.0, 3: 0.8, 4: 0.8}  # N m s/rad
ACTUATOR_RANGE = 25.0  # of the position's counter, in its own unit
ACTUATOR_POSITION = {1: 1.0, 2: 1.0, 3: 0.5, 4: 0.5}  # rad per unit: at every held speed of 3 and 4 it moves 1.99 times as fast
EPOS_TORQUE = 9.84e-3  # N m, at 100 %
RPM = np.pi / 30.0
TRAINING = 0.7


class Parts(NamedTuple):
    """What is fitted, what is held out, and which data the second is."""

    training: list[ga.Record]
    held_out: list[ga.Record]
    held: str


@dataclass(frozen=True)
class Drive:
    """One row: `load(**arguments)` gives the records that are fitted and, where there are some, those that validate."""

    load: Callable[..., tuple[list[ga.Record], list[ga.Record]]]
    arguments: Mapping[str, Any]
    variations: tuple[str, ...]
    truth: tuple[frozenset[str], ...] | None
    allowed: frozenset[str] = LOAD
    axis: str = "rotary"
    controller: ga.PI | None = None
    split: float = TRAINING


@dataclass(frozen=True)
class Case:
    drive: str
    variation: str

    @property
    def key(self) -> str:
        return f"{self.drive}/{self.variation}"

    @property
    def row(self) -> Drive:
        return DRIVES[self.drive]


def data_folder() -> Path:
    """The folder of recorded data. Raises FileNotFoundError with the remedy."""
    path = Path(os.environ.get("GAIDENT_DATA", ""))
    if "GAIDENT_DATA" not in os.environ or not path.is_dir():
        raise FileNotFoundError("set GAIDENT_DATA to the folder of recorded data")
    return path


def emps(file: str, validation: str | None = None) -> tuple[list[ga.Record], list[ga.Record]]:
    def one(name: str) -> ga.Record:
        columns = {"torque": "vir", "position": "qm", "time": "t"}
        return ga.read(data_folder() / "emps" / f"{name}.mat", columns, {"torque": EMPS_GAIN}, name=name)

    return [one(file)], [] if validation is None else [one(validation)]


def hsm150(channel: int) -> tuple[list[ga.Record], list[ga.Record]]:
    from scipy.io import loadmat

    kind = "measured" if channel == 5 else "commanded"

    def one(name: str) -> ga.Record:
        log = loadmat(data_folder() / "hsm150" / f"idf_{name}.mat")["data"].T
        return ga.Record(1e-3, velocity=log[3], torque=log[channel], position=log[2], torque_is=kind, name=name)

    return [one(path.stem.removeprefix("idf_")) for path in sorted((data_folder() / "hsm150").glob("*.mat"))], []


def joint(number: int) -> tuple[list[ga.Record], list[ga.Record]]:
    path = data_folder() / "robot_joints" / f"joint_{number}.csv"
    columns = {name: name for name in ("time", "position", "velocity")} | {"torque": "current"}
    return [ga.read(path, columns, {"torque": JOINT_GAINS[number]}, resample=0.01, torque_is="measured", name=path.stem)], []


def actuator(motor: int, run: int) -> tuple[list[ga.Record], list[ga.Record]]:
    """Its irregular log on the even axis of its usual step; the position starts again after its range and is continued."""
    log = dict(np.load(data_folder() / "joint_actuators" / f"motor_{motor:02d}_run_{run:02d}.npz"))
    from gaident.data.signals.resampling import resampled

    log["position"] = ACTUATOR_POSITION[motor] * np.unwrap(log["position"], period=ACTUATOR_RANGE)

    dt = round(float(np.median(np.diff(log["time"]))), 4)
    channels = {"command": "velocity_cmd", "velocity": "velocity", "torque": "torque_feedback", "position": "position"}
    logged = resampled("log", {name: (log["time"], log[column]) for name, column in channels.items()}, dt)
    return [ga.Record(dt, **logged, torque_is="measured", name=f"motor {motor}, run {run}")], []


def _cell(text: str) -> float:
    """A number of an EPOS log; where its authors put another one, "-800,,was -11.1", the one that was logged."""
    logged = re.search(r"was\s*(-?[\d.]+)", text) or re.match(r"\s*(-?\d+(?:\.\d+)?)", text)
    if logged is None:
        raise ValueError(f"{text!r} is no number of an EPOS log")
    return float(logged[1])


def epos(drive: int) -> tuple[list[ga.Record], list[ga.Record]]:
    """The steady speeds of the sample time that most logs have; every third of them is held out."""
    found = []
    for path in sorted((data_folder() / "epos_screws" / "experiments" / f"driveNo{drive}" / "steady_state").rglob("*.csv")):
        lines = [x.replace(",", ".") for x in path.read_text(encoding="latin1").splitlines() if re.match(r"^-?[\d.,]+;", x)]
        cells = [[_cell(cell) for cell in row[:3]] for row in csv.reader(lines, delimiter=";")]
        time, speed, torque = np.array(cells).T
        dt = round(float(np.median(np.diff(time))) * 1e-3, 6)
        found.append(
            ga.Record(dt, velocity=speed * RPM, torque=torque / 100.0 * EPOS_TORQUE, torque_is="measured", name=path.stem)
        )
    (usual, _), *_ = Counter(r.dt for r in found).most_common(1)
    same = [r for r in found if r.dt == usual]
    return [r for i, r in enumerate(same) if i % 3 != 2], same[2::3]


def ced(record: int) -> tuple[list[ga.Record], list[ga.Record]]:
    from scipy.io import loadmat

    data = loadmat(data_folder() / "ced" / "DATAUNIF.MAT")
    z, u = (data[f"{name}{record}"].ravel().astype(float) for name in "zu")
    return [ga.Record(0.02, velocity=z, torque=u, name=f"ced {record}")], []


def rack() -> tuple[list[ga.Record], list[ga.Record]]:
    path = data_folder() / "rack_pinion" / "a3MR.csv"
    log = np.genfromtxt(path, delimiter=",", skip_header=5, usecols=(0, 1, 2), encoding="latin1")
    log = log[np.isfinite(log).all(axis=1)]
    dt = round(float(np.median(np.diff(log[:, 0]))) * 1e-3, 7)
    return [ga.Record(dt, velocity=log[:, 1] * RPM, torque=log[:, 2] / 100.0, name="a3MR")], []


WINDOWS = ("0:12400", "3000:15400", "6200:18600", "9300:21700", "12400:24841")
VARIED = ("whole", "first half", "second half", "decimated 2", "decimated 4", "velocity noise 1 %", "torque noise 5 %")
FEW = ("whole",)

DRIVES: dict[str, Drive] = {
    "emps": Drive(emps, {"file": "DATA_EMPS", "validation": "DATA_EMPS_PULSES"}, FEW, (FRICTION,), axis="linear"),
    "emps window": Drive(emps, {"file": "DATA_EMPS"}, WINDOWS, (FRICTION,), axis="linear"),
    "emps pulses": Drive(emps, {"file": "DATA_EMPS_PULSES"}, FEW, (FRICTION,), axis="linear"),
    "joint 1": Drive(joint, {"number": 1}, VARIED, (FRICTION,)),
    "joint 2": Drive(joint, {"number": 2}, VARIED, (FRICTION, GRAVITY)),
    "joint 6": Drive(joint, {"number": 6}, VARIED, (FRICTION,)),
    "hsm150 measured": Drive(hsm150, {"channel": 5}, FEW, (FRICTION,)),
    "hsm150 commanded": Drive(hsm150, {"channel": 4}, FEW, (FRICTION,)),
    **{
        f"actuator {m}": Drive(actuator, {"motor": m, "run": 1}, FEW, (FRICTION,), controller=ga.PI(k, 0.0, loop="continuous"))
        for m, k in ACTUATOR_GAINS.items()
    },
    **{f"epos {d}": Drive(epos, {"drive": d}, FEW, (FRICTION,)) for d in (1, 2, 3)},
    **{f"ced {r}": Drive(ced, {"record": r}, FEW, None, allowed=frozenset(), split=0.8) for r in (11, 12)},
    "rack and pinion": Drive(rack, {}, FEW, None, allowed=frozenset({"quadratic_drag"})),
}


FOLDERS: dict[Callable[..., Any], str] = {
    emps: "emps",
    hsm150: "hsm150",
    joint: "robot_joints",
    actuator: "joint_actuators",
    epos: "epos_screws",
    ced: "ced",
    rack: "rack_pinion",
}
"""Where each loader reads."""


def missing(case: Case) -> str:
    """Which folder of data the case lacks here, in words; "" where it is there."""
    if not os.environ.get("GAIDENT_DATA"):
        return "GAIDENT_DATA does not name a folder of recorded data"
    folder = Path(os.environ["GAIDENT_DATA"]) / FOLDERS[case.row.load]
    return "" if folder.is_dir() else f"no recorded data: {folder} does not exist"


def cases() -> list[Case]:
    """Every case, in the order of the table."""
    return [Case(name, variation) for name, drive in DRIVES.items() for variation in drive.variations]


@lru_cache(maxsize=2)
def _loaded(name: str) -> tuple[tuple[ga.Record, ...], tuple[ga.Record, ...]]:
    training, validation = DRIVES[name].load(**DRIVES[name].arguments)
    return tuple(training), tuple(validation)


def parts_of(case: Case) -> Parts:
    """The records of a case, divided. A variation acts on the whole record, before it is divided."""
    training, validation = _loaded(case.drive)
    varied = [vary(r, case.variation) for r in training]
    if validation:
        return Parts(varied, [vary(r, case.variation) for r in validation], "validation records")
    divided = [divide(r, case.row.split) for r in varied]
    return Parts([a for a, _, _ in divided], [b for _, b, _ in divided], divided[0][2])


def vary(rec: ga.Record, variation: str) -> ga.Record:
    """One of the variations: a window, a half, every nth sample behind a low-pass, or noise of a share of the channel's rms."""
    if variation == "whole":
        return rec
    if ":" in variation:
        first, last = map(int, variation.split(":"))
        return rec[first:last]
    if variation.endswith("half"):
        middle = len(rec) // 2
        return rec[:middle] if variation.startswith("first") else rec[middle:]
    if variation.startswith("decimated"):
        return rec.decimate(int(variation.split()[1]))
    channel, _, share, _ = variation.split()
    values = getattr(rec, channel)
    noise = float(share) / 100.0 * float(np.std(values)) * np.random.default_rng(1).standard_normal(len(rec))
    return rec.with_channels(**{channel: values + noise})


def divide(rec: ga.Record, share: float) -> tuple[ga.Record, ga.Record, str]:
    """The first `share` of the time and the rest; where the rest hardly moves, of the path, so that it does."""
    at, how = round(share * len(rec)), f"the last {100 * (1 - share):.0f} % of the time"
    rms = float(np.sqrt(np.mean(rec.velocity[:at] ** 2)))
    if float(np.sqrt(np.mean(rec.velocity[at:] ** 2))) < rms / 3.0:
        path = np.cumsum(np.abs(rec.velocity))
        at, how = int(np.searchsorted(path, share * path[-1])), f"the last {100 * (1 - share):.0f} % of the path"
    return rec[:at], rec[at:], how
