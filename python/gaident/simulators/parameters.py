"""joint_parameters(): the joint of what was found, friction as the straight line that such a joint has.

friction(w) = friction sign(w) + more w        both >= 0, least squares over the speeds of the record, mean of both directions
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.axis import Text, called, joined, say
from gaident.checks import size_of_drive
from gaident.control.controller import Controller
from gaident.diagnosis.library.terms import LIBRARY
from gaident.errors import ModelError, SettingsError
from gaident.models.effects import Effect
from gaident.models.effects_linear import LINEAR
from gaident.models.mechanics import OneMass, TwoMass
from gaident.models.model import Model
from gaident.models.simulation_input import as_model
from gaident.remedies.doubts import doubts_of
from gaident.remedies.rules import rigid_axis
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.simulators.joint import JointParameters

__all__ = ["joint_parameters"]

Vector = NDArray[np.float64]

POINTS = 200  # no decision: a grid: speeds of the straight line
WIDE = np.geomspace(1e-3, 1e3, POINTS)  # no decision: a grid: speeds at which a straight line is told from a curve
STRAIGHT = 1e-9  # no decision: rounding: of the largest friction


def joint_parameters(
    result: Diagnosis | Identification | Model | OneMass | TwoMass, *, speed: float | None = None
) -> JointParameters:
    """Return what was found as the parameters of a joint, for MuJoCo, URDF, SDF, WPILib and Simscape.

    A joint of these has an inertia, viscous and dry friction, an actuator, and of two masses a spring between both.
    A friction that is no straight line over the velocity becomes the nearest line, and that of both directions its mean.
    What such a joint has not is said in `left_out`.

    Parameters
    ----------
    result : Diagnosis, Identification, Model, OneMass or TwoMass
        What was found; of a result its controller, too.
    speed : float, optional
        Highest speed at which the friction counts [rad/s]; None: that of the records.
        Without records a friction that is curved needs it.

    Returns
    -------
    JointParameters
        The numbers, with `to_mujoco`, `to_urdf`, `to_sdf`, `to_wpilib` and `to_simscape`.

    Raises
    ------
    SettingsError
        For a model that is no axis, and for a speed that is not above 0 or is needed.

    Examples
    --------
    >>> import gaident as ga
    >>> drive = ga.OneMass(J=0.01, D=0.05).model().with_effect("coulomb_friction", torque=0.3)
    >>> joint = ga.joint_parameters(drive)
    >>> joint.inertia, joint.damping, round(joint.friction, 9)
    (0.01, 0.05, 0.3)
    >>> joint.to_wpilib(torque_constant=0.5)["kA"]
    0.02
    """
    given = isinstance(result, Diagnosis | Identification)
    if not given and not isinstance(result, Model | OneMass | TwoMass):
        raise SettingsError(f"result is {type(result).__name__}: give a Diagnosis, an Identification, a Model or a mechanism")
    model = result.model if isinstance(result, Diagnosis | Identification) else as_model(result)
    if model.mechanism.gain < 0.0 or model.p != 1:
        raise SettingsError(
            f"the model has gain {model.mechanism.gain:g} and p = {model.p}: a joint is an axis that a positive torque turns "
            "forwards, with one pole more than zeros; change the sign of the torque, or identify again"
        )
    axis = result.axis if isinstance(result, Diagnosis) else "rotary"
    highest = _speed_of(result, speed)
    words: list[Text] = []
    whole, motor, shaft = _mechanism(model, words)
    kept = _kept(model)
    sides = [_friction([e for e in kept if e.at_load is load], highest, words) for load in (False, True)]
    (level, slope, uneven), (far_level, far_slope, far_uneven) = sides
    inertia, damping = whole
    rest = max((e.parameters["static_torque"] for e in kept if "static_torque" in e.parameters), default=0.0)
    slow = [e.parameters["stribeck_velocity"] for e in kept if "stribeck_velocity" in e.parameters]
    constant = sum((-float(c(np.ones(1), e.parameters)[0]) for e in model.effects if (c := _constant(e)) is not None), 0.0)
    controller = result.controller if isinstance(result, Diagnosis | Identification) else None
    friction = level + far_level
    return JointParameters(
        inertia=inertia,
        damping=damping + slope + far_slope,
        friction=friction,
        load=constant + uneven + far_uneven,
        motor=(motor[0], motor[1] + slope, level) if shaft else (inertia, damping + slope + far_slope, friction),
        shaft=shaft,
        breakaway=max(rest, friction),
        stribeck_velocity=slow[0] if len(slow) == 1 else 0.0,
        lag=sum(e.parameters["time_constant"] for e in model.effects if _is_lag(e)),
        torque_limit=_limit(model, controller),
        **_gains(controller),
        left_out=tuple(_left_out(model, words)),
        doubts=doubts_of(result) if isinstance(result, Diagnosis | Identification) else (),
        axis=axis,
    )


def _speed_of(result: object, speed: float | None) -> float | None:
    if speed is not None:
        return size_of_drive(speed, "speed", SettingsError, "give the highest speed, > 0")
    records = result.records if isinstance(result, Diagnosis | Identification) else ()
    return max((float(np.max(np.abs(r.velocity))) for r in records), default=0.0) or None


def _mechanism(model: Model, words: list[Text]) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float] | None]:
    """((inertia, damping) of the axis, of the motor, (stiffness, damping) of the shaft or None)."""
    mechanism = model.mechanism
    if model.q == 0:
        one = OneMass.from_model(mechanism)
        return (one.J, one.D), (one.J, one.D), None
    if mechanism.q == 2:  # no decision: a formula: the zeros of two masses
        try:
            exact = TwoMass.from_model(mechanism, free_shaft_damping=True)
            two = exact if exact.physical else TwoMass.from_model(mechanism)
        except ModelError:
            two = None
        if two is not None and two.physical:
            return (two.J, two.D), (two.JM, two.DM), (two.KG, two.DG)
    words.append(say("The resonances of the mechanism: the joint is the rigid axis below them."))
    rigid = rigid_axis(model)
    return rigid, rigid, None


def _kept(model: Model) -> list[Effect]:
    """The effects with a static curve over the velocity."""
    return [e for e in model.effects if (row := LIBRARY.get(e.key)) is not None and row.curve is not None and not row.constant]


def _constant(effect: Effect) -> Callable[..., Any] | None:
    row = LIBRARY.get(effect.key)
    return row.curve if row is not None and row.constant else None


def _is_lag(effect: Effect) -> bool:
    return effect.row.place == "actuator" and "time_constant" in effect.parameters


def _friction(effects: list[Effect], highest: float | None, words: list[Text]) -> tuple[float, float, float]:
    """(level [N m], slope [N m s/rad]) of the line nearest to the friction of both directions, and a constant torque [N m].

    With F+ and F- the friction of the two directions, the constant part of (F+ - F-)/2 is the torque of a constant load.
    """
    if not effects:
        return 0.0, 0.0, 0.0

    def both(w: Vector) -> tuple[Vector, Vector]:
        forth, back = np.zeros(len(w)), np.zeros(len(w))
        for effect in effects:
            curve = LIBRARY[effect.key].curve
            assert curve is not None
            forth, back = forth - curve(w, effect.parameters), back + curve(-w, effect.parameters)
        return forth, back

    level, slope, off = _line(WIDE, np.mean(both(WIDE), axis=0))
    if off > STRAIGHT:
        if highest is None:
            raise SettingsError(
                f"the friction ({', '.join(e.name for e in effects)}) is no straight line over the velocity, and no "
                f"records say up to which speed it counts: give {arg('speed')} [rad/s]"
            )
        w = np.linspace(0.0, highest, POINTS + 1)[1:]
        level, slope, off = _line(w, np.mean(both(w), axis=0))
        text = "The friction is no straight line over the velocity: the nearest one up to {:.3g} {rad/s} is off by {:.2g} {N m}."
        words.append(say(text, highest, off * (level + slope * highest)))
    at = WIDE if highest is None else np.linspace(0.0, highest, POINTS + 1)[1:]
    forth, back = both(at)
    apart = float(np.max(np.abs(forth - back)))
    if not apart > STRAIGHT * float(np.max(forth + back)):
        return level, slope, 0.0
    constant = float(np.polynomial.Polynomial.fit(at, 0.5 * (forth - back), 1)(0.0))
    text = (
        "The friction of both directions differs by up to {:.2g} {N m}: the joint has its mean, and {:.2g} {N m} of "
        "constant load."
    )
    words.append(say(text, apart, constant))
    return level, slope, constant


def _line(w: Vector, friction: Vector) -> tuple[float, float, float]:
    """(level, slope, largest difference as a fraction of the largest value of the line)."""
    from scipy.optimize import nnls

    size = np.array([1.0, float(w[-1])])
    columns = np.column_stack([np.ones(len(w)), w]) / size
    (level, slope), _ = nnls(columns, friction)
    line = columns @ (level, slope)
    return float(level), float(slope / size[1]), float(np.max(np.abs(line - friction)) / max(float(np.max(line)), 1e-300))


def _limit(model: Model, controller: Controller | None) -> float | None:
    limits = [e.parameters["limit"] for e in model.effects if e.row.place == "actuator" and "limit" in e.parameters]
    if controller is not None:
        limits += [value for value in controller.limits[:1] if np.isfinite(value)]
    return min(limits, default=None)


def _gains(controller: Controller | None) -> dict[str, float | None]:
    if controller is None or controller.unknown:
        return dict.fromkeys(("kp", "ki", "position_gain"))
    gains = controller.gains
    position = controller.to_dict().get("position_gain") if "position." in dict(controller.parts) else None
    return {"kp": gains.kp, "ki": gains.ki, "position_gain": None if position is None else float(position)}


def _left_out(model: Model, words: list[Text]) -> list[Text]:
    """Sentences on what such a joint has not."""
    kept = {e.key for e in _kept(model)}
    others = [
        called(e.name)
        for e in model.effects
        if e.key not in kept
        and _constant(e) is None
        and not _is_lag(e)
        and not (e.row.place == "actuator" and "limit" in e.parameters)
    ]
    found = list(words)
    rows = [LIBRARY[key] for key in kept]
    if any(row.harmonic == "friction" for row in rows):
        found.append(say("The friction changes with the {angle}: the joint has its mean."))
    if any(row.beside for row in rows):
        found.append(say("The friction grows with the load that the gear carries: the joint has that without load."))
    if any(row.time_varying for row in rows):
        found.append(say("The friction changes in the course of the record: the joint has that of its start."))
    if others:
        late = any(e.name in LINEAR for e in model.effects if not _is_lag(e))
        text = "Left out: {}. What is late in the loop makes it less stable than that of the joint." if late else "Left out: {}."
        found.append(say(text, joined(", ", others)))
    return found
