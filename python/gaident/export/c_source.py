"""A model as one C99 file: the recurrence that `gaident.simulate` steps through, sample by sample, with numbers filled in.

Linear, behind a hold or bilinear as the controller's loop says, in delta = z - 1 (no digits are lost at short sample times):

    y = x[0] + b[0] u,   x[i] += x[i+1] + b[i+1] u - a[i] y

With a controller the torque u of the sample solves the loop through b[0] and the controller's limits (csrc/gaident/loop.hpp);
with effects the sample is divided into substeps (c_effects.py).
"""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Any

from gaident.checks import real_number
from gaident.control import core
from gaident.control.pi import PI
from gaident.errors import ModelError
from gaident.export.c_effects import HELPERS, Pieces, effect_pieces, indented, number
from gaident.files import write_whole
from gaident.models.model import Model, require_strictly_proper
from gaident.models.simulate import checked_substeps
from gaident.version import version

__all__ = ["c_source", "write_c"]

TURNING = ("unbalance", "cogging", "velocity_ripple")
FINEST = 16  # substeps that the core takes at most by itself

LINEAR_MOVE = """
for (i = 0; i + 1 < ORDER; ++i) s->x[i] += s->x[i + 1] + b[i + 1] * u - a[i] * y;
if (ORDER > 0) s->x[ORDER - 1] += b[ORDER] * u - a[ORDER - 1] * y;
"""


def write_c(
    model: Model, path: str | os.PathLike[str] | None, dt: float, controller: PI | None, name: str | None, substeps: int | None
) -> str:
    """Writes the file, where a path is given, and returns its text; see `Model.to_c`."""
    if name is None:
        name = re.sub(r"\W", "_", Path(path).stem) if path is not None else "drive"
        name = f"drive_{name}" if not name or name[0].isdigit() else name
    text = c_source(model, dt, controller, name, substeps)
    if path is not None:
        write_whole(path, text.encode())
    return text


def c_source(model: Model, dt: float, controller: PI | None, name: str, substeps: int | None) -> str:
    """The text of the file; `name` begins every name that it declares. Raises ModelError where it cannot be written."""
    _checked(model, dt, controller, name, substeps)
    steps = substeps or (FINEST if any(e.name in TURNING for e in model.effects) else 0)
    limits = (math.inf, math.inf) if controller is None else controller.limits
    try:
        found: dict[str, Any] = core.recurrence(model.core(), dt, controller, steps, 0.0)
    except ValueError as reason:
        raise ModelError(str(reason)) from None
    if found["substeps"] and core.loop_name(controller) == "continuous":
        names = ", ".join(e.name for e in model.effects)
        raise ModelError(
            f"with effects ({names}) the continuous loop is the difference of two simulations, which makes no recurrence for a "
            'controller: use PI(..., loop="sampled"), or controller=None for the drive alone'
        )
    clamp = min(limits[1], found.get("effects", {}).get("integrator_clamp", (math.inf,))[0])
    pieces = Pieces()
    if controller is not None:
        pieces.numbers({"kp": controller.kp}, "proportional gain [N m s/rad]")
        pieces.numbers({"g": 0.5 * controller.ki * dt}, "integral gain times dt/2 [N m s/rad]")
        bounds = {"torque_limit": limits[0], "integrator_limit": clamp}
        pieces.numbers({key: value for key, value in bounds.items() if value < math.inf}, "N m")
    if found["substeps"]:
        effect_pieces(pieces, found, dt, None if controller is None else _sampled_pi(limits[0], clamp))
    else:
        _linear(pieces, found, controller, limits)
    return _file(model, dt, controller, name, pieces, found["substeps"])


def _checked(model: Model, dt: float, controller: PI | None, name: str, substeps: int | None) -> None:

    if real_number(dt, "dt", ModelError, "give the sample time in s, > 0") <= 0.0:
        raise ModelError(f"dt is {dt:g}: give the sample time in s, > 0")
    if controller is not None and not isinstance(controller, PI):
        raise ModelError(f"controller is a {type(controller).__name__}: give gaident.PI(...), or None for the drive alone")
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        raise ModelError(f"name is {name!r}: give what C takes as a name, letters, digits and _")
    own = [effect.name for effect in model.effects if effect.own]
    if own:
        raise ModelError(
            f"{', '.join(own)} is an effect of your own, a Python function that C cannot call: take it out with without_effect "
            "and write its formula into the file"
        )
    checked_substeps(substeps)
    require_strictly_proper(model.p, controller)


def _limited(expression: str, name: str, limit: float) -> str:
    """The expression, clipped where the limit exists."""
    return f"clip({expression}, {name})" if limit < math.inf else expression


def _sampled_pi(torque_limit: float, clamp: float) -> list[str]:
    """The digital controller: velocity y read, torque u issued."""
    return [
        "const double e = r - y;",
        f"const double I = {_limited('s->stored + g * e', 'integrator_limit', clamp)};",
        "s->stored = I + g * e;",
        f"double u = {_limited('kp * e + I', 'torque_limit', torque_limit)};",
    ]


def _linear(pieces: Pieces, found: dict[str, Any], controller: PI | None, limits: tuple[float, float]) -> None:
    a, b = found["a"], found["b"]
    pieces.constants.append(f"enum {{ ORDER = {len(a)} }};")
    pieces.array("a", a or [0.0], "denominator in delta = z - 1")
    pieces.array("b", b, "numerator")
    pieces.members.append((f"double x[{max(len(a), 1)}]", "the mechanism"))
    step = pieces.step
    step.append("int i;")
    if controller is None:
        step.append("const double u = input, y = s->x[0] + b[0] * u;")
    else:
        pieces.members.append(("double stored", "N m, of the controller"))
        pieces.reset.append("s->stored = 0.0;")
        torque = _limited("kp * (lead - b[0] * I) / (1.0 + b[0] * kp) + I", "torque_limit", limits[0])
        # The velocity answers within the sample where b[0] is not 0: the loop is solved, then limited.
        step += [
            "const double lead = input - s->x[0];",
            "const double free = (lead - b[0] * s->stored) / (1.0 + b[0] * (kp + g));",
            f"const double I = {_limited('s->stored + g * free', 'integrator_limit', limits[1])};",
            f"const double u = {torque};",
            "const double y = s->x[0] + b[0] * u, e = input - y;",
            f"s->stored = {_limited('s->stored + g * e', 'integrator_limit', limits[1])} + g * e;",
        ]
    step += LINEAR_MOVE.strip("\n").split("\n")
    step += ["s->velocity = y;", "s->torque = u;", "return y;"]


def _file(model: Model, dt: float, controller: PI | None, name: str, pieces: Pieces, substeps: int) -> str:

    members = [("double velocity", "rad/s, as the sensor shows it"), ("double torque", "N m, as the controller issues it")]
    members += pieces.members
    width = max(len(m) for m, _ in members) + 1
    state = [f"    {m + ';':{width}} /* {what} */" if what else f"    {m};" for m, what in members]
    reset = [*pieces.reset, "for (i = 0; i < ORDER; ++i) s->x[i] = 0.0;", "s->velocity = s->torque = 0.0;"]
    if substeps:
        reset.append("s->angle = 0.0;")
    drive = "command [rad/s]" if controller is not None else "torque [N m]"
    text = "\n".join(
        [
            *_head(model, dt, controller, name, version(), drive),
            f"#ifndef {name.upper()}_DECLARED",
            f"#define {name.upper()}_DECLARED",
            "",
            "typedef struct {",
            *state,
            f"}} {name}_state;",
            "",
            f"void {name}_reset({name}_state *s);",
            f"double {name}_step({name}_state *s, double input);",
            "",
            "#endif",
            f"#ifndef {name.upper()}_DECLARATIONS_ONLY",
            "",
            "#include <math.h>",
            "",
            "@HELPERS@",
            *pieces.constants,
            "",
            f"void {name}_reset({name}_state *s) {{",
            "    int i;",
            *(f"    {line}" for line in reset),
            "}",
            "",
            f"double {name}_step({name}_state *s, double input) {{",
            indented("\n".join(pieces.step), 4),
            "}",
            "",
            "#endif",
            "",
        ]
    )
    return text.replace("@HELPERS@\n", HELPERS.lstrip() if "clip(" in text else "")


def _head(model: Model, dt: float, controller: PI | None, name: str, version: str, drive: str) -> list[str]:
    loop = "the drive alone" if controller is None else f"{controller.loop} loop, kp {controller.kp:g}, ki {controller.ki:g}"
    lines = [
        f"/* {name}: {drive} to motor velocity [rad/s], every {number(dt)} s ({loop}).",
        " *",
        " * SI units of a rotary axis; a linear axis reads m for rad and N for N m.",
        f" * Written by gaident {version}. C99, standard library only.",
        " *",
        f" *   gain  {number(model.gain)}",
        *(f" *   {kind}  {root.real:.10g}" + (f" {root.imag:+.10g}j" if root.imag else "") + " rad/s"
          for kind, roots in (("pole", model.poles), ("zero", model.zeros)) for root in roots),
        *(f" *   {effect.name}: " + ", ".join(f"{k} {v:.10g}" for k, v in effect.parameters.items()) for effect in model.effects),
        " *",
        f" * {name}_state s;  {name}_reset(&s);  then once per sample  w = {name}_step(&s, input);",
        f" * In other files that use it, #define {name.upper()}_DECLARATIONS_ONLY before #include of this one.",
        " */",
    ]  # fmt: skip
    return lines
