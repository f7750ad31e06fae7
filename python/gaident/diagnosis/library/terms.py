"""The library of effects as the diagnosis sees them: coordinates that a fit can move, with bounds, starts, families and classes.

This room is the only place outside the effects themselves that names one: what another room has to know of an effect is data of
its `Term`. The bounds are part of each definition: a Stribeck friction of any speed and any ratio
comes close to the data of many other effects.
Coordinates are chosen so that a fit moves smoothly: logarithms of positive numbers whose size is unknown, the two components
a cos(phase), a sin(phase) of a harmonic, ratios instead of differences.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.control.controller import Limiting
from gaident.diagnosis.library.coordinates import (
    asymmetric,
    friction_steps,
    grid,
    harmonic,
    linear,
    ln,
    ln_stiffness,
    lugre,
    of,
    positive,
    resonance_starts,
    single,
    stribeck,
)
from gaident.diagnosis.library.user_defined import Library
from gaident.estimation.term import Term
from gaident.models.roots import quadratic_roots

__all__ = [
    "EQUIVALENT",
    "EVEN_FRICTION",
    "IN_CONTROLLER",
    "LIBRARY",
    "LOAD",
    "RESONANCE",
    "HIGHEST_ORDER",
    "TWO_LEVELS",
    "conditional_classes",
    "friction_family",
]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

HIGHEST_ORDER = 64  # no decision: which effects there are
"""Of cogging and encoder ripple that a drive is expected to have [1/turn]."""

FRICTION = "dry friction"
"""The family of dry friction and its generalisations: a model holds one of them."""

EQUIVALENT: dict[frozenset[str], Text] = {
    frozenset({"torque_lag", "velocity_filter"}): say(
        "Torque lag and velocity filter act alike on every record of command, {torque} and velocity, whatever the command: log "
        "the measured motor current (it shows a lag) or the raw encoder {angle} (it shows a filter) beside them."
    ),
    frozenset({"load_torque", "asymmetric_friction"}): say(
        "A constant load and dry friction of two levels are the same {torque} while the axis {turns}, whatever the command: "
        "repeat the record with the load taken off or the axis turned over, only a load changes with that."
    ),
}
"""Equivalence classes: effects that no record of command, velocity and torque tells apart, and what else would."""


def friction_family() -> tuple[str, ...]:
    """Dry friction, simplest first, and its generalisations."""
    return tuple(t.name for t in LIBRARY.values() if t.family == FRICTION)


def conditional_classes(reversals: int, step_sizes: int, torque_logged: bool) -> tuple[frozenset[str], ...]:
    """Classes that records without reversals, or with a single size of step, cannot split."""
    classes = []
    if reversals == 0:
        classes.append(frozenset({*friction_family(), "load_torque", "torque_dead_band"}))
        classes.append(frozenset({"quadratic_drag", "friction_drift"}))
    if step_sizes <= 1:
        classes.append(frozenset({"hardening_stiffness", "extra_resonance"}))
        if not torque_logged:
            classes.append(frozenset({"torque_saturation", "command_rate_limit", "integrator_clamp"}))
    return tuple(classes)


_BUILT_IN: dict[str, Term] = {
    t.name: t
    for t in (
        Term(
            "extra_resonance",
            "plant",
            positive(0, 2),
            lambda p: np.array([np.log(p["frequency"]), p["damping"], np.log(p["zero_frequency"]), p["zero_damping"]]),
            lambda s: 2 * [ln(2.0 / s.duration, 0.95 * np.pi / s.dt), (1e-4, 2.0)],
            resonance_starts,
            lambda s: (0.1, 0.05, 0.1, 0.05),
        ),
        linear("coulomb_friction", "torque", lambda s: 0.0, lambda s: s.torque,
                lambda s: tuple(f * s.torque for f in (0.005, 0.02, 0.05, 0.12, 0.3)), friction_steps),
        Term(
            "stribeck_friction",
            "shaft",
            stribeck,
            lambda p: np.array([p["torque"], p["static_torque"] / p["torque"] - 1.0, np.log(p["stribeck_velocity"])]),
            lambda s: [(1e-6 * s.torque, s.torque), (0.0, 2.0), ln(1e-4 * s.speed, 0.1 * s.speed)],
            lambda s: grid((s.friction,), (0.3, 1.0), ln(0.005 * s.speed, 0.02 * s.speed, 0.06 * s.speed)),
            lambda s: (friction_steps(s), 0.3, 0.3),
            nested=("coulomb_friction",), family=FRICTION,
            neutral=lambda level, s: (level, 0.0, float(np.log(0.02 * s.speed))),
            multimodal=True,
        ),
        Term(
            "asymmetric_friction",
            "shaft",
            asymmetric,
            lambda p: np.array([p["torque_positive"], p["torque_negative"], p["viscous_positive"] - p["viscous_negative"]]),
            lambda s: [(0.0, s.torque), (0.0, s.torque), (-s.torque / s.speed, s.torque / s.speed)],
            lambda s: [
                (s.friction, s.friction, 0.0), (s.friction, s.friction, 0.3 * s.friction / s.speed),
                (s.friction, s.friction, -0.3 * s.friction / s.speed), (s.friction, 0.4 * s.friction, 0.0),
                (0.4 * s.friction, s.friction, 0.0),
            ],
            lambda s: (friction_steps(s), friction_steps(s), friction_steps(s) / s.speed),
            nested=("coulomb_friction",), family=FRICTION,
            neutral=lambda level, s: (level, level, 0.0),
        ),
        Term(
            "presliding_friction",
            "shaft",
            positive(1),
            lambda p: np.array([p["torque"], np.log(p["stiffness"])]),
            lambda s: [(1e-6 * s.torque, s.torque), *ln_stiffness(s)],
            lambda s: [(s.friction, float(np.log(s.friction / x)))
                       for x in np.geomspace(2e-4, 0.1, 6) * min(max(s.travel, 1e-9), 1.0)],
            lambda s: (friction_steps(s), 0.5),
            nested=("coulomb_friction",), family=FRICTION,
            neutral=lambda level, s: (level, float(np.log(1e6 * s.friction / max(s.travel, 1e-9)))),
        ),
        Term(
            "lugre_friction",
            "shaft",
            lugre,
            lambda p: np.concatenate([
                [p["torque"], p["static_torque"] / p["torque"] - 1.0],
                np.log([p["stribeck_velocity"], p["stiffness"], max(p["damping"], 1e-300)]),
            ]),
            lambda s: [(1e-6 * s.torque, s.torque), (0.0, 2.0), ln(1e-4 * s.speed, 0.1 * s.speed), *ln_stiffness(s),
                       ln(1e-3 * s.friction / s.speed, 1e3 * s.friction / s.speed)],
            lambda s: [(s.friction, 0.4, float(np.log(0.02 * s.speed)), float(np.log(s.friction / x)),
                        float(np.log(d * s.friction / s.speed)))
                       for x in np.geomspace(5e-4, 0.05, 4) * min(max(s.travel, 1e-9), 1.0) for d in (1.0, 10.0)],
            lambda s: (friction_steps(s), 0.3, 0.3, 0.5, 0.5),
            nested=("coulomb_friction", "stribeck_friction", "presliding_friction"), family=FRICTION,
            multimodal=True,
        ),
        Term(
            "friction_drift",
            "shaft",
            lambda z: z.copy(),
            of("torque", "rate"),
            lambda s: [(0.0, s.torque), (-0.95 / s.duration, 5.0 / s.duration)],
            lambda s: [(s.friction, r / s.duration) for r in (-0.4, 0.4)],
            lambda s: (friction_steps(s), 0.3 / s.duration),
            nested=("coulomb_friction",), family=FRICTION,
            neutral=lambda level, s: (level, 0.0),
        ),
        linear("quadratic_drag", "coefficient", lambda s: 0.0, lambda s: s.torque / s.speed**2,
                lambda s: tuple(f * s.torque / s.speed**2 for f in (0.01, 0.05, 0.2)), lambda s: 0.05 * s.torque / s.speed**2),
        linear("load_torque", "torque", lambda s: -s.torque, lambda s: s.torque,
                lambda s: tuple(f * s.torque for f in (-0.1, -0.02, 0.02, 0.1)), lambda s: 0.02 * s.torque),
        harmonic("unbalance", "shaft", 1, False, "torque"),
        harmonic("cogging", "shaft", 2, True, "torque"),
        harmonic("velocity_ripple", "sensor", 1, True, "velocity"),
        single("backlash", "coupling", "gap", lambda s: 1e-4 * s.torque / s.stiffness, lambda s: 100.0 * s.torque / s.stiffness,
                lambda s: tuple(s.torque / s.stiffness * np.geomspace(1e-3, 2.0, 16)), multimodal=True),
        single("hardening_stiffness", "coupling", "cubic_stiffness", lambda s: 1e-3 * s.stiffness**3 / s.torque**2,
                lambda s: 1e5 * s.stiffness**3 / s.torque**2,
                lambda s: tuple(s.stiffness**3 / s.torque**2 * np.geomspace(0.05, 500.0, 6)), multimodal=True),
        single("torque_saturation", "actuator", "limit", lambda s: 0.01 * s.torque, lambda s: 1.0 * s.torque,
                lambda s: tuple(s.torque * np.array([0.97, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2]))),
        single("torque_dead_band", "actuator", "width", lambda s: 1e-4 * s.torque, lambda s: 0.7 * s.torque,
                lambda s: tuple(s.torque * np.geomspace(0.003, 0.3, 7))),
        single("transport_delay", "actuator", "delay", lambda s: 0.02 * s.log_dt, lambda s: 10.0 * s.log_dt,
                lambda s: tuple(s.log_dt * np.array([0.3, 0.7, 1.0, 1.5, 2.2, 3.2, 4.5, 7.0]))),
        single("torque_lag", "actuator", "time_constant", lambda s: 0.02 * s.log_dt, lambda s: 30.0 * s.log_dt,
                lambda s: tuple(s.log_dt * np.geomspace(0.25, 16.0, 6))),
        single("velocity_filter", "sensor", "time_constant", lambda s: 0.02 * s.log_dt, lambda s: 30.0 * s.log_dt,
                lambda s: tuple(s.log_dt * np.geomspace(0.25, 16.0, 6))),
        single("integrator_clamp", "controller", "limit", lambda s: 1e-3 * s.integral, lambda s: s.integral,
                lambda s: tuple(s.integral * np.geomspace(5e-3, 0.95, 14)), multimodal=True),
        single("command_rate_limit", "controller", "rate", lambda s: 1e-3 * s.acceleration, lambda s: s.acceleration,
                lambda s: tuple(s.acceleration * np.geomspace(2e-3, 0.7, 8)), multimodal=True),
    )
}  # fmt: skip

_DRY = frozenset({"velocity", "position", "past", "time"})
"""Signals whose free function imitates what happens at the shaft of a moving axis: they are functions of one another there."""


def _behind_filter(seen: Vector, velocity: Vector, values: Vector) -> Vector:
    """theta = theta_m + tau w_m: the integral of a filtered velocity is late."""
    return np.asarray(seen + values[0] * (velocity - velocity[0]))


def _behind_ripple(seen: Vector, velocity: Vector, values: Vector) -> Vector:
    """theta = theta_m - a (sin(n theta + phase) - sin(phase)), two rounds: a is small."""
    amplitude, order, phase = values
    angle = seen
    for _ in range(2):
        angle = seen - amplitude * (np.sin(order * angle + phase) - np.sin(phase))
    return angle


def _dry(w: Vector, p: Mapping[str, float]) -> Vector:
    return -p["torque"] * np.sign(w)


def _with_hump(w: Vector, p: Mapping[str, float]) -> Vector:
    hump = (p["static_torque"] - p["torque"]) * np.exp(-((w / p["stribeck_velocity"]) ** 2))
    return np.asarray(-(p["torque"] + hump) * np.sign(w))


def _two_levels(w: Vector, p: Mapping[str, float]) -> Vector:
    forwards = -(p["torque_positive"] + p["viscous_positive"] * w)
    backwards = p["torque_negative"] - p["viscous_negative"] * w
    return np.where(w > 0.0, forwards, np.where(w < 0.0, backwards, 0.0))


_METADATA: dict[str, dict[str, object]] = {
    "extra_resonance": {
        "resonates": True,
        "excludes": frozenset({"backlash", "hardening_stiffness"}),
        "poles": lambda v: tuple(quadratic_roots(2.0 * float(v[1]) * float(v[0]), float(v[0]) ** 2)),
    },
    "coulomb_friction": {"family": FRICTION, "levels": True, "domains": _DRY, "curve": _dry},
    "stribeck_friction": {"levels": True, "domains": _DRY, "curve": _with_hump},
    "asymmetric_friction": {"levels": True, "domains": _DRY, "curve": _two_levels},
    "presliding_friction": {"levels": True, "domains": _DRY, "curve": _dry},
    "lugre_friction": {
        "levels": True,
        "domains": _DRY,
        "curve": _with_hump,
        "shared": {"stribeck_friction": (0, 1, 2), "presliding_friction": (0, 3)},
    },
    "friction_drift": {"levels": True, "domains": _DRY, "curve": _dry},
    "quadratic_drag": {"domains": _DRY, "curve": lambda w, p: -p["coefficient"] * w * np.abs(w)},
    "load_torque": {"domains": _DRY, "curve": lambda w, p: np.full_like(w, -p["torque"])},
    "unbalance": {"domains": _DRY},
    "cogging": {"domains": _DRY, "orders": (2, HIGHEST_ORDER)},
    "velocity_ripple": {"domains": _DRY, "orders": (1, HIGHEST_ORDER), "seen_angle": _behind_ripple},
    "backlash": {"domains": _DRY, "excludes": frozenset({"extra_resonance"})},
    "hardening_stiffness": {"domains": _DRY, "excludes": frozenset({"extra_resonance"})},
    "torque_saturation": {"domains": frozenset({"torque"})},
    "torque_dead_band": {"domains": frozenset({"torque"})},
    "transport_delay": {},
    "torque_lag": {},
    "velocity_filter": {"seen_angle": _behind_filter, "late": True},
    "integrator_clamp": {"limiting": lambda p: Limiting(integrator=float(p[0]))},
    "command_rate_limit": {"limiting": lambda p: Limiting(slope=float(p[0]))},
}
"""What the rest of the package has to know of an effect: a row for each."""

LIBRARY = Library({name: replace(term, **_METADATA[name]) for name, term in _BUILT_IN.items()})  # type: ignore[arg-type]
"""Every effect that a diagnosis can name, in the order of a report's tables; user-defined ones last."""

RESONANCE = LIBRARY["extra_resonance"]
"""The resonance in series that is equivalent to a second mass."""
EVEN_FRICTION, LOAD, TWO_LEVELS = LIBRARY["coulomb_friction"], LIBRARY["load_torque"], LIBRARY["asymmetric_friction"]
"""Even dry friction with a constant load is the same torque, while the shaft turns, as friction of two levels."""
IN_CONTROLLER = tuple(t for t in LIBRARY.values() if t.in_controller)
"""Effects at the controller."""
GRAVITY = LIBRARY["unbalance"]
"""A torque once per turn."""


def of_inverse_dynamics(values: Mapping[str, float]) -> dict[Term, dict[str, float]]:
    """The effects that the parameters of an inverse-dynamics regression stand for, each with its own parameters.

    values: name -> value, as `gaident.InverseDynamics.parameters` has them. Viscous friction common to both directions belongs to
    the mechanism and is none.
    """
    found: dict[Term, dict[str, float]] = {}
    if values.get("coulomb", 0.0) > 0.0:
        found[EVEN_FRICTION] = {"torque": values["coulomb"]}
    levels = [values.get(f"coulomb_{d}", 0.0) for d in ("positive", "negative")]
    if max(levels) > 0.0:
        slopes = [values.get(f"viscous_{d}", values.get("viscous", 0.0)) for d in ("positive", "negative")]
        found[TWO_LEVELS] = {
            "torque_positive": max(levels[0], 0.0),
            "torque_negative": max(levels[1], 0.0),
            "viscous_positive": slopes[0] - min(slopes),
            "viscous_negative": slopes[1] - min(slopes),
        }
    if "offset" in values:
        found[LOAD] = {"torque": values["offset"]}
    if "gravity_amplitude" in values:
        found[GRAVITY] = {"amplitude": values["gravity_amplitude"], "phase": values["gravity_phase"]}
    return found
