"""The public functions, each with arguments that it takes, and the files that these name."""

from __future__ import annotations

import inspect
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import gaident as ga
from gaident.models import FactorCounts

# How long a call may take; under a sanitizer GAIDENT_SLOWER says by how much the core is slower.
SECONDS = 10.0 * float(os.environ.get("GAIDENT_SLOWER", "1"))

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


def arguments_of(name: str) -> list[str]:
    """The names of the arguments that the function of a row takes, those in its row among them."""
    function, given = CALLS[name]
    kinds = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    return list(
        dict.fromkeys([*given, *(p.name for p in inspect.signature(function).parameters.values() if p.kind not in kinds)])
    )


def write_log() -> None:
    """Write log.csv of `REC` into the working folder."""
    rows = np.column_stack([REC.time, COMMAND, REC.velocity, np.asarray(REC.torque)])
    np.savetxt("log.csv", rows, delimiter=",", header="t,w_ref,w,M", comments="")


def write_files(fleet: Path) -> None:
    """Write what the rows of `CALLS` name into the working folder; fleet: a finished one, which is copied."""
    write_log()
    IDN.save("saved.json")
    shutil.copytree(fleet, "fleet")
    g = ONE.frequency_response(2.0 * np.pi * BAND)
    header = "frequency [Hz],real,imaginary"
    np.savetxt("bode.csv", np.column_stack([BAND, g.real, g.imag]), delimiter=",", header=header, comments="")
    assert len(ga.read_response("bode.csv")) == len(BAND)
