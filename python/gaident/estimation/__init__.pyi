from .regression.force_error import ForceError, force_error
from .regression.inverse_dynamics import inverse_dynamics

__all__ = ["ForceError", "force_error", "inverse_dynamics"]
