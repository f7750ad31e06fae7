from .page import page, summary
from .pictures import figures
from .reproduction import Reproduction, reproduce

__all__ = [
    "Reproduction",
    "figures",
    "page",
    "reproduce",
    "summary",
]
