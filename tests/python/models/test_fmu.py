"""A model as an FMU: FMPy reads it, runs it, and gets the numbers of gaident.run."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga

T = 1e-3
LOOP = ga.PI(0.02, 0.6)
ONE = ga.OneMass(J=3e-4, D=0.004).model()
TWO = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59, DG=1e-3).model()
COMMAND = np.repeat([20.0, 60.0, -40.0, -5.0, 5.0, 0.0], 60)
ANGLE = 1.0 - np.cos(np.maximum(np.linspace(-0.2, 6.0, 360), 0.0))
DIGITAL = ga.PI(
    0.02, 0.6, rule="backward", command_weight=0.7, torque_limit=0.4, anti_windup="tracking", tracking_time=4e-3,
)  # fmt: skip
LOW, NOTCH = (ga.LowPass(time_constant=0.8e-3),), (ga.Notch(frequency=110.0, numerator_damping=0.1, denominator_damping=0.7),)

# Model, controller, substeps of the simulation, and whether the bits are the same.
# Without limits and effects the simulation steps one equation of the whole loop; with effects the order of a few sums differs.
CASES: dict[str, tuple[ga.Model, ga.PI | ga.Cascade | None, int | None, bool]] = {
    "alone": (TWO, None, None, True),
    "limited": (TWO, ga.PI(0.02, 0.6, torque_limit=0.4, integrator_limit=0.1), None, True),
    "loose": (TWO.with_effect("backlash", gap=0.01).with_effect("coulomb_friction", torque=0.02), LOOP, None, False),
    "late": (
        ONE.with_effect("torque_lag", time_constant=1e-3).with_effect("transport_delay", delay=1.3e-3), LOOP, None, True,
    ),
    "linear": (TWO, LOOP, None, False),
    "cogging": (TWO.with_effect("cogging", amplitude=0.05, order=6.0, phase=0.3), LOOP, 16, False),
    "servo": (TWO, ga.Cascade(DIGITAL, torque_filters=LOW, velocity_filters=NOTCH, delay=0.3e-3), None, True),
    "placed": (
        TWO,
        ga.Cascade(
            DIGITAL, position=ga.P(20.0), position_period=3 * T, velocity_feedforward=0.9, acceleration_feedforward=1e-4,
            friction_feedforward=0.02, command_filters=LOW, feedforward_over="past",
        ),
        None,
        True,
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def fmpy() -> Any:
    return pytest.importorskip("fmpy", reason="FMPy runs the FMUs: pip install '.[test]'")


@pytest.fixture
def compiled() -> None:
    if not any(map(shutil.which, ("cc", "gcc", "clang"))):
        pytest.skip("no C compiler on the path")


def written(name: str, folder: Path, **options: Any) -> Path:
    model, controller, _, _ = CASES[name]
    return ga.to_fmu(model, folder / f"{name}.fmu", T, controller, **options)


@contextmanager
def opened(path: Path, fmpy: Any) -> Iterator[Any]:
    from fmpy.fmi3 import FMU3Slave

    description = fmpy.read_model_description(str(path), validate=True)
    folder = fmpy.extract(str(path))
    identifier = description.coSimulation.modelIdentifier
    fmu = FMU3Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=identifier, instanceName="axis")
    fmu.instantiate()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    yield fmu
    fmu.terminate()
    fmu.freeInstance()
    shutil.rmtree(folder)


def answers(fmu: Any, source: np.ndarray) -> np.ndarray:
    """Time, velocity, torque and position at each sample."""
    rows = []
    for k, value in enumerate(source):
        fmu.setFloat64([1], [value])
        rows.append(fmu.getFloat64([0, 2, 3, 4]))
        fmu.doStep(k * T, T)
    return np.array(rows).T


@pytest.mark.parametrize("name", CASES)
def test_an_fmu_steps_as_the_simulation(name: str, fmpy: Any, compiled: None, tmp_path: Path) -> None:
    model, controller, substeps, same_bits = CASES[name]
    what = "torque" if controller is None else controller.driven_by
    source = {"torque": 0.01 * COMMAND, "command": COMMAND, "position_command": ANGLE}[what]
    drive = {what: source}
    expected = ga.run(model, ga.Record(T, velocity=0.0 * source, **drive), controller, substeps=substeps)
    with opened(written(name, tmp_path), fmpy) as fmu:
        time, *found = answers(fmu, source)
    assert np.array_equal(time, T * np.arange(len(source)))
    for answer, wanted in zip(found, (expected.velocity, expected.torque, expected.position), strict=True):
        if same_bits:
            assert np.array_equal(answer, wanted)
        np.testing.assert_allclose(answer, wanted, rtol=0.0, atol=1e-12 * np.abs(wanted).max())


def test_a_controller_that_is_faster_than_the_steps_of_a_tool(fmpy: Any, compiled: None, tmp_path: Path) -> None:
    """It steps at its own clock; between two steps of the tool the command is held, as a simulation holds it where it jumps."""
    controller = ga.Cascade(DIGITAL, period=T / 4, torque_filters=LOW, delay=0.1e-3)
    expected = ga.run(TWO, ga.Record(T, command=COMMAND, velocity=0.0 * COMMAND), controller)
    path = ga.to_fmu(TWO, tmp_path / "fast.fmu", T, controller)
    description = fmpy.read_model_description(str(path), validate=True)
    assert description.coSimulation.fixedInternalStepSize == str(T / 4) and description.defaultExperiment.stepSize == str(T)
    with opened(path, fmpy) as fmu:
        _, *found = answers(fmu, COMMAND)
    for answer, wanted in zip(found, (expected.velocity, expected.torque, expected.position), strict=True):
        assert np.array_equal(answer, wanted)


def test_a_simulator_runs_it(fmpy: Any, compiled: None, tmp_path: Path) -> None:
    """From rest under a constant command, with a state that was stored, a step of several samples and one that is none."""
    from fmpy.fmi1 import FMICallException

    path = written("loose", tmp_path)
    found = fmpy.simulate_fmu(str(path), stop_time=0.1, output_interval=2 * T, start_values={"command": 20.0}, validate=True)
    model, controller, _, _ = CASES["loose"]
    rec = ga.Record(T, command=np.full(101, 20.0), velocity=np.zeros(101))
    expected = ga.run(model, rec, controller)
    assert np.array_equal(found["velocity"], expected.velocity[::2]) and np.array_equal(found["torque"], expected.torque[::2])
    with opened(path, fmpy) as fmu:
        first = answers(fmu, COMMAND[:30])
        stored = fmu.getFMUState()
        later = answers(fmu, COMMAND[30:60])
        fmu.setFMUState(stored)
        assert np.array_equal(answers(fmu, COMMAND[30:60]), later) and first[0, -1] < later[0, 0]
        bytes_of = fmu.serializeFMUState(stored)
        fmu.setFMUState(fmu.deserializeFMUState(bytes_of))
        assert np.array_equal(answers(fmu, COMMAND[30:60]), later)
        with pytest.raises(FMICallException):
            fmu.doStep(0.0, 0.4 * T)
        with pytest.raises(FMICallException):
            fmu.getFloat64([9])
        fmu.reset()
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        assert np.array_equal(answers(fmu, COMMAND[:30]), first)


def test_its_functions_are_those_of_the_standard(fmpy: Any, compiled: None, tmp_path: Path) -> None:
    """All functions of FMI 3.0 are in the library, and each has the arguments that the headers of the standard say."""
    headers = Path(fmpy.__file__).parent / "c-code"
    declared = set(re.findall(r"#define (fmi3\w+)\s+fmi3FullName", (headers / "fmi3Functions.h").read_text()))
    with zipfile.ZipFile(written("alone", tmp_path)) as archive:
        archive.extractall(tmp_path)
    (library,) = (tmp_path / "binaries").rglob("alone.*")
    assert len(declared) > 70 and all(name.encode() in library.read_bytes() for name in declared)
    # Every type of the standard's functions against ours, as a tool calls them: pointers of one type, whatever it is named.
    source = (tmp_path / "sources" / "fmi3.c").read_text()
    ours = re.findall(r"(fmi3\w+)\(([^()]*(?:\([^()]*\)[^()]*)*)\) \{", source)
    counts = {name: arguments.count(",") for name, arguments in ours}
    types = (headers / "fmi3FunctionTypes.h").read_text()
    wanted = {name: text.count(",") for name, text in re.findall(r"(fmi3\w+)TYPE\s*\(([^;]*)\);", types)}
    checked = [name for name in counts if name in wanted]
    assert len(checked) > 20 and all(counts[name] == wanted[name] for name in checked)
    short = {name: 1 + text.count(",") for name, text in re.findall(r"FMU_NOT\((fmi3\w+), ([^)]*)\)\n", source)}
    assert len(short) > 20 and all(wanted[name] == count for name, count in short.items())


def test_what_is_in_the_file(tmp_path: Path) -> None:
    path = written("linear", tmp_path, binary=False, axis="linear")
    with zipfile.ZipFile(path) as archive:
        names, text = archive.namelist(), archive.read("modelDescription.xml").decode()
        source = archive.read("sources/linear.c").decode()
    wanted = ["buildDescription.xml", "fmi3.c", "fmu.c", "linear.c"]
    assert names == ["modelDescription.xml", *(f"sources/{name}" for name in wanted)]
    assert 'fmiVersion="3.0"' in text and 'fixedInternalStepSize="0.001"' in text and 'name="command"' in text
    assert 'unit="m/s"' in text and 'unit="N"' in text and "N m" not in text and "force" in text
    assert source == TWO.to_c(None, T, LOOP, name="linear", axis="linear")
    with zipfile.ZipFile(written("placed", tmp_path, binary=False)) as archive:
        placed = archive.read("modelDescription.xml").decode()
    assert 'name="position_command" valueReference="1" causality="input" variability="continuous" unit="rad"' in placed
    again = written("linear", tmp_path / "..", binary=False, axis="linear")
    assert again.read_bytes() == path.read_bytes()
    again.unlink()


def test_the_c_of_it_compiles_without_a_warning(compiled: None, tmp_path: Path) -> None:
    with zipfile.ZipFile(written("loose", tmp_path, binary=False)) as archive:
        archive.extractall(tmp_path)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-Wshadow", "-fsyntax-only"]
    compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))))
    done = subprocess.run([compiler, *flags, "fmu.c"], cwd=tmp_path / "sources", capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_wrong_use_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ga.GaidentError, match=r"path is 'axis': an FMU has the ending .fmu, as 'axis.fmu'"):
        ga.to_fmu(ONE, "axis", T)
    with pytest.raises(ga.GaidentError, match="dt is 0"):
        ga.to_fmu(ONE, tmp_path / "axis.fmu", 0.0)
    ahead = ga.Cascade(LOOP, position=ga.P(20.0), velocity_feedforward=1.0)
    with pytest.raises(ga.GaidentError, match=r'feedforward_over is "coming": .*feedforward_over="past"\), or write C with to_c'):
        ga.to_fmu(ONE, tmp_path / "axis.fmu", T, ahead)
    with pytest.raises(ga.GaidentError, match="kp is None, not known: give a number here"):
        ga.to_fmu(ONE, tmp_path / "axis.fmu", T, ga.PI(None, 0.6))
    with pytest.raises(ga.GaidentError, match="binary is 1: give True or False"):
        ga.to_fmu(ONE, tmp_path / "axis.fmu", T, binary=1)  # type: ignore[arg-type]
    with pytest.raises(ga.GaidentError, match=r"no C compiler: 'no-such-cc' is no program here.*binary=False"):
        ga.to_fmu(ONE, tmp_path / "axis.fmu", T, compiler="no-such-cc -O2")
    failing = f"{sys.executable} -c \"raise SystemExit('broken')\""
    with pytest.raises(ga.GaidentError, match="fails: broken"):
        ga.to_fmu(ONE, tmp_path / "axis.fmu", T, compiler=failing)
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ga.GaidentError, match="none of cc, gcc, clang is on the path"):
        ga.to_fmu(ONE, tmp_path / "axis.fmu", T)
    monkeypatch.setattr("platform.machine", lambda: "riscv64")
    with pytest.raises(ga.GaidentError, match="riscv64, for which no FMU is compiled here: give binary=False"):
        ga.to_fmu(ONE, tmp_path / "axis.fmu", T)
    assert not os.listdir(tmp_path)
