"""Per effect: was it triggered at all? One function per kind of reason, plain physics, the record's own figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.control.pi import PI
from gaident.diagnosis.library.terms import LIBRARY
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["Motion", "not_testable", "one_sided"]

Vector = NDArray[np.float64]

TURN = math.tau  # no decision: rad
HIGHEST_ORDER = LIBRARY["cogging"].orders[1]
"""Of cogging and encoder ripple."""
FRICTIONS = (
    "coulomb_friction",
    "stribeck_friction",
    "asymmetric_friction",
    "presliding_friction",
    "lugre_friction",
    "friction_drift",
)


@dataclass(frozen=True, eq=False)
class Motion:
    """One record as the triggers see it; arrays of shape (n,).

    velocity as measured and smooth [rad/s], torque [N m], position [rad], command [rad/s] or None; floors: what is taken for
    noise around zero; moving: |smooth| above its floor; held: speeds held; jumps: sizes of command jumps; repeated: a speed held
    in the first third is held again in the last.
    """

    dt: float
    velocity: Vector
    smooth: Vector
    torque: Vector
    position: Vector
    command: Vector | None
    velocity_floor: float
    torque_floor: float
    moving: NDArray[np.bool_]
    held: tuple[float, ...]
    jumps: tuple[float, ...]
    repeated: bool


def not_testable(motions: Sequence[Motion], controller: PI | None, model: Model | None) -> dict[str, str]:
    """Effect -> why these records say nothing about it; effects that were triggered are not in it."""
    why: dict[str, str] = {}
    for part in (_speed(motions), _travel(motions), _torque(motions), _loop(motions, controller), _structure(model)):
        for effect, reason in part.items():
            why.setdefault(effect, reason)
    return why


def one_sided(motions: Sequence[Motion], controller: PI | None) -> dict[str, str]:
    """Effect -> which sizes of it could not have shown in these records; what stands there is tested, but not beyond."""
    highest = max(float(np.abs(m.torque).max()) for m in motions)
    notes = {"torque_saturation": f"a limit above {highest:.3g} N m would not have shown: no more torque was asked for"}
    if controller is not None:
        integral = max(
            float(np.abs(m.torque - controller.kp * (m.command - m.velocity)).max()) for m in motions if m.command is not None
        ) if any(m.command is not None for m in motions) else math.nan  # fmt: skip
        if math.isfinite(integral):
            notes["integrator_clamp"] = f"a clamp above {integral:.3g} N m would not have shown: the integral went no higher"
        slope = max((float(np.abs(np.diff(m.command)).max()) / m.dt for m in motions if m.command is not None), default=0.0)
        if slope > 0.0:
            notes["command_rate_limit"] = f"a limit above {slope:.3g} rad/s^2 would not have shown: no command rises faster"
    travel = max(float(np.ptp(m.position)) for m in motions)
    least = math.ceil(POLICY.seen_turn * TURN / travel) if travel > 0.0 else HIGHEST_ORDER
    per_sample = max(_slowest(m) * m.dt for m in motions)
    fastest = math.floor(POLICY.seen_band * math.pi / per_sample) if per_sample > 0.0 else None
    for effect in ("cogging", "velocity_ripple"):
        parts = [f"orders below {least} need more than the {travel / TURN:.2g} turns travelled"] if least > 2 else []
        if fastest is not None and fastest < HIGHEST_ORDER:
            parts.append(f"orders above {fastest} are faster than the sampling even at the slowest speed held")
        if parts and least <= HIGHEST_ORDER:
            notes[effect] = "; ".join(parts)
    return notes


def _slowest(m: Motion) -> float:
    """Least speed held while moving [rad/s]; 0 where none is held."""
    return min((abs(v) for v in m.held if v), default=0.0)


def _monotone(m: Motion, apart: float) -> bool:
    """Nothing is repeated, and the speeds held while moving only rise or only fall with time."""
    steps = np.diff([abs(v) for v in m.held if v])
    return not m.repeated and bool(np.all(steps > -apart) or np.all(steps < apart))


def _speed(motions: Sequence[Motion]) -> dict[str, str]:
    top = max(float(np.abs(m.smooth).max()) for m in motions)
    if not any(np.any(m.moving) for m in motions):
        still = "the axis does not move"
        return dict.fromkeys(
            (*FRICTIONS, "quadratic_drag", "unbalance", "cogging", "backlash", "hardening_stiffness", "velocity_ripple"), still
        )
    why = {}
    forward = any(np.any(m.moving & (m.smooth > 0.0)) for m in motions)
    backward = any(np.any(m.moving & (m.smooth < 0.0)) for m in motions)
    if not (forward and backward):
        why["asymmetric_friction"] = f"the axis turns {'forwards' if forward else 'backwards'} only"
    slowest = min(float(np.abs(m.velocity).min()) for m in motions)
    if slowest > POLICY.slow * top:
        why["stribeck_friction"] = f"the axis never turns slower than {slowest:.3g} rad/s"
    if slowest > max(m.velocity_floor for m in motions):
        why["presliding_friction"] = why["lugre_friction"] = f"the axis neither stands nor reverses (slowest {slowest:.3g} rad/s)"
    speeds = sorted({round(abs(v) / (POLICY.slow * top)) for m in motions for v in m.held if v})
    near = sum(int(np.sum(np.abs(np.abs(m.smooth[m.moving]) - top) < POLICY.slow * top)) for m in motions)
    if len(speeds) < 2 and 2 * near > sum(int(np.sum(m.moving)) for m in motions):
        why["quadratic_drag"] = f"one speed only ({top:.3g} rad/s): its drag is viscous friction there"
    if all(_monotone(m, POLICY.apart * top) for m in motions):
        why["friction_drift"] = "no speed is held early and late, nor are speeds mixed in time: a drift would be drag"
    return why


def _travel(motions: Sequence[Motion]) -> dict[str, str]:
    travel = max(float(np.ptp(m.position)) for m in motions)
    why = {}
    if travel < POLICY.gravity_turn * TURN:
        why["unbalance"] = f"{math.degrees(travel):.2g} degrees of travel: over so little it is a constant load"
    if travel < TURN / HIGHEST_ORDER:
        for effect in ("cogging", "velocity_ripple"):
            why[effect] = f"{math.degrees(travel):.2g} degrees of travel hold no period of order {HIGHEST_ORDER} or less"
    return why


def _torque(motions: Sequence[Motion]) -> dict[str, str]:
    why = {}
    changes = any(np.any(m.torque > m.torque_floor) and np.any(m.torque < -m.torque_floor) for m in motions)
    if not changes:
        why["backlash"] = "the torque never changes its sign: the coupling stays on one flank"
        least = min(float(np.abs(m.torque).min()) for m in motions)
        highest = max(float(np.abs(m.torque).max()) for m in motions)
        if least > POLICY.slow * highest:
            why["torque_dead_band"] = f"the torque never comes near zero (least {least:.2g} N m): a dead band is a constant load"
    if all(float(np.ptp(m.torque)) == 0.0 for m in motions):
        constant = "the torque never changes"
        for effect in ("transport_delay", "torque_lag", "torque_saturation", "extra_resonance", "hardening_stiffness"):
            why[effect] = constant
    return why


def _loop(motions: Sequence[Motion], controller: PI | None) -> dict[str, str]:
    if controller is None or all(m.command is None for m in motions):
        return dict.fromkeys(("integrator_clamp", "command_rate_limit"), "no controller and no command are known: open loop")
    why = {}
    if controller.ki == 0.0:
        why["integrator_clamp"] = "the controller has no integral part"
    if not any(m.jumps or (m.command is not None and np.any(np.diff(m.command) != 0.0)) for m in motions):
        why["command_rate_limit"] = "the command never changes"
    return why


def _structure(model: Model | None) -> dict[str, str]:
    if model is None or any(pole.imag > 0.0 for pole in model.poles):
        return {}
    reason = f"the model ({model.p},{model.q}) shows no shaft resonance, so that there is no coupling to have it"
    return dict.fromkeys(("backlash", "hardening_stiffness"), reason)
