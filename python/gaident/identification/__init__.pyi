from .identify import identify
from .least_squares import LeastSquares, least_squares
from .m_sequence import m_sequence
from .response.measured import frequency_response

__all__ = [
    "LeastSquares",
    "frequency_response",
    "identify",
    "least_squares",
    "m_sequence",
]
