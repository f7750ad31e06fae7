"""What noise alone leaves in the errors of a fit, and whether a fit leaves more.

    ratio = rms of the errors/sqrt(s_w^2 + s_u^2)

s_w: the noise of the velocity. s_u: what the noise of a measured torque makes of the velocity, behind the prefilter of the output
errors; 0 where the torque is exact, where the command drives the model, and under innovations, whose noise filter contains it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.mechanisms import drives_itself
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Innovations, Objective
from gaident.estimation.prediction import ClosedLoop, OpenLoop, Predictor, torque_noise_draws
from gaident.policy.table import Policy

__all__ = ["NoiseLevel"]


@dataclass(frozen=True, eq=False)
class NoiseLevel:
    """The errors of fits over one objective, against what noise leaves."""

    objective: Objective
    policy: Policy

    @property
    def data(self) -> DataSet:
        """The records."""
        return self.objective.data

    @property
    def whitens(self) -> bool:
        """Whether errors are whitened, each hypothesis with a noise filter of its own."""
        return isinstance(self.objective.family, Innovations)

    def closed(self, predictor: Predictor) -> Predictor:
        """The closed loop with the same angle."""
        return ClosedLoop(self.data, predictor.own_angle)

    def hears_torque_noise(self, fit: Fit) -> bool:
        """Whether the noise of a measured torque is in the errors of a fit.

        Where the command drives the models, in a loop or through a replayed controller, that noise is not in their errors.
        """
        driven = not fit.predictor.closed and not any(t.in_controller for t in fit.parameters.terms)
        return self.data.torque_measured and driven and not self.whitens

    def noise_beside(self, fit: Fit) -> float:
        """Standard deviation of white noise on the velocity, as a fit shows it [rad/s].

        In a log slower than its controller the motion itself has third differences; the errors of a fit have smaller ones.
        """
        return self.data.noise_of(self.objective.error(fit))

    def noise_in_errors(self, fit: Fit) -> float:
        """Rms that noise leaves in the errors of a fit: that of the velocity, and of a measured torque behind the model.

        A mechanism that drives itself has no level of its own: noise would grow in it without end.
        """
        if not self.hears_torque_noise(fit) or drives_itself(fit):
            return self.noise_beside(fit)
        key = "noise in errors", fit.hypothesis, fit.x.tobytes()
        return self.objective.once(key, lambda: self._with_torque_noise(fit))

    def _with_torque_noise(self, fit: Fit) -> float:
        rows = torque_noise_draws(fit.predictor, fit.parameters, fit.x, self.noise_beside(fit), self.policy.level_draws)
        inertias = self.objective.inertias(fit.hypothesis, np.repeat(fit.x[None, :], len(rows), axis=0))
        errors = self.objective.whitened(rows, WHITE, inertias)
        return float(np.sqrt(np.sum(errors**2) / (len(rows) * self.objective.counted.sum())))

    def ratio(self, fit: Fit) -> float:
        """Rms of the errors over what noise leaves in them."""
        return float(np.sqrt(fit.cost / self.objective.count)) / max(self.noise_in_errors(fit), 1e-300)

    def quiet(self, fit: Fit) -> bool:
        """Whether a fit leaves so little that no effort is spent beyond it."""
        return self.ratio(fit) < self.policy.effort_ratio

    def is_noise(self, fit: Fit) -> bool:
        """The variance-ratio test: whether a fit leaves noise."""
        return self.ratio(fit) < self.policy.noise_ratio

    def small_unwhitened(self, fit: Fit) -> bool:
        """Whether the errors before whitening, in the loop where there is one, are little more than the noise.

        A loop that begins under a load is only simulated for a model that has the load.
        Where the torque of each sample is known, small errors under that torque are enough:
        the simulated loop lacks what the controller answered to noise.
        """
        loaded = self.data.simulates_loop and any(LIBRARY[e].constant for e in fit.effects)
        in_loop = self.data.fits_in_loop or loaded
        ways = [fit.hypothesis.driven_by(self.closed(fit.predictor)) if in_loop else fit.hypothesis]
        if in_loop and not self.data.loop_only:
            ways.append(fit.hypothesis.driven_by(OpenLoop(self.data, fit.predictor.own_angle)))
        cost = min(float(self.objective.costs(way, fit.x[None, :], WHITE)[0]) for way in ways)
        return bool(np.sqrt(cost / self.objective.count) < self.policy.free_run_ratio * self.noise_in_errors(fit))
