"""retune(): gains of the velocity loop, and what they change, for a drive that was identified."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gaident.arguments import arg
from gaident.axis import Text, say
from gaident.checks import time_of_sample, yes_or_no
from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller, checked_controller
from gaident.control.differencing import older
from gaident.control.filters import Filter, LowPass, Notch
from gaident.control.pi import PI
from gaident.errors import SettingsError
from gaident.models.effects_linear import LATE
from gaident.models.model import Model
from gaident.policy.table import POLICY
from gaident.remedies.doubts import beyond_the_records, doubts_of, no_gains
from gaident.remedies.draws import age_of, drawn_models
from gaident.remedies.figures import Judge
from gaident.remedies.loops import Loops, frequencies_of
from gaident.remedies.nonlinear import simulated_with, without_each
from gaident.remedies.plants import sampled_plants
from gaident.remedies.position import position_gain
from gaident.remedies.rules import resonances, rule_gains
from gaident.remedies.search import (
    UNSTABLE,
    Search,
    Tuned,
    asked_of,
    at_most,
    held_low,
    most_of,
    no_less_than_now,
    step_not_known,
)
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.results.retuning import Retuning, RuleStart
from gaident.version import version

__all__ = ["retune"]

AS_GIVEN = "the given gains"
NO_FILTER = "A PI has no filter: where the drive can have one, give a Cascade around the PI as controller."
NOT_ASKED = "None is added, because none was asked for."
MOST_FILTERS = 8  # no decision: what an argument may be: filters of a cascade in one place
HIGHEST_NOTCH = 0.45  # no decision: a start; of the sampling frequency
NOTCH = (0.1, 0.6)  # no decision: a start; dampings of a notch
FASTEST = 0.5  # no decision: a start; time constant of a low pass in samples


def retune(
    result: Identification | Diagnosis,
    controller: Controller | None = None,
    *,
    phase_margin: float = POLICY.phase_margin,
    gain_margin: float = POLICY.gain_margin,
    torque_limit: float | None = None,
    torque_noise: float | None = None,
    step: float | None = None,
    dt: float | None = None,
    filters: bool = True,
    seed: int = 0,
    most_times: float | None = None,
) -> Retuning:
    """Propose gains for the drive of a result: as stiff as the margins, the torque and the uncertainty of the model allow.

    The linear part of the model (delay, lag, filter and extra resonance included) is sampled exactly at the controller's clock.
    The gains keep the margins in 95 % of the drives that the covariance of the result leaves possible.
    From the best of the classical rules (symmetrical optimum, magnitude optimum, two masses equally damped, the given gains) a
    search makes the loop as stiff as possible.
    A low pass and a notch are added where they pay, to a Cascade; a PI stays one.
    Where the model has nonlinear effects, the proposal is simulated with them, and the result says what was found.

    Parameters
    ----------
    result : Identification or Diagnosis
        What `identify` or `diagnose` found.
    controller : PI or Cascade, optional
        The controller to retune; None: that of the result.
    phase_margin : float
        Least phase margin of the velocity loop, and of the position loop where there is one [deg], above 0 and below 90.
    gain_margin : float
        Least gain margin [dB], above 0 and below 40.
    torque_limit : float, optional
        Largest torque that a step of the velocity command of the size `step` may ask for [N m].
        None: that of the controller or, where the step asks for more under the given gains, as much as under these; none where
        the controller has no limit.
        In that second case ki, unless an anti-windup holds the integral, and the gain of a position controller are at most
        those given.
    torque_noise : float, optional
        Largest rms of the torque that the noise of the velocity may make [N m]; None: any.
    step : float, optional
        Size of the step of the velocity command [rad/s]; None: the largest change between two lines of the records' command,
        1 where there are none.
    dt : float, optional
        Sample time of the controller [s]; None: that of the controller, or of the records.
    filters : bool
        Whether a Cascade may get a low pass and a notch.
    seed : int
        Seed of the drives that are drawn; the same seed gives the same result.
    most_times : float, optional
        Times the given kp, ki and gain of the position controller, which the proposed ones are at most, 1 or more; None: any.

    Returns
    -------
    Retuning
        The proposal, and the loop before and after.

    Raises
    ------
    SettingsError
        For arguments out of their range, and a result or controller that no loop can be made of.
    ModelError
        For a delay of very many samples.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> controller = ga.PI(kp=0.5, ki=5.0)
    >>> command = np.repeat([20.0, -30.0, 10.0, -5.0], 100)
    >>> noise = 0.02 * np.random.default_rng(1).standard_normal(400)
    >>> drive = ga.OneMass(J=0.01, D=0.05).model().with_effect("torque_lag", time_constant=2e-3)
    >>> run = ga.run(drive, ga.Record(1e-3, command=command - noise, velocity=noise), controller)
    >>> rec = ga.Record(1e-3, command=command, velocity=run.velocity + noise, torque=run.torque)
    >>> tuned = ga.retune(ga.diagnose(rec, controller, seed=1), phase_margin=50.0)
    >>> tuned.keeps, tuned.after.stiffness.value > tuned.before.stiffness.value
    (True, True)
    """
    given = _controller_of(result, controller)
    period = _period_of(result, given, dt)
    wanted = asked_of(result, given, phase_margin, gain_margin, torque_limit, torque_noise, step)
    asked = replace(wanted, most=most_of(given, most_times))
    yes_or_no(filters, "filters", SettingsError)
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise SettingsError(f"seed is {seed!r}: give a whole number >= 0")
    age = age_of(result, given)
    axis = result.axis if isinstance(result, Diagnosis) else "rotary"
    drawn = drawn_models(result, POLICY.checked_drives, seed)
    linear = [_with_what_is_late(model) for model in drawn]
    if linear[0].gain < 0.0 or linear[0].p < 1:
        raise SettingsError(
            f"the model of the result has gain {linear[0].gain:g} and p = {linear[0].p}: gains are proposed for a drive that a "
            "positive torque turns forwards, with more poles than zeros; change the sign of the torque, or identify again"
        )
    plants = sampled_plants(linear, period, given.delay, age > 0.0)
    judge = Judge(
        plants, plants.responses(frequencies_of(plants, POLICY.checked_points, POLICY.checked_near)), asked.step, asked.noise
    )
    before = judge.figures(cascade_of(given))
    asked, beyond = no_less_than_now(asked, before, given) if torque_limit is None else (asked, [])
    work = _Retuning(
        linear[0], given, period, age > 0.0, Search(plants.chosen(slice(0, POLICY.tuned_drives + 1)), asked.roomier())
    )
    allowed = filters and isinstance(given, Cascade)
    tuned, notes = work.best(allowed)
    tuned = work.held(tuned, judge)
    if tuned.excess >= UNSTABLE:
        tuned, notes = replace(tuned, cascade=cascade_of(given), rule=AS_GIVEN), [no_gains(linear)]
    proposal, more = work.placed(tuned.cascade)
    phase, gain = judge.margins(proposal)
    holds = float(np.mean((phase >= asked.phase_margin) & (gain >= asked.gain_margin)))
    found: Controller = proposal
    if isinstance(given, PI):
        found = replace(given, kp=proposal.velocity.kp, ki=proposal.velocity.ki)
    after = judge.figures(proposal)
    now, then = older(given, age), older(found, age)
    told = simulated_with(drawn[0], now, then, period, asked.step, after)
    return Retuning(
        controller=found,
        given=given,
        before=before,
        after=after,
        doubts=(*doubts_of(result), *beyond_the_records(result.records, *judge.loop(proposal))),
        phase_margin=asked.phase_margin,
        gain_margin=asked.gain_margin,
        torque_limit=asked.torque_limit,
        torque_noise=asked.torque_noise,
        step=asked.step,
        holds=holds,
        drives=len(drawn) - 1,
        rule=tuned.rule,
        starts=work.starts(),
        simulated=told,
        mended=without_each(drawn[0], then, period, asked.step, after),
        notes=(
            *notes,
            *more,
            *beyond,
            *step_not_known(result, asked, step),
            *held_low(before, after, asked),
            *at_most(proposal, asked, most_times),
            *_of_the_covariance(len(drawn) - 1, holds),
            *_of_the_mechanism(result.model),
        ),
        model=drawn[0],
        period=period,
        velocity_age=age,
        noise=asked.noise,
        seed=seed,
        axis=axis,
        digests=result.digests,
        version=version(),
    )


class _Retuning:
    """The work on one loop."""

    def __init__(self, model: Model, given: Controller, period: float, differenced: bool, search: Search) -> None:
        self.model, self.cascade, self.search = model, cascade_of(given), search
        self.filterable, cascade = isinstance(given, Cascade), self.cascade
        self.asked = search.asked
        pi = cascade.velocity
        rules = rule_gains(model, cascade, period, differenced)
        rules = {name: (kp, ki if pi.ki > 0.0 else 0.0) for name, (kp, ki) in rules.items() if ki > 0.0 or pi.ki == 0.0}
        if pi.kp > 0.0:
            rules[AS_GIVEN] = (pi.kp, pi.ki)
        self.rules: Mapping[str, tuple[float, float]] = rules
        self.period = period

    def best(self, allowed: bool) -> tuple[Tuned, list[Text]]:
        """The best loop, with filters where they pay, and what is to say of them."""
        plain = self.search.tuned(self.cascade, self.rules, ())
        best, words = plain, ""
        for added, name in self._filters():
            with_it = self.search.tuned(self.cascade, self.rules, added)
            if with_it.excess == 0.0 and _pays(with_it, best):
                best, words = self._without_needless(with_it, len(added), name)
        if not words:
            return plain, []
        more = math.exp(best.worth - plain.worth)
        if plain.excess > 0.0:
            text = "These gains alone do not keep what was asked for, with {} in the path of the {torque} a loop does."
            return (best, [say(text, words)]) if allowed else (plain, [say(text, words), *([say(NOT_ASKED)] * self.filterable)])
        if allowed:
            text = (
                "Added in the path of the {torque}: {}. The loop is {:.2g} times as stiff with it as with the best gains alone."
            )
            return best, [say(text, words, more)]
        text = "With {} in the path of the {torque} the loop would be {:.2g} times as stiff as with these gains alone. {}"
        return plain, [say(text, words, more, NOT_ASKED if self.filterable else NO_FILTER)]

    def _without_needless(self, tuned: Tuned, added: int, name: str) -> tuple[Tuned, str]:
        """Without the first of two added filters, where the search from there does not need it."""
        own = tuned.cascade
        filters = tuple(own.torque_filters)
        kept, last = filters[: len(filters) - added], filters[-1:]
        if added == 1:
            return tuned, name
        rules = {tuned.rule: (own.velocity.kp, own.velocity.ki)}
        less = self.search.tuned(replace(own, torque_filters=kept), rules, last)
        return (tuned, name) if less.excess > 0.0 or _pays(tuned, less) else (less, "a notch")

    def _filters(self) -> list[tuple[tuple[Filter, ...], str]]:
        """Filters that may pay, in the order in which they are tried."""
        room = MOST_FILTERS - len(self.cascade.torque_filters)
        highest = HIGHEST_NOTCH / self.period
        low = LowPass(FASTEST * self.period)
        notches = [Notch(f, *NOTCH) for f in resonances(self.model) if f < highest][:1]
        found: list[tuple[tuple[Filter, ...], str]] = [((low,), "a low pass")]
        found += [((notch,), "a notch") for notch in notches]
        found += [((low, notch), "a low pass and a notch") for notch in notches]
        return [(added, name) for added, name in found if len(added) <= room]

    def held(self, tuned: Tuned, judge: Judge) -> Tuned:
        """Searched again with larger margins, while too few of all drives keep those that were asked for."""
        search, own = self.search, tuned.cascade
        added = len(own.torque_filters) - len(self.cascade.torque_filters)
        for _ in range(POLICY.rounds):
            phase, gain = judge.margins(own)
            asked = self.asked
            if np.mean((phase >= asked.phase_margin) & (gain >= asked.gain_margin)) >= POLICY.robust_share:
                break
            low = 50.0 * (1.0 - POLICY.robust_share)  # half of those that may miss it
            lacks = [max(0.0, wanted - float(np.percentile(m, low))) for m, wanted in
                     ((phase, asked.phase_margin), (gain, asked.gain_margin))]  # fmt: skip
            search = Search(search.plants, search.asked.stricter(*lacks))
            rules = {tuned.rule: (own.velocity.kp, own.velocity.ki)}
            tuned = search.tuned(replace(own, torque_filters=own.torque_filters[: len(own.torque_filters) - added]), rules,
                                   own.torque_filters[len(own.torque_filters) - added :])  # fmt: skip
            own = tuned.cascade
        return tuned

    def placed(self, cascade: Cascade) -> tuple[Cascade, list[Text]]:
        """With the gain of the position controller, where there is one."""
        if cascade.position is None:
            return cascade, []
        gain = position_gain(self.search, cascade, self.asked)
        if gain is None:
            return cascade, [say("No gain of the position controller keeps what was asked for: the given one stays.")]
        return replace(cascade, position=replace(cascade.position, gain=gain)), []

    def starts(self) -> tuple[RuleStart, ...]:
        """The rules as they are."""
        found = []
        for name, (kp, ki) in self.rules.items():
            one = self.search.judged(replace(self.cascade, velocity=replace(self.cascade.velocity, kp=kp, ki=ki)), name)
            found.append(RuleStart(name, kp, ki, one.excess == 0.0, _stiffness(one, self.search)))
        return tuple(found)


def _stiffness(tuned: Tuned, search: Search) -> float:
    loops = Loops(search.plants, tuned.cascade, search.responses)
    return float(loops.stiffness[0]) if loops.stable.all() else 0.0


def _pays(one: Tuned, other: Tuned) -> bool:
    return other.excess > 0.0 or one.worth >= other.worth + math.log(POLICY.filter_pays)


def _of_the_covariance(drives: int, holds: float) -> list[Text]:
    if drives == 0:
        return [say("The records leave a number of the model open, or the result is an old one: nothing is known of its spread.")]
    if holds < POLICY.robust_share:
        text = "Only in {:.0f} % of {} drives that the records leave possible does this loop keep the margins."
        return [say(text, 100.0 * holds, drives)]
    return []


def _with_what_is_late(model: Model) -> Model:
    """The linear part, with what of the sensor is late and linear in no continuous system."""
    linear = model.linear
    for effect in model.effects:
        if effect.name in LATE:
            linear = linear.with_effect(effect.name, **effect.parameters)
    return linear


def _of_the_mechanism(model: Model) -> list[Text]:
    text = "The {inertia} changes with the {angle}: the loop is that of its mean, and at the least one the margins are smaller."
    return [say(text)] if any(effect.row.place == "mechanism" for effect in model.effects) else []


def _controller_of(result: object, controller: Controller | None) -> Controller:
    if not isinstance(result, Identification | Diagnosis):
        raise SettingsError(f"result is {type(result).__name__}: give what gaident.identify or gaident.diagnose found")
    given = checked_controller(controller) or result.controller
    if given is None:
        raise SettingsError(f"the result has no controller, and none is given: give {arg('controller', 'PI(...)')}")
    if given.loop != "sampled":
        raise SettingsError(
            "the controller has the continuous loop of the paper: gains are proposed for a digital controller; give "
            f"{arg('controller', 'PI(kp, ki)')}"
        )
    lag = next((f for f in result.findings if f.effect == "torque_filter"), None) if isinstance(result, Diagnosis) else None
    if lag is not None and result.controller is None and not cascade_of(given).torque_filters:
        time = lag.parameters["time_constant"].value
        raise SettingsError(
            f"the diagnosis found a low pass of {1e3 * time:.3g} ms in the path of the torque, which its model does not contain "
            f"and this controller lacks: give it, Cascade(..., torque_filters=(LowPass({time:.4g}),))"
        )
    if given.unknown:
        raise SettingsError(f"controller has {given.unknown[0]}=None: give a number, or a result that found one")
    return given


def _period_of(result: Identification | Diagnosis, given: Controller, dt: float | None) -> float:
    if dt is not None:
        period = time_of_sample(dt, SettingsError, "the sample time of the controller")
        if given.clock is not None and not math.isclose(given.clock, period, rel_tol=1e-9):
            raise SettingsError(f"dt is {period:g} and the controller's period {given.clock:g}: give one of them, or both alike")
        return period
    if given.clock is not None:
        return given.clock
    if result.controller is not None and result.controller.clock is not None:
        return result.controller.clock
    if result.records:
        return result.records[0].dt
    raise SettingsError(f"the sample time of the controller is not known: a loaded result has no records; give {arg('dt')} [s]")
