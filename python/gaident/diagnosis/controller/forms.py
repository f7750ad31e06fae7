"""Which form of controller the logged torques show, where a bare PI with the given gains does not make them.

A form is the regression of form_regression.py under constraints: gains as given or free, a rule of integration, a command weight,
feedforwards, filters. All forms are compared by one criterion, with n samples, k free numbers and m settings chosen of three,

    n ln(max(rss/n, floor^2)) + k ln n + 2 m ln 3

floor: the root mean square error of a replay by the rounding of the log; a smaller error shows nothing.
The least counts, and only if the torque follows from it: the controller runs on all measured signals.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Cascade
from gaident.control.found import FoundNumbers
from gaident.control.pi import PI, RULES
from gaident.data.record import Record
from gaident.diagnosis.controller.form import (
    FEEDS,
    FIRST_FEED,
    GAINS,
    KI,
    KP_R,
    KP_W,
    WEIGHTS,
    Form,
    FormCandidate,
    controller_of,
    found_of,
    named,
)
from gaident.diagnosis.controller.form_regression import (
    FILTER_SETS,
    FILTER_SETS_OF_ONE,
    Law,
    Shape,
    bounds_of,
    fitted_shape,
    law_of,
    least,
    quiet_law,
    slope,
)
from gaident.diagnosis.controller.slow_forms import limited, run_error, too_fast
from gaident.diagnosis.library.settings import OF_SETTING
from gaident.estimation.criterion import bic, cost_of
from gaident.estimation.projection import inverse_of
from gaident.identification.replay.causes import white_noise
from gaident.identification.replay.replay import tolerance_of, velocity_steps
from gaident.policy.table import POLICY

__all__ = ["Form", "Shown", "form_shown"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

INSIDE = 1e-9  # no decision: a start: so far inside of its bound a search begins
SUM_ROUNDING = 1e-9  # no decision: of the largest torque, what a sum is exact to


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


def form_shown(records: Sequence[Record], given: PI, unknown: tuple[str, ...] = (), every: int = 1) -> Shown | None:
    """The simplest controller that makes the logged torques; None where none does, or where the given PI makes them.

    unknown: gains of `given` that were not given but estimated. every: controller samples to a line of the log.
    """
    if given.loop != "sampled" or any(r.dt != records[0].dt for r in records):
        return None
    shown = []
    for steps in velocity_steps(records) if every == 1 else ((),):
        regression = law_of(records, given, every, steps)
        found = None if regression is None else _form_of(records, given, unknown, *regression)
        if found is not None and found.exact:
            return found
        shown.append(found)
    # The finest rounding comes first: errors of a coarser rounding are not white, and forms may fit them by numbers too many.
    return next((found for found in reversed(shown) if found is not None), None)


def _form_of(records: Sequence[Record], given: PI, unknown: tuple[str, ...], law: Law, floor: float) -> Shown | None:
    """The same for one assumption on the log's rounding."""
    candidates = _compared(law, given, floor, unknown)
    if not candidates:
        return None
    if law.every > 1:
        return _shown_slowly(records, law, given, candidates, floor)
    shown = _shown(records, law, given, candidates) if candidates[0].names else None
    return shown or _shown_quietly(records, law, given, floor, unknown)


def _compared(law: Law, given: PI, floor: float, unknown: tuple[str, ...]) -> list[FormCandidate]:
    """Every form with every set of filters that is needed, the best first."""
    candidates: list[FormCandidate] = []
    followed: int | None = None
    for places in FILTER_SETS if law.every == 1 else FILTER_SETS_OF_ONE:
        if followed is not None and len(places) > followed:
            break  # where only rounding or white noise is left, another filter improves nothing
        shape = fitted_shape(law, places, floor)
        least = float(np.hypot(floor, law.unseen(shape)))
        if shape.rms <= POLICY.near_rounding * least or white_noise(shape.left, law.logged):
            followed = len(places)
        candidates += _candidates(law, shape, given, least, unknown)
    return sorted(candidates, key=lambda c: c.criterion)


def _allowed(records: Sequence[Record], law: Law, controller: PI) -> list[float]:
    """By how much each logged torque may be off [N m]."""
    logged = [(r, r.command, r.torque) for r in records]
    return [
        tolerance_of(r, c, controller, u, q)
        for (r, c, u), q in zip(logged, law.steps, strict=True)
        if c is not None and u is not None
    ]


def _forms(given: PI, unknown: tuple[str, ...]) -> Iterator[Form]:
    """Every form, except integration rules that free gains reproduce exactly: no log shows these."""
    gains: tuple[tuple[str, ...], ...] = ((), ("kp",), ("ki",), ("kp", "ki")) if given.ki else ((), ("kp",))
    gains = tuple(free for free in gains if set(unknown) <= set(free))
    feeds = ((), FEEDS[:1], FEEDS[1:], FEEDS)
    for rule, free, weight, feed, starts in product(RULES, gains, WEIGHTS, feeds, (False, True)):
        if rule != "trapezoidal" and (not given.ki or ("kp" in free and weight != "none")):
            continue
        yield Form(rule, free, weight, feed, starts, unknown)


def _candidates(law: Law, shape: Shape, given: PI, floor: float, unknown: tuple[str, ...]) -> Iterator[FormCandidate]:
    """Every form with these filters: one small least squares each, linear in the filters' numbers around those of `shape`."""
    table = law.columns(shape.places, shape.numbers)
    around = np.column_stack([table, _slopes(law, shape), law.logged])
    R: Matrix = np.linalg.qr(around)[1]
    p, n = table.shape[1], len(law.logged)
    linear, slopes, logged = R[:, :p], R[:, p:-1], R[:, -1]
    for form in _forms(given, unknown):
        if form.starts and law.stretch is not None and law.every == 1:
            continue  # each stretch has an integral of its own
        fixed, moved = form.constraints(given, len(law.lengths))
        B = form.of_columns(p, law.period)
        M = np.column_stack([linear @ B @ moved, slopes])
        wanted = logged - linear @ B @ fixed
        free, left = least(M, wanted)
        if np.any(np.abs(free[moved.shape[1] :]) > POLICY.slope_reach):  # the slope holds no longer
            free, left = least(M[:, : moved.shape[1]], wanted)
        numbers = fixed + moved @ free[: moved.shape[1]]
        if min(numbers[KP_W], numbers[KP_R], numbers[KI]) < -POLICY.negligible * float(np.abs(numbers[:FIRST_FEED]).max()):
            continue
        k = M.shape[1]
        criterion = bic(max(left / n, floor**2), n, 0) + _price(law, k, form.chosen)
        yield FormCandidate(form, shape, free, k, float(criterion))


def _price(law: Law, count: int, chosen: int) -> float:
    """Cost of numbers and settings: that of the BIC; in a slower log, each must reduce the error to the share `each_number`."""
    n = len(law.logged)
    if law.every == 1:
        return cost_of(count, n) + POLICY.form_choice * chosen
    return float(-2.0 * n * np.log(POLICY.each_number) * (count + chosen))  # no decision: a formula


def _slopes(law: Law, shape: Shape) -> Matrix:
    """(n, filters' numbers) of the torque over each number."""
    slopes = [
        slope(lambda x: law.columns(shape.places, x) @ shape.coefficients, shape.numbers, k) for k in range(len(shape.numbers))
    ]
    return np.array(slopes).reshape(len(slopes), len(law.logged)).T


def _shown(records: Sequence[Record], law: Law, given: PI, candidates: Sequence[FormCandidate]) -> Shown | None:
    """The best candidate fitted and run as a whole on every sample; None where the torque does not follow from it."""
    best = candidates[0]
    numbers, filters, cov = _fitted(law, best, given)
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
        gains=_gains(candidates),
        rivals=_rivals(candidates),
        before=_rms(before),
        rms=_rms(off),
        starts=float(np.abs(starts).max()),
        estimated=_estimated(best, numbers, cov),
        found=found_of(best, (numbers, filters, cov), given, controller, law.period, slow=False),
        exact=exact,
    )


def _shown_slowly(
    records: Sequence[Record], law: Law, given: PI, candidates: Sequence[FormCandidate], floor: float
) -> Shown | None:
    """The same for a slower log; None where more is left than another velocity between its lines could make."""
    negligible = POLICY.negligible * float(np.abs(law.torque).max())
    # Where the given controller leaves as little, no other numbers are searched, only settings without a number of their own.
    plain = [c for c in candidates if not c.names]
    as_free = [c for c in candidates if plain and c.count == plain[0].count and c.shape is plain[0].shape and not c.form.free]
    for best in (*as_free[:1], *plain[:1], candidates[0]):
        numbers, filters, cov = _fitted(law, best, given)
        left = law.logged - law.columns(best.shape.places, filters) @ (best.form.of_columns(len(numbers), law.period) @ numbers)
        least = float(np.hypot(floor, law.unseen(best.shape)))
        follows = _rms([left]) <= max(POLICY.near_rounding * least, negligible)
        if follows and not too_fast(controller_of(best, numbers, filters, given, law.period), records[0].dt):
            others = [best, *(c for c in candidates if c is not best)]
            if (shown := _with_limit(records, law, given, others, (numbers, filters, cov))) is not None:
                return shown
            break
    # Noise on the logged velocity leaves more than interpolation; with a limit the given controller may explain all of it.
    for best in plain[:1]:
        others = [best, *(c for c in candidates if c is not best)]
        return _with_limit(records, law, given, others, _fitted(law, best, given), float(np.sqrt(POLICY.replay_left)))
    return None


def _shown_quietly(records: Sequence[Record], law: Law, given: PI, floor: float, unknown: tuple[str, ...]) -> Shown | None:
    """The same where it follows at small torques only: the comparison uses only samples at which no limit acts."""
    # no decision: a quarter of it where few samples are left, as the row of filter_memory says
    for memory in (POLICY.filter_memory, POLICY.filter_memory // 4):
        quiet = quiet_law(law, memory)
        candidates = [] if quiet is None else _compared(quiet, given, floor, unknown)
        if quiet is None or not candidates:
            continue
        best = candidates[0]
        numbers, filters, cov = _fitted(quiet, best, given)
        made = quiet.columns(best.shape.places, filters) @ (best.form.of_columns(len(numbers), law.period) @ numbers)
        left = quiet.logged - made
        allowed = max(_allowed(records, law, given))
        exact = float(np.abs(left).max()) <= allowed
        if exact or white_noise(left, quiet.logged):
            shown = _with_limit(records, quiet, given, candidates, (numbers, filters, cov))
            return None if shown is None else replace(shown, exact=exact)
    return None


def _with_limit(
    records: Sequence[Record],
    law: Law,
    given: PI,
    candidates: Sequence[FormCandidate],
    fitted: tuple[Vector, Vector, Matrix],
    part: float = POLICY.better_reason,
) -> Shown | None:
    """A form that was shown where no limit acts, and the limit; None where there is neither, or the whole torque fits no better.

    part: of the given controller's rms error over the whole torque, the largest share that may be left.
    In a slower log, whose errors are no noise, it is also at most `each_number`, and the error at most that of measured noise.
    """
    best, (numbers, filters, cov) = candidates[0], fitted
    at_limit = limited(records, replace(controller_of(best, numbers, filters, given, law.period), period=law.period))
    if not best.names and not at_limit.gain:
        return None
    before, after = run_error(records, Cascade(given, law.period)), run_error(records, at_limit.controller)
    size = float(np.std(np.concatenate([r.torque for r in records if r.torque is not None])))
    slow = law.every > 1
    if not after < (min(part, POLICY.each_number) if slow else part) * before or (slow and after > POLICY.replay_noise * size):
        return None
    differs, gains = named(best, numbers, filters, cov, law.period), _gains(candidates)
    if at_limit.limit is not None:
        differs[OF_SETTING["torque_limit"]] = {"limit": (at_limit.limit, at_limit.std)}
        gains[OF_SETTING["torque_limit"]] = at_limit.gain
    return Shown(
        controller=at_limit.controller,
        numbers=differs,
        gains=gains,
        rivals=_rivals(candidates),
        before=before,
        rms=after,
        starts=0.0,
        estimated=_estimated(best, numbers, cov),
        found=found_of(best, fitted, given, at_limit.controller, law.period, law.every > 1),
    )


def _gains(candidates: Sequence[FormCandidate]) -> dict[str, float]:
    best = candidates[0]
    without = {name: [c.criterion for c in candidates if name not in c.names] for name in best.names}
    return {name: min(others) - best.criterion if others else np.inf for name, others in without.items()}


def _rivals(candidates: Sequence[FormCandidate]) -> tuple[tuple[str, ...], ...]:
    close = [
        c for c in candidates if c.criterion - candidates[0].criterion < POLICY.rival_margin and c.count <= candidates[0].count
    ]
    return tuple(dict.fromkeys(c.names for c in close if c.names and set(c.names) != set(candidates[0].names)))


def _estimated(best: FormCandidate, numbers: Vector, cov: Matrix) -> dict[str, tuple[float, float]]:
    return {name: (float(numbers[at]), float(np.sqrt(cov[at, at]))) for name, at in GAINS.items() if name in best.form.unknown}


def _rms(parts: Sequence[Vector]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def _fitted(law: Law, best: FormCandidate, given: PI) -> tuple[Vector, Vector, Matrix]:
    """(P, filters' numbers, covariance of both) of a form, by least squares on the replay itself."""
    from scipy.optimize import least_squares

    form, shape = best.form, best.shape
    fixed, moved = form.constraints(given, len(law.lengths))
    B = form.of_columns(len(fixed), law.period)
    m = moved.shape[1]
    size = float(np.sqrt(np.mean(law.logged**2)))

    def off(x: Vector) -> Vector:
        return (law.columns(shape.places, x[m:]) @ (B @ (fixed + moved @ x[:m])) - law.logged) / size

    start = np.concatenate([best.free[:m], shape.numbers])
    x = start
    if len(shape.numbers):
        low, high = (
            np.concatenate([np.full(m, end), b]) for end, b in zip((-np.inf, np.inf), bounds_of(shape.places), strict=True)
        )
        start = np.clip(start, low + INSIDE, high - INSIDE)
        x = start
        found = least_squares(
            off, start, bounds=(low, high), x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-15, max_nfev=POLICY.final
        )
        x = found.x if np.sum(found.fun**2) <= np.sum(off(start) ** 2) else start
    # A weight of exactly 0 was chosen; its deviation is that of a free weight.
    wide = (
        form.constraints(given, len(law.lengths))[1]
        if form.weight != "none"
        else np.column_stack([moved, np.eye(len(fixed))[KP_R]])
    )
    table = law.columns(shape.places, x[m:])
    coefficients = B @ (fixed + moved @ x[:m])
    slopes = _slopes(law, Shape(shape.places, x[m:], coefficients, shape.left))
    J = np.column_stack([table @ B @ wide, slopes])
    sizes = np.linalg.norm(J, axis=0)
    sizes[sizes == 0.0] = 1.0
    variance = max(float(np.mean((size * off(x)) ** 2)), (SUM_ROUNDING * float(np.abs(law.logged).max())) ** 2)
    spread = variance * inverse_of(J.T @ J)
    here = np.linalg.lstsq(J / sizes, law.logged - table @ coefficients, rcond=1e-12)[0] / sizes
    for other in law.others:  # how far the numbers move with another velocity between the lines
        columns = other.columns(shape.places, x[m:])
        slopes = _slopes(other, Shape(shape.places, x[m:], coefficients, shape.left))
        table = np.column_stack([columns @ B @ wide, slopes]) / sizes
        there = np.linalg.lstsq(table, other.logged - columns @ coefficients, rcond=1e-12)[0] / sizes
        spread += np.outer(there - here, there - here)
    k = wide.shape[1]
    outward = np.zeros((len(fixed) + len(shape.numbers), J.shape[1]))
    outward[: len(fixed), :k] = wide
    outward[len(fixed) :, k:] = np.eye(len(shape.numbers))
    return fixed + moved @ x[:m], x[m:], outward @ spread @ outward.T
