from .fleet import Fleet, fleet

__all__ = ["Fleet", "fleet"]
