"""Section III-B on the simulated rig: a step, the nominal misfit, the genetic identification, 20 trials, time.

Where the paper leaves something open: the gains are the printed ones (Table III); the loop is digital in the rig and in the
model; the friction is chosen so that the nominal fitness is about the paper's; the ranges are those a user of the paper would
give, around the sheet values.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.identification.identify import identify
from gaident.models.search_space import SearchSpace
from gaident.models.simulate import simulate
from gaident.paper.facts import DT, ERROR_WEIGHT, ORDER_WEIGHT, SAMPLES, STEP, Mechanism
from gaident.paper.rig import Friction, Rig, RigRun, side_by_side
from gaident.results.identification import Identification
from gaident.results.settings import Settings

__all__ = ["FRICTION", "NOISE", "Engine", "StepTest", "rig_of", "step_test"]

Vector = NDArray[np.float64]
Say = Callable[[str], None]

FRICTION = Friction(coulomb=0.07, static=0.09, stribeck_velocity=5.0)  # N m, N m, rad/s
NOISE = 0.3  # of the velocity that the controller reads [rad/s]
SPACE = SearchSpace(gain=(1e3, 2e4), real=(0.0, 60.0), imaginary=(0.0, 250.0), p=(0, 3), q=(0, 3), bits=10)
ENGINES = (("paper", "Settings.paper()", Settings.paper()), ("default", "Settings()", Settings()))
# A run is at the optimum where its error sum is within this factor of the best one known.
AT_OPTIMUM = 1.1


@dataclass(frozen=True)
class Engine:
    """Trials of one engine on one record; every trial has its own seed.

    history: mean over the trials of the best fitness (6) so far, by generation; final: each trial's fitness as reported, after
    the local fits where the engine has them. right: trials with the true (p, q); optimal: those that also reach the optimum.
    seconds: processor time of one trial in one thread, the fastest of three; generations: of that trial.
    """

    key: str
    title: str
    best: Identification
    history: Vector
    final: tuple[float, ...]
    structures: tuple[tuple[int, int], ...]
    right: int
    optimal: int
    seconds: float
    generations: int

    @property
    def trials(self) -> int:
        return len(self.final)


@dataclass(frozen=True)
class StepTest:
    """One mechanism's step on the rig: what Table IV, Fig. 6, 7 and 8 are made of."""

    mechanism: Mechanism
    rig: Rig
    record: Record
    nominal_velocity: Vector
    nominal_fitness: float
    engines: tuple[Engine, ...]
    bilinear: Identification  # the default engine with the paper's model of the loop
    scaled_nominal: float  # fitness of the nominal model on the same rig with the loop gain of Table V
    scaled_final: tuple[float, ...]  # and of the paper's algorithm there, each trial

    def engine(self, key: str) -> Engine:
        return next(e for e in self.engines if e.key == key)


def rig_of(mechanism: Mechanism, friction: Friction = FRICTION) -> Rig:
    """The rig of Table III for one of the two drives."""
    return Rig(mechanism.sheet, mechanism.controller("sampled"), DT, friction, NOISE)


def fitness(rec: Record, velocity: Vector, structure: tuple[int, int]) -> float:
    """Equation (6)."""
    return float(np.sum((ERROR_WEIGHT * (rec.velocity - velocity)) ** 2) + ORDER_WEIGHT * sum(structure))


def step_test(mechanism: Mechanism, trials: int, seed: int, workers: int | None, say: Say) -> StepTest:
    """The paper's experiment: 250 samples of a step of 43.6 rad/s."""
    rig = rig_of(mechanism)
    command = np.full(SAMPLES, STEP)
    scaled = replace(rig, controller=mechanism.scaled_controller("sampled"))
    rec, other = side_by_side(
        [
            RigRun(rig, command, seed, f"step, {mechanism.title}"),
            RigRun(scaled, command, seed, f"step with the loop gain of Table V, {mechanism.title}"),
        ]
    )
    model = mechanism.sheet.model()
    nominal = simulate(model, rec, rig.controller)
    runs: dict[str, list[Identification]] = {}
    for key, title, settings in ENGINES:
        say(f"{mechanism.title}: {trials} trials of {title}")
        runs[key] = [identify(rec, rig.controller, SPACE, settings, seed=seed + k, workers=workers) for k in range(trials)]
    optimum = min(error_sum(idn) for found in runs.values() for idn in found)
    engines = tuple(
        _engine(key, title, runs[key], (model.p, model.q), optimum, _fastest(rec, rig, settings, seed))
        for key, title, settings in ENGINES
    )
    bilinear = identify(rec, mechanism.controller(), SPACE, seed=seed, workers=workers)
    say(f"{mechanism.title}: {trials} trials with the loop gain of Table V")
    found = [identify(other, scaled.controller, SPACE, Settings.paper(), seed=seed + k, workers=workers) for k in range(trials)]
    return StepTest(
        mechanism,
        rig,
        rec,
        nominal,
        fitness(rec, nominal, (model.p, model.q)),
        engines,
        bilinear,
        fitness(other, simulate(model, other, scaled.controller), (model.p, model.q)),
        tuple(idn.fitness for idn in found),
    )


def error_sum(idn: Identification) -> float:
    """Of the reported model's free run, without the penalty."""
    return idn.fitness - ORDER_WEIGHT * (idn.p + idn.q)


def _engine(
    key: str, title: str, found: list[Identification], truth: tuple[int, int], optimum: float, clock: tuple[float, int]
) -> Engine:
    length = max(len(idn.history) for idn in found)
    history = np.array([[*idn.history, *[idn.history[-1]] * (length - len(idn.history))] for idn in found])
    right = [idn for idn in found if (idn.p, idn.q) == truth]
    return Engine(
        key,
        title,
        min(found, key=lambda idn: idn.fitness),
        np.minimum.accumulate(history, axis=1).mean(axis=0),
        tuple(idn.fitness for idn in found),
        tuple((idn.p, idn.q) for idn in found),
        len(right),
        sum(error_sum(idn) < AT_OPTIMUM * optimum for idn in right),
        *clock,
    )


def _fastest(rec: Record, rig: Rig, settings: Settings, seed: int) -> tuple[float, int]:
    """(processor time [s], generations) of the fastest of three runs in one thread: what else the machine does adds to it."""
    clocks = []
    for _ in range(3):
        began = time.process_time()
        idn = identify(rec, rig.controller, SPACE, settings, seed=seed, workers=1)
        clocks.append((time.process_time() - began, idn.trials[0].generations))
    return min(clocks)
