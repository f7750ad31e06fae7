from .joint import JointParameters
from .parameters import joint_parameters

__all__ = ["JointParameters", "joint_parameters"]
