"""Coordinates of effects: how a fit moves their parameters, and terms of the same kind made by one function each."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.term import Natural, Rows, Scales, Term

FREE = 1e6  # no decision: a bound that nothing reaches;
"""Times the largest torque of the log: a pendulum that swings with little friction has far more torque than drives it."""

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def positive(*logs: int) -> Natural:
    def natural(z: Matrix) -> Matrix:
        out = z.copy()
        for i in logs:
            out[:, i] = np.exp(z[:, i])
        return out

    return natural


def grid(*axes: tuple[float, ...]) -> Rows:
    rows: Rows = [()]
    for axis in axes:
        rows = [(*row, value) for row in rows for value in axis]
    return rows


def ln(*values: float) -> tuple[float, ...]:
    return tuple(float(np.log(v)) for v in values)


def single(
    effect: str,
    place: str,
    name: str,
    low: Callable[[Scales], float],
    high: Callable[[Scales], float],
    starts: Callable[[Scales], tuple[float, ...]],
    multimodal: bool = False,
) -> Term:
    """An effect of one positive number of unknown size, moved by its logarithm."""
    return Term(
        effect,
        place,
        positive(0),
        lambda p: np.log([max(p[name], 1e-300)]),
        lambda s: [(float(np.log(low(s))), float(np.log(high(s))))],
        lambda s: [(float(np.log(v)),) for v in starts(s) if low(s) < v < high(s)],
        lambda s: (1.0,),
        multimodal=multimodal,
    )


def linear(effect: str, name: str, low: Callable[[Scales], float], high: Callable[[Scales], float],
            starts: Callable[[Scales], tuple[float, ...]], step: Callable[[Scales], float]) -> Term:  # fmt: skip
    """A shaft torque in proportion to one number, moved as it is."""
    return Term(
        effect,
        "shaft",
        lambda z: z.copy(),
        lambda p: np.array([p[name]]),
        lambda s: [(low(s), high(s))],
        lambda s: [(v,) for v in starts(s)],
        lambda s: (step(s),),
        proportional=True,
    )


def harmonic(effect: str, place: str, first: int, with_order: bool, kind: str) -> Term:
    """A harmonic of the angle: (a cos(phase), a sin(phase)[, order]) -> (amplitude[, order], phase)."""

    def natural(z: Matrix) -> Matrix:
        columns = [np.hypot(z[:, 0], z[:, 1])]
        if with_order:
            columns.append(z[:, 2])
        columns.append(np.arctan2(z[:, 1], z[:, 0]))
        return np.column_stack(columns)

    def coordinates(p: Mapping[str, float]) -> Vector:
        a, phase = p["amplitude"], p["phase"]
        pair = [a * np.cos(phase), a * np.sin(phase)]
        return np.array([*pair, p["order"]] if with_order else pair)

    def amplitude(s: Scales) -> float:
        return s.torque if kind == "torque" else 0.2

    def limits(s: Scales) -> Rows:
        a = (10.0 if with_order else FREE) * amplitude(s) if kind == "torque" else amplitude(s)
        rows: Rows = [(-a, a), (-a, a), (float(first), 1000.0)]
        return rows[: 3 if with_order else 2]

    def steps(s: Scales) -> tuple[float, ...]:
        a = 0.05 * amplitude(s)
        return (a, a, 0.0)[: 3 if with_order else 2]

    return Term(effect, place, natural, coordinates, limits, lambda s: [], steps, harmonic=kind)


def stribeck(z: Matrix) -> Matrix:
    return np.column_stack([z[:, 0], z[:, 0] * (1.0 + z[:, 1]), np.exp(z[:, 2])])


def asymmetric(z: Matrix) -> Matrix:
    return np.column_stack([z[:, 0], z[:, 1], np.maximum(z[:, 2], 0.0), np.maximum(-z[:, 2], 0.0)])


def lugre(z: Matrix) -> Matrix:
    return np.column_stack([z[:, 0], z[:, 0] * (1.0 + z[:, 1]), np.exp(z[:, 2:])])


def ln_stiffness(s: Scales) -> Rows:
    """Of a bristle: it breaks away after a third of the travel at most."""
    return [ln(s.friction / max(0.3 * s.travel, 1e-9), 1e6 * s.friction / max(s.travel, 1e-9))]


def friction_steps(s: Scales) -> float:
    return max(s.friction, 1e-3 * s.torque)


def resonance_starts(s: Scales) -> Rows:
    nyquist = np.pi / s.dt
    low = 2.0 * np.pi / s.duration * 4.0
    own = s.resonance if np.isfinite(s.resonance) else 0.0
    poles = [w for w in np.geomspace(max(low, 0.02 * nyquist), 0.7 * nyquist, 7) if abs(w - own) > 0.1 * own]
    return [(float(np.log(w)), 0.05, float(np.log(w * r)), 0.05) for w in poles for r in (0.75, 1.0 / 0.75)]


def of(*names: str) -> Callable[[Mapping[str, float]], Vector]:
    return lambda p: np.array([p[n] for n in names])
