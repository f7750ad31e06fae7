"""A model as one C99 file: the recurrence that `gaident.simulate` steps through, sample by sample, with numbers filled in.

Linear, behind a hold or bilinear as the controller's loop says, in delta = z - 1 (no digits are lost at short sample times):

    y = x[0] + b[0] u,   x[i] += x[i+1] + b[i+1] u - a[i] y

With a controller the torque u of the sample solves the loop through b[0] and the controller's limits
(csrc/gaident/control/loop.hpp); with effects the sample is divided into substeps (csrc/gaident/nonlinear/effect_loop.hpp).
A controller with more than a bare PI acts at its own clock (servo.py); its delay is one of the torque's path.
The code is written by hand, once (runtime.h, runtime.c); this module writes the table of coefficients that it steps through.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from gaident.axis import Text, checked_axis, said, say, velocity_unit
from gaident.checks import checked_path, time_of_sample
from gaident.control import core
from gaident.control.controller import Controller, checked_controller
from gaident.control.unknown import known
from gaident.errors import GaidentError, ModelError
from gaident.export.c_text import array, number
from gaident.export.servo import Servo
from gaident.files import write_whole
from gaident.models.discrete import require_strictly_proper
from gaident.models.effect_rows import effect_and_side, of_one_wave
from gaident.models.effects import row_of
from gaident.models.effects_linear import DELAY
from gaident.models.model import Model
from gaident.models.simulation_input import checked_substeps
from gaident.version import version

__all__ = ["c_name", "c_source", "write_c"]

FINEST = 16  # no decision: substeps that the core takes at most by itself; substeps
MOST_KEPT = 1_000_000  # no decision: what an argument may be: torques on their way, 8 MB of a drive's memory


def write_c(
    model: Model,
    path: str | os.PathLike[str] | None,
    dt: float,
    controller: Controller | None,
    name: str | None,
    substeps: int | None,
    axis: str = "rotary",
) -> str:
    """Writes the file, where a path is given, and returns its text; see `Model.to_c`."""
    path = None if path is None else checked_path(path, error=ModelError)
    if name is None:
        name = "drive" if path is None else c_name(path.stem)
    text = c_source(model, dt, controller, name, substeps, axis)
    if path is not None:
        write_whole(path, text.encode())
    return text


def c_name(stem: str) -> str:
    """A name that C takes, of the file that the source goes to."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", stem)
    return name if re.match(r"[A-Za-z]", name) else f"drive_{name}"


def c_source(
    model: Model, dt: float, controller: Controller | None, name: str, substeps: int | None, axis: str = "rotary"
) -> str:
    """The text of the file; `name` begins every name that it declares. Raises ModelError where it cannot be written."""
    _checked(model, dt, controller, name, substeps)
    checked_axis(axis)
    servo = Servo.of(controller, dt)
    try:
        found = _recurrence(model, dt, controller, substeps) if servo is None else _of_servo(model, servo, substeps)
    except GaidentError:
        raise
    except ValueError as reason:
        raise ModelError(str(reason)) from None
    if found["substeps"] and core.loop_name(controller) == "continuous":
        names = ", ".join(e.name for e in model.effects)
        raise ModelError(
            f"with effects ({names}) the continuous loop is the difference of two simulations, which makes no recurrence for a "
            'controller: use PI(..., loop="sampled"), or controller=None for the drive alone'
        )
    period = dt if servo is None else servo.period
    for effect, (back, _) in found.get("tables", {}).items():
        if max(back) > MOST_KEPT:
            raise ModelError(
                f"{effect} looks back {max(back)} torques at a sample time of {period:g} s, and a drive keeps at most "
                f"{MOST_KEPT}: give a longer sample time or a shorter delay"
            )
    return _file(model, dt, controller, servo, name, found, axis)


def _recurrence(model: Model, period: float, controller: Controller | None, substeps: int | None) -> dict[str, Any]:
    steps = substeps or (FINEST if any(e.row.turns for e in model.effects) else 0)
    return core.recurrence(model.core(), period, controller, steps, 0.0)


def _of_servo(model: Model, servo: Servo, substeps: int | None) -> dict[str, Any]:
    """Under a controller at its own clock, which has substeps with and without effects."""
    late = servo.cascade.delay
    if late > 0.0:
        late += sum(e.values[0] for e in model.effects if e.name == DELAY)
        model = model.with_effect(DELAY, delay=late)
    found = _recurrence(model, servo.period, servo.cascade, substeps)
    if found["substeps"]:
        return found
    steps = substeps or 1
    return {**_recurrence(model, servo.period / steps, servo.cascade, None), "substeps": steps}


def _checked(model: Model, dt: float, controller: Controller | None, name: str, substeps: int | None) -> None:
    time_of_sample(dt, ModelError)
    given = checked_controller(controller)
    if given is not None:
        known(given)
    if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        raise ModelError(f"name is {name!r}: give what C takes as a name, letters, digits and _")
    own = [effect.name for effect in model.effects if effect.own]
    if own:
        raise ModelError(
            f"{', '.join(own)} is an effect of your own, a Python function that C cannot call: take it out with without_effect "
            "and write its formula into the file"
        )
    checked_substeps(substeps)
    require_strictly_proper(model.p, controller)


def _table(
    dt: float, controller: Controller | None, servo: Servo | None, name: str, found: dict[str, Any]
) -> tuple[list[str], int]:
    """The drive's coefficients, and how many torques are on their way at most."""
    rows: list[tuple[str, str]] = []
    before, length, period = [], 1, dt
    if servo is not None:
        before, period = servo.table(name), servo.period
        rows += [("servo", f"&{name}_servo")]
    if controller is not None:
        gains, limits = controller.gains, controller.limits
        newest = 0.5 * gains.ki * dt if servo is None else servo.newest
        rows += [("closed", "1"), ("kp", number(gains.kp)), ("g", number(newest))]
        rows += [("torque_limit", number(limits[0])), ("integrator_limit", number(limits[1]))]
    if "phi" in found:
        rows += [("two_masses", "1"), ("order", "3"), *((key, array(found[key])) for key in ("phi", "motor", "coupling"))]
        rows += [(key, number(v)) for key, v in zip(("stiffness", "damping", "per_scale"), found["shaft"], strict=True)]
    else:
        rows += [("order", str(len(found["a"]))), ("a", array(found["a"])), ("b", array(found["b"]))]
    rows += [(key, array(found[key])) for key in ("rise", "bend", "bend_of") if any(found.get(key, ()))]
    effects: dict[str, Sequence[float]] = found.get("effects", {})
    if found["substeps"]:
        rows += [("substeps", str(found["substeps"])), ("h", number(period / found["substeps"]))]
        of: dict[str, list[str]] = {"": []}
        for effect in effects:
            of.setdefault(_part(effect)[0], []).append(f"GAIDENT_{_part(effect)[1].upper()}")
        rows += [(f"{part}effects", " | ".join(names) or "0") for part, names in of.items()]
    for effect, values in effects.items():
        field = "".join(_part(effect))
        if effect in found["tables"]:
            back, share = found["tables"][effect]
            length = max(length, max(back) + 1)
            before.append(f"static const int {name}_back[] = {{{', '.join(str(b) for b in back)}}};")
            before.append(f"static const double {name}_share[] = {array(share)};")
            rows.append((field, f"{{{max(back) + 1}, {name}_back, {name}_share}}"))
        else:
            rows.append((field, array(values) if of_one_wave(effect) == effect else _waves(effect, values)))
    table = [f"static const gaident_drive {name}_drive = {{", *(f"    .{key} = {value}," for key, value in rows), "};"]
    return [*before, *table], length


def _part(effect: str) -> tuple[str, str]:
    """(part of the drive's structure, field there) of an effect's key."""
    name, side = effect_and_side(effect)
    return (f"at_{side}." if row_of(of_one_wave(effect)).sides else "", name)


def _waves(effect: str, values: Sequence[float]) -> str:
    """The numbers of an effect with several waves, an array of each."""
    count = row_of(of_one_wave(effect)).waves
    size = len(values) // count
    return "{" + ", ".join(array(values[k * size : k * size + size]) for k in range(count)) + "}"


def _runtime(file: str) -> str:
    return files("gaident.export").joinpath(file).read_text(encoding="utf-8").strip("\n")


def _file(
    model: Model, dt: float, controller: Controller | None, servo: Servo | None, name: str, found: dict[str, Any], axis: str
) -> str:
    def in_units(text: str) -> str:
        return said(say(text), axis)

    table, length = _table(dt, controller, servo, name, found)
    several = servo is not None and servo.inputs > 1
    reset, step = f"void {name}_reset({name}_state *s)", f"double {name}_step({name}_state *s, double input)"
    step, given = (step.replace("double input", "const double *input"), "input") if several else (step, "&input")
    placed, at, memory = f"void {name}_reset_at({name}_state *s, double angle)", "", "0"
    state = [in_units("    double angle; /* {rad}, of the motor, from 0 */")] if found["substeps"] else []
    state += ["    gaident_memory memory;"]
    if servo is not None:
        state, memory = [*state, "    gaident_servo_memory servo;"], "&s->servo"
        at = in_units(" /* at rest at this {angle} [{rad}] */")
    return "\n".join(
        [
            *_head(model, dt, controller, servo, name, axis),
            f"#ifndef {name.upper()}_DECLARED",
            f"#define {name.upper()}_DECLARED",
            "",
            _runtime("runtime.h"),
            "",
            *([f"enum {{ {name.upper()}_INPUTS = {servo.inputs} }};", ""] if servo is not None and several else []),
            "typedef struct {",
            in_units("    double velocity; /* {rad/s}, as the sensor shows it */"),
            in_units("    double torque; /* {N m}, as the controller issues it */"),
            *state,
            f"    double issued[{length}]; {in_units('/* {N m}, {torques} on their way */')}",
            f"}} {name}_state;",
            "",
            f"{reset};",
            *([f"{placed};{at}"] if at else []),
            f"{step};",
            "",
            "#endif",
            f"#ifndef {name.upper()}_DECLARATIONS_ONLY",
            "",
            _runtime("runtime.c"),
            "",
            *table,
            "",
            f"{reset} {{",
            f"    static const {name}_state at_rest;",
            "    *s = at_rest;",
            "}",
            "",
            *([f"{placed} {{", f"    {name}_reset(s);", "    s->angle = s->memory.angle = s->memory.theta = angle;", "}", ""]
              if at else []),
            f"{step} {{",
            f"    s->velocity = gaident_step(&{name}_drive, &s->memory, {memory}, s->issued, {given}, &s->torque);",
            *(["    s->angle = s->memory.angle;"] if found["substeps"] else []),
            "    return s->velocity;",
            "}",
            "",
            "#endif",
            "",
        ]
    )  # fmt: skip


def _head(model: Model, dt: float, controller: Controller | None, servo: Servo | None, name: str, axis: str) -> list[str]:
    drive, loop = say("{torque} [{N m}]"), "the drive alone"
    if controller is not None:
        drive = say("command [{rad/s}]") if servo is None else servo.driven_by
        loop = f"{controller.loop} loop, kp {controller.gains.kp:g}, ki {controller.gains.ki:g}"
    units = Text(
        "SI units of a rotary axis; a linear axis reads m for rad and N for N m.",
        "SI units of a linear axis; where the runtime below says rad and N m, read m and N.",
    )
    lines = [
        f"/* {name}: {said(drive, axis)} to motor velocity [{velocity_unit(axis)}], every {number(dt)} s ({loop}).",
        " *",
        " * " + said(units, axis),
        f" * Written by gaident {version()}. C99, standard library only.",
        " *",
        f" *   gain  {number(model.gain)}",
        *(f" *   {kind}  {root.real:.10g}" + (f" {root.imag:+.10g}j" if root.imag else "") + " rad/s"
          for kind, roots in (("pole", model.poles), ("zero", model.zeros)) for root in roots),
        *(f" *   {e.name}{' at the load' if e.at_load else ''}: " + ", ".join(f"{k} {v:.10g}" for k, v in e.parameters.items())
          for e in model.effects),
        *(f" *   {said(line, axis)}" for line in (servo.said() if servo is not None else [])),
        " *",
        f" * {name}_state s;  {name}_reset(&s);  then once per sample  w = {name}_step(&s, input);",
        *(f" * {line}" for line in (servo.interface(name) if servo is not None else [])),
        f" * In other files that use it, #define {name.upper()}_DECLARATIONS_ONLY before #include of this one.",
        " */",
    ]  # fmt: skip
    return lines
