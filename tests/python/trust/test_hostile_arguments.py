"""Every argument of the public functions with values of another kind: one error of one line, no warning, no other end."""

from __future__ import annotations

import inspect
import time
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hostile_calls import CALLS, NAMED, ONE, PI, REC, SECONDS, TAKEN, N, arguments_of

import gaident as ga
from gaident.control import core
from gaident.models.own_effects import OWN

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


@pytest.mark.long
@pytest.mark.parametrize("name", CALLS)
def test_a_wrong_argument_is_one_error_that_is_ours(name: str, files: Path) -> None:
    function, given = CALLS[name]
    function(**given)  # else the row would say nothing of its arguments
    wrong = []
    for argument in arguments_of(name):
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
            if time.process_time() - began > SECONDS:
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
def test_what_would_be_nonsense_is_refused_by_name(name: str, changed: dict[str, Any], message: str, files: Path) -> None:
    function, given = CALLS[name]
    with pytest.raises(ga.GaidentError, match=message):
        function(**{**given, **changed})


SECOND, TOO_LARGE, PART = np.timedelta64(1, "s"), np.longdouble("1e4000"), np.complex64(1j)
FILTERS = {**ga.Cascade(PI).to_dict(), "velocity_filters": "x"}
NO_POLES = SimpleNamespace(gain=1.0, poles=None, zeros=[], p=1)
NO_FRAME = SimpleNamespace(columns=None, index=None, iloc=None)
NO_FUTURES = SimpleNamespace(submit=lambda *_: None, shutdown=lambda: None)


@pytest.mark.parametrize(
    ("name", "changed", "message"),
    [
        ("LowPass", {"time_constant": PART}, "time_constant is .*1j"),
        ("frequency_response", {"omega": PART}, "omega is .*: give frequencies in rad/s"),
        ("tables.torque", {"acceleration": TOO_LARGE}, "acceleration has inf, which no drive reaches"),
        ("simulate_many", {"initial_states": TOO_LARGE}, "initial_states"),
        ("mechanics_from_model", {"covariance": TOO_LARGE}, r"covariance has the shape \(\)"),
        ("FrequencyResponse", {"coherence": np.array([TOO_LARGE])}, r"coherence\[0\] = inf: every value must be finite"),
        ("between", {"t0": SECOND}, "t0 is no number; give seconds"),
        ("m_sequence", {"hold": SECOND}, "hold is .*: give a whole number of samples"),
        ("inverse_dynamics", {"decimation": SECOND}, "decimation=.*: give a whole number of samples"),
        ("read_response", {"amplitude": SECOND}, "amplitude=.* is no number; give the torque's amplitude"),
        ("tables.to_c", {"path": 3, "name": "f"}, "path is 3: give the file's name"),
        ("idn.save", {"path": "\ud800"}, r"path is '.ud800': no file's name contains the character .*; correct it"),
        ("load", {"path": "\ud800"}, r"path is '.ud800': no file's name contains"),
        ("force_error", {"records": np.array(1.0)}, "records: give one Record or several"),
        ("SearchSpace", {"gain": (1.0, 10**400)}, "gain is .*: both ends must be numbers"),
        ("Cascade.from_dict", {"data": FILTERS}, "velocity_filters is 'x': give a list of the dictionaries that to_dict gave"),
        ("Cascade.from_dict", {"data": {**FILTERS, "velocity_filters": ["x"]}}, "a filter is 'x': give the dictionary"),
        ("estimate_winding", {"voltage": np.zeros(2000)}, "voltage, current and velocity do not determine it"),
        ("factor_parameters", {"model": NO_POLES}, "poles of model is None: give a gaident.Model"),
        ("differentiate", {"position": np.ma.masked_array(np.zeros(3, [("a", "f8")]), True)}, "position is structured"),
        ("read_axes one", {"own": {**NAMED, "a\x1cb\u2028c": 1.0}}, "unexpected keyword argument 'a b c'"),
        ("read_axes one", {"own": {**NAMED, "\x02a\x1f\x1f\x1f\x1f\x03": 1.0}}, "unexpected keyword argument 'a"),
        ("read_axes", {"path": NO_FRAME}, "give the file's name"),
        ("Cascade.from_dict", {"data": {**FILTERS, "velocity_filters": [], "position_gain": np.zeros(3)}}, "gain"),
        ("from_mechanics", {"resonance_hz": (1.0, 10**400)}, "resonance_hz is .*: give a pair of numbers"),
        ("from_mechanics", {"p": np.array(0.0)}, r"p is array\(0\.\): give a pair"),
        ("Model", {"zeros": TOO_LARGE}, r"zeros\[0\] is .*inf.*: every root must be finite"),
        ("Limits", {"speed": 1e-320}, "speed is .*: give one number > 0, 1e-30 to 1e"),
        ("Limits", {"speed": np.ma.masked}, "speed is masked: give one number > 0"),
        ("tables.torque", {"acceleration": np.array([PART], object)}, "acceleration is .*: give real numbers"),
        ("tables.torque", {"acceleration": np.array(["1.5"], object)}, "acceleration is .*: give real numbers"),
        ("tables.torque", {"acceleration": True}, "acceleration is True"),
        ("LowPass", {"time_constant": np.array(PART, object)}, "time_constant is .*1j"),
        ("SearchSpace", {"gain": np.array([1 + 2j, 3])}, "gain is .*: both ends must be numbers"),
        ("SearchSpace", {"gain": ["1", "3"]}, "gain is .*: both ends must be numbers"),
        ("diagnose", {"expected": {"inertia": "12"}}, "expected inertia is '12': give a mapping"),
        ("diagnose", {"expected": {"inertia": (0.1, PART)}}, "expected inertia is .*: give a mapping"),
        ("fleet by another", {"executor": NO_FUTURES}, "executor.submit gives None: give a concurrent.futures.Executor"),
    ],
)
def test_values_that_were_drawn_are_refused_by_name(name: str, changed: dict[str, Any], message: str, files: Path) -> None:
    """Each ended in an error of another kind, in a warning, or never."""
    function, given = CALLS[name]
    with pytest.raises(ga.GaidentError, match=message):
        function(**{**given, **changed})


@pytest.mark.parametrize(
    ("name", "corner", "message"),
    [
        ("force_error", 1e-320, r"cutoff_hz=1e-320: give a corner between 1e-09 and 500 Hz"),
        ("inverse_dynamics", 1e-320, r"cutoff_hz=1e-320: give a corner between 1e-09 and 500 Hz"),
        ("estimate_winding", 1e-320, r"cutoff_hz=1e-320: give a corner between 1e-09 and 500 Hz"),
        ("inverse_dynamics", 1e-6, r"cutoff_hz is 1e-06 Hz: more than 100000 samples become one row; give 0\.01 Hz or more"),
    ],
)
def test_a_corner_below_all_frequencies_is_refused(name: str, corner: float, message: str) -> None:
    """1/(1e-320 dt) is infinite, and no whole number of samples; 1e-6 Hz was named as another argument's fault."""
    function, given = CALLS[name]
    with pytest.raises(ga.GaidentError, match=message):
        function(**{**given, "cutoff_hz": corner})


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
