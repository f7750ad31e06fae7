"""The arithmetics of a drive, from Python: simulate, identify, refusals, and what stands in the drive's C++ and C."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.errors import ModelError, SettingsError
from gaident.results.settings import ARITHMETICS, DRIVE_ARITHMETICS
from places import ROOT

EMBEDDED = ROOT / "csrc" / "embedded"
SYMBOLS = (EMBEDDED / "gaident.symbols").read_text().split()
MODEL = ga.Model(6545.29, poles=(-15.41, -10.3 + 150.9j, -10.3 - 150.9j), zeros=(-4.26 + 93.98j, -4.26 - 93.98j))
LOOP = ga.PI(0.0232 * 5.5637, 1.367 * 5.5637, loop="continuous")
SPACE = ga.SearchSpace(gain=(1e3, 2e4), real=(0.0, 60.0), imaginary=(0.0, 250.0))

# Largest deviation of the velocity, relative to its peak; docs/dsp.md has the figures.
TOLERANCE = {"drive_double": 1e-12, "drive_float": 1e-5, "c30": 1e-5, "fixed": 1e-5, "fixed_tight": 1e-5, "fixed_wide": 1e-4}


@pytest.fixture(scope="module")
def rec() -> ga.Record:
    command = np.full(250, 43.6)
    clean = ga.simulate(MODEL, ga.Record(dt=0.444e-3, velocity=command, command=command), LOOP)
    noise = 0.3 * np.random.default_rng(1).standard_normal(250)
    return ga.Record(dt=0.444e-3, velocity=clean + noise, command=command)


def test_names_are_those_of_the_core_and_of_simulate() -> None:
    assert set(TOLERANCE) == set(DRIVE_ARITHMETICS)
    # The package exports the function of the same name.
    assert import_module("gaident.models.simulate").ARITHMETICS == ARITHMETICS


@pytest.mark.parametrize("arithmetic", DRIVE_ARITHMETICS)
def test_simulates_what_double_does(rec: ga.Record, arithmetic: str) -> None:
    exact = ga.simulate(MODEL, rec, LOOP)
    found = ga.simulate(MODEL, rec, LOOP, arithmetic=arithmetic)
    deviation = np.max(np.abs(found - exact))
    assert (deviation > 0.0) == (arithmetic != "drive_double")  # in double the same operations in the same order
    assert deviation < TOLERANCE[arithmetic] * np.max(np.abs(exact))


def test_simulation_beyond_the_range_is_undefined_and_not_clipped(rec: ga.Record) -> None:
    fast = ga.Record(dt=rec.dt, velocity=np.full(250, 60.0), command=np.full(250, 60.0))  # words without headroom end at 64 rad/s
    exact = ga.simulate(MODEL, fast, LOOP)
    first = int(np.argmax(exact > 64.0))
    tight = ga.simulate(MODEL, fast, LOOP, arithmetic="fixed_tight")
    assert 0 < first < 249 and np.isnan(tight[first:]).all()
    assert np.max(np.abs(tight[:first] - exact[:first])) < 1e-3
    assert np.isfinite(ga.simulate(MODEL, fast, LOOP, arithmetic="fixed")).all()


def test_identify_runs_as_the_drive_does(rec: ga.Record) -> None:
    def run(arithmetic: str, seed: int = 1) -> ga.Identification:
        settings = ga.Settings(code="binary", scale="linear", engine="plain", generations=60, arithmetic=arithmetic)
        return ga.identify(rec, LOOP, SPACE, settings, seed=seed)

    double, c30, again, fixed = run("double"), run("c30"), run("c30"), run("fixed")
    assert np.array_equal(double.trials[0].history, run("drive_double").trials[0].history)
    assert np.array_equal(c30.trials[0].history, again.trials[0].history)
    assert not np.array_equal(c30.trials[0].history, double.trials[0].history)
    # The same words are drawn: as long as no rounding decides a tournament, the runs stay together.
    np.testing.assert_allclose(c30.trials[0].history[:3], double.trials[0].history[:3], rtol=1e-4)
    np.testing.assert_allclose(fixed.trials[0].history[:3], double.trials[0].history[:3], rtol=1e-3)


def test_overflows_are_told(rec: ga.Record) -> None:
    settings = ga.Settings(code="binary", scale="linear", engine="plain", generations=20, arithmetic="fixed_tight")
    found = ga.identify(rec, LOOP, SPACE, settings)
    assert any("fixed_tight" in w and "left its range" in w for w in found.warnings)


def test_refuses_other_loops_and_starts(rec: ga.Record) -> None:
    settings = ga.Settings(arithmetic="c30")
    for controller in (None, ga.PI(0.1, 5.0), ga.PI(0.1, 5.0, loop="continuous", torque_limit=1.0)):
        torque = ga.Record(dt=rec.dt, velocity=rec.velocity, command=rec.command, torque=rec.velocity)
        with pytest.raises(SettingsError, match=r"arithmetic is 'c30'"):
            ga.identify(torque, controller, settings=settings)
        with pytest.raises(ModelError, match="arithmetic is 'c30'"):
            ga.simulate(MODEL, torque, controller, arithmetic="c30")
    with pytest.raises(ModelError, match="initial_state"):
        ga.simulate(MODEL, rec, LOOP, np.zeros(4), arithmetic="c30")


@pytest.mark.long
def test_the_drives_headers_need_no_library(tmp_path: Path) -> None:
    compiler, nm = shutil.which("g++"), shutil.which("nm")
    if compiler is None or nm is None:
        pytest.skip("no g++ or nm on the path")
    text = """
        #include "gaident/numeric/c30.hpp"
        #include "gaident/target/fixed_scaling.hpp"
        #include "gaident/target/static_search.hpp"
        template class gaident::StaticSearch<gaident::Plain<float>, 50, 250>;
        template class gaident::StaticSearch<gaident::FixedPoint<2>, 50, 250>;
        template class gaident::StaticSearch<gaident::Plain<gaident::C30Word, gaident::C30>, 50, 250>;
        static_assert(sizeof(gaident::StaticSearch<gaident::FixedPoint<2>, 50, 250>) < 20 * 1024);
    """
    flags = "-std=c++20 -O1 -ffreestanding -fno-exceptions -fno-rtti -fno-stack-protector -Wall -Wextra -Wpedantic -Wconversion"
    if platform.machine() in ("x86_64", "AMD64"):
        flags += " -mfma"  # as a drive's processor has it: without it a product and a sum in one is the C library's
    object_file = tmp_path / "drive.o"
    command = [compiler, *flags.split(), "-Werror", "-I", str(ROOT / "csrc"), "-x", "c++", "-", "-c", "-o", str(object_file)]
    built = subprocess.run(command, input=text, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    symbols = subprocess.run([nm, str(object_file)], capture_output=True, text=True, check=True).stdout.splitlines()
    undefined = {line.split()[-1] for line in symbols if " U " in line}
    assert undefined <= {"memcpy", "memset", "memmove", "_GLOBAL_OFFSET_TABLE_"}  # no heap, no libm, no exceptions
    assert not [line for line in symbols if "_GLOBAL__" in line]  # no constructor before main


def test_the_c_interface_is_c99() -> None:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler on the path")
    flags = "-std=c99 -Wall -Wextra -Wpedantic -Wconversion -Werror -fsyntax-only -x c -"
    command = [compiler, *flags.split(), "-I", str(EMBEDDED)]
    text = '#include "gaident.h"\nint ready(gaident_search *g) { return gaident_ready(g); }\n'
    built = subprocess.run(command, input=text, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr


def test_the_c_interface_has_the_projects_version() -> None:
    stated = re.search(r'^version = "(\d+)\.(\d+)\.(\d+)', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    defined = re.search(r"^#define GAIDENT_H_VERSION (\d+)$", (EMBEDDED / "gaident.h").read_text(), re.MULTILINE)
    assert stated is not None and defined is not None
    major, minor, patch = (int(part) for part in stated.groups())
    assert int(defined[1]) == 10000 * major + 100 * minor + patch


def test_the_list_of_symbols_is_what_the_header_declares() -> None:
    declared = re.findall(r"^[a-z][\w* ]*?\b(gaident_\w+)\([^;{]*\);", (EMBEDDED / "gaident.h").read_text(), re.MULTILINE)
    assert sorted(declared) == SYMBOLS


def built(*command: object, given: str = "") -> str:
    """What a compiler, or what it made, says."""
    done = subprocess.run([str(c) for c in command], input=given, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def genes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with genes.hpp."""
    cxx = shutil.which("g++")
    if cxx is None:
        pytest.skip("no g++ on the path")
    folder = tmp_path_factory.mktemp("genes")
    tables = folder / "make_tables"
    built(cxx, "-std=c++20", "-O0", "-ffp-contract=off", "-o", tables, EMBEDDED / "make_tables.cpp")
    (folder / "genes.hpp").write_text(built(tables, "genes"))
    return folder


@pytest.mark.parametrize("name, arithmetic", [("Float", "drive_float"), ("Fixed", "fixed")])
def test_the_c_interface_makes_the_desks_run(rec: ga.Record, tmp_path: Path, genes: Path, name: str, arithmetic: str) -> None:
    """tests/cpp/c_interface.c also checks what the interface refuses, and what a bad sample does."""
    cc, cxx = shutil.which("gcc"), shutil.which("g++")
    if cc is None or cxx is None:
        pytest.skip("no gcc or g++ on the path")
    program = tmp_path / "program"
    # Unoptimised: the same operations, compiled sooner.
    flags = f"-std=c++20 -O0 -ffp-contract=off -ffreestanding -fno-exceptions -fno-rtti -DGAIDENT_ARITHMETIC={name} -I{genes}"
    built(cxx, *flags.split(), "-c", "-o", tmp_path / "core.o", EMBEDDED / "gaident.cpp")
    if nm := shutil.which("nm"):
        exported = [line.split() for line in built(nm, "--extern-only", "--defined-only", tmp_path / "core.o").splitlines()]
        assert sorted(name for *_, kind, name in exported if kind not in "VWu") == SYMBOLS  # what is C++ may be there twice
        assert all(name.startswith("_Z") for *_, kind, name in exported if kind in "VWu")
    caller = ROOT / "tests" / "cpp" / "c_interface.c"
    strict = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
    built(cc, *strict, f"-I{EMBEDDED}", "-o", program, caller, tmp_path / "core.o", "-lm")  # fma, where the processor has none

    command = np.full(250, 43.6)
    numbers = [LOOP.kp, LOOP.ki, rec.dt, max(43.6, float(np.max(np.abs(rec.velocity))))]
    numbers += np.column_stack([command, rec.velocity]).ravel().tolist()
    p, q, gain, fitness, generation = built(program, given="\n".join(float(x).hex() for x in numbers)).split()

    settings = ga.Settings(code="binary", scale="linear", engine="plain", generations=30, arithmetic=arithmetic)
    found = ga.identify(rec, LOOP, SPACE, settings, seed=1)
    history = found.trials[0].history
    assert float.fromhex(fitness) == np.min(history) and int(generation) == np.argmin(history)
    assert (int(p), int(q)) == (found.model.p, found.model.q)
    assert float.fromhex(gain) == pytest.approx(found.model.gain, rel=1e-6)
