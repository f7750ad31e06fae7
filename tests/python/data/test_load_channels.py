"""The two channels of a sensor at the load: what a record does with them."""

import json
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.data.signals.wraps import continued
from gaident.errors import RecordError

DT, N = 1e-3, 400
TIME = DT * np.arange(N)
VELOCITY = 20.0 * np.sin(12.0 * TIME) + 15.0
LOAD = -0.37 * DT * np.cumsum(VELOCITY) + 4.0
GIVEN = {"load_position": LOAD, "load_velocity": np.gradient(LOAD, DT)}


def record(**more: object) -> ga.Record:
    arguments = {"velocity": VELOCITY, "torque": np.cos(12.0 * TIME), **GIVEN, **more}
    return ga.Record(DT, **arguments)  # type: ignore[arg-type]


def test_a_record_keeps_what_a_sensor_at_the_load_shows() -> None:
    rec = record()
    assert rec.load_position is not None and np.array_equal(rec.load_position, LOAD)
    assert [name for name, _ in rec.channels()] == ["velocity", "torque", "load_position", "load_velocity"]
    assert not rec.load_position.flags.writeable
    assert "load_position 1" in repr(rec) and "load_velocity -1" in repr(rec)
    html = rec._repr_html_()
    assert "<tr><td>load_position</td><td></td>" in html and "<tr><td>load_velocity</td><td></td>" in html
    plain = record(load_position=None, load_velocity=None)
    assert plain.load_position is None and plain.load_velocity is None
    assert "load" not in repr(plain)


OPERATIONS: dict[str, tuple[Callable[[ga.Record], ga.Record], Callable[[np.ndarray], np.ndarray]]] = {
    "slice": (lambda r: r[30:90], lambda x: x[30:90]),
    "between": (lambda r: r.between(0.03, 0.09), lambda x: x[30:90]),
    "shifted": (lambda r: r.shifted(torque=-2), lambda x: x[:-2]),
    "shifted load": (lambda r: r.shifted(load_position=3, load_velocity=3), lambda x: x[:-3]),
    "with_channels": (lambda r: r.with_channels(velocity=r.velocity + 1.0), lambda x: x),
    "dict": (lambda r: ga.Record.from_dict(r.to_dict()), lambda x: x),
    "pickle": (lambda r: pickle.loads(pickle.dumps(r)), lambda x: x),
}


@pytest.mark.parametrize("name", OPERATIONS)
def test_every_operation_keeps_the_channels_of_the_load(name: str) -> None:
    operation, expected = OPERATIONS[name]
    found = operation(record())
    for channel, values in GIVEN.items():
        assert np.array_equal(getattr(found, channel), expected(values)), channel


def test_decimation_treats_the_load_as_the_motor() -> None:
    rec = record(load_velocity=-0.37 * VELOCITY).decimate(4)
    assert rec.load_velocity is not None and len(rec) == N // 4
    assert rec.load_velocity == pytest.approx(-0.37 * rec.velocity, abs=1e-9)


def test_a_saved_record_comes_back(tmp_path: Path) -> None:
    rec = record(name="run")
    rec.save(tmp_path / "run.json")
    loaded = ga.load(tmp_path / "run.json")
    assert loaded == rec and loaded.digest == rec.digest


def test_a_file_from_before_has_no_load(tmp_path: Path) -> None:
    old = record(load_position=None, load_velocity=None)
    old.save(tmp_path / "new.json")
    data = json.loads((tmp_path / "new.json").read_text())
    early = {key: value for key, value in data.items() if not key.startswith("load_")}
    (tmp_path / "old.json").write_text(json.dumps(early))
    assert ga.load(tmp_path / "old.json") == old


def test_the_digest_of_a_record_without_load_is_that_of_before() -> None:
    n = np.arange(20.0)
    rec = ga.Record(1e-3, command=n, velocity=n, position_command=n)
    assert rec.digest == "b90e8d9e8c66c714851bcef4e333505ed06366a4a78e8d0f5cde0a67d30767fb"
    assert len({rec.digest, *(rec.with_channels(**{name: n}).digest for name in GIVEN)}) == 3


def test_equality_knows_the_load() -> None:
    assert record() == record()
    assert record() != record(load_position=None)
    assert record() != record(load_position=LOAD + 1.0)


def test_the_arguments_have_to_be_named() -> None:
    n = np.zeros(20)
    with pytest.raises(TypeError):
        ga.Record(1e-3, n, n, n, n, "run", n)  # type: ignore[misc]


@pytest.mark.parametrize("channel", GIVEN)
def test_wrong_values_are_named(channel: str) -> None:
    with pytest.raises(RecordError, match=rf"unequal lengths.*{channel} 399"):
        record(**{channel: GIVEN[channel][:-1]})
    broken = GIVEN[channel].copy()
    broken[7] = np.nan
    with pytest.raises(RecordError, match=rf"{channel}\[7\] = nan, but every value must be finite"):
        record(**{channel: broken})
    with pytest.raises(RecordError, match=rf"{channel} has the shape \(400, 2\)"):
        record(**{channel: np.zeros((400, 2))})


def test_a_load_alone_is_no_record() -> None:
    with pytest.raises(RecordError, match="velocity=None"):
        ga.Record(1e-3, load_velocity=VELOCITY, command=VELOCITY)


@pytest.mark.parametrize("factor", [1.0, -0.05, 360.0])
@pytest.mark.parametrize("turn", [1.0, 360.0, 2.0 * np.pi, 4096.0, 17.3])
def test_a_load_position_that_wraps_is_continued_whatever_its_unit(factor: float, turn: float) -> None:
    time = 2e-3 * np.arange(6000)
    velocity = 3.0 + 2.0 * np.sin(0.5 * time)
    straight = factor * turn * 0.1 * (2e-3 * np.cumsum(velocity)) / max(1.0, abs(factor))
    rec = ga.Record(2e-3, velocity=velocity, command=velocity, load_position=straight % turn)
    assert rec.load_position is not None
    assert rec.load_position - rec.load_position[0] == pytest.approx(straight - straight[0], abs=1e-6 * turn)
    wrapped = bool(np.any(np.abs(np.diff(straight % turn)) > 0.5 * turn))
    assert len(rec.notes) == wrapped
    assert all("The load position wrapped" in note for note in rec.notes)


def test_a_load_that_jumps_because_the_motor_does_has_not_wrapped() -> None:
    velocity = np.full(N, -1.0)
    velocity[200:202] = 360.0 / 2.0
    load = np.cumsum(velocity)
    assert continued(load, velocity, 1.0, scaled=True) is None


def test_another_channel_does_not_wrap_the_load_again() -> None:
    turn = 2.0 * np.pi
    rec = record(load_position=(40.0 * LOAD) % turn, load_velocity=None)
    assert len(rec.notes) == 1
    changed = rec.with_channels(velocity=rec.velocity + 0.5)
    assert changed.notes == rec.notes and np.array_equal(changed.load_position, rec.load_position)  # type: ignore[arg-type]


def test_an_integer_of_the_load_that_overflowed_is_refused() -> None:
    counts = 32600.0 + np.arange(N)
    with pytest.raises(RecordError, match="load_velocity: it jumps"):
        record(load_velocity=np.where(counts > 32767.0, counts - 65536.0, counts))


def test_a_second_log_brings_the_load_along() -> None:
    def velocity(t: np.ndarray) -> np.ndarray:
        return 10.0 * np.tanh(40.0 * (t - 0.5)) + 3.0 * np.tanh(30.0 * (t - 1.1))

    w = velocity(1e-3 * np.arange(2000))
    rec = ga.Record(1e-3, command=w, velocity=w)
    later = 0.25 + 2e-3 * np.arange(800)
    second = {"load_velocity": -0.1 * velocity(later), "load_position": (7.0 * later) % 1.0}
    found = ga.align(rec, second, dt=2e-3, on=("velocity", "load_velocity")).record
    assert found.load_velocity == pytest.approx(-0.1 * found.velocity, abs=1e-3)
    assert found.load_position == pytest.approx(7.0 * (found.time - found.time[0]) + found.load_position[0], abs=1e-3)  # type: ignore[index]
