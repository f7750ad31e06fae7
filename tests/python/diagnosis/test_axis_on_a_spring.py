"""Blind: an axis under gravity, or on a spring to the ground: the right name and sizes, no cogging in gravity's place.

The drive is that of drive_rig.py, which shares no code with the library. Its torque drives the diagnosis, and no angle is logged.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from drive_rig import Array, Effects, Noise, Plant, rig, skip_without_library

skip_without_library()

PLANT = Plant(J=3e-4, D=1.5e-3, kp=0.03, ki=1.9, dt=2e-3)
TIME = PLANT.dt * np.arange(2000)
FRICTION = {"coulomb_friction": {"torque": 0.02}}


def swings(travel: float, frequency: float) -> Array:
    """The velocity command of two swings of different frequency [rad/s]; travel in rad."""
    parts = ((0.5, 1.0), (0.15, 3.3))
    return sum(s * travel * 2.0 * np.pi * r * frequency * np.sin(2.0 * np.pi * r * frequency * TIME) for s, r in parts)


def diagnosed(plant: Plant, effects: Effects, command: Array) -> ga.Diagnosis:
    log = rig(plant, command, effects, noise=Noise(white=0.02), seed=3)
    return ga.diagnose(ga.Record(log.dt, velocity=log.velocity, torque=log.torque))


def sizes(dia: ga.Diagnosis) -> dict[str, float]:
    """The first parameter of each finding."""
    return {f.effect: next(iter(f.parameters.values())).value for f in dia.findings}


@pytest.mark.long
@pytest.mark.parametrize(("travel", "frequency"), [(1.15, 1.3), (9.0, 0.7)], ids=["sixth of a turn", "through the top"])
def test_gravity_is_named(travel: float, frequency: float) -> None:
    gravity = {"unbalance": {"amplitude": 0.15, "phase": -0.5}}
    dia = diagnosed(PLANT, FRICTION | gravity, swings(travel, frequency))
    assert sizes(dia) == pytest.approx({"unbalance": 0.15, "coulomb_friction": 0.02}, rel=0.1)
    assert all(f.named for f in dia.findings) and "ground_stiffness" not in dia.mechanics
    assert dia.mechanics["inertia"].value == pytest.approx(PLANT.J, rel=0.05)
    assert "gravity acts" in dia.force_reason and not any("disagree" in note for note in dia.notes)


@pytest.mark.long
@pytest.mark.parametrize("rest", [0.0, 0.1], ids=["at rest", "under tension"])
def test_a_spring_to_the_ground_is_part_of_the_mechanism(rest: float) -> None:
    plant = replace(PLANT, ground=0.8, rest=rest)
    dia = diagnosed(plant, FRICTION, swings(0.6, 2.0))
    found = sizes(dia)
    assert found["coulomb_friction"] == pytest.approx(0.02, rel=0.1)
    # The tension where the record starts is a constant torque.
    assert found.get("load_torque", 0.0) == pytest.approx(-0.8 * rest, abs=4e-3) and len(found) == 1 + (rest > 0.0)
    assert dia.mechanics["ground_stiffness"].value == pytest.approx(0.8, rel=0.03)
    assert dia.mechanics["ground_stiffness"].unit == "N m/rad"
    assert dia.mechanics["inertia"].value == pytest.approx(PLANT.J, rel=0.05)
    assert {c.name: c.differs for c in dia.comparisons}["ground stiffness"] is False
    assert dia.after.force_percent < 5.0 and "ground stiffness" in dia.summary()


def test_without_a_spring_none_is_found() -> None:
    dia = diagnosed(PLANT, FRICTION, swings(1.15, 1.3))
    assert list(sizes(dia)) == ["coulomb_friction"] and set(dia.mechanics) == {"inertia", "viscous_friction"}
