from .retune import retune

__all__ = [
    "retune",
]
