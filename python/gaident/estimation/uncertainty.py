"""Standard deviations of the parameters of an extended model.

Whitened, least squares has the covariance s^2 (J J')^-1 over x; parameters in the table's own units follow to first order.

What a model gets wrong is no such noise: it is large where the motion is, and goes on for longer than any filter knows.
No deviation is smaller than that of the covariance which holds for errors of any size and colour whose memory is short beside the
record (White 1980; Newey and West 1987), neither of x nor of any number that follows from it,

    (J J')^-1 S (J J')^-1,   S the long-run covariance of J v (`regression.long_run`)

H. White, Econometrica 48(4):817-838, 1980.

Beside a gap these are too small: x changes the times of the impacts, and a slope at one point does not show that.
There every standard deviation is at least that of the jackknife over K blocks of the records,

    var x = (K-1)/K sum_k (x_(k) - mean x_(k))^2,   x_(k) fitted without block k

Measured on eight hidden gaps: errors of up to 14 deviations of the first kind, 3.5 of the second kind.
On one gap under a coloured torque, whose impacts no model predicts, the error was 17 deviations of the second kind.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gaident.errors import ModelError
from gaident.estimation.found_numbers import of_ages, of_numbers, seen_in, variance_of
from gaident.estimation.least_squares import fit as fitted
from gaident.estimation.objective import LOST, Fit, Objective
from gaident.estimation.parameterisation import parameter_names
from gaident.estimation.projection import inverse_of
from gaident.estimation.records.places import Place
from gaident.estimation.regression.regression import larger_of, long_run
from gaident.models.effect_rows import by_wave, wave_of
from gaident.models.effects import row_of
from gaident.models.factors import model_numbers
from gaident.models.model import Model
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["age_part", "controller_part", "covariance_of", "estimates_of", "local_covariance", "model_covariance"]

BLOCKS = 8  # no decision: how many parts of a jackknife

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def covariance_of(objective: Objective, fit: Fit) -> Matrix:
    """Covariance of x, computed once for a fit; infinite where the record does not determine it, 0 for entries not fitted."""
    return objective.once(("covariance", fit.key), lambda: _covariance(objective, fit))


def local_covariance(objective: Objective, fit: Fit) -> Matrix:
    """The part of the covariance that the slopes at x and the errors there make."""
    return _at_one_point(objective, fit, *objective.linearised(fit.hypothesis, fit.x, fit.noise))


def controller_part(objective: Objective, fit: Fit) -> Matrix:
    """The part of the covariance that comes from the numbers of the controller. Computed once for a fit."""
    numbers = objective.once(("part of the numbers", fit.key), lambda: of_numbers(objective, fit))
    return numbers + age_part(objective, fit)


def age_part(objective: Objective, fit: Fit) -> Matrix:
    """What of that part comes from the age of the velocity, where the records do not show it. Computed once for a fit."""
    return objective.once(("part of the age", fit.key), lambda: of_ages(objective, fit))


def _covariance(objective: Objective, fit: Fit) -> Matrix:
    v, J = objective.linearised(fit.hypothesis, fit.x, fit.noise)
    found = _of_the_errors(objective, fit, v, J) + _of_the_steps(objective, fit, J) + controller_part(objective, fit)
    return found + _of_the_angle(objective, fit)


def _of_the_errors(objective: Objective, fit: Fit, v: Vector, J: Matrix) -> Matrix:
    cov = _at_one_point(objective, fit, v, J)
    if not fit.impacts:
        return cov
    local = np.sqrt(np.diag(cov))
    known = (local > 0.0) & np.isfinite(local)
    larger = np.ones(len(local))
    larger[known] = np.maximum(_jackknife(objective, fit)[known] / local[known], 1.0)
    return cov * np.outer(larger, larger)


def _of_the_steps(objective: Objective, fit: Fit, J: Matrix) -> Matrix:
    """The square of what the steps of the simulation move in x, by a fit under half the step."""
    part, seen = np.zeros((len(fit.x), len(fit.x))), seen_in(fit, J)
    if not fit.effects or not len(seen):
        return part
    finer = fit.hypothesis.over(replace(fit.predictor.data, finer=2))  # no decision: half a step
    if np.abs(objective.errors(finer, fit.x[None, :])).max() < LOST:
        moved = fitted(objective, finer, fit.x, fit.noise, POLICY.short).x[seen] - fit.x[seen]
        # An error of first order in the step is twice what half the step changes; one of second order, 4/3 of it.
        part[np.ix_(seen, seen)] = 4.0 * np.outer(moved, moved)  # no decision: a formula: twice, squared
    return part


def _of_the_angle(objective: Objective, fit: Fit) -> Matrix:
    """What the noise of the velocity does to an angle that is its integral, and so to the phases; 0 where the angle is another.

        var of the angle's mean over n samples = (s dt)^2 n/3,   phase: moves by the order times it

    s: standard deviation of white noise on the velocity. The difference of an encoder's angle does not walk away from it.
    The angle of a window is the integral from its record's beginning on, see `_walk_over`.
    """
    part, data = np.zeros((len(fit.x), len(fit.x))), fit.predictor.data
    turning = [t for t in fit.parameters.terms if t.harmonic and "phase" in parameter_names(t)]
    own = fit.predictor.own_angle and not data.places  # that of a simulation begins at the walked one in each window
    if not turning or data.angle_logged or data.differenced or own:
        return part
    move = np.zeros(len(fit.x))
    for term in turning:
        slot = fit.parameters.slot(term.name)
        values = dict(zip(parameter_names(term), term.natural(fit.x[slot][None, :])[0], strict=True))
        h = 1e-6  # no decision: the step of a difference
        later = {name: value + h if wave_of(name)[0] == "phase" else value for name, value in values.items()}
        turned = term.coordinates(later) - term.coordinates(values)
        orders = [wave.get("order", 1.0) for wave in by_wave(values)]
        move[slot] = np.repeat(orders, term.size // term.waves) * np.asarray(turned) / h
    lengths = np.array(objective.lengths, dtype=np.float64)
    noise = data.noise_of(objective.error(fit)) * data.dt
    # no decision: a formula: of a random walk
    walk = _walk_over(data.places) if data.places else float(np.sum((lengths / lengths.sum()) ** 2 * lengths)) / 3.0
    return noise**2 * walk * np.outer(move, move)


def _walk_over(places: Sequence[Place]) -> float:
    """Variance of the mean over windows of a random walk, which begins with each record and has steps of variance 1.

        n^2 var = sum over lines j, k of one record of min(j, k)

    n: lines of all windows. Of two windows that is each line of the earlier one, once for each line of the later one.
    """
    total = 0.0
    for i, p in enumerate(sorted(places)):
        n = p.stop - p.start
        total += n**2 * p.start + n**3 / 3.0  # no decision: a formula: the double sum within a window
        total += sum(n * (q.stop - q.start) * (p.start + p.stop) for q in sorted(places)[i + 1 :] if q.at == p.at)
    return total / float(sum(p.stop - p.start for p in places)) ** 2


def _jackknife(objective: Objective, fit: Fit) -> Vector:
    """Standard deviations of x from fits that leave out one block each."""
    edges = np.linspace(0, sum(objective.lengths), BLOCKS + 1).astype(int)
    fits = []
    for first, end in pairwise(edges):
        weight = objective.weight.copy()
        weight[first:end] = 0.0
        fits.append(fitted(objective.weighted(weight), fit.hypothesis, fit.x, fit.noise, POLICY.short).x)
    return np.asarray(np.sqrt((BLOCKS - 1) * np.var(fits, axis=0)))


def _at_one_point(objective: Objective, fit: Fit, v: Vector, J: Matrix) -> Matrix:
    cov, seen = np.diag(np.where(fit.parameters.steps() > 0.0, np.inf, 0.0)), seen_in(fit, J)
    if len(seen):
        inverse = inverse_of(J[seen] @ J[seen].T)
        scores = objective.by_record(J[seen] * v)
        robust = inverse @ np.sum([long_run(s) for s in scores], axis=0) @ inverse
        cov[np.ix_(seen, seen)] = larger_of(variance_of(objective, fit, v) * inverse, robust)
    return cov


def model_covariance(
    objective: Objective, fit: Fit, made: Callable[[Vector], Model], more: Matrix
) -> tuple[tuple[float, ...], ...] | None:
    """Covariance of the `model_numbers` of a fit, to first order; more: to be added to that of x.

    made: x -> model, with known settings beside.

    None where the records leave a number open, and where a small step makes two real roots of a pair.
    """
    count = fit.parameters.size - sum(fit.parameters.starts)
    cov = (covariance_of(objective, fit) + more)[:count, :count]
    if not np.all(np.isfinite(cov)):
        return None
    found = model_numbers(made(fit.x))
    # no decision: the step of a difference
    h = 1e-6 * np.maximum(np.maximum(np.abs(fit.x[:count]), fit.parameters.steps()[:count]), 1e-6)
    slopes = []
    for i in range(count):
        near = fit.x.copy()
        near[i] += h[i]
        try:
            moved = model_numbers(made(near))
        except ModelError:  # beyond a physical bound, at which it stands
            return None
        if len(moved) != len(found):
            return None
        slopes.append((moved - found) / h[i])
    S = np.array(slopes)
    return tuple(tuple(map(float, row)) for row in S.T @ cov @ S)


def estimates_of(objective: Objective, fit: Fit) -> dict[str, dict[str, Estimate]]:
    """Effect -> parameter -> Estimate."""
    cov, by_controller = covariance_of(objective, fit), controller_part(objective, fit)
    limits = fit.parameters.limits()
    result: dict[str, dict[str, Estimate]] = {}
    for term in fit.parameters.terms:
        effect = term.name
        slot = fit.parameters.slot(effect)
        z, part = fit.x[slot], cov[slot, slot]
        values = term.natural(z[None, :])[0]
        h = 1e-6 * np.maximum(np.abs(z), np.array(term.steps(fit.parameters.scales)))  # no decision: the step of a difference
        h[h == 0.0] = 1.0
        moved = term.natural(z + np.diag(h))
        slopes = (moved - values) / h[:, None]
        finite = np.where(np.isfinite(part), part, 0.0)
        variances, parts = (np.einsum("ij,ik,kj->j", slopes, C, slopes) for C in (finite, by_controller[slot, slot]))
        lost = np.any((np.abs(slopes) > 0.0) & ~np.isfinite(np.diag(part))[:, None], axis=0)
        span = np.maximum(limits[1, slot] - limits[0, slot], 1e-300)
        near = (z <= limits[0, slot] + 1e-6 * span) | (z >= limits[1, slot] - 1e-6 * span)  # no decision: rounding at a bound
        bound = np.any((np.abs(slopes) > 0.0) & near[:, None], axis=0)
        row = row_of(effect).of_waves(term.waves)
        result[effect] = {}
        for i, parameter in zip(term.strongest_first(values), row.parameters, strict=True):
            name, unit = parameter.name, parameter.unit
            std = float("inf") if lost[i] else float(np.sqrt(max(variances[i], 0.0)))
            value = float(values[i])
            # A phase of 0 is as good as any other: it is not compared with itself.
            size = term.scales.get(wave_of(name)[0], abs(value))
            known = std < size if size > 0.0 else np.isfinite(std)
            part_of_it = float(np.sqrt(max(parts[i], 0.0)))
            result[effect][name] = Estimate(value, std, unit, bool(bound[i]), bool(known), part_of_it)
    return result
