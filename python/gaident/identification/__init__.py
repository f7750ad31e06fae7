"""Identification: from records to structure and parameters."""

from gaident.identification.covariance import Estimate
from gaident.identification.identify import identify
from gaident.identification.least_squares import LeastSquares, least_squares
from gaident.identification.m_sequence import m_sequence
from gaident.identification.result import Identification
from gaident.identification.settings import Settings
from gaident.identification.space import SearchSpace

__all__ = [
    "Estimate",
    "Identification",
    "LeastSquares",
    "SearchSpace",
    "Settings",
    "identify",
    "least_squares",
    "m_sequence",
]
