"""Small files that stand for much: read or refused in seconds, within bounds of memory, and never by opening another file."""

from __future__ import annotations

import subprocess
import sys
import time
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.data.formats import delimited, table
from gaident.errors import ReadError

FUZZ = Path(__file__).resolve().parents[2] / "fuzz"
ROWS = "".join(f"{k * 1e-3:.3f},{k % 7},{k % 5}\n" for k in range(40))
HEAD = "t,torque,velocity"

TEXTS = {
    "digits in a cell": f"{HEAD}\n{'1' * 40_000},1,2\n{ROWS}",
    "digits that are no number": f"{HEAD}\n{ROWS}{'1' * 40_000}x,1,2\n",
    "digits in a title": f"{HEAD} [{'1' * 40_000}]\n{ROWS}",
    "square brackets": f"{HEAD}{'[' * 100_000}\n{ROWS}",
    "round brackets": f"{HEAD}{'(' * 100_000}\n{ROWS}",
    "pairs of brackets": f"{HEAD}{'[]' * 50_000}\n{ROWS}",
    "behind an open bracket": f"{HEAD} [{'a ' * 100_000}\n{ROWS}",
    "underlines": f"{HEAD}{'_' * 100_000}rad{'_' * 100_000}x\n{ROWS}",
    "a quoted title": f'{HEAD[:-8]}"velocity{"a" * 140_000}"\n{ROWS}',
    "a quoted cell": f'{HEAD}\n0,"{"a" * 140_000}",1\n{ROWS}',
    "blanks": f"{' ' * 200_000}{HEAD}\n{ROWS}",
    "columns": ",".join([HEAD, *["a"] * 20_000]) + "\n" + "".join(f"{k},1,2{',1' * 20_000}\n" for k in range(25)),
}


@pytest.mark.long
@pytest.mark.parametrize("name", TEXTS)
def test_a_text_takes_no_minutes(name: str, tmp_path: Path) -> None:
    """100 000 brackets in a title, or 40 000 digits before a letter, took minutes."""
    path = tmp_path / "log.csv"
    path.write_text(TEXTS[name])
    began = time.perf_counter()
    for read in (ga.columns, lambda p: ga.read(p, {"torque": "torque", "velocity": "velocity"}, dt=1e-3)):
        try:
            assert repr(read(path))
        except ReadError as error:
            assert "\n" not in str(error)
    assert time.perf_counter() - began < 10.0


def test_more_columns_than_a_log_has_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert table.MOST_COLUMNS == 100_000 and table.LONGEST_NAME == 10_000  # as SECURITY.md says
    path = tmp_path / "log.csv"
    path.write_text(f"{','.join('abcd')}\n" + "1,2,3,4\n" * 30)
    with monkeypatch.context() as few:
        few.setattr(table, "MOST_COLUMNS", 3)
        with pytest.raises(ReadError, match=r"log\.csv: 4 columns, and at most 3 are read; save those that belong"):
            ga.columns(path)
    np.savez(tmp_path / "log.npz", velocity=np.zeros(30), **{"a" * 10_001: np.zeros(30)})
    with pytest.raises(ReadError, match=r"the name of column #1 is 10001 characters long \('aaaaaaaaaaaaaaaaaaaa'\.\.\.\)"):
        ga.read(tmp_path / "log.npz", {"velocity": "velocity"}, dt=1e-3)
    path.write_text(f"{HEAD} {'a' * 10_000}\n{ROWS}")
    with pytest.raises(ReadError, match=r"the name of column #2 is 10009 characters long.*a quotation mark may lack its end"):
        ga.columns(path)


LIMITED = """
import resource, sys
import gaident as ga
ga.columns(sys.argv[2])
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
try:
    ga.read(sys.argv[1], {"torque": "torque", "velocity": "velocity"}, dt=1e-3)
except ga.errors.ReadError as error:
    print(error)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def npz(path: Path) -> None:
    """Two arrays of 800 MB of zeros, in a file of 1.6 MB."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("torque", "velocity"):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": (100_000_000,)})
                for _ in range(100):
                    member.write(bytes(8_000_000))


def mat(path: Path) -> None:
    """A compressed variable that unpacks to 2 GB."""
    packer = zlib.compressobj()
    packed = b"".join(packer.compress(bytes(10_000_000)) for _ in range(200)) + packer.flush()
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    path.write_bytes(head + np.array([15, len(packed)], "<u4").tobytes() + packed)


def hdf(path: Path) -> None:
    """Two datasets of 4 GB that contain nothing but what they are filled with, in 2 kB."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name in ("torque", "velocity"):
            file.create_dataset(name, shape=(500_000_000,), dtype="f8", chunks=(1_000_000,), fillvalue=1.0)


def parquet(path: Path) -> None:
    """Two columns of 40 million equal numbers each, 320 MB, in 100 kB."""
    pyarrow = pytest.importorskip("pyarrow")
    files = pytest.importorskip("pyarrow.parquet")
    part = pyarrow.table({name: np.zeros(1_000_000) for name in ("torque", "velocity")})
    with files.ParquetWriter(path, part.schema) as writer:
        for _ in range(40):
            writer.write_table(part)


@pytest.mark.long
@pytest.mark.parametrize("make", [npz, mat, hdf, parquet])
def test_a_file_that_unpacks_to_gigabytes_is_refused(make: Callable[[Path], None], tmp_path: Path) -> None:
    path, plain = tmp_path / f"log.{make.__name__.replace('hdf', 'h5')}", tmp_path / "plain.csv"
    make(path)
    plain.write_text(f"{HEAD}\n{ROWS}")
    done = subprocess.run([sys.executable, "-c", LIMITED, path, plain], capture_output=True, text=True, timeout=60)
    said, kilobytes = done.stdout.splitlines()
    assert "20 times the file" in said, done.stderr
    assert int(kilobytes) < 1 << 20


def test_a_trace_that_holds_its_values_for_long_is_refused(tmp_path: Path) -> None:
    """1 kB stood for 20 million samples of each of its signals."""
    path = tmp_path / "trace.xml"
    signals = "".join(f'<dataSignal interval="0.001" id="f{k}" name="s{k}" datapointCount="15000000"/>' for k in range(3))
    records = "".join(f'<rec time="{k}" f0="1" f1="2" f2="3"/>' for k in range(3))
    trace = f"<traceSession><traceData><dataFrame>{signals}{records}</dataFrame></traceData></traceSession>"
    path.write_text(trace)
    with pytest.raises(ReadError, match=r"trace\.xml: its [0-9]+ bytes unpack to 720000000 or more, .*; save the log without"):
        ga.read_columns(path)
    path.write_text(trace.replace("15000000", "1e300"))
    with pytest.raises(ReadError, match=r"unpack to .* or more"):
        ga.read_columns(path)
    path.write_text(trace.replace('"0.001"', '"1e-300"'))
    with pytest.raises(ReadError, match=r"unpack to .* or more"):
        ga.read_columns(path)
    path.write_text(trace.replace("15000000", "3000"))
    values = ga.read_columns(path)["s1"]
    assert len(values) == 3000 and np.all(values == 2.0)


def of_every_format() -> list[Any]:
    """A whole log of each, as `make fuzz` has them."""
    sys.path.insert(0, str(FUZZ))
    from corpus import seeds

    first: dict[str, Any] = {}
    for seed in seeds():
        if seed.form not in ("saved", "response", "drive"):
            first.setdefault(seed.form, seed)
    return [pytest.param(seed.ending, seed.content, id=form) for form, seed in first.items()]


@pytest.mark.parametrize(("ending", "content"), of_every_format())
def test_one_limit_of_samples_for_every_format(
    ending: str, content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"log{ending}"
    path.write_bytes(content)
    assert max(map(len, ga.read_columns(path).values())) > 10
    monkeypatch.setattr(table, "MOST_SAMPLES", 10)
    with pytest.raises(ReadError, match=r"log\.\w+: the signal '.*' has \d+ samples or more, and at most 10 are read; save the"):
        ga.read_columns(path)


def test_the_limit_of_samples_holds_for_long_text_and_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pandas: Any = pytest.importorskip("pandas")
    assert table.MOST_SAMPLES == 1_000_000_000 and "1 000 000 000 samples" in (FUZZ.parents[1] / "SECURITY.md").read_text()
    path = tmp_path / "log.csv"
    path.write_text(f"{HEAD}\n{ROWS}")
    monkeypatch.setattr(table, "MOST_SAMPLES", 30)
    monkeypatch.setattr(delimited, "WHOLE", 0)
    monkeypatch.setattr(delimited, "ROWS", 16)
    for function in (ga.read, ga.read_pieces, ga.read_columns):
        for source in (path, pandas.read_csv(path)):
            if function is ga.read_columns and source is not path:
                continue
            with pytest.raises(ReadError, match=r"has [0-9]+ samples or more, and at most 30 are read; save the log in parts"):
                function(source)


def test_data_in_another_file_are_never_read(tmp_path: Path) -> None:
    """HDF5 may name any file as the place of a dataset, or a pipe, for which it waits for ever."""
    h5py: Any = pytest.importorskip("h5py")
    secret = tmp_path / "secret"
    secret.write_bytes(np.arange(100.0).tobytes())
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("velocity", (100,), "f8", external=[(str(secret), 0, 800)])
    with pytest.raises(ReadError, match="'velocity' lies in another file, which is never opened"):
        ga.columns(path)
    with h5py.File(tmp_path / "part.h5", "w") as file:
        file["torque"] = np.arange(100.0)
    layout = h5py.VirtualLayout((100,), "f8")
    layout[:] = h5py.VirtualSource(tmp_path / "part.h5", "torque", (100,))
    with h5py.File(path, "w") as file:
        file.create_virtual_dataset("torque", layout)
    with pytest.raises(ReadError, match="'torque' lies in another file"):
        ga.read(path, {"torque": "torque", "velocity": "torque"}, dt=1e-3)
