"""The difference equation of a drive, sampled (the paper's equation 7)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import CONTINUOUS_LOOP
from gaident.control.controller import Controller
from gaident.errors import ModelError

__all__ = ["Discrete", "require_strictly_proper"]


@dataclass(frozen=True, eq=False)
class Discrete:
    """Coefficients of equation (7), a difference equation of order N.

        w(n) = sum_{i=0..N} alpha_i r(n-i) + sum_{i=1..N} beta_i w(n-i)

    Attributes
    ----------
    alpha : ndarray, shape (N+1,)
        Coefficients of the command r [rad/s] (without a controller: of the torque [N m]).
    beta : ndarray, shape (N,)
        Coefficients of the earlier velocities w [rad/s]; beta[0] is beta_1.

    See Also
    --------
    Model.discrete : The equation of a model.
    least_squares : The equation that fits a record best.

    Examples
    --------
    >>> import gaident as ga
    >>> equation = ga.OneMass(J=1e-3, D=0.0).model().discrete(dt=1e-2)
    >>> equation.alpha.round(6).tolist(), equation.beta.round(6).tolist()
    ([0.0, 10.0], [1.0])
    """

    alpha: NDArray[np.float64]
    beta: NDArray[np.float64]


def require_strictly_proper(p: int, controller: Controller | None) -> None:
    """Raises ModelError for p = 0 outside the continuous loop."""
    if p == 0 and (controller is None or controller.loop != "continuous"):
        where = "the sampled loop" if controller is not None else "an open loop"
        raise ModelError(
            f"the model has p = 0 (as many zeros as poles), which does not exist in {where}: "
            f"use a model with more poles than zeros, or {CONTINUOUS_LOOP}"
        )
