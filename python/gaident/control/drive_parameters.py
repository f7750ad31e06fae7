"""Gains as drives show them: for each drive its parameters, their units, what they are in SI, and who says so.

A row's formulas are what a text says and what a function computes; a test compares the two. docs/how-to/drive-parameters.md is
written from this table (docs/tools/drive_parameters.py). A drive stands here where a source gives the unit of each parameter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from gaident.checks import known_keys, one_of, real_number
from gaident.errors import ControllerError

__all__ = ["CONSTANTS", "DRIVES", "DriveRow", "DriveParameter", "drive_row", "kp_and_ki", "position_gain"]

Values = Mapping[str, float]


@dataclass(frozen=True)
class DriveParameter:
    """A parameter of a drive: its name here, its unit, and what the drive calls it."""

    name: str
    unit: str
    meaning: str


@dataclass(frozen=True)
class Formula:
    """What a number in SI follows from, as a text in the parameters' names and as a function of their values."""

    text: str
    of: Callable[[Values], float]


@dataclass(frozen=True)
class DriveRow:
    """A drive: the parameters of its velocity and position controller, and the gains in SI that follow from them.

    kp [N m s/rad], ki [N m/rad], position_gain [1/s]. loop: what the source says of the form of the velocity controller.
    """

    title: str
    velocity: tuple[DriveParameter, ...]
    kp: Formula
    ki: Formula
    loop: str
    sources: tuple[str, ...]
    position: tuple[DriveParameter, ...] = ()
    position_gain: Formula | None = None
    none_at_zero: str = ""  # the time whose value 0 switches the integral off, where a source says so


TORQUE_CONSTANT = DriveParameter(
    "torque_constant", "N m/A", "of the motor, for the ampere (peak or rms) in which the drive counts"
)
CONSTANTS = (TORQUE_CONSTANT.name,)
"""Parameters that are the motor's and not of a drive; a drive file gives them above its first section."""

_PER_TURN = math.tau  # no decision: a unit; rad

DRIVES: dict[str, DriveRow] = {
    "sinamics": DriveRow(
        title="Siemens SINAMICS S, servo control",
        velocity=(
            DriveParameter("p1460", "N m s/rad", "speed controller P gain"),
            DriveParameter("p1462", "ms", "speed controller integral time Tn"),
        ),
        kp=Formula("p1460", lambda v: v["p1460"]),
        ki=Formula("p1460 / (p1462 * 1e-3)", lambda v: v["p1460"] / (v["p1462"] * 1e-3)),
        loop="PI, kp (1 + 1/(Tn s))",
        sources=("SINAMICS S120/S150 List Manual, p1460 and p1462 (no copy of these pages was at hand: check the units)",),
    ),
    "el72xx": DriveRow(
        title="Beckhoff EL72xx, EP72xx (TwinCAT servo terminals)",
        velocity=(
            DriveParameter("velocity_loop_proportional_gain", "mA/(rad/s)", "2002:15 or 8010:15 Velocity loop proportional gain"),
            DriveParameter("velocity_loop_integral_time", "0.1 ms", "2002:14 or 8010:14 Velocity loop integral time (Tn)"),
            TORQUE_CONSTANT,
        ),
        kp=Formula(
            "velocity_loop_proportional_gain * 1e-3 * torque_constant",
            lambda v: v["velocity_loop_proportional_gain"] * 1e-3 * v["torque_constant"],
        ),
        ki=Formula(
            "velocity_loop_proportional_gain * 1e-3 * torque_constant / (velocity_loop_integral_time * 1e-4)",
            lambda v: (
                v["velocity_loop_proportional_gain"] * 1e-3 * v["torque_constant"] / (v["velocity_loop_integral_time"] * 1e-4)
            ),
        ),
        loop="PI with the integral action time Tn",
        position=(
            DriveParameter(
                "position_loop_proportional_gain", "(rad/s)/rad", "2002:17 or 8010:17 Position loop proportional gain"
            ),
        ),
        position_gain=Formula("position_loop_proportional_gain", lambda v: v["position_loop_proportional_gain"]),
        sources=(
            "https://infosys.beckhoff.com/content/1033/el72x1/1976542987.html",
            "https://infosys.beckhoff.com/content/1033/el72x1-001x/1877637259.html",
        ),
    ),
    "ax5000": DriveRow(
        title="Beckhoff AX5000, gain in N m (P-0-0010 bit 15 set)",
        velocity=(
            DriveParameter("s_0_0100", "N m/(rad/s)", "S-0-0100 Velocity loop proportional gain"),
            DriveParameter("s_0_0101", "ms", "S-0-0101 Velocity loop integral action time; 0: no integral"),
        ),
        kp=Formula("s_0_0100", lambda v: v["s_0_0100"]),
        ki=Formula("s_0_0100 / (s_0_0101 * 1e-3)", lambda v: v["s_0_0100"] / (v["s_0_0101"] * 1e-3)),
        loop="PI with the integral action time",
        position=(DriveParameter("s_0_0104", "1000/min", "S-0-0104 Position loop Kv-factor"),),
        position_gain=Formula("s_0_0104 * 1000 / 60", lambda v: v["s_0_0104"] * 1000 / 60),
        none_at_zero="s_0_0101",
        sources=(
            "https://infosys.beckhoff.com/content/1031/ax5000_idn_description/1000502539.html",
            "https://infosys.beckhoff.com/content/1031/ax5000_idn_description/1000532747.html",
            "https://infosys.beckhoff.com/content/1033/ax5000_idn_description/1000602379.html",
        ),
    ),
    "ax8000": DriveRow(
        title="Beckhoff AX8000, AMP8000 (scaling 3005:09 in N m)",
        velocity=(
            DriveParameter("velocity_control_proportional_gain", "N m/(rad/s)", "3140:01 Velocity control proportional gain"),
            DriveParameter("velocity_control_integral_action_time", "s", "3140:02 Velocity control integral action time"),
        ),
        kp=Formula("velocity_control_proportional_gain", lambda v: v["velocity_control_proportional_gain"]),
        ki=Formula(
            "velocity_control_proportional_gain / velocity_control_integral_action_time",
            lambda v: v["velocity_control_proportional_gain"] / v["velocity_control_integral_action_time"],
        ),
        loop="PI: gain factor Kp, integral action time Tn",
        position=(DriveParameter("position_control_proportional_gain", "1/s", "30C0:01 Position control proportional gain"),),
        position_gain=Formula("position_control_proportional_gain", lambda v: v["position_control_proportional_gain"]),
        sources=(
            "https://infosys.beckhoff.com/content/1033/ax8xxx_object/18798255883.html",
            "https://infosys.beckhoff.com/content/1031/ax8xxx_object/18798159243.html",
            "https://infosys.beckhoff.com/content/1033/ax8xxx_object/11604829451.html",
            "https://infosys.beckhoff.com/content/1033/ax8000_fb/8749202443.html",
        ),
    ),
    "sigma": DriveRow(
        title="Yaskawa Sigma-II",
        velocity=(
            DriveParameter("pn100", "Hz", "Pn100 Speed loop gain Kv"),
            DriveParameter(
                "pn101", "0.01 ms", "Pn101 Speed loop integral time constant Ti; a panel that shows 20.00 ms means 2000"
            ),
            DriveParameter("pn103", "%", "Pn103 Inertia ratio, load over rotor, as set in the drive"),
            DriveParameter("rotor_inertia", "kg m^2", "of the servomotor"),
        ),
        kp=Formula(
            "2 * pi * pn100 * rotor_inertia * (1 + pn103 / 100)",
            lambda v: _PER_TURN * v["pn100"] * v["rotor_inertia"] * (1 + v["pn103"] / 100),
        ),
        ki=Formula(
            "2 * pi * pn100 * rotor_inertia * (1 + pn103 / 100) / (pn101 * 1e-5)",
            lambda v: _PER_TURN * v["pn100"] * v["rotor_inertia"] * (1 + v["pn103"] / 100) / (v["pn101"] * 1e-5),
        ),
        loop="Kv (1 + 1/(Ti s)), PI or I-P; the gain of the speed loop is Pn100 where Pn103 is right, so kp = 2 pi Pn100 J",
        sources=(
            "https://azmanual.top/manuals/802369/yaskawa-large-capacity-sigma-ii-series.html?page=189",
            "https://www.manualsdir.com/manuals/802371/yaskawa-sigma-ii-series-dc-power-input-sgmaj.html?page=264",
        ),
    ),
    "epos2": DriveRow(
        title="maxon EPOS2",
        velocity=(
            DriveParameter("speed_regulator_p_gain", "20 uA/(rad/s)", "0x60F9-01 Speed Regulator P-Gain"),
            DriveParameter("speed_regulator_i_gain", "5 mA/s/(rad/s)", "0x60F9-02 Speed Regulator I-Gain"),
            TORQUE_CONSTANT,
        ),
        kp=Formula(
            "20e-6 * speed_regulator_p_gain * torque_constant",
            lambda v: 20e-6 * v["speed_regulator_p_gain"] * v["torque_constant"],
        ),
        ki=Formula(
            "5e-3 * speed_regulator_i_gain * torque_constant",
            lambda v: 5e-3 * v["speed_regulator_i_gain"] * v["torque_constant"],
        ),
        loop="PI, KP + KI/s, every 1 ms; its position controller is a PID and stands beside it",
        sources=("https://www.yumpu.com/en/document/view/26037317/epos2-application-notes-collection-maxon-motor/120",),
    ),
    "odrive": DriveRow(
        title="ODrive, firmware with gains in N m",
        velocity=(
            DriveParameter("vel_gain", "N m/(turn/s)", "controller.config.vel_gain"),
            DriveParameter("vel_integrator_gain", "N m/(turn/s s)", "controller.config.vel_integrator_gain"),
        ),
        kp=Formula("vel_gain / (2 * pi)", lambda v: v["vel_gain"] / _PER_TURN),
        ki=Formula("vel_integrator_gain / (2 * pi)", lambda v: v["vel_integrator_gain"] / _PER_TURN),
        loop='PI; the torque takes the integral of the errors before it (rule="forward"); at the limit the integral decays',
        position=(DriveParameter("pos_gain", "(turn/s)/turn", "controller.config.pos_gain"),),
        position_gain=Formula("pos_gain", lambda v: v["pos_gain"]),
        sources=(
            "https://github.com/odriverobotics/ODrive/blob/029ab55229dbefccd87314be7482815e2ccb0c1f/Firmware/odrive-interface.yaml",
            "https://github.com/odriverobotics/ODrive/blob/0153e3509a2ac678c6fb3219e8f23f538aca7133/Firmware/MotorControl/controller.cpp",
            "https://docs.odriverobotics.com/v/latest/manual/control.html",
        ),
    ),
    "simplefoc": DriveRow(
        title="SimpleFOC, torque control by current",
        velocity=(
            DriveParameter("pid_velocity_p", "A/(rad/s)", "motor.PID_velocity.P, with PID_velocity.D = 0"),
            DriveParameter("pid_velocity_i", "A/rad", "motor.PID_velocity.I"),
            TORQUE_CONSTANT,
        ),
        kp=Formula("pid_velocity_p * torque_constant", lambda v: v["pid_velocity_p"] * v["torque_constant"]),
        ki=Formula("pid_velocity_i * torque_constant", lambda v: v["pid_velocity_i"] * v["torque_constant"]),
        loop='P + I/s, the integral takes the newest error (rule="backward"); where the output is limited, so is the integral. '
        "In voltage mode without the phase's resistance the output is a voltage and no torque",
        position=(DriveParameter("p_angle_p", "(rad/s)/rad", "motor.P_angle.P"),),
        position_gain=Formula("p_angle_p", lambda v: v["p_angle_p"]),
        sources=(
            "https://docs.simplefoc.com/library_units",
            "https://docs.simplefoc.com/velocity_loop",
            "https://github.com/simplefoc/Arduino-FOC/blob/0bd97dee291728f2374e4411474852b7d6d2b8eb/src/common/pid.cpp",
        ),
    ),
    "vesc": DriveRow(
        title="VESC, speed control",
        velocity=(
            DriveParameter("s_pid_kp", "1/(20 erpm)", "Speed PID Kp, with Kd = 0"),
            DriveParameter("s_pid_ki", "1/(20 erpm s)", "Speed PID Ki"),
            DriveParameter("l_current_max", "A", "Motor current max, times its scale"),
            DriveParameter("pole_pairs", "1", "of the motor: erpm = rpm * pole_pairs"),
            TORQUE_CONSTANT,
        ),
        kp=Formula(
            "s_pid_kp / 20 * l_current_max * torque_constant * pole_pairs * 60 / (2 * pi)",
            lambda v: v["s_pid_kp"] / 20 * _torque_per_erpm(v),
        ),
        ki=Formula(
            "s_pid_ki / 20 * l_current_max * torque_constant * pole_pairs * 60 / (2 * pi)",
            lambda v: v["s_pid_ki"] / 20 * _torque_per_erpm(v),
        ),
        loop="PI on the electrical speed; the current takes the integral of the errors before it "
        '(rule="forward"), output and integral are clamped to the largest current; below s_pid_min_erpm the motor is released',
        sources=("https://github.com/vedderb/bldc/blob/04f13d6e458f75a541a9361ee5d551b098487e33/motor/foc_math.c",),
    ),
}


def _torque_per_erpm(v: Values) -> float:
    """Largest torque over the shaft speed of one erpm [N m s/rad]."""
    return v["l_current_max"] * v["torque_constant"] * v["pole_pairs"] * 60 / _PER_TURN


def kp_and_ki(drive: str, parameters: Mapping[str, object]) -> tuple[float, float]:
    """(kp [N m s/rad], ki [N m/rad]) of a drive's parameters; raises ControllerError."""
    row = drive_row(drive)
    values = _values(drive, row.velocity, parameters, may_be_zero=(row.none_at_zero, *_GAINS))
    if row.none_at_zero and values[row.none_at_zero] == 0.0:
        return row.kp.of(values), 0.0
    return row.kp.of(values), row.ki.of(values)


def position_gain(drive: str, parameters: Mapping[str, object]) -> float:
    """Kv [1/s] of a drive's position controller; raises ControllerError."""
    row = drive_row(drive)
    if row.position_gain is None:
        known = ", ".join(name for name, other in DRIVES.items() if other.position_gain is not None)
        raise ControllerError(
            f"drive is {drive!r}, whose position gain is not known here (of {known} it is): give P(gain) in 1/s"
        )
    return row.position_gain.of(_values(drive, row.position, parameters))


# Integral gains and ratios: 0 says that there is none. A time of 0 says nothing but where a source says so.
_GAINS = ("speed_regulator_i_gain", "vel_integrator_gain", "pid_velocity_i", "s_pid_ki", "pn103")


def drive_row(drive: str) -> DriveRow:
    """The row of a drive; ControllerError for one that is not in the table."""
    return DRIVES[one_of(drive, "drive", DRIVES, ControllerError)]


def _values(
    drive: str, needed: tuple[DriveParameter, ...], given: Mapping[str, object], may_be_zero: tuple[str, ...] = ()
) -> dict[str, float]:
    known_keys(given, f"the drive {drive!r}", [p.name for p in needed], (), ControllerError)
    missing = [f"{p.name} [{p.unit}] ({p.meaning})" for p in needed if p.name not in given]
    if missing:
        raise ControllerError(f"the drive {drive!r} lacks {', '.join(missing)}: give it as the drive shows it")
    values = {p.name: _as_shown(p, given[p.name]) for p in needed}
    for p in needed:
        value = values[p.name]
        if p.unit == "1" and not value.is_integer():
            raise ControllerError(f"{p.name} is {value:g}: give a whole number, {p.meaning}")
        if value < 0.0 or (value == 0.0 and p.name not in may_be_zero):
            least = ">= 0" if p.name in may_be_zero else "> 0"
            raise ControllerError(f"{p.name} is {value:g}: give a number {least} [{p.unit}], as the drive shows it")
    return values


def _as_shown(p: DriveParameter, value: object) -> float:
    """The number that was given for a parameter; ControllerError for what is none, true and false among it."""
    remedy = f"give one finite number [{p.unit}] ({p.meaning}), as the drive shows it"
    if isinstance(value, bool):
        raise ControllerError(f"{p.name} is {value!r}: {remedy}")
    return real_number(value, p.name, ControllerError, remedy)
