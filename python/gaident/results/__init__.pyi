from .adequacy import Adequacy
from .diagnosis import Diagnosis
from .estimate import Estimate
from .experiment import Limits, Proposal
from .finding import Bound, Finding
from .fitness import Comparison, Fitness
from .frequency import AveragedResponse, Responses
from .identification import Identification
from .inverse_dynamics import InverseDynamics
from .relevance import Relevance
from .retuning import LoopFigures, Retuning, RuleStart, Spread
from .settings import Settings
from .store import load, schema

__all__ = [
    "Adequacy",
    "Bound",
    "Comparison",
    "Diagnosis",
    "Estimate",
    "Finding",
    "Fitness",
    "AveragedResponse",
    "Identification",
    "InverseDynamics",
    "Limits",
    "LoopFigures",
    "Proposal",
    "Relevance",
    "Responses",
    "Retuning",
    "RuleStart",
    "Settings",
    "Spread",
    "load",
    "schema",
]
