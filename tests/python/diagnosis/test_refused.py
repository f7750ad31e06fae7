"""What a diagnosis refuses: an effect that makes held-out data worse, and a mechanism that no axis is."""

from __future__ import annotations

import importlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaident as ga

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


def test_that_none_is_named_is_said_only_where_none_is(monkeypatch: pytest.MonkeyPatch) -> None:
    true = module.mechanics_of

    def driven(*given: Any) -> dict[str, ga.Estimate]:
        return true(*given) | {"viscous_friction": ga.Estimate(-0.01, 0.003, "N m s/rad")}

    monkeypatch.setattr(module, "mechanics_of", driven)
    for only, said in (("load_torque", "load torque the model would come closer still"), ("", "so none is named")):
        monkeypatch.setattr(module, "only_describes", lambda *given, only=only: given[2] == only or not only)
        found = ga.diagnose(record(1), ga.PI(kp=0.02, ki=0.5))
        assert bool(found.causes) == bool(only)
        assert any(said in note for note in found.notes)
        assert any("none is named" in note for note in found.notes) == (not only)
