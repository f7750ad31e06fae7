from .fmu import to_fmu

__all__ = ["to_fmu"]
