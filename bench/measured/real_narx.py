"""A polynomial NARX model by sysidentpy: degree 2, two lags of torque and velocity, terms by forward regression and BIC."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from real_fits import rmse
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

import gaident as ga

LAGS = 2
MOST_TERMS = 12


def narx_rmse(training: Sequence[ga.Record], held_out: Sequence[ga.Record]) -> float:
    """The velocity error of its free run on the held-out records [rad/s]; inf where it diverges.

    Channels are divided by their largest value.
    Training records stand one behind the other: the few rows at the joints are wrong, of thousands.
    """
    speed, torque = (float(max(np.abs(getattr(r, name)).max() for r in training)) for name in ("velocity", "torque"))
    y = np.concatenate([r.velocity for r in training]).reshape(-1, 1) / speed
    u = np.concatenate([r.torque for r in training]).reshape(-1, 1) / torque
    model = FROLS(
        order_selection=True,
        n_info_values=MOST_TERMS,
        ylag=LAGS,
        xlag=LAGS,
        info_criteria="bic",
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=2),
    )

    def free_run(rec: ga.Record) -> NDArray[np.float64]:
        start = rec.velocity[:LAGS].reshape(-1, 1) / speed
        run = model.predict(X=rec.torque.reshape(-1, 1) / torque, y=start)
        return np.asarray(run).ravel() * speed

    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        model.fit(X=u, y=y)
        return rmse(held_out, free_run)
