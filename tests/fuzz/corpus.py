"""The files that `make fuzz` damages: what this repository contains, and small logs of every format that are made here."""

from __future__ import annotations

import io
import json
import struct
import tempfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
SUPPORT = ROOT / "tests" / "python" / "support"

N = 60
T = np.arange(N) * 1e-3
W = 80.0 * np.tanh(20.0 * T)
U = 0.4 * np.cos(60.0 * T)


@dataclass(frozen=True)
class Seed:
    """One whole file: its format, the ending of its name, its content, and how often it is taken beside the others."""

    form: str
    ending: str
    content: bytes
    weight: float = 1.0


def seeds(forms: Sequence[str] = ()) -> list[Seed]:
    """Every seed, in an order that does not change, or those of some formats."""
    found = [*_text(), *_binary(), *_sinumerik(), *_saved(), *_responses(), *_drive()]
    for form, ending, make, weight in [row for row in _FOREIGN if not forms or row[0] in forms]:
        with suppress(ImportError):  # what is not installed cannot be read
            found += [Seed(form, ending, content, weight) for content in make()]
    return [seed for seed in found if not forms or seed.form in forms]


def _text() -> Iterator[Seed]:
    for file in sorted((SUPPORT / "samples").iterdir()):
        if file.suffix in (".csv", ".txt", ".dat"):
            yield Seed("text", file.suffix, file.read_bytes())
    for delimiter, decimal, ending in (
        (",", ".", ".csv"),
        (";", ",", ".csv"),
        ("\t", ".", ".txt"),
        (" ", ".", ".dat"),
        ("|", ".", ".csv"),
    ):
        rows = [f"{t:.4f}{delimiter}{w:.5g}{delimiter}{u:.6e}".replace(".", decimal) for t, w, u in zip(T, W, U, strict=True)]
        for head in (
            "time,velocity,torque",
            "# made by nobody\ntime [s],velocity [rpm],torque [Nm]",
            '"t","v","i"\n"ms","1/min","A"',
        ):
            text = "\n".join([head.replace(",", delimiter), *rows]) + "\n"
            yield Seed("text", ending, text.encode())
    text = "time,velocity,torque\n" + "\n".join(f'"{t:.3f}","{1000 * w:,.2f}","{u:.3f}"' for t, w, u in zip(T, W, U, strict=True))
    yield Seed("text", ".csv", text.encode("utf-16"))
    dated = [f"2026-03-01 10:00:{t:06.3f};{w:.4f};{u:.4f}" for t, w, u in zip(T, W, U, strict=True)]
    yield Seed("text", ".csv", "\r\n".join(["Zeit;velocity [°/s];torque", *dated]).encode("latin-1"))


def _element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def _variable(name: str, values: np.ndarray) -> bytes:
    """A matrix of doubles, as the format's description has it (MathWorks, MAT-File Format)."""
    shape = np.array([len(values), 1], "<i4").tobytes()
    parts = [_element(6, struct.pack("<II", 6, 0)), _element(5, shape), _element(1, name.encode())]
    return _element(14, b"".join([*parts, _element(9, values.astype("<f8").tobytes())]))


def _binary() -> Iterator[Seed]:
    named = {"time": T, "velocity": W, "torque": U}
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    plain = b"".join(_variable(name, values) for name, values in named.items())
    packed = b"".join(struct.pack("<II", 15, len(p)) + p for p in (zlib.compress(_variable(n, v)) for n, v in named.items()))
    yield Seed("MAT", ".mat", head + plain)
    yield Seed("MAT", ".mat", head + packed)
    four = b"".join(struct.pack("<5I", 0, N, 1, 0, len(n) + 1) + n.encode() + b"\0" + v.tobytes() for n, v in named.items())
    yield Seed("MAT", ".mat", four)
    for save in (np.savez, np.savez_compressed):
        stream = io.BytesIO()
        save(stream, **named, both=np.column_stack([W, U]), words=np.array(["a", "b"]))
        yield Seed("NPZ", ".npz", stream.getvalue())


def _sinumerik() -> Iterator[Seed]:
    names = ("nckServoDataActVelMot32", "nckServoDataActCurr32")
    signals = [
        f'<dataSignal domain="NCU_1" interval="0.001" id="f{k}" description="{told}" datapointCount="{N}" '
        f'name="/Nck/!SD/{name} [u1, 7]" unitsType="{unit}" dataType="double"/>'
        for k, (name, told, unit) in enumerate(zip(names, ("velocity", "torque"), ("velo", "current"), strict=True), 1)
    ]
    records = [f'<rec time="{t:.6f}" f1="{w:.6f}" f2="{u:.6f}"/>' for t, w, u in zip(T, W, U, strict=True)]
    header = '<frameHeader dropOuts="0" startTime="2024-01-02T03:04:05.000Z" stopInc="0.0195"/>'
    frame = "\n".join(["<dataFrame>", header, *signals, *records, "</dataFrame>"])
    text = f'<traceSession version="01.00">\n<traceData dataFrames="1">\n{frame}\n</traceData>\n</traceSession>\n'
    yield Seed("SINUMERIK", ".xml", f'<?xml version="1.0" encoding="utf-8" ?>\n{text}'.encode())


def _saved() -> Iterator[Seed]:
    for file in sorted((SUPPORT / "golden" / "saved_0_1").glob("*.json")):
        yield Seed("saved", ".json", json.dumps(json.loads(file.read_text())).encode())


def _responses() -> Iterator[Seed]:
    rows = "\n".join(f"{f:g},{20 - 0.1 * f:g},{-f:g}" for f in range(1, 200, 4))
    yield Seed("response", ".csv", f"frequency [Hz],magnitude [dB],phase [deg]\n{rows}\n".encode())


def _drive() -> Iterator[Seed]:
    content = (ROOT / "examples" / "drive.toml").read_bytes()
    yield Seed("drive", ".toml", content)
    yield Seed("drive", ".toml", content + b"\n[axes.x]\ngear_ratio = 5.0\n[axes.y]\n")


# ---- formats of libraries, each through a file


def _through(write: Callable[[Path], object], ending: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"log{ending}"
        write(path)
        return next(Path(folder).iterdir()).read_bytes()


def _hdf() -> list[bytes]:
    import h5py

    def plain(path: Path) -> None:
        with h5py.File(path, "w") as file:
            for name, values in (("time", T), ("velocity", W), ("torque", U)):
                file[name] = values
            file["velocity"].attrs["unit"] = "rpm"
            file["run/both"] = np.column_stack([W, U])

    def packed(path: Path) -> None:
        with h5py.File(path, "w", libver="latest") as file:
            for name, values in (("time", T), ("velocity", W), ("torque", U)):
                file.create_dataset(name, data=values, chunks=(16,), compression="gzip", shuffle=True)
            file["table"] = np.array(list(zip(T, W, strict=True)), dtype=[("t", "f8"), ("w", "f4")])

    return [_through(plain, ".h5"), _through(packed, ".h5")]


def _parquet() -> list[bytes]:
    import pyarrow
    from pyarrow import parquet

    table = pyarrow.table({"time": T, "velocity": W, "torque": U, "state": ["on"] * N})
    options: list[dict[str, Any]] = [{"row_group_size": 16}, {"compression": "none", "use_dictionary": False}]
    return [_through(lambda path, o=o: parquet.write_table(table, path, **o), ".parquet") for o in options]  # type: ignore[misc]


def _tdms() -> list[bytes]:
    import nptdms

    def write(path: Path) -> None:
        wave = {"wf_increment": 1e-3, "wf_start_offset": 0.0}
        rows = (("velocity", W), ("torque", U))
        with nptdms.TdmsWriter(path) as writer:
            writer.write_segment([nptdms.ChannelObject("drive", name, values, wave) for name, values in rows])

    return [_through(write, ".tdms")]


def _mdf() -> list[bytes]:
    import asammdf

    def writer(version: str) -> Callable[[Path], object]:
        def write(path: Path) -> None:
            file = asammdf.MDF(version=version)
            scaled = asammdf.Signal((1000 * U).astype("<i2"), T, name="torque", conversion={"a": 1e-3, "b": 0.0})
            file.append([asammdf.Signal(W, T, name="velocity", unit="rad/s"), scaled])
            file.save(path, overwrite=True)
            file.close()

        return write

    return [_through(writer(version), ".mf4") for version in ("3.30", "4.10")]


# A process of its own for each costs 0.2 s, one with asammdf 2 s: they are taken less often.
_FOREIGN: list[tuple[str, str, Callable[[], list[bytes]], float]] = [
    ("HDF5", ".h5", _hdf, 0.5),
    ("Parquet", ".parquet", _parquet, 0.3),
    ("TDMS", ".tdms", _tdms, 0.6),
    ("MDF", ".mf4", _mdf, 0.06),
]
