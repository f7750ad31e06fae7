from .compare import ComparedModel, ModelComparison, compare
from .feedforward import feedforward
from .following.errors import FollowingError, LoopError
from .friction_map import FrictionMap, friction_map
from .retune import retune
from .tables import FeedforwardTables, Wave

__all__ = [
    "ComparedModel",
    "FeedforwardTables",
    "FollowingError",
    "FrictionMap",
    "LoopError",
    "ModelComparison",
    "Wave",
    "compare",
    "feedforward",
    "friction_map",
    "retune",
]
