"""A drive that takes the difference of its encoder's angle for the velocity, which it reads and logs.

w_m(n) = (theta(n) - theta(n-1))/T = 1/T int w dt over the sample T of the controller
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from gaident import _core
from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller

__all__ = ["DifferencingCascade", "differencing", "older"]


@dataclass(frozen=True)
class DifferencingCascade(Cascade):
    """A cascade around that velocity: a loop that is simulated with it shows the mean over each sample."""

    def core_loop(self, dt: float) -> _core.Loop:
        """See `Controller`."""
        return super().core_loop(dt).differenced()


def differencing(controller: Controller) -> DifferencingCascade:
    """The same controller around a differenced angle."""
    cascade = cascade_of(controller)
    return DifferencingCascade(**{f.name: getattr(cascade, f.name) for f in fields(Cascade)})


def older(controller: Controller, lines: float) -> Controller:
    """The same controller around a velocity that is so many lines of the log old: above 0 it is the differenced angle."""
    return differencing(controller) if lines > 0.0 else controller
