"""What a result leaves possible: drives drawn from its covariance, and how late its velocity is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Controller
from gaident.data.signals.difference import is_difference_of_lines
from gaident.errors import ModelError
from gaident.models.drive_torque import HALF
from gaident.models.factors import model_numbers, model_of_numbers
from gaident.models.model import Model
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification

__all__ = ["age_of", "drawn_models"]

TRIES = 20  # no decision: of a solver: draws for each drive, of which some are no drives


def drawn_models(result: Identification | Diagnosis, count: int, seed: int) -> list[Model]:
    """The model itself first, then so many draws; the model alone where the result has no covariance.

    A draw that is no drive of the same structure (a negative inertia, two real roots for a pair) is drawn again.
    """
    model = result.model
    if result.covariance is None:
        return [model]
    values, covariance = model_numbers(model), np.array(result.covariance)
    if covariance.shape != (len(values), len(values)):
        return [model]
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = np.where(std > 0.0, std, 1.0)
    size, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    shape = unit[:, None] * vectors * np.sqrt(np.maximum(size, 0.0))
    rng, found = np.random.default_rng(seed), [model]
    for _ in range(TRIES * count):
        if len(found) > count:
            break
        one = _made(values + shape @ rng.standard_normal(len(values)), model)
        if one is not None:
            found.append(one)
    return found


def _made(values: NDArray[np.float64], like: Model) -> Model | None:
    """The model of these numbers; None where they are none of a drive."""
    try:
        made = model_of_numbers(values, like)
    except ModelError:
        return None
    return made if made.q == like.q and made.p == like.p and made.gain * like.gain > 0.0 and _alike(made, like) else None


def _alike(made: Model, like: Model) -> bool:
    pairs = [[sum(r.imag > 0.0 for r in roots) for roots in (m.poles, m.zeros)] for m in (made, like)]
    return pairs[0] == pairs[1]


def age_of(result: Identification | Diagnosis, given: Controller) -> float:
    """Lines of the log by which the velocity is old: as diagnosed, else half a sample where it is the positions' difference."""
    if isinstance(result, Diagnosis):
        return result.velocity_age
    pairs = [(r, r.position) for r in result.records]
    made = pairs and all(q is not None and is_difference_of_lines(r.velocity, q, r.dt) for r, q in pairs)
    return HALF / given.log_every(result.records[0].dt) if made else 0.0
