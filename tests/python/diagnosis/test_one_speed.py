"""Drag at one speed is viscous friction there: where a record says so, and where it does not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from gaident.diagnosis.experiments.excitation import excitation

DT = 1e-3
DRIVE = ga.OneMass(J=3e-4, D=2e-3).model().with_effect("coulomb_friction", torque=0.02)
STEEP = np.concatenate([np.linspace(0.0, 60.0, 800), np.linspace(60.0, -60.0, 1600), np.linspace(-60.0, 0.0, 800)])


def run(command: NDArray[np.float64], ki: float) -> ga.Record:
    """A run under the command; ki 0.2 N m/rad does not overshoot, 1.9 N m/rad by a fifth."""
    noise = 0.02 * np.random.default_rng(1).standard_normal(len(command))
    done = ga.run(DRIVE, ga.Record(DT, command=command - noise, velocity=noise), ga.PI(0.03, ki))
    return ga.Record(DT, command=command, velocity=done.velocity + noise, torque=done.torque)


def said(rec: ga.Record) -> str:
    return excitation(rec).not_testable.get("quadratic_drag", "")


@pytest.mark.parametrize("command", [np.full(1500, 40.0), np.repeat([40.0, -40.0] * 2, 400), np.repeat([40.0, 0.0] * 2, 400)],
                         ids=["a step", "both directions", "with rests"])  # fmt: skip
def test_one_speed_is_said(command: NDArray[np.float64]) -> None:
    rec = run(command, 0.2)
    top = float(np.abs(rec.velocity).max())
    assert 30.0 < top < 44.0
    why = said(rec)
    assert why.startswith("one speed only (") and why.endswith(" rad/s): its drag is viscous friction there")
    assert float(why.split("(")[1].split()[0]) == pytest.approx(top, rel=0.01)


@pytest.mark.parametrize("command", [np.repeat([40.0, 20.0] * 2, 400), np.repeat([40.0, -25.0] * 2, 400), STEEP,
                                     60.0 * np.sin(np.arange(3000) * DT * np.pi * 2.0)],
                         ids=["two speeds", "one in each direction", "a triangle", "a sine"])  # fmt: skip
def test_several_speeds_are_not_one(command: NDArray[np.float64]) -> None:
    assert said(run(command, 0.2)) == ""


def test_an_overshoot_of_more_than_a_tenth_is_another_speed() -> None:
    """The share of the time at the highest speed counts, and that is the overshoot's: the drag is tried."""
    rec = run(np.full(1500, 40.0), 1.9)
    assert rec.velocity.max() > 1.1 * 40.0 and said(rec) == ""
