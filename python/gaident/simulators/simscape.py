"""A joint as the blocks of Simscape's mechanical library, with the names of their parameters (mathworks.com/help/simscape).

The block "Rotational Friction" has, with v_St = sqrt(2) v_brk and v_C = v_brk/10,

    T = sqrt(2 e) (T_brk - T_C) exp(-(w/v_St)^2) w/v_St + T_C tanh(w/v_C) + f w

Its breakaway velocity v_brk is where that is largest: of the Stribeck law exp(-(w/vs)^2), v_brk = vs/sqrt(2).
"""

from __future__ import annotations

import math

from gaident.axis import unit
from gaident.simulators.numbers import JointNumbers

__all__ = ["blocks"]

Row = tuple[str, str, float, str]

SLOW = 0.1  # no decision: a format: the block's own default of a breakaway velocity; rad/s


def blocks(joint: JointNumbers) -> tuple[Row, ...]:
    """See `JointParameters.to_simscape`."""
    rotary = joint.axis == "rotary"
    kind = "Rotational" if rotary else "Translational"
    mass = ("Inertia", "Inertia") if rotary else ("Mass", "Mass")
    force = "torque" if rotary else "force"
    inertia, damping, torque, speed, stiffness = (unit(u, joint.axis) for u in ("kg m^2", "N m s/rad", "N m", "rad/s", "N m/rad"))
    rows: list[Row] = []
    ends = [("Motor ", joint.motor), ("Load ", joint.at_load)] if joint.shaft else [("", joint.motor)]
    for end, (own, viscous, dry) in ends:
        rows.append((f"{end}{mass[0]}", mass[1], own, inertia))
        block = f"{end}{kind} Friction"
        rest = joint.breakaway - joint.friction if end != "Load " else 0.0
        slow = joint.stribeck_velocity / math.sqrt(2.0) if joint.stribeck_velocity else SLOW
        rows += [
            (block, f"Breakaway friction {force}", dry + rest, torque),
            (block, "Breakaway friction velocity", slow, speed),
            (block, f"Coulomb friction {force}", dry, torque),
            (block, "Viscous friction coefficient", viscous, damping),
        ]
    if joint.shaft:
        rows.append((f"{kind} Spring", "Spring rate", joint.shaft[0], stiffness))
        rows.append((f"{kind} Damper", "Damping coefficient", joint.shaft[1], damping))
    if joint.load:
        rows.append((f"Ideal {'Torque' if rotary else 'Force'} Source", "Constant", -joint.load, torque))
    if joint.lag:
        rows.append(("Transfer Fcn", "Time constant of the denominator", joint.lag, "s"))
    if joint.torque_limit is not None:
        rows.append(("Saturation", "Upper limit", joint.torque_limit, torque))
    if joint.kp is not None and joint.ki is not None:
        rows += [
            ("PID Controller", "Proportional (P)", joint.kp, damping),
            ("PID Controller", "Integral (I)", joint.ki, stiffness),
        ]
    return tuple(rows)
