"""The search once more where a sensor at the load is logged: its errors count beside those of the motor."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.selection.mechanisms import is_mechanism, moved_to, shafts
from gaident.diagnosis.selection.model_space import Grown
from gaident.diagnosis.selection.moves import Moves
from gaident.estimation import least_squares as ls
from gaident.estimation.load_sensor.joint import JointObjective
from gaident.estimation.load_sensor.signals import LoadSensor
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis
from gaident.estimation.projection import WORST
from gaident.estimation.term import Term

__all__ = ["LoadMoves"]

Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LoadMoves(Moves):
    """The models over the errors of motor and load, and the moves between them."""

    @classmethod
    def beside(cls, space: Moves, sensor: LoadSensor, fit: Fit) -> LoadMoves:
        """The models of a space whose errors at the load count too, weighed by what a fit leaves there."""
        kept = {f.name: getattr(space, f.name) for f in fields(space)}
        objective, fit = space.objective.of_the_motor(fit)
        return cls(**kept | {"objective": JointObjective.of(objective, sensor, fit), "grown": Grown()})

    @property
    def joint(self) -> JointObjective:
        """The objective, which has the sensor."""
        assert isinstance(self.objective, JointObjective)
        return self.objective

    def explains_load(self, fit: Fit) -> bool:
        """Whether a model leaves noise at the load."""
        return bool(np.sqrt(self.joint.at_load(fit)) < self.policy.noise_ratio * self.joint.sensor.noise)

    def quiet(self, fit: Fit) -> bool:
        """Whether a fit leaves so little at motor and load that no effort is spent beyond it."""
        return super().quiet(fit) and self.explains_load(fit)

    def is_noise(self, fit: Fit) -> bool:
        """Whether a fit leaves noise at motor and load."""
        return super().is_noise(fit) and self.explains_load(fit)

    def extended(self, now: Fit) -> list[Fit]:
        """With what the motor alone may not show: an effect of the coupling or at the load, and the load itself."""
        more = [] if self.explains_load(now) else [*self._beside_coupling(now), *self._with_a_shaft(now)]
        return [*super().extended(now), *more]

    def _beside_coupling(self, now: Fit) -> list[Fit]:
        """Two masses with each effect more that changes how the load follows the motor, from its best start."""
        if now.parameters.masses == 1 or any(t.resonates for t in now.parameters.terms):
            return []
        couplings = [t for t in self.candidates(now) if t.in_coupling]
        turned = [self._beside(now.hypothesis, t) for t in self.allowed if t.other_side and not t.nested]
        found = [self._from_best_start(now, t) for t in (*couplings, *turned) if t is not None]
        return [f for f in found if f is not None and f.cost < WORST and is_mechanism(f.parameters, f.x)]

    def _from_best_start(self, now: Fit, term: Term) -> Fit | None:
        rows = term.starts(now.parameters.scales)
        if not rows:
            return None
        X = np.array([now.parameters.inserted(now.x, np.array(row)) for row in rows])
        return self._best_of(now.hypothesis.extended(term), X)

    def _with_a_shaft(self, now: Fit) -> list[Fit]:
        """One mass with its effects as two on the shaft that explains most."""
        if now.parameters.kind != "one mass" or any(t.resonates for t in now.parameters.terms):
            return []
        starts = [moved_to(model, now) for model in shafts(now)]
        best = self._best_of(starts[0][0], np.array([x for _, x in starts]))
        return [best] if best.cost < WORST and is_mechanism(best.parameters, best.x) else []

    def _best_of(self, hypothesis: Hypothesis, X: Matrix) -> Fit:
        """The fit from the best of some starts."""
        costs = self.objective.costs(hypothesis, X, WHITE)
        tries = np.argsort(costs)[: self.policy.starts]
        short = [ls.fit(self.objective, hypothesis, X[i], WHITE, self.policy.short) for i in tries]
        best = min(short, key=lambda f: f.cost)
        return self.refitted(best.hypothesis, best.x)
