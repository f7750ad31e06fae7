"""Numbers of a controller that the records have shown, and how far they may be off together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Controller
from gaident.errors import ControllerError
from gaident.policy.table import POLICY

__all__ = ["NUMBER_STEP", "FoundNumbers", "loosened"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

NUMBER_STEP = 1e-3  # no decision: the step of a difference; of a controller's number
VARIANCE_RANK = 1e-9  # no decision: of the largest variance, what a sum is exact to


@dataclass(frozen=True, eq=False)
class FoundNumbers:
    """A controller whose numbers were found.

    made: the controller of such numbers. at: the numbers that are used (k,), low <= at <= high.
    covariance: of the numbers as the torque showed them (k, k); None: they were found from the errors of the model itself.
    shown: what the torque showed (k,), where the errors of the model moved it; None: they did not.
    named: finding -> parameter -> (value, standard deviation), of numbers and their covariance; "": of those that were None.
    """

    made: Callable[[Vector], Controller]
    at: Vector
    covariance: Matrix | None = None
    low: Vector | float = -np.inf
    high: Vector | float = np.inf
    shown: Vector | None = None
    named: Callable[[Vector, Matrix], Mapping[str, Mapping[str, tuple[float, float]]]] | None = None

    @cached_property
    def directions(self) -> Matrix:
        """(m, k): one deviation in each independent direction; without a covariance a small step of each number."""
        size = len(self.at)
        if self.covariance is None:
            return NUMBER_STEP * np.eye(size)
        std = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        known = np.flatnonzero((std > 0.0) & np.isfinite(std))
        if not len(known):
            return np.zeros((0, size))
        std = std[known]
        values, vectors = np.linalg.eigh(self.covariance[np.ix_(known, known)] / np.outer(std, std))
        kept = values > VARIANCE_RANK
        rows = np.zeros((int(np.sum(kept)), size))
        rows[:, known] = (vectors[:, kept] * np.sqrt(values[kept])).T * std
        return rows

    @property
    def deviations_off(self) -> Vector:
        """(m,): how many deviations the numbers are from what the torque showed in each direction; 0 where none showed them."""
        if self.covariance is None or self.shown is None:
            return np.zeros(len(self.directions))
        size = np.maximum(np.abs(self.directions).max(axis=0, initial=0.0), 1e-300)
        return np.asarray(np.linalg.lstsq((self.directions / size).T, (self.at - self.shown) / size, rcond=1e-12)[0])

    def moved(self, by: Vector) -> FoundNumbers:
        """The same with its numbers moved, as far as they go."""
        return replace(self, at=np.clip(self.at + by, self.low, self.high))

    def joined(self) -> FoundNumbers:
        """The same, from now on moved by what the errors of the model show, too."""
        return self if self.shown is not None else replace(self, shown=self.at)

    @property
    def joint(self) -> bool:
        """Whether the errors of the model show the numbers, too."""
        return self.covariance is None or self.shown is not None

    @property
    def controller(self) -> Controller | None:
        """The controller with its numbers; None where it refuses them."""
        try:
            return self.made(self.at)
        except ControllerError:
            return None

    def with_number(
        self, name: tuple[str, str], value: float, std: float, put: Callable[[Controller, float], Controller]
    ) -> FoundNumbers:
        """The same with one number above 0 more, independent of the others; name: (finding, parameter); put: sets it."""
        count, made, named = len(self.at), self.made, self.named
        assert self.covariance is not None
        covariance = np.zeros((count + 1, count + 1))
        covariance[:count, :count], covariance[count, count] = self.covariance, std**2

        def also(at: Vector, spread: Matrix) -> dict[str, Mapping[str, tuple[float, float]]]:
            others = {} if named is None else dict(named(at[:count], spread[:count, :count]))
            finding, parameter = name
            mine = {parameter: (float(at[count]), float(np.sqrt(spread[count, count])))}
            return {**others, finding: {**others.get(finding, {}), **mine}}

        return replace(
            self,
            made=lambda at: put(made(at[:count]), float(at[count])),
            at=np.append(self.at, value),
            covariance=covariance,
            low=np.append(np.broadcast_to(self.low, count), POLICY.negligible * value),
            high=np.append(np.broadcast_to(self.high, count), np.inf),
            named=also,
        )

    def then(self, change: Callable[[Controller], Controller]) -> FoundNumbers:
        """The same of a controller that is changed by what is known."""
        made = self.made
        return replace(self, made=lambda numbers: change(made(numbers)))


def loosened(covariance: Matrix) -> Matrix:
    """A covariance with a part of its correlations: of numbers that are off by what a log lost, and not by noise.

    The deviations of each alone contain that; of a combination that noise would show closely it is not known.
    """
    kept = POLICY.kept_correlation
    return np.asarray(kept * covariance + (1.0 - kept) * np.diag(np.diag(covariance)))
