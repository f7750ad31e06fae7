"""Dry friction with its generalisations, of which a model contains one, and drag."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library import triggers as t
from gaident.diagnosis.library.cause import AT_THE_SHAFT, NO_REVERSAL, Cause
from gaident.diagnosis.library.coordinates import HIGHEST_ORDER, grid, ln, of, positive
from gaident.diagnosis.library.kinds import FREE, linear
from gaident.estimation.term import PHASE, Rows, Scales

__all__ = ["CAUSES"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

FRICTION = "dry friction"
"""The family of dry friction and its generalisations: a model contains one of them."""


def _drifted(rows: Matrix, seconds: float) -> Matrix:
    """T (1 + rate (t + s)) = T' (1 + rate' t):   T' = T (1 + rate s),   rate' = rate/(1 + rate s)."""
    level = 1.0 + rows[:, 1] * seconds
    level = np.where(level == 0.0, 1e-12, level)  # no decision: no division by 0
    return np.column_stack([rows[:, 0] * level, rows[:, 1] / level])


def _stribeck(z: Matrix) -> Matrix:
    return np.column_stack([z[:, 0], z[:, 0] * (1.0 + z[:, 1]), np.exp(z[:, 2])])


def _asymmetric(z: Matrix) -> Matrix:
    return np.column_stack([z[:, 0], z[:, 1], np.maximum(z[:, 2], 0.0), np.maximum(-z[:, 2], 0.0)])


def _lugre(z: Matrix) -> Matrix:
    return np.column_stack([z[:, 0], z[:, 0] * (1.0 + z[:, 1]), np.exp(z[:, 2:])])


def _of_place(z: Matrix) -> Matrix:
    """(Tc, Tc a cos(phase), Tc a sin(phase), order) -> (Tc, a, order, phase); no friction is below 0 anywhere."""
    share = np.hypot(z[:, 1], z[:, 2]) / np.maximum(z[:, 0], 1e-300)
    return np.column_stack([z[:, 0], np.minimum(share, 1.0), z[:, 3], np.arctan2(z[:, 2], z[:, 1])])


def _place_coordinates(p: Mapping[str, float]) -> Vector:
    change = p["torque"] * p["amplitude"]
    return np.array([p["torque"], change * np.cos(p["phase"]), change * np.sin(p["phase"]), p["order"]])


def _place_steps(s: Scales) -> tuple[float, ...]:
    order = 0.05 / s.travel if s.period_seen else 0.0  # no decision: the step of a difference; rad over the travel
    return (_steps(s), _steps(s), _steps(s), order)


def _ln_stiffness(s: Scales) -> Rows:
    """Of a bristle: it breaks away after a third of the travel at most."""
    return [ln(s.friction / max(0.3 * s.travel, 1e-9), 1e6 * s.friction / max(s.travel, 1e-9))]


def _steps(s: Scales) -> float:
    return max(s.friction, 1e-3 * s.torque)


def _dry(w: Vector, p: Mapping[str, float]) -> Vector:
    return -p["torque"] * np.sign(w)


def _with_hump(w: Vector, p: Mapping[str, float]) -> Vector:
    hump = (p["static_torque"] - p["torque"]) * np.exp(-((w / p["stribeck_velocity"]) ** 2))
    return np.asarray(-(p["torque"] + hump) * np.sign(w))


def _two_levels(w: Vector, p: Mapping[str, float]) -> Vector:
    forwards = -(p["torque_positive"] + p["viscous_positive"] * w)
    backwards = p["torque_negative"] - p["viscous_negative"] * w
    return np.where(w > 0.0, forwards, np.where(w < 0.0, backwards, 0.0))


def _even_of_regression(values: Mapping[str, float]) -> dict[str, float] | None:
    return {"torque": values["coulomb"]} if values.get("coulomb", 0.0) > 0.0 else None


def _by_direction_of_regression(values: Mapping[str, float]) -> dict[str, float] | None:
    """Viscous friction common to both directions belongs to the mechanism."""
    levels = [values.get(f"coulomb_{d}", 0.0) for d in ("positive", "negative")]
    if not max(levels) > 0.0:
        return None
    slopes = [values.get(f"viscous_{d}", values.get("viscous", 0.0)) for d in ("positive", "negative")]
    return {
        "torque_positive": max(levels[0], 0.0),
        "torque_negative": max(levels[1], 0.0),
        "viscous_positive": slopes[0] - min(slopes),
        "viscous_negative": slopes[1] - min(slopes),
    }


def _drag_of_regression(values: Mapping[str, float]) -> dict[str, float] | None:
    return {"coefficient": values["drag"]} if values.get("drag", 0.0) > 0.0 else None


ONE_TORQUE = {NO_REVERSAL: ("constant torque",)}

CAUSES: tuple[Cause, ...] = (
    linear(
        "coulomb_friction", "torque", lambda s: 0.0, lambda s: s.torque,
        lambda s: tuple(f * s.torque for f in (0.005, 0.02, 0.05, 0.12, 0.3)), _steps,
        family=FRICTION,
        levels=True,
        domains=AT_THE_SHAFT,
        curve=_dry,
        needs=(t.moves,),
        excited_by=("slow stairs", "triangle across zero", "reversals", "random signal at standstill", "holds up and down",
                    "speeds mixed in time"),
        alike=ONE_TORQUE,
        regressed=_even_of_regression,
    ),
    Cause(
        "stribeck_friction",
        "shaft",
        _stribeck,
        lambda p: np.array([p["torque"], p["static_torque"] / p["torque"] - 1.0, np.log(p["stribeck_velocity"])]),
        lambda s: [(1e-6 * s.torque, s.torque), (0.0, 2.0), ln(1e-4 * s.speed, 0.3 * s.speed)],
        lambda s: grid((s.friction,), (0.3, 1.0), ln(0.005 * s.speed, 0.02 * s.speed, 0.06 * s.speed, 0.2 * s.speed)),
        lambda s: (_steps(s), 0.3, 0.3),
        nested=("coulomb_friction",),
        family=FRICTION,
        neutral=lambda level, s: (level, 0.0, float(np.log(0.02 * s.speed))),
        multimodal=True,
        bends=True,
        levels=True,
        domains=AT_THE_SHAFT,
        curve=_with_hump,
        needs=(t.moves, t.creeps),
        excited_by=("slow stairs", "triangle across zero", "creep below break-away"),
        alike=ONE_TORQUE,
    ),
    Cause(
        "asymmetric_friction",
        "shaft",
        _asymmetric,
        lambda p: np.array([p["torque_positive"], p["torque_negative"], p["viscous_positive"] - p["viscous_negative"]]),
        lambda s: [(0.0, s.torque), (0.0, s.torque), (-s.torque / s.speed, s.torque / s.speed)],
        lambda s: [
            (s.friction, s.friction, 0.0), (s.friction, s.friction, 0.3 * s.friction / s.speed),
            (s.friction, s.friction, -0.3 * s.friction / s.speed), (s.friction, 0.4 * s.friction, 0.0),
            (0.4 * s.friction, s.friction, 0.0),
        ],
        lambda s: (_steps(s), _steps(s), _steps(s) / s.speed),
        nested=("coulomb_friction",),
        family=FRICTION,
        neutral=lambda level, s: (level, level, 0.0),
        levels=True,
        domains=AT_THE_SHAFT,
        curve=_two_levels,
        needs=(t.moves, t.both_directions),
        excited_by=("slow stairs", "triangle across zero", "holds up and down", "speeds mixed in time"),
        alike=ONE_TORQUE,
        regressed=_by_direction_of_regression,
    ),
    Cause(
        "presliding_friction",
        "shaft",
        positive(1),
        lambda p: np.array([p["torque"], np.log(p["stiffness"])]),
        lambda s: [(1e-6 * s.torque, s.torque), *_ln_stiffness(s)],
        lambda s: [(s.friction, float(np.log(s.friction / x)))
                   for x in np.geomspace(2e-4, 0.1, 6) * min(max(s.travel, 1e-9), 1.0)],
        lambda s: (_steps(s), 0.5),
        nested=("coulomb_friction",),
        family=FRICTION,
        neutral=lambda level, s: (level, float(np.log(1e6 * s.friction / max(s.travel, 1e-9)))),
        levels=True,
        domains=AT_THE_SHAFT,
        curve=_dry,
        needs=(t.moves, t.stands_or_reverses),
        excited_by=("slow stairs", "reversals", "random signal at standstill", "creep below break-away"),
        alike=ONE_TORQUE,
    ),
    Cause(
        "lugre_friction",
        "shaft",
        _lugre,
        lambda p: np.concatenate([
            [p["torque"], p["static_torque"] / p["torque"] - 1.0],
            np.log([p["stribeck_velocity"], p["stiffness"], max(p["damping"], 1e-300)]),
        ]),
        lambda s: [(1e-6 * s.torque, s.torque), (0.0, 2.0), ln(1e-4 * s.speed, 0.1 * s.speed), *_ln_stiffness(s),
                   ln(1e-3 * s.friction / s.speed, 1e3 * s.friction / s.speed)],
        lambda s: [(s.friction, 0.4, float(np.log(0.02 * s.speed)), float(np.log(s.friction / x)),
                    float(np.log(d * s.friction / s.speed)))
                   for x in np.geomspace(5e-4, 0.05, 4) * min(max(s.travel, 1e-9), 1.0) for d in (1.0, 10.0)],
        lambda s: (_steps(s), 0.3, 0.3, 0.5, 0.5),
        nested=("coulomb_friction", "stribeck_friction", "presliding_friction"),
        shared={"stribeck_friction": (0, 1, 2), "presliding_friction": (0, 3)},
        family=FRICTION,
        multimodal=True,
        bends=True,
        levels=True,
        domains=AT_THE_SHAFT,
        curve=_with_hump,
        needs=(t.moves, t.stands_or_reverses),
        excited_by=("creep below break-away",),
        alike=ONE_TORQUE,
    ),
    Cause(
        "friction_drift",
        "shaft",
        lambda z: z.copy(),
        of("torque", "rate"),
        lambda s: [(0.0, s.torque), (-0.95 / s.duration, 5.0 / s.duration)],
        lambda s: [(s.friction, r / s.duration) for r in (-0.4, 0.4)],
        lambda s: (_steps(s), 0.3 / s.duration),
        nested=("coulomb_friction",),
        family=FRICTION,
        neutral=lambda level, s: (level, 0.0),
        levels=True,
        time_varying=True,
        later=_drifted,
        domains=AT_THE_SHAFT,
        curve=_dry,
        needs=(t.moves, t.speeds_mixed_in_time),
        excited_by=("repeated segment", "speeds mixed in time"),
        alike={NO_REVERSAL: ("constant torque", "torque that grows")},
    ),
    Cause(
        "load_dependent_friction",
        "shaft",
        lambda z: z.copy(),
        of("torque", "share"),
        lambda s: [(0.0, s.torque), (0.0, 1.0)],
        lambda s: [(s.friction, share) for share in (0.03, 0.1, 0.3)],
        lambda s: (_steps(s), 0.02),
        nested=("coulomb_friction",),
        family=FRICTION,
        beside=frozenset({"unbalance"}),
        neutral=lambda level, s: (level, 0.0),
        levels=True,
        domains=AT_THE_SHAFT,
        curve=_dry,
        needs=(t.rotary, t.moves, t.part_of_a_turn, t.both_directions),
        excited_by=("holds up and down", "slow constant speeds"),
        alike={NO_REVERSAL: ("constant torque",)},
    ),
    Cause(
        "position_friction",
        "shaft",
        _of_place,
        _place_coordinates,
        lambda s: [(1e-6 * s.torque, s.torque), (-s.torque, s.torque), (-s.torque, s.torque), (1.0, FREE)],
        lambda s: [],
        _place_steps,
        nested=("coulomb_friction",),
        family=FRICTION,
        harmonic="friction",
        components=1,
        scales={"phase": PHASE},
        orders=(1, HIGHEST_ORDER),
        levels=True,
        domains=AT_THE_SHAFT,
        curve=_dry,
        needs=(t.periodic, t.moves, t.period_of_an_order, t.period_both_ways),
        unseen=t.orders_beyond,
        excited_by=("slow constant speeds",),
        alike={NO_REVERSAL: ("constant torque", "torque n times per turn", "torque once per turn")},
    ),
    linear(
        "quadratic_drag", "coefficient", lambda s: 0.0, lambda s: s.torque / s.speed**2,
        lambda s: tuple(f * s.torque / s.speed**2 for f in (0.001, 0.01, 0.05, 0.2)), lambda s: 0.05 * s.torque / s.speed**2,
        domains=AT_THE_SHAFT,
        curve=lambda w, p: -p["coefficient"] * w * np.abs(w),
        needs=(t.moves, t.several_speeds),
        excited_by=("triangle across zero", "repeated segment", "speeds mixed in time"),
        alike={NO_REVERSAL: ("torque that grows",)},
        regressed=_drag_of_regression,
    ),
    linear(
        "square_root_drag", "coefficient", lambda s: 0.0, lambda s: s.torque / s.speed**0.5,
        lambda s: tuple(f * s.torque / s.speed**0.5 for f in (0.001, 0.01, 0.05, 0.2)), lambda s: 0.05 * s.torque / s.speed**0.5,
        domains=AT_THE_SHAFT,
        curve=lambda w, p: -p["coefficient"] * np.sign(w) * np.sqrt(np.abs(w)),
        family=FRICTION,
        steep=True,
        bends=True,
        needs=(t.moves, t.several_speeds, t.both_directions),
        excited_by=("slow stairs", "triangle across zero", "speeds mixed in time"),
        alike={NO_REVERSAL: ("torque that grows",)},
    ),
)  # fmt: skip
