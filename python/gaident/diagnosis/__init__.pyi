from .diagnose import diagnose
from .experiments import Limits, Proposal, first_experiment
from .result import Diagnosis, Finding

__all__ = ["Diagnosis", "Finding", "Limits", "Proposal", "diagnose", "first_experiment"]
