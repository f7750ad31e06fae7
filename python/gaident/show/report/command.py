"""The command of a proposed experiment as a log that a drive's signal generator takes."""

from __future__ import annotations

from gaident.axis import unit, velocity_unit
from gaident.results.experiment import Proposal

__all__ = ["proposal_csv"]


def proposal_csv(proposal: Proposal, axis: str = "rotary") -> str:
    """CSV of time [s] and command [rad/s or m/s], or position_command [rad or m] where a position drives the loop."""
    path = proposal.position_command
    driving = proposal.command if path is None else path
    head = f"command [{velocity_unit(axis)}]" if path is None else f"position_command [{unit('rad', axis)}]"
    rows = (f"{n * proposal.dt:.9g},{r:.9g}" for n, r in enumerate(driving.tolist()))
    return "\n".join([f"time [s],{head}", *rows, ""])
