from .compare import ComparedModel, ModelComparison, compare
from .feedforward import feedforward
from .friction_map import FrictionMap, friction_map
from .retune import retune
from .tables import FeedforwardTables, Wave

__all__ = [
    "ComparedModel",
    "FeedforwardTables",
    "FrictionMap",
    "ModelComparison",
    "Wave",
    "compare",
    "feedforward",
    "friction_map",
    "retune",
]
