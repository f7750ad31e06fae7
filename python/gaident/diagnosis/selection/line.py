"""A single frequency in what is left, as the torque at the motor that would make it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Objective

__all__ = ["torque_of_line"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def torque_of_line(objective: Objective, fit: Fit, jacobian: Matrix, error: Vector, pairs: Matrix) -> tuple[float, float]:
    """(frequency [Hz], amplitude [N m]) of a torque a cos(wt) + b sin(wt), fitted to the error beside the model's parameters.

    jacobian (parameters, N) and error (N,) raw; pairs: rows cos(wt), sin(wt) of each record, 0 outside it, t from its start.
    Of several records the amplitude is the rms of theirs, each by its samples.
    """
    answers = fit.predictor.torque_response(fit.parameters, fit.x, pairs)
    rows = objective.whitened(np.vstack([jacobian, answers]), WHITE)
    sizes = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    sizes[sizes == 0.0] = 1.0
    v = objective.whitened(error[None, :], WHITE)[0]
    found = np.linalg.lstsq((rows / sizes[:, None]).T, v, rcond=1e-8)[0] / sizes
    radians_per_sample = float(np.arctan2(pairs[1, 1], pairs[0, 1]))
    powers = np.sum(found[-len(pairs) :].reshape(-1, 2) ** 2, axis=1)
    amplitude = float(np.sqrt(np.average(powers, weights=objective.lengths)))
    return radians_per_sample / (2.0 * np.pi * fit.parameters.scales.dt), amplitude
