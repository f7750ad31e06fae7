"""Effects: accuracy against an independent integrator, registry and model side, simulate_many; see docs/effects.md."""

from __future__ import annotations

import _thread
import copy
import json
import pickle
import signal
import threading
import time
from typing import Any

import numpy as np
import pytest

import gaident as ga
from clock import fastest
from effect_sizes import SIZES
from fine_integrator import Array, FineCase, FineRun, integrate
from gaident import _core
from gaident.cli import main
from gaident.models import FactorCounts, factor_parameters, initial_state, simulate_values

# Typical sizes of each effect on a small servo drive.
TWO_MASSES = ("backlash", "hardening_stiffness", "hysteretic_coupling")
BESIDE = {"load_dependent_friction": ("unbalance", "load_torque")}  # in the same run: alone it is Coulomb friction
CONTROLLER_ONLY = ("integrator_clamp", "command_rate_limit")
ONE = ga.OneMass(5e-4, 0.005)
TWO = ga.TwoMass(1.02e-4, 0.003, 5.815e-4, 0.008, 2.59, 0.002)
SAMPLES = 200


def staircase(n: int = SAMPLES) -> Array:
    """Ten levels with reversals, fast and slow [rad/s]."""
    return np.repeat([3.0, -5.0, 20.0, 1.0, -40.0, 10.0, 0.0, -2.0, 60.0, -60.0], n // 10)


def pulses(n: int = SAMPLES) -> Array:
    """Torques that reverse, kick, and leave the drive alone at the end [N m]."""
    k = np.arange(n)
    slow = 0.12 * np.sign(np.sin(2 * np.pi * 3.3 * k / n)) * (1.0 + 0.8 * np.sin(2 * np.pi * 1.7 * k / n))
    return np.where(k > 0.93 * n, 0.0, slow + 0.6 * (k % 90 < 6))


def record(dt: float, loop: str, position: Array | None = None, velocity: Array | None = None, n: int = SAMPLES) -> ga.Record:
    measured = np.zeros(n) if velocity is None else velocity
    if loop == "open":
        return ga.Record(dt, torque=pulses(n), velocity=measured, position=position)
    return ga.Record(dt, command=staircase(n), velocity=measured, position=position)


def controller_of(loop: str, two: bool) -> ga.PI | None:
    if loop == "open":
        return None
    return ga.PI(0.08, 1.5, loop=loop) if two else ga.PI(0.1, 2.0, loop=loop)


def suits(name: str | None, two: bool, loop: str) -> bool:
    return not (name in TWO_MASSES and not two) and not (name in CONTROLLER_ONLY and loop == "open")


Key = tuple[float, bool, str, str | None]


def integrated(cases: list[FineCase], fine: int) -> FineRun:
    try:
        return integrate(cases, fine)
    except RuntimeError as missing:
        pytest.skip(str(missing))


@pytest.fixture(scope="module")
def reference() -> dict[Key, tuple[Array, Array, Array]]:
    """(velocity, torque, angle) of the fine integrator for every effect, drive, sample time and loop."""
    cases, keys = [], []
    for dt in (0.444e-3, 1e-3):
        for two in (False, True):
            for loop in ("open", "sampled", "continuous"):
                for name in (None, *SIZES):
                    if not suits(name, two, loop):
                        continue
                    ctl = controller_of(loop, two)
                    gains = {} if ctl is None else {"kp": ctl.kp, "ki": ctl.ki}
                    drive: dict[str, Any] = {"motor": (ONE.J, ONE.D)}
                    if two:
                        drive = {"motor": (TWO.JM, TWO.DM), "load": (TWO.JL, TWO.DL), "shaft": (TWO.KG, TWO.DG)}
                    source = pulses() if loop == "open" else staircase()
                    effects = {} if name is None else {other: SIZES[other] for other in (name, *BESIDE.get(name, ()))}
                    cases.append(FineCase(dt, loop, source, **drive, **gains, effects=effects))
                    keys.append((dt, two, loop, name))
    out = integrated(cases, fine=100)
    return {key: (out.velocity[:, i], out.torque[:, i], out.angle[:, i]) for i, key in enumerate(keys)}


def rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


@pytest.mark.parametrize("name", [n for n in SIZES if n != "velocity_quantisation"])
@pytest.mark.parametrize("loop", ["open", "sampled", "continuous"])
def test_effect_agrees_with_the_fine_integrator(reference: dict[Key, tuple[Array, Array, Array]], name: str, loop: str) -> None:
    if loop == "continuous" and name == "extra_resonance":
        pytest.skip("linear: part of the bilinear transformation, see test_extra_resonance_is_the_linear_model")
    for dt in (0.444e-3, 1e-3):
        for two in (False, True):
            if not suits(name, two, loop):
                continue
            model = (TWO if two else ONE).model()
            truth, _, angle = reference[dt, two, loop, name]
            plain = reference[dt, two, loop, None][0]
            # In open loop the angle is the record's, elsewhere the simulation's own.
            rec = record(dt, loop, angle if loop == "open" else None, truth)
            ctl = controller_of(loop, two)
            with_all = model.with_effect(name, **SIZES[name])
            for other in BESIDE.get(name, ()):
                with_all = with_all.with_effect(other, **SIZES[other])
            ours = ga.simulate(with_all, rec, ctl)
            # With minus without on both sides: what the reference's own steps do to the linear drive is no matter of the effect.
            deviation = (ours - ga.simulate(model, rec, ctl)) - (truth - plain)
            size = rms(truth - plain)
            assert size > 0.02
            assert rms(deviation) < 0.01 * size, f"{name}, dt {dt}, two masses {two}: {rms(deviation) / size:.4f}"


@pytest.mark.parametrize("loop", ["open", "sampled"])
def test_torque_and_angle_agree_too(reference: dict[Key, tuple[Array, Array, Array]], loop: str) -> None:
    for name in ("stribeck_friction", "torque_saturation", "velocity_filter", "velocity_ripple"):
        _, torque, angle = reference[1e-3, False, loop, name]
        result = ga.run(ONE.model().with_effect(name, **SIZES[name]), record(1e-3, loop), controller_of(loop, False))
        assert rms(result.torque - torque) < 1e-3 * rms(torque) + 1e-15
        assert rms(result.position - angle) < 1e-3 * rms(angle)


def test_quantisation_rounds_what_the_sensor_shows(reference: dict[Key, tuple[Array, Array, Array]]) -> None:
    step = SIZES["velocity_quantisation"]["step"]
    for two in (False, True):
        model = (TWO if two else ONE).model()
        for loop in ("open", "continuous"):
            rec, ctl = record(1e-3, loop), controller_of(loop, two)
            quantised = ga.simulate(model.with_effect("velocity_quantisation", step=step), rec, ctl)
            assert rms(quantised - ga.simulate(model, rec, ctl)) < 3.0 * step
            if loop == "open":
                expected = np.round(ga.simulate(model, rec, ctl) / step) * step
                assert np.mean(np.abs(quantised - expected) > 1e-9) < 0.01
    truth, plain = (reference[1e-3, False, "sampled", n][0] for n in ("velocity_quantisation", None))
    ours = ga.simulate(
        ONE.model().with_effect("velocity_quantisation", step=step), record(1e-3, "sampled"), controller_of("sampled", False)
    )
    # Until a velocity falls on a border between two steps the runs are the same.
    same = np.abs(ours - truth) < 1e-9
    assert np.mean(same) > 0.9
    assert rms(truth - plain) > 0.05


def test_the_fine_integrator_itself_converges() -> None:
    effects = [{}, *({name: SIZES[name]} for name in ("stribeck_friction", "presliding_friction", "backlash", "torque_lag"))]
    cases = [
        FineCase(1e-3, "sampled", staircase(40), (TWO.JM, TWO.DM), (TWO.JL, TWO.DL), (TWO.KG, TWO.DG), 0.08, 1.5, e)
        for e in effects
    ]
    coarse, fine = (integrated(cases, n).velocity for n in (100, 300))
    for i in range(1, len(cases)):
        size = rms(fine[:, i] - fine[:, 0])
        assert rms((coarse - fine)[:, i] - (coarse - fine)[:, 0]) < 0.006 * size, cases[i].effects


@pytest.mark.parametrize("loop", ["open", "sampled", "continuous"])
def test_extra_resonance_is_the_linear_model(loop: str) -> None:
    model = TWO.model().with_effect("extra_resonance", **SIZES["extra_resonance"])
    rec, ctl = record(1e-3, loop), controller_of(loop, True)
    assert model.linear.q == 4
    assert model.linear.static_gain == pytest.approx(TWO.model().static_gain, rel=1e-12)
    np.testing.assert_allclose(ga.simulate(model, rec, ctl), ga.simulate(model.linear, rec, ctl), rtol=0, atol=1e-9)


@pytest.mark.parametrize("loop", ["open", "sampled", "continuous"])
def test_many_equal_one_by_one(loop: str) -> None:
    rng = np.random.default_rng(5)
    models: list[ga.Model] = []
    for i, (name, parameters) in enumerate([*SIZES.items(), *SIZES.items()]):
        base = ga.TwoMass(TWO.JM * (1 + 0.01 * i), TWO.DM, TWO.JL, TWO.DL, TWO.KG, TWO.DG).model()
        models.append(base.with_effect(name, **{k: v * (1.0 + 0.01 * rng.random()) for k, v in parameters.items()}))
        models.append(base)
    models.append(ONE.model())
    rec, ctl = record(1e-3, loop, n=100), controller_of(loop, True)
    many = ga.simulate_many(models, rec, ctl)
    assert many.shape == (len(models), len(rec))
    for row, model in zip(many, models, strict=True):
        assert np.array_equal(row, ga.simulate(model, rec, ctl), equal_nan=True)
    assert np.array_equal(many, ga.simulate_many(models, rec, ctl, workers=2), equal_nan=True)
    assert ga.simulate_many([], rec, ctl).shape == (0, len(rec))


def test_ctrl_c_ends_many_simulations() -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    rec, model = record(1e-3, "open", n=5000), ONE.model().with_effect("coulomb_friction", torque=0.02)

    def seconds() -> float:
        began = time.perf_counter()
        threading.Timer(0.1, _thread.interrupt_main).start()
        with pytest.raises(KeyboardInterrupt):
            ga.simulate_many([model] * 2000, rec, substeps=64)  # more than a second, if they were let
        return time.perf_counter() - began

    assert fastest(seconds, below=0.4) < 0.4
    assert ga.simulate_many([model], rec).shape == (1, 5000)


@pytest.mark.parametrize("loop", ["open", "sampled", "continuous"])
def test_starts_in_motion(loop: str) -> None:
    model, rec, ctl = TWO.model(), record(1e-3, loop), controller_of(loop, True)
    moving = ga.Record(1e-3, command=rec.command, torque=rec.torque, velocity=ga.simulate(model, rec, ctl) + 5.0)
    state = initial_state(model, moving, ctl)
    slight = model.with_effect("load_torque", torque=1e-13)
    np.testing.assert_allclose(ga.simulate(slight, rec, ctl, state), ga.simulate(model, rec, ctl, state), atol=1e-8)
    friction = model.with_effect("coulomb_friction", torque=0.05)
    assert np.array_equal(initial_state(friction, moving, ctl), state)
    states = np.stack([state, 2.0 * state])
    many = ga.simulate_many([friction, friction], rec, ctl, initial_states=states)
    for row, start in zip(many, states, strict=True):
        assert np.array_equal(row, ga.simulate(friction, rec, ctl, start))
    with pytest.raises(ga.GaidentError, match="initial_states has the shape"):
        ga.simulate_many([friction], rec, ctl, initial_states=states)
    with pytest.raises(ga.GaidentError, match="states"):
        ga.simulate_many([friction], rec, ctl, initial_states=states[:1, :2])


def test_simulate_values_are_the_models() -> None:
    rec, ctl = record(1e-3, "sampled"), controller_of("sampled", True)
    models = [
        ga.TwoMass(TWO.JM, TWO.DM, TWO.JL, TWO.DL, TWO.KG * f, TWO.DG)
        .model()
        .with_effect("cogging", **SIZES["cogging"])
        .with_effect("coulomb_friction", torque=0.05 * f)
        for f in (1.0, 1.1, 1.2)
    ]
    assert [e.name for e in models[0].effects] == ["coulomb_friction", "cogging"]
    values = [[*factor_parameters(m)[1], *(v for e in m.effects for v in e.values)] for m in models]
    structure = FactorCounts.of(models[0])
    found = simulate_values(structure, ["coulomb_friction", "cogging"], values, rec, ctl)
    np.testing.assert_allclose(found, ga.simulate_many(models, rec, ctl), rtol=0, atol=1e-8)
    with pytest.raises(ga.GaidentError, match="rows of"):
        simulate_values(structure, ["cogging"], values, rec, ctl)
    with pytest.raises(ga.GaidentError, match="no effect"):
        simulate_values(structure, ["coulomb", "cogging"], values, rec, ctl)


def test_substeps_can_be_given() -> None:
    model = TWO.model().with_effect("coulomb_friction", torque=0.05)
    rec, ctl = record(1e-3, "sampled"), controller_of("sampled", True)
    fine, own = ga.simulate(model, rec, ctl, substeps=64), ga.simulate(model, rec, ctl)
    assert 0.0 < rms(fine - own) < 0.01
    assert np.array_equal(ga.simulate_many([model], rec, ctl, substeps=64)[0], fine)
    for wrong in (0, 65, 2.0, True):
        with pytest.raises(ga.GaidentError, match="substeps is"):
            ga.simulate(model, rec, ctl, substeps=wrong)  # type: ignore[arg-type]


def test_run_gives_the_true_angle_and_the_issued_torque() -> None:
    rec = record(1e-3, "sampled", position=np.full(SAMPLES, 2.0))
    ctl = controller_of("sampled", False)
    run = ga.run(ONE.model().with_effect("torque_saturation", limit=0.1), rec, ctl)
    assert run.position[0] == 2.0
    assert np.max(np.abs(run.torque)) > 0.5  # before saturation
    stuck = ga.run(ONE.model().with_effect("velocity_filter", time_constant=0.05), rec, ctl)
    assert not np.allclose(np.gradient(stuck.position, 1e-3), stuck.velocity, atol=1.0)


# The model side


def test_table_is_the_documented_one() -> None:
    table = ga.effects.table()
    assert [row.name for row in table] == [*SIZES, "outliers"]
    assert {row.name: tuple(p.name for p in row.parameters) for row in table if row.simulated} == {
        n: tuple(p) for n, p in SIZES.items()
    }
    places = {row.name: row.place for row in table}
    assert places["backlash"] == "coupling" and places["torque_lag"] == "actuator" and places["velocity_ripple"] == "sensor"
    text = str(table).splitlines()
    assert len(text) == len(table) + 1
    assert all(p.unit and p.name in line for row, line in zip(table, text[1:], strict=True) for p in row.parameters)
    assert len(_core.effect_table()) == len(table)


def test_command_line_prints_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects"]) == 0
    assert capsys.readouterr().out == f"{ga.effects.table()}\n"
    assert main(["effects", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in data["effects"]] == [*SIZES, "outliers"]
    assert data["effects"][0]["parameters"][0] == {
        "name": "torque",
        "unit": "N m",
        "neutral": 0.0,
        "lowest": 0.0,
        "highest": None,
    }


def test_with_and_without_effect() -> None:
    base = ONE.model()
    model = base.with_effect("cogging", **SIZES["cogging"]).with_effect("coulomb_friction", torque=0.05)
    assert model != base and model.linear == base and hash(model) != hash(base)
    assert model == base.with_effect("coulomb_friction", torque=0.05).with_effect("cogging", **SIZES["cogging"])
    assert model.with_effect("coulomb_friction", torque=0.1).effects[0].parameters["torque"] == 0.1
    assert model.without_effect("cogging").without_effect("coulomb_friction") == base
    assert "coulomb_friction" in repr(model)
    assert (model.gain, model.poles) == (base.gain, base.poles)
    with pytest.raises(TypeError):
        model.effects[0].parameters["torque"] = 1.0  # type: ignore[index]


def test_models_with_effects_survive_json_pickle_and_copy() -> None:
    model = TWO.model()
    for name, parameters in SIZES.items():
        if name != "extra_resonance":
            model = model.with_effect(name, **parameters)
    model = model.with_effect("torque_saturation", limit=np.inf)
    ga.simulate(model, record(1e-3, "sampled"), controller_of("sampled", True))
    again = ga.Model.from_dict(json.loads(json.dumps(model.to_dict(), allow_nan=False)))
    assert again == model
    assert pickle.loads(pickle.dumps(model)) == model == copy.deepcopy(model)
    assert "effects" not in TWO.model().to_dict()


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("colomb_friction", {"torque": 1.0}, "did you mean 'coulomb_friction'"),
        ("coulomb_friction", {}, "lacks torque"),
        ("coulomb_friction", {"torque": 1.0, "tork": 2.0}, "has the key 'tork'"),
        ("coulomb_friction", {"torque": -0.1}, "torque of coulomb_friction is -0.1: give a number >= 0 in N m"),
        ("coulomb_friction", {"torque": float("nan")}, "torque of coulomb_friction is nan"),
        ("coulomb_friction", {"torque": float("inf")}, "torque of coulomb_friction is inf"),
        ("coulomb_friction", {"torque": "0.1"}, "torque of coulomb_friction is '0.1'"),
        (
            "stribeck_friction",
            {"torque": 0.2, "static_torque": 0.1, "stribeck_velocity": 1.0},
            "static_torque must be at least torque",
        ),
        ("stribeck_friction", {"torque": 0.1, "static_torque": 0.2, "stribeck_velocity": 0.0}, "> 0 in rad/s"),
        ("cogging", {"amplitude": 0.1, "order": 1.0, "phase": 0.0}, "order of cogging is 1: give a number >= 2"),
        ("transport_delay", {"delay": 2.0}, ">= 0 and <= 1 in s"),
        ("outliers", {"fraction": 0.1}, "mask such samples"),
        ("backlash", {"gap": 0.01}, "p = 1 and q = 2"),
    ],
)
def test_refusals_name_the_remedy(name: str, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ga.GaidentError) as caught:
        ONE.model().with_effect(name, **parameters)
    assert message in str(caught.value)


def test_what_a_model_with_effects_cannot_do() -> None:
    model = TWO.model().with_effect("coulomb_friction", torque=0.05)
    for call in (model.to_scipy, model.to_control, lambda: model.discrete(1e-3), lambda: model.frequency_response([1.0])):
        with pytest.raises(ga.GaidentError, match=r"use model\.linear"):
            call()
    assert model.linear.to_scipy() is not None
    with pytest.raises(ga.GaidentError, match="p = 0"):
        ga.Model(1.0, [-1.0], [-2.0]).with_effect("load_torque", torque=0.1)
    with pytest.raises(ga.GaidentError, match="without_effect"):
        TWO.model().with_effect("backlash", gap=0.01).with_effect("extra_resonance", **SIZES["extra_resonance"])
    with pytest.raises(ga.GaidentError, match="has no effect 'cogging'"):
        model.without_effect("cogging")
    with pytest.raises(ga.GaidentError, match='in "double" only'):
        ga.simulate(model, record(1e-3, "sampled"), controller_of("sampled", True), arithmetic="float")


def test_neutral_parameters_are_the_identity() -> None:
    rec, ctl = record(1e-3, "sampled"), controller_of("sampled", True)
    plain = ga.simulate(TWO.model(), rec, ctl)
    for row in ga.effects.table():
        if not row.simulated:
            continue
        parameters = {p.name: SIZES[row.name][p.name] if np.isnan(p.neutral) else p.neutral for p in row.parameters}
        if row.name == "extra_resonance":
            parameters["zero_frequency"] = parameters["frequency"]
        model = TWO.model().with_effect(row.name, **parameters)
        assert np.array_equal(ga.simulate(model, rec, ctl), plain), row.name


def test_a_changing_inertia_keeps_its_energy() -> None:
    """Without torque and damping J(theta) w^2/2 stays what it is, through many turns."""
    J, a, n = 5e-4, 0.6, 2.0
    still = ga.Record(1e-3, torque=np.zeros(2000), velocity=np.full(2000, 30.0))
    model = ga.OneMass(J, 1e-12).model().with_effect("position_inertia", amplitude=a, order=n, phase=0.3)
    done = ga.run(model, still, initial_state=initial_state(ga.OneMass(J, 1e-12).model(), still), substeps=16)
    energy = 0.5 * J * (1.0 + a * np.cos(n * done.position + 0.3)) * done.velocity**2
    assert done.velocity.max() > 1.5 * done.velocity.min() > 0.0
    assert np.ptp(energy) < 2e-3 * energy.mean()


def test_a_difference_is_the_mean_over_its_samples() -> None:
    rec = record(1e-3, "open")
    run = ga.run(ONE.model(), rec)
    seen = ga.simulate(ONE.model().with_effect("velocity_difference", samples=3.0), rec)
    np.testing.assert_allclose(seen[3:], (run.position[3:] - run.position[:-3]) / 3e-3, rtol=0, atol=2e-3 * rms(run.velocity))
    with pytest.raises(ga.GaidentError, match="samples must be 1 or more"):
        ONE.model().with_effect("velocity_difference", samples=0.5)
