"""Per effect: was it triggered at all? One function per kind of reason, plain physics, the record's own figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.axis import TURN, Text, joined, order, say, turns
from gaident.control.controller import Controller
from gaident.diagnosis.library.terms import HIGHEST_ORDER, LIBRARY, friction_family
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["Motion", "not_testable", "one_sided"]

Vector = NDArray[np.float64]


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


def not_testable(
    motions: Sequence[Motion], controller: Controller | None, model: Model | None, axis: str = "rotary"
) -> dict[str, Text]:
    """Effect -> why these records say nothing about it; effects that were triggered are not in it. axis: rotary or linear."""
    why: dict[str, Text] = {}
    for part in (_turn(axis), _speed(motions), _travel(motions), _torque(motions), _loop(motions, controller), _structure(model)):
        for effect, reason in part.items():
            why.setdefault(effect, reason)
    return why


def one_sided(motions: Sequence[Motion], controller: Controller | None) -> dict[str, Text]:
    """Effect -> which sizes of it could not have shown in these records; what stands there is tested, but not beyond."""
    limit, clamp = (math.inf, math.inf) if controller is None else controller.limits
    highest = max(float(np.abs(m.torque).max()) for m in motions)
    own = highest > POLICY.at_limit * limit
    why = Text("the controller's own limit lets no more through") if own else say("no more {torque} was asked for")
    notes = {"torque_saturation": say("a limit above {:.3g} {N m} would not have shown: {}", highest, why)}
    if controller is not None:
        integral = max((_integral(m, controller) for m in motions), default=0.0)
        if integral > 0.0:
            own = integral > POLICY.at_limit * clamp
            why = Text("the controller's own clamp lets it go no higher" if own else "the integral went no higher")
            notes["integrator_clamp"] = say("a clamp above {:.3g} {N m} would not have shown: {}", integral, why)
        slope = max((float(np.abs(np.diff(m.command)).max()) / m.dt for m in motions if m.command is not None), default=0.0)
        if slope > 0.0:
            rate = say("a limit above {:.3g} {rad/s^2} would not have shown: no command rises faster", slope)
            notes["command_rate_limit"] = rate
    travel = max(float(np.ptp(m.position)) for m in motions)
    least = math.ceil(POLICY.seen_turn * TURN / travel) if travel > 0.0 else HIGHEST_ORDER
    per_sample = max(_slowest(m) * m.dt for m in motions)
    fastest = math.floor(POLICY.seen_band * math.pi / per_sample) if per_sample > 0.0 else None
    for effect in ("cogging", "velocity_ripple"):
        parts = [say("orders below {} need more than the {} travelled", order(least), turns(travel))] if least > 2 else []
        if fastest is not None and fastest < HIGHEST_ORDER:
            parts.append(say("orders above {} are faster than the sampling even at the slowest speed held", order(fastest)))
        if parts and least <= HIGHEST_ORDER:
            notes[effect] = joined("; ", parts)
    return notes


def _turn(axis: str) -> dict[str, Text]:
    """What returns with every turn: the position of a linear axis is a length, which does not say what one turn is."""
    if axis == "rotary":
        return {}
    why = Text("positions are lengths on a linear axis: which length is one turn, they do not say")
    return {name: why for name, term in LIBRARY.items() if term.harmonic}


def _integral(m: Motion, controller: Controller) -> float:
    """Highest |u - kp (r - w)| [N m] of a bare PI while its limit does not cut its torque u; 0 without a command."""
    if m.command is None or not controller.one_equation:
        return 0.0
    free = np.abs(m.torque) <= POLICY.at_limit * controller.limits[0]
    held = np.abs(m.torque - controller.gains.kp * (m.command - m.velocity))[free]
    return float(held.max(initial=0.0))


def _slowest(m: Motion) -> float:
    """Least speed held while moving [rad/s]; 0 where none is held."""
    return min((abs(v) for v in m.held if v), default=0.0)


def _monotone(m: Motion, apart: float) -> bool:
    """Nothing is repeated, and the speeds held while moving only rise or only fall with time."""
    steps = np.diff([abs(v) for v in m.held if v])
    return not m.repeated and bool(np.all(steps > -apart) or np.all(steps < apart))


def _speed(motions: Sequence[Motion]) -> dict[str, Text]:
    top = max(float(np.abs(m.smooth).max()) for m in motions)
    if not any(np.any(m.moving) for m in motions):
        moving = ("quadratic_drag", "unbalance", "cogging", "backlash", "hardening_stiffness", "velocity_ripple")
        return dict.fromkeys((*friction_family(), *moving), Text("the axis does not move"))
    why = {}
    forward = any(np.any(m.moving & (m.smooth > 0.0)) for m in motions)
    backward = any(np.any(m.moving & (m.smooth < 0.0)) for m in motions)
    if not (forward and backward):
        why["asymmetric_friction"] = say("the axis {turns} {} only", "forwards" if forward else "backwards")
    slowest = min(float(np.abs(m.velocity).min()) for m in motions)
    if slowest > POLICY.slow * top:
        why["stribeck_friction"] = say("the axis never {turns} slower than {:.3g} {rad/s}", slowest)
    if slowest > max(m.velocity_floor for m in motions):
        restless = say("the axis neither stands nor reverses (slowest {:.3g} {rad/s})", slowest)
        why["presliding_friction"] = why["lugre_friction"] = restless
    speeds = sorted({round(abs(v) / (POLICY.slow * top)) for m in motions for v in m.held if v})
    near = sum(int(np.sum(np.abs(np.abs(m.smooth[m.moving]) - top) < POLICY.slow * top)) for m in motions)
    if len(speeds) < 2 and 2 * near > sum(int(np.sum(m.moving)) for m in motions):
        why["quadratic_drag"] = say("one speed only ({:.3g} {rad/s}): its drag is viscous friction there", top)
    if all(_monotone(m, POLICY.apart * top) for m in motions):
        why["friction_drift"] = Text("no speed is held early and late, nor are speeds mixed in time: a drift would be drag")
    return why


def _travel(motions: Sequence[Motion]) -> dict[str, Text]:
    travel = max(float(np.ptp(m.position)) for m in motions)
    moved = Text(f"{math.degrees(travel):.2g} degrees of travel", f"{travel:.2g} m of travel")
    why = {}
    if travel < POLICY.gravity_turn * TURN:
        why["unbalance"] = say("{}: over so little it is a constant load", moved)
    if travel < TURN / HIGHEST_ORDER:
        for effect in ("cogging", "velocity_ripple"):
            why[effect] = say("{} hold no period of order {} or less", moved, order(HIGHEST_ORDER))
    return why


def _torque(motions: Sequence[Motion]) -> dict[str, Text]:
    why = {}
    changes = any(np.any(m.torque > m.torque_floor) and np.any(m.torque < -m.torque_floor) for m in motions)
    if not changes:
        why["backlash"] = say("the {torque} never changes its sign: the coupling stays on one flank")
        least = min(float(np.abs(m.torque).min()) for m in motions)
        highest = max(float(np.abs(m.torque).max()) for m in motions)
        if least > POLICY.slow * highest:
            near = "the {torque} never comes near zero (least {:.2g} {N m}): a dead band is a constant load"
            why["torque_dead_band"] = say(near, least)
    if all(float(np.ptp(m.torque)) == 0.0 for m in motions):
        constant = say("the {torque} never changes")
        for effect in ("transport_delay", "torque_lag", "torque_saturation", "extra_resonance", "hardening_stiffness"):
            why[effect] = constant
    return why


def _loop(motions: Sequence[Motion], controller: Controller | None) -> dict[str, Text]:
    why = say("the {torque} drives the model: no controller is simulated from a command")
    unseen = all(m.command is None for m in motions)
    if controller is None or (unseen and controller.one_equation):
        return dict.fromkeys(("integrator_clamp", "command_rate_limit"), why)
    reasons = {"command_rate_limit": say("the velocity command is not logged")} if unseen else {}
    if controller.gains.ki == 0.0:
        reasons["integrator_clamp"] = Text("the controller has no integral part")
    if not unseen and not any(m.jumps or (m.command is not None and np.any(np.diff(m.command) != 0.0)) for m in motions):
        reasons["command_rate_limit"] = Text("the command never changes")
    return reasons


def _structure(model: Model | None) -> dict[str, Text]:
    if model is None or any(pole.imag > 0.0 for pole in model.poles):
        return {}
    reason = Text(f"the model ({model.p},{model.q}) shows no shaft resonance, so that there is no coupling to have it")
    return dict.fromkeys(("backlash", "hardening_stiffness"), reason)
