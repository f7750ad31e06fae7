from .regression.inverse_dynamics import inverse_dynamics
from .regression.inverse_dynamics_result import InverseDynamics
from .regression.winding import WindingFit, estimate_winding

__all__ = ["InverseDynamics", "WindingFit", "estimate_winding", "inverse_dynamics"]
