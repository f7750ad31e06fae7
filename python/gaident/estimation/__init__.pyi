from .regression.inverse_dynamics import inverse_dynamics
from .regression.inverse_dynamics_result import InverseDynamics

__all__ = ["InverseDynamics", "inverse_dynamics"]
