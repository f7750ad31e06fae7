"""A controller in its simplest form: a cascade of nothing but a bare PI, at the log's own rate, is that PI."""

from __future__ import annotations

from collections.abc import Iterable

from gaident.control.cascade import Cascade
from gaident.control.controller import Controller

__all__ = ["simplest"]


def simplest(controller: Controller | None, sample_times: Iterable[float]) -> Controller | None:
    """The PI of a cascade that has nothing beside it and samples at each line of the logs; else the controller itself."""
    if not isinstance(controller, Cascade):
        return controller
    pi = controller.velocity
    alone = pi.bare and controller == Cascade(pi, controller.period)
    return pi if alone and all(controller.log_every(dt) == 1 for dt in sample_times) else controller
