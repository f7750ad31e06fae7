"""Stretches of a record at a held speed, and the torque that each takes.

    torque = mean(u) - J a                      of n samples, T = n dt long
    a      = slope of w over the stretch        the mean torque of the acceleration is J (w_end - w_start)/T exactly
    std^2  = var(u)/n_eff + (J std(a))^2        n_eff independent samples: noise and cogging are alike from line to line

With s the running mean of the velocity, over a 400th of the record, at least smoothed_samples and at most held_samples, and sigma
the deviation of neighbouring means, a speed v is held

    (1) while all s lie within v +- width/2,    width = max(2 still |v|, above_noise sigma)
    (2) and its halves, and its middle and its ends, differ by less than no_ramp width: the longest such stretch of a ramp, or of
        a turning point, fills the width, so that they differ by half of it, whatever the inertia
    (3) for held_samples at least, in one direction: all s have the sign of v, |v| is above half a sensor's step and above_noise
        deviations of a mean, and a logged position moves by half of v T at least: at rest a sensor may show some velocity
    (4) and, where J is known, |J a| < check_torque |mean(u)|

The longest stretch is taken first, then the longest of what is left on either side.
At last those of the rest count that keep to (1) and (2) with `apart` in the place of `still`: a speed may ripple more.
Neighbours are one where the speed of each is that of all, within `apart` or standing_noise deviations of its mean.
What lies between them is within 2 `apart` of it then, or no longer than what stands beside it.
For a ripple of the angle cuts a held speed, and its torque is that of whole periods.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.data.signals.lattice import lattice_step
from gaident.estimation.criterion import effective_samples
from gaident.policy.table import POLICY

__all__ = ["LeftOut", "Plateau", "plateaus_of"]

Vector = NDArray[np.float64]

SIDES = 2.0  # no decision: a formula: from one side of a speed to the other
MEDIAN = 1.4826  # no decision: a formula: median of |x| -> standard deviation of a normal x
SECOND = 6.0  # no decision: a formula: variance of x - 2 y + z over that of each
ROUNDED = 12.0  # no decision: a formula: variance of a value within one step


@dataclass(frozen=True)
class Plateau:
    """One held speed.

    Attributes
    ----------
    record : str
        Name of its record.
    start, stop : float
        Where it begins and ends [s].
    velocity : float
        Mean velocity [rad/s]; its sign is the direction.
    torque : float
        Mean torque, without that of the acceleration where the inertia was given [N m].
    std : float
        Its standard deviation [N m], of the independent samples.
    independent : float
        How many of its samples are independent of each other.
    samples : int
        Samples.
    temperature : float
        Mean temperature, in the unit it was given in; nan where there is none.

    See Also
    --------
    friction_map : Makes it.
    """

    record: str
    start: float
    stop: float
    velocity: float
    torque: float
    std: float
    independent: float
    samples: int
    temperature: float = np.nan


class LeftOut(NamedTuple):
    """Stretches that are long enough, and are no plateau: speeds at which the axis sticks, and those that accelerate it."""

    sticking: int = 0
    accelerating: int = 0


def plateaus_of(rec: Record, name: str, inertia: float | None, temperature: Vector) -> tuple[list[Plateau], LeftOut]:
    """The held speeds of a record in their order; temperature (n,), nan where there is none."""
    assert rec.torque is not None
    width = min(max(POLICY.smoothed_samples, len(rec) // POLICY.smoothed_parts), POLICY.held_samples)
    smooth = _running_mean(rec.velocity, width)
    step, rounding = lattice_step(rec.velocity), lattice_step(rec.torque)
    found, sticking, accelerating = [], 0, 0
    for start, stop, turns in _joined(_stretches(smooth, _scatter(smooth, width)), rec.velocity, smooth):
        if turns:
            continue
        here = slice(start, stop)
        w, u = rec.velocity[here], rec.torque[here]
        speed = float(np.mean(w))
        still = abs(speed) <= max(step / 2, POLICY.above_noise * float(np.std(w)) / np.sqrt(effective_samples(w)))
        if still or (rec.position is not None and _stays(rec.position[here], speed * rec.dt)):
            continue
        if not np.all(np.sign(speed) * smooth[here] > 0.0):
            sticking += 1
            continue
        slope, slope_std = _slope(w, rec.dt)
        mass = 0.0 if inertia is None else inertia
        if abs(mass * slope) > POLICY.check_torque * abs(float(np.mean(u))):
            accelerating += 1
            continue
        independent = effective_samples(u)
        variance = max(float(np.var(u, ddof=1)), rounding**2 / ROUNDED) / independent
        heat = temperature[here][np.isfinite(temperature[here])]
        found.append(
            Plateau(
                name,
                start * rec.dt,
                stop * rec.dt,
                speed,
                float(np.mean(u)) - mass * slope,
                float(np.sqrt(variance + (mass * slope_std) ** 2)),
                independent,
                stop - start,
                float(np.mean(heat)) if len(heat) else np.nan,
            )
        )
    return found, LeftOut(sticking, accelerating)


def _stays(position: Vector, step: float) -> bool:
    """Whether a position moves by less than half of what the velocity says, `step` to a line."""
    return bool(2 * abs(position[-1] - position[0]) < abs(step) * (len(position) - 1))


def _running_mean(x: Vector, width: int) -> Vector:
    """Mean over an odd width, the ends repeated."""
    half = min(width, len(x)) // 2
    padded = np.concatenate([np.full(half, x[0]), x, np.full(half, x[-1])])
    total = np.concatenate([[0.0], np.cumsum(padded)])
    return np.asarray((total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1))


def _scatter(smooth: Vector, width: int) -> float:
    """Standard deviation of means that share no sample, while the axis moves; from second differences: a ramp has none."""
    bent = np.abs(smooth[: -2 * width] - 2 * smooth[width:-width] + smooth[2 * width :])
    moves = np.abs(smooth[width:-width]) > POLICY.still * float(np.max(np.abs(smooth)))
    return MEDIAN * float(np.median(bent[moves])) / float(np.sqrt(SECOND)) if np.any(moves) else 0.0


def _slope(w: Vector, dt: float) -> tuple[float, float]:
    """Slope of a straight line through w [rad/s^2], and its standard deviation."""
    t = dt * (np.arange(len(w)) - 0.5 * (len(w) - 1))
    slope = float(t @ w / (t @ t))
    left = w - np.mean(w) - slope * t
    return slope, float(np.sqrt(np.mean(left**2) * len(w) / effective_samples(left) / (t @ t)))


class _Stretch(NamedTuple):
    """A stretch in the band; turns: it fills the band as a turning point does."""

    start: int
    stop: int
    turns: bool = False


def _joined(parts: Sequence[_Stretch], velocity: Vector, smooth: Vector) -> list[_Stretch]:
    """Stretches in their order, neighbours of one speed as one: all of them, else those before and after a cut.

    The cut is at the widest gap, of the lengths beside it, or where neighbours differ most.
    """
    if len(parts) < 2:
        return list(parts)
    whole = slice(parts[0].start, parts[-1].stop)
    gaps = [_gap(before, after, smooth) for before, after in itertools.pairwise(parts)]
    one_way = np.ptp(np.sign(smooth[whole])) == 0.0
    if max(gaps) < 1.0 and one_way and _of_one_speed(parts, velocity, float(np.mean(velocity[whole]))):
        return [_Stretch(whole.start, whole.stop)]
    means = [float(np.mean(velocity[part.start : part.stop])) for part in parts]
    at = 1 + int(np.argmax(gaps if max(gaps) >= 1.0 else np.abs(np.diff(means))))
    return [*_joined(parts[:at], velocity, smooth), *_joined(parts[at:], velocity, smooth)]


def _gap(before: _Stretch, after: _Stretch, smooth: Vector) -> float:
    """Length of the gap between two stretches, of the longer one; 0 where the speed in it is near theirs."""
    speed, between = float(np.mean(smooth[before.start : after.stop])), smooth[before.stop : after.start]
    if np.all(np.abs(between - speed) < SIDES * POLICY.apart * abs(speed)):
        return 0.0
    return (after.start - before.stop) / max(before.stop - before.start, after.stop - after.start)


def _of_one_speed(parts: Sequence[_Stretch], velocity: Vector, speed: float) -> bool:
    """Whether each has the speed of all."""
    own = [velocity[part.start : part.stop] for part in parts]
    reach = POLICY.apart * abs(speed)
    return all(abs(np.mean(w) - speed) < max(reach, POLICY.standing_noise * np.std(w) / np.sqrt(len(w))) for w in own)


def _stretches(smooth: Vector, scatter: float) -> list[_Stretch]:
    """The stretches that keep to (1), are no ramp and long enough, in their order."""
    found: list[_Stretch] = []
    for share in (POLICY.still, POLICY.apart):
        ends = [0, *(end for part in sorted(found) for end in (part.start, part.stop)), len(smooth)]
        found += _longest(smooth, list(zip(ends[::2], ends[1::2], strict=True)), _Width(share, scatter))
    return sorted(found)


class _Width(NamedTuple):
    """Of the band of a held speed, from one side to the other: a share of the speed on either side, or what noise needs."""

    share: float
    scatter: float

    def at(self, speed: float) -> float:
        return max(SIDES * self.share * abs(speed), POLICY.above_noise * self.scatter)


def _longest(smooth: Vector, parts: list[tuple[int, int]], width: _Width) -> Iterator[_Stretch]:
    """Of each part the longest stretch in the band, and of what is left on either side; those of a ramp left out."""
    reach = _reach(smooth, width)
    while parts:
        low, high = parts.pop()
        if high - low < POLICY.held_samples:
            continue
        lengths = np.minimum(reach[low:high], high) - np.arange(low, high)
        start = low + int(np.argmax(lengths))
        stop = start + int(lengths[start - low])
        if stop - start < POLICY.held_samples:
            continue
        parts += [(low, start), (stop, high)]
        first, second, third, last = np.array_split(smooth[start:stop], 4)
        little = POLICY.no_ramp * width.at(float(np.median(smooth[start:stop])))
        if _differ([first, second], [third, last]) < little:
            yield _Stretch(start, stop, _differ([first, last], [second, third]) >= little)


def _differ(some: list[Vector], others: list[Vector]) -> float:
    return abs(float(np.median(np.concatenate(some)) - np.median(np.concatenate(others))))


def _reach(smooth: Vector, width: _Width) -> NDArray[np.intp]:
    """For each sample the end of the longest stretch from it on that keeps to (1): its extremes are no farther apart."""
    values = smooth.tolist()
    n, stop = len(values), 0
    reach = np.empty(n, dtype=np.intp)
    lowest: deque[int] = deque()
    highest: deque[int] = deque()
    for start in range(n):
        while stop < n:
            value = values[stop]
            low = min(value, values[lowest[0]]) if lowest else value
            high = max(value, values[highest[0]]) if highest else value
            if high - low > width.at((low + high) / 2):
                break
            while lowest and values[lowest[-1]] >= value:
                lowest.pop()
            while highest and values[highest[-1]] <= value:
                highest.pop()
            lowest.append(stop)
            highest.append(stop)
            stop += 1
        reach[start] = stop
        for ends in (lowest, highest):
            if ends and ends[0] == start:
                ends.popleft()
    return reach
