"""gaident export: a saved result for C, an FMU, python-control, SciPy, other simulators or a table."""

from __future__ import annotations

import argparse
import csv
import io
import json
import math
from collections.abc import Callable
from pathlib import Path

from gaident.cli.export_options import FORMS
from gaident.cli.output import naming, print_json, target_of, write
from gaident.control.controller import Controller
from gaident.errors import SettingsError
from gaident.export.c_source import c_name
from gaident.export.fmu import to_fmu
from gaident.models.effects_linear import LINEAR
from gaident.models.model import Model
from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import Estimate, of_axis
from gaident.results.identification import Identification
from gaident.results.json_text import ROOTS
from gaident.results.store import load
from gaident.simulators.joint import JointParameters
from gaident.simulators.parameters import joint_parameters

__all__ = ["export_command"]

PADE = 3  # no decision: a format: order of a delay in a file for another tool, which says so


def export_command(args: argparse.Namespace) -> None:
    """`gaident export RESULT.json --to FORM`."""
    result = load(args.result)
    if not isinstance(result, (Diagnosis, Identification)):
        raise SettingsError(f"{args.result} contains a record, no model: give what gaident identify or diagnose wrote with --out")
    path = args.out or f"{Path(args.result).stem}{FORMS[args.to]}"
    target = target_of(path, [args.result])
    assert target is not None
    if args.out is None and target.exists():
        raise SettingsError(f"{target}: there is such a file already; name it, or another one, with --out")
    if args.to == "fmu":
        _fmu(result, target, args)
        _told(target, args)
        return
    if args.to == "c":
        text = _c_source(result, target, args)
    elif args.to in JOINT:
        text = JOINT[args.to](joint_parameters(result, speed=args.speed), c_name(target.stem), args)
    elif args.to == "csv":
        text = _table(result, args.axis or (result.axis if isinstance(result, Diagnosis) else "rotary"))
    else:
        text = _python(result, args)
    write(target, text.encode())
    _told(target, args)


def _told(target: Path, args: argparse.Namespace) -> None:
    if args.json:
        print_json({"schema": "gaident/export", "schema_version": 1, "path": str(target), "form": args.to})
        return
    print(f"written: {target}")


def _c_source(result: Diagnosis | Identification, target: Path, args: argparse.Namespace) -> str:
    """The C99 file; --closed: with the result's controller, command or position command to velocity."""
    model, loop = _stepped(result, args)
    return model.to_c(None, dt=args.dt, controller=loop, name=c_name(target.stem))


def _fmu(result: Diagnosis | Identification, target: Path, args: argparse.Namespace) -> None:
    model, loop = _stepped(result, args)
    axis = args.axis or (result.axis if isinstance(result, Diagnosis) else "rotary")
    with naming(target):
        to_fmu(model, target, args.dt, loop, axis=axis, binary=not args.sources, compiler=args.compiler)


def _stepped(result: Diagnosis | Identification, args: argparse.Namespace) -> tuple[Model, Controller | None]:
    """The model, and with --closed its controller, as they are stepped through in C."""
    if args.dt is None:
        raise SettingsError(f"--to {args.to} needs the sample time of its steps: give --dt [s]")
    model, _ = _linear(result, args)
    if args.closed and result.controller is None:
        raise SettingsError(
            "--closed: the result has no controller, the torque drove its model; leave it out: torque to velocity"
        )
    return model, result.controller if args.closed else None


def _linear(result: Diagnosis | Identification, args: argparse.Namespace) -> tuple[Model, str]:
    """The model that a transfer function can be, and what it leaves out."""
    model: Model = result.model
    if not args.linear:
        return model, ""
    left = ", ".join(effect.name for effect in model.effects if effect.name not in LINEAR)
    return model.linear, f"; left out by --linear: {left}" if left else ""


def _python(result: Diagnosis | Identification, args: argparse.Namespace) -> str:
    """A Python file that makes the system and needs no gaident."""
    model, left = _linear(result, args)
    delayed = any(effect.name in LINEAR and LINEAR[effect.name](effect.values).delay for effect in model.effects)
    system = model.to_scipy(pade=PADE if delayed else None)
    left += f"; its delay by a Pade approximation of order {PADE}" if delayed else ""
    rows = {"zeros": list(map(complex, system.zeros)), "poles": list(map(complex, system.poles)), "gain": float(system.gain)}
    head = [
        f'"""Torque to velocity in SI units, of {Path(args.result).name}, written by gaident export{left}."""',
        "",
        "from scipy import signal" if args.to == "scipy" else "import control",
        "",
        *(f"{name} = {value!r}" for name, value in rows.items()),
    ]
    made = "signal.ZerosPolesGain(zeros, poles, gain)" if args.to == "scipy" else "control.zpk(zeros, poles, gain)"
    return "\n".join([*head, f"plant = {made}", ""])


def _blocks(joint: JointParameters, name: str, args: argparse.Namespace) -> str:
    """The parameters of Simscape's blocks as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([("block", "parameter", "value", "unit"), *joint.to_simscape()])
    return text.getvalue()


JOINT: dict[str, Callable[[JointParameters, str, argparse.Namespace], str]] = {
    "mujoco": lambda joint, name, args: joint.to_mujoco(name),
    "urdf": lambda joint, name, args: joint.to_urdf(name),
    "sdf": lambda joint, name, args: joint.to_sdf(name),
    "wpilib": lambda joint, name, args: json.dumps(joint.to_wpilib(args.torque_constant), indent=1) + "\n",
    "simscape": _blocks,
}
"""What --to takes of a joint -> the text of its file."""


def _table(result: Diagnosis | Identification, axis: str) -> str:
    """Every number with its deviation and unit, one a row."""
    rows: list[tuple[str, str, Estimate]] = []
    if isinstance(result, Diagnosis):
        rows += [("mechanics", name, e) for name, e in result.mechanics.items()]
        rows += [(f.effect, name, e) for f in result.findings for name, e in f.parameters.items()]
    else:
        m = result.mechanics
        if m is not None:
            rows += [
                ("mechanics", n, Estimate(getattr(m, n), m.std.get(n, math.nan), u)) for n, u in m.UNITS.items() if hasattr(m, n)
            ]
        rows += [("model", name, e) for name, e in result.parameters.items()]
        rows += [("path", name, e) for name, e in result.path.items()]
    rows += [("controller", name, e) for name, e in result.controller_numbers.items()]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("of", "parameter", "value", "std", "unit"))
    for of, name, e in rows:
        if of != "model" or e.unit != ROOTS:
            e = of_axis(name, e, axis)
        writer.writerow((of, name, repr(float(e.value)), repr(float(e.std)), e.unit))
    return text.getvalue()
