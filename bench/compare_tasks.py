"""The records of compare_methods.py: the simulated rig of the paper, EMPS and CED, each with a part that no method sees."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import io

import gaident as ga
from gaident.paper.experiment import rig_of
from gaident.paper.facts import MECHANISMS, SAMPLES
from gaident.paper.friction import LEVELS, OTHER_LEVELS
from gaident.paper.rig import RigRun, side_by_side

Vector = np.ndarray


@dataclass(frozen=True)
class Task:
    """Fit on `train`, simulate `test` freely from its input alone.

    controller: of the loop that the command went through, None where the torque is the input; `unit` of the error, and the factor
    that brings rad/s or m/s to it. continued: `test` contains `train` at its beginning; only its samples from `first` on count.
    decimation: what black boxes may thin the samples by: one-step prediction of a finely sampled signal teaches them nothing.
    published: (method, figure) as reported elsewhere, copied facts; `note` says what they are.
    """

    name: str
    train: ga.Record
    test: ga.Record
    controller: ga.PI | None
    unit: str
    factor: float
    decimation: tuple[int, ...]
    continued: bool = False
    first: int = 0
    position: bool = False
    published: tuple[tuple[str, str], ...] = ()
    note: str = ""

    def input_of(self, rec: ga.Record) -> Vector:
        """What drives the model."""
        source = rec.torque if self.controller is None else rec.command
        assert source is not None
        return np.asarray(source)


def rig_tasks() -> list[Task]:
    """Two rigs of the paper: trained on reversing steps, tested on other levels and other noise."""
    train, test = np.repeat(LEVELS, SAMPLES), np.repeat(OTHER_LEVELS, SAMPLES)
    rigs = [rig_of(mechanism) for mechanism in MECHANISMS]
    made = side_by_side([RigRun(rig, command, seed) for rig in rigs for command, seed in ((train, 1), (test, 2))])
    return [
        Task(f"rig, {mechanism.words}", made[2 * i], made[2 * i + 1], rigs[i].controller, "rad/s", 1.0, (1, 4, 16))
        for i, mechanism in enumerate(MECHANISMS)
    ]


def emps_tasks(folder: Path) -> list[Task]:
    """EMPS, force to velocity in open loop; test: the file with pulses, which act through the recorded voltage."""

    def record(name: str) -> ga.Record:
        data = io.loadmat(folder / "emps" / name)
        position = data["qm"].ravel()
        force = float(data["gtau"].item()) * data["vir"].ravel()
        return ga.Record(1e-3, torque=force, velocity=ga.differentiate(position, 1e-3, 100.0), position=position, name=name)

    published = (
        ("state space", "5.53 mm"),
        ("best reported", "2.64 mm"),
        ("neural networks", "74 to 220 mm"),
        ("physical model with published parameters", "9.2 mm"),
    )
    note = "published: position error of the open loop on the same test file, ill-conditioned because the axis integrates"
    train, test = record("DATA_EMPS.mat"), record("DATA_EMPS_PULSES.mat")
    return [Task("EMPS", train, test, None, "mm/s", 1e3, (10, 20), position=True, published=published, note=note)]


def ced_tasks(folder: Path) -> list[Task]:
    """CED, voltage to the absolute speed that its sensor shows: first 400 samples train, last 100 test, 4 of them to begin."""
    data = io.loadmat(folder / "ced" / "DATAUNIF.MAT")
    figures = (
        ("linear state space", (0.224, 0.384)),
        ("ARX", (0.291, 0.331)),
        ("polynomial NARX", (0.10, 0.141)),
        ("best reported over both records", (0.115, 0.074)),
        ("grey box with an absolute-value sensor, 5 parameters", (0.165, 0.211)),
    )
    tasks = []
    for k in (0, 1):
        u, z = (data[f"{name}1{k + 1}"].ravel().astype(float) for name in "uz")
        whole = ga.Record(0.02, torque=u, velocity=z, name=f"CED {k + 1}")
        published = tuple((name, f"{values[k]:g}") for name, values in figures)
        note = "the sensor loses the sign of the speed, which no effect of the library does"
        options = {"continued": True, "first": 404, "published": published, "note": note}
        tasks.append(Task(whole.name, whole[:400], whole, None, "ticks/s", 1.0, (1,), **options))
    return tasks


def all_tasks() -> list[Task]:
    """Those whose data are there."""
    tasks = rig_tasks()
    named = os.environ.get("GAIDENT_DATA")
    makers: list[tuple[str, Callable[[Path], list[Task]]]] = [("emps", emps_tasks), ("ced", ced_tasks)]
    for name, make in makers:
        if named and (Path(named) / name).is_dir():
            tasks += make(Path(named))
    return tasks
