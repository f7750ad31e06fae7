from .feedforward import feedforward
from .retune import retune
from .tables import FeedforwardTables, Wave

__all__ = [
    "FeedforwardTables",
    "Wave",
    "feedforward",
    "retune",
]
