"""differentiate: exact on straight lines, right in gain and phase, refusals; the time axis of logs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaident.data import differentiate, read
from gaident.data.signals.conditioning import low_pass
from gaident.errors import ReadError, RecordError
from samples.logs import rows, write

DT = 1e-3


@given(
    st.floats(-100, 100),
    st.floats(-1000, 1000),
    st.sampled_from([None, 5.0, 50.0, 400.0]),
    st.integers(20, 300),
)
def test_constant_speed_comes_back_up_to_the_ends(offset: float, speed: float, cutoff: float | None, n: int) -> None:
    position = offset + speed * DT * np.arange(n)
    np.testing.assert_allclose(differentiate(position, DT, cutoff), speed, atol=1e-6 * max(1.0, abs(speed)))


def test_central_differences_without_a_cutoff() -> None:
    position = np.random.default_rng(1).normal(size=50)
    velocity = differentiate(position, DT)
    np.testing.assert_allclose(velocity[1:-1], (position[2:] - position[:-2]) / (2 * DT), rtol=1e-12)
    np.testing.assert_allclose(velocity[[0, -1]], [(position[1] - position[0]) / DT, (position[-1] - position[-2]) / DT])


@pytest.mark.parametrize("frequency", [5.0, 20.0, 50.0, 100.0])
def test_gain_of_the_filter_and_no_phase(frequency: float) -> None:
    # |H|^2 of a Butterworth filter of order 4, the bilinear transformation's frequency warped
    cutoff, t = 50.0, DT * np.arange(4000)
    warp = np.tan(np.pi * frequency * DT) / np.tan(np.pi * cutoff * DT)
    gain = np.sin(2 * np.pi * frequency * DT) / DT / (1 + warp**8)
    velocity = differentiate(np.sin(2 * np.pi * frequency * t), DT, cutoff)
    middle = slice(1000, 3000)
    expected = gain * np.cos(2 * np.pi * frequency * t)
    np.testing.assert_allclose(velocity[middle], expected[middle], atol=1e-6 * 2 * np.pi * frequency)


def test_is_linear_and_symmetric_in_time() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 400))
    both = differentiate(2 * a - 3 * b, DT, 80.0)
    np.testing.assert_allclose(both, 2 * differentiate(a, DT, 80.0) - 3 * differentiate(b, DT, 80.0), atol=1e-8)
    # forward-backward filtering forgets its direction but near the ends
    np.testing.assert_allclose(-differentiate(a[::-1], DT, 80.0)[::-1][100:-100], differentiate(a, DT, 80.0)[100:-100], atol=1e-6)


def test_leaves_the_input_alone() -> None:
    position = np.arange(100.0)
    differentiate(position, DT, 100.0)
    np.testing.assert_array_equal(position, np.arange(100.0))
    assert position.flags.writeable


x = np.zeros(40)
nan_at_7 = np.where(np.arange(40) == 7, np.nan, 0.0)
REFUSED: list[tuple[Any, Any, Any, list[str]]] = [
    (nan_at_7, DT, None, ["position[7] = nan", "cut"]),
    (np.zeros(5), DT, None, ["position has 5 samples", "at least 20"]),
    (np.zeros((40, 1)), DT, None, ["position has the shape (40, 1)"]),
    (["a"] * 40, DT, None, ["position is text"]),
    (x, 0.0, None, ["dt=0.0", "positive"]),
    (x, DT, 500.0, ["cutoff_hz=500 Hz", "Nyquist frequency 500 Hz", "lower corner"]),
    (x, DT, 0, ["cutoff_hz=0", "positive"]),
    (x, DT, -3.0, ["cutoff_hz=-3.0"]),
    (x, DT, np.nan, ["cutoff_hz=nan"]),
    (x, DT, "100", ["cutoff_hz='100' is no number"]),
]


@pytest.mark.parametrize(("position", "dt", "cutoff", "words"), REFUSED, ids=[row[3][0] for row in REFUSED])
def test_refusals(position: Any, dt: Any, cutoff: Any, words: list[str]) -> None:
    with pytest.raises(RecordError) as caught:
        differentiate(position, dt, cutoff)
    for word in words:
        assert word in str(caught.value)


# ---- the time axis of logs, and a velocity from their position


def test_velocity_is_derived_from_position(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "t,position [deg],torque", rows(100))
    rec, filtered = read(path), read(path, velocity_cutoff_hz=100.0)
    assert rec.position is not None and filtered.position is not None and filtered.torque is not None
    np.testing.assert_array_equal(rec.velocity, differentiate(rec.position, 1e-3))
    # Behind a corner all channels are filtered alike.
    np.testing.assert_array_equal(filtered.velocity, differentiate(rec.position, 1e-3, 100.0))
    np.testing.assert_array_equal(filtered.velocity, differentiate(filtered.position, 1e-3))
    np.testing.assert_array_equal(filtered.torque, low_pass(rec.torque, 1e-3, 100.0))
    assert rec.notes == () and "same zero-phase low-pass of 100 Hz" in filtered.notes[0]


TIMES = {
    "exact": (lambda k: f"{k * 1e-3:.6f}", 1e-3),
    "two thirds of a millisecond": (lambda k: f"{k * 0.000666666:.9f}", 0.000666666),
    "rounded in the fourth digit": (lambda k: f"{k * 2e-3 / 3:.4f}", 2e-3 / 3),
    "six significant digits": (lambda k: f"{1 + k * 0.444e-3:.6g}", 0.444e-3),
    "single precision": (lambda k: f"{np.float32(100 + k * 0.444e-3):.12g}", 0.444e-3),
    "late start": (lambda k: f"{12345.678 + k * 1e-3:.3f}", 1e-3),
    "before zero": (lambda k: f"{-0.05 + k * 1e-3:.4f}", 1e-3),
    "jitter of a clock": (lambda k: f"{k * 1e-3 + 2e-6 * math.sin(k):.9f}", 1e-3),
}


@pytest.mark.parametrize(("form", "dt"), TIMES.values(), ids=TIMES.keys())
def test_regular_time_axes(tmp_path: Path, form: Any, dt: float) -> None:
    n = 400
    path = write(tmp_path / "a.csv", "t,velocity,torque", [f"{form(k)},{k},{k}" for k in range(n)])
    rec = read(path)
    # the printed digits allow an error of one step over the whole record
    assert rec.dt == pytest.approx(dt, rel=2e-3)
    if form(1) == f"{dt:.9f}":
        assert rec.dt == pytest.approx(dt, rel=1e-9)
    # and one lost sample is found in each of them
    lines = [f"{form(k)},{k},{k}" for k in range(n) if k != 217]
    with pytest.raises(ReadError, match=r"a\.csv, line 219: time column 't' is irregular.*jumps.*resample"):
        read(write(tmp_path / "a.csv", "t,velocity,torque", lines))


def test_dt_and_time_column(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "t,velocity,torque", rows())
    assert read(path, dt=1.005e-3).dt == 1.005e-3
    assert read(path, dt=0.5, columns={"velocity": "velocity", "torque": "torque", "time": None}).dt == 0.5
    # a column that only happens to be called t does not stand in the way of dt
    text = write(tmp_path / "b.csv", "t,velocity,torque", [f"12:00:0{k % 10},{k},{k}" for k in range(30)])
    assert read(text, dt=2.0).dt == 2.0
