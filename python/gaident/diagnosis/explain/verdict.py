"""The verdict of a diagnosis."""

from __future__ import annotations

__all__ = ["verdict_of"]


def verdict_of(found: bool, left: bool, loop_in_doubt: bool) -> str:
    """The verdict, see `Diagnosis.verdict`.

    found: causes are named, alone or with alternatives.
    left: something significant depends on a signal or on nothing known, or is left at the load.
    loop_in_doubt: the logged torque does not follow from the controller that made it between the lines of the log.
    What it lacks there looks like mechanics, and a model that leaves nothing is then no proof of its causes.
    """
    if left:
        return "partly explained" if found else "unexplained"
    if found:
        return "partly explained" if loop_in_doubt else "explained"
    return "adequate"
