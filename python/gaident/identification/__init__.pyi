from .covariance import Estimate
from .identify import identify
from .least_squares import LeastSquares, least_squares
from .m_sequence import m_sequence
from .result import Identification
from .settings import Settings
from .space import SearchSpace

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
