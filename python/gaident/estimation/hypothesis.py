"""What is fitted, and what came out: a hypothesis is a model with its predictor, a fit the best numbers of one."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import NoiseFilter
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import Predictor
from gaident.estimation.term import Term

__all__ = ["Fit", "Hypothesis"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Hypothesis:
    """What is fitted: the parameters of a model, and how the data drive it."""

    parameters: Parameterisation
    predictor: Predictor

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects in the model, in the order in which they were added."""
        return self.parameters.effects

    def extended(self, term: Term) -> Hypothesis:
        """With one effect more, behind the others."""
        return replace(self, parameters=self.parameters.extended(term))

    def without(self, effect: str) -> Hypothesis:
        """With one effect less."""
        return replace(self, parameters=self.parameters.without(effect))

    def driven_by(self, predictor: Predictor) -> Hypothesis:
        """The same model under another predictor."""
        return replace(self, predictor=predictor)

    def over(self, data: DataSet) -> Hypothesis:
        """The same model over other data, driven in the same way."""
        return replace(self, predictor=replace(self.predictor, data=data))  # type: ignore[type-var]


@dataclass(frozen=True, eq=False)
class Fit:
    """A hypothesis with its best x under a noise filter: cost V there, and BIC."""

    hypothesis: Hypothesis
    x: Vector
    noise: NoiseFilter
    cost: float
    bic: float
    converged: bool = False

    @property
    def parameters(self) -> Parameterisation:
        """Those of the hypothesis."""
        return self.hypothesis.parameters

    @property
    def predictor(self) -> Predictor:
        """That of the hypothesis."""
        return self.hypothesis.predictor

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects in the model, in the order in which they were added."""
        return self.hypothesis.effects

    @property
    def impacts(self) -> bool:
        """Whether one of its effects has impacts."""
        return any(t.impacts for t in self.parameters.terms)

    @cached_property
    def key(self) -> Hashable:
        """The same for fits of the same numbers."""
        return self.hypothesis, self.x.tobytes(), self.noise.key, self.cost, self.bic, self.converged
