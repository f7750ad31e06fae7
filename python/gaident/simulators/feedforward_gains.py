"""The feedforward gains of WPILib (docs.wpilib.org, "Introduction to DC Motor Feedforward"):

output = kS sign(w) + kV w + kA dw/dt + kG

Its output is a voltage there; of a drive that controls the torque it is a torque, or a current.
A voltage also has the back-EMF of the motor in kV, which no model from torque to velocity knows.
"""

from __future__ import annotations

from gaident.axis import unit
from gaident.checks import size_of_drive
from gaident.errors import SettingsError
from gaident.simulators.numbers import JointNumbers

__all__ = ["wpilib"]


def wpilib(joint: JointNumbers, torque_constant: float | None) -> dict[str, float | str]:
    """See `JointParameters.to_wpilib`."""
    constant, output = 1.0, unit("N m", joint.axis)
    if torque_constant is not None:
        remedy = "give the torque constant [N m/A], > 0, or None"
        constant, output = size_of_drive(torque_constant, "torque_constant", SettingsError, remedy), "A"
    values = {"kS": joint.friction, "kV": joint.damping, "kA": joint.inertia, "kG": joint.load}
    return {**{name: value / constant for name, value in values.items()}, "unit": output}
