"""How the estimated numbers of the controller change a model, and how the model corrects these numbers.

    V(x, z) = |v(x, z)|^2/s^2 + (z - z_0)' C^-1 (z - z_0)

x: numbers of the model, z: of the controller, z_0 and C: as the torque showed them. Where no torque did, the second part is 0.
With E the slopes of the whitened errors v over z, J over x, and P what takes out of E all that x can explain,

    cov x = s^2 (J J')^-1 + S M S',   S = -(J J')^-1 J E',   M = C                                where x alone is fitted
                                                             M = (C^-1 + E P E'/s^2)^-1           where z is fitted too

This is the part of x in the covariance of both together.
The slopes E are differences by one deviation in the directions in which z is independent.
So a number with a large deviation, such as that of a filter, counts with its full change and not with its slope.

z is found by steps of Gauss and Newton, after each of which x is fitted again (variable projection, Golub and Pereyra 1973):

    (E P E' + s^2 C^-1) dz = -(E P v + s^2 C^-1 (z - z_0)),   the second part of each sum only where a torque showed z_0
"""

from __future__ import annotations

from collections.abc import Callable, MutableMapping
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Controller
from gaident.control.found import FoundNumbers
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import cost_of, effective_samples, gained
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import NoiseFilter
from gaident.estimation.objective import LOST, Fit, Hypothesis, Innovations, Objective
from gaident.estimation.projection import WORST, inverse_of, project_out
from gaident.estimation.records.driven import freed, torque_in
from gaident.models.drive_torque import driven_by, torque_of
from gaident.policy.table import POLICY

__all__ = [
    "answers",
    "covariance_of_numbers",
    "moved",
    "numbers_in",
    "of_ages",
    "of_controller",
    "of_numbers",
    "refined",
    "seen_in",
    "slopes",
    "under_other",
    "variance_of",
    "whole_of",
    "worth",
]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

SMALLEST = 1e-300  # no decision: no division by 0


def moved(data: DataSet, by: Vector) -> DataSet | None:
    """The data with the found numbers of the controller moved; None where it refuses them."""
    assert data.found is not None and data.controller is not None
    found = data.found.moved(by)
    here, there = data.found.controller, found.controller
    return None if here is None or there is None else under_other(data, here, there, found)


def under_other(data: DataSet, here: Controller, there: Controller, found: FoundNumbers | None) -> DataSet:
    """The data of a controller as that of another one; found: the numbers of that."""
    assert data.controller is not None
    pairs = [(_made(r, here), _made(r, there)) for r in data.read or data.records]
    driven = tuple(r.with_channels(torque=torque_in(r) + v - u) for r, (u, v) in zip(data.driven, pairs, strict=True))
    own = zip(data.controller.limits, here.limits, there.limits, strict=True)
    limits = (new if shown == old and np.isfinite(new) else shown for shown, old, new in own)  # those of the records stay
    return replace(data, controller=there.with_limits(*limits), driven=driven, free=freed(data.records, driven), found=found)


def whole_of(data: DataSet, before: DataSet) -> DataSet:
    """The whole records of a search's data, under its controller with its numbers; before: the same, under earlier ones."""
    if not data.places:
        return data
    if data.controller is None or before.controller is None or data.controller == before.controller:
        return before
    return under_other(before, before.controller, data.controller, data.found)


_MADE: MutableMapping[Record, dict[Controller, Vector]] = WeakKeyDictionary()
KEPT = 4  # no decision: torques of one record that are kept, one for each of the last controllers: moves begin at the same one


def _made(rec: Record, controller: Controller) -> Vector:
    """The torque over each line [N m], as this controller makes it where the record has none, or fewer lines than it samples."""
    kept = _MADE.setdefault(rec, {})
    made = kept.pop(controller, None)
    if made is None:
        pi = bare_pi(controller)
        made = torque_of(rec, pi) if pi is not None else torque_in(driven_by(rec, controller))
        made.setflags(write=False)
    kept[controller] = made  # the last one that was asked for
    while len(kept) > KEPT:
        kept.pop(next(iter(kept), controller), None)
    return made


def _joined(data: DataSet) -> DataSet:
    """The data with numbers that are fitted with the model from now on."""
    return data if data.found is None else replace(data, found=data.found.joined())


def variance_of(objective: Objective, fit: Fit, v: Vector) -> float:
    """Mean square of the whitened errors; of output errors of colour it grows by samples over independent samples.

    Such samples contain less than their number. A cost that is a mean over several sensors weighs each of their errors less.
    """
    dof = max(objective.count - int(np.count_nonzero(fit.parameters.steps() > 0.0)), 1.0)
    repeats = 1.0 if isinstance(objective.family, Innovations) else objective.count / effective_samples(v)
    return repeats * float(v @ v) / dof / objective.sensors


def of_controller(objective: Objective, fit: Fit) -> Matrix:
    """What the numbers of the controller that were found, and its clock, bring into the covariance of x; 0 for neither."""
    return of_numbers(objective, fit) + of_ages(objective, fit)


def of_numbers(objective: Objective, fit: Fit) -> Matrix:
    """The part of the numbers of the controller that were found; 0 where none were."""
    v, J = objective.linearised(fit.hypothesis, fit.x, fit.noise)
    part, seen = np.zeros((len(fit.x), len(fit.x))), seen_in(fit, J)
    if len(seen) and fit.predictor.data.found is not None:
        E = _changes(objective, fit.hypothesis, fit.x, fit.noise, v)
        S = answers(J[seen], E)
        part[np.ix_(seen, seen)] = S @ _spread(objective, fit, v, J, E) @ S.T
    return part


def of_ages(objective: Objective, fit: Fit) -> Matrix:
    """The part of an age of the velocity that the model does not exclude; 0 where there is one alone."""
    J = objective.linearised(fit.hypothesis, fit.x, fit.noise)[1]
    others = [f.x - fit.x for age in fit.predictor.data.other_ages if (f := _of_age(objective, fit, age)) is not None]
    if not len(seen_in(fit, J)) or not others:
        return np.zeros((len(fit.x), len(fit.x)))
    furthest = max(others, key=lambda move: float(np.sum((move @ J) ** 2)))
    return np.outer(furthest, furthest)


def seen_in(fit: Fit, J: Matrix) -> NDArray[np.intp]:
    """The coordinates that a fit moves and that show in the errors, of the slopes J."""
    moved = np.flatnonzero(fit.parameters.steps() > 0.0)
    return np.array([i for i in moved if np.all(np.isfinite(J[i])) and np.any(J[i])], dtype=np.intp)


def covariance_of_numbers(objective: Objective, fit: Fit) -> Matrix:
    """The covariance of the numbers themselves (k, k)."""
    found = numbers_in(fit.hypothesis)
    v, J, E = slopes(objective, fit.hypothesis, fit.x, fit.noise)
    spread = _spread(objective, fit, v, J, E)
    return np.asarray(found.directions.T @ spread @ found.directions)


def refined(
    objective: Objective,
    fit: Fit,
    data: DataSet | None = None,
    noise: NoiseFilter | None = None,
    too_far: Callable[[Fit], bool] | None = None,
) -> Fit:
    """The fit with the numbers of the controller moved to where the errors of the model, and the torque, have them.

    data, noise: other ones than those of the fit. too_far: whether a model is not followed, where its cost falls slowly.
    """
    here = _under(objective, _joined(data or fit.predictor.data), fit, noise)
    for _ in range(POLICY.usual):
        v, J, E = slopes(objective, here.hypothesis, here.x, here.noise)
        found = numbers_in(here.hypothesis)
        s2, rest = variance_of(objective, here, v), project_out(J, E)
        A, b = rest @ rest.T, rest @ v
        if found.covariance is not None:
            A, b = A + s2 * np.eye(len(A)), b + s2 * found.deviations_off
        step = -inverse_of(A) @ b
        for part in (1.0, 0.3, 0.1):  # no decision: of a solver: shares of a step
            to = moved(here.predictor.data, part * step @ found.directions)
            trial = here if to is None else _under(objective, to, here)
            fall = _cost(here, s2) - _cost(trial, s2)
            if fall > 0.0:
                break
        else:
            break
        here = trial
        if ls.negligible(objective, fall, here.cost):
            break
        if too_far is not None and fall < POLICY.slow_fall * here.cost and too_far(here):
            break
    return here


def worth(objective: Objective, fit: Fit) -> float:
    """The cost of the changed numbers, to be added to the criterion of the fit [BIC units]."""
    found = fit.predictor.data.found
    if found is None or found.shown is None or found.covariance is None:
        return 0.0
    off = found.deviations_off
    return float(off @ off) + cost_of(len(found.directions), objective.information)


def _under(objective: Objective, data: DataSet, fit: Fit, noise: NoiseFilter | None = None) -> Fit:
    """The model fitted over other data; noise: another filter than that of the fit."""
    return ls.fit(objective, fit.hypothesis.over(data), fit.x, fit.noise if noise is None else noise, POLICY.usual)


def numbers_in(hypothesis: Hypothesis) -> FoundNumbers:
    """The numbers of the controller in the data of a model."""
    found = hypothesis.predictor.data.found
    assert found is not None
    return found


def _cost(fit: Fit, variance: float) -> float:
    """s^2 V(x, z)."""
    if fit.cost >= WORST:
        return WORST
    off = numbers_in(fit.hypothesis).deviations_off
    return float(fit.cost + variance * (off @ off))


def slopes(objective: Objective, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter) -> tuple[Vector, Matrix, Matrix]:
    """(whitened errors v, their slopes J over x, their change E with each move of the controller's numbers)."""
    v, J = objective.linearised(hypothesis, x, noise)
    return v, J, _changes(objective, hypothesis, x, noise, v)


def _changes(objective: Objective, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, v: Vector) -> Matrix:
    """(m, samples): how the whitened errors change along each direction of the controller's numbers."""
    directions = numbers_in(hypothesis).directions
    return np.array([_change(objective, hypothesis, x, noise, v, by) for by in directions]).reshape(len(directions), len(v))


def answers(J: Matrix, E: Matrix) -> Matrix:
    """(k, m): how the coordinates with the slopes J (k, samples) move where the errors change by E (m, samples)."""
    return np.asarray(-inverse_of(J @ J.T) @ (J @ E.T))


def _of_age(objective: Objective, fit: Fit, age: float) -> Fit | None:
    """The model with another age of the velocity; None where its errors are clearly larger.

    Where the torque does not follow from the controller, it is not known between the lines of a log that may be slower.
    A wrong age may then compensate for the unknown torque, so that no age is excluded.
    """
    data = fit.predictor.data.aged(age)
    other = _under(objective, data, fit) if data.found is None or not data.found.joint else refined(objective, fit, data)
    more = gained(other.cost, fit.cost, objective.information)
    return None if data.known_between and more > POLICY.rival_margin else other


def _change(objective: Objective, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, v: Vector, by: Vector) -> Vector:
    """How the whitened errors change where the numbers of the controller are moved.

    Moves by a deviation are made in both directions, and the larger change counts.
    A move by the step of a difference is made in the first direction that the numbers allow.
    """
    found = numbers_in(hypothesis)
    rows = [np.zeros(len(v))]
    for sign in (1.0, -1.0):
        data = moved(hypothesis.predictor.data, sign * by)
        if data is None:
            continue
        driven = hypothesis.over(data)
        if float(np.abs(objective.errors(driven, x[None, :])).max()) < LOST:
            rows.append(sign * (objective.whitened_at(driven, x, noise) - v))
            if found.covariance is None and np.array_equal(numbers_in(driven).at, found.at + sign * by):
                break
    return max(rows, key=lambda row: float(row @ row))


def _spread(objective: Objective, fit: Fit, v: Vector, J: Matrix, E: Matrix) -> Matrix:
    """M in the directions of the moves."""
    found = numbers_in(fit.hypothesis)
    if not found.joint or not len(E):
        return np.eye(len(E))
    rest = project_out(J, E)
    inner = rest @ rest.T / max(variance_of(objective, fit, v), SMALLEST)
    if found.covariance is not None:
        inner = inner + np.eye(len(E))
    return inverse_of(inner)
