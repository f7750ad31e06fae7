"""joint_parameters(): the numbers of what was found under the names of other simulators, and what these have not."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import gaident as ga
from gaident.axis import said
from gaident.results.json_text import json_text
from report_cases import diagnosed

ONE = ga.OneMass(J=4e-4, D=2e-3).model()
TWO = ga.TwoMass(JM=2e-4, DM=1e-3, JL=6e-4, DL=3e-3, KG=40.0, DG=5e-3).model()
LOOP = ga.PI(0.03, 1.0, torque_limit=2.0)


@pytest.fixture(scope="module")
def found() -> ga.Diagnosis:
    return replace(diagnosed(), controller=LOOP)


def element(text: str, path: str) -> dict[str, str]:
    found = ElementTree.fromstring(text).find(path)
    assert found is not None, path
    return found.attrib


def test_one_mass_with_its_controller(found: ga.Diagnosis) -> None:
    joint = ga.joint_parameters(found)
    assert joint.inertia == pytest.approx(5e-4, rel=1e-2) and joint.friction == pytest.approx(0.05, rel=1e-2)
    assert (joint.kp, joint.ki, joint.position_gain, joint.torque_limit) == (0.03, 1.0, None, 2.0)
    assert joint.shaft is None and joint.motor == (joint.inertia, joint.damping, joint.friction) and not joint.left_out
    text = joint.to_mujoco("axis")
    hinge = element(text, ".//joint")
    own = float(element(text, ".//inertial")["diaginertia"].split()[2])
    assert float(hinge["armature"]) + own == pytest.approx(joint.inertia, rel=1e-8)
    assert float(hinge["damping"]) == pytest.approx(joint.damping) and float(hinge["frictionloss"]) == pytest.approx(
        joint.friction
    )
    assert element(text, "actuator/velocity") == {"name": "axis_velocity", "joint": "axis", "kv": "0.03", "forcerange": "-2 2"}
    assert "its integral, ki 1 N m/rad, no actuator of MJCF has" in text
    assert element(joint.to_urdf(), "dynamics") == {"damping": f"{joint.damping:.9g}", "friction": f"{joint.friction:.9g}"}
    assert element(joint.to_urdf(), "limit")["effort"] == "2"
    gains = joint.to_wpilib(torque_constant=0.5)
    assert gains == {"kS": joint.friction / 0.5, "kV": joint.damping / 0.5, "kA": joint.inertia / 0.5, "kG": 0.0, "unit": "A"}


def test_two_masses_are_two_joints_and_a_shaft() -> None:
    drive = TWO.with_effect("coulomb_friction", torque=0.05).with_effect("coulomb_friction", side="load", torque=0.1)
    joint = ga.joint_parameters(drive)
    assert joint.motor == pytest.approx((2e-4, 1e-3, 0.05), rel=1e-6)
    assert joint.at_load == pytest.approx((6e-4, 3e-3, 0.1), rel=1e-6) and joint.shaft == pytest.approx((40.0, 5e-3), rel=1e-6)
    text = joint.to_mujoco()
    spring = element(text, "tendon/fixed")
    assert float(spring["stiffness"]) == pytest.approx(40.0) and float(spring["damping"]) == pytest.approx(5e-3)
    names = [e.attrib["joint"] for e in ElementTree.fromstring(text).findall("tendon/fixed/joint")]
    assert names == ["axis_load", "axis_motor"] and len(ElementTree.fromstring(text).findall("worldbody/body")) == 2
    sdf = ElementTree.fromstring(joint.to_sdf())
    assert [j.attrib["name"] for j in sdf.findall("joint")] == ["axis", "axis_shaft"]
    assert sdf.findtext("joint[2]/axis/dynamics/spring_stiffness") == "40" and sdf.findtext("joint[2]/child") == "load"
    assert "damping 0.003, friction 0.1" in joint.to_sdf()
    assert (
        "here rigid: 40 N m/rad, 0.005 N m s/rad" in joint.to_urdf()
        and element(joint.to_urdf(), "dynamics")["friction"] == "0.15"
    )
    blocks = {(block, name): (value, unit) for block, name, value, unit in joint.to_simscape()}
    assert blocks["Motor Inertia", "Inertia"] == (pytest.approx(2e-4), "kg m^2")
    assert blocks["Load Rotational Friction", "Coulomb friction torque"] == (pytest.approx(0.1), "N m")
    assert blocks["Rotational Spring", "Spring rate"] == (pytest.approx(40.0), "N m/rad")
    assert "stiffness of the shaft" in joint.summary() and "load" in joint.summary()


@pytest.mark.parametrize("model", [ONE, TWO])
def test_the_joint_moves_as_the_axis(model: ga.Model) -> None:
    """The equations of MuJoCo's joints and tendon, written out: the numbers stand in their places."""
    drive = model.with_effect(
        "asymmetric_friction", torque_positive=0.02, torque_negative=0.02, viscous_positive=2e-3, viscous_negative=2e-3
    )
    root = ElementTree.fromstring(ga.joint_parameters(drive).to_mujoco())
    joints = [e.attrib for e in root.findall(".//body/joint")]
    J = np.array([float(j["armature"]) for j in joints]) + [float(e.attrib["mass"]) for e in root.findall(".//inertial")]
    D, friction = (np.array([float(j[name]) for j in joints]) for name in ("damping", "frictionloss"))
    shaft = root.find("tendon/fixed")
    K, C = (0.0, 0.0) if shaft is None else (float(shaft.attrib["stiffness"]), float(shaft.attrib["damping"]))
    torque = np.repeat([0.5, -0.4, 0.3, -0.5], 100)
    w, q, steps, seen = np.zeros(len(J)), np.zeros(len(J)), 100, []
    for u in torque:
        seen.append(w[0])
        for _ in range(steps):
            coupling = K * (q[-1] - q[0]) + C * (w[-1] - w[0])
            pull = np.array([u, 0.0])[: len(J)] - D * w + (0.0 if shaft is None else np.array([coupling, -coupling]))
            w = w + 1e-3 / steps * (pull - friction * np.sign(w)) / J
            q = q + 1e-3 / steps * w
    expected = ga.simulate(drive, ga.Record(1e-3, torque=torque, velocity=0.0 * torque))
    assert np.abs(np.array(seen) - expected).max() < 0.005 * np.abs(expected).max()


def test_what_is_no_straight_line_and_what_a_joint_has_not() -> None:
    hump = {"torque": 0.05, "static_torque": 0.15, "stribeck_velocity": 2.0}
    drive = ONE.with_effect("stribeck_friction", **hump).with_effect("load_torque", torque=0.3)
    drive = drive.with_effect("torque_lag", time_constant=1e-3).with_effect("torque_saturation", limit=1.5)
    drive = drive.with_effect("cogging", amplitude=0.01, order=6.0, phase=0.0).with_effect("velocity_filter", time_constant=1e-3)
    with pytest.raises(ga.GaidentError, match=r"friction \(stribeck_friction\) is no straight line.*give speed= \[rad/s\]"):
        ga.joint_parameters(drive)
    joint = ga.joint_parameters(drive, speed=200.0)
    assert joint.friction == pytest.approx(0.05, rel=0.02) and joint.damping == pytest.approx(2e-3, rel=1e-6)
    assert (joint.breakaway, joint.stribeck_velocity, joint.load, joint.lag, joint.torque_limit) == (0.15, 2.0, 0.3, 1e-3, 1.5)
    assert "nearest one up to 200 rad/s is off by" in joint.left_out[0]
    assert joint.left_out[1].startswith("Left out: cogging, velocity filter") and "less stable" in joint.left_out[1]
    blocks = {name: value for block, name, value, _ in joint.to_simscape() if "Friction" in block}
    assert blocks["Breakaway friction torque"] == 0.15
    assert blocks["Breakaway friction velocity"] == pytest.approx(2.0 / math.sqrt(2.0))
    text = joint.to_mujoco()
    assert element(text, "actuator/general")["dynprm"] == "0.001" and "Constant load, in no joint: 0.3 N m" in text
    assert all("Lag of the actuator, in no joint: 0.001 s" in form for form in (joint.to_urdf(), joint.to_sdf()))
    uneven = ONE.with_effect(
        "asymmetric_friction", torque_positive=0.1, torque_negative=0.3, viscous_positive=0.0, viscous_negative=0.0
    )
    mean = ga.joint_parameters(uneven)
    assert mean.friction == pytest.approx(0.2) and "both directions differs by up to 0.2 N m" in mean.left_out[0]
    assert mean.load == pytest.approx(-0.1) and "and -0.1 N m of constant load" in mean.left_out[0]
    assert mean.to_wpilib()["kG"] == pytest.approx(-0.1), "the same torques as dry friction of 0.2 N m and that load"
    steeper = {"torque_positive": 0.2, "torque_negative": 0.1, "viscous_positive": 2e-3, "viscous_negative": 0.0}
    assert ga.joint_parameters(ONE.with_effect("asymmetric_friction", **steeper)).load == pytest.approx(0.05)
    turning = ONE.with_effect("position_friction", torque=0.05, amplitude=0.5, order=2.0, phase=0.0)
    assert "changes with the angle" in ga.joint_parameters(turning).left_out[0]
    many = ga.Model(4000.0, [-12.0, -6 + 160j, -6 - 160j, -20 + 420j, -20 - 420j], [-3 + 95j, -3 - 95j, -8 + 380j, -8 - 380j])
    assert "rigid axis below them" in ga.joint_parameters(many).left_out[0] and ga.joint_parameters(many).shaft is None


def test_doubts_come_first_and_a_linear_axis_has_its_units(found: ga.Diagnosis) -> None:
    doubtful = ga.joint_parameters(replace(found, verdict="unexplained", axis="linear"))
    assert doubtful.summary().startswith("Warning: The data contradict this model")
    assert "N m" not in doubtful.summary() and "N s/m" in doubtful.summary()
    assert [row[3] for row in doubtful.to_simscape()[:2]] == ["kg", "N"] and doubtful.to_wpilib()["unit"] == "N"
    for text in (doubtful.to_mujoco(), doubtful.to_urdf(), doubtful.to_sdf()):
        assert text.index("Warning") < text.index("<axis" if "<axis" in text else "axis=") and "N m" not in text
    assert 'type="slide"' in doubtful.to_mujoco() and 'type="prismatic"' in doubtful.to_sdf()
    data = json.loads(json_text(doubtful.to_dict()))
    assert data["schema"] == "gaident/joint" and data["motor"] == list(doubtful.motor) and said(data["doubts"][0], "linear")
    placed = ga.Cascade(ga.PI(0.03, 0.0), position=ga.P(20.0))
    position = element(ga.joint_parameters(replace(found, controller=placed)).to_mujoco(), "actuator/position")
    assert (position["kp"], position["kv"]) == ("0.6", "0.03")


@pytest.mark.parametrize(
    ("what", "named", "message"),
    [(3, {}, "result is int"), (ONE, {"speed": 0.0}, "speed is 0: give the highest speed, > 0"),
     (ga.Model(-5.0, [-1.0]), {}, "the model has gain -5"), (ga.Model(5.0, [-1.0, -2.0]), {}, "p = 2")],
)  # fmt: skip
def test_wrong_use_is_told(what: Any, named: dict[str, float], message: str) -> None:
    with pytest.raises(ga.GaidentError, match=message):
        ga.joint_parameters(what, **named)
    joint = ga.joint_parameters(ONE)
    with pytest.raises(ga.GaidentError, match="name is 'a b'"):
        joint.to_urdf("a b")
    with pytest.raises(ga.GaidentError, match="torque_constant is 0"):
        joint.to_wpilib(0.0)
