"""The paper, reproduced and checked: its tables against one another, its experiment on a simulated rig, and what lies behind."""

from gaident.paper.page import page, summary
from gaident.paper.pictures import figures
from gaident.paper.reproduction import Reproduction, reproduce

__all__ = ["Reproduction", "figures", "page", "reproduce", "summary"]
