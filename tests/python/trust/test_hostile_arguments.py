"""Every argument of the public functions with values of another kind: one error of one line, no warning, no other end."""

from __future__ import annotations

import inspect
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
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

HOSTILE: list[Any] = [
    *(None, True, 3, -1, 0, 1.5, 1e300, -1e300, 1e-300, float("nan"), float("inf"), 10**400, -(10**400), 2**63, 1j),
    *("x", "", b"x", "a\0b", object(), int, Ellipsis, lambda *_: None, range(3)),
    *([], [1], [1, 2, 3], (), {}, {"a": 1}),
    *(np.zeros(0), np.zeros((2, 2)), np.array(["a"]), np.float64(1e308), np.full(N, np.nan), np.full(N, 1e200)),
]

BAND = np.geomspace(1.0, 100.0, 20)
SIZE = ga.effects.Parameter("size", "1", neutral=0.0, lowest=0.0, highest=1.0)
NAMED = {"time": "t", "command": "w_ref", "velocity": "w", "torque": "M"}

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
    "frequency_response of a record": (ga.frequency_response, {"rec": REC, "controller": PI}),
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
    "inverse_dynamics": (ga.inverse_dynamics, {"rec": REC}),
    "force_error": (ga.force_error, {"model": ONE, "records": REC}),
    "Winding": (ga.Winding, {"resistance": 1.0, "torque_constant": 0.1}),
    "estimate_winding": (
        ga.estimate_winding,
        {"voltage": COMMAND, "current": REC.torque, "velocity": REC.velocity, "dt": 1e-3, "cutoff_hz": 50.0},
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
    "load": (ga.load, {"path": "none.json"}),
    "report": (ga.report, {"result": DIA, "path": "page.html"}),
}
# Where a function is taken, that one may raise what it likes.
TAKEN = {("diagnose", "progress"), ("identify", "progress"), ("force_error", "model")}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    rows = np.column_stack([REC.time, COMMAND, REC.velocity, np.asarray(REC.torque)])
    np.savetxt("log.csv", rows, delimiter=",", header="t,w_ref,w,M", comments="")
    g = ONE.frequency_response(2.0 * np.pi * BAND)
    header = "frequency [Hz],real,imaginary"
    np.savetxt("bode.csv", np.column_stack([BAND, g.real, g.imag]), delimiter=",", header=header, comments="")
    assert len(ga.read_response("bode.csv")) == len(BAND)
    return tmp_path


@pytest.mark.parametrize("name", CALLS)
def test_a_wrong_argument_is_one_error_that_is_ours(name: str, here: Path) -> None:
    function, given = CALLS[name]
    kinds = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    names = dict.fromkeys([*given, *(p.name for p in inspect.signature(function).parameters.values() if p.kind not in kinds)])
    wrong = []
    for argument in names:
        for value in HOSTILE:
            if callable(value) and (name, argument) in TAKEN:
                continue
            began = time.perf_counter()
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    function(**{**given, argument: value})
            except (ga.GaidentError, OSError) as error:
                if "\n" in str(error).strip():
                    wrong.append(f"{argument}={value!r:.40}: more than one line: {error!r:.200}")
            except Exception as error:
                wrong.append(f"{argument}={value!r:.40}: {error!r:.200}")
            if time.perf_counter() - began > 10.0:
                wrong.append(f"{argument}={value!r:.40}: {time.perf_counter() - began:.1f} s")
    for own in tuple(OWN):
        ga.effects.unregister(own)
    assert not wrong, "\n".join(wrong)


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
