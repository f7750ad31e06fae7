"""The judge and the tables of the blind tests, on made-up diagnoses."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from blind_judge import Judgement, deviations, judge, with_ends
from drive_rig import Plant
from places import BENCH

sys.path.insert(0, str(BENCH))
import blind
import blind_tables

Hidden = dict[str, dict[str, float]]
COULOMB = {"coulomb_friction": {"torque": 0.05}}
LAG = {"torque_lag": {"time_constant": 1e-3}}


def finding(effect: str, *alternatives: str, is_noise: bool = False, **values: float) -> Any:
    parameters = {name: SimpleNamespace(value=value) for name, value in values.items()}
    return SimpleNamespace(effect=effect, alternatives=alternatives, is_noise=is_noise, parameters=parameters)


def said(
    effects: dict[str, dict[str, float]], *findings: Any, verdict: str = "explained", driver: str | None = None
) -> Judgement:
    return judge(SimpleNamespace(findings=list(findings), verdict=verdict, driver=driver), effects)


def test_a_right_name() -> None:
    judged = said(COULOMB, finding("coulomb_friction", torque=0.052), finding("outliers", is_noise=True))
    assert judged.exact and judged.in_set and not judged.wrong and judged.column == "coulomb_friction"
    assert judged.parameter_errors == {"coulomb_friction.torque": pytest.approx(0.04)}


def test_abstaining_with_and_without_the_truth() -> None:
    within = said(COULOMB, finding("stribeck_friction", "coulomb_friction"))
    assert within.in_set and not within.exact and not within.wrong and within.column == "abstained" and within.extra == 0
    without = said(COULOMB, finding("stribeck_friction", "presliding_friction"))
    assert not without.in_set and not without.wrong and without.column == "abstained without it" and without.extra == 1


def test_wrong_names_count_even_beside_the_right_one() -> None:
    judged = said(COULOMB, finding("coulomb_friction"), finding("quadratic_drag"))
    assert judged.in_set and not judged.exact and judged.wrong == ["quadratic_drag"] and judged.column == "quadratic_drag"
    assert said({}, finding("cogging")).wrong == ["cogging"]
    assert said({}, finding("velocity_quantisation", is_noise=True)).sets == []


def test_noise_effects_count_where_they_were_hidden() -> None:
    judged = said({"outliers": {"fraction": 0.002}}, finding("outliers", is_noise=True, fraction=0.003))
    assert judged.exact and judged.parameter_errors["outliers.fraction"] == pytest.approx(0.5)


def test_equivalents_must_stand_together() -> None:
    assert said(LAG, finding("velocity_filter", "torque_lag")).equivalents_together
    assert said(LAG, finding("torque_lag")).equivalents_together is False
    assert said(COULOMB, finding("coulomb_friction")).equivalents_together is None


def test_true_parts_of_the_unknown_are_no_wrong_names() -> None:
    walking = {"random_walk_friction": {"torque": 0.05, "size": 0.6, "number": 1.0}}
    judged = said(walking, finding("coulomb_friction"), verdict="partly explained", driver="time")
    assert judged.parts == ["coulomb_friction"] and not judged.wrong and not judged.extra
    assert said({"thermal_gain": {"share": 0.2, "time_constant": 1.0}}, finding("coulomb_friction")).wrong == ["coulomb_friction"]


def test_declining() -> None:
    assert said(COULOMB, verdict="unexplained").column == "unexplained"
    assert said({}, verdict="adequate").column == "none"


def line(effect: str, factor: float, *findings: Any, group: str = "effects", **more: Any) -> dict[str, Any]:
    effects: dict[str, dict[str, float]] = {effect: {"torque": 0.05}} if effect else {}
    cell = {"group": group, "effects": list(effects), "kind": "multi", "noise": "white"}
    return {"key": f"{group}/{effect}", "cell": cell, "judged": said(effects, *findings).as_dict(), "seconds": 1.0,
            "plant": "one mass", "factor": factor, **more}  # fmt: skip


def test_rates_and_their_intervals() -> None:
    assert blind_tables.interval(0, 299)[1] == pytest.approx(0.01226, abs=1e-4)  # 1 - 0.025^(1/299)
    low, high = blind_tables.interval(5, 10)
    assert (low, high) == (pytest.approx(0.1871, abs=1e-4), pytest.approx(0.8129, abs=1e-4))
    assert blind_tables.rate(1, 2).startswith("1/2 = 50.0 %")


def test_tables_count_what_happened() -> None:
    good = line("coulomb_friction", 1.0, finding("coulomb_friction", torque=0.051), before=0.3, after=0.12, oracle=0.1)
    bad = line("coulomb_friction", 1.0, finding("cogging"), before=0.3, after=0.3, oracle=0.1)
    text = blind_tables.effect_table([good, bad, good])
    assert "| coulomb_friction | 3 | 67 % | 67 % | 1 |" in text
    assert blind_tables.gain_ratio(good) == pytest.approx(0.9)
    matrix = blind_tables.confusion([good, bad, line("", 0.0)])
    assert "| nothing |  |  | 1 |" in matrix and "| coulomb_friction | 1 | 1 |" in matrix
    limit = {"size": 0.5, "factor": 1.0, "nearest": 100.0, "rival": "none"}
    limits = [{"key": "limit/", "effect": "coulomb_friction", "plant": "one mass", "limit": limit}]
    curve = blind_tables.curve_table([good | {"factor": 1.2}, line("coulomb_friction", 0.1, finding("cogging"))], limits)
    assert "above twice the limit, exact outside classes: 1/1" in curve
    assert "below the limit, a wrong name: 1/1" in curve and "100 %, 100 %, 0 % of 1" in curve
    assert "no results" in blind_tables.report([])
    assert "### Crashes" in blind_tables.report([{"key": "x", "crash": "ValueError: no"}])


def test_friction_at_both_ends_is_two_causes_with_their_ends() -> None:
    key = "coulomb_friction@load"
    hidden = {"coulomb_friction": {"torque": 0.05}, key: {"torque": 0.08}}

    def told(*findings: ga.Finding) -> Judgement:
        return judge(with_ends(SimpleNamespace(findings=findings, verdict="explained", driver=None)), hidden)

    def friction(side: str, torque: float) -> ga.Finding:
        return ga.Finding("coulomb_friction", {"torque": ga.Estimate(torque, 1e-3, "N m")}, sides=(side,))

    good = told(friction("motor", 0.05), friction("load", 0.084))
    assert good.exact and good.in_set and not good.wrong
    assert good.parameter_errors == {"coulomb_friction.torque": pytest.approx(0.0), f"{key}.torque": pytest.approx(0.05)}
    half = told(friction("motor", 0.13))
    assert not half.in_set and not half.wrong
    lines = [{"cell": {"effects": list(hidden)}, "judged": each.as_dict()} for each in (good, half, half)]
    assert "| coulomb_friction | 3 | 33 % | 33 % | 2 | 2.5 % | - |" in blind_tables.ends_table(lines)


def test_cells_repeat_themselves_and_have_their_own_keys() -> None:
    for group in blind.GROUPS:
        cells = list(blind.cells(group, 3, 1))
        assert cells == list(blind.cells(group, 3, 1))
        assert len({c.key for c in cells}) == len(cells) > 0
        assert not {c.key for c in cells} & {c.key for c in blind.cells(group, 3, 2)}
    assert np.prod([len(list(blind.cells("clean", 17, 1)))]) >= 300


def test_an_interrupted_file_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    path.write_text('{"key": "a", "x": 1}\n{"key": "b", "x"')
    assert list(blind.read(path)) == ["a"]


def test_deviations_of_mechanics_and_of_what_is_there() -> None:
    plant = Plant(J=2e-3, D=1e-2, kp=0.1, ki=1.0, dt=1e-3)
    wave = {"amplitude": ga.Estimate(-0.05, 0.001, "N m"), "phase": ga.Estimate(-2.0, 0.01, "rad")}
    unknown = {"torque": ga.Estimate(0.01, 0.02, "N m", identifiable=False)}
    dia = SimpleNamespace(
        mechanics={"inertia": ga.Estimate(2.1e-3, 5e-5, "kg m^2")},
        findings=[
            SimpleNamespace(effect="unbalance", alternatives=(), is_noise=False, parameters=wave),
            SimpleNamespace(effect="coulomb_friction", alternatives=(), is_noise=False, parameters=unknown),
            SimpleNamespace(effect="cogging", alternatives=(), is_noise=False, parameters=wave),
        ],
    )
    hidden = {"unbalance": {"amplitude": 0.052, "phase": np.pi - 2.03}, "coulomb_friction": {"torque": 0.03}}
    off = deviations(dia, hidden, plant)
    assert off == {
        "inertia": pytest.approx(2.0),
        "unbalance.amplitude": pytest.approx(-2.0),
        "unbalance.phase": pytest.approx(3.0),
    }


def test_deviations_of_a_shaft_have_its_resonance_and_damping() -> None:
    shaft = ga.TwoMass(JM=2e-4, DM=1e-3, JL=3e-4, DL=1.5e-3, KG=60.0, DG=2e-3)
    plant = Plant(shaft.JM, shaft.DM, 0.1, 1.0, 1e-3, shaft.JL, shaft.DL, shaft.KG, shaft.DG)
    free = ga.TwoMass(2e-4, 0.0, 3e-4, 0.0, 60.0, 0.0)
    found = {
        "resonance": ga.Estimate(np.sqrt(free.KG * (1 / free.JM + 1 / free.JL)) / (2 * np.pi), 0.01, "Hz"),
        "antiresonance": ga.Estimate(np.sqrt(free.KG / free.JL) / (2 * np.pi), 0.01, "Hz"),
        "stiffness": ga.Estimate(61.0, 0.5, "N m/rad"),
    }
    off = deviations(SimpleNamespace(mechanics=found, findings=[]), {}, plant)
    assert off["stiffness"] == pytest.approx(2.0) and abs(off["resonance"]) < 3.0 and abs(off["antiresonance"]) < 3.0


def test_deviations_of_an_effect_at_both_ends_are_of_each_end() -> None:
    ends = [
        ga.Finding("coulomb_friction", {"torque": ga.Estimate(torque, 1e-3, "N m")}, sides=(side,))
        for side, torque in (("load", 0.021), ("motor", 0.05))
    ]
    hidden = {"coulomb_friction": {"torque": 0.05}, "coulomb_friction@load": {"torque": 0.02}}
    dia = SimpleNamespace(mechanics={}, findings=ends, verdict="explained", driver=None)
    off = deviations(dia, hidden, Plant(2e-3, 1e-2, 0.1, 1.0, 1e-3))
    assert off == {"coulomb_friction.torque": pytest.approx(0.0), "coulomb_friction@load.torque": pytest.approx(1.0)}


def test_coverage_counts_by_verdict() -> None:
    lines = [
        {"judged": {"verdict": verdict}, "deviations": {"inertia": z, "cogging.order": 0.1}}
        for verdict, z in (("explained", 1.0), ("explained", -2.5), ("partly explained", 9.0))
    ]
    rows = {line.split(" | ")[0].strip("| "): line for line in blind_tables.coverage_table(lines).splitlines()[2:]}
    assert "1/2 = 50.0 %" in rows["inertia"] and "0/1 = 0.0 %" in rows["inertia"] and rows["inertia"].endswith("| 9 |")
    assert "3/4 = 75.0 %" in rows["all"] and next(iter(rows)) == "inertia"


def test_the_tables_of_the_evidence_page() -> None:
    """Inertia and friction of the whole axis stand before the findings; a crash is an answer, too."""
    sys.path.insert(0, str(BENCH / "measured"))
    import real_tables

    found = {"effect": "asymmetric_friction", "alternatives": ["load_torque"], "is_noise": False}
    found["parameters"] = {"torque_positive": 20.1, "viscous_negative": 75.0}
    what = {"verdict": "partly explained", "findings": [found], "gain": 0.01, "poles": [[-2.0, 0.0]]}
    methods = {"rigid": {"velocity": 0.3, "training": 0.2, "force": 0.1}, "regression": {"velocity": 0.2, "training": 0.4}}
    lines: dict[str, Any] = {
        "emps/whole/diagnosis": {
            "said": what,
            "judged": {"name": "friction"},
            "methods": {"extended": {"velocity": 0.1, "force": 0.05, "training": 0.1}},
        },
        "emps/whole/plain": {"methods": {**methods, "linear": {"velocity": 0.9}}},
        "joint 1/whole/diagnosis": {"crash": "ValueError: no"},
    }
    rows = [line for line in real_tables.evidence(lines).splitlines() if line.startswith(("| emps ", "| joint 1 "))]
    said, crash, errors = ([cell.strip() for cell in row.strip("|").split("|")] for row in rows)
    expected = "inertia 100, viscous friction 200; asymmetric friction or load torque (torque positive 20.1, viscous negative 75)"
    assert said[2:] == [expected, "partly explained", ""] and crash[2] == "ValueError: no"
    assert errors[1:] == ["0.9", "0.3", "", "", "0.1", "0.1", "0.05"]
