"""A limit of the controller that was not given: does the logged torque follow with one.

The controller is run on command and measured signals with each of many limits; no plant is involved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from gaident.control.cascade import cascade_of
from gaident.control.controller import Controller
from gaident.control.filtering import rate_limited
from gaident.data.record import Record
from gaident.diagnosis.controller.slow_forms import run_error
from gaident.policy.table import POLICY

__all__ = ["by_a_limit", "left_by_a_limit"]

LOWEST = 1e-3  # no decision: a start; of the largest value, from where a limit is looked for


def by_a_limit(records: Sequence[Record], controller: Controller) -> bool:
    """Whether the torque follows with a clamp of the integrator, or a slope of the command, that was not given.

    Then the loop is the drive's but for that, and a simulation of it shows the limit.
    As in a replay at each sample, it leaves at most `replay_left` of the squared error.
    """
    return left_by_a_limit(records, controller) ** 2 < POLICY.replay_left * run_error(records, cascade_of(controller)) ** 2


def left_by_a_limit(records: Sequence[Record], controller: Controller) -> float:
    """Root mean square of logged minus made torque [N m] with the better of the two limits."""
    cascade = cascade_of(controller)
    torque = max(float(np.abs(r.torque).max()) for r in records if r.torque is not None)

    def clamped(limit: float) -> float:
        return run_error(records, cascade.with_limits(cascade.limits[0], limit))

    def followed(limit: float) -> float:
        slow = [r.with_channels(command=rate_limited(command, limit, r.dt, 0.0)) for r, command in asked]
        return run_error(slow, cascade)

    asked = [(r, r.command) for r in records if r.command is not None and cascade.position is None]
    slope = max((float(np.abs(np.diff(command, prepend=0.0)).max()) / r.dt for r, command in asked), default=0.0)
    searches = ((clamped, torque), (followed, slope))
    return min(_least(error, top) for error, top in searches if top > 0.0)


def _least(error: Callable[[float], float], top: float) -> float:
    """The least error of a limit up to `top`: the best of a grid, and the minimum beside it."""
    from scipy.optimize import minimize_scalar

    grid = np.linspace(np.log(LOWEST * top), np.log(top), POLICY.limits_not_given)
    values = [error(float(np.exp(x))) for x in grid]
    best = int(np.argmin(values))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    # no decision: of a solver
    found = minimize_scalar(lambda x: error(float(np.exp(x))), bounds=(low, high), method="bounded", options={"xatol": 1e-6})
    return min(values[best], float(found.fun))
