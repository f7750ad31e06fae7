from . import errors
from .data import Alignment, Record, align, columns, differentiate, read, read_columns
from .diagnosis import Diagnosis, Finding, Limits, Proposal, diagnose, first_experiment
from .errors import GaidentError
from .estimation import InverseDynamics, inverse_dynamics
from .identification import (
    Estimate,
    Identification,
    LeastSquares,
    SearchSpace,
    Settings,
    identify,
    least_squares,
    m_sequence,
)
from .models import (
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
from .progress_bar import progress
from .reporting import report
from .store import load

__all__ = [
    "PI",
    "Alignment",
    "Diagnosis",
    "Discrete",
    "Effect",
    "Estimate",
    "Finding",
    "GaidentError",
    "Identification",
    "InverseDynamics",
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
    "align",
    "columns",
    "diagnose",
    "differentiate",
    "effects",
    "errors",
    "factor_parameters",
    "first_experiment",
    "identify",
    "initial_state",
    "inverse_dynamics",
    "least_squares",
    "load",
    "m_sequence",
    "mechanics_from_model",
    "model_from_factor_parameters",
    "progress",
    "read",
    "read_columns",
    "report",
    "run",
    "simulate",
    "simulate_many",
]

__version__: str
