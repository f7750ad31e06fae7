from .compare import ComparedModel, ModelComparison, compare
from .feedforward import feedforward
from .retune import retune
from .tables import FeedforwardTables, Wave

__all__ = [
    "ComparedModel",
    "FeedforwardTables",
    "ModelComparison",
    "Wave",
    "compare",
    "feedforward",
    "retune",
]
