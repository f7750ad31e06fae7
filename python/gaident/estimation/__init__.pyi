from .regression.force_error import ForceError, force_error
from .regression.inverse_dynamics import inverse_dynamics
from .regression.winding import WindingFit, estimate_winding

__all__ = ["ForceError", "WindingFit", "estimate_winding", "force_error", "inverse_dynamics"]
