"""A model as a Functional Mock-up Unit of FMI 3.0 for co-simulation: the exported C behind the functions of the standard.

An FMU is a zip file:

    modelDescription.xml                 variables with units, step size
    binaries/<architecture>-<system>/    the library that the compiler of this machine makes
    sources/                             the same as C99, and what to compile: `buildDescription.xml`

fmi3.c is written by hand, once; this module writes the model's C file (c_source.py), the few lines between both, and the XML.
Standard: fmi-standard.org, FMI 3.0.2 (2024).
"""

from __future__ import annotations

import hashlib
import io
import os
import platform
import shlex
import shutil
import subprocess
import tempfile
import zipfile
from importlib.resources import files
from pathlib import Path
from xml.etree import ElementTree

from gaident.arguments import arg
from gaident.axis import checked_axis, said, say, unit
from gaident.checks import checked_path, time_of_sample, yes_or_no
from gaident.control.controller import Controller, checked_controller
from gaident.control.unknown import known
from gaident.errors import ModelError
from gaident.export.c_source import c_name, c_source
from gaident.export.servo import Servo
from gaident.files import write_whole
from gaident.models.mechanics import OneMass, TwoMass
from gaident.models.model import Model
from gaident.models.simulation_input import as_model
from gaident.version import version

__all__ = ["to_fmu"]

COMPILERS = ("cc", "gcc", "clang")
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden")
SYSTEMS = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib"), "Windows": ("windows", ".dll")}
ARCHITECTURES = {"AMD64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
DATE = (1980, 1, 1, 0, 0, 0)  # no decision: a format: the earliest of a zip file: the same model gives the same file

# Unit of the library -> exponents of kg, m, s, rad.
BASE = {
    "rad": {"rad": 1},
    "rad/s": {"s": -1, "rad": 1},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
}


def to_fmu(
    model: Model | OneMass | TwoMass,
    path: str | os.PathLike[str],
    dt: float,
    controller: Controller | None = None,
    *,
    substeps: int | None = None,
    axis: str = "rotary",
    binary: bool = True,
    compiler: str | None = None,
) -> Path:
    """Write a model as an FMU of FMI 3.0 for co-simulation: for Simulink, Dymola, OpenModelica, FMPy and others.

    It is the C file of `Model.to_c`, all built-in effects included, and steps as `run` does.
    Its input is `command` with a controller, `position_command` with one that has a position controller, `torque_command` without
    one; its outputs are `velocity`, `torque` and `position`.
    A communication step is a whole multiple of dt, or of the controller's period where it has one, over which the input is held.

    Parameters
    ----------
    model : Model, OneMass or TwoMass
        The drive.
    path : str or path-like
        File to write, with the ending .fmu.
    dt : float
        Sample time of its steps [s]; it steps at the controller's period where that is shorter.
    controller : PI or Cascade, optional
        The loop; None: the drive alone, torque [N m] to velocity [rad/s].
    substeps : int, optional
        As `Model.to_c` takes it.
    axis : {"rotary", "linear"}
        "linear": units of m and N.
    binary : bool
        Whether the library for this machine is compiled into it. False: sources alone, for tools that compile them.
    compiler : str, optional
        C compiler as on a command line, as "gcc -march=native"; None: what CC names, or the first of cc, gcc and clang.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ModelError
        For what `Model.to_c` refuses, for a feedforward with slopes over the coming period, which no input tells, and where no
        compiler is found or it fails.
    ControllerError
        As `Model.to_c`.
    OSError
        Where the file cannot be written.

    Examples
    --------
    >>> import zipfile
    >>> import gaident as ga
    >>> made = ga.to_fmu(ga.OneMass(J=1e-3, D=0.01), "axis.fmu", dt=1e-3, controller=ga.PI(0.05, 0.5), binary=False)
    >>> sorted(zipfile.ZipFile(made).namelist())[0]
    'modelDescription.xml'
    """
    target = checked_path(path, error=ModelError)
    if target.suffix != ".fmu":
        raise ModelError(f"path is {str(target)!r}: an FMU has the ending .fmu, as {target.stem + '.fmu'!r}")
    yes_or_no(binary, "binary", ModelError)
    if compiler is not None and not (isinstance(compiler, str) and compiler.strip()):
        raise ModelError(f"compiler is {compiler!r:.80}: give a C compiler as on a command line, such as 'gcc', or None")
    checked_axis(axis)
    plant, name = as_model(model), c_name(target.stem)
    step = _step(dt, controller)
    sources = {
        f"{name}.c": c_source(plant, step, controller, name, substeps, axis),
        "fmi3.c": files("gaident.export").joinpath("fmi3.c").read_text(encoding="utf-8"),
    }
    token = hashlib.sha256("".join(sources.values()).encode()).hexdigest()
    sources["fmu.c"] = _between(name, step, token, "    double angle;" in sources[f"{name}.c"])
    contents = {f"sources/{file}": text.encode() for file, text in sources.items()}
    contents["sources/buildDescription.xml"] = _build(name)
    contents["modelDescription.xml"] = _description(name, (step, float(dt)), token, controller, axis)
    if binary:
        folder, suffix = _platform()
        contents[f"binaries/{folder}/{name}{suffix}"] = _compiled(sources, name + suffix, compiler)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for file, data in sorted(contents.items(), key=lambda item: (item[0] != "modelDescription.xml", item[0])):
            archive.writestr(zipfile.ZipInfo(file, DATE), data, zipfile.ZIP_DEFLATED)
    write_whole(target, packed.getvalue())
    return target


def _step(dt: float, controller: Controller | None) -> float:
    """Its step [s]: a sample of the controller. Raises ModelError where the controller reads commands that come later."""
    time_of_sample(dt, ModelError)
    given = checked_controller(controller)
    if given is None:
        return float(dt)
    known(given)
    servo = Servo.of(given, dt)
    if servo is None:
        return float(dt)
    if servo.ahead:
        raise ModelError(
            'feedforward_over is "coming": the feedforward takes slopes of commands that come later, which no input of an FMU '
            'tells; give Cascade(..., feedforward_over="past"), or write C with to_c, whose steps read the coming commands'
        )
    return servo.period


def _between(name: str, dt: float, token: str, angle: bool) -> str:
    """The file that is compiled: what fmi3.c has to know of the model."""
    lines = [
        f"/* {name} as an FMU, written by gaident {version()}. */",
        f'#include "{name}.c"',
        f'#define FMU_TOKEN "{token}"',
        f"#define FMU_DT {dt!r}",
        f"#define FMU_STATE {name}_state",
        f"#define FMU_RESET {name}_reset",
        f"#define FMU_STEP {name}_step",
        *(["#define FMU_ANGLE(s) ((s).angle)"] if angle else []),
        '#include "fmi3.c"',
        "",
    ]
    return "\n".join(lines)


def _platform() -> tuple[str, str]:
    """(folder of the binary, ending of a library) of this machine. Raises ModelError where the standard names no such machine."""
    system, machine = platform.system(), platform.machine()
    if system not in SYSTEMS or machine not in ARCHITECTURES:
        raise ModelError(
            f"this machine is {system} on {machine}, for which no FMU is compiled here: give {arg('binary', 'False')}"
        )
    folder, suffix = SYSTEMS[system]
    return f"{ARCHITECTURES[machine]}-{folder}", suffix


def _compiled(sources: dict[str, str], library: str, compiler: str | None) -> bytes:
    named = compiler if compiler is not None else os.environ.get("CC", "")
    command = shlex.split(named) or [next(filter(None, map(shutil.which, COMPILERS)), "")]
    if not command[0] or shutil.which(command[0]) is None:
        what = f"{command[0]!r} is no program here" if command[0] else f"none of {', '.join(COMPILERS)} is on the path"
        raise ModelError(
            f"no C compiler: {what}; name one with {arg('compiler', 'gcc')}, or give {arg('binary', 'False')} for sources alone, "
            "which other tools compile"
        )
    with tempfile.TemporaryDirectory(prefix="gaident-fmu-") as folder:
        for file, text in sources.items():
            Path(folder, file).write_text(text, encoding="utf-8")
        whole = [*command, *FLAGS, "fmu.c", "-o", library, "-lm"]
        try:
            done = subprocess.run(whole, cwd=folder, capture_output=True, text=True, check=False)
        except OSError as reason:
            raise ModelError(f"the compiler {command[0]!r} does not run: {reason}") from None
        if done.returncode != 0:
            raise ModelError(f"the compiler {command[0]!r} fails: {done.stderr.strip()[-600:]}")
        return Path(folder, library).read_bytes()


def _xml(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _build(name: str) -> bytes:
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    made = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=name)
    files_of = ElementTree.SubElement(made, "SourceFileSet", language="C99", compilerOptions="-ffp-contract=off")
    ElementTree.SubElement(files_of, "SourceFile", name="fmu.c")
    return _xml(root)


def _description(name: str, steps: tuple[float, float], token: str, controller: Controller | None, axis: str) -> bytes:
    """steps: its own, and that at which a tool may communicate with it [s]."""
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=name,
        instantiationToken=token,
        generationTool=f"gaident {version()}",
        variableNamingConvention="flat",
    )
    abilities = dict.fromkeys(("canGetAndSetFMUState", "canSerializeFMUState"), "true")
    ElementTree.SubElement(root, "CoSimulation", {"modelIdentifier": name, "fixedInternalStepSize": repr(steps[0]), **abilities})
    units = ElementTree.SubElement(root, "UnitDefinitions")
    speed, torque, place = (unit(u, axis) for u in ("rad/s", "N m", "rad"))
    for one in (speed, torque, place):
        base = {k: str(v) for k, v in BASE[one].items()}
        ElementTree.SubElement(ElementTree.SubElement(units, "Unit", name=one), "BaseUnit", base)
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stepSize=repr(steps[1]))
    variables = ElementTree.SubElement(root, "ModelVariables")
    clock = {"name": "time", "valueReference": "0", "causality": "independent", "variability": "continuous"}
    ElementTree.SubElement(variables, "Float64", clock)
    given = ("torque_command", torque, "{torque} of the motor")
    if controller is not None:
        placed = controller.driven_by == "position_command"
        given = (controller.driven_by, place if placed else speed, "position command" if placed else "velocity command")
    rows = [
        (*given, "input"),
        ("velocity", speed, "velocity of the motor as the sensor shows it", "output"),
        ("torque", torque, "{torque} as the controller issues it", "output"),
        ("position", place, "{angle} of the motor, from 0", "output"),
    ]
    for reference, (variable, of, meaning, causality) in enumerate(rows, 1):
        words = {"name": variable, "valueReference": str(reference), "causality": causality, "variability": "continuous"}
        words |= {"unit": of, "description": said(say(meaning), axis)} | ({"start": "0"} if causality == "input" else {})
        ElementTree.SubElement(variables, "Float64", words)
    structure = ElementTree.SubElement(root, "ModelStructure")
    for kind in ("Output", "InitialUnknown"):
        for reference in range(2, len(rows) + 1):
            ElementTree.SubElement(structure, kind, valueReference=str(reference))
    return _xml(root)
