"""Every argument of the public functions with values of another kind: one error of one line, no warning, no other end."""

from __future__ import annotations

import inspect
import shutil
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.control import core
from gaident.models import FactorCounts
from gaident.models.own_effects import OWN

N = 200
COMMAND = np.repeat([0.0, 20.0, -5.0, 60.0], N // 4)
PI = ga.PI(0.02, 0.5)
ONE = ga.OneMass(J=2e-4, D=3e-3).model()
NOISE = 0.05 * np.random.default_rng(0).standard_normal(N)
RUN = ga.run(ONE, ga.Record(1e-3, command=COMMAND, velocity=np.zeros(N)), PI)
REC = ga.Record(1e-3, command=COMMAND, velocity=RUN.velocity + NOISE, torque=RUN.torque)
IDN = ga.identify(REC, PI, trials=1)
DIA = ga.diagnose(REC, PI, IDN, quick=True)
# Long enough for the regression and for frequency responses.
LONG_COMMAND = np.repeat(30.0 * np.random.default_rng(1).standard_normal(40), 50)
LONG_RUN = ga.run(ONE, ga.Record(1e-3, command=LONG_COMMAND, velocity=0.0 * LONG_COMMAND), PI)
LONG = ga.Record(1e-3, command=LONG_COMMAND, velocity=LONG_RUN.velocity, torque=LONG_RUN.torque)
INVERSE = ga.inverse_dynamics(LONG)
TUNED = ga.retune(DIA, dt=1e-3)
TABLES = ga.feedforward(DIA)
JOINT = ga.joint_parameters(DIA)
FRICTION = ga.friction_map(LONG)
COMPARED = ga.compare([ONE, DIA], REC, PI)
LEAST = ga.least_squares(REC, 2)

HOSTILE: list[Any] = [
    *(None, True, 3, -1, 0, 1.5, 1e300, -1e300, 1e-300, float("nan"), float("inf"), 10**400, -(10**400), 2**63, 1j),
    *("x", "", b"x", "a\0b", object(), int, Ellipsis, lambda *_: None, range(3)),
    *([], [1], [1, 2, 3], (), {}, {"a": 1}),
    *(np.zeros(0), np.zeros((2, 2)), np.array(["a"]), np.float64(1e308), np.full(N, np.nan), np.full(N, 1e200)),
    *([[]], [[1, 2], [3]], [[[1.0]]], [None], [["x"]], [[1e300, -1e300]], ([],), {"a": [1, [2]]}, [{"a": 1}], [np.zeros(2)]),
    *(ga.Model(1e90, [-1e15, -1.0], [-1e15]), ga.Model(1e-90, [1e15]), ga.Model(-1.0, [0.0, -1e-200], [-1e-200])),
    *(ga.Model(1.0, 14 * [-1e15], 7 * [-1e15]), ga.Model(1.0, [-1e15 + 1e15j, -1e15 - 1e15j, 0.0], [0.0, -1e-200])),
    ga.Model(1.0, [-1.0]).with_effect("coulomb_friction", torque=1e30),
]

BAND = np.geomspace(1.0, 100.0, 20)
SIZE = ga.effects.Parameter("size", "1", neutral=0.0, lowest=0.0, highest=1.0)
RESPONSE = ga.FrequencyResponse(BAND, ONE.frequency_response(2.0 * np.pi * BAND))
WINDING = ga.Winding(1.0, 0.1, 1e-3)
TWO = ga.TwoMass(JM=1e-4, DM=0.1, JL=1e-4, DL=0.1, KG=2.0)
CURVED = ONE.with_effect("stribeck_friction", torque=0.1, static_torque=0.2, stribeck_velocity=1.0)
DIA_OF_MORE = replace(DIA, model=DIA.model.with_effect("coulomb_friction", torque=0.01))
NAMED = {"time": "t", "command": "w_ref", "velocity": "w", "torque": "M"}

FLEET: dict[str, Any] = {"logs": "log.csv", "out": "fleet", "executor": map, "method": "identify", "read": {"columns": NAMED}}


def _register(parameter: ga.effects.Parameter = SIZE) -> None:
    ga.effects.register("mine", [parameter], meaning="x", torque=lambda s, **_: 0.0 * s.velocity, replace=True)


CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Record": (ga.Record, {"dt": 1e-3, "command": COMMAND, "velocity": REC.velocity, "torque": REC.torque}),
    "with_channels": (REC.with_channels, {}),
    "between": (REC.between, {"t0": 0.0, "t1": 0.1}),
    "decimate": (REC.decimate, {"factor": 2}),
    "differentiate": (ga.differentiate, {"position": 1e-3 * np.cumsum(REC.velocity), "dt": 1e-3, "cutoff_hz": 50.0}),
    "align": (ga.align, {"rec": REC, "other": REC}),
    "read": (ga.read, {"path": "log.csv", "columns": NAMED}),
    "read_pieces": (ga.read_pieces, {"path": "log.csv", "columns": NAMED}),
    "read_columns": (ga.read_columns, {"path": "log.csv"}),
    "columns": (ga.columns, {"path": "log.csv"}),
    "PI": (ga.PI, {"kp": 0.02, "ki": 0.5}),
    "Cascade": (ga.Cascade, {"velocity": PI}),
    "LowPass": (ga.LowPass, {"time_constant": 1e-3}),
    "Notch": (ga.Notch, {"frequency": 85.0, "numerator_damping": 0.1, "denominator_damping": 0.7}),
    "Model": (ga.Model, {"gain": 10.0, "poles": [-1.0]}),
    "Model.from_dict": (ga.Model.from_dict, {"data": ONE.to_dict()}),
    "OneMass": (lambda **k: ga.OneMass(**k).model(), {"J": 1e-4, "D": 0.1}),
    "TwoMass": (lambda **k: ga.TwoMass(**k).model(), {"JM": 1e-4, "DM": 0.1, "JL": 1e-4, "DL": 0.1, "KG": 2.0, "DG": 0.0}),
    "with_effect": (ONE.with_effect, {"name": "coulomb_friction", "torque": 0.1, "side": "motor"}),
    "mechanics_from_model": (ga.mechanics_from_model, {"model": ONE}),
    "factor_parameters": (ga.factor_parameters, {"model": ONE}),
    "frequency_response": (ONE.frequency_response, {"omega": 1.0}),
    "FrequencyResponse": (ga.FrequencyResponse, {"frequency_hz": BAND, "response": ONE.frequency_response(2.0 * np.pi * BAND)}),
    "read_response": (ga.read_response, {"path": "bode.csv"}),
    "frequency_response of a record": (ga.frequency_response, {"rec": LONG, "controller": PI}),
    "discrete": (ONE.discrete, {"dt": 1e-3}),
    "to_c": (ONE.to_c, {"path": None, "dt": 1e-3, "controller": PI}),
    "to_scipy": (ONE.to_scipy, {}),
    "simulate": (ga.simulate, {"model": ONE, "rec": REC, "controller": PI}),
    "run": (ga.run, {"model": ONE.with_effect("coulomb_friction", torque=0.01), "rec": REC, "controller": PI}),
    "simulate_many": (ga.simulate_many, {"models": [ONE, ONE], "rec": REC, "controller": PI}),
    "initial_state": (ga.initial_state, {"model": ONE, "rec": REC, "controller": PI}),
    "register": (
        ga.effects.register,
        {"name": "mine", "parameters": [SIZE], "meaning": "x", "torque": lambda s, **_: 0.0 * s.velocity, "replace": True},
    ),
    "Settings": (ga.Settings, {}),
    "SearchSpace": (ga.SearchSpace, {"gain": (1.0, 10.0), "real": (0.1, 10.0), "imaginary": (0.0, 100.0)}),
    "from_mechanics": (ga.SearchSpace.from_mechanics, {"inertia": (1e-4, 1e-3), "resonance_hz": (1.0, 100.0)}),
    "identify": (ga.identify, {"rec": REC, "controller": PI}),
    "diagnose": (ga.diagnose, {"rec": REC, "controller": PI, "identification": IDN, "quick": True}),
    "least_squares": (ga.least_squares, {"rec": REC, "order": 2}),
    "m_sequence": (ga.m_sequence, {"register": 5}),
    "inverse_dynamics": (ga.inverse_dynamics, {"rec": LONG}),
    "force_error": (ga.force_error, {"model": ONE, "records": REC}),
    "Winding": (ga.Winding, {"resistance": 1.0, "torque_constant": 0.1}),
    "estimate_winding": (
        ga.estimate_winding,
        {"voltage": LONG_COMMAND, "current": LONG.torque, "velocity": LONG.velocity, "dt": 1e-3, "cutoff_hz": 50.0},
    ),
    "Limits": (
        lambda **k: ga.first_experiment(1e-3, ga.Limits(**k)),
        {"speed": 80.0, "torque": 2.4, "travel": 9.0, "duration": 5.0},
    ),
    "first_experiment": (ga.first_experiment, {"dt": 1e-3, "limits": ga.Limits(80.0, 2.4)}),
    "idn.simulate": (IDN.simulate, {"rec": REC}),
    "idn.residual": (IDN.residual, {"rec": REC}),
    "idn.save": (IDN.save, {"path": "idn.json"}),
    "idn.summary": (IDN.summary, {}),
    "dia.summary": (DIA.summary, {}),
    "load": (ga.load, {"path": "saved.json"}),
    "report": (ga.report, {"result": DIA, "path": "page.html", "remedies": False}),
    "to_fmu": (ga.to_fmu, {"model": ONE, "path": "drive.fmu", "dt": 1e-3, "controller": PI, "binary": False}),
    "to_fmu compiled": (ga.to_fmu, {"model": ONE, "path": "drive.fmu", "dt": 1e-3, "compiler": "gcc"}),
    "to_control": (ONE.to_control, {}),
    "joint_parameters": (ga.joint_parameters, {"result": DIA}),
    "joint_parameters of a curve": (ga.joint_parameters, {"result": CURVED, "speed": 100.0}),
    "joint.to_mujoco": (JOINT.to_mujoco, {"name": "axis"}),
    "joint.to_urdf": (JOINT.to_urdf, {"name": "axis"}),
    "joint.to_sdf": (JOINT.to_sdf, {"name": "axis"}),
    "joint.to_wpilib": (JOINT.to_wpilib, {"torque_constant": 0.1}),
    "joint.to_simscape": (JOINT.to_simscape, {}),
    "joint.summary": (JOINT.summary, {}),
    "fleet": (ga.fleet, FLEET),
    "fleet of diagnoses": (ga.fleet, FLEET | {"method": "diagnose", "quick": True}),
    "fleet by another": (
        lambda executor: ga.fleet(**FLEET | {"executor": map if executor is None else executor, "resume": False}),
        {"executor": map},
    ),
    "fleet.rows": (lambda **k: list(ga.fleet(**FLEET).rows(**k)), {"table": "logs"}),
    "trends": (ga.trends, {"fleet": "fleet", "out": "trends.html"}),
    "retune": (ga.retune, {"result": DIA, "dt": 1e-3}),
    "tuned.summary": (TUNED.summary, {}),
    "tuned.save": (TUNED.save, {"path": "tuned.json"}),
    "tuned.plot": (TUNED.plot, {}),
    "feedforward": (ga.feedforward, {"result": DIA}),
    "tables.torque": (TABLES.torque, {"velocity": 1.0, "angle": 0.0, "acceleration": 0.0}),
    "tables.to_c": (TABLES.to_c, {"path": None}),
    "tables.to_csv": (TABLES.to_csv, {"path": "tables.csv"}),
    "tables.summary": (TABLES.summary, {}),
    "friction_map": (ga.friction_map, {"records": LONG}),
    "friction.summary": (FRICTION.summary, {}),
    "friction.to_csv": (FRICTION.to_csv, {"path": "map.csv"}),
    "friction.plot": (FRICTION.plot, {}),
    "compare": (ga.compare, {"models": [ONE, IDN], "rec": REC, "controller": PI}),
    "compare one": (lambda model: ga.compare([model], REC), {"model": ONE}),
    "compare.summary": (COMPARED.summary, {}),
    "read_axes": (ga.read_axes, {"path": "log.csv", "axes": {"x": NAMED}}),
    "read_axes one": (lambda own: ga.read_axes("log.csv", {"x": own}), {"own": NAMED}),
    "read_axes common": (
        lambda **k: ga.read_axes("log.csv", {"x": {"velocity": "w"}}, **k),
        {"columns": NAMED, "units": {}, "dt": None, "shift": None, "delimiter": None},
    ),
    "P": (ga.P, {"gain": 5.0}),
    "P.from_drive": (ga.P.from_drive, {"drive": "odrive", "pos_gain": 20.0}),
    "PI.from_drive": (ga.PI.from_drive, {"drive": "sinamics", "p1460": 0.02, "p1462": 10.0}),
    "PI.from_dict": (ga.PI.from_dict, {"data": PI.to_dict()}),
    "PI.with_limits": (PI.with_limits, {"torque": 1.0, "integrator": 1.0}),
    "Cascade.from_dict": (ga.Cascade.from_dict, {"data": ga.Cascade(PI).to_dict()}),
    "Effect": (ga.Effect, {"name": "coulomb_friction", "parameters": {"torque": 0.1}}),
    "Effect.from_dict": (ga.Effect.from_dict, {"data": ga.Effect("coulomb_friction", {"torque": 0.1}).to_dict()}),
    "Parameter": (
        lambda **k: _register(ga.effects.Parameter(**k)),
        {"name": "size", "unit": "1", "neutral": 0.0, "lowest": 0.0, "highest": 1.0, "logarithmic": False, "starts": ()},
    ),
    "unregister": (lambda **k: (_register(), ga.effects.unregister(**k)), {"name": "mine"}),
    "without_effect": (ONE.with_effect("coulomb_friction", torque=0.1).without_effect, {"name": "coulomb_friction"}),
    "model_from_factor_parameters": (
        ga.model_from_factor_parameters,
        {"values": ga.factor_parameters(ONE)[1], "structure": FactorCounts.of(ONE)},
    ),
    "OneMass.from_model": (ga.OneMass.from_model, {"model": ONE}),
    "TwoMass.from_model": (ga.TwoMass.from_model, {"model": TWO.model()}),
    "Record.from_dict": (ga.Record.from_dict, {"data": REC.to_dict()}),
    "Record.save": (REC.save, {"path": "rec.json"}),
    "Record.plot": (REC.plot, {}),
    "Record.shifted": (REC.shifted, {"velocity": 1}),
    "Settings.from_dict": (ga.Settings.from_dict, {"data": ga.Settings().to_dict()}),
    "SearchSpace.from_dict": (ga.SearchSpace.from_dict, {"data": ga.SearchSpace().to_dict()}),
    "Limits.of": (ga.Limits.of, {"records": REC, "controller": PI}),
    "response.band": (RESPONSE.band, {"lowest_hz": 2.0}),
    "response.plot": (RESPONSE.plot, {}),
    "winding.current": (WINDING.current, {"voltage": COMMAND, "velocity": REC.velocity, "dt": 1e-3}),
    "winding.mean_current": (WINDING.mean_current, {"current": COMMAND, "dt": 1e-3}),
    "winding.torque": (WINDING.torque, {"voltage": COMMAND, "velocity": REC.velocity, "dt": 1e-3}),
    "inverse.error": (INVERSE.error, {"records": LONG}),
    "inverse.torque": (INVERSE.torque, {"record": LONG}),
    "inverse.from_dict": (ga.InverseDynamics.from_dict, {"data": INVERSE.to_dict()}),
    "least.simulate": (LEAST.simulate, {"rec": REC}),
    "idn.as_used": (IDN.as_used, {"rec": REC}),
    "idn.plot": (IDN.plot, {}),
    "idn.plot_bode": (IDN.plot_bode, {}),
    "idn.plot_poles": (IDN.plot_poles, {}),
    "idn.from_dict": (ga.Identification.from_dict, {"data": IDN.to_dict()}),
    "dia.as_used": (DIA.as_used, {"rec": REC}),
    "dia.plot": (DIA.plot, {}),
    "dia.plot_bode": (DIA.plot_bode, {}),
    "dia.save": (DIA.save, {"path": "dia.json"}),
    "dia.from_dict": (ga.Diagnosis.from_dict, {"data": DIA.to_dict()}),
    "dia.simulate_without": (DIA_OF_MORE.simulate_without, {"effect": "coulomb_friction", "rec": REC}),
    "tuned.from_dict": (ga.Retuning.from_dict, {"data": TUNED.to_dict()}),
    "LoopFigures.from_dict": (ga.LoopFigures.from_dict, {"data": TUNED.to_dict()["before"]}),
    "Proposal.from_dict": (ga.Proposal.from_dict, {"data": ga.first_experiment(1e-3, ga.Limits(80.0, 2.4)).to_dict()}),
}
# Where a function is taken, that one may raise what it likes.
TAKEN = {
    *(("diagnose", "progress"), ("identify", "progress"), ("force_error", "model")),
    *(("fleet", "progress"), ("fleet of diagnoses", "progress")),
}


def _write_log() -> None:
    rows = np.column_stack([REC.time, COMMAND, REC.velocity, np.asarray(REC.torque)])
    np.savetxt("log.csv", rows, delimiter=",", header="t,w_ref,w,M", comments="")


@pytest.fixture(scope="module")
def kept_fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `fleet` found in the log, by both methods: made once, so that no row waits for it."""
    with pytest.MonkeyPatch.context() as there:
        there.chdir(tmp_path_factory.mktemp("fleet"))
        _write_log()
        for given in (FLEET, FLEET | {"method": "diagnose", "quick": True}):
            assert ga.fleet(**given).done == 1
        return Path("fleet").absolute()


@pytest.fixture
def here(kept_fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    _write_log()
    IDN.save("saved.json")
    shutil.copytree(kept_fleet, "fleet")
    g = ONE.frequency_response(2.0 * np.pi * BAND)
    header = "frequency [Hz],real,imaginary"
    np.savetxt("bode.csv", np.column_stack([BAND, g.real, g.imag]), delimiter=",", header=header, comments="")
    assert len(ga.read_response("bode.csv")) == len(BAND)
    return tmp_path


@pytest.mark.long
@pytest.mark.parametrize("name", CALLS)
def test_a_wrong_argument_is_one_error_that_is_ours(name: str, here: Path) -> None:
    function, given = CALLS[name]
    kinds = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    names = dict.fromkeys([*given, *(p.name for p in inspect.signature(function).parameters.values() if p.kind not in kinds)])
    function(**given)  # else the row would say nothing of its arguments
    wrong = []
    for argument in names:
        for value in HOSTILE:
            if callable(value) and (name, argument) in TAKEN:
                continue
            began = time.process_time()
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    function(**{**given, argument: value})
            except (ga.GaidentError, OSError) as error:
                if "\n" in str(error).strip():
                    wrong.append(f"{argument}={value!r:.40}: more than one line: {error!r:.200}")
            except Exception as error:
                wrong.append(f"{argument}={value!r:.40}: {error!r:.200}")
            if time.process_time() - began > 10.0:
                wrong.append(f"{argument}={value!r:.40}: {time.process_time() - began:.1f} s")
    for own in tuple(OWN):
        ga.effects.unregister(own)
    assert not wrong, "\n".join(wrong)


def test_every_public_function_has_a_row() -> None:
    functions = {name: getattr(ga, name) for name in ga.__all__ if inspect.isfunction(getattr(ga, name))}
    called = [function for function, _ in CALLS.values()]
    assert not [n for n, f in functions.items() if inspect.signature(f).parameters and f not in called]


@pytest.mark.parametrize(
    ("name", "changed", "message"),
    [
        ("to_fmu", {"compiler": 3}, "compiler is 3: give a C compiler"),
        ("to_fmu", {"dt": 1e300}, r"dt is 1e\+300: give the sample time in s, from 1e-12"),
        ("to_fmu", {"dt": True}, "dt is True: give the sample time"),
        ("joint_parameters", {"speed": 1e300}, r"speed is 1e\+300, which no drive has .*: give the highest speed"),
        (
            "joint.to_wpilib",
            {"torque_constant": 1e-300},
            "torque_constant is 1e-300, which no drive has .*: give the",
        ),
        ("fleet", {"out": ""}, "out is '', which names no file or folder: give its name"),
        ("fleet", {"seed": 2**63}, "seed is 9223372036854775808: it must be a whole number from 0"),
        ("fleet", {"logs": {"a": 1}}, "logs is {'a': 1}: give a pattern"),
        ("fleet of diagnoses", {"noise": 1e300}, r"noise is 1e\+300, which no drive has .*: give its standard deviation"),
        ("fleet by another", {"executor": int}, "executor raises TypeError .*: give a function like map, or an Executor"),
        ("trends", {"fleet": ""}, "fleet is '', which names no file or folder"),
        ("retune", {"dt": 1e300}, r"dt is 1e\+300: give the sample time of the controller"),
        ("retune", {"step": 1e300}, r"step is 1e\+300, which no drive has"),
        ("tables.torque", {"velocity": np.nan}, "velocity has nan, which no drive reaches .*: give real numbers"),
        ("tables.torque", {"velocity": [1, 2, 3], "angle": [1, 2]}, r"have the shapes \(3,\), \(2,\) and \(\): give one number"),
        ("friction_map", {"inertia": 1e-300}, "inertia is 1e-300, which no drive has"),
        ("read_axes common", {"units": [1]}, r"units is \[1\]: give a mapping of channels"),
        ("TwoMass.from_model", {"free_shaft_damping": "no"}, "free_shaft_damping is 'no': give True or False"),
        ("Parameter", {"logarithmic": None}, "logarithmic of size of mine is None: give True or False"),
        ("idn.plot_bode", {"hz": "no"}, "hz is 'no': give True or False"),
        ("Model", {"gain": 1e300}, r"gain is 1e\+300, whose size no drive has .*: correct its unit"),
        ("Model", {"gain": -1e-305}, r"gain is -1e-305, whose size no drive has"),
        ("Model", {"poles": [-1.0, -1e200]}, r"poles\[1\] is -1e\+200.*, which no drive has .*: give it in rad/s"),
        ("Model", {"zeros": [-1e250]}, r"zeros\[0\] is -1e\+250.*, which no drive has"),
        ("OneMass", {"J": 1e300}, r"J is 1e\+300, which no drive has"),
        ("OneMass", {"J": 1e-25, "D": 1e28}, r"J is 1e-25 and D is 1e\+28: poles\[0\] is -1e\+53"),
        ("with_effect", {"torque": 1e300}, r"torque of coulomb_friction is 1e\+300, which no drive has"),
        (
            "factor_parameters",
            {"model": SimpleNamespace(gain=1.0, poles=[-1e200 + 1e200j, -1e200 - 1e200j], zeros=[], p=2)},
            r"poles of model\[0\] is -1e\+200.*, which no drive has",
        ),
        ("discrete", {"dt": 1e300}, r"dt is 1e\+300"),
    ],
)
def test_what_would_be_nonsense_is_refused_by_name(name: str, changed: dict[str, Any], message: str, here: Path) -> None:
    function, given = CALLS[name]
    with pytest.raises(ga.GaidentError, match=message):
        function(**{**given, **changed})


@pytest.mark.long
@pytest.mark.parametrize("size", [1e-30, 1e-12, 1e6, 1e17, 1e28])
@pytest.mark.parametrize("channel", ["command", "velocity", "torque"])
def test_a_size_that_no_drive_has_ends_in_a_verdict_or_one_error(channel: str, size: float) -> None:
    """A command of 2e17 asked for 489 TiB for the next experiment."""
    channels = {"command": REC.command, "velocity": REC.velocity, "torque": REC.torque}
    channels[channel] = size * np.asarray(channels[channel])
    for controller in (PI, None):
        try:
            assert ga.diagnose(ga.Record(1e-3, **channels), controller).summary()
        except ga.GaidentError as error:
            assert "\n" not in str(error)


def test_sizes_beyond_all_drives_are_refused_by_name() -> None:
    with pytest.raises(ga.GaidentError, match=r"velocity\[3\] = -2e\+50 is beyond 1e\+30"):
        ga.Record(1e-3, torque=np.ones(N), velocity=np.where(np.arange(N) == 3, -2e50, 0.0))
    for dt in (1e300, 1e-300):
        with pytest.raises(ga.GaidentError, match=r"is no sample time of a drive \(1e-12 to 1e\+09 s\)"):
            ga.Record(dt, torque=np.ones(N), velocity=np.zeros(N))
    with pytest.raises(ga.GaidentError, match="show no motion in common"):
        ga.align(REC, {"velocity": REC.velocity}, dt=1e3)
    slow = ga.first_experiment(1e-3, ga.Limits(80.0, 2.4), inertia=1e12, kp=0.02)
    assert len(slow.command) < 50_000 and np.abs(slow.command).max() < 80.0  # ramps of an axis that no torque moves


def test_models_at_the_ends_of_what_may_be_are_simulated_in_numbers() -> None:
    """A gain of 1e300 with roots of 1e200 and 1e250 was NaN without a word, and its axis had no inertia."""
    for model in (ga.Model(1e15, [-1.0, -1e15]), ga.Model(1e-90, [-1e15], []), ga.Model(1.0, [-1e15, -1.0], [-1e15])):
        assert np.all(np.isfinite(ga.simulate(model, REC))) and np.all(np.isfinite(model.discrete(1e-3).beta))
        assert ga.joint_parameters(model).inertia > 0.0 if model.p == 1 else model.to_control() is not None
    unstable = ga.Model(1.0, [1e15])
    for sampled in (unstable.discrete, unstable.to_scipy, unstable.to_control):
        with pytest.raises(ga.GaidentError, match=r"dt is 0\.001: within one such step .* grows beyond all numbers"):
            sampled(1e-3)
    assert ga.Model(1.0, 2 * [-1e-200]).static_gain == np.inf and ga.Model(1.0, [-1e-200, -1e-200, 1e-200]).static_gain == -np.inf
    assert ga.TwoMass(1e-4, 0.1, 1e-4, 0.1, 2.0).model().static_gain > 0.0
    with pytest.raises(ga.GaidentError, match=r"dt is 1e-12: the delay of 1 s has .* states at it"):
        ONE.with_effect("transport_delay", delay=1.0).to_scipy(1e-12)


@pytest.mark.parametrize("period", [4e-10, 1e-5])
def test_a_delay_of_many_periods_makes_no_one_equation(period: float) -> None:
    """More than 2^31 of them were none; 100 000 took minutes."""
    cascade = ga.Cascade(PI, period=period, delay=1.0)
    began = time.perf_counter()
    assert not core.is_one_equation(period, cascade, poles=1)
    assert time.perf_counter() - began < 1.0
