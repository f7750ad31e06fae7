"""Forms of a controller compared by one criterion, and the best one fitted; see forms.py.

Where a slow log does not tell when its command jumped, each set of filters has a noise of its own (`lost_times`).
The criterion is then

    N (ln(rss/n) + ln(det(L L'))/n)   instead of   n ln(max(rss/n, floor^2))        N: lines of the log, n: steps that count
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaident.control.between import Unsure
from gaident.control.pi import PI, RULES
from gaident.diagnosis.controller.form import FEEDS, FIRST_FEED, KI, KP_R, KP_W, WEIGHTS, Form, FormCandidate
from gaident.diagnosis.controller.form_between import about, cost_of_left, on_samples, shape_between
from gaident.diagnosis.controller.form_filters import FILTER_SETS, FILTER_SETS_OF_ONE, bounds_of
from gaident.diagnosis.controller.form_regression import Law, Shape, fitted_shape, least, slope
from gaident.estimation.criterion import bic, cost_of
from gaident.estimation.projection import inverse_of
from gaident.identification.replay.causes import white_noise
from gaident.policy.table import POLICY

__all__ = [
    "Fitted",
    "compared",
    "fitted_form",
    "fitted_with_times",
    "gains_of",
    "least_seen",
    "rivals_of",
    "shape_of",
    "simplest_first",
]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Fitted: TypeAlias = tuple[Vector, Vector, Matrix]
"""(P, filters' numbers, covariance of both)."""

ROUNDS = 3  # no decision: of a solver: how many steps, it starts near
INSIDE = 1e-9  # no decision: a start: so far inside of its bound a search begins
SUM_ROUNDING = 1e-9  # no decision: of the largest torque, what a sum is exact to


def compared(
    law: Law,
    given: PI,
    floor: float,
    unknown: tuple[str, ...],
    unsure: Unsure | None = None,
    near: Shape | None = None,
    most: int = 2,
) -> list[FormCandidate]:
    """Every form with every set of at most so many filters that is needed, the best first.

    unsure: jumps between the lines of unknown times; of two filters then only those of `near` are tried, from its numbers.
    """
    candidates: list[FormCandidate] = []
    followed: int | None = None
    two = () if near is None or near.places in FILTER_SETS_OF_ONE else (near.places,)
    for places in FILTER_SETS if unsure is None else (*FILTER_SETS_OF_ONE, *two):
        if len(places) > most:
            break
        if followed is not None and len(places) > followed:
            break  # where only rounding or white noise is left, another filter improves nothing
        if unsure is not None:
            starts = [near.numbers] if near is not None and places in two else None
            one, shape = shape_between(law, unsure, places, given, starts)
        else:
            one, shape = law, fitted_shape(law, places, floor)
            for _ in range(ROUNDS if law.every > 1 else 0):
                one = one.correlated_as(shape)
                shape = fitted_shape(one, places, 0.0, [shape.numbers])
        least = least_seen(one, shape, floor)
        white = one.lost is None and white_noise(shape.left, one.logged)  # with unknown times what is left is white in any case
        if shape.rms <= POLICY.near_rounding * least or white:
            followed = len(places)
        candidates += _candidates(one, shape, given, least, unknown)
    return sorted(candidates, key=lambda c: c.criterion)


def least_seen(law: Law, shape: Shape, floor: float) -> float:
    """Root mean square [N m] below which what such filters leave shows nothing; floor: that of `law_of`."""
    own = floor if law.every == 1 or law.lost is not None else law.floor
    return float(np.hypot(own, law.unseen(shape)))


def _forms(given: PI, unknown: tuple[str, ...]) -> Iterator[Form]:
    """Every form, except integration rules that free gains reproduce exactly: no log shows these."""
    gains: tuple[tuple[str, ...], ...] = ((), ("kp",), ("ki",), ("kp", "ki")) if given.ki else ((), ("kp",))
    gains = tuple(free for free in gains if set(unknown) <= set(free))
    feeds = ((), FEEDS[:1], FEEDS[1:], FEEDS)
    for rule, free, weight, feed, starts in product(RULES, gains, WEIGHTS, feeds, (False, True)):
        if rule != given.rule and (not given.ki or ("kp" in free and weight != "none")):
            continue
        yield Form(rule, free, weight, feed, starts, unknown, given.rule)


def _candidates(law: Law, shape: Shape, given: PI, floor: float, unknown: tuple[str, ...]) -> Iterator[FormCandidate]:
    """Every form with these filters: one small least squares each, linear in the filters' numbers around those of `shape`."""
    table = law.columns(shape.places, shape.numbers)
    around = np.column_stack([table, _slopes(law, shape), law.logged])
    R: Matrix = np.linalg.qr(around)[1]
    p, n = table.shape[1], len(law.logged)
    linear, slopes, logged = R[:, :p], R[:, p:-1], R[:, -1]
    for form in _forms(given, unknown):
        if form.starts and law.stretch is not None and (law.every == 1 or law.lost is not None):
            continue  # each stretch has an integral of its own
        fixed, moved = form.constraints(given, law)
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
        if law.lost is None:
            cost = bic(max(left / n, floor**2), n, 0)
        else:
            cost = len(law.torque) * cost_of_left(law, np.full(n, np.sqrt(left / n)))
        yield FormCandidate(form, shape, law, free, k, float(cost + _price(law, k, form.chosen)))


def _price(law: Law, count: int, chosen: int) -> float:
    """Cost of numbers and settings: that of the BIC; in a slower log, each must reduce the error to the share `each_number`."""
    if law.every == 1:
        n = len(law.logged)
        return cost_of(count, n) + POLICY.form_choice * chosen
    n = len(law.logged) if law.lost is None else len(law.torque)
    return float(-2.0 * n * np.log(POLICY.each_number) * (count + chosen))  # no decision: a formula


def _slopes(law: Law, shape: Shape) -> Matrix:
    """(n, filters' numbers) of the torque over each number."""
    slopes = [
        slope(lambda x: law.columns(shape.places, x) @ shape.coefficients, shape.numbers, k) for k in range(len(shape.numbers))
    ]
    return np.array(slopes).reshape(len(slopes), len(law.logged)).T


def fitted_with_times(best: FormCandidate, given: PI) -> tuple[FormCandidate, Fitted]:
    """A form with the times that are the most probable ones with its numbers, and these, see `fitted_form`.

    Jumps fall on the controller's samples: on which of r, costs 2 ln r each; that stands where it has the higher evidence.
    """
    fitted = fitted_form(best, given)
    for _ in range(ROUNDS):
        best, fitted = _again(best, about(best.law, shape_of(best, fitted)), fitted, given)
    there, refitted = _again(best, on_samples(best.law, shape_of(best, fitted)), fitted, given)
    there, refitted = _again(there, about(there.law, shape_of(there, refitted)), refitted, given)
    n, jumps = len(best.law.torque), 0 if best.law.lost is None else int(np.sum(best.law.lost.steps.unsure.jump))
    choices = 2.0 * jumps * np.log(best.law.every)  # no decision: a formula
    free, chosen = (n * cost_of_left(c.law, shape_of(c, f).left) for c, f in ((best, fitted), (there, refitted)))
    return (there, refitted) if chosen + choices < free else (best, fitted)


def _again(best: FormCandidate, law: Law, fitted: Fitted, given: PI) -> tuple[FormCandidate, Fitted]:
    """The form fitted again, of another regression, from these numbers on."""
    numbers, filters, _ = fitted
    table = law.columns(best.shape.places, filters) @ best.form.of_columns(len(numbers), law.period)
    fixed, moved = best.form.constraints(given, law)
    free = least(table @ moved, law.logged - table @ fixed)[0]
    again = replace(best, law=law, shape=shape_of(best, fitted), free=free)
    return again, fitted_form(again, given)


def shape_of(best: FormCandidate, fitted: Fitted) -> Shape:
    """What the numbers make, and what they leave."""
    numbers, filters, _ = fitted
    coefficients = best.form.of_columns(len(numbers), best.law.period) @ numbers
    left = best.law.logged - best.law.columns(best.shape.places, filters) @ coefficients
    return Shape(best.shape.places, filters, coefficients, left)


def gains_of(candidates: Sequence[FormCandidate]) -> dict[str, float]:
    best = candidates[0]
    without = {name: [c.criterion for c in candidates if name not in c.names] for name in best.names}
    return {name: min(others) - best.criterion if others else np.inf for name, others in without.items()}


def simplest_first(candidates: Sequence[FormCandidate]) -> list[FormCandidate]:
    """The forms to try: where the given gains leave as little, settings without a number of their own, before other numbers.

    Forms of fewer numbers that the criterion does not tell from the best come before it.
    """
    plain = [c for c in candidates if not c.names]
    as_free = [c for c in candidates if plain and c.count == plain[0].count and c.shape is plain[0].shape and not c.form.free]
    alike = [c for c in candidates if c.criterion - candidates[0].criterion < POLICY.rival_margin]
    fewer = sorted((c for c in alike if c.count < candidates[0].count), key=lambda c: c.count)
    return list(dict.fromkeys([*as_free[:1], *plain[:1], *fewer[:1], candidates[0]]))


def rivals_of(candidates: Sequence[FormCandidate]) -> tuple[tuple[str, ...], ...]:
    close = [
        c for c in candidates if c.criterion - candidates[0].criterion < POLICY.rival_margin and c.count <= candidates[0].count
    ]
    return tuple(dict.fromkeys(c.names for c in close if c.names and set(c.names) != set(candidates[0].names)))


def fitted_form(best: FormCandidate, given: PI) -> Fitted:
    """(P, filters' numbers, covariance of both) of a form, by least squares on the replay itself."""
    from scipy.optimize import least_squares

    form, shape, law = best.form, best.shape, best.law
    fixed, moved = form.constraints(given, law)
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
    wide = form.constraints(given, law)[1] if form.weight != "none" else np.column_stack([moved, np.eye(len(fixed))[KP_R]])
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
