"""Effects of one's own: registered, simulated like the core's, found by a diagnosis, named in saved results."""

from __future__ import annotations

import json
import re
import runpy
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from effect_sizes import SIZES
from gaident.errors import ModelError
from gaident.models.factors import FactorCounts, factor_parameters
from gaident.models.own_effects import OWN, Parameter, starts
from gaident.models.simulate_many import simulate_values
from places import ROOT

effects = ga.effects
DT = 1e-3
N = 240
COMMAND = np.repeat([20.0, -40.0, 10.0, 60.0, -5.0, 0.0], N // 6)
TORQUE = 0.3 * np.sin(np.linspace(0.0, 25.0, N)) + 0.1
CONTROLLER = ga.PI(0.02, 0.6)
LOOPS: dict[str, ga.PI | None] = {"open": None, "sampled": CONTROLLER, "continuous": ga.PI(0.02, 0.6, loop="continuous")}
ONE = ga.OneMass(J=3e-4, D=0.004).model()
TWO = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59, DG=1e-3).model()


def parameter(name: str = "size", unit: str = "N m", **more: Any) -> effects.Parameter:
    return effects.Parameter(name, unit, **{"neutral": 0.0, "lowest": 0.0, "highest": 1.0, **more})


def spring(s: effects.Signals, stiffness: np.ndarray) -> np.ndarray:
    return -stiffness * s.angle


def registered_spring() -> None:
    effects.register("return_spring", [parameter("stiffness", "N m/rad")], meaning="a spring to the start angle", torque=spring)


@pytest.fixture(autouse=True)
def nothing_registered() -> Iterator[None]:
    yield
    for name in tuple(OWN):
        effects.unregister(name)


def record(controller: ga.PI | None) -> ga.Record:
    return ga.Record(DT, command=COMMAND, torque=TORQUE, velocity=np.zeros(N))


COUNTERPARTS: list[tuple[str, dict[str, float], str, Callable[..., Any]]] = [
    ("coulomb_friction", {"torque": 0.05}, "friction", lambda s, torque: torque),
    ("quadratic_drag", {"coefficient": 2e-5}, "torque", lambda s, coefficient: -coefficient * s.velocity * np.abs(s.velocity)),
    ("load_torque", {"torque": 0.03}, "torque", lambda s, torque: -torque),
    ("cogging", {"amplitude": 0.03, "order": 4.0, "phase": 0.5}, "torque",
     lambda s, amplitude, order, phase: -amplitude * np.sin(order * s.angle + phase)),
    ("torque_dead_band", {"width": 0.03}, "actuator", lambda s, width: s.torque - np.clip(s.torque, -width, width)),
    ("velocity_ripple", {"amplitude": 4e-3, "order": 8.0, "phase": 0.3}, "sensor",
     lambda s, amplitude, order, phase: s.velocity * (1.0 + amplitude * order * np.cos(order * s.angle + phase))),
    ("friction_drift", {"torque": 0.05, "rate": -2.0}, "friction",
     lambda s, torque, rate: np.maximum(torque * (1.0 + rate * s.time), 0.0)),
]  # fmt: skip


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize(("name", "values", "acts", "function"), COUNTERPARTS, ids=[t[0] for t in COUNTERPARTS])
def test_a_built_in_effect_written_again_is_the_same(
    loop: str, name: str, values: dict[str, float], acts: str, function: Callable[..., Any]
) -> None:
    row = next(r for r in effects.table() if r.name == name)
    given = [p._replace(lowest=-10.0 if p.name in ("rate", "phase") else 0.0, highest=10.0) for p in row.parameters]
    effects.register("mine", given, meaning="the same again", **{acts: function})
    rec, controller = record(LOOPS[loop]), LOOPS[loop]
    linear = ga.simulate(TWO, rec, controller)
    theirs = ga.run(TWO.with_effect(name, **values), rec, controller, substeps=8)
    mine = ga.run(TWO.with_effect("mine", **values), rec, controller, substeps=8)
    changed = np.abs(theirs.velocity - linear).max()
    # The velocity in the middle of the substep is solved for there, foreseen here: both of second order.
    tolerance = 5e-3 if name == "quadratic_drag" else 1e-9
    assert changed > 0.01
    np.testing.assert_allclose(mine.velocity, theirs.velocity, rtol=0.0, atol=tolerance * changed)
    np.testing.assert_allclose(mine.position, theirs.position, rtol=0.0, atol=tolerance * np.abs(theirs.position).max())


AT_LOAD = [row for row in COUNTERPARTS if row[2] in ("torque", "friction")]


@pytest.mark.parametrize("beside", ["", "stribeck_friction", "hysteretic_coupling"])
@pytest.mark.parametrize(("name", "values", "acts", "function"), AT_LOAD, ids=[t[0] for t in AT_LOAD])
def test_a_built_in_effect_at_the_load_written_again_is_the_same(
    beside: str, name: str, values: dict[str, float], acts: str, function: Callable[..., Any]
) -> None:
    row = next(r for r in effects.table() if r.name == name)
    given = [p._replace(lowest=-10.0 if p.name in ("rate", "phase") else 0.0, highest=10.0) for p in row.parameters]
    effects.register("mine", given, meaning="the same again", **{acts: function})
    drive = TWO.with_effect(beside, **SIZES[beside]) if beside else TWO
    for loop, controller in LOOPS.items():
        rec = record(controller)
        without = ga.simulate(drive, rec, controller, substeps=8 if beside else None)
        theirs = ga.run(drive.with_effect(name, side="load", **values), rec, controller, substeps=8)
        mine = ga.run(drive.with_effect("mine", side="load", **values), rec, controller, substeps=8)
        changed = np.abs(theirs.velocity - without).max()
        tolerance = 5e-3 if name == "quadratic_drag" else 1e-9
        assert changed > 0.01, loop
        np.testing.assert_allclose(mine.velocity, theirs.velocity, rtol=0.0, atol=tolerance * changed)
        np.testing.assert_allclose(mine.position, theirs.position, rtol=0.0, atol=tolerance * np.abs(theirs.position).max())


def test_effects_of_ones_own_at_both_ends_are_the_same_alone_side_by_side_and_as_numbers() -> None:
    effects.register("mine", [parameter("torque")], meaning="dry", friction=lambda s, torque: torque)
    rec = record(CONTROLLER)
    one = TWO.with_effect("mine", torque=0.02)
    models = [one, one.with_effect("mine", side="load", torque=0.05), TWO.with_effect("mine", side="load", torque=0.05), TWO]
    assert [[e.key for e in m.effects] for m in models] == [["mine"], ["mine", "mine@load"], ["mine@load"], []]
    rows = ga.simulate_many(models, rec, CONTROLLER)
    for found, model in zip(rows, models, strict=True):
        np.testing.assert_array_equal(found, ga.simulate(model, rec, CONTROLLER))
    dry = TWO.with_effect("coulomb_friction", torque=0.02).with_effect("coulomb_friction", side="load", torque=0.05)
    np.testing.assert_allclose(rows[1], ga.simulate(dry, rec, CONTROLLER), rtol=0.0, atol=1e-9)
    assert np.abs(rows[1] - rows[0]).max() > 0.1 and np.abs(rows[1] - rows[2]).max() > 0.1
    counts = FactorCounts.of(TWO)
    values = np.concatenate([factor_parameters(TWO)[1], [0.02], [0.05]])
    fast = simulate_values(counts, ["mine", "mine@load"], values[None, :], rec, CONTROLLER)
    np.testing.assert_allclose(fast[0], rows[1], rtol=0.0, atol=1e-9)
    stored = models[1].to_dict()
    assert [e.get("side") for e in stored["effects"]] == [None, "load"] and ga.Model.from_dict(stored) == models[1]
    with pytest.raises(ModelError, match="mine at the load needs two masses"):
        ONE.with_effect("mine", side="load", torque=0.05)


def test_an_effect_at_the_load_is_asked_with_the_loads_signals() -> None:
    seen: list[tuple[float, float]] = []

    def look(s: effects.Signals, size: np.ndarray) -> np.ndarray:
        seen.append((float(s.velocity[0]), float(s.angle[0])))
        return 0.0 * size

    effects.register("look", [parameter()], meaning="looks only", torque=look)
    step = np.full(N, 0.2)
    rec = ga.Record(DT, torque=step, velocity=np.zeros(N))
    ends = {}
    for side in ("motor", "load"):
        seen.clear()
        ga.run(TWO.with_effect("look", side=side, size=0.5), rec, substeps=4)
        ends[side] = np.array(seen).T
    # The load follows: J_L d^2 theta_L/dt^2 = K_G (theta_M - theta_L) + ..., at first it is behind by the twist.
    (w_motor, motor), (w_load, load) = ends["motor"], ends["load"]
    assert np.all(w_load[1:20] < w_motor[1:20]) and np.all(load[1:40] < motor[1:40])
    h = DT / 4.0
    np.testing.assert_allclose(
        np.diff(load)[1:], h * 0.5 * (w_load[1:] + w_load[:-1])[1:], rtol=0.0, atol=2e-3 * np.abs(w_load).max() * h
    )


@pytest.mark.long
def test_a_diagnosis_finds_it_at_the_load() -> None:
    def fan(s: effects.Signals, coefficient: np.ndarray) -> np.ndarray:
        return -coefficient * s.velocity * np.abs(s.velocity) * np.abs(s.velocity)

    effects.register("fan", [parameter("coefficient", "N m s^3/rad^3", highest=1e-5)], meaning="a fan", torque=fan)
    command = np.repeat(COMMAND[::40], 80)
    rec = ga.Record(DT, command=command, velocity=np.zeros(len(command)))
    run = ga.run(TWO.with_effect("fan", side="load", coefficient=2e-6), rec, CONTROLLER)
    noise = 0.02 * np.random.default_rng(1).standard_normal(len(command))
    dia = ga.diagnose(ga.Record(DT, torque=run.torque, velocity=run.velocity + noise))
    (finding,) = dia.causes
    assert finding.effect == "fan" and [e.key for e in dia.model.effects] == ["fan@load"]
    assert finding.parameters["coefficient"].value == pytest.approx(2e-6, rel=0.05)
    assert "fan at the load" in dia.summary()


def dead_zone(s: effects.Signals, width: np.ndarray) -> np.ndarray:
    return s.command - np.clip(s.command, -width, width)


def share_of(s: effects.Signals, share: np.ndarray) -> np.ndarray:
    return share * s.command


def registered_commands() -> None:
    width = parameter("width", "rad/s", highest=30.0)
    effects.register("dead_zone", [width], meaning="a dead zone of the command", command=dead_zone)
    share = parameter("share", "1", neutral=1.0, highest=2.0)
    effects.register("share", [share], meaning="a share of the command", command=share_of)


CLOSED = {
    **{name: loop for name, loop in LOOPS.items() if loop is not None},
    "cascade": ga.Cascade(CONTROLLER, 0.25 * DT, torque_filters=[ga.LowPass(1e-3)]),
    "limited": ga.PI(0.02, 0.6, torque_limit=0.4),
}


@pytest.mark.parametrize("name", CLOSED)
def test_a_command_is_as_the_record_with_the_command_changed_beforehand(name: str) -> None:
    registered_commands()
    assert next(row for row in effects.table() if row.name == "dead_zone").place == "controller"
    loop, rec = CLOSED[name], record(CONTROLLER)
    # In the continuous loop what effects change, simulated in substeps, is added to the linear response, which is not.
    exact = 1e-3 if name == "continuous" else 1e-11
    nothing = ONE.with_effect("coulomb_friction", torque=0.0)
    cases: list[tuple[str, dict[str, float], np.ndarray]] = [("share", {"share": 0.7}, 0.7 * COMMAND)]
    if name != "continuous":  # which draws the command as a line between the samples
        cases.append(("dead_zone", {"width": 8.0}, COMMAND - np.clip(COMMAND, -8.0, 8.0)))
    for effect, values, command in cases:
        found = ga.run(ONE.with_effect(effect, **values), rec, loop, substeps=4)
        expected = ga.run(nothing, rec.with_channels(command=command), loop, substeps=4)
        for signal in ("velocity", "torque"):
            changed, as_before = getattr(found, signal), getattr(expected, signal)
            np.testing.assert_allclose(changed, as_before, rtol=0.0, atol=exact * np.abs(as_before).max())
        assert np.abs(found.velocity - ga.simulate(ONE, rec, loop)).max() > 1.0
    if name != "continuous":
        moving = [14.0, 0.05]  # rad/s, N m
        found = ga.run(ONE.with_effect("share", share=0.7), rec, loop, moving, substeps=4)
        expected = ga.run(nothing, rec.with_channels(command=0.7 * COMMAND), loop, moving, substeps=4)
        np.testing.assert_allclose(found.velocity, expected.velocity, rtol=0.0, atol=exact * np.abs(expected.velocity).max())
    both = ONE.with_effect("share", share=0.7).with_effect("command_rate_limit", rate=2000.0)
    slow = ga.run(ONE.with_effect("command_rate_limit", rate=2000.0), rec.with_channels(command=0.7 * COMMAND), loop, substeps=4)
    found = ga.run(both, rec, loop, substeps=4)
    np.testing.assert_allclose(found.velocity, slow.velocity, rtol=0.0, atol=exact * np.abs(slow.velocity).max())


def test_a_command_acts_behind_a_position_controller_and_not_where_the_torque_drives_the_model() -> None:
    registered_commands()
    path = 0.4 * (1.0 - np.cos(np.linspace(0.0, 12.0, N)))
    rec = ga.Record(DT, position_command=path, velocity=np.zeros(N))
    given, softer = (ga.Cascade(CONTROLLER, position=ga.P(gain)) for gain in (40.0, 30.0))
    found = ga.run(ONE.with_effect("share", share=0.75), rec, given, substeps=4)
    expected = ga.run(ONE.with_effect("coulomb_friction", torque=0.0), rec, softer, substeps=4)
    np.testing.assert_allclose(found.velocity, expected.velocity, rtol=0.0, atol=1e-11 * np.abs(expected.velocity).max())
    assert np.abs(found.velocity - ga.simulate(ONE, rec, given)).max() > 0.05
    driven = record(None)
    for name, values in (("share", {"share": 0.5}), ("command_rate_limit", {"rate": 10.0})):
        alone = ga.simulate(ONE.with_effect("coulomb_friction", torque=0.0), driven, substeps=4)
        np.testing.assert_allclose(ga.simulate(ONE.with_effect(name, **values), driven, substeps=4), alone, rtol=0.0, atol=1e-9)


def test_a_command_sees_the_signals_of_its_sample() -> None:
    seen: list[tuple[float, float, float, float, float]] = []

    def look(s: effects.Signals, size: np.ndarray) -> np.ndarray:
        seen.append((s.time, float(s.command[0]), float(s.velocity[0]), float(s.angle[0]), float(s.torque[0])))
        return s.command + 0.0 * size

    effects.register("look", [parameter(unit="rad/s")], meaning="looks only", command=look)
    seen.clear()
    rec = record(CONTROLLER)
    run = ga.run(ONE.with_effect("look", size=0.5), rec, CONTROLLER, substeps=4)
    assert seen.pop(0) == (0.0, 0.0, 0.0, 0.0, 0.0)  # the command before the record
    time, command, velocity, angle, torque = np.array(seen).T
    np.testing.assert_allclose(time, rec.time, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(command, COMMAND)
    np.testing.assert_allclose(velocity, run.velocity, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(angle, run.position, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(torque, np.append(0.0, run.torque[:-1]), rtol=0.0, atol=1e-12)


@pytest.mark.long
def test_a_diagnosis_finds_a_command_where_no_torque_is_logged_and_says_where_it_does_not_look() -> None:
    registered_commands()
    command = COMMAND + 3.0 * np.sin(0.3 * np.arange(N))
    driven = ga.Record(DT, command=command, velocity=np.zeros(N))
    made = ga.run(ONE.with_effect("dead_zone", width=4.0), driven, CONTROLLER)
    velocity = made.velocity + 0.1 * np.random.default_rng(1).standard_normal(N)
    (finding,) = ga.diagnose(ga.Record(DT, command=command, velocity=velocity), CONTROLLER).causes
    width = finding.parameters["width"]
    assert (finding.effect, finding.place) == ("dead_zone", "controller")
    assert abs(width.value - 4.0) < 4.0 * width.std < 0.2
    logged = ga.Record(DT, command=command, velocity=velocity, torque=made.torque)
    assert "replay asks no function of your own" in str(ga.diagnose(logged, CONTROLLER).not_testable["dead_zone"])
    assert "no controller is simulated" in str(ga.diagnose(logged).not_testable["dead_zone"])
    plain = ga.run(ONE, driven, CONTROLLER)
    follows = ga.Record(DT, command=command, velocity=plain.velocity, torque=plain.torque)
    assert "follows from command and velocity without it" in str(ga.diagnose(follows, CONTROLLER).not_testable["dead_zone"])


def test_a_spring_is_the_exact_linear_system() -> None:
    registered_spring()
    k, J, D = 0.05, 3e-4, 0.004
    poles = np.roots([J, D, k])
    exact = ga.Model(1.0 / J, poles, [0.0])
    rec = record(None)
    for controller in (None, CONTROLLER):
        expected = ga.simulate(exact, rec, controller)
        found = ga.simulate(ONE.with_effect("return_spring", stiffness=k), rec, controller, substeps=16)
        change = np.abs(expected - ga.simulate(ONE, rec, controller)).max()
        assert change > 1.0
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-3 * change)


def test_many_at_once_are_as_each_alone() -> None:
    registered_spring()
    effects.register("mine", [parameter("share", "1")], meaning="gears", friction=lambda s, share: share * np.abs(s.torque))
    rec = record(CONTROLLER)
    models = [ONE.with_effect("return_spring", stiffness=k) for k in np.linspace(0.0, 0.1, 10)]
    models += [ONE, ONE.with_effect("coulomb_friction", torque=0.02), models[3].with_effect("mine", share=0.2)]
    rows = ga.simulate_many(models, rec, CONTROLLER, workers=2)
    for row, model in zip(rows, models, strict=True):
        np.testing.assert_array_equal(row, ga.simulate(model, rec, CONTROLLER))
    np.testing.assert_array_equal(rows[0], rows[10])  # neutral
    values = np.array([[m.gain, -m.poles[0].real, 0.02, 0.2, 0.05] for m in models[:3]])
    names = ["coulomb_friction", "mine", "return_spring"]
    fast = simulate_values(FactorCounts(1, 0, 0, 0), names, values, rec, CONTROLLER, substeps=4)
    model = (
        ONE.with_effect("coulomb_friction", torque=0.02)
        .with_effect("mine", share=0.2)
        .with_effect("return_spring", stiffness=0.05)
    )
    np.testing.assert_array_equal(fast[0], ga.simulate(model, rec, CONTROLLER, substeps=4))
    with pytest.raises(ModelError, match="4 columns: 5 are needed"):
        simulate_values(FactorCounts(1, 0, 0, 0), names, values[:, :4], rec, CONTROLLER)


@pytest.mark.long
def test_a_diagnosis_finds_it_and_saves_it_by_name(tmp_path: Path) -> None:
    example = runpy.run_path(str(ROOT / "examples" / "08_own_effect.py"))
    assert not OWN
    dia: ga.Diagnosis = example["dia"]
    (finding,) = dia.causes
    estimate = finding.parameters["share"]
    assert (dia.verdict, finding.effect, finding.named, estimate.unit) == ("explained", "gear_friction", True, "1")
    assert abs(estimate.value - 0.3) < 4.0 * estimate.std < 0.03
    assert finding.evidence.startswith("Dry friction in proportion to the torque transmitted: beyond doubt")

    assert "gear friction" in dia.summary() and "share" in dia.summary()
    path = tmp_path / "dia.json"
    dia.save(path)
    share = parameter("share", "1", highest=0.9)
    effects.register("gear_friction", [share], meaning="gears", friction=example["gear_friction"])
    dia.plot()
    assert ga.load(path) == dia
    (stored,) = json.loads(path.read_text())["model"]["effects"]
    assert stored["own"] is True
    effects.unregister("gear_friction")
    with pytest.raises(ga.GaidentError, match=r"dia\.json: 'gear_friction' is an effect of your own.*register"):
        ga.load(path)
    with pytest.raises(ModelError, match=r"'gear_friction' is an effect of your own that is not registered"):
        ga.simulate(dia.model, example["rec"], example["controller"])


def test_the_table_has_it_as_long_as_it_is_registered() -> None:
    before = effects.table()
    registered_spring()
    row = effects.table()[-1]
    assert effects.table()[:-1] == before
    assert (row.name, row.place, row.own, row.parameters[0].unit) == ("return_spring", "shaft", True, "N m/rad")
    assert "a spring to the start angle" in str(effects.table())
    with pytest.raises(ModelError, match="registered already"):
        registered_spring()
    effects.register("return_spring", [parameter("k", "1")], meaning="another", torque=lambda s, k: -k * s.angle, replace=True)
    assert effects.table()[-1].meaning == "another"
    effects.unregister("return_spring")
    assert effects.table() == before
    with pytest.raises(ModelError, match="no effect of your own"):
        effects.unregister("coulomb_friction")
    with pytest.raises(ModelError, match="the effect's name is 'return_spring'"):
        ONE.with_effect("return_spring", stiffness=0.1)


def test_bounds_are_kept_and_exports_refuse() -> None:
    registered_spring()
    with pytest.raises(ModelError, match="stiffness of return_spring"):
        ONE.with_effect("return_spring", stiffness=2.0)
    model = ONE.with_effect("return_spring", stiffness=0.1)
    for export in (lambda: model.to_c(None, DT), model.to_scipy):
        with pytest.raises(ModelError, match="return_spring"):
            export()


REFUSED: list[tuple[str, dict[str, Any]]] = [
    ("built-in", {"name": "cogging"}),
    ("name is 'my effect'", {"name": "my effect"}),
    ("exactly one of command, torque, friction, actuator, sensor", {"torque": None}),
    ("torque and sensor", {"sensor": spring}),
    ("give a function", {"torque": 3.0}),
    ("meaning of mine", {"meaning": ""}),
    ("no parameters", {"parameters": []}),
    ("neutral value", {"parameters": [parameter(neutral=float("nan"))]}),
    ("both finite", {"parameters": [parameter(highest=float("inf"))]}),
    ("lowest < highest", {"parameters": [parameter(lowest=2.0)]}),
    ("logarithmic with lowest 0", {"parameters": [parameter(logarithmic=True)]}),
    ("neutral of size of mine is -1", {"parameters": [parameter(neutral=-1.0)]}),
    ("starts of size of mine is 7", {"parameters": [parameter(starts=(7.0,))]}),
    ("two parameters 'size'", {"parameters": [parameter(), parameter()]}),
    ("unit of size", {"parameters": [parameter(unit="")]}),
    ("a parameter of mine is 'size'", {"parameters": ["size"]}),
    ("raised TypeError", {"torque": lambda s: s.velocity}),
    ("raised ValueError.*where()", {"torque": lambda s, size: size if s.velocity > 0 else -size}),
    ("the shape (3,)", {"torque": lambda s, size: np.zeros(3)}),
    ("gives 'x'", {"torque": lambda s, size: "x"}),
    ("answers otherwise for one drive", {"torque": lambda s, size: size * s.velocity.sum()}),
    ("raised ValueError.*read-only", {"torque": lambda s, size: np.multiply(s.velocity, size, out=s.velocity)}),
    ("finite everywhere", {"torque": lambda s, size: size / s.velocity}),
    ("is not 0 where its parameters are neutral", {"torque": lambda s, size: size + 1.0}),
    ("is not signals.command where", {"torque": None, "command": lambda s, size: size * s.command}),
    ("only a command= knows signals.command", {"torque": lambda s, size: size * s.command}),
    ("is not signals.torque where", {"torque": None, "actuator": lambda s, size: size * s.torque}),
    ("against the motion, >= 0", {"torque": None, "friction": lambda s, size: size * s.velocity}),
]  # fmt: skip


@pytest.mark.parametrize(("message", "change"), REFUSED, ids=[m for m, _ in REFUSED])
def test_what_is_refused(message: str, change: dict[str, Any]) -> None:
    good: dict[str, Any] = {
        "name": "mine", "parameters": [parameter()], "meaning": "a test", "torque": lambda s, size: -size * s.velocity
    }  # fmt: skip
    with pytest.raises(ModelError, match=re.escape(message).replace(r"\.\*", ".*")):
        effects.register(**{**good, **change})
    assert "mine" not in OWN
    effects.register(**good)


def test_a_function_that_fails_later_is_named() -> None:
    def fails(s: effects.Signals, size: np.ndarray) -> np.ndarray:
        if s.time > 0.28:
            raise RuntimeError("no more")
        return -size * s.velocity

    effects.register("mine", [parameter(unit="N m s/rad")], meaning="a test", torque=fails)
    rec = ga.Record(2.0 * DT, torque=TORQUE, velocity=np.zeros(N))
    with pytest.raises(ModelError, match="the effect 'mine': its function raised RuntimeError: no more"):
        ga.simulate(ONE.with_effect("mine", size=0.01), rec)


def test_a_search_begins_somewhere_other_than_at_nothing() -> None:
    even = Parameter("bias", "N m", neutral=0.0, lowest=-1.0, highest=1.0)
    for count in (1, 2, 3, 5):
        begun = starts(even, count)
        assert begun and 0.0 not in begun and all(-1.0 < v < 1.0 for v in begun)
