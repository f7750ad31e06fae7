from .diagnose import Diagnosis, Finding, diagnose
from .experiments.first_experiment import Limits, Proposal, first_experiment

__all__ = ["Diagnosis", "Finding", "Limits", "Proposal", "diagnose", "first_experiment"]
