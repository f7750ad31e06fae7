"""The parameters of a joint as other simulators know it: inertia, damping, dry friction, and a spring to the load."""

from __future__ import annotations

import textwrap
from dataclasses import asdict, dataclass
from typing import Any

from gaident.axis import linear_sentences, said, say, unit
from gaident.show.wording import WIDTH, number, table
from gaident.simulators import feedforward_gains, robots, simscape
from gaident.simulators.numbers import JointNumbers

__all__ = ["JointParameters"]


@dataclass(frozen=True)
class JointParameters(JointNumbers):
    """One joint, or the motor and the load of two masses. Made by `joint_parameters`.

    Numbers are of a rotary axis; of a linear one read kg, N s/m, N and N/m.

    Attributes
    ----------
    inertia : float
        Of the whole axis [kg m^2].
    damping : float
        Viscous friction of the whole axis [N m s/rad].
    friction : float
        Dry friction of the whole axis, the mean of both directions [N m].
    load : float
        Constant torque that brakes a motion forwards [N m].
    motor : tuple of float
        (inertia, damping, friction) of the motor alone; those of the whole axis where it is one mass.
    shaft : tuple of float, or None
        (stiffness [N m/rad], damping [N m s/rad]) between motor and load; None where the axis is one mass.
    breakaway : float
        Friction at standstill [N m], at least `friction`.
    stribeck_velocity : float
        Velocity over which it falls to `friction` [rad/s]; 0 where it does not fall.
    lag : float
        Time constant of the actuator [s].
    torque_limit : float or None
        Largest torque of the motor [N m].
    kp, ki, position_gain : float or None
        Gains of the controller [N m s/rad], [N m/rad], [1/s], where one is known.
    left_out : tuple of str
        What the model has and such a joint has not, in plain sentences.
    doubts : tuple of str
        Why the model behind the numbers is not to be trusted.
    axis : {"rotary", "linear"}
        Kind of the axis.

    See Also
    --------
    joint_parameters : Makes it, with an example.
    """

    def to_mujoco(self, name: str = "axis") -> str:
        """Return an MJCF model: joints with armature, damping and frictionloss, and the actuator.

        Two masses are two joints with a tendon between them.
        `name` : of the joint.
        """
        return robots.mujoco(self, name)

    def to_urdf(self, name: str = "axis") -> str:
        """Return a <joint> of URDF with <dynamics damping, friction>, of the whole axis; `name` : of the joint."""
        return robots.urdf(self, name)

    def to_sdf(self, name: str = "axis") -> str:
        """Return the <joint> of SDFormat, of two masses a second one with the shaft's spring; `name` : of the joint."""
        return robots.sdf(self, name)

    def to_wpilib(self, torque_constant: float | None = None) -> dict[str, float | str]:
        """Return kS, kV, kA and kG of a feedforward, with what `unit` they give.

        Parameters
        ----------
        torque_constant : float, optional
            Of the motor [N m/A]: the gains then give a current; None: a torque.

        Returns
        -------
        dict
            "kS", "kV", "kA", "kG", and "unit", in which output = kS sign(w) + kV w + kA dw/dt + kG.
        """
        return feedforward_gains.wpilib(self, torque_constant)

    def to_simscape(self) -> tuple[tuple[str, str, float, str], ...]:
        """Return (block, parameter, value, unit) for the blocks of Simscape's mechanical library."""
        return simscape.blocks(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        data = asdict(self)
        sentences = [*self.left_out, *self.doubts]
        return {"schema": "gaident/joint", "schema_version": 1, **data, "linear_axis": linear_sentences(sentences)}

    def summary(self, axis: str | None = None) -> str:
        """Return the parameters as text, doubts first; `axis`: "linear" for units of m and N, None for those of the axis."""
        shown = self.axis if axis is None else axis
        rows: list[tuple[str, ...]] = [("", "axis", *(("motor", "load") if self.shaft else ()), "")]
        units = ("kg m^2", "N m s/rad", "N m")
        names = (said(say("{inertia}"), shown), "damping", "dry friction")
        whole = (self.inertia, self.damping, self.friction)
        for words, value, own, far, of in zip(names, whole, self.motor, self.at_load, units, strict=True):
            parts = (number(own), number(far)) if self.shaft else ()
            rows.append((words, number(value), *parts, unit(of, shown)))
        others = [("friction at standstill", self.breakaway, "N m"), ("constant load", self.load, "N m"), ("lag", self.lag, "s")]
        if self.shaft:
            others += [("stiffness of the shaft", self.shaft[0], "N m/rad"), ("damping of the shaft", self.shaft[1], "N m s/rad")]
        if self.torque_limit is not None:
            others.append((said(say("limit of the {torque}"), shown), self.torque_limit, "N m"))
        more: list[tuple[str, ...]] = [(words, number(value), unit(of, shown)) for words, value, of in others if value]
        parts_of = [
            [line for doubt in self.doubts for line in textwrap.wrap(f"Warning: {said(doubt, shown)}", WIDTH)],
            table(rows),
            table(more) if more else [],
            [line for text in self.left_out for line in textwrap.wrap(said(text, shown), WIDTH)],
        ]
        return "\n\n".join("\n".join(lines) for lines in parts_of if lines)
