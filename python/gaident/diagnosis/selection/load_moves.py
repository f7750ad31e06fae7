"""The search once more where a sensor at the load is logged: its errors count beside those of the motor."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.selection.mechanisms import drives_itself, is_mechanism, moved_to, shafts
from gaident.diagnosis.selection.model_space import Grown
from gaident.diagnosis.selection.moves import Moves
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import gained
from gaident.estimation.load_end import LoadEnd
from gaident.estimation.load_sensor.joint import JointObjective
from gaident.estimation.load_sensor.signals import LoadSensor
from gaident.estimation.noise_model import WHITE, autoregression
from gaident.estimation.objective import Fit, Hypothesis
from gaident.estimation.prediction import torque_noise_draws
from gaident.estimation.projection import WORST
from gaident.estimation.term import Term

__all__ = ["LoadMoves"]

Vector = NDArray[np.float64]
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

    def load_ratio(self, fit: Fit) -> float:
        """Rms of the errors at the load over the noise there."""
        return float(np.sqrt(self.joint.at_load(fit))) / max(self._noise_at_load(fit), 1e-300)

    def _white_at_load(self, fit: Fit) -> bool:
        """Whether so little is left at the load that nothing is looked for there; the criterion decides what is taken."""
        return self.load_ratio(fit) < self.policy.noise_ratio

    def explains_load(self, fit: Fit) -> bool:
        """Whether a model leaves noise at the load: whitened as much as is noise, and before that little more.

        Noise of the axis and of sensors is coloured, there as at the motor.
        """
        ratio = self.load_ratio(fit)
        if ratio < self.policy.noise_ratio or not ratio < self.policy.free_run_ratio:
            return ratio < self.policy.noise_ratio
        left = self.joint.left_at_load(fit)
        whitened = WHITE.then(autoregression(self.joint.parts(left))).of(left[None, :], self.joint.lengths)[0]
        share = float(whitened @ whitened) / max(float(left @ left), 1e-300)
        return bool(ratio * np.sqrt(share) < self.policy.noise_ratio)

    def _noise_at_load(self, fit: Fit) -> float:
        """That of the sensor and, where it was measured, what the torque's noise makes of the load's motion in the model."""
        sensor = self.joint.sensor
        if not self.hears_torque_noise(fit) or fit.parameters.masses == 1 or drives_itself(fit):
            return sensor.noise
        key = "noise at the load", fit.hypothesis, fit.x.tobytes()

        def level() -> float:
            motor = torque_noise_draws(fit.predictor, fit.parameters, fit.x, 0.0, self.policy.level_draws)
            load = LoadEnd.of(fit.parameters, fit.x, self.data).carried(motor)
            rows = sensor.reading(fit.hypothesis, fit.x).scale * sensor.of_rates(load - motor, self.data.dt)
            return float(np.hypot(sensor.noise, np.sqrt(np.sum(rows**2) / (len(rows) * sensor.count))))

        return self.joint.once(key, level)

    def ratio(self, fit: Fit) -> float:
        """That of the errors of the motor alone."""
        alone, there = self.joint.of_the_motor(fit)
        return float(np.sqrt(there.cost / alone.count)) / max(self.noise_in_errors(fit), 1e-300)

    def quiet(self, fit: Fit) -> bool:
        """Whether a fit leaves so little at motor and load that no effort is spent beyond it."""
        return super().quiet(fit) and self._white_at_load(fit)

    def extended(self, now: Fit) -> list[Fit]:
        """With what the motor alone may not show: an effect of the coupling or at the load, and the load itself."""
        shaft = [] if self._white_at_load(now) else self._with_a_shaft(now)
        key = "at the load", now.key, self.allowed
        return [*super().extended(now), *self.objective.once(key, lambda: self._beside_coupling(now)), *shaft]

    def _beside_coupling(self, now: Fit) -> list[Fit]:
        """Two masses with each effect more that changes how the load follows the motor, and that promises something."""
        if now.parameters.masses == 1 or any(t.resonates for t in now.parameters.terms):
            return []
        couplings = [t for t in self.candidates(now) if t.in_coupling]
        turned = [self._beside(now.hypothesis, t) for t in self.allowed if t.other_side and not t.nested]
        v = self.joint.whitened_at(now.hypothesis, now.x, now.noise)
        tries = [self._promising_start(now, v, t) for t in (*couplings, *turned) if t is not None]
        found = [self._best_of(hypothesis, x[None, :]) for hypothesis, x in filter(None, tries)]
        return [f for f in found if f.cost < WORST and is_mechanism(f.parameters, f.x)]

    def _promising_start(self, now: Fit, v: Vector, term: Term) -> tuple[Hypothesis, Vector] | None:
        """The start of an effect that promises most, of errors that change in proportion to it; None where it is too little.

        v: the errors of the model. Of a change d the best share takes (d'v)^2/d'd away.
        """
        rows = term.starts(now.parameters.scales)
        if not rows:
            return None
        longer = now.hypothesis.extended(term)
        X = np.array([now.parameters.inserted(now.x, np.array(row)) for row in rows])
        D = self.joint.rows_at(longer, X, now.noise) - v
        power = np.einsum("ij,ij->i", D, D)
        known = np.isfinite(power) & (power > 0.0)
        falls = np.divide((D @ v) ** 2, power, out=np.zeros(len(D)), where=known)
        best, cost = int(np.argmax(falls)), float(v @ v)
        if gained(cost, max(cost - float(falls[best]), 1e-300), self.joint.samples) < self.policy.hope * self.penalty:
            return None
        return longer, X[best]

    def _with_a_shaft(self, now: Fit) -> list[Fit]:
        """One mass with its effects as two on the shaft that explains most."""
        if now.parameters.kind != "one mass" or any(t.resonates for t in now.parameters.terms):
            return []
        starts = [moved_to(model, now) for model in shafts(now)]
        costs = [float(self.objective.costs(hypothesis, x[None, :], WHITE)[0]) for hypothesis, x in starts]
        nearest = [starts[i] for i in np.argsort(costs)[: self.policy.starts]]
        found = [self._best_of(hypothesis, x[None, :]) for hypothesis, x in nearest]
        return [f for f in found if f.cost < WORST and is_mechanism(f.parameters, f.x)]

    def _best_of(self, hypothesis: Hypothesis, X: Matrix) -> Fit:
        """The fit from the best of some starts."""
        costs = self.objective.costs(hypothesis, X, WHITE)
        tries = np.argsort(costs)[: self.policy.starts]
        short = [ls.fit(self.objective, hypothesis, X[i], WHITE, self.policy.short) for i in tries]
        best = min(short, key=lambda f: f.cost)
        return self.refitted(best.hypothesis, best.x)
