from . import errors
from .control import PI, Cascade, LowPass, Notch, P
from .data import Alignment, Record, Winding, align, columns, differentiate, read, read_axes, read_columns, read_pieces
from .diagnosis import diagnose, first_experiment
from .errors import GaidentError
from .estimation import ForceError, WindingFit, estimate_winding, force_error, inverse_dynamics
from .fleets import Fleet, Trends, fleet, trends
from .identification import LeastSquares, identify, least_squares, m_sequence
from .models import (
    Discrete,
    Effect,
    Model,
    OneMass,
    Run,
    SearchSpace,
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
from .reporting import report
from .results import Diagnosis, Estimate, Finding, Identification, InverseDynamics, Limits, Proposal, Settings, load
from .show import progress

__all__ = [
    "PI",
    "Alignment",
    "Cascade",
    "Diagnosis",
    "Discrete",
    "Effect",
    "Estimate",
    "Finding",
    "Fleet",
    "ForceError",
    "GaidentError",
    "Identification",
    "InverseDynamics",
    "LeastSquares",
    "Limits",
    "LowPass",
    "Model",
    "Notch",
    "OneMass",
    "P",
    "Proposal",
    "Record",
    "Run",
    "SearchSpace",
    "Settings",
    "Trends",
    "TwoMass",
    "Winding",
    "WindingFit",
    "align",
    "columns",
    "diagnose",
    "differentiate",
    "effects",
    "errors",
    "estimate_winding",
    "factor_parameters",
    "first_experiment",
    "fleet",
    "force_error",
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
    "read_axes",
    "read_columns",
    "read_pieces",
    "report",
    "run",
    "simulate",
    "simulate_many",
    "trends",
]

__version__: str
