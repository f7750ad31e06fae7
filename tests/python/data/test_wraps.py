"""Counters that run over: positions are continued, overflown integers refused, and what only looks like it is left alone."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from drive_rig import Noise, Plant, rig
from gaident.axis import said
from gaident.data.signals.wraps import Unwrapper, overflow
from gaident.errors import ReadError, RecordError

PLANT = Plant(3e-4, 2e-3, 0.03, 1.9, 1e-3)
COMMAND = np.repeat([40.0, -60.0, 25.0, 0.5], 500)
TURN = 2 * np.pi
PERIODS = {"turn": 1.0, "degrees": 360.0, "radians": TURN, "int16": 65536.0, "counts": 8000.0, "odd": 2730.6}


def motion() -> ga.Record:
    return rig(PLANT, COMMAND, noise=Noise(white=0.02), position_logged=True)


def wrapped(position: NDArray[np.float64], period: float, lowest: float = 0.0) -> NDArray[np.float64]:
    """A position of a turn per `period`, as a counter from `lowest` on shows it."""
    turned = position / TURN * period
    return (turned - lowest) % period + lowest


@pytest.mark.parametrize("name", PERIODS)
@pytest.mark.parametrize("blocks", [1, 7])
def test_a_wrapped_position_is_continued(name: str, blocks: int) -> None:
    period = PERIODS[name]
    rec = motion()
    assert rec.position is not None
    for lowest in (0.0, -0.5 * period):
        for step in (0.0, 1.0) if period > 1000 else (0.0,):  # of an encoder
            raw = wrapped(rec.position, period, lowest)
            raw = np.floor(raw) if step else raw
            one = Unwrapper()
            found = np.concatenate([one.push(part) for part in np.array_split(raw, blocks)])
            assert one.wraps >= 8 and one.period == pytest.approx(period, rel=1e-12 if name not in ("odd", "counts") else 3e-3)
            smooth = rec.position / TURN * period
            error = found - found[0] - (smooth - smooth[0])
            allowed = 2 * step + 1e-9 * period + one.wraps * abs(one.period - period)
            assert float(np.abs(error).max()) <= allowed
    counts = Unwrapper([8000.0])
    counts.push(np.floor(wrapped(rec.position, 8000.0)))
    assert counts.period == 8000.0  # where it is known, it is exact


def test_a_slow_axis_wraps_by_a_usual_range_alone() -> None:
    slow = np.floor(65536 + 0.3 * np.arange(-200, 200)) % 65536.0
    one = Unwrapper()
    np.testing.assert_allclose(np.diff(one.push(slow)), np.diff(np.floor(0.3 * np.arange(-200, 200))), atol=1)
    assert one.period == 65536.0 and one.wraps == 1


def test_what_only_looks_like_a_wrap_is_left_alone() -> None:
    rng = np.random.default_rng(0)
    n = np.arange(2000)
    spike = 0.01 * n
    spike[700] += 50.0
    for x in (
        motion().position,
        spike,  # it comes back at once
        np.where(n % 400 < 200, 5.0, -5.0) + 0.01 * rng.standard_normal(2000),  # a switched signal
        np.cumsum(rng.choice([-1.0, 1.0], 2000)),
        40.0 * rng.standard_normal(2000),
        np.sin(2.9 * n),  # three samples a period
        np.zeros(2000),
        np.repeat([0.0, 1.0], 1000),
    ):
        assert x is not None
        one = Unwrapper()
        assert one.push(x) is x and one.period is None and overflow(x) is None


def test_an_integer_that_overflowed() -> None:
    speed = 400 * np.sin(2e-3 * np.arange(4000)) + 0.3 * np.random.default_rng(1).standard_normal(4000)
    counted = np.round(speed / 0.01)
    short = (counted + 32768) % 65536 - 32768  # int16 of 0.01 rad/s: up to 327.67 rad/s
    for values, unit in ((short, 1.0), (0.01 * short, 0.01)):
        found = overflow(values)
        assert found is not None and found[1] == pytest.approx(65536 * unit, rel=1e-9)
        assert abs(values[found[0] + 1] - values[found[0]]) > 65000 * unit
        repaired = np.unwrap(values, period=found[1])
        np.testing.assert_allclose(repaired, counted * unit, atol=1e-6)
    assert overflow(counted) is None
    torque = np.sign(np.sin(0.01 * np.arange(3000))) + 1e-4 * np.round(50 * np.random.default_rng(2).standard_normal(3000))
    assert overflow(torque) is None  # a torque that is reversed at full size


@pytest.mark.parametrize("key", ["command", "velocity", "torque"])
def test_a_record_refuses_an_overflown_channel(key: str) -> None:
    counted = np.round(40_000 * np.sin(8e-3 * np.arange(2000)))
    channels = {"velocity": np.zeros(2000), "command": np.ones(2000), key: 1e-3 * ((counted + 32768) % 65536 - 32768)}
    with pytest.raises(
        RecordError, match=rf"^{key}: it jumps from 32\.\d+ to -32\.\d+ at sample \d+ .* numpy.unwrap\({key}, "
    ) as found:
        ga.Record(1e-3, **channels)
    period = float(str(found.value).rsplit("=", 1)[1].rstrip(")"))
    repaired = np.unwrap(channels[key], period=period)
    np.testing.assert_allclose(repaired, 1e-3 * counted, atol=1e-9)
    ga.Record(1e-3, **(channels | {key: repaired}))


@pytest.mark.long
def test_read_continues_a_position_and_results_say_so(tmp_path: Path) -> None:
    rec = motion()
    assert rec.position is not None
    rows = np.column_stack([rec.time, rec.command, rec.torque, np.floor(wrapped(rec.position, 65536.0))])
    path = tmp_path / "encoder.csv"
    np.savetxt(path, rows, delimiter=",", header="time,command,torque,position [counts]", comments="", fmt="%.10g")
    read = ga.read(path, counts_per_turn=65536)
    assert read.position is not None
    step = TURN / 65536
    assert float(np.ptp(read.position - rec.position)) < step + 1e-9
    # The derived velocity is the central difference: of the true angle but for one step of the counter over two samples.
    # Beside the velocity itself it is up to a dt/2 off where a step of the command begins, at a = kp 100/J 5 rad/s.
    off = np.abs(read.velocity - np.gradient(rec.position, rec.dt))
    assert off[1:-1].max() < 0.5 * step / rec.dt + 1e-6 and off.max() < step / rec.dt + 1e-6
    assert len(read.notes) == 1 and "times, by 65536 counts, and was continued" in read.notes[0]
    # A gear's load side, a coarser log and an even axis see the continued one.
    decimated = ga.read(path, counts_per_turn=65536, decimate=4)
    assert decimated.position is not None and np.abs(np.diff(decimated.position)).max() < 0.4 and decimated.notes == read.notes
    even = ga.read(path, counts_per_turn=65536, resample=1e-3)
    assert even.position is not None and np.abs(np.diff(even.position)).max() < 0.1 and even.notes == read.notes
    for made in (read[5:], read.with_channels(command=None), read.shifted(torque=1), ga.Record.from_dict(read.to_dict())):
        assert made.notes == read.notes
    assert read == ga.Record.from_dict({**read.to_dict(), "notes": []}) and rec.notes == ()
    dia = ga.diagnose(read, PLANT.controller)
    assert read.notes[0] in dia.notes
    idn = ga.identify(read, controller=PLANT.controller)
    assert read.notes[0] in idn.warnings


@pytest.mark.parametrize("period", [TURN, 65536 / 4000 * TURN, 65536 / 8192 * TURN], ids=["turn", "16 bit, 4000", "16 bit, 8192"])
@pytest.mark.parametrize("step", [0.0, TURN / 4000], ids=["exact", "counts"])
def test_a_record_continues_a_position_that_its_velocity_goes_through(period: float, step: float) -> None:
    rec = motion()
    assert rec.position is not None
    turned = 8.0 * rec.position  # through the range of 16 bits, too
    turned = step * np.floor(turned / step) if step else turned
    velocity = 8.0 * rec.velocity
    raw = wrapped(turned / period * TURN, period, -0.5 * period)
    made = ga.Record(rec.dt, velocity=velocity, torque=rec.torque, position=raw, notes=["first"])
    assert made.position is not None and not made.position.flags.writeable
    off = made.position - turned - np.mean(made.position - turned)
    assert float(np.abs(off).max()) < 0.002 * period
    assert made.notes[0] == "first" and f"by {period:.4g}"[:7] in made.notes[1] and "was continued" in made.notes[1]
    assert said(made.notes[1], "linear") == made.notes[1].replace(" rad", " m")
    again = made.with_channels(velocity=velocity + 1e-3)
    assert again.notes == made.notes and np.array_equal(again.position, made.position)
    ahead = np.concatenate([turned[4:], np.full(4, turned[-1])])  # a command that the axis follows 4 samples late
    asked = wrapped(ahead / period * TURN, period, -0.5 * period)
    driven = ga.Record(rec.dt, velocity=velocity, position=raw, position_command=asked)
    assert driven.position is not None and driven.position_command is not None
    np.testing.assert_allclose(driven.position_command - driven.position, ahead - turned, atol=0.002 * period)
    given = rec.with_channels(velocity=velocity, position=raw)
    assert given.position is not None and given.notes == made.notes[1:] and np.array_equal(given.position, made.position)
    for same in (made[5:], ga.Record.from_dict(made.to_dict()), pickle.loads(pickle.dumps(made))):
        assert same.notes == made.notes


def test_a_record_leaves_a_position_as_it_is_where_nothing_wraps() -> None:
    """One that is continuous, one that comes back at once, and one that its velocity follows over the jump."""
    rec = motion()
    assert rec.position is not None
    spike = rec.position.copy()
    spike[700] += 500.0
    leap = 0.01 * np.arange(len(rec)) - 100.0 * (np.arange(len(rec)) > 900)
    for position, velocity in ((rec.position, rec.velocity), (spike, rec.velocity), (leap, np.gradient(leap, rec.dt))):
        made = ga.Record(rec.dt, velocity=velocity, torque=rec.torque, position=position)
        assert made.notes == () and np.array_equal(made.position, position)


def test_read_refuses_an_overflown_velocity(tmp_path: Path) -> None:
    speed = np.round(40000 * np.sin(2e-3 * np.arange(3000)))
    path = tmp_path / "int16.csv"
    rows = np.column_stack([1e-3 * np.arange(3000), (speed + 32768) % 65536 - 32768, speed])
    np.savetxt(path, rows, delimiter=",", header="time,velocity,torque", comments="", fmt="%.10g")
    said = r"line \d+: the velocity jumps from 327\d\d to -32[67]\d\d .*: an integer of 65536 overflowed"
    with pytest.raises(ReadError, match=said):
        ga.read(path)
    with pytest.raises(ReadError, match=r"numpy.unwrap\(values, period=65536\)"):
        ga.read(path, units={"velocity": 0.01})
