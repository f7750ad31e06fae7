"""gaident demo: the main job on a simulated two-mass drive, and on a measured axis where there is one."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gaident.data.readers import read
from gaident.data.record import Record
from gaident.identification.identify import identify
from gaident.identification.result import Identification
from gaident.models.controller import PI
from gaident.models.mechanics import TwoMass
from gaident.models.simulate import simulate

__all__ = ["CONTROLLER", "TRUTH", "emps_path", "identify_emps", "identify_two_masses"]

Progress = Callable[[float, str], None] | None

# Table III of the paper: the robot arm with a flexible joint and its velocity controller.
TRUTH = TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59)
CONTROLLER = PI(kp=0.0232, ki=1.367, loop="continuous")
SAMPLE_TIME = 0.444e-3  # s
SAMPLES = 250
STEP = 43.6  # rad/s
NOISE = 0.3  # rad/s

STORY = f"""\
A two-mass drive, simulated: the robot arm of the paper's Table III, a step of {STEP} rad/s through its PI
loop, {SAMPLES} samples of {1e3 * SAMPLE_TIME} ms, noise {NOISE} rad/s. What is found in this record:
"""

EMPS_STORY = "A ball-screw axis, measured (EMPS, Janot, Gautier and Brunot 2019; m, m/s, N, kg)"
EMPS_TRUTH = """\
Published for this axis: a mass of 95.1 kg and a dry friction of 20.4 N. The friction, which no linear model
holds, bends the mass found here; the falsified verdict says so without knowing the truth."""
EMPS_FORCE = 35.15065188248547  # N/V, of the data set's authors: force = EMPS_FORCE * vir
EMPS_CUTOFF = 100.0  # Hz, theirs too


def two_mass_record(seed: int) -> Record:
    """A velocity step through the PI loop, with white noise on the measured velocity."""
    still = Record(SAMPLE_TIME, command=np.full(SAMPLES, STEP), velocity=np.zeros(SAMPLES), name="velocity step")
    noise = NOISE * np.random.default_rng(seed).standard_normal(SAMPLES)
    velocity = simulate(TRUTH, still, CONTROLLER) + noise
    return Record(SAMPLE_TIME, command=still.command, velocity=velocity, name=still.name)


def identify_two_masses(seed: int, progress: Progress, workers: int | None) -> tuple[Record, Identification]:
    """The simulated record and what is found in it."""
    rec = two_mass_record(seed)
    return rec, identify(rec, controller=CONTROLLER, seed=seed, workers=workers, progress=progress)


def emps_path() -> Path | None:
    """The EMPS record below the folder that GAIDENT_DATA names; None where there is none."""
    folder = os.environ.get("GAIDENT_DATA")
    path = Path(folder) / "emps" / "DATA_EMPS.mat" if folder else None
    return path if path is not None and path.is_file() else None


def identify_emps(path: Path, seed: int, progress: Progress, workers: int | None) -> tuple[Record, Identification]:
    """The measured ball-screw axis, from force to velocity (linear: m, m/s, N, kg)."""
    columns: dict[str, Any] = {"torque": "vir", "position": "qm", "time": "t"}
    rec = read(path, columns, {"torque": EMPS_FORCE}, velocity_cutoff_hz=EMPS_CUTOFF, name="EMPS")
    return rec, identify(rec, seed=seed, workers=workers, progress=progress)
