"""Cogging and ripple of several orders as one effect: how it is given and kept, and what it does."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_rig import Plant, run_drive, skip_without_library
from gaident.diagnosis.explain.wording import evidence_of
from gaident.errors import ModelError
from gaident.fleets.rows import rows_of
from gaident.models.effect_rows import by_wave
from gaident.results.json_text import on_axis

ONE = Plant(J=3e-4, D=2e-3, kp=0.03, ki=1.9, dt=1e-3)
TWO = Plant(J=2e-4, D=1e-3, JL=3e-4, DL=2e-3, KG=20.0, DG=1e-3, kp=0.03, ki=1.5, dt=0.5e-3)
MODELS = {
    "one mass": (ONE, ga.OneMass(J=ONE.J, D=ONE.D).model()),
    "two masses": (TWO, ga.TwoMass(JM=TWO.J, DM=TWO.D, JL=TWO.JL, DL=TWO.DL, KG=TWO.KG, DG=TWO.DG).model()),
}
COGGING = {"amplitude": [0.03, 0.02, 0.01, 0.008], "order": [4.0, 12.0, 6.0, 18.0], "phase": [0.3, 1.0, -2.0, 2.5]}
RIPPLE = {"amplitude": [5e-3, 3e-3, 2e-3], "order": [1.0, 4.0, 2.0], "phase": [0.2, -1.0, 2.0]}
COMMAND = np.repeat([0.0, 8.0, -12.0, 4.0, 30.0, -3.0], 150)


def first(count: int, lists: dict[str, list[float]]) -> dict[str, list[float]]:
    return {name: values[:count] for name, values in lists.items()}


def singly(lists: dict[str, list[float]]) -> dict[str, float]:
    """The same under a name for each number."""
    return {name if k == 0 else f"{name}_{k + 1}": v for name, values in lists.items() for k, v in enumerate(values)}


def estimated(effect: ga.Effect) -> dict[str, ga.Estimate]:
    """Its parameters as a diagnosis has them."""
    return {p.name: ga.Estimate(effect.parameters[p.name], 0.01, p.unit) for p in effect.row.parameters}


def velocity(plant: Plant, model: ga.Model) -> np.ndarray:
    still = np.zeros(len(COMMAND))
    return ga.simulate(model, ga.Record(plant.dt, command=COMMAND, velocity=still), plant.controller)


@pytest.mark.parametrize("masses", MODELS)
@pytest.mark.parametrize(
    ("effect", "side", "given"),
    [
        ("cogging", "motor", first(2, COGGING)),
        ("cogging", "motor", COGGING),
        ("cogging", "load", first(3, COGGING)),
        ("velocity_ripple", "motor", first(2, RIPPLE)),
        ("velocity_ripple", "motor", RIPPLE),
    ],
    ids=["cogging 2", "cogging 4", "cogging at the load 3", "ripple 2", "ripple 3"],
)
def test_the_simulation_is_that_of_an_independent_drive(
    masses: str, effect: str, side: str, given: dict[str, list[float]]
) -> None:
    skip_without_library()
    plant, linear = MODELS[masses]
    if side == "load" and not plant.two_masses:
        with pytest.raises(ModelError, match="needs two masses"):
            linear.with_effect(effect, side=side, **given)
        return
    model = linear.with_effect(effect, side=side, **given)
    (found,) = model.effects
    assert found.waves == len(given["order"]) and found.parameters == singly(given)
    key = effect if side == "motor" else f"{effect}@load"
    exact, plain = (run_drive(plant, COMMAND, e).velocity for e in ({key: singly(given)}, {}))
    # Of what the effect changes, as docs/effects.md says of one wave.
    changed = float(np.sqrt(np.mean((exact - plain) ** 2)))
    assert changed > 0.05
    assert float(np.sqrt(np.mean((velocity(plant, model) - exact) ** 2))) < 0.01 * changed
    # Each of its waves is there, and needed.
    for k in range(found.waves):
        fewer = {name: values[:k] + values[k + 1 :] for name, values in given.items()}
        without = linear.with_effect(effect, side=side, **fewer)
        assert float(np.sqrt(np.mean((velocity(plant, without) - exact) ** 2))) > 0.05 * changed


@pytest.mark.parametrize(("effect", "given"), [("cogging", COGGING), ("velocity_ripple", RIPPLE)])
def test_one_wave_is_what_it_was_and_a_wave_without_a_size_is_none(effect: str, given: dict[str, list[float]]) -> None:
    plant, linear = MODELS["one mass"]
    one = {name: values[0] for name, values in given.items()}
    model = linear.with_effect(effect, **one)
    assert model == linear.with_effect(effect, **first(1, given))
    assert model.effects[0].of_core() == (effect, tuple(one.values()))
    nothing = {**one, "amplitude_2": 0.0, "order_2": 30.0, "phase_2": 0.7}
    apart = velocity(plant, linear.with_effect(effect, **nothing)) - velocity(plant, model)
    assert float(np.abs(apart).max()) < 1e-9
    none = {name: [0.0, 0.0] if name == "amplitude" else values[:2] for name, values in given.items()}
    assert np.array_equal(velocity(plant, linear.with_effect(effect, **none)), velocity(plant, linear))


def test_many_models_side_by_side_are_each_alone() -> None:
    plant, linear = MODELS["one mass"]
    models = [linear.with_effect("cogging", **first(k, COGGING)) for k in (1, 2, 3, 4, 2, 1)]
    models += [linear.with_effect("velocity_ripple", **first(k, RIPPLE)) for k in (1, 2, 3)]
    rec = ga.Record(plant.dt, command=COMMAND, velocity=np.zeros(len(COMMAND)))
    rows = ga.simulate_many(models, rec, plant.controller)
    for row, model in zip(rows, models, strict=True):
        assert np.array_equal(row, ga.simulate(model, rec, plant.controller))


def test_lists_and_numbers_give_the_same_effect_and_it_is_kept_whole(tmp_path: Path) -> None:
    effect = ga.Effect("cogging", singly(first(2, COGGING)))
    assert effect == ga.Effect("cogging", first(2, COGGING))  # type: ignore[arg-type]
    assert [p.name for p in effect.row.parameters] == ["amplitude", "order", "phase", "amplitude_2", "order_2", "phase_2"]
    assert [p.unit for p in effect.row.parameters] == ["N m", "1/turn", "rad"] * 2
    assert effect.values == (0.03, 4.0, 0.3, 0.02, 12.0, 1.0)
    assert by_wave(effect.parameters) == (
        {"amplitude": 0.03, "order": 4.0, "phase": 0.3},
        {"amplitude": 0.02, "order": 12.0, "phase": 1.0},
    )
    assert ga.Effect.from_dict(effect.to_dict()) == effect == pickle.loads(pickle.dumps(effect))
    _, linear = MODELS["two masses"]
    model = linear.with_effect("cogging", **COGGING).with_effect("cogging", side="load", **first(2, COGGING))
    assert [e.waves for e in model.effects] == [4, 2]
    assert model.without_effect("cogging", side="load").effects == (ga.Effect("cogging", singly(COGGING)),)
    assert ga.Model.from_dict(model.to_dict()) == model


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"amplitude": [0.1, 0.2], "order": [4, 12], "phase": [0.0]}, "amplitude 2, order 2, phase 1"),
        ({"amplitude": [0.1, 0.2], "order": [4, 12], "phase": 0.0}, "amplitude 2, order 2, phase 0.0"),
        ({"amplitude": [0.1] * 5, "order": [2, 3, 4, 5, 6], "phase": [0.0] * 5}, "from 1 to 4"),
        ({"amplitude": [], "order": [], "phase": []}, "from 1 to 4"),
        ({"amplitude": 0.1, "order": 4, "phase": 0.0, "amplitude_2": 0.1}, "lacks order_2, phase_2"),
        ({"amplitude": 0.1, "order": 4, "phase": 0.0, "order_3": 5}, "lacks amplitude_2, order_2, phase_2, amplitude_3"),
        ({"amplitude": 0.1, "order": 4, "phase": 0.0, "order_5": 5}, "has the key 'order_5'"),
        ({"amplitude": [0.1, -0.2], "order": [4, 12], "phase": [0.0, 0.0]}, "amplitude_2 of cogging is -0.2"),
        ({"amplitude": [0.1, 0.2], "order": [4, 1], "phase": [0.0, 0.0]}, "order_2 of cogging is 1"),
        ({"amplitude": [0.1, 0.2], "order": [4, 4], "phase": [0.0, 1.0]}, "order_2 of cogging is 4, as order is"),
    ],
)
def test_wrong_waves_are_refused_with_name_and_remedy(given: dict[str, Any], said: str) -> None:
    with pytest.raises(ModelError, match=said):
        ga.OneMass(J=1e-3, D=0.0).model().with_effect("cogging", **given)


def test_an_effect_that_cannot_have_several_says_which_parameters_it_has() -> None:
    linear = ga.OneMass(J=1e-3, D=0.0).model()
    with pytest.raises(ModelError, match="amplitude_2"):
        linear.with_effect("unbalance", amplitude=0.1, phase=0.0, amplitude_2=0.1, phase_2=0.0)
    with pytest.raises(ModelError, match="give one finite number"):
        linear.with_effect("unbalance", amplitude=[0.1, 0.2], phase=[0.0, 1.0])
    several = {row.name for row in ga.effects.table() if row.waves > 1}
    assert several == {"cogging", "velocity_ripple"} and {row.waves for row in ga.effects.table()} == {1, 4}


def test_feedforward_tables_contain_every_wave(diagnosed_axis: ga.Diagnosis) -> None:
    model = MODELS["one mass"][1].with_effect("cogging", **first(3, COGGING))
    tables = ga.feedforward(replace(diagnosed_axis, model=model), speed=30.0)
    assert [wave.order for wave in tables.waves] == [4.0, 12.0, 6.0] and {wave.effect for wave in tables.waves} == {"cogging"}
    waves = list(zip(*first(3, COGGING).values(), strict=True))
    expected = sum(a * np.sin(n * tables.angle + phase) for a, n, phase in waves)
    assert np.allclose(tables.by_angle, expected, atol=1e-12)
    assert [np.hypot(w.sine, w.cosine) for w in tables.waves] == pytest.approx([0.03, 0.02, 0.01])
    assert float(tables.torque(0.0, 0.7)) == pytest.approx(sum(a * np.sin(n * 0.7 + phase) for a, n, phase in waves))


@pytest.fixture(scope="module")
def diagnosed_axis() -> ga.Diagnosis:
    plant, linear = MODELS["one mass"]
    noise = 0.05 * np.random.default_rng(1).standard_normal(len(COMMAND))
    run = ga.run(linear, ga.Record(plant.dt, command=COMMAND - noise, velocity=noise), plant.controller)
    return ga.diagnose(ga.Record(plant.dt, velocity=run.velocity + noise, torque=run.torque, command=COMMAND), plant.controller)


def test_on_a_linear_axis_each_order_counts_periods_to_a_metre_and_each_phase_stays_an_angle() -> None:
    effect = ga.Effect("cogging", singly(first(2, COGGING)))
    shown = on_axis({"effects": [effect.to_dict()]}, "linear")["effects"][0]
    assert shown["units"] == {
        **{"amplitude": "N", "order": "1/m", "phase": "rad"},
        **{"amplitude_2": "N", "order_2": "1/m", "phase_2": "rad"},
    }
    assert shown["parameters"]["order_2"] == pytest.approx(12.0 / (2.0 * np.pi)) and shown["parameters"]["phase_2"] == 1.0
    back = ga.Effect.from_dict(shown)
    assert back.parameters == pytest.approx(dict(effect.parameters))
    estimates = {
        name: ga.Estimate(v, 0.01, u.unit) for (name, v), u in zip(effect.parameters.items(), effect.row.parameters, strict=True)
    }
    said = evidence_of("cogging", 100.0, (), known=(estimates, np.array([30.0])))
    assert "n times per turn" in said and ", here n = 4 and 12: " in said
    assert "n times per metre" in said.linear and ", here n = 0.6366 and 1.91: " in said.linear
    one = {name: estimates[name] for name in ("amplitude", "order", "phase")}
    assert "here n" not in evidence_of("cogging", 100.0, (), known=(one, np.array([30.0])))


def test_a_fleet_has_a_course_of_each_order(diagnosed_axis: ga.Diagnosis) -> None:
    """Under the order of each wave, whichever is the strongest."""
    effect = ga.Effect("cogging", singly(first(2, COGGING)))
    estimates = {
        name: ga.Estimate(v, 0.01, u.unit) for (name, v), u in zip(effect.parameters.items(), effect.row.parameters, strict=True)
    }
    result = replace(diagnosed_axis, findings=(ga.Finding("cogging", estimates, place="shaft"),))
    _, rows = rows_of(result, result.records, "rotary", None)
    found = {(row["order"], row["parameter"]): row["value"] for row in rows if row["effect"] == "cogging"}
    assert found == {
        **{(4, "amplitude"): 0.03, (4, "order"): 4.0, (4, "phase"): 0.3},
        **{(12, "amplitude"): 0.02, (12, "order"): 12.0, (12, "phase"): 1.0},
    }


@pytest.mark.parametrize("order", [np.array([4, 4]), np.array([4.0, 4.0], dtype=np.float32), [4, 4], [np.int64(4), 4.0]])
def test_equal_orders_of_any_number_type_are_refused(order: Any) -> None:
    with pytest.raises(ModelError, match="give one wave of each order"):
        MODELS["one mass"][1].with_effect("cogging", amplitude=[0.1, 0.2], order=order, phase=[0.0, 0.0])


def test_an_order_that_is_no_number_is_refused_as_any_parameter() -> None:
    model = MODELS["one mass"][1]
    for order, others in ((np.nan, 0.1), ([4.0, np.nan], [0.1, 0.1])):
        with pytest.raises(ModelError, match="is nan: give one finite number"):
            model.with_effect("cogging", amplitude=others, order=order, phase=others)
    with pytest.raises(ModelError, match="its keys are amplitude, order, phase"):
        model.with_effect("cogging", **{"amplitude": 0.1, "order": 4.0, "phase": 0.0, "amplitude_\u00b2": 0.1})


def test_an_array_without_a_dimension_is_a_number() -> None:
    (effect,) = MODELS["one mass"][1].with_effect("cogging", amplitude=np.array(0.1), order=np.array(4), phase=0.0).effects
    assert effect.parameters == {"amplitude": 0.1, "order": 4.0, "phase": 0.0}
