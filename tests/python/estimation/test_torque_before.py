"""The torque that acted before a record: a delay and a lag of the torque contain it where the record begins."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.models.made_torque import load_before, stored_torque
from gaident.models.starts import torque_before

LOAD, DT = -1.5, 2.5e-4
AXIS = ga.OneMass(J=0.00875, D=0.0066).model().with_effect("load_torque", torque=LOAD)
LATE = {"transport_delay": {"delay": 4e-4}, "torque_lag": {"time_constant": 2e-4}}


def standing(n: int = 400, quiet: int = 40) -> ga.Record:
    """The load's torque, then steps around it."""
    steps = np.repeat(np.random.default_rng(0).choice([-1.0, 1.0], n // 20), 20)
    torque = LOAD + 20.0 * np.where(np.arange(n) < quiet, 0.0, steps)
    return ga.Record(DT, torque=torque, velocity=np.zeros(n))


@pytest.mark.parametrize("effect", LATE)
def test_an_axis_under_its_load_stands_until_the_torque_changes(effect: str) -> None:
    rec, late = standing(), AXIS.with_effect(effect, **LATE[effect])
    held = ga.simulate(late, rec, initial_state=[0.0, LOAD])
    assert np.max(np.abs(held[:40])) == 0.0 and np.ptp(held) > 1.0
    empty = ga.simulate(late, rec)
    fell = -LOAD * next(iter(LATE[effect].values())) / 0.00875  # by the load, as long as no torque acts
    assert empty[30] == pytest.approx(fell, rel=0.02), "from rest nothing acted before"
    in_motion = ga.simulate(late, rec, initial_state=[1.0])
    assert in_motion == pytest.approx(ga.simulate(late, rec, initial_state=[1.0, LOAD])), "else the first torque acted"


def test_one_number_more_is_the_torque_before_of_an_open_loop_only() -> None:
    rec, controller = standing().with_channels(command=np.zeros(400)), ga.PI(0.5, 5.0)
    plain = ga.OneMass(J=0.00875, D=0.0066)
    assert ga.simulate(plain, rec, initial_state=[2.0, 7.0]) == pytest.approx(ga.simulate(plain, rec, initial_state=[2.0]))
    for loop, states in ((None, [0.0, 0.0, 0.0]), (controller, [0.0, 0.0, 0.0])):
        with pytest.raises(ga.GaidentError, match="initial_state has the shape"):
            ga.simulate(plain, rec, loop, initial_state=states)
    with pytest.raises(ga.GaidentError, match="initial_state has the shape"):
        ga.simulate_many([plain], rec, initial_states=[[0.0, 0.0]])


@pytest.mark.parametrize(
    ("velocity", "stored", "before"),
    [
        (np.full(100, 5.0) + np.arange(100), 0.0, 3.0),  # in motion
        (np.concatenate([np.zeros(30), np.arange(70.0)]), 0.0, 3.0),  # a standstill is held
        (np.concatenate([np.zeros(30), np.arange(70.0)]), 2.5, 2.5),
        (np.arange(100.0), 0.0, 0.0),  # a step at its first line
        (np.arange(100.0), 2.5, 2.5),
    ],
)
def test_which_torque_acted_before(velocity: np.ndarray, stored: float, before: float) -> None:
    torque = np.full(100, 3.0)
    torque[50:] = 4.0
    assert torque_before(ga.Record(DT, velocity=velocity, torque=torque), stored) == before
    assert torque_before(ga.Record(DT, velocity=velocity, command=torque)) == 0.0


@pytest.mark.long
@pytest.mark.parametrize("given", [True, False])
def test_a_delay_under_a_standing_load_is_found_as_it_is(given: bool) -> None:
    """With an empty delay at the start it was half as long, a filter of the velocity beside it, and the load off."""
    skip_without_library()
    plant = Plant(J=0.00875, D=0.0066, kp=3.0, ki=40.0, dt=DT)
    levels = np.random.default_rng(2).choice([-1.0, 1.0], 150) * 20.0
    command = np.concatenate([np.zeros(60), np.repeat(levels, 20)])
    hidden: Any = {"load_torque": {"torque": LOAD}, "transport_delay": {"delay": DT}, "torque_lag": {"time_constant": 2.2e-4}}
    rec = rig(plant, command, hidden, Noise(white=0.04), 3, settle=4000)
    dia = ga.diagnose(rec, ga.PI(3.0, 40.0)) if given else ga.diagnose(rec.with_channels(command=None))
    assert len(dia.causes) == 3, dia.summary()
    by_name = {name: f.parameters for f in dia.causes for name in (f.effect, *f.alternatives)}
    assert set(hidden) <= set(by_name), "a filter of the velocity is as good as a lag of the torque"
    delay, lag = by_name["transport_delay"]["delay"], next(iter(by_name["torque_lag"].values()))
    assert abs(delay.value - DT) < 4.0 * delay.std and abs(lag.value - 2.2e-4) < 4.0 * lag.std, dia.summary()
    assert by_name["load_torque"]["torque"].value == pytest.approx(LOAD, rel=1e-3)


@pytest.mark.parametrize(("load", "cut"), [(0.0, 0), (0.0, 1), (LOAD, 0), (LOAD, 1)])
def test_a_record_that_was_cut_behind_a_step_begins_under_no_load(load: float, cut: int) -> None:
    """Its integrator holds what the error of the lines before has made."""
    controller, command = ga.PI(kp=1.0, ki=40.0), np.repeat([20.0, -20.0, 10.0], 100)
    drive = ga.OneMass(J=0.00875, D=0.0066).model().with_effect("load_torque", torque=load)
    drive = drive.with_effect("transport_delay", delay=2.0 * DT)  # so that it stands at the line behind the step, too
    made = ga.run(drive, ga.Record(DT, command=command, velocity=0.0 * command), controller, initial_state=[0.0, load])
    rec = ga.Record(DT, command=command, velocity=made.velocity, torque=made.torque)[cut:]
    assert (stored_torque(rec, controller) != 0.0) == bool(load or cut)
    assert load_before(rec, controller) == pytest.approx(load, rel=0.2) and load_before(rec, None) == 0.0
