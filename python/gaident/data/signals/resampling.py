"""Channels with time stamps of their own, irregular or of several rates, on one even time axis: only where asked for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.axis import Text, say
from gaident.errors import ReadError
from gaident.policy.table import POLICY

__all__ = ["held_means", "interpolated", "resampled"]

OWN_STEP = 0.8  # no decision: what is said is decided here, and nothing that is found; of a log's own step
MS = 1e3  # no decision: a unit: in a second


def resampled(
    path: str, channels: Mapping[str, tuple[NDArray[np.float64], NDArray[np.float64]]], dt: float, held: Mapping[str, bool] = {}
) -> dict[str, NDArray[np.float64]]:
    """Each channel by linear interpolation at t0 + n dt, t0 to t1 being what all channels cover; one that is held by its means.

        x_held(n) = (1/dt) (integral of x from t0 + n dt to t0 + (n + 1) dt)    x keeps each value until the next time stamp

    channels  name -> (time stamps [s], values), shape (n,) each, n may differ; the stamps increase, those without a
              value (NaN) are left out, and no gap between them may be longer than five of their usual steps in the time
              that all cover
    dt        sample time of the result [s]; at most 1.5 times what the channels have, or high frequencies would alias;
              at least a hundredth of the finest
    held      name -> whether it is known that this channel keeps each value until the next one; where it is not known it does,
              unless another channel was logged faster: then there are values between those that were logged

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
    ends: NDArray[np.float64] = dt * np.arange(len(axis) + 1.0)

    def even(name: str, t: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
        fast = float(np.median(np.diff(t))) <= POLICY.resample_coarser * finest
        return held_means(ends, t - start, x) if held.get(name, False) or (name in held and fast) else np.interp(axis, t, x)

    return {name: even(name, t, x) for name, (t, x) in logged.items()}


def interpolated(step: float, jitters: bool, dt: float) -> list[Text]:
    """What is said of a log whose lines are so far apart [s], put on an axis of steps dt [s].

    jitters: whether many of its steps differ.
    """
    if dt < OWN_STEP * step:
        text = (
            "The log's lines, {:.4g} ms apart, were interpolated to every {:.4g} ms: between them nothing is known, what is fast "
            "is drawn straight, and deviations count lines that are none. Give resample = {:.4g} in its place."
        )
        return [say(text, MS * step, MS * dt, step)]
    text = "The log's lines are not evenly apart; they were interpolated to every {:.4g} ms."
    return [say(text, MS * dt)] if jitters else []


def held_means(ends: NDArray[np.float64], t: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The means between the times `ends` (n + 1,) of a signal that is x(i) from t(i) on, the last one to the end; shape (n,)."""
    last = max(t[-1], ends[-1]) + 1.0  # no decision: a formula: any time behind both
    area = np.append(0.0, np.cumsum(x * np.diff(t, append=last)))
    return np.asarray(np.diff(np.interp(ends, np.append(t, last), area)) / np.diff(ends))


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
