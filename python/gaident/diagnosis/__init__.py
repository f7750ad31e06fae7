"""Diagnosis: what a record says beyond the linear model: evidence, causes, extended models, next experiments."""

from gaident.diagnosis.diagnose import diagnose
from gaident.diagnosis.experiments import Limits, Proposal, first_experiment
from gaident.diagnosis.result import Diagnosis, Finding

__all__ = ["Diagnosis", "Finding", "Limits", "Proposal", "diagnose", "first_experiment"]
