"""Effects of the same kind, made by one function each; `known`: what else a `Cause` contains."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.axis import TURN
from gaident.diagnosis.library.cause import Cause
from gaident.diagnosis.library.coordinates import positive
from gaident.estimation.term import PHASE, Rows, Scales
from gaident.models.effect_rows import by_wave
from gaident.models.effects import row_of

__all__ = ["FREE", "harmonic", "linear", "of_waves", "single", "tone"]

FREE = 1e6  # no decision: what an argument may be: a bound that nothing reaches;
"""Times the largest torque of the log: a pendulum that swings with little friction has far more torque than drives it."""

LARGEST_SHARE = 0.95  # no decision: a formula: an inertia is above 0 at every angle
"""Of an inertia that changes with its angle: beyond it there is next to none at some angle."""

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def single(
    effect: str,
    place: str,
    name: str,
    low: Callable[[Scales], float],
    high: Callable[[Scales], float],
    starts: Callable[[Scales], tuple[float, ...]],
    **known: Any,
) -> Cause:
    """An effect of one positive number of unknown size, moved by its logarithm."""
    return Cause(
        effect,
        place,
        positive(0),
        lambda p: np.log([max(p[name], 1e-300)]),
        lambda s: [(float(np.log(low(s))), float(np.log(high(s))))],
        lambda s: [(float(np.log(v)),) for v in starts(s) if low(s) < v < high(s)],
        lambda s: (1.0,),
        **known,
    )


def linear(effect: str, name: str, low: Callable[[Scales], float], high: Callable[[Scales], float],
            starts: Callable[[Scales], tuple[float, ...]], step: Callable[[Scales], float], **known: Any) -> Cause:  # fmt: skip
    """A shaft torque in proportion to one number, moved as it is."""
    return Cause(
        effect,
        "shaft",
        lambda z: z.copy(),
        lambda p: np.array([p[name]]),
        lambda s: [(low(s), high(s))],
        lambda s: [(v,) for v in starts(s)],
        lambda s: (step(s),),
        proportional=True,
        from_nothing=True,
        **known,
    )


def tone(effect: str, **known: Any) -> Cause:
    """A torque of one frequency in time: (a cos(phase), a sin(phase), frequency) -> (amplitude, frequency, phase)."""

    def natural(z: Matrix) -> Matrix:
        return np.column_stack([np.hypot(z[:, 0], z[:, 1]), z[:, 2], np.arctan2(z[:, 1], z[:, 0])])

    def coordinates(p: Mapping[str, float]) -> Vector:
        a, phase = p["amplitude"], p["phase"]
        return np.array([a * np.cos(phase), a * np.sin(phase), p["frequency"]])

    def limits(s: Scales) -> Rows:
        a, fastest = 10.0 * s.torque, 0.5 / s.dt
        return [(-a, a), (-a, a), (1e-3 * fastest, fastest)]

    return Cause(
        effect,
        "shaft",
        natural,
        coordinates,
        limits,
        lambda s: [],
        lambda s: (0.05 * s.torque, 0.05 * s.torque, 0.02 / s.duration),
        in_time=True,
        later=lambda rows, s: rows + TURN * s * rows[:, 1:2] * np.eye(3)[2],  # the phase, in rad, of the frequency
        scales={"phase": PHASE},
        **known,
    )


def harmonic(effect: str, place: str, first: int, with_order: bool, kind: str, **known: Any) -> Cause:
    """A harmonic of the angle: (a cos(phase), a sin(phase)[, order]) -> (amplitude[, order], phase)."""
    share = kind == "inertia"

    def natural(z: Matrix) -> Matrix:
        size = np.hypot(z[:, 0], z[:, 1])
        columns = [np.minimum(size, LARGEST_SHARE) if share else size]
        if with_order:
            columns.append(z[:, 2])
        columns.append(np.arctan2(z[:, 1], z[:, 0]))
        return np.column_stack(columns)

    def coordinates(p: Mapping[str, float]) -> Vector:
        a, phase = p["amplitude"], p["phase"]
        pair = [a * np.cos(phase), a * np.sin(phase)]
        return np.array([*pair, p["order"]] if with_order else pair)

    def amplitude(s: Scales) -> float:
        return s.torque if kind == "torque" else LARGEST_SHARE if share else 0.2

    def limits(s: Scales) -> Rows:
        a = (10.0 if with_order else FREE) * amplitude(s) if kind == "torque" else amplitude(s)
        rows: Rows = [(-a, a), (-a, a), (float(first), FREE)]
        return rows[: 3 if with_order else 2]

    def steps(s: Scales) -> tuple[float, ...]:
        a = 0.05 * amplitude(s)
        order = 0.05 / s.travel if s.period_seen else 0.0  # no decision: the step of a difference; rad over the travel
        return (a, a, order)[: 3 if with_order else 2]

    turning = {"phase": PHASE}
    row = Cause(effect, place, natural, coordinates, limits, lambda s: [], steps, harmonic=kind, scales=turning, **known)
    return replace(row, from_nothing=True, most_waves=row_of(effect).waves)


@cache
def of_waves(one: Cause, count: int) -> Cause:
    """A harmonic with so many waves whose torques or ripples add up; one: with one wave, itself where that is the count.

    Their coordinates and parameters stand one behind the other.
    """
    if count == one.waves:
        return one
    size = one.size

    def natural(z: Matrix) -> Matrix:
        return np.hstack([one.natural(z[:, k : k + size]) for k in range(0, count * size, size)])

    def coordinates(p: Mapping[str, float]) -> Vector:
        return np.concatenate([one.coordinates(wave) for wave in by_wave(p)])

    return replace(
        one,
        natural=natural,
        coordinates=coordinates,
        limits=lambda s: one.limits(s) * count,
        steps=lambda s: one.steps(s) * count,
        components=(count - 1) * size,
        waves=count,
    )
