"""gaident demo: the main jobs on simulated two-mass drives, and on a measured axis where there is one."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gaident.control.pi import PI
from gaident.data.readers import read
from gaident.data.record import Record
from gaident.diagnosis.diagnose import diagnose
from gaident.identification.identify import identify
from gaident.models.mechanics import TwoMass
from gaident.models.simulate import run, simulate
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification

__all__ = [
    "CONTROLLER",
    "DIGITAL",
    "FRICTION",
    "FRICTION_STORY",
    "FRICTION_TRUTH",
    "HIDDEN",
    "TRUTH",
    "diagnose_friction",
    "emps_path",
    "identify_emps",
    "identify_two_masses",
]

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

DIGITAL = PI(kp=CONTROLLER.kp, ki=CONTROLLER.ki)
FRICTION = 0.04  # N m, Coulomb
HIDDEN = {"coulomb_friction": {"torque": FRICTION}}
"""What the drive of the second part has beside its masses: effect -> parameters."""
LEVELS = (3.0, -3.0, 20.0, -20.0, 8.0, -8.0, 50.0, -50.0, 1.0, -1.0, 35.0, -35.0)  # rad/s
DWELL, CHIP = 250, 9  # samples of a level, of one value of the dither
DITHER = 2.0  # rad/s
LOOP_NOISE = 0.1  # rad/s

FRICTION_STORY = f"""\
The same drive with a digital controller and a dry friction that nobody has told the model of: levels
with reversals, noise of {LOOP_NOISE} rad/s inside the loop. What does a linear model get wrong, and why?
"""
FRICTION_TRUTH = f"""\
The truth: a dry friction of {FRICTION} N m, an inertia of {TRUTH.J:.4g} kg m^2, a viscous friction of {TRUTH.D:.4g} N m s/rad."""

EMPS_STORY = "A ball-screw axis, measured (EMPS, Janot, Gautier and Brunot 2019; m, m/s, N, kg)"
EMPS_TRUTH = """\
Published for this axis: a mass of 95.1 kg and a dry friction of 20.4 N. The friction, which no linear model
contains, biases the mass found here; the falsified verdict says so without knowing the truth."""
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


def friction_record(seed: int, order: int = 1) -> Record:
    """Levels with reversals and dither, forwards (order 1) or backwards (-1), of the drive with hidden friction.

    The controller acts on r - (w + noise) = (r - noise) - w: noise inside the loop is a command r - noise, and a logged
    velocity w + noise.
    """
    rng = np.random.default_rng([seed, order % 3])
    command = np.repeat(LEVELS[::order], DWELL)
    dither = np.repeat(rng.choice([-DITHER, DITHER], len(command) // CHIP + 1), CHIP)[: len(command)]
    command = command + dither * (np.arange(len(command)) // DWELL % 2)
    noise = LOOP_NOISE * rng.standard_normal(len(command))
    disturbed = Record(SAMPLE_TIME, command=command - noise, velocity=np.zeros(len(command)))
    model = TRUTH.model()
    for effect, parameters in HIDDEN.items():
        model = model.with_effect(effect, **parameters)
    done = run(model, disturbed, DIGITAL)
    return Record(SAMPLE_TIME, command=command, velocity=done.velocity + noise, torque=done.torque, name="levels")


def diagnose_friction(seed: int, progress: Progress) -> tuple[Record, Diagnosis]:
    """The record of the drive with hidden friction and its diagnosis, judged on a second record that no fit sees."""
    rec = friction_record(seed)
    return rec, diagnose(rec, DIGITAL, validation=friction_record(seed, -1), seed=seed, progress=progress)


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
