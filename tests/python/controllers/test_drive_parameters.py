"""Gains as drives show them: each row against its own text, against the source's numbers, and its refusals."""

from __future__ import annotations

import importlib.util
import math
from dataclasses import fields

import pytest

import gaident as ga
from gaident.control.drive_parameters import DRIVES
from gaident.errors import ControllerError
from places import ROOT

# The drive's parameters -> (kp [N m s/rad], ki [N m/rad]), worked out by hand.
BY_HAND: dict[str, tuple[dict[str, float], float, float]] = {
    "sinamics": ({"p1460": 0.3, "p1462": 20.0}, 0.3, 15.0),
    # 150 mA/(rad/s) and 5 ms, the terminal's defaults, at 0.2 N m/A
    "el72xx": (
        {"velocity_loop_proportional_gain": 150, "velocity_loop_integral_time": 50, "torque_constant": 0.2},
        0.03,
        6.0,
    ),
    "ax5000": ({"s_0_0100": 0.1, "s_0_0101": 5.0}, 0.1, 20.0),
    "ax8000": ({"velocity_control_proportional_gain": 0.01, "velocity_control_integral_action_time": 0.01}, 0.01, 1.0),
    # 40 Hz of a total inertia of 3e-4 kg m^2, and 20 ms: 251.327 rad/s * 3e-4
    "sigma": ({"pn100": 40, "pn101": 2000, "pn103": 200, "rotor_inertia": 1e-4}, 0.0753982, 3.76991),
    # the manual's own example: 1575 and 257 are 31.5 mA/(rad/s) and 1.29 A/s/(rad/s), at 52.5 mN m/A
    "epos2": (
        {"speed_regulator_p_gain": 1575, "speed_regulator_i_gain": 257, "torque_constant": 0.0525},
        0.0315 * 0.0525,
        1.285 * 0.0525,
    ),
    # at one turn a second the error is 6.283 rad/s
    "odrive": ({"vel_gain": 0.16, "vel_integrator_gain": 0.32}, 0.0254648, 0.0509296),
    "simplefoc": ({"pid_velocity_p": 0.2, "pid_velocity_i": 2.0, "torque_constant": 0.05}, 0.01, 0.1),
    # 1000 erpm too slow are full output, 60 A * 0.02 N m/A; with 7 pole pairs that is 14.9600 rad/s of the shaft
    "vesc": (
        {"s_pid_kp": 0.02, "s_pid_ki": 0.04, "l_current_max": 60, "pole_pairs": 7, "torque_constant": 0.02},
        1.2 / 14.9600,
        2.4 / 14.9600,
    ),
}
POSITION = {
    "el72xx": ({"position_loop_proportional_gain": 10}, 10.0),
    "ax5000": ({"s_0_0104": 1.5}, 25.0),
    "ax8000": ({"position_control_proportional_gain": 40.0}, 40.0),
    "odrive": ({"pos_gain": 20.0}, 20.0),
    "simplefoc": ({"p_angle_p": 20.0}, 20.0),
}


@pytest.mark.parametrize("drive", DRIVES)
def test_gains_are_those_worked_out_by_hand(drive: str) -> None:
    parameters, kp, ki = BY_HAND[drive]
    pi = ga.PI.from_drive(drive, **parameters)
    assert (pi.kp, pi.ki) == (pytest.approx(kp, rel=1e-5), pytest.approx(ki, rel=1e-5))
    assert pi == ga.PI(pi.kp, pi.ki)


@pytest.mark.parametrize("drive", [name for name, row in DRIVES.items() if row.position_gain is not None])
def test_position_gains_are_those_worked_out_by_hand(drive: str) -> None:
    parameters, gain = POSITION[drive]
    assert ga.P.from_drive(drive, **parameters).gain == pytest.approx(gain, rel=1e-12)


@pytest.mark.parametrize("drive", DRIVES)
def test_what_a_row_says_is_what_it_computes(drive: str) -> None:
    row = DRIVES[drive]
    values = {p.name: 1.7 + 0.3 * i for i, p in enumerate((*row.velocity, *row.position))}
    for formula in filter(None, (row.kp, row.ki, row.position_gain)):
        assert formula.of(values) == pytest.approx(eval(formula.text, {"pi": math.pi}, values), rel=1e-12)


def test_rows_have_sources_and_names_of_their_own() -> None:
    of_pi = {f.name for f in fields(ga.PI)} | {f.name for f in fields(ga.Cascade)}
    for name, row in DRIVES.items():
        names = [p.name for p in (*row.velocity, *row.position)]
        assert row.sources and len(set(names)) == len(names) and not of_pi & set(names), name
        assert all(p.name.isidentifier() and p.unit and p.meaning for p in row.velocity)


def test_what_else_a_controller_has_goes_with_it() -> None:
    pi = ga.PI.from_drive("ax5000", s_0_0100=0.1, s_0_0101=5.0, torque_limit=2.0, rule="backward", anti_windup="hold")
    assert pi == ga.PI(0.1, 20.0, torque_limit=2.0, rule="backward", anti_windup="hold")
    assert ga.PI.from_drive("ax5000", s_0_0100=0.1, s_0_0101=0.0).ki == 0.0


REFUSED = {
    "drive": ("sinamic", {"p1460": 0.02, "p1462": 10.0}, "did you mean 'sinamics'"),
    "name": ("sinamics", {"p1460": 0.02, "p1463": 10.0}, "did you mean 'p146"),
    "missing": ("sinamics", {"p1460": 0.02}, r"lacks p1462 \[ms\] \(speed controller integral time Tn\)"),
    "constant": (
        "simplefoc",
        {"pid_velocity_p": 0.2, "pid_velocity_i": 2.0},
        r"lacks torque_constant \[N m/A\]",
    ),
    "zero time": ("sinamics", {"p1460": 0.02, "p1462": 0.0}, r"p1462 is 0: give a number > 0 \[ms\]"),
    "negative": ("sinamics", {"p1460": -0.02, "p1462": 10.0}, "p1460 is -0.02: give a number > 0"),
    "text": ("sinamics", {"p1460": "0.02", "p1462": 10.0}, r"p1460 is '0.02': give one finite number \[N m s/rad\]"),
    "truth": ("sinamics", {"p1460": True, "p1462": 10.0}, r"p1460 is True: give one finite number \[N m s/rad\]"),
    "nothing": ("sinamics", {"p1460": 0.02, "p1462": None}, r"p1462 is None: give one finite number \[ms\] \(speed controller"),
    "not finite": ("sinamics", {"p1460": 0.02, "p1462": math.inf}, r"p1462 is inf: give one finite number \[ms\]"),
    "a list": ("sinamics", {"p1460": [0.02], "p1462": 10.0}, r"p1460 is \[0.02\]: give one finite number"),
    "half a pole pair": (
        "vesc",
        {"s_pid_kp": 1, "s_pid_ki": 0, "l_current_max": 60, "pole_pairs": 7.5, "torque_constant": 0.02},
        "pole_pairs is 7.5: give a whole number, of the motor",
    ),
    "no drive": (None, {"p1460": 0.02, "p1462": 10.0}, "drive is None: it must be one of sinamics"),
    "limit": ("sinamics", {"p1460": 0.02, "p1462": 10.0, "torque_limit": -1}, "torque_limit is -1: give a number > 0"),
    "gain": ("sinamics", {"kp": 0.02, "p1460": 0.1, "p1462": 10.0}, "has the key 'kp'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_parameters_are_refused(case: str) -> None:
    drive, parameters, message = REFUSED[case]
    with pytest.raises(ControllerError, match=message):
        ga.PI.from_drive(drive, **parameters)


def test_a_position_gain_that_is_not_known_is_refused() -> None:
    with pytest.raises(ControllerError, match="whose position gain is not known here"):
        ga.P.from_drive("vesc", kp=1.0)
    with pytest.raises(ControllerError, match="lacks pos_gain"):
        ga.P.from_drive("odrive")
    with pytest.raises(ControllerError, match=r"s_0_0104 is True: give one finite number \[1000/min\]"):
        ga.P.from_drive("ax5000", s_0_0104=True)
    with pytest.raises(ControllerError, match=r"s_0_0104 is 0: give a number > 0 \[1000/min\]"):
        ga.P.from_drive("ax5000", s_0_0104=0)


def test_the_page_is_what_the_table_says() -> None:
    spec = importlib.util.spec_from_file_location("drive_page", ROOT / "docs" / "tools" / "drive_parameters.py")
    assert spec is not None and spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert tool.PAGE.read_text(encoding="utf-8") == tool.page(), "write it again: python docs/tools/drive_parameters.py"
