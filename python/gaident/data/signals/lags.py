"""Offset and rate between two signals of the same motion: coarsely by correlation, finely by least squares."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.data.signals.decimation import low_passed
from gaident.estimation.criterion import effective_samples
from gaident.policy.table import POLICY

__all__ = ["LagFit", "coarse_lags", "refine"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class LagFit:
    """offset t0 [s], rate rho, with standard deviations std = (of t0, of rho); see alignment.py.

    centre       [s] middle of the samples used, on the second clock; centre_std [s]: of the time axis there
    variance     of the residual, as a part of the variance of y
    width        [s] within which offsets are the same one: where the correlation has fallen by half
    independent  samples of the residual that count
    """

    offset: float
    rate: float
    std: tuple[float, float]
    centre: float
    centre_std: float
    gain: float
    variance: float
    correlation: float
    width: float
    independent: float

    def with_rate_std(self, value: float) -> LagFit:
        """The fit of a rate taken to be 0, with the uncertainty that this hides."""
        return replace(self, std=(float(np.hypot(self.std[0], value * self.centre)), value))


def coarse_lags(
    x: Vector, dt: float, y: Vector, their_dt: float, within: tuple[float, float] | None, max_rate: float
) -> Iterator[tuple[float, float]]:
    """(offset [s], rate) of the highest peaks of the correlation, both signals on one grid, over a range of rates."""
    duration = min(len(x) * dt, len(y) * their_dt)
    grid = max(dt, their_dt, max(len(x) * dt, len(y) * their_dt) / POLICY.aligned_samples)
    a = _on_grid(x, dt, grid)
    width = max(_half_width(a) * grid, grid)
    steps = int(np.ceil(max_rate * duration / width))
    rates = np.linspace(-max_rate, max_rate, min(2 * steps, POLICY.clock_rates - 1) + 1) if steps else np.zeros(1)
    peaks: list[tuple[float, float, float]] = []
    for rate in rates:
        b = _on_grid(y, their_dt * (1.0 + rate), grid)
        lags, correlation = _correlation(a, b)
        offsets = lags * grid
        if within is not None:
            inside = (offsets >= within[0] - width) & (offsets <= within[1] + width)
            offsets, correlation = offsets[inside], correlation[inside]
        strong = np.abs(correlation)
        for k in _peaks(strong):
            peaks.append((float(strong[k]), float(offsets[k]), float(rate)))
    peaks.sort(reverse=True)
    chosen: list[tuple[float, float]] = []
    for _, offset, rate in peaks:
        if all(abs(offset - other) > width for other, _ in chosen):
            chosen.append((offset, rate))
        if len(chosen) == POLICY.lag_peaks:
            break
    yield from chosen


def _on_grid(x: Vector, dt: float, grid: float) -> Vector:
    time = np.arange(int((len(x) - 1) * dt / grid) + 1) * grid
    return np.asarray(np.interp(time, np.arange(len(x)) * dt, low_passed(x, grid / dt)))


def _half_width(a: Vector) -> float:
    """Samples in which the autocorrelation falls to a half."""
    lags, correlation = _correlation(a, a)
    right = correlation[np.searchsorted(lags, 0) :]
    below = np.flatnonzero(right < 0.5)  # no decision: a formula: the width of a peak
    return float(below[0]) if below.size else len(right) / 4.0


def _correlation(a: Vector, b: Vector) -> tuple[Vector, Vector]:
    """(lags l, correlation of a(n + l) and b(n) over what they share), where enough is shared."""
    from scipy.signal import correlate

    a, b = a - a.mean(), b - b.mean()
    ones_a, ones_b = np.ones(len(a)), np.ones(len(b))

    def sums(p: Vector, q: Vector) -> Vector:
        return np.asarray(correlate(p, q, mode="full", method="fft"))

    count = np.rint(sums(ones_a, ones_b))
    sa, sb = sums(a, ones_b), sums(ones_a, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        va, vb = sums(a * a, ones_b) - sa**2 / count, sums(ones_a, b * b) - sb**2 / count
        # Where little moves in what is shared, a correlation says nothing.
        usable = count >= POLICY.overlap * min(len(a), len(b))
        # no decision: no division by 0: where nothing moves there is no correlation
        usable &= (va > 1e-3 * count * a.var()) & (vb > 1e-3 * count * b.var())
        correlation = (sums(a, b) - sa * sb / count) / np.sqrt(np.where(usable, va * vb, np.inf))
    return np.arange(1.0 - len(b), len(a)), np.where(usable, correlation, 0.0)


def _peaks(strong: Vector) -> NDArray[np.intp]:
    """The highest local maxima, ends included."""
    padded = np.concatenate([[-1.0], strong, [-1.0]])
    local = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] > padded[2:]))
    return local[np.argsort(strong[local])[::-1][: 4 * POLICY.lag_peaks]]


def refine(
    x: Vector, dt: float, y: Vector, their_dt: float, offset: float, rate: float, max_rate: float, free_rate: bool = True
) -> LagFit | None:
    """Least squares in offset, rate, scale and zero, from where the correlation led.

    None where the logs do not overlap. The offset stays within the width of the correlation's peak, the rate below max_rate.
    """
    from scipy.interpolate import CubicSpline
    from scipy.optimize import least_squares

    # Noise of x would pass for motion of its own: both are looked at in the band that they share.
    band = _shared_band(x, dt, y, their_dt, offset, rate)
    spline = CubicSpline(np.arange(len(x)) * dt, low_passed(x, 0.5 / (band * dt)))
    slope = spline.derivative()
    own = np.arange(len(y)) * their_dt
    smooth = low_passed(y, 0.5 / (band * their_dt))
    margin = 2.0 * max(dt, their_dt)  # no decision: samples at the ends, where a spline has no neighbours
    t = offset + (1.0 + rate) * own
    used = (t >= margin) & (t <= (len(x) - 1) * dt - margin)
    s, z = own[used], smooth[used]
    if len(s) < 20:  # no decision: how many samples a fit of four numbers needs
        return None
    width = 2.0 * _half_width(smooth - smooth.mean()) * their_dt
    centre = float(s.mean())
    at, rho = offset + (1.0 + rate) * centre, rate  # the time axis at the centre, which the rate hardly moves
    low, high = at - width, at + width

    def model(p: Vector) -> Vector:
        moved, scale, zero = p[:-2], p[-2], p[-1]
        t = moved[0] + (1.0 + (moved[1] if free_rate else rho)) * (s - centre)
        return np.asarray(scale * spline(t) + zero)

    def slopes(p: Vector) -> Vector:
        t = p[0] + (1.0 + (p[1] if free_rate else rho)) * (s - centre)
        along = p[-2] * slope(t)
        columns = [along, along * (s - centre)] if free_rate else [along]
        return np.column_stack([*columns, spline(t), np.ones(len(t))])

    basis = np.column_stack([spline(at + (1.0 + rho) * (s - centre)), np.ones(len(s))])
    scale, zero = np.linalg.lstsq(basis, z, rcond=None)[0].tolist()
    moved = [(at, low, high), (rho, -max_rate, max_rate)] if free_rate else [(at, low, high)]
    start, lowest, highest = np.array([*moved, (scale, -np.inf, np.inf), (zero, -np.inf, np.inf)]).T
    found = least_squares(
        lambda p: model(p) - z,
        np.clip(start, lowest, highest),
        slopes,
        (lowest, highest),
        method="dogbox",
        x_scale="jac",
        ftol=1e-10,
        xtol=1e-14,
    )
    p = found.x
    at, rho, gain = float(p[0]), float(p[1]) if free_rate else rho, float(p[-2])
    e, J = z - model(p), slopes(p)
    cov, independent = _sandwich(J, e), effective_samples(e)
    rate_std = float(np.sqrt(cov[1, 1])) if free_rate else 0.0
    to_start = np.array([1.0, -centre]) if free_rate else np.array([1.0])
    k = len(to_start)
    offset_std = float(np.sqrt(to_start @ cov[:k, :k] @ to_start))
    variance = float(e @ e) / max(float(((z - z.mean()) ** 2).sum()), 1e-300)
    correlation = float(np.sqrt(max(0.0, 1.0 - variance)))
    return LagFit(
        at - (1.0 + rho) * centre, rho, (offset_std, rate_std), centre, float(np.sqrt(cov[0, 0])), gain,
        max(variance, 1e-12), correlation, width, independent,
    )  # fmt: skip


def _shared_band(x: Vector, dt: float, y: Vector, their_dt: float, offset: float, rate: float) -> float:
    """Frequency [Hz] up to which the coherence of the two, as aligned so far, stays above a half."""
    from scipy.signal import coherence

    grid = max(dt, their_dt)
    time = np.arange(int((len(y) - 1) * their_dt / grid) + 1) * grid
    t = offset + (1.0 + rate) * time
    inside = (t >= 0.0) & (t <= (len(x) - 1) * dt)
    a = np.interp(t[inside], np.arange(len(x)) * dt, low_passed(x, grid / dt))
    b = np.interp(time[inside], np.arange(len(y)) * their_dt, low_passed(y, grid / their_dt))
    part = max(16, len(a) // 8)  # no decision: segments of a coherence, and half of it: where noise and signal are as strong
    if len(a) < 32:  # no decision: segments of a coherence, and half of it: where noise and signal are as strong
        return 0.5 / grid
    frequency, square = coherence(a, b, 1.0 / grid, nperseg=part, detrend="linear")
    # no decision: segments of a coherence, and half of it: where noise and signal are as strong
    below = np.flatnonzero(square[3:] < 0.5)
    return float(frequency[3 + below[0]]) if below.size else 0.5 / grid


def _sandwich(J: Vector, e: Vector) -> Vector:
    """Covariance of the parameters, with Bartlett's weights over the lags."""
    n = len(e)
    # no decision: a formula: the bandwidth of an estimate of variance
    r = np.array([e[: n - k] @ e[k:] for k in range(min(n // 4, 400))]) / max(float(e @ e), 1e-300)
    quiet = np.flatnonzero(np.abs(r) < 2.0 / np.sqrt(n))  # no decision: a formula: the bandwidth of an estimate of variance
    reach = min(2 * (int(quiet[0]) if quiet.size else len(r)) + 1, n // 2)
    scale = np.linalg.norm(J, axis=0) + 1e-300
    scores = (J / scale) * e[:, None]
    S = scores.T @ scores
    for k in range(1, reach):
        part = scores[:-k].T @ scores[k:]
        S += (1.0 - k / reach) * (part + part.T)
    inverse = np.linalg.pinv((J / scale).T @ (J / scale), rcond=1e-14)
    cov = (inverse @ S @ inverse) / np.outer(scale, scale)
    return np.asarray(cov * n / max(1, n - J.shape[1]))
