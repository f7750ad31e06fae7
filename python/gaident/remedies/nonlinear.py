"""A proposal simulated with all effects of the model: limit cycles, stick-slip, limits that are reached, windup.

The command is a step to a speed and back to rest, then a slow speed; under a position controller the angle that goes with it.
Behind a limit, or in a wide gap, a motion dies out much later than in the linear loop: its parts are longer then.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.control.cascade import Cascade, cascade_of
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
SHORTEST, LONGEST = 200, 4000  # no decision: memory: samples of a part at first
LONGER, TRIES = 4, 3  # no decision: memory: a part is so many times longer where the axis neither rests nor swings on; tries
SLOW = 3  # no decision: a formula: parts before the slow speed
HALF = 0.5  # no decision: a formula: of what a velocity moves through
PERCENT = 100.0  # no decision: a unit
TURNS = 8  # no decision: a formula: changes of sign in four periods: fewer are no swing that goes on
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
    def last(self) -> Vector:
        """The second half of that, about its mean."""
        last = self.at_rest[len(self.at_rest) // 2 :]
        return last - np.mean(last)

    @property
    def turns(self) -> int:
        """How often the velocity changes its sign there."""
        return int(np.count_nonzero(np.diff(np.signbit(self.last))))

    @property
    def swing(self) -> float:
        """Half of what the velocity moves through there [rad/s]."""
        return HALF * float(np.ptp(self.last))

    def rests(self, step: float) -> bool:
        """Whether the axis has come to rest."""
        return self.swing <= POLICY.swings_on * step

    def settles(self, step: float) -> bool:
        """Whether the velocity is steady at the end of the step."""
        last = self.run.velocity[self.part - self.part // 4 : self.part]
        return HALF * float(np.ptp(last)) <= POLICY.swings_on * step

    def cycles(self, step: float) -> bool:
        """Whether it swings on: as far in the second half as in the first."""
        first = HALF * float(np.ptp(self.at_rest[: len(self.at_rest) // 2]))
        return not self.rests(step) and self.turns >= TURNS and self.swing > POLICY.dies_out * first

    def beyond(self) -> float:
        """By how much the velocity goes beyond the step [%]."""
        top = float(np.max(np.abs(self.command)))
        return PERCENT * max(float(np.max(np.abs(self.run.velocity[: self.part]))) / top - 1.0, 0.0)

    def stands(self, slow: float) -> float:
        """Share of the time in which it stands, once the slow speed should be reached."""
        return float(np.mean(np.abs(self.run.velocity[4 * self.part :]) < STANDS * slow))


def simulated_with(
    model: Model, given: Controller, found: Controller, period: float, step: float, after: LoopFigures
) -> tuple[Text, ...]:
    """What the run of the proposal shows, in sentences; none where model and loop are linear."""
    if not _nonlinear(model) and not found.limited:
        return ()
    try:
        new = _tried(model, found, period, step, after)
    except GaidentError as error:
        return (say("The proposal could not be simulated with all effects: {}", str(error)),)
    # no decision: a formula: numbers that grow without end
    if not np.all(np.abs(new.run.velocity) < 1e3 * step):
        return (say("With all effects of the model the simulated loop runs away under these gains: do not use them."),)
    old: _Tried | None
    try:
        old = _tried(model, given, period, step, after)
    except GaidentError:
        old = None
    said = [*_limit_cycle(new, old, step, period), *_stick_slip(new, old, step), *_limited(new, old, model, found, period)]
    said += _wound_up(new, model, found, period)
    return tuple(said) or (say("Simulated with all effects of the model, the loop comes to rest and creeps without a stop."),)


def without_each(
    model: Model, found: Controller, period: float, step: float, after: LoopFigures
) -> tuple[tuple[str, float, float], ...]:
    """(effect, error of the velocity with all effects, error without this one), rms [rad/s], for what can be mended.

    Of the second half of the step and of the rest, as what follows at once is the loop's.
    Of all of the slow motion, which dry friction holds at its beginning.
    """
    rows = []
    try:
        whole = _tried(model, found, period, step, after)
        for effect in model.effects:
            if mendable(effect):
                less = model.without_effect(effect.name, side=effect.side or None)
                rows.append((effect.name, _error(whole), _error(_trial(less, found, period, step, whole.part))))
    except GaidentError:
        return ()
    return tuple(rows)


def mendable(effect: Effect) -> bool:
    """Whether an effect can be a fault of the drive: a linear one is part of how it is built."""
    return effect.name not in LINEAR


def _nonlinear(model: Model) -> bool:
    return any(map(mendable, model.effects))


def _error(trial: _Tried) -> float:
    parts = (trial.command - trial.run.velocity).reshape(-1, trial.part)
    counted = np.concatenate([parts[:SLOW, trial.part // 2 :].ravel(), parts[SLOW:].ravel()])
    return float(np.sqrt(np.mean(counted**2)))


def _tried(model: Model, controller: Controller, period: float, step: float, after: LoopFigures) -> _Tried:
    """The run with parts that are long enough to see whether the axis comes to rest, or swings on."""
    settles = after.settling_time.high
    wanted = SETTLING_TIMES * settles / period if np.isfinite(settles) else LONGEST
    part = int(np.clip(wanted, SHORTEST, LONGEST))
    for longer in range(TRIES):
        trial = _trial(model, controller, period, step, part * LONGER**longer)
        if (trial.rests(step) and trial.settles(step)) or trial.cycles(step):
            break
    return trial


def _trial(model: Model, controller: Controller, period: float, step: float, part: int) -> _Tried:
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


def _limit_cycle(new: _Tried, old: _Tried | None, step: float, period: float) -> list[Text]:
    if new.rests(step):
        return []
    if not new.cycles(step):
        text = "{:.3g} s after the command is back at 0 the velocity still moves by +-{:.3g} {rad/s}{}."
        return [
            say(
                text,
                (new.part + new.part) * period,
                new.swing,
                _given(", under the given gains by +-{:.3g}", None if old is None else old.swing),
            )
        ]
    frequency = 0.5 * new.turns / (len(new.last) * period)
    so_far = "" if old is None else ", as under the given gains" if old.cycles(step) else ", which the given gains do not make"
    text = "At rest the velocity goes on swinging by +-{:.3g} {rad/s} at about {:.3g} Hz, a limit cycle{}."
    return [say(text, new.swing, frequency, so_far)]


def _stick_slip(new: _Tried, old: _Tried | None, step: float) -> list[Text]:
    slow = POLICY.slow_command * step
    stands = new.stands(slow)
    if stands <= POLICY.sticks:
        return []
    before = _given(", under the given gains for {:.0f} %", None if old is None else PERCENT * old.stands(slow))
    text = "At a slow command of {:.3g} {rad/s} the axis stands for {:.0f} % of the time (stick-slip){}."
    return [say(text, slow, PERCENT * stands, before)]


def _limited(new: _Tried, old: _Tried | None, model: Model, found: Controller, period: float) -> list[Text]:
    behind = [e.parameters["limit"] for e in model.effects if e.row.place == "actuator" and "limit" in e.parameters]
    limit = min(found.limits[0], *behind, math.inf)
    samples = int(np.sum(np.abs(new.run.torque[: new.part]) >= limit * (1.0 - 1e-9)))
    if samples == 0:
        return []
    text = "A step of {:.3g} {rad/s} reaches the limit of {:.3g} {N m} for {:.3g} s; the velocity then goes {:.3g} % beyond it{}."
    before = _given(", under the given gains {:.3g} %", None if old is None else old.beyond())
    return [say(text, float(np.max(np.abs(new.command))), limit, samples * period, new.beyond(), before)]


def _given(text: str, value: float | None) -> Text | str:
    """What is said of the given gains; nothing where the loop runs away under them, or could not be simulated."""
    return say(text, value) if value is not None and math.isfinite(value) else ""


def _wound_up(new: _Tried, model: Model, found: Controller, period: float) -> list[Text]:
    """What an integral that is held at the limit of the torque would change."""
    velocity, step = cascade_of(found).velocity, float(np.max(np.abs(new.command)))
    if (
        velocity.torque_limit is None
        or velocity.ki == 0.0
        or velocity.anti_windup != "none"
        or new.beyond() <= PERCENT * POLICY.winds_up
    ):
        return []
    held = replace(velocity, anti_windup="hold")
    try:
        kept = _trial(model, replace(found, velocity=held) if isinstance(found, Cascade) else held, period, step, new.part)
    except GaidentError:
        return []
    if kept.beyond() > 0.5 * new.beyond():  # no decision: printed: half of it is worth a sentence
        return []
    text = 'The integral winds up at the limit: held there, anti_windup="hold", the velocity goes {:.3g} % beyond the step.'
    return [say(text, kept.beyond())]
