"""A controller that a log of fewer lines shows, run whole on the logged signals: what it does at its torque limit.

The regression of the form leaves out the lines at a limit.
What the integrator does there is told by running the controller, with each of the schemes that `PI` knows, over the whole record:
the scheme with the least squares of what is left of the torque.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.control.filters import Notch
from gaident.control.found import FoundNumbers
from gaident.data.record import Record
from gaident.data.signals.lattice import rounding_step
from gaident.diagnosis.controller.form_filters import equation_of
from gaident.diagnosis.library.settings import ANTI_WINDUP, OF_SETTING
from gaident.identification.logged_stretches import Log, centred, log_of, numbered, plateau_of, unlimited, whitened
from gaident.identification.logged_torque import comparable, not_followed
from gaident.models.starts import starts_moving
from gaident.policy.table import POLICY

__all__ = [
    "Limited",
    "follow",
    "limited",
    "run_error",
    "time_std",
    "too_fast",
    "torque_spread",
    "with_numbers_of_limit",
]

Vector = NDArray[np.float64]

SUM_ROUNDING = 1e-9  # no decision: of a torque, what a sum is exact to
LIMIT_EXACT = 1e-6  # no decision: of a solver: where its search ends, of a plateau
TIME_EXACT = 1e-10  # no decision: of a solver: where its search ends, of the logarithm of a time
LIMITS, LIMIT_STEP = 6, 0.01  # no decision: a start; limits from which the closest is searched, of its logarithm
TIMES = np.geomspace(0.3e-3, 0.3, POLICY.tracking_times)  # no decision: a start; s
UNTIMED = 3  # no decision: a formula: how many schemes have no time
NEXT_TIME = float(TIMES[1] / TIMES[0])


@dataclass(frozen=True)
class Limited:
    """The controller with the limit that the logs show, if any; limit [N m] None: none, or the given one.

    gain: BIC units by which the whole run is better than without the limit, or the anti-windup at a given one; 0: neither.
    std: of the limit [N m], of what stands at it. windup: BIC units by which it is better than with the given anti-windup at the
    limit; 0: it does not take the share away that a number has to, or is the given one. time_std: of its tracking time [s].
    """

    controller: Cascade
    limit: float | None
    gain: float
    std: float = 0.0
    windup: float = 0.0
    time_std: float = 0.0


def run_error(records: Sequence[Record], controller: Cascade, late: int = 0) -> float:
    """Root mean square of logged minus made torque [N m] over whole records, the controller at its own clock.

    Of records that start in motion what the integrator stored is not known: the controller runs without limits, and what is left
    is taken without its mean in each stretch between two limits; on the lines at a limit it is 0 where the controller has one.
    late: controller samples by which the logged torque is older than the motion of its line.
    """
    whole = [replace(log_of(r, len(r), controller, True), late=late) for r in records]
    if not any(log.moving for log in whole):
        return _left(whole, controller)
    free = replace(controller, velocity=unlimited(controller.velocity))
    cut = [replace(log_of(r, len(r), controller, False), late=late) for r in records]
    off, stretch = np.concatenate([log.torque - log.made(free) for log in cut]), numbered([log.stretch for log in cut])
    between = centred(*whitened(off, stretch, 0.0), False)
    at_limit = off[(stretch < 0) & np.concatenate([log.stretch >= 0 for log in whole])]
    if controller.velocity.torque_limit is not None:
        at_limit = 0.0 * at_limit
    return float(np.sqrt(np.mean(np.concatenate([between, at_limit]) ** 2)))


def _left(logs: Sequence[Log], controller: Cascade) -> float:
    return float(np.sqrt(np.mean(np.concatenate([log.torque - log.made(controller) for log in logs]) ** 2)))


def _from_rest(records: Sequence[Record], controller: Cascade) -> Callable[[Cascade], float]:
    """`run_error` of records from rest, of controllers with the clock of this one; velocities between the lines are made once."""
    logs = [log_of(r, len(r), controller, True) for r in records]
    return lambda one: _left(logs, one)


def follow(records: Sequence[Record], controller: Cascade) -> bool:
    """Whether all torques can be compared with this controller and follow from it, as of one that was given."""
    return all(comparable(r, controller) for r in records) and not not_followed(records, controller)


def too_fast(controller: Cascade, dt: float) -> bool:
    """Whether a notch of the controller lies where a log with the sample time dt [s] shows nothing."""
    # no decision: a formula: the Nyquist frequency
    return any(isinstance(f, Notch) and f.frequency > 0.5 / dt for f in controller.torque_filters)


def limited(records: Sequence[Record], controller: Cascade) -> Limited:
    """The controller with the plateau of the logged torques as its limit, and the anti-windup that comes closest.

    At a given limit it is the given anti-windup, where none of them comes closer by the share that a number has to take away.
    Where the torques follow without a limit, as well as their log can show, a plateau is no limit: the top of a swing is flat.
    """
    given = controller.velocity.torque_limit
    in_motion = any(starts_moving(r, None) for r in records)  # no run from rest shows what the integrator does at the limit
    if given is not None and in_motion:
        return Limited(controller, None, 0.0)
    if given is not None:
        best = _closest(records, controller, given)
        gain = _by_windup(records, controller, best)
        if not gain > 0.0:
            return Limited(controller, None, 0.0)
        return Limited(best, None, gain, windup=gain, time_std=_time_std(records, best))
    if follow(records, controller):
        return Limited(controller, None, 0.0)
    slow = controller.log_every(records[0].dt) > 1
    torques = [(r.torque, r.dt) for r in records if r.torque is not None]
    parts = [np.abs(torque if slow else before_filters(torque, controller, dt)) for torque, dt in torques]
    limit = plateau_of(np.concatenate(parts))
    if slow and controller.torque_filters and not in_motion:
        return _limited_before_filters(records, controller, float(np.concatenate(parts).max()), bool(np.isfinite(limit)))
    if not np.isfinite(limit) or not limit > 0.0:
        return Limited(controller, None, 0.0)
    if in_motion:
        known = replace(controller, velocity=replace(controller.velocity, torque_limit=limit))
        return Limited(known, limit, _gain(records, controller, known), torque_spread(records, limit))
    return _at_limit(records, controller, _closest(records, controller, limit), limit)


def _at_limit(records: Sequence[Record], controller: Cascade, best: Cascade, limit: float) -> Limited:
    """What a controller at this limit gains over the one without."""
    same = replace(controller, velocity=replace(controller.velocity, torque_limit=limit))
    windup, gain = _by_windup(records, same, best), _gain(records, controller, best)
    return Limited(best, limit, gain, torque_spread(records, limit), windup, _time_std(records, best) if windup > 0.0 else 0.0)


def _limited_before_filters(records: Sequence[Record], controller: Cascade, highest: float, plateau: bool) -> Limited:
    """The same of a slower log whose torque is behind filters: the limit and the anti-windup are searched together.

    highest: of the logged torques [N m], which may overshoot the limit or stay below it. plateau: whether they have one.
    Where a filter leaves none, as a notch rings at the limit, the whole torque has to follow: a limit also keeps the run of a
    controller that is not the drive's from growing.
    """
    best = _closest_of_all(records, controller, highest)
    limit = best.velocity.torque_limit
    if limit is None or (not plateau and not follow(records, best)):
        return Limited(controller, None, 0.0)
    return _at_limit(records, controller, best, limit)


def _closest_of_all(records: Sequence[Record], controller: Cascade, highest: float) -> Cascade:
    """The controller with the limit and the anti-windup, and its time, with which its torque comes closest to the logged one.

    Another anti-windup than none, and one that has a time, takes the share away that a number has to.
    """
    from scipy.optimize import minimize

    off = _from_rest(records, controller)
    near = [min((_with_limit(one, x) for x in _limits(highest)), key=off) for one in _schemes(controller, highest)]
    winding_up, untimed, timed = near[0], min(near[1:UNTIMED], key=off), min(near[UNTIMED:], key=off)
    time, limit = timed.velocity.tracking_time, timed.velocity.torque_limit
    assert time is not None and limit is not None
    start = np.log([limit, time])

    def at(x: Vector) -> Cascade:
        return _tracked(_with_limit(timed, float(np.exp(x[0]))), float(np.exp(x[1])))

    corners = np.vstack([start, start + np.diag([LIMIT_STEP, np.log(NEXT_TIME)])])
    options = {"initial_simplex": corners, "xatol": LIMIT_EXACT, "fatol": SUM_ROUNDING * highest}
    bounds = [tuple(np.log([some[0], some[-1]])) for some in (_limits(highest), TIMES)]
    found = at(minimize(lambda x: off(at(x)), start, method="Nelder-Mead", bounds=bounds, options=options).x)
    best = _closest_limit(records, winding_up, highest)
    for other in (_closest_limit(records, untimed, highest), found):
        best = other if off(other) < POLICY.each_number * off(best) else best
    return best


def _limits(highest: float) -> Vector:
    return np.asarray(highest * np.geomspace(POLICY.limit_apart, 1.0 / POLICY.limit_apart, LIMITS))


def _closest_limit(records: Sequence[Record], controller: Cascade, highest: float) -> Cascade:
    """The controller with the limit at its torque filters' input with which it comes closest to the logged torque."""
    from scipy.optimize import minimize_scalar

    left, grid = _from_rest(records, controller), _limits(highest)

    def off(limit: float) -> float:
        return left(_with_limit(controller, limit))

    k = int(np.clip(np.argmin([off(limit) for limit in grid]), 1, LIMITS - 2))
    bounds = grid[k - 1], grid[k + 1]
    found = minimize_scalar(off, bounds=bounds, method="bounded", options={"xatol": LIMIT_EXACT * highest})
    return _with_limit(controller, float(found.x))


def with_numbers_of_limit(found: FoundNumbers, limit: Limited, records: Sequence[Record]) -> FoundNumbers:
    """The numbers with those at the limit of a slower log that what it lost between its lines moves, too.

    These are a limit before a filter, whose deviation contains what the others of the numbers move it by, and the tracking time.
    """
    velocity = limit.controller.velocity
    in_motion = any(starts_moving(r, None) for r in records)  # no run shows the limit then
    if limit.limit is not None and limit.controller.torque_filters and velocity.integrator_limit is None and not in_motion:
        moved = [c for by in found.directions if (c := found.moved(by).controller) is not None]
        others = [_closest_limit(records, cascade_of(c), limit.limit).limits[0] for c in moved]
        std = float(np.linalg.norm([limit.std, *(other - limit.limit for other in others)]))
        found = found.with_number((OF_SETTING["torque_limit"], "limit"), limit.limit, std, _with_limit)
    if velocity.tracking_time is not None and 0.0 < limit.time_std < np.inf:
        found = found.with_number((ANTI_WINDUP, "tracking_time"), velocity.tracking_time, limit.time_std, _tracked)
    return found


def _with_limit(controller: Controller, limit: float) -> Cascade:
    cascade = cascade_of(controller)
    torque, integrator = cascade.limits
    return cascade.with_limits(limit, limit if integrator == torque < np.inf else integrator)  # both may be clamped alike


def _tracked(controller: Controller, time: float) -> Cascade:
    cascade = cascade_of(controller)
    return replace(cascade, velocity=replace(cascade.velocity, tracking_time=time))


def _by_windup(records: Sequence[Record], given: Cascade, best: Cascade) -> float:
    """BIC units by which another anti-windup than the given one is better; 0 where it is not by the share of a number."""
    if best.velocity == given.velocity or run_error(records, best) >= POLICY.each_number * run_error(records, given):
        return 0.0
    return _gain(records, given, best)


def _time_std(records: Sequence[Record], best: Cascade) -> float:
    """Deviation of a tracking time [s]; 0 without one."""
    time = best.velocity.tracking_time
    return 0.0 if time is None else time_std(records, lambda at: _tracked(best, at), time)


def time_std(records: Sequence[Record], with_time: Callable[[float], Cascade], time: float, late: int = 0) -> float:
    """Deviation of a time of a controller [s], by what is left and how the torque changes with it.

    With what a velocity that goes straight between the lines would move it by.
    """
    best = with_time(time)

    def made(at: float, straight: bool = False) -> Vector:
        one = with_time(at)
        return np.concatenate([replace(log_of(r, len(r), one, True), late=late).made(one, straight) for r in records])

    slope = (made(time * NEXT_TIME) - made(time / NEXT_TIME)) / (time * NEXT_TIME - time / NEXT_TIME)
    power = float(slope @ slope)
    if not power > 0.0:
        return float("inf")
    moved = float(slope @ (made(time, straight=True) - made(time))) / power
    return max(float(np.hypot(run_error(records, best, late) / np.sqrt(power), moved)), SUM_ROUNDING * time)


def _closest(records: Sequence[Record], controller: Cascade, limit: float) -> Cascade:
    """The controller with the anti-windup at a limit with which its torque comes closest to the logged one.

    A tracking time is searched between the neighbours of the best one of a grid before it is compared with the other schemes: an
    integrator that is held may come closer than each time of the grid.
    """
    from scipy.optimize import minimize_scalar

    errors = [(run_error(records, one), k, one) for k, one in enumerate(_schemes(controller, limit))]
    best = min(errors)[2]
    tracking = min(one for one in errors if one[2].velocity.tracking_time is not None)[2]
    time = tracking.velocity.tracking_time
    assert time is not None

    def with_time(logarithm: float) -> Cascade:
        return _tracked(tracking, float(np.exp(logarithm)))

    found = minimize_scalar(
        lambda x: run_error(records, with_time(x)),
        bounds=(np.log(time / NEXT_TIME), np.log(time * NEXT_TIME)),
        method="bounded",
        options={"xatol": TIME_EXACT},
    )
    return min((best, with_time(found.x)), key=lambda one: run_error(records, one))


def torque_spread(records: Sequence[Record], limit: float) -> float:
    """Deviation of the torques at a limit [N m], no less than their rounding makes."""
    torque = np.concatenate([r.torque for r in records if r.torque is not None])
    at_limit = np.abs(torque)[np.abs(torque) >= POLICY.at_limit * limit]
    rounded = rounding_step(torque) / float(np.sqrt(12.0))  # no decision: a formula: an even distribution
    return max(float(np.std(at_limit)) if len(at_limit) else 0.0, rounded, SUM_ROUNDING * limit)


def _gain(records: Sequence[Record], without: Cascade, controller: Cascade) -> float:
    """BIC units by which a run with a limit is better than one without."""
    n = sum(len(r) for r in records)
    floor = SUM_ROUNDING * float(np.concatenate([np.abs(r.torque) for r in records if r.torque is not None]).max())
    before, after = (max(run_error(records, one), floor) for one in (without, controller))
    return float(2 * n * np.log(before / after) - np.log(n))


def before_filters(torque: Vector, controller: Cascade, period: float) -> Vector:
    """What the controller's torque filters were given [N m] (n,), of a torque at each of its samples: the filters undone."""
    from scipy.signal import lfilter

    for f in reversed(controller.torque_filters):
        b, a = equation_of(f, period)
        torque = np.asarray(lfilter(a, b, torque), dtype=np.float64)
    return torque


def _schemes(controller: Cascade, limit: float) -> Iterator[Cascade]:
    """The anti-windups at this limit, none first, those with a time from number `UNTIMED` on."""
    pi = replace(controller.velocity.winding_up, torque_limit=limit)
    yield replace(controller, velocity=pi)
    yield replace(controller, velocity=replace(pi, integrator_limit=limit))  # both are clamped alike, as SimpleFOC does
    yield replace(controller, velocity=replace(pi, anti_windup="hold"))
    for time in TIMES:
        yield replace(controller, velocity=replace(pi, anti_windup="tracking", tracking_time=float(time)))
