from .cascade import Cascade
from .filters import LowPass, Notch
from .pi import PI
from .position import P

__all__ = [
    "PI",
    "Cascade",
    "LowPass",
    "Notch",
    "P",
]
