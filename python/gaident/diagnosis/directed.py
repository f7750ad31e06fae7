"""Shapes of missing torques, as functions of the motion: what directed tests look for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["torque_columns"]

Vector = NDArray[np.float64]


def torque_columns(w: Vector, theta: Vector, u: Vector, t: Vector, top: float) -> dict[str, list[Vector]]:
    """Kind -> columns of torque [arbitrary unit], shape (n,) each.

    w velocity [rad/s], theta position [rad], u torque [N m], t time [s], top the highest speed [rad/s]. Signs change over a
    hundredth of `top`, so that a velocity that rests has none.
    """
    small = 0.01 * max(top, 1e-300)
    sign = np.clip(w / small, -1.0, 1.0)
    highest = max(float(np.abs(u).max()), 1e-300)
    along = np.sign(u)
    return {
        "constant": [np.ones_like(w)],
        "sign of velocity": [sign],
        "slow motion": [np.exp(-((w / (f * top)) ** 2)) * sign for f in (0.02, 0.06)] if top > 0.0 else [sign],
        "modulus of velocity": [np.abs(w)],
        "square of velocity": [w * np.abs(w)],
        "once per turn": [np.sin(theta), np.cos(theta)],
        "twice per turn": [np.sin(2.0 * theta), np.cos(2.0 * theta)],
        "small torque": [along * np.minimum(np.abs(u), 0.03 * highest)],
        "large torque": [along * np.maximum(np.abs(u) - 0.7 * highest, 0.0)],
        "time": [t, t * sign],
    }
