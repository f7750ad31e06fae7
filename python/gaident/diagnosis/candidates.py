"""The candidates of a diagnosis: every effect as coordinates that a fit can move, with bounds, starts, kin and twins.

The bounds are part of each definition: a Stribeck friction of any speed and any ratio imitates half of the library. Coordinates
are chosen so that a fit moves smoothly: logarithms of positive numbers whose size is unknown, the two components a cos(phase),
a sin(phase) of a harmonic, ratios instead of differences.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.own_candidates import Library

__all__ = ["CANDIDATES", "FRICTION", "TWINS", "Candidate", "Scales", "conditional_twins"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Scales:
    """The sizes that bounds and starts are made of, from the records and the model so far."""

    dt: float  # s
    duration: float  # s, of the longest record
    speed: float  # rad/s, largest
    torque: float  # N m, largest
    acceleration: float  # rad/s^2, largest slope of the command, inf without one
    travel: float  # rad
    friction: float  # N m, Coulomb level as fitted alone, else a guess
    stiffness: float  # N m/rad of the shaft; nan where the model has one mass
    resonance: float  # rad/s of the model's fastest pole pair; nan where it has none
    two_masses: bool
    integral: float  # N m, largest integrator state of the controller's replay; nan without a controller
    blocks: int = 1  # samples of the log in one of dt: a long record is searched on a coarser grid first

    @property
    def log_dt(self) -> float:
        """Sample time of the log [s]: what the bounds of delays and lags are made of."""
        return self.dt / self.blocks


Natural = Callable[[Matrix], Matrix]
Rows = list[tuple[float, ...]]


@dataclass(frozen=True)
class Candidate:
    """One effect as the fit sees it.

    natural: coordinates (n, k) -> parameters (n, m) in the order of the effects table; coordinates: its inverse for one vector.
    limits, starts: bounds (k pairs) and start rows for given scales. steps: size of each coordinate that makes a difference; 0
    for one that is chosen by search, not by slope (an order). parents: simpler effects that this one contains.
    """

    effect: str
    place: str
    natural: Natural
    coordinates: Callable[[Mapping[str, float]], Vector]
    limits: Callable[[Scales], Rows]
    starts: Callable[[Scales], Rows]
    steps: Callable[[Scales], tuple[float, ...]]
    parents: tuple[str, ...] = ()
    harmonic: str = ""  # "torque" or "velocity": phase and size follow from two columns per order
    neutral: Callable[[float, Scales], tuple[float, ...]] | None = None  # the parent of this level as this effect
    proportional: bool = False  # its torque is proportional to its one coordinate
    rough: bool = False  # a stop or an impact more or less leads a torque-driven simulation astray: fitted in the loop first

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.limits(_UNIT))


_UNIT = Scales(1e-3, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 100.0, True, 1.0)

FRICTION = ("coulomb_friction", "stribeck_friction", "asymmetric_friction", "presliding_friction", "friction_drift")
"""Dry friction and its generalisations: a model holds one of them."""

TWINS: tuple[frozenset[str], ...] = (
    frozenset({"torque_lag", "velocity_filter"}),
    frozenset({"load_torque", "asymmetric_friction"}),
)
"""Effects that no record of command, velocity and torque tells apart (DIAGNOSIS classes E1, E3)."""


def conditional_twins(reversals: int, step_sizes: int, torque_logged: bool) -> tuple[frozenset[str], ...]:
    """Classes that records without reversals, or with a single size of step, cannot split (E7, E8, E10, E13)."""
    classes = []
    if reversals == 0:
        classes.append(frozenset({*FRICTION, "load_torque", "torque_dead_band"}))
        classes.append(frozenset({"quadratic_drag", "friction_drift"}))
    if step_sizes <= 1:
        classes.append(frozenset({"hardening_stiffness", "extra_resonance"}))
        if not torque_logged:
            classes.append(frozenset({"torque_saturation", "command_rate_limit", "integrator_clamp"}))
    return tuple(classes)


def _positive(*logs: int) -> Natural:
    def natural(z: Matrix) -> Matrix:
        out = z.copy()
        for i in logs:
            out[:, i] = np.exp(z[:, i])
        return out

    return natural


def _grid(*axes: tuple[float, ...]) -> Rows:
    rows: Rows = [()]
    for axis in axes:
        rows = [(*row, value) for row in rows for value in axis]
    return rows


def _ln(*values: float) -> tuple[float, ...]:
    return tuple(float(np.log(v)) for v in values)


def _single(
    effect: str,
    place: str,
    name: str,
    low: Callable[[Scales], float],
    high: Callable[[Scales], float],
    starts: Callable[[Scales], tuple[float, ...]],
    rough: bool = False,
) -> Candidate:
    """An effect of one positive number of unknown size, moved by its logarithm."""
    return Candidate(
        effect,
        place,
        _positive(0),
        lambda p: np.log([max(p[name], 1e-300)]),
        lambda s: [(float(np.log(low(s))), float(np.log(high(s))))],
        lambda s: [(float(np.log(v)),) for v in starts(s) if low(s) < v < high(s)],
        lambda s: (1.0,),
        rough=rough,
    )


def _linear(effect: str, name: str, low: Callable[[Scales], float], high: Callable[[Scales], float],
            starts: Callable[[Scales], tuple[float, ...]], step: Callable[[Scales], float]) -> Candidate:  # fmt: skip
    """A shaft torque in proportion to one number, moved as it is."""
    return Candidate(
        effect,
        "shaft",
        lambda z: z.copy(),
        lambda p: np.array([p[name]]),
        lambda s: [(low(s), high(s))],
        lambda s: [(v,) for v in starts(s)],
        lambda s: (step(s),),
        proportional=True,
    )


def _harmonic(effect: str, place: str, first: int, with_order: bool, kind: str) -> Candidate:
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
        a = amplitude(s)
        rows: Rows = [(-a, a), (-a, a), (float(first), 1000.0)]
        return rows[: 3 if with_order else 2]

    def steps(s: Scales) -> tuple[float, ...]:
        a = 0.05 * amplitude(s)
        return (a, a, 0.0)[: 3 if with_order else 2]

    return Candidate(effect, place, natural, coordinates, limits, lambda s: [], steps, harmonic=kind)


def _stribeck(z: Matrix) -> Matrix:
    return np.column_stack([z[:, 0], z[:, 0] * (1.0 + z[:, 1]), np.exp(z[:, 2])])


def _asymmetric(z: Matrix) -> Matrix:
    return np.column_stack([z[:, 0], z[:, 1], np.maximum(z[:, 2], 0.0), np.maximum(-z[:, 2], 0.0)])


def _friction_steps(s: Scales) -> float:
    return max(s.friction, 1e-3 * s.torque)


def _resonance_starts(s: Scales) -> Rows:
    nyquist = np.pi / s.dt
    low = 2.0 * np.pi / s.duration * 4.0
    own = s.resonance if np.isfinite(s.resonance) else 0.0
    poles = [w for w in np.geomspace(max(low, 0.02 * nyquist), 0.7 * nyquist, 7) if abs(w - own) > 0.1 * own]
    return [(float(np.log(w)), 0.05, float(np.log(w * r)), 0.05) for w in poles for r in (0.75, 1.0 / 0.75)]


def _of(*names: str) -> Callable[[Mapping[str, float]], Vector]:
    return lambda p: np.array([p[n] for n in names])


_BUILT_IN: dict[str, Candidate] = {
    c.effect: c
    for c in (
        Candidate(
            "extra_resonance",
            "plant",
            _positive(0, 2),
            lambda p: np.array([np.log(p["frequency"]), p["damping"], np.log(p["zero_frequency"]), p["zero_damping"]]),
            lambda s: 2 * [_ln(2.0 / s.duration, 0.95 * np.pi / s.dt), (1e-4, 2.0)],
            _resonance_starts,
            lambda s: (0.1, 0.05, 0.1, 0.05),
        ),
        _linear("coulomb_friction", "torque", lambda s: 0.0, lambda s: s.torque,
                lambda s: tuple(f * s.torque for f in (0.005, 0.02, 0.05, 0.12, 0.3)), _friction_steps),
        Candidate(
            "stribeck_friction",
            "shaft",
            _stribeck,
            lambda p: np.array([p["torque"], p["static_torque"] / p["torque"] - 1.0, np.log(p["stribeck_velocity"])]),
            lambda s: [(1e-6 * s.torque, s.torque), (0.0, 2.0), _ln(1e-4 * s.speed, 0.1 * s.speed)],
            lambda s: _grid((s.friction,), (0.3, 1.0), _ln(0.005 * s.speed, 0.02 * s.speed, 0.06 * s.speed)),
            lambda s: (_friction_steps(s), 0.3, 0.3),
            parents=("coulomb_friction",),
            neutral=lambda level, s: (level, 0.0, float(np.log(0.02 * s.speed))),
            rough=True,
        ),
        Candidate(
            "asymmetric_friction",
            "shaft",
            _asymmetric,
            lambda p: np.array([p["torque_positive"], p["torque_negative"], p["viscous_positive"] - p["viscous_negative"]]),
            lambda s: [(0.0, s.torque), (0.0, s.torque), (-s.torque / s.speed, s.torque / s.speed)],
            lambda s: [(s.friction, s.friction, b) for b in (0.0, 0.3 * s.friction / s.speed, -0.3 * s.friction / s.speed)],
            lambda s: (_friction_steps(s), _friction_steps(s), _friction_steps(s) / s.speed),
            parents=("coulomb_friction",),
            neutral=lambda level, s: (level, level, 0.0),
        ),
        Candidate(
            "presliding_friction",
            "shaft",
            _positive(1),
            lambda p: np.array([p["torque"], np.log(p["stiffness"])]),
            lambda s: [(1e-6 * s.torque, s.torque),
                       _ln(s.friction / max(0.3 * s.travel, 1e-9), 1e6 * s.friction / max(s.travel, 1e-9))],
            lambda s: [(s.friction, float(np.log(s.friction / x)))
                       for x in np.geomspace(2e-4, 0.1, 6) * min(max(s.travel, 1e-9), 1.0)],
            lambda s: (_friction_steps(s), 0.5),
            parents=("coulomb_friction",),
            neutral=lambda level, s: (level, float(np.log(1e6 * s.friction / max(s.travel, 1e-9)))),
        ),
        Candidate(
            "friction_drift",
            "shaft",
            lambda z: z.copy(),
            _of("torque", "rate"),
            lambda s: [(0.0, s.torque), (-0.95 / s.duration, 5.0 / s.duration)],
            lambda s: [(s.friction, r / s.duration) for r in (-0.4, 0.4)],
            lambda s: (_friction_steps(s), 0.3 / s.duration),
            parents=("coulomb_friction",),
            neutral=lambda level, s: (level, 0.0),
        ),
        _linear("quadratic_drag", "coefficient", lambda s: 0.0, lambda s: s.torque / s.speed**2,
                lambda s: tuple(f * s.torque / s.speed**2 for f in (0.01, 0.05, 0.2)), lambda s: 0.05 * s.torque / s.speed**2),
        _linear("load_torque", "torque", lambda s: -s.torque, lambda s: s.torque,
                lambda s: tuple(f * s.torque for f in (-0.1, -0.02, 0.02, 0.1)), lambda s: 0.02 * s.torque),
        _harmonic("unbalance", "shaft", 1, False, "torque"),
        _harmonic("cogging", "shaft", 2, True, "torque"),
        _harmonic("velocity_ripple", "sensor", 1, True, "velocity"),
        _single("backlash", "coupling", "gap", lambda s: 1e-4 * s.torque / s.stiffness, lambda s: 100.0 * s.torque / s.stiffness,
                lambda s: tuple(s.torque / s.stiffness * np.geomspace(1e-3, 2.0, 16)), rough=True),
        _single("hardening_stiffness", "coupling", "cubic_stiffness", lambda s: 1e-3 * s.stiffness**3 / s.torque**2,
                lambda s: 1e5 * s.stiffness**3 / s.torque**2,
                lambda s: tuple(s.stiffness**3 / s.torque**2 * np.geomspace(0.05, 500.0, 6)), rough=True),
        _single("torque_saturation", "actuator", "limit", lambda s: 0.01 * s.torque, lambda s: 1.0 * s.torque,
                lambda s: tuple(s.torque * np.array([0.97, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2]))),
        _single("torque_dead_band", "actuator", "width", lambda s: 1e-4 * s.torque, lambda s: 0.7 * s.torque,
                lambda s: tuple(s.torque * np.geomspace(0.003, 0.3, 7))),
        _single("transport_delay", "actuator", "delay", lambda s: 0.02 * s.log_dt, lambda s: 10.0 * s.log_dt,
                lambda s: tuple(s.log_dt * np.array([0.3, 0.7, 1.0, 1.5, 2.2, 3.2, 4.5, 7.0]))),
        _single("torque_lag", "actuator", "time_constant", lambda s: 0.02 * s.log_dt, lambda s: 30.0 * s.log_dt,
                lambda s: tuple(s.log_dt * np.geomspace(0.25, 16.0, 6))),
        _single("velocity_filter", "sensor", "time_constant", lambda s: 0.02 * s.log_dt, lambda s: 30.0 * s.log_dt,
                lambda s: tuple(s.log_dt * np.geomspace(0.25, 16.0, 6))),
        _single("integrator_clamp", "controller", "limit", lambda s: 1e-3 * s.integral, lambda s: s.integral,
                lambda s: tuple(s.integral * np.geomspace(5e-3, 0.95, 14)), rough=True),
        _single("command_rate_limit", "controller", "rate", lambda s: 1e-3 * s.acceleration, lambda s: s.acceleration,
                lambda s: tuple(s.acceleration * np.geomspace(2e-3, 0.7, 8)), rough=True),
    )
}  # fmt: skip

CANDIDATES = Library(_BUILT_IN)
"""Every effect that a diagnosis can name, in the order of a report's tables; those of one's own last."""
