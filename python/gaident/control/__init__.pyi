from .pi import PI

__all__ = [
    "PI",
]
