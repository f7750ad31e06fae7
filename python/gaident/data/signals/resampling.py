"""Channels with time stamps of their own, irregular or of several rates, on one even time axis: only where asked for."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.errors import ReadError
from gaident.policy.table import POLICY

__all__ = ["resampled"]


def resampled(
    path: str, channels: Mapping[str, tuple[NDArray[np.float64], NDArray[np.float64]]], dt: float, held: Collection[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Each channel by linear interpolation at t0 + n dt, t0 to t1 being what all channels cover.

        x_held(n) = (1/dt) (integral of x from t0 + n dt to t0 + (n + 1) dt)    x keeps each value until the next time stamp

    channels  name -> (time stamps [s], values), shape (n,) each, n may differ; the stamps increase, those without a
              value (NaN) are left out, and no gap between them may be longer than five of their usual steps in the time
              that all cover
    dt        sample time of the result [s]; at most 1.5 times what the channels have, or high frequencies would alias;
              at least a hundredth of the finest
    held      names of channels that keep each value until the next one, unless another channel was logged faster: then there are
              values between those that were logged; the mean over a line of the result is held over it

    Linear interpolation is a low-pass of its own (sinc^2 on average: -1.8 dB at a quarter of the log's sample rate) without
    delay. Raises ReadError.
    """
    logged = {}
    finest = np.inf
    for name, (time, values) in channels.items():
        there = np.isfinite(time) & np.isfinite(values)
        t, x = time[there], values[there]
        back = np.flatnonzero(np.diff(t) <= 0.0)
        if t.size < 2 or back.size:
            where = "has fewer than two values" if t.size < 2 else f"does not increase at {t[back[0]]:.12g} s"
            raise ReadError(f"{path}: the time of {name} {where}; sort the log or remove stamps that stand twice")
        steps = np.diff(t)
        median = float(np.median(steps))
        if dt > POLICY.resample_coarser * median:
            raise ReadError(
                f"{path}: {arg('resample', format(dt, 'g'))} s is coarser than the log, whose {name} has steps of {median:g} "
                "s, and would alias high "
                f"frequencies down; give {arg('resample', format(median, '.4g'))} and "
                f"{arg('decimate', repr(max(2, round(dt / median))))}"
            )
        logged[name] = (t, x)
        finest = min(finest, median)
    if dt * POLICY.resample_finer < finest:
        raise ReadError(
            f"{path}: {arg('resample', format(dt, 'g'))} s is more than {POLICY.resample_finer:g} times finer than the log, "
            f"whose steps are {finest:g} s: "
            f"give seconds, for example {arg('resample', format(finest, '.4g'))}"
        )
    start, stop = max(t[0] for t, _ in logged.values()), min(t[-1] for t, _ in logged.values())
    if stop <= start:
        raise ReadError(f"{path}: the channels were not logged at the same time; name columns of one run")
    for name, (t, _) in logged.items():
        _refuse_gaps(path, name, t, start, stop)
    axis = start + dt * np.arange(int(np.floor((stop - start) / dt + 1e-6)) + 1)
    fast = POLICY.resample_coarser * finest
    kept = {name for name, (t, _) in logged.items() if name in held and float(np.median(np.diff(t))) <= fast}
    return {
        name: _means(len(axis), dt, t - start, x) if name in kept else np.interp(axis, t, x) for name, (t, x) in logged.items()
    }


def _means(count: int, dt: float, t: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of a signal that is x from each t on, t from the first line, the mean over each line of an even axis."""
    ends = dt * np.arange(count + 1)
    last = max(t[-1], ends[-1]) + dt  # its last value is held to the end
    area = np.append(0.0, np.cumsum(x * np.diff(t, append=last)))
    return np.asarray(np.diff(np.interp(ends, np.append(t, last), area)) / dt)


def _refuse_gaps(path: str, name: str, t: NDArray[np.float64], start: float, stop: float) -> None:
    """ReadError where a channel pauses inside the time from `start` to `stop`."""
    steps = np.diff(t)
    usual = float(np.median(steps))
    at = int(np.argmax(np.where((t[:-1] < stop) & (t[1:] > start), steps, 0.0)))
    if steps[at] > POLICY.pause * usual and t[at] < stop and t[at + 1] > start:
        raise ReadError(
            f"{path}: {name} has a gap of {steps[at]:.4g} s, from {t[at]:.9g} to {t[at + 1]:.9g} s, where its usual step is "
            f"{usual:.4g} s, and nobody knows what happened in it; split the log there into two records, which can be "
            f"identified together: read_pieces does it ({arg('pieces', python='pieces=True')})"
        )
