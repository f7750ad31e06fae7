"""The command of a proposed experiment as a log that a drive's signal generator takes."""

from __future__ import annotations

from gaident.axis import velocity_unit
from gaident.results.experiment import Proposal

__all__ = ["proposal_csv"]


def proposal_csv(proposal: Proposal, axis: str = "rotary") -> str:
    """CSV of time [s] and command [rad/s or m/s]; proposal: what has `command` (n,) and `dt`."""
    rows = (f"{n * proposal.dt:.9g},{r:.9g}" for n, r in enumerate(proposal.command.tolist()))
    return "\n".join([f"time [s],command [{velocity_unit(axis)}]", *rows, ""])
