"""What stands against a model, or against a loop that is designed on it: the records show a drive up to some frequency only."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

import gaident as ga
from gaident.identification.response.averaged import response_of
from gaident.remedies.doubts import beyond_the_records, shown_up_to

DT, EDGE = 1e-3, 40.0  # s; Hz, up to which the torque excites
DRIVE = ga.OneMass(J=1e-3, D=2e-3).model()


def record(seed: int = 1) -> ga.Record:
    rng = np.random.default_rng(seed)
    torque = sosfiltfilt(butter(8, EDGE, fs=1.0 / DT, output="sos"), rng.standard_normal(8000))
    run = ga.run(DRIVE, ga.Record(DT, velocity=np.zeros(8000), torque=torque), None)
    return ga.Record(DT, velocity=run.velocity + 0.05 * rng.standard_normal(8000), torque=torque)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_records_show_a_drive_as_far_as_its_torque_moves_it(seed: int) -> None:
    shown = shown_up_to([record(seed)])
    assert shown is not None and EDGE < shown < 3.0 * EDGE
    assert shown_up_to([ga.Record(DT, command=np.ones(2000), velocity=np.ones(2000))]) is None


def test_a_loop_that_goes_beyond_is_a_doubt() -> None:
    f = np.geomspace(1.0, 400.0, 200)
    fast, slow = ((edge / f).astype(complex) for edge in (200.0, 20.0))
    (doubt,) = beyond_the_records([record()], f, fast)
    assert doubt.startswith("The size of the proposed loop is 1 up to 19") and "Raise the gains in steps" in doubt
    assert beyond_the_records([record()], f, slow) == () == beyond_the_records([], f, fast)


def test_a_model_is_not_shown_as_an_estimate_from_a_measured_torque() -> None:
    """It would answer the noise of that torque, and the drive did not."""
    commanded, measured = (response_of(record().with_channels(torque_is=kind), DRIVE) for kind in ("commanded", "measured"))
    assert commanded.simulated is not None and measured.simulated is None
    assert "its noise makes the estimate too small" in measured.measured.sentence
    assert "its noise" not in commanded.measured.sentence
