from .regression.inverse_dynamics import inverse_dynamics

__all__ = ["inverse_dynamics"]
