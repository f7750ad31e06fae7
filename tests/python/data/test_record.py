"""Record: what it refuses, what it keeps, how it is cut."""

from __future__ import annotations

import copy
import pickle
import re
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gaident as ga
from gaident.data import Record
from gaident.errors import GaidentError, RecordError

# What is drawn from stands here and is not made for each example, which would take longer than everything else.
LENGTHS = st.integers(20, 60)
SEEDS = st.tuples(st.integers(0, 10_000), st.sampled_from([0, 3, 290]))
COMMAND_AND_TORQUE = st.sampled_from([(True, False), (False, True), (True, True)])
SOME, TIMES = st.booleans(), st.floats(1e-6, 1.0)
# One of each kind; hypothesis would first make a table of all that there are.
NAMES = st.text("aZ0_ -./\\,;:%{}'\"\n\r\t\x00\x1f\x7f\xa0éßΩ漢\u0301\u200b\u2028\ufeff\ufffd😀\U0010ffff", max_size=5)


def array(length: int, drawn: tuple[int, int]) -> Any:
    """Numbers of all magnitudes that a record takes; drawn from a seed, for a thousand drawn numbers would take seconds."""
    seed, decade = drawn
    rng = np.random.default_rng(seed)
    return rng.normal(size=length) * 10.0 ** rng.integers(-decade, min(decade, 28) + 1, length)


@st.composite
def records(draw: st.DrawFn) -> Record:
    n = draw(LENGTHS)
    command, torque = (array(n, draw(SEEDS)) if there else None for there in draw(COMMAND_AND_TORQUE))
    return Record(
        draw(TIMES),
        command=command,
        velocity=array(n, draw(SEEDS)),
        torque=torque,
        position=array(n, draw(SEEDS)) if draw(SOME) else None,
        name=draw(NAMES),
    )


def simple(n: int = 30, dt: float = 1e-3, **more: Any) -> Record:
    return Record(dt, **{"command": np.ones(n), "velocity": np.arange(n), "name": "run", **more})


@given(records(), st.none() | st.integers(-70, 70), st.none() | st.integers(-70, 70))
def test_slicing_is_numpys(rec: Record, a: int | None, b: int | None) -> None:
    expected = rec.velocity[a:b]
    if expected.size < 20:
        with pytest.raises(RecordError, match=f"leaves {expected.size} samples, but at least 20"):
            rec[a:b]
        return
    cut = rec[a:b]
    assert len(cut) == expected.size
    assert cut.dt == rec.dt
    assert cut.name == rec.name
    assert {key for key, _ in cut.channels()} == {key for key, _ in rec.channels()}
    for key, values in rec.channels():
        np.testing.assert_array_equal(getattr(cut, key), values[a:b])
        assert not getattr(cut, key).flags.writeable


@given(records())
def test_nothing_in_a_record_can_be_changed(rec: Record) -> None:
    for key, values in rec.channels():
        assert values.dtype == np.float64
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1.0
        with pytest.raises(ValueError, match="WRITEABLE"):
            values.flags.writeable = True
        with pytest.raises(AttributeError):
            setattr(rec, key, values)


@given(LENGTHS, SEEDS)
def test_the_users_arrays_stay_as_they_are(n: int, drawn: tuple[int, int]) -> None:
    mine = array(n, drawn)
    before = mine.copy()
    rec = Record(1e-3, command=mine, velocity=mine)
    np.testing.assert_array_equal(mine, before)
    assert mine.flags.writeable
    mine += 1.0
    np.testing.assert_array_equal(rec.velocity, before)


@given(records())
def test_copies_and_pickles_are_equal_and_locked(rec: Record) -> None:
    for copied in (copy.copy(rec), copy.deepcopy(rec), pickle.loads(pickle.dumps(rec))):
        assert copied == rec
        assert copied.digest == rec.digest
        assert hash(copied) == hash(rec)
        assert not copied.velocity.flags.writeable


@given(records(), st.integers(0, 10_000), st.sampled_from(["velocity", "other"]))
def test_one_changed_value_changes_digest_and_equality(rec: Record, where: int, which: str) -> None:
    key = "velocity" if which == "velocity" else ("command" if rec.command is not None else "torque")
    values: dict[str, Any] = {name: array.copy() for name, array in rec.channels()}
    index = where % len(rec)
    values[key][index] = np.nextafter(values[key][index], np.inf) or 1.0
    other = Record(rec.dt, name=rec.name, **values)
    assert other != rec
    assert other.digest != rec.digest


@given(LENGTHS, st.integers(0, 100), st.sampled_from([np.nan, np.inf, -np.inf]), st.sampled_from([0, 1, 2, 3]))
def test_the_first_value_that_is_not_finite_is_named(n: int, where: int, value: float, which: int) -> None:
    keys = ("command", "velocity", "torque", "position")
    channels: dict[str, Any] = {key: np.zeros(n) for key in keys}
    index = where % n
    channels[keys[which]][index:] = value
    with pytest.raises(RecordError, match=re.escape(f"{keys[which]}[{index}] = {value}")):
        Record(1e-3, **channels)


@given(
    st.integers(20, 200),
    st.integers(0, 200),
    st.integers(1, 200),
    st.sampled_from([1e-3, 0.444e-3, 0.1, 1 / 3]),
)
def test_between_is_slicing_by_time(n: int, a: int, length: int, dt: float) -> None:
    rec = Record(dt, command=np.zeros(n), velocity=np.arange(n))
    b = a + length
    if max(0, min(b, n) - min(a, n)) < 20:
        with pytest.raises(RecordError, match="at least 20"):
            rec.between(a * dt, b * dt)
        return
    assert rec.between(a * dt, b * dt) == rec[a:b]


def test_between_takes_open_ends_and_parts_do_not_overlap() -> None:
    rec = simple(100)
    assert rec.between(-np.inf, np.inf) == rec
    assert rec.between(0, rec.duration) == rec
    first, second = rec.between(0.0, 0.0405), rec.between(0.0405, 1.0)
    assert (len(first), len(second)) == (41, 59)
    np.testing.assert_array_equal(np.concatenate([first.velocity, second.velocity]), rec.velocity)


def test_time_and_duration() -> None:
    rec = simple(25, dt=0.444e-3)
    np.testing.assert_allclose(rec.time, np.arange(25) * 0.444e-3, rtol=1e-15)
    assert rec.time[0] == 0.0
    assert rec.duration == pytest.approx(25 * 0.444e-3)
    assert rec[3:].time[0] == 0.0


def test_equality_and_digest() -> None:
    rec = simple()
    assert rec == simple()
    assert rec != simple(name="other")
    assert rec.digest == simple(name="other").digest
    assert rec != simple(dt=2e-3)
    assert rec.digest != simple(dt=2e-3).digest
    assert rec != "run"
    # A channel counts by its place: the same numbers as torque are another record.
    swapped = Record(1e-3, torque=np.ones(30), velocity=np.arange(30), name="run")
    assert rec != swapped
    assert rec.digest != swapped.digest
    minus = simple(command=-np.zeros(30))
    assert minus == simple(command=np.zeros(30))
    assert minus.digest == simple(command=np.zeros(30)).digest
    assert re.fullmatch("[0-9a-f]{64}", rec.digest)


def test_repr_says_what_is_inside() -> None:
    assert repr(simple()) == "Record('run', 30 samples, dt=0.001 s, 0.03 s; command 1..1, velocity 0..29)"


@pytest.mark.parametrize(
    "values",
    [
        list(range(30)),
        tuple(range(30)),
        np.arange(30, dtype=np.uint8),
        np.arange(30, dtype=np.int16),
        np.arange(30, dtype=np.float32),
        np.arange(30, dtype=">f8"),
        np.arange(60)[::2] / 2,
        np.arange(90.0).reshape(30, 3)[:, 0] / 3,
        np.ma.masked_array(np.arange(30)),
    ],
    ids=lambda values: f"{type(values).__name__}-{getattr(values, 'dtype', '')}",
)
def test_numbers_of_every_kind_become_float64(values: Any) -> None:
    rec = Record(1e-3, torque=values, velocity=values)
    np.testing.assert_array_equal(rec.velocity, np.arange(30.0))
    assert rec.velocity.flags.c_contiguous
    assert rec.velocity.dtype == np.dtype("=f8")


def test_large_whole_numbers() -> None:
    rec = Record(1, torque=[2**70] * 30, velocity=np.full(30, 2**63, dtype=np.uint64))
    assert rec.torque is not None
    assert rec.torque[0] == 2.0**70
    assert rec.velocity[0] == 2.0**63


ok = np.zeros(30)
REFUSED = [
    ({"velocity": None}, ["velocity=None", "differentiate"]),
    ({"command": None}, ["command=None and torque=None", "give one of them"]),
    ({"velocity": np.zeros(19)}, ["velocity has 19 samples", "at least 20", "longer"]),
    ({"velocity": []}, ["velocity has 0 samples"]),
    ({"velocity": np.zeros(31)}, ["command 30, velocity 31", "cut"]),
    ({"position": np.zeros(29)}, ["position 29"]),
    ({"velocity": np.zeros((30, 1))}, ["velocity has the shape (30, 1)", "velocity=x[:, 0]"]),
    ({"velocity": 3.0}, ["velocity has the shape ()"]),
    ({"velocity": np.zeros(30, complex)}, ["velocity is complex", "x.real"]),
    ({"velocity": np.zeros(30, bool)}, ["velocity is boolean", "astype"]),
    ({"velocity": np.zeros(30, object)}, ["velocity is object", "dtype=float"]),
    ({"velocity": ["1"] * 30}, ["velocity is text", "convert"]),
    ({"velocity": "1" * 30}, ["velocity has the shape ()"]),
    ({"velocity": [0.0] * 7 + [None] + [0.0] * 22}, ["velocity[7] = None", "real numbers"]),
    ({"velocity": [[1, 2], [3]] * 15}, ["velocity is no array", "one number per sample"]),
    ({"velocity": [10**400] * 30}, ["velocity", "too large", "scale"]),
    ({"velocity": np.zeros(30, "M8[s]")}, ["velocity is a date"]),
    ({"velocity": np.ma.masked_equal(np.arange(30), 4)}, ["velocity[4] is masked"]),
    ({"dt": 0}, ["dt=0", "positive", "dt=1e-3"]),
    ({"dt": -1e-3}, ["dt=-0.001"]),
    ({"dt": np.nan}, ["dt=nan"]),
    ({"dt": np.inf}, ["dt=inf"]),
    ({"dt": 10**400}, ["dt=1000", "finite"]),
    ({"dt": "1e-3"}, ["dt='1e-3' is no number"]),
    ({"dt": True}, ["dt=True is no number"]),
    ({"dt": np.array([1e-3])}, ["dt=array([0.001]) is no number"]),
    ({"dt": None}, ["dt=None is no number"]),
    ({"name": 3}, ["name=3", "str"]),
]


@pytest.mark.parametrize(("wrong", "words"), REFUSED, ids=[str(words[0]) for _, words in REFUSED])
def test_refusals_name_argument_value_and_remedy(wrong: dict[str, Any], words: list[str]) -> None:
    arguments: dict[str, Any] = {"dt": 1e-3, "command": ok, "velocity": ok, **wrong}
    with pytest.raises(RecordError) as caught:
        Record(**arguments)
    for word in words:
        assert word in str(caught.value)
    assert isinstance(caught.value, GaidentError)
    assert caught.value.__cause__ is None


@pytest.mark.parametrize(
    ("cut", "words"),
    [
        (lambda rec: rec[::2], ["rec[::2]", "step must be 1", "rec[a:b]"]),
        (lambda rec: rec[5:40:-1], ["rec[5:40:-1]", "step"]),
        (lambda rec: rec[5], ["rec[5]", "rec.velocity[n]"]),
        (lambda rec: rec[0.1:0.2], ["rec[0.1:0.2]", "between"]),
        (lambda rec: rec[5:10], ["rec[5:10] leaves 5 samples", "wider"]),
        (lambda rec: rec[30:5], ["leaves 0 samples"]),
        (lambda rec: rec.between(0.02, 0.01), ["t0 must be before t1"]),
        (lambda rec: rec.between(5, 6), ["between(5, 6) leaves 0 samples", "lasts 0.05 s"]),
        (lambda rec: rec.between(np.nan, 6), ["t0 is NaN"]),
        (lambda rec: rec.between("0", 6), ["t0 is no number"]),
        (lambda rec: rec.between(0, None), ["t1 is no number"]),
    ],
)
def test_wrong_cuts(cut: Any, words: list[str]) -> None:
    with pytest.raises(RecordError) as caught:
        cut(simple(50))
    for word in words:
        assert word in str(caught.value)


def test_a_cut_shares_memory_and_its_pickle_holds_only_the_cut() -> None:
    rec = simple(100_000)
    cut = rec[:100]
    assert np.shares_memory(cut.velocity, rec.velocity)
    assert len(pickle.dumps(cut)) < 10_000


def test_saving_where_there_is_no_folder_says_so(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"cannot write .*run1\.json: there is no folder .*none; create it first"):
        Record(1e-3, velocity=np.zeros(30), torque=np.ones(30)).save(tmp_path / "none" / "run1.json")


def test_a_long_record_costs_one_copy() -> None:
    n = 2_000_000
    velocity = np.zeros(n)
    tracemalloc.start()
    rec = Record(1e-3, torque=velocity, velocity=velocity)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # two channels of 8 bytes, and one mask of 1 byte while checking
    assert peak < n * (2 * 8 + 1) + 1_000_000
    assert len(rec[1:].digest) == 64


def test_data_does_not_import_scipy() -> None:
    code = "import sys, gaident.data; sys.exit(any(name.split('.')[0] == 'scipy' for name in sys.modules))"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_name_that_is_no_text_of_unicode_can_be_written(tmp_path: Path) -> None:
    """A file named in Latin-1 comes with its bytes as halves of characters, which no file and no picture takes."""
    rec = Record(1e-3, torque=np.ones(20), velocity=np.zeros(20), name="run\udce9 \ud800 é")
    assert rec.name == "runé \ufffd é"
    rec.save(tmp_path / "run.json")
    assert ga.load(tmp_path / "run.json") == rec
