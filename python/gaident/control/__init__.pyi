from .cascade import Cascade, P
from .filters import LowPass, Notch
from .pi import PI

__all__ = [
    "PI",
    "Cascade",
    "LowPass",
    "Notch",
    "P",
]
