"""The objective of an estimation: errors of many parameter vectors at once, whitened, and what a hypothesis is worth.

    e(n) = w(n) - w_model(n; x),   v = H^-1 e,   minimise V(x) = sum of v^2 over the samples in use

e is the *raw* error. What becomes of it is the choice of a noise family:

*Innovations*: every hypothesis has a noise filter H^-1 of its own, which is part of it and counts in its criterion, so that no
effect is whitened away by a filter that was estimated without it, and none is favoured by one estimated with it.
With almost no noise on the velocity, the filter would give most weight to details: the exact instant of a reversal,
and the corner that a jump of friction makes there.
White noise of a variance f (`floor`) is then added to the error of every hypothesis alike, as if it had been on the velocity: H
is that of e plus this noise, and V/N becomes V/N + f |h|^2, h the impulse response of H^-1.

*Output errors*: the same filter for every hypothesis, none (H = 1) or a prefilter (see `prefilter.py`), with the information of
the independent samples (see `criterion.py`).
Behind a prefilter errors are *weighed*, alike for all hypotheses, and not *whitened*, by a filter of each.
Output errors are used where the errors are a misfit and no stationary noise.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.control.filtering import filtered_powers
from gaident.estimation.criterion import bic
from gaident.estimation.dataset import DataSet
from gaident.estimation.hypothesis import Fit, Hypothesis
from gaident.estimation.masked import Bridges
from gaident.estimation.noise_model import DIFFERENCED, HIGHEST, ON_TOP, WHITE, NoiseFilter, ShaftNoise, autoregression
from gaident.estimation.prefilter import Prefilter
from gaident.estimation.projection import WORST, project_out, slopes, sums_of_squares

__all__ = ["Fit", "Hypothesis", "Innovations", "NoiseFamily", "Objective", "OutputErrors"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
T = TypeVar("T")

HEAD = 12  # no decision: parts of the shortest record, of which a filter's start takes one at most
LOST = 1e60  # no decision: rad/s: the error of a model that diverges, every sample; its squares stay numbers
DIFFERENCE = 1e-6  # no decision: the step of a difference; small beside any standard deviation, within which errors may bend
ROUGH = 1e-3  # no decision: the step of a difference, beside effects whose errors jump


class NoiseFamily(Protocol):
    """How errors are whitened and what they are worth."""

    @property
    def floor(self) -> float:
        """Variance of white noise that is added to the noise that the velocity shows [(rad/s)^2]."""
        ...

    def information(self, count: float) -> float:
        """Number of independent samples among `count` samples."""
        ...

    @property
    def weighs_inertias(self) -> bool:
        """Whether `prefiltered` asks for the inertia of each row."""
        ...

    def prefiltered(self, E: Matrix, lengths: Sequence[int], inertias: Vector | None = None) -> Matrix:
        """Rows of raw errors behind a filter that no hypothesis estimates; inertias: of each row."""
        ...

    def estimated(self, objective: Objective, error: Vector, closed: bool) -> NoiseFilter:
        """The filter of one row of raw errors."""
        ...


@dataclass(frozen=True, eq=False)
class Innovations:
    """Every hypothesis under a noise filter of its own; shaft: filters of torques at the shaft, None: not looked for."""

    shaft: ShaftNoise | None = None
    floor: float = 0.0
    weighs_inertias = False

    def information(self, count: float) -> float:
        """All samples count."""
        return count

    def prefiltered(self, E: Matrix, lengths: Sequence[int], inertias: Vector | None = None) -> Matrix:
        """As they are."""
        return E

    def estimated(self, objective: Objective, error: Vector, closed: bool) -> NoiseFilter:
        """An autoregression, or noise at the shaft or of a differenced angle with a short one behind it: the lowest BIC."""
        lengths = objective.data.lengths
        row = objective.bridged(error[None, :])
        plain = WHITE.then(autoregression(objective.parts(row[0]), floor=self.floor))

        def variances(filters: Sequence[NoiseFilter]) -> list[float]:
            b, a = np.array([f.b for f in filters]), np.array([f.a for f in filters])
            powers = filtered_powers(b, a, row[0], objective.counted, lengths)
            return [objective.variance(float(cost), f) for cost, f in zip(powers, filters, strict=True)]

        def variance(f: NoiseFilter) -> float:
            return objective.variance(float(sums_of_squares(objective.whitened(row, f))[0]), f)

        found = [] if self.shaft is None else [self.shaft.best(variances, closed)]
        found += DIFFERENCED if objective.data.differenced else []
        behind = [
            f.then(autoregression(objective.parts(f.of(row, lengths)[0]), ON_TOP, self.floor * f.power))
            for f in found
            if f is not None
        ]
        return min((plain, *behind), key=lambda f: bic(variance(f), objective.count, f.size))


@dataclass(frozen=True, eq=False)
class OutputErrors:
    """Raw errors behind one prefilter, None: as they are; samples: how many of them are independent.

    inertia: where the torque is measured, that of the regression [kg m^2], which noise on the torque does not bias.
    A heavier axis follows a noisy torque less: its velocity errors get smaller, but its torque errors do not.
    A lighter axis must gain nothing: an axis that dry friction holds has no torque error at all.
    """

    samples: float
    prefilter: Prefilter | None = None
    inertia: float | None = None
    floor = 0.0

    @property
    def weighs_inertias(self) -> bool:
        """See `NoiseFamily`: true where the torque is measured."""
        return self.inertia is not None

    def information(self, count: float) -> float:
        """See `NoiseFamily`: at most `count`."""
        return min(self.samples, count)

    def prefiltered(self, E: Matrix, lengths: Sequence[int], inertias: Vector | None = None) -> Matrix:
        """Behind the prefilter, times J over that of the regression where the torque is measured."""
        if self.prefilter is None:
            return E
        if self.inertia is None or inertias is None:
            return self.prefilter.of(E, lengths)
        return self.prefilter.of(E, lengths) * np.maximum(inertias / self.inertia, 1.0)[:, None]

    def estimated(self, objective: Objective, error: Vector, closed: bool) -> NoiseFilter:
        """None: the errors count as they are."""
        return WHITE


class Counter:
    """How many simulations were made."""

    def __init__(self) -> None:
        self.simulations = 0

    def add(self, simulations: int) -> None:
        """So many more."""
        self.simulations += simulations


def _of_error(hypothesis: Hypothesis, x: Vector) -> Hashable:
    """The key of a raw error."""
    return "error", hypothesis, x.tobytes()


@dataclass(frozen=True, eq=False)
class Objective:
    """Errors over one data set.

    weight: (N,), 0 for samples that are left out. measured: (N,), the velocity that models are compared with [rad/s].
    """

    data: DataSet
    weight: Vector
    family: NoiseFamily = field(default_factory=Innovations)
    measured: Vector = field(default_factory=lambda: np.zeros(0))
    counter: Counter = field(default_factory=Counter)
    _memory: dict[Hashable, object] = field(init=False, default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if len(self.measured) == 0:
            object.__setattr__(self, "measured", self.data.velocity)

    def once(self, key: Hashable, work: Callable[[], T]) -> T:
        """The result of `work`, which depends on its key alone and is computed once."""
        if key not in self._memory:
            self._memory[key] = work()
        found: T = self._memory[key]  # type: ignore[assignment]
        return found

    @property
    def lengths(self) -> tuple[int, ...]:
        """Samples of each record."""
        return self.data.lengths

    def errors(self, hypothesis: Hypothesis, X: Matrix) -> Matrix:
        """Rows of raw errors: measured minus simulated velocity [rad/s]."""
        self.counter.add(len(X))
        return _core.errors_of(self.measured, hypothesis.predictor.velocities(hypothesis.parameters, X), LOST)

    def error(self, fit: Fit) -> Vector:
        """The raw error of a fit."""
        return self.once(_of_error(fit.hypothesis, fit.x), lambda: self.errors(fit.hypothesis, fit.x[None, :])[0])

    def known_error(self, hypothesis: Hypothesis, x: Vector) -> Vector | None:
        """The raw error at x where it was computed before; else None."""
        return self._memory.get(_of_error(hypothesis, x))  # type: ignore[return-value]

    def remember_error(self, hypothesis: Hypothesis, x: Vector, error: Vector) -> None:
        """Store the raw error at x, so that it is not simulated again."""
        self._memory.setdefault(_of_error(hypothesis, x), error.copy())

    def unwhitened_errors(self, fit: Fit) -> Vector:
        """The errors of a fit under no noise filter, 0 where samples do not count: raw, or weighed by the family's prefilter."""
        return self.whitened_errors(fit, WHITE)

    def whitened_errors(self, fit: Fit, noise: NoiseFilter) -> Vector:
        """The errors of a fit under a noise filter; its cost is their sum of squares."""
        rows = self.whitened(self.error(fit)[None, :], noise, self.inertias(fit.hypothesis, fit.x[None, :]))
        return np.asarray(rows[0])

    def whitened_at(self, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter) -> Vector:
        """v at x, without its slopes."""
        rows = self.whitened(self.errors(hypothesis, x[None, :]), noise, self.inertias(hypothesis, x[None, :]))
        return np.asarray(rows[0])

    @property
    def sensors(self) -> int:
        """How many errors a sample has; a cost is their mean over the sensors."""
        return 1

    def by_record(self, rows: Matrix) -> list[Matrix]:
        """Rows over v, summed over the sensors at each sample, as (samples, rows) of each record."""
        return np.split(rows.T, np.cumsum(self.lengths)[:-1])

    def cost_under(self, fit: Fit, noise: NoiseFilter) -> float:
        """V of a fit's x under another filter."""
        v = self.whitened_errors(fit, noise)
        return float(v @ v)

    def whitened(self, E: Matrix, noise: NoiseFilter, inertias: Vector | None = None) -> Matrix:
        """Rows of whitened errors, of models with these inertias [kg m^2]; samples that do not count are 0."""
        V = noise.of(self.family.prefiltered(self.bridged(E), self.lengths, inertias), self.lengths)
        V = V.copy() if V is E else np.asarray(V)
        V[:, self._uncounted] = 0.0
        return V

    @cached_property
    def counted(self) -> Vector:
        """1 for samples that count: all but the masked ones and the head of each record."""
        use = self.weight.copy()
        at = 0
        for n in self.lengths:
            use[at : at + self.head] = 0.0
            at += n
        return use

    @cached_property
    def _uncounted(self) -> NDArray[np.intp]:
        return np.flatnonzero(self.counted == 0.0)

    def bridged(self, E: Matrix) -> Matrix:
        """Errors with a straight line over the masked samples of each record, so that a filter does not see them."""
        return self._bridges.over(E)

    @cached_property
    def _bridges(self) -> Bridges:
        return Bridges.of(self.weight, self.lengths)

    @property
    def head(self) -> int:
        """Samples at the start of each record that never count, so that filters of all orders are judged on the same ones.

        None of windows: a filter takes a slow free motion for noise, and their first samples tell how they begin.
        """
        return 0 if self.data.windowed else min(HIGHEST, min(self.lengths) // HEAD)

    @cached_property
    def count(self) -> float:
        """Number of samples that count."""
        return float(self.counted.sum())

    @cached_property
    def information(self) -> float:
        """Independent samples among those that count."""
        return self.family.information(self.count)

    def noise_of(self, error: Vector, closed: bool) -> NoiseFilter:
        """The noise filter of one row of raw errors, of a model in its loop or not."""
        if float(np.abs(error).max()) >= LOST:
            return WHITE
        return self.family.estimated(self, error, closed)

    def own_noise(self, fit: Fit) -> NoiseFilter:
        """The noise filter of what a fit leaves itself."""
        key = "own noise", fit.hypothesis, fit.x.tobytes()
        return self.once(key, lambda: self.noise_of(self.error(fit), fit.predictor.closed))

    def parts(self, row: Vector) -> list[Vector]:
        """The records without their heads, where filters begin."""
        return [part[self.head // 2 :] for part in np.split(row, np.cumsum(self.lengths)[:-1])]

    def costs(self, hypothesis: Hypothesis, X: Matrix, noise: NoiseFilter) -> Vector:
        """V of each row; WORST where a model diverges."""
        return self.costs_and_errors(hypothesis, X, noise)[0]

    def costs_and_errors(self, hypothesis: Hypothesis, X: Matrix, noise: NoiseFilter) -> tuple[Vector, Matrix]:
        """(V of each row, WORST where a model diverges; rows of raw errors)."""
        E = self.errors(hypothesis, X)
        return sums_of_squares(self.whitened(E, noise, self.inertias(hypothesis, X))), E

    def inertias(self, hypothesis: Hypothesis, X: Matrix) -> Vector | None:
        """Of each row of x, where the family weighs errors by it [kg m^2]."""
        return hypothesis.parameters.inertias(X) if self.family.weighs_inertias else None

    def linearised(
        self, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, error: Vector | None = None
    ) -> tuple[Vector, Matrix]:
        """(v, J) at x: J[j] = dv/dx_j, forward differences; rows of entries that are not moved are 0.

        error: the raw error at x where it is known, which is then not simulated again.
        """
        X, h = self._neighbours(hypothesis, x)
        E = self._errors_around(hypothesis, X, error)
        V = self.whitened(E, noise, self.inertias(hypothesis, X))
        return V[0], slopes(V, h)

    def sensitivities(self, hypothesis: Hypothesis, x: Vector) -> tuple[Matrix, Vector]:
        """(J, e) at x: J[j] = de/dx_j of the errors before all filters, 0 for samples that do not count; e as it is."""
        X, h = self._neighbours(hypothesis, x)
        E = self._errors_around(hypothesis, X, self.known_error(hypothesis, x))
        return slopes(self.bridged(E) * self.counted, h), E[0]

    def _errors_around(self, hypothesis: Hypothesis, X: Matrix, error: Vector | None) -> Matrix:
        """Rows of raw errors; error: that of the first row where it is known."""
        if error is None:
            return self.errors(hypothesis, X)
        return np.vstack([error, self.errors(hypothesis, X[1:])]) if len(X) > 1 else error[None, :]

    def _neighbours(self, hypothesis: Hypothesis, x: Vector) -> tuple[Matrix, Vector]:
        """(rows: x, and x with each entry moved that is moved, steps: 0 for entries that are not)."""
        parameters = hypothesis.parameters
        steps, limits = parameters.steps(), parameters.limits()
        moved = np.flatnonzero(steps > 0.0)
        h = (DIFFERENCE if all(t.smooth for t in parameters.terms) else ROUGH) * steps
        h = np.where(x + h > limits[1], -h, h)
        X = np.repeat(x[None, :], len(moved) + 1, axis=0)
        X[np.arange(1, len(moved) + 1), moved] += h[moved]
        return X, np.where(steps > 0.0, h, 0.0)

    def raw_rest(self, rows: Matrix, error: Vector) -> float:
        """Sum of squared raw errors beside what the rows can explain."""
        rest = project_out(self.bridged(rows) * self.counted, self.bridged(error[None, :]) * self.counted)[0]
        return float(rest @ rest)

    def unwhitened_rest(self, rows: Matrix, error: Vector) -> float:
        """Sum of squared errors before whitening beside what the rows can explain; rows and error raw."""
        rest = project_out(self.whitened(rows, WHITE), self.whitened(error[None, :], WHITE))[0]
        return float(rest @ rest)

    def bic(self, cost: float, noise: NoiseFilter, numbers: int) -> float:
        """BIC of a cost V under a filter, for so many fitted numbers beside those of the filter."""
        return bic(self.variance(cost, noise), self.information, numbers + noise.size)

    def variance(self, cost: float, noise: NoiseFilter) -> float:
        """V/N + f |h|^2."""
        floor = self.family.floor
        return max(cost, 1e-300) / self.count + (floor * noise.power if floor else 0.0)

    def fitted(self, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, cost: float, converged: bool = False) -> Fit:
        """A fit of this cost."""
        worth = self.bic(cost, noise, hypothesis.parameters.size) if cost < WORST else np.inf
        return Fit(hypothesis, x, noise, cost, worth, converged)

    def rescored(self, fit: Fit) -> Fit:
        """A fit of the same cost under a family of other information."""
        return self.fitted(fit.hypothesis, fit.x, fit.noise, fit.cost, fit.converged)

    def of_the_motor(self, fit: Fit) -> tuple[Objective, Fit]:
        """The objective whose errors are those of the motor alone, and a fit there."""
        return self, fit

    def under_beside(self, family: NoiseFamily, fit: Fit) -> Objective:
        """The same data, weights and sensors under another noise family; fit: by whose errors sensors are weighed."""
        return self.under(family)

    def under(self, family: NoiseFamily) -> Objective:
        """The same data and weights under another noise family."""
        return Objective(self.data, self.weight, family, self.measured, self.counter)

    def weighted(self, weight: Vector) -> Objective:
        """The same with other samples left out."""
        return Objective(self.data, weight, self.family, self.measured, self.counter)
