"""A joint in the files of robot simulators.

MuJoCo   mujoco.readthedocs.io, XML reference: joint (armature, damping, frictionloss), tendon/fixed, actuator
URDF     wiki.ros.org/urdf/XML/joint: dynamics (damping, friction), limit (effort)
SDF      sdformat.org, 1.11: joint/axis/dynamics (damping, friction, spring_stiffness, spring_reference), limit/effort
"""

from __future__ import annotations

from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from gaident.axis import Text, said, say, unit
from gaident.errors import SettingsError
from gaident.simulators.numbers import JointNumbers

__all__ = ["mujoco", "sdf", "urdf"]

MASSLESS = 1e-6  # no decision: of the inertia, which MuJoCo's bodies need beside that of the joint
UNLIMITED = 1e12  # no decision: a format: URDF has no joint without a number there


def mujoco(joint: JointNumbers, name: str) -> str:
    """See `JointParameters.to_mujoco`."""
    _checked(name)
    root = Element("mujoco", model=name)
    _said(root, joint)
    world = SubElement(root, "worldbody")
    if joint.shaft is None:
        _body(world, joint, name, joint.motor)
    else:
        _body(world, joint, f"{name}_motor", joint.motor)
        _body(world, joint, f"{name}_load", joint.at_load)
        # x = load - motor; the tendon's spring rests at 0.
        spring = SubElement(
            SubElement(root, "tendon"),
            "fixed",
            name=f"{name}_shaft",
            stiffness=_n(joint.shaft[0]),
            damping=_n(joint.shaft[1]),
            springlength="0",
        )
        SubElement(spring, "joint", joint=f"{name}_load", coef="1")
        SubElement(spring, "joint", joint=f"{name}_motor", coef="-1")
    _actuator(SubElement(root, "actuator"), joint, name if joint.shaft is None else f"{name}_motor")
    return _text(root)


def _body(world: Element, joint: JointNumbers, name: str, numbers: tuple[float, float, float]) -> None:
    inertia, damping, friction = numbers
    kind = "hinge" if joint.axis == "rotary" else "slide"
    own = MASSLESS * inertia
    body = SubElement(world, "body", name=name)
    armature = _n(inertia - own)
    SubElement(
        body,
        "joint",
        name=name,
        type=kind,
        axis="0 0 1",
        armature=armature,
        damping=_n(damping),
        frictionloss=_n(friction),
    )
    SubElement(body, "inertial", pos="0 0 0", mass=_n(own), diaginertia=" ".join([_n(own)] * 3))


def _actuator(actuators: Element, joint: JointNumbers, name: str) -> None:
    force: dict[str, str] = {}
    if joint.torque_limit is not None:
        force = {"forcerange": f"{_n(-joint.torque_limit)} {_n(joint.torque_limit)}"}
    lag = {"dyntype": "filterexact", "dynprm": _n(joint.lag)} if joint.lag else {"dyntype": "none"}
    drive = {"name": f"{name}_torque", "joint": name, "gaintype": "fixed", "gainprm": "1"}
    SubElement(actuators, "general", drive | lag | force)
    if joint.kp is None:
        return
    actuators.append(ElementTree.Comment(_controller_words(joint)))
    if joint.position_gain is not None:
        gains = {"joint": name, "kp": _n(joint.position_gain * joint.kp), "kv": _n(joint.kp)}
        SubElement(actuators, "position", {"name": f"{name}_position"} | gains | force)
    else:
        SubElement(actuators, "velocity", {"name": f"{name}_velocity", "joint": name, "kv": _n(joint.kp)} | force)


def _controller_words(joint: JointNumbers) -> str:
    text = " In place of the one above: the proportional part of the drive's controller"
    if joint.ki:
        return f"{text}; its integral, ki {joint.ki:g} {unit('N m/rad', joint.axis)}, no actuator of MJCF has. "
    return f"{text}. "


def urdf(joint: JointNumbers, name: str) -> str:
    """See `JointParameters.to_urdf`."""
    _checked(name)
    root = Element("joint", name=name, type="continuous" if joint.axis == "rotary" else "prismatic")
    _said(root, joint, *_lag(joint), *_rigid(joint))
    of = unit("kg m^2", joint.axis)
    where = (
        f" <inertial> of the link behind it: {joint.inertia:.9g} {of} along the axis, the motor's {joint.motor[0]:.9g} included "
    )
    root.append(ElementTree.Comment(where))
    SubElement(root, "axis", xyz="0 0 1")
    SubElement(root, "dynamics", damping=_n(joint.damping), friction=_n(joint.friction))
    effort = joint.torque_limit if joint.torque_limit is not None else UNLIMITED
    limits = {"effort": _n(effort), "velocity": _n(UNLIMITED)}
    if joint.axis == "linear":
        limits |= {"lower": _n(-UNLIMITED), "upper": _n(UNLIMITED)}
    SubElement(root, "limit", limits)
    return _text(root)


def sdf(joint: JointNumbers, name: str) -> str:
    """See `JointParameters.to_sdf`."""
    _checked(name)
    root = Element("model", name=name)
    _said(root, joint, *_lag(joint))
    kind = "revolute" if joint.axis == "rotary" else "prismatic"
    of = unit("kg m^2", joint.axis)
    links = [("motor", joint.motor[0]), ("load", joint.at_load[0])] if joint.shaft else [(name, joint.inertia)]
    for link, inertia in links:
        root.append(ElementTree.Comment(f" <inertial> of the link {link}: {inertia:.9g} {of} along the axis "))
    first = links[0][0]
    _sdf_joint(root, kind, name, "world", first, joint.motor[1], joint.motor[2], limit=joint.torque_limit)
    if joint.shaft:
        stiffness, damping = joint.shaft
        if joint.at_load[1] or joint.at_load[2]:
            _, viscous, dry = joint.at_load
            told = f" of the load against the world, in no joint: damping {viscous:.9g}, friction {dry:.9g} "
            root.append(ElementTree.Comment(told))
        _sdf_joint(root, kind, f"{name}_shaft", "motor", "load", damping, 0.0, stiffness=stiffness)
    return _text(root)


def _sdf_joint(
    root: Element,
    kind: str,
    name: str,
    parent: str,
    child: str,
    damping: float,
    friction: float,
    *,
    stiffness: float | None = None,
    limit: float | None = None,
) -> None:
    made = SubElement(root, "joint", name=name, type=kind)
    made.extend([_element("parent", parent), _element("child", child)])
    axis = SubElement(made, "axis")
    axis.append(_element("xyz", "0 0 1"))
    dynamics = SubElement(axis, "dynamics")
    dynamics.extend([_element("damping", _n(damping)), _element("friction", _n(friction))])
    if stiffness is not None:
        dynamics.extend([_element("spring_stiffness", _n(stiffness)), _element("spring_reference", "0")])
    if limit is not None:
        SubElement(axis, "limit").append(_element("effort", _n(limit)))


def _element(name: str, text: str) -> Element:
    """An element with a text."""
    builder = ElementTree.TreeBuilder()
    builder.start(name, {})
    builder.data(text)
    builder.end(name)
    return builder.close()


def _lag(joint: JointNumbers) -> list[Text]:
    return [say("Lag of the actuator, in no joint: {:.6g} s.", joint.lag)] if joint.lag else []


def _rigid(joint: JointNumbers) -> list[Text]:
    if joint.shaft is None:
        return []
    return [say("Shaft between motor and load, here rigid: {:.6g} {N m/rad}, {:.3g} {N m s/rad}.", *joint.shaft)]


def _said(root: Element, joint: JointNumbers, *more: Text) -> None:
    """Doubts first, then what the joint has not, as comments; more: what this form has not beside it."""
    texts = [f"Warning: {said(doubt, joint.axis)}" for doubt in joint.doubts]
    texts += [said(text, joint.axis) for text in joint.left_out]
    if joint.load:
        constant = say("Constant load, in no joint: {:.6g} {N m} against a motion forwards.", joint.load)
        texts.append(said(constant, joint.axis))
    for text in (*texts, *(said(one, joint.axis) for one in more)):
        root.append(ElementTree.Comment(f" {text.replace('--', '- -')} "))


def _checked(name: str) -> None:
    if not isinstance(name, str) or not name.isidentifier():
        raise SettingsError(f"name is {name!r}: give a name of letters, digits and _")


def _n(value: float) -> str:
    return f"{value:.9g}"


def _text(root: Element) -> str:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"
