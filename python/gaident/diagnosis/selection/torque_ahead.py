"""By how much the mean of a torque over a line is ahead of the value at the line, where nobody gave the period of the controller.

A torque that drives a model is held over each line.
That of a controller which is faster than the log changes between the lines:
its mean over a line of r samples is (r - 1)/(2r) lines ahead, less the age of the velocity.
No axis moves before its torque, so an age below 0 of the velocity tells it.

    u_a(n)  = (1 - a) u(n) + a u(n+1),   0 <= a <= 1/2
    J(a)    = min |w - w(model, u_a)|^2
    std     = sqrt(J_min/(n_eff c)),     J(a) = J_min + c (a - a_min)^2

The model is the axis that the inverse-dynamics regression shows, with its friction, gravity, spring and load, fitted for each a.
Where two masses that swing come closer to the records, the axis is not rigid: the regression alone tells the lag, behind a filter
below the resonance (`torque_lag`).
The regression is weak where the torque changes little in a line, and biased by friction at reversals: on 100 Hz logs of a 1 kHz
controller (sums of sines, ramps, steps; gravity, dry friction; 0.45 lines) it gave 0.05 to 0.48 lines, the fit 0.41 to 0.46.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gaident.diagnosis.selection.bases import Task
from gaident.diagnosis.selection.mechanisms import swings
from gaident.diagnosis.selection.select import Selection
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import effective_samples, gained
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Objective, OutputErrors
from gaident.estimation.regression.force_error import band_of
from gaident.estimation.regression.torque_lag import TorqueLag, torque_lag
from gaident.models.drive_torque import HALF
from gaident.models.held_torque import sampled_between
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["ahead_of_line", "closer"]

EXACT = 1e-3  # no decision: lines, what the parabola of a lag is exact to


def ahead_of_line(task: Task) -> TorqueLag | None:
    """By how many lines the mean of the torque over a line is ahead of it; None where it is not, or no held torque drives."""
    data = task.data
    drives = data.torque_logged and (data.open_runs or not data.loop_follows)
    if not drives or any(sampled_between(r) for r in data.driven):
        return None
    rigid = _Rigid.of(task)
    return _of_regression(data, task.model) if rigid is None else rigid.ahead()


@dataclass(frozen=True, eq=False)
class _Rigid:
    """The regressed axis, fitted to the output errors of a torque that is held, in a task under these."""

    task: Task
    held: Fit

    @classmethod
    def of(cls, task: Task) -> _Rigid | None:
        """None where the records show no such axis, or two masses that swing come closer."""
        held = task.by_output_errors.regressed(task.predictor())
        if held is None:
            return None
        rigid = cls(task.under(OutputErrors(1.0)), held)
        closest = rigid.fitted(HALF)
        least = min(rigid.left(0.0, rigid.fitted(0.0))[0], rigid.left(HALF, closest)[0])
        swinging = [f for part in task.two_masses(task.one_mass()) for f in part if swings(f)]
        return rigid if all(rigid.left(0.0, f)[0] > least for f in swinging) else None

    def objective(self, lines: float) -> Objective:
        objective = self.task.objective
        return replace(objective, data=objective.data.aged(-lines))

    def fitted(self, lines: float) -> Fit:
        objective = self.objective(lines)
        return ls.fit(objective, self.held.hypothesis.over(objective.data), self.held.x, WHITE, POLICY.usual)

    def left(self, lines: float, fit: Fit) -> tuple[float, float]:
        """(mean square of the output errors [(rad/s)^2], independent samples in them)."""
        errors = self.objective(lines).unwhitened_errors(fit)
        return float(errors @ errors) / len(errors), effective_samples(errors)

    def ahead(self) -> TorqueLag | None:
        from scipy.optimize import minimize_scalar

        def left(lines: float) -> float:
            return self.left(lines, self.fitted(lines))[0]

        best = minimize_scalar(left, bounds=(0.0, HALF), method="bounded", options={"xatol": POLICY.ahead_exact})
        lines = float(best.x)
        least, samples = self.left(lines, self.fitted(lines))
        held = left(0.0)
        if lines < POLICY.ahead_seen or gained(held, least, samples, 1) < POLICY.rival_margin:
            return None
        return TorqueLag(lines, lines * float(np.sqrt(least / (samples * (held - least)))), least)


def _of_regression(data: DataSet, model: Model) -> TorqueLag | None:
    # Seen from the velocity that is fitted, not from the position, which may be younger.
    moving = [r.with_channels(position=None) for r in data.driven]
    band = band_of(model, moving, below=POLICY.rigid_band)
    shown = [lag for r in moving if (lag := torque_lag(r, band, data.axis)) is not None]
    if not shown:
        return None
    weights = np.array([max(lag.std, EXACT) ** -2 for lag in shown])
    ahead = float(weights @ np.array([lag.lag for lag in shown]) / weights.sum())
    std = float(weights.sum() ** -0.5)
    if not ahead > max(POLICY.ahead_seen, POLICY.contradiction * std) or ahead > HALF + POLICY.contradiction * std:
        return None
    return TorqueLag(min(ahead, HALF), std, max(lag.left for lag in shown))


def closer(found: Selection, ahead: TorqueLag) -> float | None:
    """With how many lines the model that was found comes closest, without what is late itself.

    None where these are no others than it had, within their deviation.
    """
    from scipy.optimize import minimize_scalar

    if ahead.std < POLICY.ahead_exact:
        return None
    space, final = found.space, found.final
    for term in final.parameters.terms:
        if term.in_series:
            final = space.without(final, term.name)

    def score(lines: float) -> float:
        data = space.objective.data.aged(-float(lines))
        under = replace(space, objective=replace(space.objective, data=data))
        return under.score(under.refitted(final.hypothesis.over(data), final.x))

    best = minimize_scalar(score, bounds=(0.0, HALF), method="bounded", options={"xatol": POLICY.ahead_exact})
    lines = float(best.x)
    return lines if abs(lines - ahead.lag) > ahead.std and best.fun < score(ahead.lag) else None
