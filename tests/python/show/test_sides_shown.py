"""At which end of an elastic shaft a cause is: the same words in every output."""

from __future__ import annotations

from dataclasses import replace

import pytest

import gaident as ga
from gaident.diagnosis.library.sides import sides_of
from gaident.show.report.diagnosis import headline
from gaident.show.units import shown_in
from report_cases import diagnosed


@pytest.fixture(scope="module")
def dia() -> ga.Diagnosis:
    return diagnosed()


def _flat(text: str) -> str:
    """Without the ends of lines."""
    return " ".join(text.split())


SIDED = {
    ("motor",): "coulomb friction{} at the motor",
    ("load",): "coulomb friction{} at the load",
    ("motor", "load"): "coulomb friction{} at the motor or at the load (these data do not say which)",
    (): "coulomb friction{}",
}


@pytest.mark.parametrize("sides", SIDED)
def test_every_output_says_at_which_end_of_the_shaft_a_cause_is(dia: ga.Diagnosis, sides: tuple[str, ...]) -> None:
    """In a model of one mass both ends are one, and none says any."""
    (friction,) = dia.causes
    two = ga.TwoMass(JM=1e-4, DM=0.003, JL=5.8e-4, DL=0.008, KG=2.6).model().with_effect("coulomb_friction", torque=0.05)
    found = replace(friction, sides=sides, parameters={"torque": ga.Estimate(0.05, 1e-4, "N m")})
    there = replace(dia, findings=(found,), model=two)
    words = SIDED[sides].format("")
    assert f"Cause: {words}." in _flat(there.summary()) and f"  {words}\n" in there.summary()
    assert headline(there, "rotary").startswith(f"The model lacks {SIDED[sides].format(' (0.05 N m)')}; with it")
    assert f">{words}<" in there._repr_html_()
    assert repr(there) == f"<Diagnosis explained: {words.replace(' ', '_', 1)}; see summary()>"
    assert list(there.to_pandas()["sides"]) == [", ".join(sides)]
    assert there.to_dict()["findings"][0]["sides"] == sides
    assert shown_in(there, {"N m": ("N cm", 100.0)}, "rotary")["findings"][0]["sides"] == list(sides)  # type: ignore[index]
    one = replace(there, model=ga.OneMass(7e-4, 0.01).model().with_effect("coulomb_friction", torque=0.05))
    assert "at the" not in headline(one, "rotary") and repr(one) == "<Diagnosis explained: coulomb_friction; see summary()>"
    several = replace(there, findings=(replace(found, alternatives=("stribeck_friction", "lugre_friction")),))
    assert repr(several) == f"<Diagnosis explained: {words.replace(' ', '_', 1)}?; see summary()>"
    first = words.replace("coulomb friction", "coulomb")
    assert f"Friction, 0.05 N m; its kind is open ({first}, stribeck or lugre)." in _flat(several.summary())
    other = replace(there, findings=(replace(found, alternatives=("load_torque",)),))
    assert f"one of: {words} or load torque." in _flat(other.summary())


def test_friction_at_both_ends_is_two_causes(dia: ga.Diagnosis) -> None:
    both = tuple(replace(dia.causes[0], sides=(side,)) for side in ("motor", "load"))
    two = ga.TwoMass(JM=1e-4, DM=0.003, JL=5.8e-4, DL=0.008, KG=2.6).model().with_effect("coulomb_friction", torque=0.05)
    text = _flat(replace(dia, findings=both, model=two).summary())
    assert "Causes: coulomb friction at the motor, coulomb friction at the load." in text


def test_an_end_that_was_not_tried_is_allowed() -> None:
    """In a model of one mass, and beside a further resonance, with which no effect at the load goes together."""
    assert sides_of("coulomb_friction", [], one_place=False) == ("motor",)
    assert sides_of("coulomb_friction@load", [], one_place=False) == ("load",)
    assert sides_of("coulomb_friction@load", ["stribeck_friction"], one_place=False) == ("load",)
    assert sides_of("coulomb_friction", ["coulomb_friction@load"], one_place=False) == ("motor", "load")
    assert sides_of("coulomb_friction", [], one_place=True) == ("motor", "load")
    assert sides_of("backlash", [], one_place=True) == ()
