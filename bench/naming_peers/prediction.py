"""Black and grey boxes that predict and name nothing: ARX, NARX (SysIdentPy), a rigid axis by output error.

Each runs freely over the held-out record in the loop of the controller that everybody is given, with the limits of it that the
replay shows.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from case import Answer, Case
from in_the_loop import prepared
from numpy.typing import NDArray

import gaident as ga

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "measured"))
import real_fits

Vector = NDArray[np.float64]
Step = Callable[[Vector, Vector], float]
ONLY = 0.0
"""The one threshold of a method that has none."""


def in_the_loop(case: Case, step: Step, lags: int, own: bool = False) -> float | None:
    """rmse of w(k) = step(w(k-1)..w(k-L), u(k-1)..u(k-L)) under the PI controller [rad/s]; None without one.

    It starts from rest, as the held-out record does (own: the record itself); inf where it diverges.
    """
    rec, pi = case.record if own else case.validation, case.controller
    if rec is None or not isinstance(pi, ga.PI):
        return None
    shown = prepared(case).replayed
    limit = shown.get("integrator_clamp", {}).get("limit", np.inf)
    command = followed(rec.command, shown.get("command_rate_limit", {}).get("rate", np.inf) * rec.dt)
    w, u = np.zeros(len(rec) + lags), np.zeros(len(rec) + lags)  # at rest before
    integral, before = 0.0, 0.0
    bound = 20.0 * float(np.abs(case.record.velocity).max())
    for k, r in enumerate(command):
        at = k + lags
        w[at] = step(w[at - lags : at][::-1], u[at - lags : at][::-1]) if k else rec.velocity[0]
        if not abs(w[at]) < bound:
            return float("inf")
        e = float(r - w[at])
        integral = float(np.clip(integral + 0.5 * pi.ki * rec.dt * (e + before), -limit, limit))
        u[at], before = pi.kp * e + integral, e
    return float(np.sqrt(np.mean((rec.velocity - w[lags:]) ** 2)))


def closest(case: Case, makes: Sequence[Callable[[], Step]]) -> float | None:
    """The same of the one that comes closest to the record itself; a step with a state is made anew for each run."""
    errors = [in_the_loop(case, make(), 1, own=True) for make in makes]
    known = [np.inf if e is None or np.isnan(e) else e for e in errors]
    return in_the_loop(case, makes[int(np.argmin(known))](), 1)


def followed(command: Vector, step: float) -> Vector:
    """The command as a controller follows it that changes by no more than `step` a sample."""
    if not np.isfinite(step):
        return command
    found = command.copy()
    for k in range(1, len(found)):
        found[k] = found[k - 1] + min(max(command[k] - found[k - 1], -step), step)
    return found


def arx(case: Case) -> dict[float, Answer]:
    """Least squares, order 1 to 4 by BIC of the one-step error (bench/measured/real_fits.py)."""
    theta, order = real_fits.arx([case.record])
    rmse = in_the_loop(case, lambda w, u: float(theta[:-1] @ np.concatenate([w, u]) + theta[-1]), order)
    return {ONLY: Answer({}, rmse=rmse)}


def output_error(case: Case) -> dict[float, Answer]:
    """A rigid axis with dry and viscous friction and a constant torque, by output error (bench/measured/real_fits.py)."""
    with np.errstate(all="ignore"):
        J, B, _, C, _, T, _, _ = real_fits.output_error([case.record], real_fits.PLAIN)
    model = ga.OneMass(J, B).model().with_effect("coulomb_friction", torque=C).with_effect("load_torque", torque=T)
    return {ONLY: Answer({}, rmse=None if case.cell.loop else case.free_run(model))}


def narx(case: Case) -> dict[float, Answer]:
    """A polynomial of degree 2 over two lags of velocity and torque, its terms by forward regression and BIC."""
    from real_narx import LAGS, MOST_TERMS
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    rec = case.record
    speed, torque = float(np.abs(rec.velocity).max()), float(np.abs(rec.torque).max())
    model = FROLS(order_selection=True, n_info_values=MOST_TERMS, ylag=LAGS, xlag=LAGS, info_criteria="bic",
                  estimator=LeastSquares(), basis_function=Polynomial(degree=2))  # fmt: skip
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        model.fit(X=rec.torque.reshape(-1, 1) / torque, y=rec.velocity.reshape(-1, 1) / speed)
    theta, terms = np.ravel(model.theta), np.asarray(model.final_model)

    def step(w: Vector, u: Vector) -> float:
        """Terms are products of entries: 0 is a factor 1, 1001 is w(k-1), 2001 is u(k-1)."""
        values = {0: 1.0} | {1001 + i: w[i] / speed for i in range(LAGS)} | {2001 + i: u[i] / torque for i in range(LAGS)}
        return speed * float(sum(t * np.prod([values[int(code)] for code in term]) for t, term in zip(theta, terms, strict=True)))

    return {ONLY: Answer({}, rmse=in_the_loop(case, step, LAGS))}
