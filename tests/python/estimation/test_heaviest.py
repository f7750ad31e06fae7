"""From which inertia a model is heavier than the records of a measured torque show: regressed with the model's own terms."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_rig import Effects, Plant, run_drive, skip_without_library
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.bases import heaviest
from gaident.policy.table import POLICY

skip_without_library()

JOINT = Plant(J=15.0, D=18.0, kp=300.0, ki=1500.0, dt=0.01)
BOTH: Effects = {"unbalance": {"amplitude": 20.0, "phase": -1.57}, "coulomb_friction": {"torque": 10.5}}


def records(offset: float = 0.0) -> Any:
    """One record as `heaviest` takes it: a joint with gravity and dry friction under slow sines about a velocity [rad/s]."""
    t, rng = JOINT.dt * np.arange(3000), np.random.default_rng(0)
    command = offset + sum(a * np.sin(2.0 * np.pi * f * t) for a, f in ((0.5, 0.11), (0.35, 0.29), (0.2, 0.83)))
    log = run_drive(JOINT, np.asarray(command), BOTH)
    torque = log.torque + 0.02 * float(np.std(log.torque)) * rng.standard_normal(len(t))
    rec = ga.Record(JOINT.dt, velocity=log.velocity, torque=torque, position=log.position, torque_is="measured")
    return SimpleNamespace(records=(rec,), torque_logged=True, axis="rotary")


def model(*effects: str) -> Any:
    terms = tuple(LIBRARY[e] for e in effects)
    return SimpleNamespace(effects=effects, parameters=SimpleNamespace(terms=terms, on_a_spring=False))


def limit(data: Any, terms: tuple[str, ...] | None, cutoff_hz: float) -> float:
    inertia = ga.inverse_dynamics(data.records[0], terms=terms, cutoff_hz=cutoff_hz).parameters["inertia"]
    return inertia.value + POLICY.heavier * inertia.std


def test_it_is_that_of_the_axis_with_the_terms_of_the_model() -> None:
    data = records()
    every = ga.inverse_dynamics(data.records[0])
    assert every.terms == ("inertia", "viscous", "coulomb", "gravity")
    whole = heaviest(data, model("coulomb_friction", "unbalance"))
    assert whole == pytest.approx(limit(data, every.terms, every.cutoff_hz), rel=1e-9)
    assert whole == pytest.approx(15.0, rel=0.1)
    less = heaviest(data, model("coulomb_friction"))
    assert less == pytest.approx(limit(data, ("inertia", "viscous", "coulomb"), every.cutoff_hz), rel=1e-9)
    assert abs(less - whole) > 0.02 * whole, "without gravity the axis has another inertia"


def test_in_one_direction_a_constant_torque_stands_for_dry_friction() -> None:
    data = records(offset=2.0)
    every = ga.inverse_dynamics(data.records[0])
    assert "coulomb" not in every.terms and "offset" in every.terms
    assert heaviest(data, model("coulomb_friction", "unbalance")) == pytest.approx(limit(data, every.terms, every.cutoff_hz))


def test_where_nothing_is_regressed_there_is_none() -> None:
    data = records()
    data.torque_logged = False
    assert heaviest(data, model("coulomb_friction")) is None
