"""A proposal simulated with all effects of the model: limit cycles, stick-slip, limits that are reached.

The command is a step to a speed and back to rest, then a slow speed; under a position controller the angle that goes with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.models.effects import Effect
from gaident.models.effects_linear import LINEAR
from gaident.models.model import Model
from gaident.models.simulate import Run, run
from gaident.policy.table import POLICY
from gaident.results.retuning import LoopFigures

__all__ = ["mendable", "simulated_with", "without_each"]

Vector = NDArray[np.float64]

SETTLING_TIMES = 6.0  # no decision: a formula: of a part of the command, so that a step has settled in its first half
SHORTEST, LONGEST = 200, 4000  # no decision: memory: samples of a part
STANDS = 0.05  # no decision: a formula: of a slow command; a lower speed is standstill


@dataclass(frozen=True, eq=False)
class _Tried:
    """A run: parts of `part` samples at a speed, at rest, at rest, at a slow speed, at it; the first command is 0."""

    command: Vector
    run: Run
    part: int

    @property
    def at_rest(self) -> Vector:
        """Velocity once it should have come to rest."""
        return self.run.velocity[2 * self.part : 3 * self.part]

    @property
    def slow(self) -> Vector:
        """Velocity once the slow speed should be reached."""
        return self.run.velocity[4 * self.part :]


def simulated_with(
    model: Model, given: Controller, found: Controller, period: float, step: float, after: LoopFigures
) -> tuple[Text, ...]:
    """What the run of the proposal shows, in sentences; none where model and loop are linear."""
    if not _nonlinear(model) and not found.limited:
        return ()
    try:
        new = _trial(model, found, period, step, after)
    except GaidentError as error:
        return (say("The proposal could not be simulated with all effects: {}", str(error)),)
    # no decision: a formula: numbers that grow without end
    if not np.all(np.abs(new.run.velocity) < 1e3 * step):
        return (say("With all effects of the model the simulated loop runs away under these gains: do not use them."),)
    try:
        old = _trial(model, given, period, step, after)
    except GaidentError:
        old = new
    said = [*_limit_cycle(new, old, step, period), *_stick_slip(new, old, step), *_limited(new, model, found)]
    return tuple(said) or (say("Simulated with all effects of the model, the loop comes to rest and creeps without a stop."),)


def without_each(
    model: Model, found: Controller, period: float, step: float, after: LoopFigures
) -> tuple[tuple[str, float, float], ...]:
    """(effect, error of the velocity with all effects, error without this one), rms [rad/s], for what can be mended."""
    rows = []
    try:
        whole = _error(_trial(model, found, period, step, after))
        for effect in model.effects:
            if mendable(effect):
                less = model.without_effect(effect.name, side=effect.side or None)
                rows.append((effect.name, whole, _error(_trial(less, found, period, step, after))))
    except GaidentError:
        return ()
    return tuple(rows)


def mendable(effect: Effect) -> bool:
    """Whether an effect can be a fault of the drive: a linear one is part of how it is built."""
    return effect.name not in LINEAR


def _nonlinear(model: Model) -> bool:
    return any(map(mendable, model.effects))


def _error(trial: _Tried) -> float:
    return float(np.sqrt(np.mean((trial.command - trial.run.velocity) ** 2)))


def _trial(model: Model, controller: Controller, period: float, step: float, after: LoopFigures) -> _Tried:
    settles = after.settling_time.high
    wanted = SETTLING_TIMES * settles / period if np.isfinite(settles) else LONGEST
    part = int(np.clip(wanted, SHORTEST, LONGEST))
    slow = POLICY.slow_command * step
    command = np.repeat([step, 0.0, 0.0, slow, slow], part)
    command[0] = 0.0
    still = np.zeros(len(command))
    if controller.driven_by == "command":
        rec = Record(period, command=command, velocity=still)
    else:
        rec = Record(period, position_command=period * np.cumsum(command), velocity=still)
    with np.errstate(over="ignore", invalid="ignore"):
        return _Tried(command, run(model, rec, controller), part)


def _limit_cycle(new: _Tried, old: _Tried, step: float, period: float) -> list[Text]:
    swing, before = (0.5 * float(np.ptp(t.at_rest)) for t in (new, old))
    if swing <= POLICY.swings_on * step:
        return []
    w = new.at_rest - np.mean(new.at_rest)
    turns = np.count_nonzero(np.diff(np.signbit(w)))
    frequency = 0.5 * turns / (len(w) * period)
    so_far = say("as under the given gains") if before > POLICY.swings_on * step else say("which the given gains do not make")
    text = "At rest the velocity goes on swinging by +-{:.3g} {rad/s} at about {:.3g} Hz, a limit cycle, {}."
    return [say(text, swing, frequency, so_far)]


def _stick_slip(new: _Tried, old: _Tried, step: float) -> list[Text]:
    slow = POLICY.slow_command * step
    stands, before = (float(np.mean(np.abs(t.slow) < STANDS * slow)) for t in (new, old))
    if stands <= POLICY.sticks:
        return []
    text = (
        "At a slow command of {:.3g} {rad/s} the axis stands for {:.0f} % of the time (stick-slip), under the given gains for "
        "{:.0f} %."
    )
    return [say(text, slow, 100.0 * stands, 100.0 * before)]


def _limited(new: _Tried, model: Model, found: Controller) -> list[Text]:
    behind = [e.parameters["limit"] for e in model.effects if e.row.place == "actuator" and "limit" in e.parameters]
    limit = min(found.limits[0], *behind, math.inf)
    share = float(np.mean(np.abs(new.run.torque) >= limit * (1.0 - 1e-9)))
    if share == 0.0:
        return []
    beyond = 100.0 * max(float(np.max(np.abs(new.run.velocity))) / float(np.max(np.abs(new.command))) - 1.0, 0.0)
    text = (
        "A step of {:.3g} {rad/s} reaches the limit of {:.3g} {N m} for {:.2g} % of the run; the velocity then goes {:.2g} % "
        "beyond it."
    )
    return [say(text, float(np.max(np.abs(new.command))), limit, 100.0 * share, beyond)]
