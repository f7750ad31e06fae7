"""What the effects of a diagnosed model do, as curves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.results.diagnosis import Diagnosis

__all__ = ["velocity_curve"]

Vector = NDArray[np.float64]
Curve = tuple[Vector, Vector, str]


def velocity_curve(dia: Diagnosis, low: float, high: float) -> Curve | None:
    """(velocity, torque, label) of the effects that are functions of the velocity, from low to high [rad/s]; None without one."""
    w = np.linspace(low, high, 401)
    size, sign = np.abs(w), np.sign(w)
    torque, names = np.zeros_like(w), []
    for effect in dia.model.effects:
        p = dict(effect.parameters)
        if effect.name in ("coulomb_friction", "presliding_friction", "friction_drift"):
            torque -= p["torque"] * sign
        elif effect.name == "stribeck_friction":
            hump = (p["static_torque"] - p["torque"]) * np.exp(-((w / p["stribeck_velocity"]) ** 2))
            torque -= (p["torque"] + hump) * sign
        elif effect.name == "asymmetric_friction":
            forwards = p["torque_positive"] + p["viscous_positive"] * size
            torque += np.where(w > 0.0, -forwards, np.where(w < 0.0, p["torque_negative"] + p["viscous_negative"] * size, 0.0))
        elif effect.name == "quadratic_drag":
            torque -= p["coefficient"] * w * size
        elif effect.name == "load_torque":
            torque -= p["torque"]
        else:
            continue
        names.append(effect.name.replace("_", " "))
    return (w, torque, " + ".join(names)) if names else None
