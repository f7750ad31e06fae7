"""align: offset and rate between two clocks, how sure they are, and the refusal where the logs cannot tell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from gaident.data import align
from gaident.errors import RecordError

RATED = 2.4


def motion(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """A speed with four edges and a swing [rad/s]."""
    edges = [(0.5, 0.9, 80), (1.7, 2.0, -120), (3.1, 3.6, 60), (4.4, 4.5, -30)]
    steps = sum(h * np.clip((t - a) / (b - a), 0, 1) for a, b, h in edges)
    return np.asarray(steps + 3 * np.sin(2 * np.pi * 2.3 * t))


def pair(
    seed: int, offset: float, rate: float, dt: float, noise: float = 0.3, scale: float = 0.02
) -> tuple[ga.Record, dict[str, NDArray[np.float64]]]:
    """A record of 6 s and the channels of another logger, whose clock starts at `offset` and runs by `rate` slower."""
    rng = np.random.default_rng(seed)
    t, own = np.arange(6000) * 1e-3, np.arange(int(5.0 / dt)) * dt
    rec = ga.Record(1e-3, velocity=motion(t) + noise * rng.standard_normal(6000), command=motion(t))
    theirs = motion(offset + (1 + rate) * own)
    seen = scale * (theirs + noise * rng.standard_normal(len(own))) + 0.7
    return rec, {"velocity": seen, "torque": theirs}


@pytest.mark.parametrize(
    ("offset", "rate", "dt", "noise"),
    [(0.3137, 0.0, 0.5e-3, 0.3), (-0.4, 2e-4, 0.5e-3, 0.3), (0.05, -5e-5, 2e-3, 0.3), (0.3, 8e-4, 1e-3, 0.01)],
)
def test_offset_and_rate_are_right_within_what_is_claimed(offset: float, rate: float, dt: float, noise: float) -> None:
    off_by = []
    for seed in range(3):
        rec, other = pair(seed, offset, rate, dt, noise)
        found = align(rec, other, dt)
        off_by += [(found.offset - offset) / found.offset_std, (found.rate - rate) / found.rate_std]
        assert found.rate_seen == (found.rate != 0.0)
        assert found.gain == pytest.approx(0.02, rel=0.01)
        assert found.uncertainty < 1e-3  # a sample
        assert found.record.torque is not None
        start = int(np.flatnonzero(rec.velocity == found.record.velocity[0])[0])
        expected = motion(rec.time)[start : start + len(found.record)]
        assert np.abs(found.record.torque - expected).max() < 0.3  # half a sample on edges of 600 rad/s^2
    assert np.abs(off_by).max() < 4.0
    assert np.sqrt(np.mean(np.square(off_by))) < 2.0


def test_a_clear_difference_of_the_clocks_is_seen() -> None:
    found = align(*pair(3, 0.3, 8e-4, 0.5e-3, noise=0.02), 0.5e-3)
    assert found.rate_seen and found.rate == pytest.approx(8e-4, abs=4 * found.rate_std)
    assert "ppm" in found.summary() and "samples in common" in found.summary()


@pytest.mark.parametrize("rate", [3e-3, -6e-3])
def test_rates_beyond_the_limit_are_refused(rate: float) -> None:
    rec, other = pair(1, 0.3, rate, 1e-3)
    with pytest.raises(RecordError, match=r"rates differ by about -?0\.00[36].*, which is beyond max_rate=0\.001; .* larger"):
        align(rec, other, 1e-3)
    assert align(rec, other, 1e-3, max_rate=8e-3).rate == pytest.approx(rate, abs=2e-4)


def test_where_the_logs_cannot_tell_it_says_so() -> None:
    t = np.arange(4000) * 1e-3
    rec = ga.Record(1e-3, velocity=np.sin(20 * t), torque=t)
    later = {"velocity": np.sin(20 * t[:2000] + 1)}
    with pytest.raises(RecordError, match=r"repeats itself, and offsets of .* fit equally well; give within="):
        align(rec, later, 1e-3)
    assert align(rec, later, 1e-3, within=(0.0, 0.2)).offset == pytest.approx(0.05, abs=1e-6)
    noise = np.random.default_rng(0).standard_normal(2000)
    with pytest.raises(RecordError, match=r"best correlation is 0\.\d+; are they of the same run"):
        align(rec, {"velocity": noise}, 1e-3)
    with pytest.raises(RecordError, match="other's velocity is constant: there is no motion"):
        align(rec, {"velocity": np.ones(2000)}, 1e-3)


def test_wrong_use_of_align() -> None:
    rec, other = pair(0, 0.3, 0.0, 1e-3)
    for call, words in (
        (lambda: align(rec, other), r"give their sample time dt="),
        (lambda: align(rec, rec, 1e-3), r"dt=0\.001 is for channels without a Record"),
        (lambda: align(rec, {"speed": other["velocity"]}, 1e-3), "'speed' is no channel"),
        (lambda: align(rec, other["velocity"], 1e-3), "neither a Record nor a mapping"),  # type: ignore[arg-type]
        (lambda: align(rec, {"torque": other["torque"]}, 1e-3), "share no channel"),
        (lambda: align(rec, other, 1e-3, on="position"), "on='position': give a channel of rec"),
        (lambda: align(rec, other, 1e-3, take=["position"]), "take: other has no 'position'"),
        (lambda: align(rec, other, 1e-3, within=(20.0, 30.0)), "leaves no offset"),
        (lambda: align(rec, {"velocity": other["velocity"], "torque": [0.0] * 30}, 1e-3), "equal length"),
    ):
        with pytest.raises(RecordError, match=words):
            call()
    with pytest.raises(RecordError, match=r"two clocks.*align"):
        ga.Record(1e-3, velocity=rec.velocity, torque=other["torque"])


def test_real_trace_of_the_drive_and_second_logger(data_dir: Path) -> None:
    """Two files, two clocks: by velocity and by position the offset is the same, and the scale that of the pinion."""
    folder = data_dir / "rack_pinion"
    if not (folder / "a3MR.csv").is_file():
        pytest.skip(f"no real data: {folder} is missing")
    drive = ga.read(folder / "a3MR.csv", columns={"velocity": "Servo motor speed", "torque": "Torque"}, rated_torque=RATED)
    columns: dict[str, str | int | None] = {"position": "Input 1", "torque": "Force"}
    logger = ga.read(folder / "a3NI.csv", columns=columns, units={"position": 1.0, "torque": 1.0}, velocity_cutoff_hz=60)
    by_velocity = align(drive, logger, take=["position"])
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (drive.velocity[1:] + drive.velocity[:-1]))]) * drive.dt
    with_angle = ga.Record(drive.dt, velocity=drive.velocity, torque=drive.torque, position=turned)
    by_position = align(with_angle, logger, on="position", take=[])
    for found in (by_velocity, by_position):
        assert found.correlation > 0.999 and found.gain == pytest.approx(-0.1768, rel=2e-3)
        assert not found.rate_seen  # half a second is too short for it
        assert len(found.record) > 800
    apart = abs(by_velocity.offset - by_position.offset)
    assert apart < 3 * np.hypot(by_velocity.offset_std, by_position.offset_std)
