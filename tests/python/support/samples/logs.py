"""Logs written by code: helpers, and the table of files that read must refuse."""

from __future__ import annotations

import io
import math
import warnings
import zipfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat


def log_bytes(kind: str) -> bytes:
    k = np.arange(40)
    arrays: dict[str, Any] = {"t": k * 1e-3, "velocity": np.sin(k / 5), "torque": np.cos(k / 5)}
    if kind in ("csv", "utf16"):
        lines = [
            "t,velocity,torque",
            *(f"{a:.4f},{b:.6f},{c:.6f}" for a, b, c in zip(*arrays.values(), strict=True)),
        ]
        return "\n".join(lines).encode("utf-16" if kind == "utf16" else "utf-8")
    buffer = io.BytesIO()
    if kind == "mat":
        savemat(buffer, arrays)
    else:
        np.savez(buffer, **arrays)
    return buffer.getvalue()


def rows(n: int = 30, form: str = "{t:.3f},{w:.4f},{u:.4f}") -> list[str]:
    return [form.format(t=k * 1e-3, w=math.sin(k), u=math.cos(k), k=k) for k in range(n)]


def write(path: Path, header: str, rows: list[str], end: str = "\n") -> Path:
    path.write_text(end.join([*header.split("\n"), *rows]) + end, encoding="utf-8", newline="")
    return path


def text_file(header: str, body: list[str]) -> bytes:
    return ("\n".join([header, *body]) + "\n").encode()


def replaced(index: int, line: str, n: int = 30) -> list[str]:
    body = rows(n)
    body[index] = line
    return body


def mat(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    savemat(buffer, arrays)
    return buffer.getvalue()


def npz(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def twice_in_npz() -> bytes:
    buffer = io.BytesIO()
    single = io.BytesIO()
    np.save(single, np.arange(30.0))
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("velocity.npy", single.getvalue())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            archive.writestr("velocity.npy", single.getvalue())
    return buffer.getvalue()


T = "t,velocity,torque"
K = np.arange(30.0)
HALF_MAT, HALF_NPZ = log_bytes("mat")[:300], log_bytes("npz")[:400]
# (file name, bytes, keywords of read, words of the message)
GARBAGE: list[tuple[str, bytes, dict[str, Any], list[str]]] = [
    ("empty.csv", b"", {}, ["the file is empty", "at least 20"]),
    ("blank.csv", b" \n\n \n", {}, ["the file is empty"]),
    ("bom.csv", b"\xef\xbb\xbf", {}, ["the file is empty"]),
    ("binary.csv", bytes(range(256)) * 4, {}, ["line 1", "no text file", "export"]),
    ("utf16.csv", log_bytes("utf16")[:-1], {}, ["damaged", "utf-16", "encoding="]),
    (
        "prose.txt",
        b"Dear Sir,\nthe drive is fine.\n" * 20,
        {},
        ["line 21", "no table of numbers", "delimiter="],
    ),
    ("header.csv", b"t,velocity,torque\n", {}, ["line 1", "no table of numbers"]),
    ("short.csv", text_file(T, rows(19)), {}, ["19 samples", "at least 20", "longer"]),
    (
        "one.csv",
        text_file("velocity", ["1.5"] * 30),
        {"dt": 1.0},
        ["one column only", "'velocity'", "delimiter="],
    ),
    (
        "missing.csv",
        text_file("t,velocty,torque", rows()),
        {"columns": {"velocity": "velocity", "torque": "torque"}},
        [
            "no column 'velocity' for velocity",
            "did you mean 'velocty'",
            "'t', 'velocty', 'torque'",
            "columns={'velocity'",
        ],
    ),
    (
        "unnamed.csv",
        text_file("t,a,torque", rows()),
        {},
        ["no column is named for the velocity", "'a'", "columns="],
    ),
    ("drive.csv", text_file("t,velocity,a", rows()), {}, ["the command or the torque", "columns={'torque'"]),
    (
        "twice.csv",
        text_file("t,velocity,velocity,torque", rows(form="{t:.3f},{w:.4f},{u:.4f},1.0")),
        {},
        ["2 columns are called 'velocity'", "'#1', '#2'", "counted from 0"],
    ),
    (
        "units.csv",
        text_file("t,w [rpm],w [deg],u", rows(form="{t:.3f},{w:.4f},{u:.4f},1.0")),
        {"columns": {"velocity": "w", "torque": "u"}},
        ["2 columns are called 'w'", "'#1', '#2'"],
    ),
    (
        "number.csv",
        text_file(T, rows()),
        {"columns": {"velocity": "#7", "torque": "torque"}},
        ["no column '#7'"],
    ),
    (
        "nan.csv",
        text_file(T, replaced(9, "0.009,nan,1.0")),
        {},
        ["line 11", "'velocity' contains nan", "cut the log"],
    ),
    ("inf.csv", text_file(T, replaced(9, "0.009,1.0,-inf")), {}, ["line 11", "'torque' contains -inf"]),
    (
        "text.csv",
        text_file(T, replaced(9, "0.009,ERR,1.0")),
        {},
        ["line 11", "'velocity' contains 'ERR', not a number"],
    ),
    ("first.csv", text_file(T, replaced(0, "0.000,ERR,1.0")), {}, ["line 2", "'velocity' contains 'ERR'"]),
    ("gap.csv", text_file(T, replaced(9, "0.009,,1.0")), {}, ["line 11", "'velocity' is empty"]),
    ("under.csv", text_file(T, replaced(9, "0.009,1_0,1.0")), {}, ["line 11", "'1_0'"]),
    (
        "ragged.csv",
        text_file(T, replaced(9, "0.009,1.0")),
        {},
        ["line 11", "2 fields", "have 3", "remove this line"],
    ),
    ("ragged1.csv", text_file(T, replaced(0, "0.000,1.0")), {}, ["line 2", "2 fields", "have 3"]),
    ("wide.csv", text_file(T, replaced(9, "0.009,1,0,1.0")), {}, ["line 11", "4 fields", "decimal commas"]),
    ("footer.csv", text_file(T, [*rows(), "end of log"]), {}, ["line 32", "1 fields", "footer"]),
    ("cut.csv", text_file(T, rows())[:-12], {}, ["line 31", "2 fields"]),
    (
        "beyond.csv",
        text_file(T, [row + ("," if k != 9 else ",7") for k, row in enumerate(rows())]),
        {},
        ["line 11", "4 fields", "have 3"],
    ),
    ("blocks.csv", text_file(T, [*rows(), T, *rows()]), {}, ["line 32", "not a number"]),
    (
        "comma.csv",
        text_file("t;velocity;torque", [row.replace(",", ";").replace(".", ",") for row in rows()]),
        {"decimal": "."},
        ["no table of numbers", "decimal='.'"],
    ),
    (
        "mixed.csv",
        text_file(
            "t;velocity;torque",
            [r.replace(",", ";") if k != 9 else "0.009;0,5;1.0" for k, r in enumerate(rows())],
        ),
        {},
        ["line 11", "'0,5'", "decimal=','"],
    ),
    (
        "both.csv",
        text_file(T, [row.replace(".", ",") for row in rows(form="{t:.3f},{k}.5,{k}.25")]),
        {},
        ["commas stand between the columns", "';'", "delimiter=','"],
    ),
    (
        "thousand.csv",
        text_file("t;velocity;torque", [f"0,{k:03d};1.{k:03d},5;1,5" for k in range(30)]),
        {},
        ["'velocity'", "line 2"],
    ),
    (
        "coarse.csv",
        text_file(T, [f"{k * 0.00044:.3f},{k},{k}" for k in range(100)]),
        {},
        ["too coarse", "dt= [s]"],
    ),
    (
        "gap_t.csv",
        text_file(T, [*rows(10), *rows(30)[12:]]),
        {},
        [
            "line 12",
            "irregular",
            "from 0.009 to 0.012",
            "0.003",
            "elsewhere by 0.001",
            "dt=0.001",
            "'time': None",
        ],
    ),
    ("back.csv", text_file(T, [*rows(30), *rows(30)]), {}, ["line 32", "irregular", "from 0.029 to 0"]),
    ("down.csv", text_file(T, rows(30)[::-1]), {}, ["line 3", "does not increase", "sort"]),
    ("still.csv", text_file(T, ["1.0,2.0,3.0"] * 30), {}, ["line 3", "does not increase"]),
    (
        "clock.csv",
        text_file(T, [f"12:00:{k:02d},1.5,2.5" for k in range(30)]),
        {},
        ["line 2", "'12:00:00'", "not a number"],
    ),
    (
        "dt.csv",
        text_file(T, rows()),
        {"dt": 2e-3},
        ["dt=0.002 s", "'t' has steps of 0.001 s", "leave dt out"],
    ),
    (
        "ms.csv",
        text_file(T, rows(form="{k},{w:.4f},{u:.4f}")),
        {"dt": 1e-3},
        ["dt=0.001", "units={'time': 'ms'}"],
    ),
    ("nodt.csv", text_file("a,velocity,torque", rows()), {}, ["dt is not given", "columns={'time'", "'a'"]),
    (
        "none.csv",
        text_file(T, rows()),
        {"columns": {"time": None, "velocity": "velocity", "torque": "torque"}},
        ["'time': None", "give dt="],
    ),
    (
        "kph.csv",
        text_file("t,velocity [kph],torque", rows()),
        {},
        ["'kph'", "not known", "units={'velocity'"],
    ),
    (
        "volt.csv",
        text_file("t,velocity [V],torque", rows()),
        {},
        ["'velocity [V]'", "'V' is no unit of velocity"],
    ),
    ("amp.csv", text_file("t,velocity,torque [A]", rows()), {}, ["'torque [A]'", "torque_constant=..."]),
    ("a.csv", text_file(T, rows()), {"units": {"velocity": "rmp"}}, ["'rmp' is no unit of velocity"]),
    ("a.csv", text_file(T, rows()), {"units": {"torque": "%"}}, ["rated_torque=..."]),
    (
        "a.csv",
        text_file(T, rows()),
        {"units": {"position": "deg"}},
        ["units names 'position'", "leave its unit out"],
    ),
    (
        "a.csv",
        text_file(T, rows()),
        {"units": {"speed": "rpm"}},
        ["units: 'speed' is no channel", "velocity"],
    ),
    ("a.csv", text_file(T, rows()), {"columns": {"velocty": "w"}}, ["'velocty'", "did you mean 'velocity'"]),
    ("a.csv", text_file(T, rows()), {"columns": "velocity"}, ["columns='velocity' is no mapping"]),
    ("a.csv", text_file(T, rows()), {"columns": {"velocity": 1.5}}, ["velocity=1.5 is no column"]),
    ("a.csv", text_file(T, rows()), {"units": ["rpm"]}, ["units=['rpm'] is no mapping"]),
    ("a.csv", text_file(T, rows()), {"dt": 0}, ["dt=0", "positive"]),
    ("a.csv", text_file(T, rows()), {"dt": "1 ms"}, ["dt='1 ms' is no number"]),
    ("a.csv", text_file(T, rows()), {"name": 3}, ["name=3"]),
    ("a.csv", text_file(T, rows()), {"torque_constant": -1}, ["torque_constant=-1"]),
    (
        "a.csv",
        text_file(T, rows()),
        {"velocity_cutoff_hz": 100},
        ["velocity_cutoff_hz=100", "leave one of them out"],
    ),
    (
        "a.csv",
        text_file("t,position,torque", rows()),
        {"velocity_cutoff_hz": 900},
        ["a.csv", "cutoff_hz=900", "Nyquist"],
    ),
    ("a.csv", text_file(T, rows()), {"delimiter": ";"}, ["no table of numbers", "delimiter=';'"]),
    ("a.csv", text_file(T, rows()), {"delimiter": "::"}, ["delimiter='::'", "';'"]),
    ("a.csv", text_file(T, rows()), {"delimiter": 5}, ["delimiter=5"]),
    ("a.csv", text_file(T, rows()), {"decimal": "x"}, ["decimal='x'"]),
    ("a.csv", text_file(T, rows()), {"skip": -1}, ["skip=-1"]),
    ("a.csv", text_file(T, rows()), {"skip": 99}, ["no line is left", "skip=99"]),
    ("a.csv", text_file(T, rows()), {"encoding": "klingon"}, ["encoding='klingon'"]),
    ("a.csv", "Zeit é".encode("latin-1"), {"encoding": "utf-8"}, ["no utf-8", "latin-1"]),
    ("half.mat", HALF_MAT, {}, ["not a whole MAT file", "copy it again"]),
    ("fake.mat", b"no mat file at all, but some text" * 9, {}, ["not a whole MAT file", "-v7"]),
    (
        "new.mat",
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF\r\n\x1a\n",
        {},
        ["7.3", "'-v7'" if find_spec("h5py") else "gaident[hdf5]"],
    ),
    ("nothing.mat", mat(label="text"), {}, ["no arrays of numbers", "'label' (text)"]),
    (
        "nan.mat",
        mat(velocity=np.where(K == 7, np.nan, 0), torque=K),
        {"dt": 1.0},
        ["index 7", "'velocity' contains nan"],
    ),
    (
        "complex.mat",
        mat(velocity=K * 1j, torque=K),
        {"dt": 1.0},
        ["'velocity' contains no real numbers", "complex"],
    ),
    (
        "length.mat",
        mat(velocity=K, torque=np.arange(40.0)),
        {"dt": 1.0},
        ["velocity 30, torque 40", "one run"],
    ),
    ("t.mat", mat(t=np.where(K > 11, K + 1, K), velocity=K, torque=K), {}, ["index 12", "irregular"]),
    (
        "opt.mat",
        mat(velocity=K, torque=K),
        {"dt": 1.0, "decimal": ","},
        ["decimal= is for text tables", "MAT"],
    ),
    (
        "pickled.npz",
        npz(velocity=np.array([{}] * 30), torque=K),
        {"dt": 1.0},
        ["'velocity' is a pickled object array", "never loaded", "numpy.savez"],
    ),
    ("half.npz", HALF_NPZ, {}, ["not a whole NPZ file", "copy it again"]),
    ("fake.npz", b"text, not an archive\n" * 9, {}, ["not a whole NPZ file"]),
    ("twice.npz", twice_in_npz(), {}, ["two arrays of one name"]),
    ("cube.npz", npz(velocity=np.zeros((5, 5, 5))), {}, ["no arrays of numbers", "3-dimensional"]),
    ("sheet.xlsx", b"PK\x03\x04" + bytes(100), {}, ["Excel", "CSV"]),
    ("log.csv.gz", b"\x1f\x8b\x08" + bytes(100), {}, ["gzip", "unpack"]),
    ("a.npy", b"\x93NUMPY\x01\x00", {}, ["numpy.savez"]),
    ("run.json", b'{"schema": "gaident/identification"}', {}, ["JSON", "gaident.load"]),
    ("names.csv", b"t,w_ref,w\n" + b"0,0,0\n" * 30, {}, ["gaident init"]),
    ("a.h5", b"\x89HDF\r\n\x1a\n", {}, ["HDF5"]),
]
