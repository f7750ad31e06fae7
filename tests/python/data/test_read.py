"""read and read_columns: formats and dialects, real logs, and one clear error for whatever is wrong."""

from __future__ import annotations

import io
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import loadmat, savemat

from gaident.data import Record, read, read_columns
from gaident.data.formats.mat import variables
from gaident.errors import GaidentError, ReadError, RecordError
from places import SAMPLES
from samples.dialects import SAMPLE_CALLS, sample_log, tables
from samples.logs import GARBAGE, log_bytes, mat, rows, write

FILES = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.parametrize(("file", "call"), SAMPLE_CALLS, ids=[f"{k}-{c[0]}" for k, c in enumerate(SAMPLE_CALLS)])
def test_the_same_run_in_every_loggers_manner(file: str, call: dict[str, Any]) -> None:
    rec, expected = read(SAMPLES / file, **call), sample_log()
    assert rec.dt == pytest.approx(expected.dt, rel=1e-9)
    assert rec.name == Path(file).stem
    for key, values in rec.channels():
        np.testing.assert_allclose(values, getattr(expected, key), atol=1e-5, err_msg=key)
    assert ("command" in call.get("columns", {})) <= (rec.command is not None)


def test_read_columns_says_what_the_file_holds() -> None:
    columns = read_columns(SAMPLES / "pairs.csv")
    assert list(columns) == ["Time #0", "Speed", "Time #2", "Current"]
    np.testing.assert_allclose(columns["Time #0"], np.arange(40) * 0.5e-3)
    text = read_columns(str(SAMPLES / "status_text.csv"))
    assert list(text) == ["date", "t", "state", "velocity", "torque"]
    assert np.isnan(text["state"]).all()
    text["t"][0] = 5.0
    assert not np.may_share_memory(text["t"], text["velocity"])


# ---- round trips of random tables in random dialects


@FILES
@given(tables())
def test_round_trip_of_random_tables(tmp_path: Path, table: tuple[Record, bytes, dict[str, Any]]) -> None:
    expected, raw, told = table
    path = tmp_path / "log.csv"
    path.write_bytes(raw)
    rec = read(path, **told)
    assert rec.dt == pytest.approx(expected.dt, rel=1e-3)
    assert {key for key, _ in rec.channels()} == {key for key, _ in expected.channels()}
    for key, values in rec.channels():
        np.testing.assert_allclose(values, getattr(expected, key), rtol=1e-12, atol=1e-14, err_msg=key)


@FILES
@given(
    kind=st.sampled_from(["mat", "npz", "csv", "utf16"]),
    cut=st.none() | st.integers(1, 5000),
    seed=st.integers(0, 10_000),
    flips=st.integers(0, 20),
)
def test_damaged_files_never_end_in_a_foreign_error(tmp_path: Path, kind: str, cut: int | None, seed: int, flips: int) -> None:
    raw = bytearray(log_bytes(kind))
    rng = np.random.default_rng(seed)
    for _ in range(flips):
        raw[rng.integers(len(raw))] = rng.integers(256)
    path = tmp_path / f"damaged.{'csv' if kind == 'utf16' else kind}"
    path.write_bytes(bytes(raw[:cut]))
    message = ""
    try:
        assert len(read(path)) >= 20
    except GaidentError as error:
        message = str(error)
    assert not message or "damaged." in message
    assert "\n" not in message


@FILES
@given(st.binary(max_size=300), st.sampled_from([".csv", ".txt", ".mat", ".npz", ""]))
def test_random_bytes_are_refused_in_one_sentence(tmp_path: Path, raw: bytes, ending: str) -> None:
    path = tmp_path / f"garbage{ending}"
    path.write_bytes(raw)
    with pytest.raises(GaidentError, match="garbage"):
        read(path, dt=1e-3)


# ---- dialects, one by one


def test_a_table_without_names(tmp_path: Path) -> None:
    path = write(tmp_path / "a.txt", "", rows(form="{t:.3f} {w:9.4f}  {u:.4f}"))
    assert list(read_columns(path)) == ["#0", "#1", "#2"]
    rec = read(path, columns={"time": "#0", "velocity": 1, "torque": "# 2"})
    np.testing.assert_allclose(rec.velocity, np.round(np.sin(np.arange(30)), 4))


def test_blanks_and_names_of_two_words(tmp_path: Path) -> None:
    body = rows(form="{t:.3f} {w:9.4f}  {u:.4f}")
    for header in ("t [s]  w [rpm]  u [Nm]", "t [s] w [rpm] u [Nm]"):
        assert list(read_columns(write(tmp_path / "a.txt", header, body))) == ["t [s]", "w [rpm]", "u [Nm]"]
    path = write(tmp_path / "b.txt", "time   motor speed   torque", body)
    assert list(read_columns(path)) == ["time", "motor speed", "torque"]


def test_quoted_numbers_with_decimal_commas_between_commas(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "t,velocity,torque", [
        ",".join(f'"{cell}"' for cell in row.replace(".", ",").split(";"))
        for row in rows(form="{t:.3f};{w:.4f};{u:.4f}")
    ])  # fmt: skip
    rec = read(path)
    np.testing.assert_allclose(rec.velocity, np.round(np.sin(np.arange(30)), 4))


def test_a_decimal_comma_that_comes_late(tmp_path: Path) -> None:
    body = [f"{k};0;{k}" for k in range(40)]
    body[7] = "7;0,5;7"
    rec = read(write(tmp_path / "a.csv", "t;velocity;torque", body))
    assert rec.velocity[7] == 0.5


def test_options_override_what_is_found(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "a;b\nx;y\nvelocity:torque", rows(form="{w:.4f}:{u:.4f}"))
    rec = read(path, dt=1.0, delimiter=":", decimal=".", skip=2, encoding="ascii", name="mine")
    assert (len(rec), rec.name) == (30, "mine")
    tabbed = write(tmp_path / "b.csv", "velocity\ttorque", rows(form="{w:.4f}\t{u:.4f}"))
    assert read(tabbed, dt=1.0, delimiter="tab").velocity[1] == pytest.approx(0.8415)


def test_fortran_exponents_and_bare_points(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "velocity,torque", ["1.5D-01,.5", "2.,-3E2"] * 10)
    rec = read(path, dt=1.0)
    np.testing.assert_array_equal(rec.velocity[:2], [0.15, 2.0])
    assert rec.torque is not None
    np.testing.assert_array_equal(rec.torque[:2], [0.5, -300.0])


# ---- MAT and NPZ


@pytest.mark.parametrize("kind", ["mat", "npz"])
def test_arrays_of_every_shape(tmp_path: Path, kind: str) -> None:
    k = np.arange(30)
    path = tmp_path / f"a.{kind}"
    arrays: dict[str, Any] = {
        "row": k.reshape(1, 30) * 1e-3,
        "column": k.reshape(30, 1).astype(np.uint8),
        "flat": k.astype(np.int16),
        "data": np.column_stack([k, 2 * k, 3 * k]).astype(np.float32),
        "wide": np.vstack([k, 5 * k]),
        "gain": np.array(3.5),
        "label": np.array("text"),
    }
    if kind == "mat":
        savemat(path, arrays)
    else:
        np.savez(path, **arrays)
    for address, expected in {
        "column": k,
        "flat": k,
        "data[:,1]": 2 * k,
        "data[ : , -1 ]": 3 * k,
        "wide[1,:]": 5 * k,
    }.items():
        rec = read(path, columns={"time": "row", "velocity": address, "torque": "data[:,2]"})
        assert rec.dt == pytest.approx(1e-3)
        np.testing.assert_array_equal(rec.velocity, expected)
    columns = read_columns(path)
    assert set(columns) == {
        "row",
        "column",
        "flat",
        "data[:,0]",
        "data[:,1]",
        "data[:,2]",
        "wide[0,:]",
        "wide[1,:]",
        "gain",
    }
    assert all(values.dtype == np.float64 and values.ndim == 1 for values in columns.values())
    with pytest.raises(ReadError, match=r"a\.\w+: velocity='data' is an array of 30 x 3.*'data\[:,0\]'.*zero based"):
        read(path, columns={"velocity": "data", "torque": "flat"}, dt=1.0)
    with pytest.raises(ReadError, match=r"velocity='data\[:,3\]'.*from 0 to 2"):
        read(path, columns={"velocity": "data[:,3]", "torque": "flat"}, dt=1.0)
    with pytest.raises(ReadError, match=r"no column 'label'.*besides 'label' \(text\)"):
        read(path, columns={"velocity": "label", "torque": "flat"}, dt=1.0)
    with pytest.raises(ReadError, match=r"unequal lengths \(velocity 1, torque 30\)"):
        read(path, columns={"velocity": "gain", "torque": "flat"}, dt=1.0)


@FILES
@given(
    dtype=st.sampled_from(["f8", "f4", "i8", "i4", "i2", "i1", "u8", "u4", "u2", "u1", "c16"]),
    shape=st.sampled_from([(1, 30), (30, 1), (30, 4), (4, 30), (1, 1), (0, 0)]),
    seed=st.integers(0, 1000),
    version=st.sampled_from(["4", "5"]),
    compressed=st.booleans(),
)
def test_mat_files_are_what_scipy_says(
    tmp_path: Path, dtype: str, shape: tuple[int, int], seed: int, version: str, compressed: bool
) -> None:
    values = (np.random.default_rng(seed).normal(size=shape) * 100).astype(dtype)
    content = {"a": values, "text": "label", "b": values.T}
    if version == "5":
        content |= {"log": {"w": values, "cell": np.array([1, "a"], dtype=object)}, "flag": values.real > 0}
    savemat(tmp_path / "a.mat", content, format=version, do_compression=compressed and version == "5")
    expected = loadmat(tmp_path / "a.mat")
    found = dict(variables((tmp_path / "a.mat").read_bytes()))
    names = {"a": expected["a"], "b": expected["b"]}
    if version == "5":
        names |= {"log.w": expected["log"][0, 0]["w"], "flag": expected["flag"]}
        assert found["log.cell"] == "cell"
    assert found["text"] == "text"
    for name, array in names.items():
        np.testing.assert_array_equal(found[name], array)


def test_structs_in_mat_files(tmp_path: Path) -> None:
    k = np.arange(30.0)
    savemat(tmp_path / "a.mat", {"log": {"w": k, "motor": {"u": -k}}})
    rec = read(tmp_path / "a.mat", columns={"velocity": "log.w", "torque": "log.motor.u"}, dt=1e-3)
    np.testing.assert_array_equal(rec.torque, -k)


def test_mat_version_4(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"velocity": np.arange(30.0), "torque": np.ones(30)}, format="4")
    assert len(read(tmp_path / "a.mat", dt=1e-3)) == 30


@pytest.mark.parametrize(("file", "raw", "call", "words"), GARBAGE, ids=[f"{k}-{g[0]}" for k, g in enumerate(GARBAGE)])
def test_one_clear_error(tmp_path: Path, file: str, raw: bytes, call: dict[str, Any], words: list[str]) -> None:
    path = tmp_path / file
    path.write_bytes(raw)
    with pytest.raises(GaidentError) as caught:
        read(path, **call)
    message = str(caught.value)
    assert isinstance(caught.value, ReadError | RecordError)
    assert caught.value.__cause__ is None
    assert "\n" not in message
    for word in words:
        assert word in message
    # what is judged before the file is opened names its argument, all else the file
    assert str(path) in message or re.match(r"(units|columns|dt|name|\w+_\w+|delimiter|decimal|skip|encoding|\w+=)", message)


def test_paths_that_are_no_file(tmp_path: Path) -> None:
    (tmp_path / "run1.csv").write_bytes(log_bytes("csv"))
    cases: list[tuple[Any, list[str]]] = [
        (tmp_path / "run2.csv", ["run2.csv: there is no such file", "did you mean 'run1.csv'"]),
        (tmp_path / "folder" / "run.csv", ["no such file", "nor a folder"]),
        (tmp_path, ["this is a folder", "one log file"]),
        ("", ["folder"]),
        ("a\0b", ["'a\\x00b'", "no such file"]),
        (b"run1.csv", ["path=b'run1.csv' is no path", "pathlib.Path"]),
        (3, ["path=3 is no path"]),
        (None, ["path=None is no path"]),
        (io.StringIO("t,w"), ["is no path"]),
        ("/dev/null", ["no regular file"]),
    ]
    for path, words in cases:
        with pytest.raises(ReadError) as caught:
            read(path)
        for word in words:
            assert word in str(caught.value), (path, str(caught.value))


def test_two_variables_of_one_name_in_a_mat_file(tmp_path: Path) -> None:
    one = mat(velocity=np.arange(30.0))
    (tmp_path / "a.mat").write_bytes(one + one[128:])
    with pytest.raises(ReadError, match=r"a\.mat: two variables are called 'velocity'; save"):
        read(tmp_path / "a.mat", dt=1.0)


def test_a_long_clean_log_is_read_fast_and_a_flaw_in_it_found(tmp_path: Path) -> None:
    n = 200_000
    lines = [f"{k // 1000},{k % 1000:03d};{k % 97},5;{k % 89},25" for k in range(n)]
    path = write(tmp_path / "a.csv", "t;velocity;torque", lines)
    start = time.process_time()
    assert len(read(path)) == n
    # about 0.5 s here; a million lines in a few seconds
    assert time.process_time() - start < 4.0
    lines[150_000] = lines[150_000].replace(",25", ",2?")
    with pytest.raises(ReadError, match=r"line 150002: torque column 'torque' contains '\d+,2\?'"):
        read(write(path, "t;velocity;torque", lines))


# ---- real logs, where they are at hand


def real(data_dir: Path, *parts: str) -> Path:
    path = data_dir.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"no real data: {path} is missing")
    return path


def test_real_rack_and_pinion_drive_trace(data_dir: Path) -> None:
    path = real(data_dir, "rack_pinion", "a3MR.csv")
    rec = read(
        path,
        columns={"velocity": "Servo motor speed", "torque": "Torque"},
        units={"velocity": "rpm", "torque": "%"},
        rated_torque=2.4,
    )
    assert len(rec) == 1024
    assert rec.dt == pytest.approx(0.666666e-3, rel=1e-9)
    assert rec.torque is not None
    assert rec.torque[0] == pytest.approx(-0.024)
    by_other_names = {"time": "#0", "velocity": "Analog 1", "torque": "Analog 2"}
    units: dict[str, str | float] = {"velocity": "rpm", "torque": 0.024}
    assert read(path, columns=by_other_names, units=units, name="a3MR").velocity[500] == rec.velocity[500]
    with pytest.raises(ReadError, match=r"11 columns are called 'Not selected'.*'#4', '#5'"):
        read(path, columns={"velocity": "Not selected", "torque": "Torque"}, units=units)


def test_real_rack_and_pinion_second_logger(data_dir: Path) -> None:
    path = real(data_dir, "rack_pinion", "a3NI.csv")
    columns: dict[str, str | int | None] = {"time": "#2", "position": "Input 1", "torque": "Force"}
    rec = read(path, columns=columns, units={"position": 1.0, "torque": 1.0}, velocity_cutoff_hz=200)
    assert (len(rec), rec.dt) == (1078, 0.5e-3)
    assert rec.position is not None
    assert rec.position[0] == pytest.approx(-3.2159208831317652, rel=1e-3)  # filtered as the force is
    with pytest.raises(ReadError, match="'V' is no unit of position"):
        read(path, columns=columns)


@pytest.mark.parametrize("file", ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"])
def test_real_emps(data_dir: Path, file: str) -> None:
    rec = read(
        real(data_dir, "emps", file),
        columns={"torque": "vir", "position": "qm", "time": "t"},
        units={"torque": 35.15065188248547},
        velocity_cutoff_hz=100,
    )
    assert len(rec) == 24841
    assert rec.dt == pytest.approx(1e-3, rel=1e-6)
    assert 0.1 < np.abs(rec.velocity).max() < 0.2
    columns = read_columns(real(data_dir, "emps", file))
    assert columns["gtau"][0] == 35.15065188248547
    if "PULSES" in file:
        assert columns["pulses_N"].dtype == np.float64
        assert columns["pulses_N"].max() > 0


@pytest.mark.parametrize("run", ["0.065_1", "0.065_2", "0.065_3", "0.06_1", "0.06_2", "0.06_3"])
def test_real_hsm150(data_dir: Path, run: str) -> None:
    columns = {"time": "data[:,0]", "velocity": "data[:,3]", "torque": "data[:,4]", "position": "data[:,2]"}
    rec = read(real(data_dir, "hsm150", f"idf_pos_{run}.mat"), columns=columns)
    assert (len(rec), rec.dt) == (20000, 1e-3)
    # an encoder of 10000 counts, differenced over 1 ms
    steps = np.unique(np.round(rec.velocity / 0.62831853, 3))
    assert np.abs(steps - np.round(steps)).max() < 0.01


def test_real_mat_files_are_what_scipy_says(data_dir: Path) -> None:
    files = [path for path in data_dir.rglob("*") if path.suffix.lower() == ".mat"]
    for path in files:
        expected = {name: array for name, array in loadmat(path).items() if not name.startswith("__")}
        found = dict(variables(path.read_bytes()))
        assert found.keys() == expected.keys()
        for name, array in expected.items():
            np.testing.assert_array_equal(found[name], array)


def test_real_coupled_electric_drives(data_dir: Path) -> None:
    rec = read(real(data_dir, "ced", "DATAUNIF.MAT"), columns={"torque": "u11", "velocity": "z11"}, dt=0.02)
    assert len(rec) == 500


def test_a_column_that_may_be_the_torque_and_is_not_read_is_named(tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    rows = "".join(f"{1e-3 * i:.3f},{i % 5},{0.1 * i},{0.02 * i},{i}\n" for i in range(40))
    log.write_text("t,w_ref,w,M [N m],M_load\n" + rows)
    columns: dict[str, str | int | None] = {"time": "t", "command": "w_ref", "velocity": "w"}
    (note,) = read(log, columns=columns).notes
    assert note.startswith("No torque is read, but by its name 'M' may be it: give columns={'torque': 'M'}"), note
    # What is read, and what the user says is none, is not asked for.
    assert not read(log, columns={**columns, "torque": "M"}).notes
    assert not read(log, columns={**columns, "torque": None}).notes
