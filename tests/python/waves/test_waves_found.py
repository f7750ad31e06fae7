"""Blind: cogging and encoder ripple of several orders at once, each found as one effect with all its waves.

The drive is that of drive_rig.py, which shares no code with the library.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from drive_cases import command_for, nominal_plants, tuned
from drive_rig import Plant, rig, skip_without_library
from gaident.models.effect_rows import by_wave

skip_without_library()

FRICTION = {"coulomb_friction": {"torque": 0.05}}


def waves(*rows: tuple[float, int, float]) -> dict[str, float]:
    """Parameters of waves (amplitude, order, phase), the first ones under plain names."""
    found = {}
    for k, (amplitude, order, phase) in enumerate(rows, 1):
        behind = "" if k == 1 else f"_{k}"
        found |= {f"amplitude{behind}": amplitude, f"order{behind}": float(order), f"phase{behind}": phase}
    return found


TWO = waves((0.03, 4, 0.3), (0.02, 12, 1.0))
THREE = waves((0.03, 4, 0.3), (0.02, 12, 1.0), (0.015, 24, -2.0))
RIPPLES = waves((5e-3, 1, 0.2), (3e-3, 4, 1.0))


def axis(name: str) -> tuple[Plant, np.ndarray]:
    """A plant of the blind tests with its controller, and levels with reversals [rad/s]."""
    rng = np.random.default_rng(5)
    plant = next(p for p in nominal_plants() if p.name == name)
    return (plant := plant if plant.kp else tuned(plant, rng)), command_for("multi", plant, rng)


def diagnosed(name: str, effects: dict[str, dict[str, float]], position: bool = True) -> ga.Diagnosis:
    plant, command = axis(name)
    return ga.diagnose(rig(plant, command, effects, seed=5, position_logged=position), plant.controller)


@pytest.fixture(scope="module")
def two() -> ga.Diagnosis:
    """Cogging of the orders 4 and 12, which was once unexplained: half of it was found as a ripple."""
    return diagnosed("one mass", {"cogging": TWO})


def check(dia: ga.Diagnosis, hidden: dict[str, dict[str, float]]) -> None:
    """One finding of each effect, named, with the parameters of every wave within their deviations."""
    assert dia.verdict == "explained", dia.summary()
    found = {f.effect: f for f in dia.findings}
    assert set(found) == set(hidden) and len(found) == len(dia.findings) and all(f.named for f in dia.findings), dia.summary()
    for effect, values in hidden.items():
        assert set(found[effect].parameters) == set(values)
        sizes = [w["amplitude"].value for w in by_wave(found[effect].parameters) if "order" in w]
        assert sizes == sorted(sizes, reverse=True), "the strongest wave first"
        for name, value in values.items():
            e = found[effect].parameters[name]
            assert e.value == pytest.approx(value, rel=0.03, abs=0.03 if name.startswith("phase") else 0.0), name
            assert e.identifiable and e.unit == ga.Effect(effect, values).row.parameters[list(values).index(name)].unit


@pytest.mark.long
def test_two_orders_are_one_finding_whose_words_name_both(two: ga.Diagnosis) -> None:
    check(two, {"cogging": TWO})
    (finding,) = two.findings
    assert "here n = 4 and 12" in finding.evidence and finding.gain > 0.5 and finding.delta_bic > 500.0
    text = two.summary()
    assert "n = 4 and 12" in text and "order_2" in text.replace("order 2", "order_2")
    (effect,) = two.model.effects
    assert effect.waves == 2 and effect.parameters == {name: e.value for name, e in finding.parameters.items()}


@pytest.mark.long
def test_its_waves_are_one_cause_wherever_the_result_goes(two: ga.Diagnosis, tmp_path: Path) -> None:
    without, whole = two.simulate_without("cogging"), ga.run(two.model, two.records[0], two.controller)
    linear = ga.run(two.model.without_effect("cogging"), two.records[0], two.controller)
    assert np.array_equal(without.velocity, linear.velocity) and np.abs(whole.velocity - linear.velocity).max() > 0.1
    two.save(tmp_path / "two.json")
    loaded = ga.load(tmp_path / "two.json")
    assert isinstance(loaded, ga.Diagnosis) and loaded.model == two.model
    assert loaded.findings[0].parameters == two.findings[0].parameters and loaded.findings[0].evidence == two.findings[0].evidence
    tables = ga.feedforward(two)
    assert [wave.order for wave in tables.waves] == [4.0, 12.0]
    angle = tables.angle
    angle = tables.angle
    assert tables.by_angle == pytest.approx(0.03 * np.sin(4 * angle + 0.3) + 0.02 * np.sin(12 * angle + 1.0), abs=1e-3)
    ga.report(two, tmp_path / "two.html", live=False)
    assert "n = 4 and 12" in (tmp_path / "two.html").read_text()


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "hidden", "position"),
    [
        ("one mass", {"cogging": THREE} | FRICTION, True),
        ("one mass", {"velocity_ripple": RIPPLES}, False),
        ("one mass", {"cogging": TWO, "velocity_ripple": RIPPLES}, True),
        ("soft shaft", {"cogging": TWO}, False),
    ],
    ids=["three and friction", "ripple", "both", "two masses"],
)
def test_several_orders_are_found_together(name: str, hidden: dict[str, dict[str, float]], position: bool) -> None:
    check(diagnosed(name, hidden, position), hidden)


@pytest.mark.long
def test_several_orders_at_the_load_are_found_there() -> None:
    dia = diagnosed("soft shaft", {"cogging@load": TWO})
    check(dia, {"cogging": TWO})
    assert dia.findings[0].sides == ("load",) and [(e.side, e.waves) for e in dia.model.effects] == [("load", 2)]


@pytest.mark.long
@pytest.mark.parametrize("hidden", [{}, {"cogging": waves((0.03, 12, 0.3))}, {"velocity_ripple": waves((5e-3, 4, 0.3))}],
                         ids=["clean", "cogging", "ripple"])  # fmt: skip
def test_one_order_stays_one(hidden: dict[str, dict[str, float]]) -> None:
    dia = diagnosed("one mass", hidden)
    if not hidden:
        assert dia.verdict == "adequate" and not dia.causes
        return
    check(dia, hidden)
    assert "here n" not in dia.findings[0].evidence
