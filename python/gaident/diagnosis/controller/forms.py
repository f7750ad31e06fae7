"""Which form of controller the logged torques show, where a bare PI with the given gains does not make them.

A form is the regression of form_regression.py under constraints: gains as given or free, a rule of integration, a command weight,
feedforwards, filters. All forms are compared by one criterion, with n samples, k free numbers and m settings chosen of three,

    n ln(max(rss/n, floor^2)) + k ln n + 2 m ln 3

floor: the root mean square error of a replay by the rounding of the log; a smaller error shows nothing.
The least counts, and only if the torque follows from it: the controller runs on all measured signals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Cascade
from gaident.control.found import FoundNumbers
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.diagnosis.controller.form import (
    FEEDS,
    FILTER_NAMES,
    FIRST_FEED,
    GAINS,
    Form,
    FormCandidate,
    controller_of,
    found_of,
    named,
)
from gaident.diagnosis.controller.form_between import jumps_of
from gaident.diagnosis.controller.form_comparison import (
    Fitted,
    compared,
    fitted_form,
    fitted_with_times,
    gains_of,
    least_seen,
    rivals_of,
    shape_of,
    simplest_first,
)
from gaident.diagnosis.controller.form_regression import Law, law_of, quiet_law
from gaident.diagnosis.controller.slow_forms import follow, limited, run_error, too_fast, with_numbers_of_limit
from gaident.diagnosis.library.settings import ANTI_WINDUP, OF_SETTING
from gaident.identification.replay.causes import white_noise
from gaident.identification.replay.command_timing import timed
from gaident.identification.replay.replay import tolerance_of, velocity_steps
from gaident.identification.replay.timed_record import TimedRecord
from gaident.policy.table import POLICY

__all__ = ["Form", "Shown", "form_shown"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shown:
    """A controller that the logged torques show.

    controller  the whole of it
    numbers     name of what differs -> parameter -> (value, standard deviation), in the units of `Cascade`
    gains       name -> by how much the criterion of the best form without it is worse
    rivals      what differs in forms with no more free numbers that the logs do not tell from it
    before, rms of logged minus replayed torque, bare PI and this one [N m]
    starts      the highest integral before a record's begin [N m]; 0: none
    estimated   gains that were not given -> (value, standard deviation)
    exact       the torques follow to the rounding, at every sample
    simpler     of a slow log: the controllers without one of the names, from which the torques follow too, jumps on the lines
    found       the controller with its numbers, and how far they may be off together
    """

    controller: Cascade
    numbers: dict[str, dict[str, tuple[float, float]]]
    gains: dict[str, float]
    rivals: tuple[tuple[str, ...], ...]
    before: float
    rms: float
    starts: float
    estimated: dict[str, tuple[float, float]]
    found: FoundNumbers
    exact: bool = False
    simpler: tuple[Shown, ...] = ()


def form_shown(
    records: Sequence[Record],
    given: PI,
    unknown: tuple[str, ...] = (),
    every: int = 1,
    between: bool = True,
    around: Cascade | None = None,
    most: int = 2,
) -> Shown | None:
    """The simplest controller that makes the logged torques; None where none does, or where the given PI makes them.

    unknown: gains of `given` that were not given but estimated. every: controller samples to a line of the log.
    between: whether the command may have jumped between the lines, at times that are found with the form.
    around: the position controller of a slower log, with the feedforwards that were given. most: filters of a form.
    """
    if given.loop != "sampled" or any(r.dt != records[0].dt for r in records):
        return None
    shown = []
    for steps in velocity_steps(records) if every == 1 else ((),):
        regression = law_of(records, given, every, steps, around)
        found = None if regression is None else _form_of(records, given, unknown, *regression, between, most)
        if found is not None and found.exact:
            return found
        shown.append(found)
    # The finest rounding comes first: errors of a coarser rounding are not white, and forms may fit them by numbers too many.
    return next((found for found in reversed(shown) if found is not None), None)


def _form_of(
    records: Sequence[Record], given: PI, unknown: tuple[str, ...], law: Law, floor: float, between: bool, most: int
) -> Shown | None:
    """The same for one assumption on the log's rounding."""
    candidates = compared(law, given, floor, unknown, most=most)
    if not candidates:
        return None
    if law.every > 1:
        following = _following(records, candidates, given, floor)
        slowly = _form_slowly(records, given, unknown, law, floor, candidates, following, between)
        if slowly is not None and (following is None or following.form in simplest_first(candidates)):
            return slowly
        return _shown_quietly(records, law, given, floor, unknown, most) or slowly
    shown = _shown(records, law, given, candidates) if candidates[0].names else None
    return shown or _shown_quietly(records, law, given, floor, unknown, most)


def _form_slowly(
    records: Sequence[Record],
    given: PI,
    unknown: tuple[str, ...],
    law: Law,
    floor: float,
    candidates: Sequence[FormCandidate],
    following: _Following | None,
    between: bool,
) -> Shown | None:
    """The same of a slower log; following: the first of the candidates from which its torque follows."""
    open_times = between and law.around is None and (following is None or not following.strictly)
    unsure = jumps_of(records, law.every, law.lengths) if open_times else None
    if unsure is not None:
        told = _told(records, given, compared(law, given, floor, unknown, unsure, candidates[0].shape))
        if told is not None:
            return _with_simpler(_with_limit(told.records, given, told.candidates, told.fitted), records, given, candidates)
    return _with_simpler(_shown_slowly(records, given, candidates, following), records, given, candidates)


def _allowed(records: Sequence[Record], law: Law, controller: PI) -> list[float]:
    """By how much each logged torque may be off [N m]."""
    logged = [(r, r.command, r.torque) for r in records]
    return [
        tolerance_of(r, c, controller, u, q)
        for (r, c, u), q in zip(logged, law.steps, strict=True)
        if c is not None and u is not None
    ]


def _shown(records: Sequence[Record], law: Law, given: PI, candidates: Sequence[FormCandidate]) -> Shown | None:
    """The best candidate fitted and run as a whole on every sample; None where the torque does not follow from it."""
    best = candidates[0]
    numbers, filters, cov = fitted_form(best, given)
    controller = controller_of(best, numbers, filters, given, law.period)
    starts = numbers[FIRST_FEED + len(FEEDS) :]
    off, exact = [], True
    for rec, start, allowed in zip(records, starts, _allowed(records, law, controller.velocity), strict=True):
        assert rec.torque is not None
        left = rec.torque - controller.torque_of(rec, stored=float(start))
        if float(np.abs(left).max()) > allowed:
            exact = False
            if not white_noise(left, rec.torque):
                return None
        off.append(left)
    plain, pairs = Cascade(given), zip(records, starts, strict=True)
    before = [r.torque - plain.torque_of(r, stored=float(start)) for r, start in pairs if r.torque is not None]
    return Shown(
        controller=controller,
        numbers=named(best, numbers, filters, cov, law.period),
        gains=gains_of(candidates),
        rivals=rivals_of(candidates),
        before=_rms(before),
        rms=_rms(off),
        starts=float(np.abs(starts).max()),
        estimated=_estimated(best, numbers, cov),
        found=found_of(best, (numbers, filters, cov), given, controller, law.period, slow=False),
        exact=exact,
    )


class _Following(NamedTuple):
    """A form from which the torque of a slower log follows; fitted: its numbers, see `fitted_form`.

    strictly: it leaves no more than another velocity between the lines could make; else what is negligible.
    """

    form: FormCandidate
    fitted: Fitted
    strictly: bool


def _following(records: Sequence[Record], candidates: Sequence[FormCandidate], given: PI, floor: float) -> _Following | None:
    """The first form that leaves no more than another velocity between the lines could make, or what is negligible; or None.

    Where the best one leaves more, the best with other filters that does not: what noise makes behind its filter no number of a
    form takes away.
    Where none does, the best if it differs in filters and the rule alone, and the torque follows from it as it is asked of a
    given controller: white noise of a measured torque is left there, too, beside which other numbers fit what they are not.
    """
    first = simplest_first(candidates)
    with_filters = list({c.shape.places: c for c in reversed(candidates)}.values())
    rest = sorted((c for c in with_filters if c not in first), key=lambda c: c.criterion)
    for best in (*first, *rest):
        law, fitted = best.law, fitted_form(best, given)
        rms, least = shape_of(best, fitted).rms, least_seen(law, best.shape, floor)
        strictly = rms <= POLICY.near_rounding * least
        follows = strictly or (best in first and rms <= POLICY.negligible * float(np.abs(law.torque).max()))
        if follows and not too_fast(controller_of(best, *fitted[:2], given, law.period), law.every * law.period):
            return _Following(best, fitted, strictly)
    alone = {*FILTER_NAMES.values(), "integration_rule"}
    for best in (c for c in first if c.shape.places and {*c.names} <= alone):
        fitted = fitted_form(best, given)
        controller = replace(controller_of(best, *fitted[:2], given, best.law.period), period=best.law.period)
        if follow(records, controller) and not too_fast(controller, records[0].dt):
            return _Following(best, fitted, False)
    return None


def _shown_slowly(
    records: Sequence[Record], given: PI, candidates: Sequence[FormCandidate], following: _Following | None
) -> Shown | None:
    """The same for a slower log, where a form follows, with the limits that it has; else None."""
    if following is not None:
        shown = _with_limit(records, given, _first(following.form, candidates), following.fitted)
        if shown is not None:
            return shown
    # Noise on the logged velocity leaves more than interpolation; with a limit the given controller may explain all of it.
    for best in [c for c in candidates if not c.names][:1]:
        part = float(np.sqrt(POLICY.replay_left))
        return _with_limit(records, given, _first(best, candidates), fitted_form(best, given), part)
    return None


def _with_simpler(shown: Shown | None, records: Sequence[Record], given: PI, candidates: Sequence[FormCandidate]) -> Shown | None:
    """The same beside the controllers that lack one of its names, of those that a regression shows where no limit acts.

    What a log lost between its lines looks like a number of the controller, too: after each jump of the command the velocity
    rings, the integral of what is drawn between the lines is off in proportion to the jump, and so is that of a command weight.
    An integrator that is held at the limit is simpler than one that is set back, which has a time.
    """
    if shown is None:
        return None
    found: list[Shown] = []
    names = {name for c in candidates for name in c.names} & {*shown.numbers}
    ways = [(names - {name}, False) for name in sorted(names)]
    ways += [(names, True)] * (shown.controller.velocity.tracking_time is not None)
    for kept, held in ways:
        best = next((c for c in candidates if {*c.names} <= kept), None)
        one = best and _with_limit(records, given, _first(best, candidates), fitted_form(best, given), held=held)
        if one and follow(records, one.controller) and all(one.controller != other.controller for other in found):
            found.append(one)
    return replace(shown, simpler=tuple(found))


class _Told(NamedTuple):
    """Records whose torque tells, with the first of the candidates, when their command jumped; its numbers, see `fitted_form`."""

    records: tuple[Record, ...]
    candidates: list[FormCandidate]
    fitted: Fitted


def _told(records: Sequence[Record], given: PI, candidates: Sequence[FormCandidate]) -> _Told | None:
    """The simplest form with which the torque tells when the command jumped between the lines; None: with none."""
    for best in simplest_first(candidates):
        one, fitted = fitted_with_times(best, given)
        controller = replace(controller_of(best, *fitted[:2], given, best.law.period), period=best.law.period)
        known = timed(records, limited(records, controller).controller)
        if not too_fast(controller, records[0].dt) and all(isinstance(rec, TimedRecord) for rec in known):
            return _Told(known, [one, *_first(best, candidates)[1:]], fitted)
    return None


def _first(best: FormCandidate, candidates: Sequence[FormCandidate]) -> list[FormCandidate]:
    return [best, *(c for c in candidates if c is not best)]


def _shown_quietly(
    records: Sequence[Record], law: Law, given: PI, floor: float, unknown: tuple[str, ...], most: int
) -> Shown | None:
    """The same where it follows at small torques only: the comparison uses only samples at which no limit acts."""
    # no decision: a quarter of it where few samples are left, as the row of filter_memory says
    for memory in (POLICY.filter_memory, POLICY.filter_memory // 4):
        quiet = quiet_law(law, -(-memory // law.every))
        candidates = [] if quiet is None else compared(quiet, given, floor, unknown, most=most)
        if quiet is None or not candidates:
            continue
        if law.every > 1:
            following = _following(records, candidates, given, floor)
            slowly = _form_slowly(records, given, unknown, quiet, floor, candidates, following, between=False)
            if slowly is None:
                continue
            return slowly
        best = candidates[0]
        fitted = fitted_form(best, given)
        left = shape_of(best, fitted).left
        allowed = max(_allowed(records, law, given))
        exact = float(np.abs(left).max()) <= allowed
        if exact or white_noise(left, quiet.logged):
            shown = _with_limit(records, given, candidates, fitted)
            return None if shown is None else replace(shown, exact=exact)
    return None


def _with_limit(
    records: Sequence[Record],
    given: PI,
    candidates: Sequence[FormCandidate],
    fitted: Fitted,
    part: float = POLICY.better_reason,
    held: bool = False,
) -> Shown | None:
    """A form that was shown where no limit acts, and the limit; None where there is neither, or the whole torque fits no better.

    part: of the given controller's rms error over the whole torque, the largest share that may be left.
    In a slower log, whose errors are no noise, it is also at most `each_number`, and the error at most that of measured noise.
    held: whether the integrator is held where it comes closer if it is set back.
    """
    best, (numbers, filters, cov) = candidates[0], fitted
    law = best.law
    at_limit = limited(records, replace(controller_of(best, numbers, filters, given, law.period), period=law.period))
    if held and at_limit.controller.velocity.tracking_time is not None:
        velocity = replace(at_limit.controller.velocity, anti_windup="hold", tracking_time=None)
        at_limit = replace(at_limit, controller=replace(at_limit.controller, velocity=velocity), time_std=0.0)
    if not best.names and not at_limit.gain and (law.lost is None or not best.form.unknown):
        return None
    plain = law.whole(given, period=law.period)
    as_given = records if law.lost is None else timed(records, plain)  # with the times that the given controller would tell
    before, after = run_error(as_given, plain), run_error(records, at_limit.controller)
    size = float(np.std(np.concatenate([r.torque for r in records if r.torque is not None])))
    slow = law.every > 1
    if not after < (min(part, POLICY.each_number) if slow else part) * before or (slow and after > POLICY.replay_noise * size):
        return None
    differs, gains = named(best, numbers, filters, cov, law.period), gains_of(candidates)
    found = found_of(best, fitted, given, at_limit.controller, law.period, slow)
    if at_limit.limit is not None:
        differs[OF_SETTING["torque_limit"]] = {"limit": (at_limit.limit, at_limit.std)}
        gains[OF_SETTING["torque_limit"]] = at_limit.gain
    clamp = at_limit.controller.velocity.integrator_limit
    if at_limit.windup > 0.0 and clamp is not None:
        differs[OF_SETTING["integrator_limit"]] = {"limit": (clamp, at_limit.std)}
        gains[OF_SETTING["integrator_limit"]] = at_limit.windup
    elif at_limit.windup > 0.0:
        time = at_limit.controller.velocity.tracking_time
        differs[ANTI_WINDUP] = {} if time is None else {"tracking_time": (time, at_limit.time_std)}
        gains[ANTI_WINDUP] = at_limit.windup
    if slow:
        found = with_numbers_of_limit(found, at_limit, records)
        said = found.named(found.at, found.covariance) if found.named and found.covariance is not None else {}
        differs |= {name: dict(said[name]) for name in differs if name in said}
    return Shown(
        controller=at_limit.controller,
        numbers=differs,
        gains=gains,
        rivals=rivals_of(candidates),
        before=before,
        rms=after,
        starts=0.0,
        estimated=_estimated(best, numbers, cov),
        found=found,
    )


def _estimated(best: FormCandidate, numbers: Vector, cov: Matrix) -> dict[str, tuple[float, float]]:
    return {name: (float(numbers[at]), float(np.sqrt(cov[at, at]))) for name, at in GAINS.items() if name in best.form.unknown}


def _rms(parts: Sequence[Vector]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
