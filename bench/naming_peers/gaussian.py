"""A Gaussian process of the missing torque beside the linear model: it predicts and names nothing.

    missing torque(k) = G^-1 w(k) - u(k) = g(velocity, its sign, torque, angle of one turn) + noise

G is a linear model, that of `ga.identify` or the closest mechanism of one mass or two.
Its inverse takes derivatives behind gaident's zero-phase low pass.
Of a long record MOST rows are taken, at random; the kernel's numbers are those of the greatest marginal likelihood
(scikit-learn).
In the free run the linear model gets the controller's torque and the process's mean.
The one model or the other, with the process or without it, is taken: what comes closest to the record that it was fitted to.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from case import Answer, Case
from in_the_loop import mechanism
from library import SAME, Motion, filtered
from numpy.typing import NDArray
from prediction import ONLY, Step, closest
from scipy.signal import bilinear, lfilter

import gaident as ga

Vector = NDArray[np.float64]

MOST = 500
"""Rows of the record that the process is fitted to: the time of a fit grows with their third power."""
AT_LEAST, AT_MOST = 0.05, 100.0
"""Bounds of its length scales, in deviations of a feature."""


def missing_torque(model: ga.Model, rec: ga.Record, m: Motion) -> Vector:
    """What the torque of the record lacks for the model to move as it did [N m], (n,), behind the low pass of the motion.

    The model's zeros are a filter of the velocity, its poles are derivatives of that.
    """
    numerator = model.gain * np.real(np.poly(model.zeros))
    denominator = np.real(np.poly(model.poles))
    slopes = [m.low(lfilter(*bilinear([1.0], numerator, 1.0 / m.dt), rec.velocity)) if len(model.zeros) else m.w / model.gain]
    for _ in range(len(denominator) - 1):
        slopes.append(m.slope(slopes[-1]))
    return np.asarray(sum(d * x for d, x in zip(denominator[::-1], slopes, strict=True)) - m.u)


def features(w: Any, u: Any, theta: Any) -> Vector:
    """What the missing torque may depend on, (n, 5)."""
    return np.stack([w, np.tanh(w / SAME), u, np.cos(theta), np.sin(theta)], axis=-1)


def fitted(X: Vector, y: Vector) -> tuple[Any, Callable[[Vector], float]]:
    """(the process, its mean at one point (5,)) of points (n, 5) and values (n,), a length scale for each feature."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    middle, scale = X.mean(axis=0), X.std(axis=0) + 1e-12
    size = float(np.sqrt(np.mean(y**2))) + 1e-300
    smooth = ConstantKernel(1.0, (1e-4, 1e3)) * RBF(np.ones(X.shape[1]), (AT_LEAST, AT_MOST))
    process = GaussianProcessRegressor(smooth + WhiteKernel(0.1, (1e-6, 10.0)), random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a length scale at its bound: the feature is of no use
        process.fit((X - middle) / scale, y / size)
    lengths, level = process.kernel_.k1.k2.length_scale, process.kernel_.k1.k1.constant_value
    at, weight = process.X_train_ / lengths, level * size * process.alpha_
    scale = scale * lengths
    middle = middle / scale

    def mean(x: Vector) -> float:
        return float(np.exp(-0.5 * np.sum((x / scale - middle - at) ** 2, axis=1)) @ weight)

    return process, mean


def gaussian(case: Case) -> dict[float, Answer]:
    """The free run with the process's torque; of two linear models, with and without it, what comes closest to the record."""
    m = filtered(case.record)
    rows = np.flatnonzero(m.use)
    rows = np.random.default_rng(0).choice(rows, min(len(rows), MOST), replace=False)
    X = features(m.w, m.u, m.theta)[rows]
    makes: list[Callable[[], Step]] = []
    for model in (case.identified.model, mechanism(case)):
        y = missing_torque(model, case.record, m)[rows]
        makes.append(partial(moved, model, case.record.dt, None))
        if np.all(np.isfinite(y)):
            makes.append(partial(moved, model, case.record.dt, fitted(X, y)[1]))
    return {ONLY: Answer({}, rmse=closest(case, makes))}


def moved(model: ga.Model, dt: float, missing: Callable[[Vector], float] | None) -> Step:
    """The model from sample to sample with a torque that depends on its motion; from rest, and to be called once a sample."""
    sampled = model.to_scipy(dt)
    A, B, C = sampled.A, sampled.B[:, 0], sampled.C[0]
    x, theta = np.zeros(len(A)), 0.0

    def step(w: Vector, u: Vector) -> float:
        nonlocal x, theta
        more = missing(features(w[0], u[0], theta)) if missing else 0.0
        x = A @ x + B * (u[0] + more)
        theta += dt * float(w[0])
        return float(C @ x)

    return step
