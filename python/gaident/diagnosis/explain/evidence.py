"""What the effects of a diagnosed model do, as curves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.sides import called_of
from gaident.diagnosis.library.terms import LIBRARY
from gaident.results.diagnosis import Diagnosis

__all__ = ["velocity_curve"]

Vector = NDArray[np.float64]
Curve = tuple[Vector, Vector, str]


def velocity_curve(dia: Diagnosis, low: float, high: float) -> Curve | None:
    """(velocity, torque, label) of the effects that are functions of the velocity, from low to high [rad/s]; None without one."""
    w = np.linspace(low, high, 401)
    torque, names = np.zeros_like(w), []
    for effect in dia.model.effects:
        curve = LIBRARY[effect.name].curve if effect.name in LIBRARY else None
        if curve is not None:
            torque += curve(w, effect.parameters)
            names.append(called_of(effect.key))
    return (w, torque, " + ".join(names)) if names else None
