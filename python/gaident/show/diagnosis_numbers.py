"""What the pictures of a diagnosis draw, as numbers: means over bins, order lines, averages around reversals, spectra."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Binned",
    "OrderLines",
    "Reversals",
    "Spectrum",
    "binned_mean",
    "branches",
    "order_lines",
    "over_period",
    "reversal_averages",
    "smoothed",
    "spectrum",
]

Vector = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST_IN_BIN = 8
MOST_STEPS = 1_000_000  # of angle, over all turns


@dataclass(frozen=True, eq=False)
class Binned:
    """Per bin of x with enough samples: its mean x, mean and standard deviation of y, number of samples; arrays (bins,)."""

    x: Vector
    mean: Vector
    std: Vector
    count: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class OrderLines:
    """Amplitude [N m] per order (lines per turn), the level that chance passes in one spectrum of a hundred, turns travelled.

    level has a value per order: that of the noise around it.
    """

    order: Vector
    amplitude: Vector
    level: Vector
    turns: float

    @property
    def peaks(self) -> list[tuple[float, float]]:
        """(order, amplitude) of up to four local maxima clearly above the level, the largest first.

        An order is whole where the turns travelled do not tell it from a whole one.
        """
        a = self.amplitude
        least = np.maximum(1.2 * self.level, 0.25 * float(a.max(initial=0.0)))
        tops = [i for i in range(1, len(a) - 1) if a[i] > least[i] and a[i] >= a[i - 1] and a[i] > a[i + 1]]
        tops.sort(key=lambda i: -a[i])
        kept: list[int] = []
        for i in tops:
            # A line has side lobes a turn's resolution wide.
            if all(abs(self.order[i] - self.order[j]) > max(0.3, 3.0 / max(self.turns, 0.1)) for j in kept):
                kept.append(i)
        blur = 0.5 / max(self.turns, 0.5)
        orders = [float(self.order[i]) for i in kept[:4]]
        whole = [float(round(k)) if abs(k - round(k)) < blur and round(k) else k for k in orders]
        return [(k, float(a[i])) for k, i in zip(whole, kept, strict=False)]


@dataclass(frozen=True, eq=False)
class Reversals:
    """Averages over reversals, turned so that the new direction is positive; time [s] from the reversal, shape (n,).

    Per group ("small" and "large", by the torque around the reversal, or "all"): mean and standard deviation of torque and mean
    velocity, (n,) each, and how many reversals. none: why there is no group, "" where there is one.
    """

    time: Vector
    groups: dict[str, tuple[Vector, Vector, Vector, int]]
    none: str = ""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Amplitude density [unit/sqrt(Hz)] over frequency [Hz], mean over half-overlapping Hann windows."""

    frequency: Vector
    density: Vector


def smoothed(x: Vector, width: int) -> Vector:
    """Moving average over an odd number of samples near `width`, the ends repeated."""
    half = max(0, min(width, len(x)) // 2)
    total = np.concatenate([[0.0], np.cumsum(np.concatenate([np.full(half, x[0]), x, np.full(half, x[-1])]))])
    out: Vector = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
    return out


def branches(velocity: Vector, dt: float) -> tuple[Mask, Mask]:
    """(accelerating, decelerating) samples: the speed |w| grows or falls by more than a fifth of its typical rate of change."""
    w = _slow(velocity)
    rate = np.gradient(w, dt) * np.sign(w)
    typical = float(np.sqrt(np.mean(rate**2)))
    return rate > 0.2 * typical, rate < -0.2 * typical


def binned_mean(x: Vector, y: Vector, bins: int = 40, used: Mask | None = None) -> Binned:
    """Over `bins` equal bins of +-max |x|, with an edge at 0; bins of fewer than eight samples are left out."""
    index = _symmetric_bins(x, bins)
    if used is not None:
        index, x, y = index[used], x[used], y[used]
    return _binned(index, x, y, bins)


def order_lines(position: Vector, torque: Vector, velocity: Vector, highest: float = 40.0) -> OrderLines:
    """Amplitudes of sin and cos(order * angle) in the torque while the axis turns, even in angle.

    What depends on the velocity alone (the mean per velocity bin) is taken out first: dry friction is no line.
    """
    w = _slow(velocity)
    moving = _moving(w)
    theta, d, speed = position[moving], torque[moving], w[moving]
    turns = float(np.ptp(theta)) / math.tau if len(theta) else 0.0
    if turns < 0.05 or len(theta) < 50:
        return OrderLines(np.zeros(0), np.zeros(0), np.zeros(0), turns)
    rest = _without_velocity(d, speed)
    weight = np.abs(speed) / float(np.sum(np.abs(speed)))
    # Collected over small steps of angle, the sums over all orders are one Fourier transform.
    per_turn = max(2.0 * highest, min(16.0 * highest, MOST_STEPS / turns))
    place = ((theta - theta.min()) / math.tau * per_turn).astype(int)
    summed = np.bincount(place, weight * rest)
    size = 1 << max(len(summed), math.ceil(per_turn / 0.25), math.ceil(4.0 * turns * per_turn)).bit_length()
    orders = np.arange(size // 2 + 1, dtype=np.float64) * (per_turn / size)
    lines = 2.0 * np.abs(np.fft.rfft(summed, size))
    shown = (orders >= max(0.5, 1.0 / turns)) & (orders <= highest)  # of less than a period the travel shows nothing
    orders, lines = orders[shown], lines[shown]
    # Of noise the amplitudes are Rayleigh: median sigma sqrt(2 ln 2), passed by one of K with 1 % at sigma sqrt(2 ln(K/0.01)).
    sigma = _falling_median(orders, lines) / math.sqrt(2.0 * math.log(2.0))
    return OrderLines(orders, lines, sigma * math.sqrt(2.0 * math.log(max(len(orders), 2) / 0.01)), turns)


def _falling_median(orders: Vector, lines: Vector) -> Vector:
    """The level of a coloured noise: c order^-s, 0 <= s <= 2, with half of the amplitudes below; lines hardly move it.

    Least absolute deviations of the logarithms, by reweighted least squares.
    """
    if len(lines) < 8:
        return np.full(len(lines), float(np.median(lines)) if len(lines) else 0.0)
    x, y = np.log(orders), np.log(np.maximum(lines, 1e-12 * float(lines.max()) + 1e-300))
    weight = np.ones_like(y)
    slope = 0.0
    for _ in range(12):
        mean_x, mean_y = (float(np.average(v, weights=weight)) for v in (x, y))
        slope = float(np.clip(np.sum(weight * (x - mean_x) * (y - mean_y)) / np.sum(weight * (x - mean_x) ** 2), -2.0, 0.0))
        weight = 1.0 / np.maximum(np.abs(y - mean_y - slope * (x - mean_x)), 0.05)
    level: Vector = np.exp(slope * x + np.median(y - slope * x))
    return level


def reversal_averages(velocity: Vector, torque: Vector, drive_torque: Vector, dt: float, half_window: float = 0.05) -> Reversals:
    """Averages of missing torque and velocity [rad/s] around the samples where the velocity changes its sign.

    torque: the missing torque; drive_torque: the controller's, by whose size before the reversal the groups are made [N m].
    """
    half = max(3, round(half_window / dt))
    w = smoothed(velocity, 5)
    floor = 0.02 * float(np.abs(w).max(initial=0.0))
    far = np.flatnonzero(np.abs(w) > floor)
    signs = np.sign(w[far])
    turns = np.flatnonzero(signs[1:] != signs[:-1])
    found = []
    for i in turns:
        a, b = far[i], far[i + 1]
        centre = a + int(np.argmax(np.sign(w[a : b + 1]) != signs[i]))
        if centre >= half and centre + half < len(w):
            found.append((centre, float(signs[i + 1]), float(np.abs(drive_torque[centre - half : centre + half]).max())))
    groups: dict[str, tuple[Vector, Vector, Vector, int]] = {}
    sizes = [size for *_, size in found]
    split = math.sqrt(min(sizes) * max(sizes)) if found else 0.0
    several = len(found) >= 4 and max(sizes) > 1.5 * min(sizes)
    for name in ("small", "large") if several else ("all",):
        chosen = [(c, s) for c, s, size in found if not several or (size <= split) == (name == "small")]
        if chosen:
            d = np.array([s * torque[c - half : c + half + 1] for c, s in chosen])
            v = np.array([s * velocity[c - half : c + half + 1] for c, s in chosen])
            groups[name] = (d.mean(axis=0), d.std(axis=0), v.mean(axis=0), len(chosen))
    none = ""
    if not groups:
        around = f"no reversal with {1e3 * half * dt:.3g} ms of record before and after it"
        none = around if len(turns) else "no reversals in the record"
    return Reversals(np.arange(-half, half + 1, dtype=np.float64) * dt, groups, none)


def spectrum(x: Vector, dt: float, segments: int = 8) -> Spectrum:
    """Of x without its mean; white noise of standard deviation s stands at s sqrt(2 dt) at every frequency."""
    size = max(16, min(len(x), 2 * len(x) // (segments + 1)))
    window = np.hanning(size + 2)[1:-1]
    starts = range(0, max(len(x) - size, 0) + 1, max(1, size // 2))
    power = np.mean([np.abs(np.fft.rfft((x[a : a + size] - x.mean()) * window)) ** 2 for a in starts], axis=0)
    density = np.sqrt(2.0 * dt * power / np.sum(window**2))
    f = np.arange(1, len(density), dtype=np.float64) / (size * dt)
    return Spectrum(f, density[1:])


def over_period(position: Vector, torque: Vector, velocity: Vector, period: float, bins: int = 48, direction: int = 0) -> Binned:
    """Mean of the torque per bin of the position within `period`, while the axis moves; x from 0 to period.

    What depends on the velocity alone is taken out first, as in `order_lines`: what is left belongs to the place.
    direction: 1 or -1, samples of motion that way alone; 0, all.
    """
    w = _slow(velocity)
    moving = _moving(w)
    if not np.any(moving):
        return Binned(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64))
    d = _without_velocity(torque[moving], w[moving])
    place = np.mod(position[moving] - (0.0 if period == math.tau else float(position.min())), period)
    if direction:
        there = direction * w[moving] > 0.0
        d, place = d[there], place[there]
    return _binned(np.minimum((place / period * bins).astype(int), bins - 1), place, d, bins)


def _binned(index: NDArray[np.int64], x: Vector, y: Vector, bins: int) -> Binned:
    """Means of x and y over the samples of each bin; bins of fewer than LEAST_IN_BIN samples are left out."""
    count = np.bincount(index, minlength=bins)
    kept = count >= LEAST_IN_BIN
    mean = _bin_means(index, y, bins)
    variance = _bin_means(index, (y - mean[index]) ** 2, bins)
    return Binned(_bin_means(index, x, bins)[kept], mean[kept], np.sqrt(variance)[kept], count[kept])


def _bin_means(index: NDArray[np.int64], y: Vector, bins: int) -> Vector:
    """The mean of y per bin, 0 where a bin is empty; shape (bins,)."""
    mean: Vector = np.bincount(index, y, minlength=bins) / np.maximum(np.bincount(index, minlength=bins), 1)
    return mean


def _symmetric_bins(x: Vector, bins: int) -> NDArray[np.int64]:
    """The bin of each sample, an even number of equal bins over +-max |x|, with an edge at 0."""
    top = float(np.abs(x).max()) * (1.0 + 1e-9) or 1.0
    index: NDArray[np.int64] = np.clip(((x / top + 1.0) * 0.5 * (bins // 2 * 2)).astype(int), 0, bins // 2 * 2 - 1)
    return index


def _slow(velocity: Vector) -> Vector:
    """The velocity behind a moving average over a three-hundredth of the record, at least five samples."""
    return smoothed(velocity, max(5, len(velocity) // 300))


def _moving(w: Vector) -> Mask:
    """The samples with more than 2 % of the largest speed."""
    moving: Mask = np.abs(w) > 0.02 * float(np.abs(w).max(initial=0.0))
    return moving


def _without_velocity(torque: Vector, velocity: Vector) -> Vector:
    """The torque without the mean of each sample's velocity bin, forty over +-max |w|."""
    index = _symmetric_bins(velocity, 40)
    rest: Vector = torque - _bin_means(index, torque, 40)[index]
    return rest
