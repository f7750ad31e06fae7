"""What a diagnosis refuses: an effect that makes held-out data worse or has no known size, and a mechanism that no axis is."""

from __future__ import annotations

import importlib
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.diagnosis.explain.determined import determined, not_determined
from gaident.diagnosis.explain.expected import outside_of
from gaident.diagnosis.explain.wording import basis_of, of_the_mechanics
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.attribution import of_known_size
from gaident.errors import SettingsError
from gaident.estimation.dataset import DataSet

module = importlib.import_module("gaident.diagnosis.work")


def record(seed: int) -> ga.Record:
    """One mass with dry friction and a load, levels with reversals, torque logged."""
    drive = (
        ga.OneMass(J=2e-4, D=3e-3).model().with_effect("coulomb_friction", torque=0.02).with_effect("load_torque", torque=0.03)
    )
    noise = 0.05 * np.random.default_rng(seed).standard_normal(2000)
    levels = np.array([0, 20, -5, 60, -40, 3, -80, 10, 1, -20, 40, -60, 5, 80, -3, -10, -30, 30, -1, 0.0])
    r = np.repeat(levels, 100)
    controller = ga.PI(kp=0.02, ki=0.5)
    run = ga.run(drive, ga.Record(1e-3, command=r - noise, velocity=noise), controller)
    return ga.Record(1e-3, command=r, velocity=run.velocity + noise, torque=run.torque)


@pytest.mark.long
def test_what_is_said_is_said_of_the_model_without_the_refused_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    measured, calls = module.measured_gains, []

    def refusing(*given: Any) -> Any:
        gains = measured(*given)
        calls.append(given[4].effects)
        return replace(gains, harmful=("load_torque",)) if len(calls) == 1 else gains

    whole = ga.diagnose(record(1), ga.PI(kp=0.02, ki=0.5))
    both = {f.effect: f.delta_bic for f in whole.causes}
    assert both.keys() == {"coulomb_friction", "load_torque"}
    monkeypatch.setattr(module, "measured_gains", refusing)
    without = ga.diagnose(record(1), ga.PI(kp=0.02, ki=0.5))
    assert len(calls) == 2
    assert "load_torque" not in calls[1]
    assert any("Load torque would come closer" in note for note in without.notes)
    # The friction is now worth what it is worth without the load.
    assert all(f.delta_bic != pytest.approx(both["coulomb_friction"], rel=1e-3) for f in without.causes)


@pytest.mark.long
def test_a_model_with_a_negative_damping_is_not_adequate(monkeypatch: pytest.MonkeyPatch) -> None:
    rec, controller = record(2), ga.PI(kp=0.02, ki=0.5)
    whole = ga.diagnose(rec, controller)
    assert (whole.verdict, whole.driver) == ("explained", None)
    true = module.mechanics_of

    def driven(*given: Any) -> dict[str, ga.Estimate]:
        return true(*given) | {"viscous_friction": ga.Estimate(-0.01, 0.003, "N m s/rad")}

    monkeypatch.setattr(module, "mechanics_of", driven)
    found = ga.diagnose(rec, controller)
    assert (found.verdict, found.driver) == ("partly explained", "velocity")
    assert any(note.startswith("The viscous friction comes out negative (-0.01 N m s/rad)") for note in found.notes)
    monkeypatch.setattr(module, "mechanics_of", lambda *given: true(*given) | {"viscous_friction": ga.Estimate(-0.01, 0.004, "")})
    assert ga.diagnose(rec, controller).verdict == "explained"


@pytest.mark.long
@pytest.mark.parametrize("pair", ["resonance_damping", "antiresonance_damping"])
def test_a_pair_that_drives_itself_is_not_adequate_either(monkeypatch: pytest.MonkeyPatch, pair: str) -> None:
    """A forgotten filter between the lines of a log was two masses with a damping ratio of -0.33, and that adequate."""
    rec, controller, true = record(2), ga.PI(kp=0.02, ki=0.5), module.mechanics_of
    for std, verdict, driver in ((0.1, "partly explained", "past"), (0.2, "explained", None)):
        found = {pair: ga.Estimate(-0.33, std, "1")}
        monkeypatch.setattr(module, "mechanics_of", lambda *given, found=found: true(*given) | found)
        dia = ga.diagnose(rec, controller)
        assert (dia.verdict, dia.driver) == (verdict, driver)


@pytest.mark.long
def test_a_negative_damping_is_said_beside_what_is_left_too(monkeypatch: pytest.MonkeyPatch) -> None:
    rec, controller, true, judged = record(2), ga.PI(kp=0.02, ki=0.5), module.mechanics_of, module.Work.judged
    driven = ga.Estimate(-0.01, 0.003, "N m s/rad")
    monkeypatch.setattr(module, "mechanics_of", lambda *given: true(*given) | {"viscous_friction": driven})
    monkeypatch.setattr(module.Work, "judged", lambda work: judged(work)._replace(driver="position"))
    found = ga.diagnose(rec, controller)
    assert found.driver == "position" and any("comes out negative" in note for note in found.notes)


def test_a_pair_with_a_negative_damping_is_said() -> None:
    damped = {"resonance_damping": ga.Estimate(0.02, 0.001, "1"), "antiresonance_damping": ga.Estimate(-0.0077, 0.0001, "1")}
    data = DataSet.of([record(2)], None)
    (note,) = of_the_mechanics(damped, {}, data, False)
    assert note.startswith("The antiresonance has a damping ratio of -0.0077, below 0 beyond its deviation")
    assert "load inertia and stiffness" in note and "load mass and stiffness" in note.linear
    doubtful = damped | {"antiresonance_damping": ga.Estimate(-0.0077, 0.004, "1")}
    assert not of_the_mechanics(doubtful, {}, data, False)


def test_more_than_noise_is_no_contradiction_to_nothing_significant() -> None:
    """Errors that are no noise, and yet depend on no signal beyond chance: both stand in one sentence."""
    test, search = SimpleNamespace(contradicts=False), SimpleNamespace(whitens=False)
    before = SimpleNamespace(space=SimpleNamespace(is_noise=lambda fit: False), final=None)
    found: Any = SimpleNamespace(specification=test, space=search, whitened=before)
    (alone,), (beside,) = (basis_of(found, left) for left in (False, True))
    assert alone.startswith("What the model leaves is more than noise, but depends on no signal of these records beyond chance:")
    assert beside.startswith("What the model leaves is more than noise: ")


def test_a_value_outside_of_its_expected_range_is_said_where_it_is_so_beyond_its_deviation() -> None:
    mechanics = {"inertia": ga.Estimate(3e-3, 1e-5, "kg m^2"), "resonance": ga.Estimate(186.34, 0.15, "Hz")}
    (note,) = outside_of({"resonance_hz": (200.0, 220.0), "inertia": (1e-3, 5e-3)}, mechanics)
    assert note.startswith("The resonance was found as 186.3 +- 0.15 Hz, outside of the range that was given (200 to 220)")
    (note,) = outside_of({"inertia": (4e-3, 5e-3)}, mechanics)
    assert "The mass was found as 0.003 +- 1e-05 kg, " in note.linear
    assert not outside_of({"resonance_hz": (186.7, 220.0), "damping": (1.0, 2.0)}, mechanics)


@pytest.mark.parametrize("wrong", [{"stiffness": (1, 2)}, {"inertia": 3.0}, {"inertia": (2, 1)}, {"damping": ("a", 2)}, 3])
def test_a_wrong_expectation_is_refused(wrong: Any) -> None:
    with pytest.raises(SettingsError, match=r"give a mapping with inertia, resonance_hz or damping, each a pair"):
        ga.diagnose(record(2), ga.PI(kp=0.02, ki=0.5), expected=wrong)


@pytest.mark.long
def test_that_none_is_named_is_said_only_where_none_is(monkeypatch: pytest.MonkeyPatch) -> None:
    true = module.mechanics_of

    def driven(*given: Any) -> dict[str, ga.Estimate]:
        return true(*given) | {"viscous_friction": ga.Estimate(-0.01, 0.003, "N m s/rad")}

    monkeypatch.setattr(module, "mechanics_of", driven)
    for only, said in (("load_torque", "load torque the model would come closer still"), ("", "so none is named")):
        monkeypatch.setattr(module.attribution, "only_describes", lambda *given, only=only: given[2] == only or not only)
        found = ga.diagnose(record(1), ga.PI(kp=0.02, ki=0.5))
        assert bool(found.causes) == bool(only)
        assert any(said in note for note in found.notes)
        assert any("none is named" in note for note in found.notes) == (not only)


def swinging(seed: int) -> ga.Record:
    """A drive that swings over part of a turn, its torque logged alone, with dry friction that changes with the angle.

    Steps of 0.05 ms with set-valued friction and a PI at 1 kHz, no code of the library: J = 1e-3 kg m^2, D = 3e-3 N m s/rad.
    """
    dt, n, sub, J, B = 1e-3, 4000, 20, 1e-3, 3e-3
    t = dt * np.arange(n)
    place = np.radians(30.0) * (0.8 * np.sin(2 * np.pi * 0.8 * t) + 0.2 * np.sin(2 * np.pi * 2.3 * t))
    command, noise = np.gradient(place, dt), 0.03 * np.random.default_rng(seed).standard_normal(n)
    w = theta = integral = before = 0.0
    log = np.empty((3, n))
    for k in range(n):
        error = command[k] - (w + noise[k])
        integral += 1.5 * dt * (error + before) / 2
        before = error
        u = 0.08 * error + integral
        log[:, k] = w + noise[k], u, theta
        for _ in range(sub):
            free = (w + dt / sub * (u - 0.02 * theta * np.tanh(w / 0.05)) / J) / (1 + dt / sub * B / J)
            most = dt / sub * 0.02 / J
            now = 0.0 if abs(free) <= most else free - np.sign(free) * most
            theta += dt / sub * 0.5 * (w + now)
            w = now
    return ga.Record(dt, velocity=log[0], torque=log[1], position=log[2])


@pytest.mark.long
def test_a_viscous_friction_that_drives_the_axis_is_no_mechanism() -> None:
    """By whitened errors a drag of the square root of the speed, and -0.014 N m s/rad beside it: worse than without an effect."""
    dia = ga.diagnose(swinging(0))
    assert [f.effect for f in dia.causes] == ["asymmetric_friction"] and dia.verdict == "partly explained", dia.summary()
    mean = np.mean([dia.causes[0].parameters[f"torque_{way}"].value for way in ("positive", "negative")])
    assert mean == pytest.approx(0.02, rel=0.3)
    assert abs(dia.mechanics["viscous_friction"].value) < 3e-3 and dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=0.1)
    assert dia.after.rmse < 0.7 * dia.before.rmse


def estimate(value: float, std: float, unit: str = "N m", at_bound: bool = False) -> ga.Estimate:
    return ga.Estimate(value, std, unit, at_bound, std < abs(value))


def levels(up: tuple[float, float], down: tuple[float, float]) -> dict[str, ga.Estimate]:
    slopes = {"viscous_positive": estimate(0.0038, 1.3e-5, "N m s/rad"), "viscous_negative": estimate(0.0, 0.0, "N m s/rad")}
    return {"torque_positive": estimate(*up), "torque_negative": estimate(*down), **slopes}


@pytest.mark.parametrize(
    ("parameters", "known"),
    [
        (levels((0.038, 0.16), (0.0015, 0.16)), False),  # a load takes either level; the slopes are known, the friction is not
        (levels((0.04, 0.001), (0.0, 0.001)), True),  # one level is 0, and known to be
        ({"torque": estimate(0.05, 0.06)}, False),
        ({"torque": estimate(0.05, 0.03)}, False),  # 0 is within two deviations
        ({"torque": estimate(0.05, 0.02)}, True),
        ({"torque": estimate(0.05, float("nan"), at_bound=True)}, False),
        ({"amplitude": estimate(0.02, 0.001), "order": estimate(6.0, 0.0, "1/turn"), "phase": estimate(0.0, 0.02, "rad")}, True),
        ({"amplitude": estimate(0.02, 0.17), "order": estimate(6.0, 0.0, "1/turn"), "phase": estimate(1.5, 0.1, "rad")}, False),
        ({"width": estimate(0.01, 0.001, "rad")}, True),
    ],
)
def test_an_effect_is_determined_by_its_torques(parameters: dict[str, ga.Estimate], known: bool) -> None:
    assert determined(parameters) is known


def test_what_is_not_determined_is_said() -> None:
    assert "Asymmetric friction comes closer" in not_determined("asymmetric_friction")


def test_of_two_effects_that_take_each_others_size_the_one_goes_that_explains_less() -> None:
    """Two levels beside a constant load: even friction in their place, and the load is known."""
    terms = tuple(LIBRARY[e] for e in ("asymmetric_friction", "load_torque", "cogging"))
    costs = {"asymmetric_friction": 900.0, "load_torque": 400.0, "coulomb_friction": 150.0}

    def fit(what: str) -> Any:
        return SimpleNamespace(bic=costs[what], what=what)

    space: Any = SimpleNamespace(without=lambda final, e: fit(e), as_nested=lambda final, term, simple: fit(simple.name))
    final: Any = SimpleNamespace(parameters=SimpleNamespace(terms=terms))
    assert of_known_size(space, final, ["asymmetric_friction", "load_torque"]).what == "coulomb_friction"
    assert of_known_size(space, final, ["load_torque"]).what == "load_torque"
