"""gaident: from a drive's log to a model, its structure and parameters, and what they are worth.

import gaident as ga

rec = ga.read("run1.csv", columns={"command": "w_ref", "velocity": "w"}, units={"velocity": "rpm"})
idn = ga.identify(rec, controller=ga.PI(kp=0.0232, ki=1.367))
print(idn.summary())
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaident.data import Record, differentiate, read, read_columns
from gaident.diagnosis import Diagnosis, Finding, Limits, Proposal, diagnose, first_experiment
from gaident.errors import GaidentError
from gaident.identification import (
    Estimate,
    Identification,
    LeastSquares,
    SearchSpace,
    Settings,
    identify,
    least_squares,
    m_sequence,
)
from gaident.models import (
    PI,
    Discrete,
    Effect,
    Model,
    OneMass,
    Run,
    TwoMass,
    effects,
    factor_parameters,
    initial_state,
    mechanics_from_model,
    model_from_factor_parameters,
    run,
    simulate,
    simulate_many,
)
from gaident.store import load

if TYPE_CHECKING:
    __version__: str

__all__ = [
    "PI",
    "Diagnosis",
    "Discrete",
    "Effect",
    "Estimate",
    "Finding",
    "GaidentError",
    "Identification",
    "LeastSquares",
    "Limits",
    "Model",
    "OneMass",
    "Proposal",
    "Record",
    "Run",
    "SearchSpace",
    "Settings",
    "TwoMass",
    "diagnose",
    "differentiate",
    "effects",
    "factor_parameters",
    "first_experiment",
    "identify",
    "initial_state",
    "least_squares",
    "load",
    "m_sequence",
    "mechanics_from_model",
    "model_from_factor_parameters",
    "read",
    "read_columns",
    "run",
    "simulate",
    "simulate_many",
]


def __getattr__(name: str) -> str:
    if name == "__version__":
        from gaident.version import version

        return version()
    raise AttributeError(f"module 'gaident' has no attribute {name!r}")
