from .identify import identify
from .least_squares import LeastSquares, least_squares
from .m_sequence import m_sequence

__all__ = [
    "LeastSquares",
    "identify",
    "least_squares",
    "m_sequence",
]
