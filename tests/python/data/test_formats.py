"""Logs of every format: what drive tools write, HDF5 and MAT 7.3, Parquet, TDMS, MDF, DataFrame; rates, clocks, long logs."""

from __future__ import annotations

import datetime
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.data import read, read_columns
from gaident.data.formats import delimited
from gaident.data.signals.resampling import resampled
from gaident.data.timeaxis import even_step
from gaident.errors import ReadError, RecordError
from places import SAMPLES
from samples.dialects import sample_log

REC = sample_log()
RPM = 60 / (2 * np.pi)
NAMES = {"command": "r", "velocity": "w", "torque": "u"}


def check(rec: ga.Record, start: int = 0) -> None:
    """The record is the sample's, from sample `start`."""
    assert rec.dt == pytest.approx(REC.dt, rel=1e-5)
    for key, values in rec.channels():
        np.testing.assert_allclose(values, getattr(REC, key)[start : start + len(rec)], atol=1e-5, err_msg=key)


SCOPE = {"command": "SetVelocity", "velocity": "Axes.Axis 1.ToPlc.ActVelocity", "torque": "fTorque"}
ROS = {"command": "field.command", "velocity": "field.velocity", "torque": "field.effort"}
JUGGLER = {"velocity": "/axis/joint_states/velocity", "torque": "/axis/joint_states/effort"}


@pytest.mark.parametrize(
    ("file", "columns"),
    [("scope.csv", SCOPE), ("scope_german.csv", SCOPE), ("rostopic.csv", ROS), ("plotjuggler.csv", JUGGLER)],
)
def test_drive_tools_and_ros(file: str, columns: dict[str, str | int | None], monkeypatch: pytest.MonkeyPatch) -> None:
    check(read(SAMPLES / file, columns=columns))
    monkeypatch.setattr(delimited, "WHOLE", 0)  # the same, read block by block
    check(read(SAMPLES / file, columns=columns))


def test_channels_of_several_rates_are_joined_only_on_request() -> None:
    slow: dict[str, str | int | None] = {"velocity": "ActVelocity", "torque": "Temperature"}
    assert len(read_columns(SAMPLES / "scope.csv")["Temperature"]) == 10
    with pytest.raises(ReadError, match=r"time columns of their own \('Time #0', 'Time #4'\).*resample="):
        read(SAMPLES / "scope.csv", columns=slow)
    with pytest.raises(ReadError, match=r"resample=0\.01 s is coarser.*decimate=20"):
        read(SAMPLES / "scope.csv", columns=slow, resample=0.01)
    with pytest.raises(ReadError, match=r"resample=1e-06 s is more than 100 times finer.*0\.0005 s.*give seconds"):
        read(SAMPLES / "scope.csv", columns=slow, resample=1e-6)
    rec = read(SAMPLES / "scope.csv", columns=slow, resample=0.5e-3)
    assert len(rec) == 37 and rec.torque is not None
    np.testing.assert_allclose(rec.torque, 30 + 0.125 * np.arange(37))
    check(ga.Record(rec.dt, velocity=rec.velocity, torque=REC.torque[:37] if REC.torque is not None else None))


def test_a_given_dt_is_compared_with_the_channels_own_clock(tmp_path: Path) -> None:
    columns: dict[str, str | int | None] = {"velocity": "ActVelocity", "torque": "ActTorque"}
    assert read(SAMPLES / "scope.csv", columns=columns, dt=0.5e-3).dt == 0.5e-3
    with pytest.raises(ReadError, match=r"dt=0\.002 s, but time column 'Time #0' has steps of 0\.0005 s"):
        read(SAMPLES / "scope.csv", columns=columns, dt=2e-3)
    assert read(SAMPLES / "scope.csv", columns={**columns, "time": None}, dt=2e-3).dt == 2e-3
    np.savez(tmp_path / "two.npz", **{"a.t": REC.time, "b.t": REC.time, "w": REC.velocity, "u": REC.torque})
    assert not any(c.is_time for c in ga.columns(tmp_path / "two.npz").columns)
    with pytest.raises(ReadError, match="2 columns are called 't'"):
        read(tmp_path / "two.npz", columns={"velocity": "w", "torque": "u"})


def test_irregular_stamps_are_refused_and_resampled_on_request() -> None:
    columns = {**JUGGLER, "command": "/axis/command"}
    with pytest.raises(ReadError, match=r"line 3: velocity column .* is empty.*resample="):
        read(SAMPLES / "merged_topics.csv", columns=columns)
    rec = read(SAMPLES / "merged_topics.csv", columns=columns, resample=0.5e-3)
    assert len(rec) == 39
    # From the first command on, 0.17 ms behind the first velocity.
    expected = np.interp(0.17e-3 + rec.time, REC.time, REC.velocity)
    np.testing.assert_allclose(rec.velocity, expected, atol=5e-3)  # doubles tell such stamps to 256 ns only


@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_stamps_that_jitter_are_those_of_samples_a_mean_step_apart(tmp_path: Path, unit: float) -> None:
    """Steps of 10 and 12 ms in turn: neither is the sample time."""
    stamps = np.cumsum(np.where(np.arange(400) % 2, 10.0, 12.0))
    name = "time [ms]" if unit == 1.0 else "time [s]"
    columns = np.column_stack([unit * stamps, np.sin(1e-3 * stamps), np.cos(1e-3 * stamps)])
    np.savetxt(tmp_path / "log.csv", columns, delimiter=",", header=f"{name},velocity,torque", comments="")
    with pytest.raises(ReadError, match=r"its steps are (11|0\.011) on average; put it on an even axis with") as caught:
        read(tmp_path / "log.csv")
    assert "resample=0.011;" in str(caught.value) and "give dt=0.011 and" in str(caught.value)
    assert read(tmp_path / "log.csv", resample=0.011).dt == 0.011
    assert read(tmp_path / "log.csv", columns={"time": None, "velocity": "velocity", "torque": "torque"}, dt=0.011).dt == 0.011


def test_even_samples_are_the_usual_step_apart_where_few_stamps_differ() -> None:
    assert even_step(np.array([2.0] * 30 + [6.0])) == (2.0, False)
    assert even_step(np.array([10.0, 12.0] * 20)) == (11.0, True)
    assert even_step(np.array([10.0, 12.0] * 20 + [500.0])) == (11.0, True)  # a pause is none of them
    rng = np.random.default_rng(1)
    assert even_step(np.diff(np.arange(5000) * 1.25 + rng.uniform(-0.4, 0.4, 5000))) == (1.25, True)


def test_a_pause_of_the_logger_is_not_bridged(tmp_path: Path) -> None:
    t = np.concatenate([np.arange(100), 600 + np.arange(100)]) * 1e-3
    np.savez(tmp_path / "pause.npz", time=t, command=np.ones(200), velocity=np.sin(50 * t))
    with pytest.raises(ReadError, match=r"irregular.*split the log there into two records, as read_pieces does .*; if") as caught:
        read(tmp_path / "pause.npz")
    assert "resample" not in str(caught.value)
    with pytest.raises(ReadError, match=r"gap of 0\.501 s, from 0\.099 to 0\.6 s, where.* 0\.001 s.*split the log there"):
        read(tmp_path / "pause.npz", resample=1e-3)
    # What only one channel contains is not used, and no pause of it matters.
    early = {"v": (np.arange(100) * 1e-3, np.ones(100)), "r": (np.append(-5.0, np.arange(100) * 1e-3), np.ones(101))}
    assert len(resampled("log", early, 1e-3)["r"]) == 100
    lost = np.delete(np.arange(200), [50, 51, 120]) * 1e-3  # a few lost samples are
    np.savez(tmp_path / "lost.npz", time=lost, command=np.ones(197), velocity=np.sin(50 * lost))
    with pytest.raises(ReadError, match=r"resample=0\.001"):
        read(tmp_path / "lost.npz")
    assert len(read(tmp_path / "lost.npz", resample=1e-3)) == 200


def hdf(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        group = file.create_group("run")
        group["t"], group["r"] = REC.time, REC.command
        group["w"] = REC.velocity * RPM
        group["w"].attrs["unit"] = "rpm"
        group["data"] = np.column_stack([REC.time, REC.torque])
        group["note"] = "a text"
        table = np.zeros(40, dtype=[("u", "f8"), ("state", "S4")])
        table["u"] = REC.torque
        file["table"] = table


def mat73(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in {"t": REC.time[None], "r": REC.command, "w": REC.velocity, "u": REC.torque}.items():
            file[f"log/{name}"] = np.atleast_2d(value)
            file[f"log/{name}"].attrs["MATLAB_class"] = np.bytes_("double")
        file["both"] = np.vstack([REC.time, REC.torque])  # MATLAB's 40 x 2, stored column by column
        file["#refs#/a"] = np.zeros(3)
        file["word"] = np.frombuffer("abc".encode("utf-16-le"), dtype="u2")[:, None]
        file["word"].attrs["MATLAB_class"] = np.bytes_("char")
    with open(path, "r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, HDF5 schema 1.00 .".ljust(116) + bytes(8) + b"\x00\x02IM")


def parquet(path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    import pyarrow.parquet as files

    fields = [pyarrow.field("t", pyarrow.timestamp("us")), pyarrow.field("r", pyarrow.float64())]
    fields += [pyarrow.field("w", pyarrow.float32(), metadata={"unit": "rpm"}), pyarrow.field("u", pyarrow.float64())]
    stamps = [datetime.datetime(2024, 5, 6) + datetime.timedelta(microseconds=500 * k) for k in range(40)]
    columns = [stamps, REC.command, (REC.velocity * RPM).astype(np.float32), REC.torque, ["on"] * 40]
    schema = pyarrow.schema([*fields, pyarrow.field("state", pyarrow.string())])
    files.write_table(pyarrow.table(columns, schema=schema), path, row_group_size=16)


def tdms(path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    wave = {"wf_increment": REC.dt, "wf_start_offset": 0.0}
    channels = [
        nptdms.ChannelObject("drive", "r", REC.command, wave),
        nptdms.ChannelObject("drive", "w", REC.velocity * RPM, {**wave, "unit_string": "rpm"}),
        nptdms.ChannelObject("drive", "u", REC.torque, wave),
        nptdms.ChannelObject("slow", "temperature", np.arange(10.0), {"wf_increment": 4 * REC.dt}),
    ]
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(channels)


def mdf(path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    file = asammdf.MDF(version="4.10")
    rows = [("r", REC.command, "rad/s"), ("w", REC.velocity * RPM, "rpm"), ("u", REC.torque, "Nm")]
    file.append([asammdf.Signal(x, REC.time, name=name, unit=unit) for name, x, unit in rows])
    file.append([asammdf.Signal(np.arange(10.0), REC.time[::4], name="temperature", unit="degC")])
    file.save(path, overwrite=True)
    file.close()


FORMATS: list[tuple[str, Callable[[Path], None], dict[str, str | int | None]]] = [
    ("log.h5", hdf, {"time": "run/t", "command": "r", "velocity": "w", "torque": "run/data[:,1]"}),
    ("log.hdf", hdf, {"time": "t", "command": "run/r", "velocity": "w", "torque": "table/u"}),
    ("log.mat", mat73, {**NAMES, "time": "log.t", "torque": "both[:,1]"}),
    ("log.parquet", parquet, {**NAMES, "time": "t"}),
    ("log.tdms", tdms, {**NAMES}),
    ("log.mf4", mdf, {**NAMES}),
]


# Each reading of an MDF is 2 s of import.
IN_TURN = [pytest.param(*row, id=row[0], marks=[pytest.mark.long] if row[1] is mdf else []) for row in FORMATS]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize(("file", "make", "columns"), IN_TURN)
def test_formats_of_other_libraries(
    file: str, make: Callable[[Path], None], columns: dict[str, str | int | None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / file
    make(path)
    check(read(path, columns=columns))
    without_name = tmp_path / "log.bin"  # known by its content alone
    path.rename(without_name)
    check(read(without_name, columns=columns))
    listed = read_columns(without_name)
    assert any(key.endswith("w") for key in listed) and not any(key.endswith(("note", "word", "state")) for key in listed)
    damaged = tmp_path / f"damaged{Path(file).suffix}"
    damaged.write_bytes(without_name.read_bytes()[: without_name.stat().st_size // 3])
    with pytest.raises(ReadError, match=r"damaged\."):
        read(damaged, columns=columns)

    for name in ("h5py", "pyarrow", "nptdms", "asammdf"):
        (tmp_path / f"{name}.py").write_text(f"raise ImportError('no {name}')")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ReadError, match=r'log\.bin: this is .* needs the library \w+.*pip install "gaident\[\w+\]"'):
        read(without_name, columns=columns)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("file", "make", "columns"), FORMATS, ids=[f"{row[0]}" for row in FORMATS])
def test_damaged_files_of_other_libraries_never_end_in_a_foreign_error(
    file: str,
    make: Callable[[Path], None],
    columns: dict[str, str | int | None],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    make(tmp_path / file)
    whole = np.frombuffer((tmp_path / file).read_bytes(), dtype=np.uint8)
    rng = np.random.default_rng(5)
    refused = 0
    for _ in range(30):
        raw = whole.copy()
        raw[rng.integers(len(raw), size=8)] = rng.integers(256, size=8)
        (tmp_path / file).write_bytes(raw[: rng.integers(8, len(raw)) if rng.random() < 0.2 else len(raw)].tobytes())
        try:
            read(tmp_path / file, columns=columns)
        except ga.GaidentError as error:
            assert "\n" not in str(error) and "log." in str(error)
            refused += 1
    assert refused
    assert capfd.readouterr() == ("", "")


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("version", ["3.30", "4.10"])
def test_a_channel_outside_its_record_is_refused(version: str, tmp_path: Path) -> None:
    """asammdf itself would read there, and end the process."""
    asammdf = pytest.importorskip("asammdf", reason="asammdf is not installed: pip install 'gaident[mdf]'")
    file = asammdf.MDF(version=version)
    file.append([asammdf.Signal(REC.velocity, REC.time, name="w"), asammdf.Signal(REC.torque, REC.time, name="u")])
    path = Path(file.save(tmp_path / "log.mf4"))
    file.close()
    assert len(read(path, columns={"velocity": "w", "torque": "u"})) == len(REC)
    with asammdf.MDF(path) as written:
        channel = written.groups[0].channels[1]
        # Where its block says at which bit (version 3, 2 bytes) or byte (version 4, 4 bytes) of the record it begins.
        at = channel.address + (186 if version == "3.30" else 24 + 8 * channel.links_nr + 4)
    raw = bytearray(path.read_bytes())
    raw[at : at + 2] = b"\xff\xff"
    path.write_bytes(raw)
    with pytest.raises(ReadError, match=r"not a whole MDF file \(channel 'w' lies outside its record\)"):
        read(path, columns={"velocity": "w", "torque": "u"})


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize(("file", "make", "word"), [("log.tdms", tdms, "several rates"), ("log.mf4", mdf, "of their own")])
def test_two_rates_in_one_file_of_a_logger(file: str, make: Callable[[Path], None], word: str, tmp_path: Path) -> None:
    make(tmp_path / file)
    columns: dict[str, str | int | None] = {"velocity": "w", "torque": "temperature"}
    units: dict[str, str | float] = {"torque": 1.0}
    with pytest.raises(ReadError, match=rf"{word}.*resample="):
        read(tmp_path / file, columns=columns, units=units)
    rec = read(tmp_path / file, columns=columns, units=units, resample=0.5e-3)
    assert len(rec) == 37 and rec.torque is not None
    np.testing.assert_allclose(rec.torque, 0.25 * np.arange(37))


def test_data_frames_by_the_names_of_their_columns(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"t": REC.time, "r": REC.command, "w": REC.velocity * RPM, "u": REC.torque, "s": ["on"] * 40})
    before = frame.copy()
    rec = read(frame, columns=NAMES, units={"velocity": "rpm"}, name="mine")
    check(rec)
    assert rec.name == "mine" and frame.equals(before)
    dated = frame.set_index(pandas.Timestamp("2024-05-06") + pandas.to_timedelta(frame["t"], unit="s")).drop(columns="t")
    check(read(dated, columns=NAMES, units={"velocity": "rpm"}))
    whole = frame.astype({"u": "Float64"})
    check(read(whole, columns=NAMES, units={"velocity": "rpm"}))
    whole.loc[7, "u"] = pandas.NA
    with pytest.raises(ReadError, match="DataFrame, index 7: torque column 'u'"):
        read(whole, columns=NAMES)
    with pytest.raises(ReadError, match=r"there is no column 'omega' for velocity.*'t', 'r', 'w', 'u', 's'"):
        read(frame, columns={"velocity": "omega", "torque": "u"})
    with pytest.raises(ReadError, match=r"one column only, 'w', but a record needs the velocity and a command or torque$"):
        read(frame[["w"]], columns={"velocity": "w"}, dt=1e-3)
    with pytest.raises(ReadError, match=r"delimiter= is for text tables, but a DataFrame"):
        read(frame, columns=NAMES, delimiter=";")


# ---- long logs


@pytest.fixture(scope="module")
def long_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """40001 rows, 1.2 MB: a slow sine with noise of a high frequency on top."""
    n = 40_001
    t = np.arange(n) * 1e-4
    w = 50 * np.sin(2 * np.pi * 3 * t) + np.cos(np.pi * np.arange(n))
    body = "\n".join(
        f"{a:.4f},{b:.6f},{c:.6f},{k % 7},{k % 5}" for k, (a, b, c) in enumerate(zip(t, w, np.gradient(w), strict=True))
    )
    path = tmp_path_factory.mktemp("long") / "long.csv"
    path.write_text("t [s],w [rad/s],u [Nm],state,more\n" + body + "\n")
    return path


LONG: dict[str, str | int | None] = {"velocity": "w", "torque": "u"}


def test_a_long_log_is_decimated_as_it_is_read(long_log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = read(long_log, columns=LONG)
    monkeypatch.setattr(delimited, "WHOLE", 1 << 10)
    assert read(long_log, columns=LONG) == whole
    rec = read(long_log, columns=LONG, decimate=50)
    assert rec == whole.decimate(50)
    assert (len(rec), rec.dt) == (801, pytest.approx(5e-3))
    # In phase, and nothing folded.
    np.testing.assert_allclose(rec.velocity[60:-60], 50 * np.sin(2 * np.pi * 3 * rec.time[60:-60]), atol=0.02)


def test_memory_does_not_grow_with_the_log(long_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(delimited, "WHOLE", 1 << 10)
    monkeypatch.setattr(delimited, "_HEAD", 1 << 15)
    rows = long_log.read_text().splitlines(keepends=True)
    peaks = []
    for count in (17_000, 17_000, 40_000):  # the first run pays for imports
        path = tmp_path / "part.csv"
        path.write_text("".join(rows[:count]))
        tracemalloc.start()
        read(path, columns=LONG, decimate=50)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.1 * peaks[1]


def test_memory_does_not_grow_with_an_hdf5_log(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    n = 2_000_000
    with h5py.File(tmp_path / "long.h5", "w") as file:
        for name in ("t", "w", "u"):
            file.create_dataset(name, data=np.arange(n) * 1e-3, chunks=(1 << 14,))
    tracemalloc.start()
    rec = read(tmp_path / "long.h5", columns=LONG, decimate=100)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(rec) == n // 100
    assert peak < 0.25 * 3 * 8 * n  # 12 MB of 48


def test_flaws_of_a_long_log_bear_their_line(long_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(delimited, "WHOLE", 1 << 10)
    lines = long_log.read_text().splitlines()[:20_001]
    for row, text, words in (
        (15_000, "x,1,2,3,4", "line 15001: time column 't .s.' contains 'x'"),
        (15_000, "1.5,1,2,3,4", r"line 15001: time column .* irregular: from 1\.4998 to 1\.5 it jumps by 0\.0002"),
        (8_193, "1,2", "line 8194: 2 fields where the other lines have 5"),
        (9_000, "0.8999,1,\x01,3,4", "line 9001: this is no text"),
    ):
        changed = [*lines[:row], text, *lines[row + 1 :]]
        path = tmp_path / "flaw.csv"
        path.write_text("\n".join(changed))
        with pytest.raises(ReadError, match=words):
            read(path, columns=LONG)
    monkeypatch.setattr(delimited, "_HEAD", 1 << 15)
    path.write_bytes("\n".join(lines).encode().replace(b"1.2000,", b"1.2000\xff,"))
    with pytest.raises(ReadError, match="damaged or no utf-8"):
        read(path, columns=LONG)


@pytest.mark.parametrize("factor", [1, 2, 7])
@pytest.mark.parametrize("n", [140, 1000])
def test_decimation_does_not_depend_on_the_blocks(factor: int, n: int) -> None:
    from gaident.data.signals.decimation import Decimator, decimated

    rng = np.random.default_rng(n + factor)
    x = rng.standard_normal(n).cumsum()
    piecewise, at = Decimator(factor), 0
    while at < n:
        step = int(rng.integers(1, 90))
        piecewise.push(x[at : at + step])
        at += step
    y = piecewise.finish()
    np.testing.assert_array_equal(y, decimated(x, factor))
    assert len(y) == -(-n // factor)


def test_decimation_keeps_slow_signals_and_stops_what_would_fold() -> None:
    from gaident.data.signals.decimation import Decimator

    decimator = Decimator(10)
    j = np.arange(-decimator.half, decimator.half + 1)
    of_new_nyquist = np.linspace(0, 10, 2001)
    gain = np.array([decimator.taps @ np.cos(np.pi / 10 * f * j) for f in of_new_nyquist])
    assert abs(gain[of_new_nyquist <= 0.8] - 1).max() < 3e-4
    assert abs(gain[of_new_nyquist >= 1.0]).max() < 10 ** (-72 / 20)
    ramp = ga.Record(1e-3, velocity=np.arange(1000.0), torque=np.ones(1000)).decimate(10)
    np.testing.assert_allclose(ramp.velocity, np.arange(0, 1000, 10), atol=1e-9)  # no delay, ends included
    assert ramp.dt == pytest.approx(1e-2)
    with pytest.raises(RecordError, match=r"decimate\(0\): give a whole number"):
        ramp.decimate(0)
    with pytest.raises(RecordError, match=r"decimate\(20\) leaves 5 samples"):
        ramp.decimate(20)


def test_a_gear_between_motor_and_sensor() -> None:
    columns: dict[str, str | int | None] = {"velocity": "ActVelocity", "torque": "ActTorque"}
    rec = read(SAMPLES / "scope.csv", columns=columns, gear_ratio=10.0, load_side="velocity")
    np.testing.assert_allclose(rec.velocity, 10 * REC.velocity, atol=1e-4)
    rec = read(SAMPLES / "scope.csv", columns=columns, gear_ratio=10.0, load_side=["torque"])
    assert rec.torque is not None and REC.torque is not None
    np.testing.assert_allclose(rec.torque, REC.torque / 10, atol=1e-6)
    for wrong in ({"gear_ratio": 10.0}, {"load_side": "torque"}, {"gear_ratio": -1.0, "load_side": "torque"}):
        with pytest.raises((ReadError, RecordError), match="gear_ratio"):
            read(SAMPLES / "scope.csv", columns=columns, **wrong)  # type: ignore[arg-type]
    with pytest.raises(ReadError, match="load_side is given without gear_ratio: give both or none"):
        read(SAMPLES / "scope.csv", columns=columns, load_side="torque")
    with pytest.raises(ReadError, match="load_side names 'position'"):
        read(SAMPLES / "scope.csv", columns=columns, gear_ratio=10.0, load_side=["position"])


@pytest.mark.parametrize("columns", [None, {"velocity": "w", "torque": "u"}])
@pytest.mark.parametrize(("header", "names"), [("t,u,w,x", 4), ("t,u", 2)])
def test_a_header_that_does_not_fit_the_rows_is_named(
    tmp_path: Path, columns: dict[str, str | int | None] | None, header: str, names: int
) -> None:
    (tmp_path / "log.csv").write_text(header + "\n" + "".join(f"{k},{k * k},{k % 3}\n" for k in range(30)))
    with pytest.raises(
        ReadError, match=f"the header has {names} names, the rows have 3 cells, so the file contains '#0', '#1', '#2'"
    ):
        read(tmp_path / "log.csv", columns, dt=1e-3)
