"""Identification: from records to structure and parameters."""

from gaident.identification.covariance import Estimate
from gaident.identification.identify import identify
from gaident.identification.result import Identification
from gaident.identification.settings import Settings
from gaident.identification.space import SearchSpace

__all__ = ["Estimate", "Identification", "SearchSpace", "Settings", "identify"]
