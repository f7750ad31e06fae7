"""The gains that make a loop stiff and keep what was asked for, in every one of some drives.

    maximise  stiffness of the identified drive     over ln kp, ln ki/kp, and the numbers of an added filter
    so that   phase and gain margin >= asked, largest sensitivity <= allowed, largest torque <= limit, in all drives

What is not kept is a penalty; the search is the simplex of Nelder and Mead, from the best rules.
A loop that is only proportional stays so: there the largest kp is looked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from gaident.axis import Text, joined, say
from gaident.checks import above_zero, real_number, size_of_drive
from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.control.filters import Filter, LowPass, Notch
from gaident.errors import SettingsError
from gaident.policy.table import POLICY
from gaident.remedies.loops import Loops, frequencies_of
from gaident.remedies.plants import PlantResponses, Plants
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.results.retuning import LoopFigures

__all__ = [
    "UNSTABLE",
    "Asked",
    "Search",
    "Tuned",
    "asked_of",
    "at_most",
    "held_low",
    "most_of",
    "no_less_than_now",
    "step_not_known",
]

Vector = NDArray[np.float64]

PENALTY = 20.0  # no decision: of a solver: a tenth of a margin costs more than any stiffness gains
UNSTABLE = 1e3  # no decision: of a solver: the cost of a loop that is not stable
SIDE = 0.25  # no decision: of a solver: the sides of the first simplex, ln of a gain
STEPPED = slice(0, 4)  # no decision: of a solver: drives whose largest torque the search looks at
SMALLER = 0.97  # no decision: of a solver: a step towards gains that keep what was asked for
UPPER = 90.0  # no decision: what an argument may be; deg
DECIBELS = 40.0  # no decision: what an argument may be
SOFTER = 0.9  # no decision: printed: of a stiffness, from which a loop that becomes softer is said to
TOP = 0.999  # no decision: printed: of a gain as large as allowed
AGAIN = 2  # no decision: of a solver: simplexes, each from the end of the one before, which edges stop
TOLERANCE = 1e-3  # no decision: of a solver: ends the search; a thousandth of a gain


@dataclass(frozen=True)
class Asked:
    """What a loop has to keep: margins [deg], [dB], torque [N m] of a step [rad/s], torque noise [N m] of a noise [rad/s]."""

    phase_margin: float
    gain_margin: float
    torque_limit: float | None
    step: float
    torque_noise: float | None
    noise: float
    most: tuple[float, float, float] = (math.inf, math.inf, math.inf)  # kp, ki and the gain of a position controller

    def capped(self, cascade: Cascade) -> Cascade:
        """The controller with gains no larger than allowed."""
        own, (kp, ki, _) = cascade.velocity, self.most
        if own.kp <= kp and own.ki <= ki:
            return cascade
        return replace(cascade, velocity=replace(own, kp=min(own.kp, kp), ki=min(own.ki, ki)))

    @property
    def sensitivity(self) -> float:
        """The largest one allowed: that of the policy, or what the margins themselves allow."""
        factor: float = 10.0 ** (self.gain_margin / 20.0)
        # no decision: a formula: the chord of a circle
        of_phase = 0.5 / math.sin(math.radians(0.5 * self.phase_margin))
        of_gain = factor / (factor - 1.0) if factor > 1.0 else math.inf  # 1 is also that of a margin too small for a float64
        return float(max(POLICY.most_sensitivity, of_phase, of_gain))

    def roomier(self) -> Asked:
        """With the margins that the search keeps."""
        room = POLICY.margin_room - 1.0
        return self.stricter(room * self.phase_margin, room * self.gain_margin)

    def stricter(self, phase: float, gain: float) -> Asked:
        """With margins larger by so much [deg], [dB]."""
        return replace(self, phase_margin=self.phase_margin + phase, gain_margin=self.gain_margin + gain)


@dataclass(frozen=True, eq=False)
class Tuned:
    """A controller that a search found.

    cost: lower is better; excess: how far it misses what was asked for, 0: not at all; worth: ln of its stiffness, of a loop
    without an integral ln kp.
    """

    cascade: Cascade
    cost: float
    excess: float
    rule: str
    worth: float = -math.inf


@dataclass(frozen=True, eq=False)
class Search:
    """Drives, and what is asked for."""

    plants: Plants
    asked: Asked

    @cached_property
    def responses(self) -> PlantResponses:
        """Of the drives, shared by all controllers."""
        return self.plants.responses(frequencies_of(self.plants, POLICY.tuned_points, POLICY.tuned_near))

    def judged(self, cascade: Cascade, rule: str) -> Tuned:
        """One controller, its gains no larger than allowed."""
        cascade = self.asked.capped(cascade)
        loops, asked = Loops(self.plants, cascade, self.responses), self.asked
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            if not loops.stable.all():
                radius = np.max(np.abs(np.linalg.eigvals(loops.velocity_loop[0][:, :-1, :-1])))
                return Tuned(cascade, UNSTABLE + float(radius), UNSTABLE, rule)
            excess = max(0.0, 1.0 - float(np.min(loops.phase_margins)) / asked.phase_margin)
            excess += max(0.0, 1.0 - float(np.min(loops.gain_margins)) / asked.gain_margin)
            excess += max(0.0, float(np.max(loops.peaks)) / asked.sensitivity - 1.0)
            if asked.torque_noise is not None:
                noise = float(np.max(loops.noise_gain)) * asked.noise
                excess += max(0.0, math.log(max(noise / asked.torque_noise, 1e-300)))
            if asked.torque_limit is not None:
                few = Loops(self.plants.chosen(STEPPED), cascade, self.responses)
                torque = asked.step * few.step_torque()
                excess += max(0.0, math.log(max(torque / asked.torque_limit, 1e-300)))
            gains = cascade.velocity
            worth = math.log(max(float(loops.stiffness[0]), 1e-300)) if gains.ki > 0.0 else math.log(gains.kp)
        return Tuned(cascade, PENALTY * excess - worth, excess, rule, worth)

    def tuned(self, cascade: Cascade, rules: Mapping[str, tuple[float, float]], added: Sequence[Filter]) -> Tuned:
        """The best gains from the best of these rules, with filters of the torque added whose numbers are searched too."""
        begun = sorted((self._begun(cascade, name, gains, added) for name, gains in rules.items()), key=lambda t: t.cost)
        found = [self._from(start, len(added)) for start in (begun[:1] if added else begun[: POLICY.starts])]
        return min(found, key=lambda t: t.cost)

    def _begun(self, cascade: Cascade, name: str, gains: tuple[float, float], added: Sequence[Filter]) -> Tuned:
        """A rule, slowed down as far as is best."""
        filters = (*cascade.torque_filters, *added)
        kp, ki = gains
        tried = []
        for slower in 0.5 ** np.arange(7.0):  # no decision: a start
            own = replace(cascade.velocity, kp=kp * slower, ki=ki * slower**2)
            tried.append(self.judged(replace(cascade, velocity=own, torque_filters=filters), name))
        return min(tried, key=lambda t: t.cost)

    def _from(self, start: Tuned, added: int) -> Tuned:
        best = start
        for _ in range(AGAIN):
            vector, made = _coordinates(best.cascade, added)
            simplex = np.vstack([vector, vector + SIDE * np.eye(len(vector))])
            options = {"maxfev": POLICY.tuning_steps, "initial_simplex": simplex, "xatol": TOLERANCE, "fatol": TOLERANCE}
            cost = partial(self._cost, made, start.rule)
            done = minimize(cost, vector, method="Nelder-Mead", options=options)
            best = min((best, self.judged(made(done.x), start.rule)), key=lambda t: t.cost)
        return self._kept(best)

    def _cost(self, made: Callable[[Vector], Cascade], rule: str, x: Vector) -> float:
        return self.judged(made(x), rule).cost

    def _kept(self, tuned: Tuned) -> Tuned:
        """With gains a little smaller, where these keep all that the simplex misses by a little."""
        one = tuned
        for _ in range(POLICY.tuning_steps):
            if one.excess == 0.0 or one.excess >= UNSTABLE:
                break
            own = one.cascade.velocity
            smaller = replace(own, kp=SMALLER * own.kp, ki=SMALLER**2 * own.ki)
            one = self.judged(replace(one.cascade, velocity=smaller), one.rule)
        return one if one.excess == 0.0 else tuned


def _coordinates(cascade: Cascade, added: int) -> tuple[Vector, Callable[[Vector], Cascade]]:
    """(x, x -> cascade): ln kp, ln ki/kp where there is an integral, and the numbers of the last `added` filters."""
    pi, filters = cascade.velocity, tuple(cascade.torque_filters)
    kept, moved = filters[: len(filters) - added], filters[len(filters) - added :]
    x = [math.log(pi.kp)] + ([math.log(pi.ki / pi.kp)] if pi.ki > 0.0 else [])
    own = len(x)
    for one in moved:
        x += [math.log(one.time_constant)] if isinstance(one, LowPass) else [math.log(one.frequency), 0.0, 0.0]

    def made(values: Vector) -> Cascade:
        kp = math.exp(values[0])
        ki = kp * math.exp(values[1]) if own > 1 else 0.0
        at = own
        changed: list[Filter] = []
        for one in moved:
            if isinstance(one, LowPass):
                changed.append(LowPass(math.exp(values[at])))
                at += 1
            else:
                changed.append(_notch(one, values[at : at + 3]))
                at += 3
        return replace(cascade, velocity=replace(pi, kp=kp, ki=ki), torque_filters=(*kept, *changed))

    return np.array(x), made


def _notch(start: Notch, values: Vector) -> Notch:
    """A notch near another one: its frequency within a factor of two, and dampings that a drive takes."""
    frequency = start.frequency * math.exp(math.log(2.0) * math.tanh(values[0] - math.log(start.frequency)))
    width = start.denominator_damping * math.exp(math.tanh(values[1]))
    depth = start.numerator_damping / start.denominator_damping * math.exp(math.tanh(values[2])) ** 2
    return Notch(frequency, min(depth, 1.0) * width, width)


def asked_of(
    result: Identification | Diagnosis,
    given: Controller,
    phase: float,
    gain: float,
    torque: float | None,
    torque_noise: float | None,
    step: float | None,
) -> Asked:
    """What a proposal has to keep. Raises SettingsError for numbers out of their range."""
    own = None if np.isinf(given.limits[0]) else given.limits[0]
    numbers: dict[str, Any] = {}
    for name, value, highest, unit in (("phase_margin", phase, UPPER, "deg"), ("gain_margin", gain, DECIBELS, "dB")):
        numbers[name] = above_zero(value, name, SettingsError, f"give a number in {unit}, > 0")
        if not 0.0 < numbers[name] < highest:
            raise SettingsError(f"{name} is {numbers[name]:g}: give a number in {unit}, above 0 and below {highest:g}")
    for name, more in (("torque_limit", torque), ("torque_noise", torque_noise), ("step", step)):
        if more is not None:
            numbers[name] = size_of_drive(more, name, SettingsError, "give a number > 0, or leave it out")
    return Asked(
        numbers["phase_margin"],
        numbers["gain_margin"],
        numbers.get("torque_limit", own),
        numbers["step"] if "step" in numbers else _step_of(result),
        numbers.get("torque_noise"),
        _noise_of(result),
    )


def _step_of(result: Identification | Diagnosis) -> float:
    jumps = [float(np.max(np.abs(np.diff(r.command, prepend=r.velocity[0])))) for r in result.records if r.command is not None]
    return max(jumps, default=0.0) or 1.0


def _noise_of(result: Identification | Diagnosis) -> float:
    if isinstance(result, Diagnosis):
        return result.after.noise_floor if result.noise is None else result.noise
    return result.adequacy.noise_std


def most_of(given: Controller, times: float | None) -> tuple[float, float, float]:
    """kp, ki and gain of the position controller at most."""
    if times is None:
        return math.inf, math.inf, math.inf
    factor = real_number(times, "most_times", SettingsError, "give a number >= 1, or None")
    if isinstance(times, bool) or not factor >= 1.0:
        raise SettingsError(f"most_times is {times!r}: give a number >= 1, or None")
    own = cascade_of(given)
    gains = own.velocity.kp, own.velocity.ki, 0.0 if own.position is None else own.position.gain
    return tuple(factor * gain if gain > 0.0 else math.inf for gain in gains)  # type: ignore[return-value]


def no_less_than_now(asked: Asked, before: LoopFigures, given: Controller) -> tuple[Asked, list[Text]]:
    """(what is asked for, a note) where a step asks for more than the controller's limit under the given gains already.

    Behind a limit the integral winds up, the further the larger ki is, and a position loop overshoots: these stay as they are.
    """
    now, limit, own = before.step_torque.value, asked.torque_limit, cascade_of(given)
    if limit is None or not limit < now < math.inf:
        return asked, []
    kp, ki, place = asked.most
    kept = []
    if own.velocity.ki > 0.0 and own.velocity.anti_windup == "none":
        ki, kept = min(ki, own.velocity.ki), ["ki"]
    if own.position is not None:
        place, kept = min(place, own.position.gain), [*kept, "the position gain"]
    text = (
        "Under the given gains a step of {:.3g} {rad/s} asks for {:.3g} {N m}, more than the limit of {:.3g} {N m}: the proposal "
        "may ask for as much{}. Ask for a limit to have gains that stay below it."
    )
    stays = (
        say(", with {} no larger than given, as the loop goes beyond its step behind a limit", joined(" and ", kept))
        if kept
        else ""
    )
    return replace(asked, torque_limit=now, most=(kp, ki, place)), [say(text, asked.step, now, limit, stays)]


def step_not_known(result: Identification | Diagnosis, asked: Asked, step: float | None) -> list[Text]:
    """A note where a limit of the torque is of a step that nobody gave and no record shows.

    A saved result has no records, and those of a position controller have the command of a position.
    """
    if step is not None or asked.torque_limit is None or any(r.command is not None for r in result.records):
        return []
    text = "No record shows the steps of a velocity command: one of {:.3g} {rad/s} is taken; give step, or --step."
    return [say(text, asked.step)]


def held_low(before: LoopFigures, after: LoopFigures, asked: Asked) -> list[Text]:
    """A note where the limit of the torque alone keeps the loop softer than it is."""
    limit, old, new = asked.torque_limit, before.stiffness.value, after.stiffness.value
    if limit is None or after.step_torque.value < POLICY.near_limit * limit or not 0.0 < new < SOFTER * old:
        return []
    text = (
        "The loop becomes {:.2g} times as stiff as it is: a step of {:.3g} {rad/s} may ask for {:.3g} {N m}. A larger "
        "limit, or a smaller step, allows more."
    )
    return [say(text, new / old, asked.step, limit)]


def at_most(proposal: Cascade, asked: Asked, times: float | None) -> list[Text]:
    """What is said where a gain is as large as allowed."""
    kp, ki, place = asked.most
    position = 0.0 if proposal.position is None else proposal.position.gain
    if times is None or not any(
        gain >= TOP * most for gain, most in ((proposal.velocity.kp, kp), (proposal.velocity.ki, ki), (position, place))
    ):
        return []
    text = "No gain is raised to more than {:g} times the given one: record the drive with these gains, and go on from there."
    return [say(text, times)]
