"""A velocity late behind the logged angle: which of a filter and a lag it is, and what torque the motion needs."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga

DT, FILTER = 1e-3, 8e-3
AXIS = ga.OneMass(J=2e-3, D=4e-3)


def log(seed: int, filtered: bool = True, angle: bool = True) -> ga.Record:
    """An open loop; the encoder's angle is that of the shaft, the velocity is behind a filter or the torque behind a lag."""
    rng = np.random.default_rng(seed)
    torque = np.repeat(rng.uniform(-0.5, 0.5, 60), 50)
    # 100 steps to a sample, of exact exponentials: nothing of the library.
    fine, steps = DT / 100, 100
    share = 1.0 - np.exp(-fine / FILTER)
    w = theta = seen = at_shaft = 0.0
    rows = []
    for u in torque:
        rows.append((seen if filtered else w, theta))
        for _ in range(steps):
            at_shaft += share * (u - at_shaft)
            now = u if filtered else at_shaft
            w += fine * (now - AXIS.D * w) / AXIS.J
            theta += fine * w
            seen += share * (w - seen)
    velocity, position = np.transpose(rows)
    noise = 0.02 * rng.standard_normal(len(torque))
    return ga.Record(DT, velocity=velocity + noise, torque=torque, position=position if angle else None)


def test_the_torque_behind_an_angle_that_is_ahead_of_the_velocity_knows_no_filter() -> None:
    model = AXIS.model()
    behind = model.with_effect("velocity_filter", time_constant=FILTER)
    rec, alone = log(1), log(1, angle=False)
    assert ga.force_error(behind, rec).percent == pytest.approx(ga.force_error(model, rec).percent)
    assert ga.force_error(behind, rec).percent < 1.0
    # Where the motion is that of the late velocity, the torque has to be as late.
    assert ga.force_error(behind, alone).percent < 2.0 < ga.force_error(model, alone).percent
    # A lag of the torque is before the shaft, whatever makes the motion.
    late = model.with_effect("torque_lag", time_constant=FILTER)
    assert ga.force_error(late, log(1, filtered=False)).percent < 1.0 < ga.force_error(model, log(1, filtered=False)).percent


@pytest.mark.long
def test_an_angle_ahead_of_the_velocity_tells_a_filter_from_a_lag() -> None:
    dia = ga.diagnose(log(1), validation=log(2))
    assert dia.verdict == "explained" and [f.effect for f in dia.causes] == ["velocity_filter"], dia.summary()
    assert dia.causes[0].alternatives == ("log_shift",), "a log may have written the velocity late"
    assert dia.causes[0].parameters["time_constant"].value == pytest.approx(FILTER, rel=0.01)
    without = ga.diagnose(log(1, angle=False), validation=log(2, angle=False))
    (cause,) = without.causes
    assert {cause.effect, *cause.alternatives} >= {"velocity_filter", "torque_lag"}


@pytest.mark.long
def test_an_angle_that_accounts_for_a_part_of_what_is_late_excludes_no_lag() -> None:
    """A lag of the torque, and a velocity that is late behind the angle by one sample: not all of it is the sensor's."""
    records = []
    for seed in (1, 2):
        rec = log(seed, filtered=False)
        assert rec.position is not None
        late = np.append(np.zeros(2), rec.position[2:] - rec.position[:-2]) / (2 * DT)
        noise = 0.02 * np.random.default_rng(seed).standard_normal(len(rec))
        records.append(rec.with_channels(velocity=late + noise))
    dia = ga.diagnose(records[0], validation=records[1])
    named = {name for f in dia.causes for name in (f.effect, *f.alternatives)}
    assert "torque_lag" in named, dia.summary()


@pytest.mark.long
def test_a_record_at_rest_beside_a_moving_one_is_diagnosed() -> None:
    still = ga.Record(DT, velocity=np.zeros(500), position=np.zeros(500), torque=np.zeros(500))
    dia = ga.diagnose([log(1), still], validation=log(2))
    named = {name for f in dia.causes for name in (f.effect, *f.alternatives)}
    assert "velocity_filter" in named, dia.summary()
