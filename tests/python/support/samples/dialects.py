"""The run that every file of this folder contains, how to read each, and random tables in random dialects."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

from gaident.data import Record

RPM = 2 * math.pi / 60


def sample_log() -> Record:
    """What the files in this folder contain; see README.md."""
    k = np.arange(40)
    r = np.where(k < 5, 0.0, 100.0)
    w = np.where(k < 5, 0.0, 100 * (1 - np.exp(-(k - 5) / 8)))
    return Record(0.5e-3, command=r, velocity=w, torque=0.4 * (r - w) / 100 + 0.02)


SAMPLE_CALLS: list[tuple[str, dict[str, Any]]] = [
    (
        "trace_two_names.csv",
        {
            "columns": {"command": "Command speed", "velocity": "Motor speed", "torque": "Torque"},
            "units": {"command": "rpm", "velocity": "rpm", "torque": "%"},
            "rated_torque": 1.0,
        },
    ),
    (
        "trace_two_names.csv",
        {
            "columns": {"time": "Time", "command": "Analog 1", "velocity": "Analog 2", "torque": "#3"},
            "units": {"time": "ms", "command": "rpm", "velocity": RPM, "torque": 0.01},
        },
    ),
    (
        "german.csv",
        {
            "columns": {
                "time": "Zeit",
                "command": "Drehzahl Soll",
                "velocity": "Drehzahl Ist [1/min]",
                "torque": "moment",
            }
        },
    ),
    ("units_line_utf16.txt", {}),
    (
        "pairs.csv",
        {"columns": {"time": 0, "velocity": "Speed", "torque": "Current"}, "torque_constant": 0.05},
    ),
    ("savetxt.dat", {"columns": {"command": "r", "velocity": "w", "torque": "u"}}),
    ("status_text.csv", {}),
]


HEADER_LINES = [
    "Axis 1",
    "Date: 2024-05-06",
    "Number of sampling data,40",
    "Interval(ms);0,5",
    "# a comment",
    "",
]
UNITS = {"velocity": ("rpm", RPM), "torque": ("mN m", 1e-3), "command": ("deg/s", math.pi / 180)}


@st.composite
def tables(draw: st.DrawFn) -> tuple[Record, bytes, dict[str, Any]]:
    """A record, the bytes of a log that contains it, and what read must be told beyond the path."""
    n = draw(st.integers(20, 60))
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    dt = draw(st.sampled_from([1e-3, 0.444e-3, 2 / 3 * 1e-3, 0.02]))
    channels = ["velocity", *draw(st.sampled_from([["torque"], ["command"], ["command", "torque"]]))]
    if draw(st.booleans()):
        channels.append("position")
    rng.shuffle(channels)
    values = {key: np.round(rng.normal(size=n) * draw(st.sampled_from([1e-2, 1.0, 1e3])), 5) for key in channels}
    delimiter, decimal = draw(
        st.sampled_from([*((mark, ".") for mark in ",;\t| "), (";", ","), ("\t", ","), ("|", ","), (" ", ",")])
    )
    with_time = draw(st.booleans())
    in_ms = with_time and draw(st.booleans())
    cells = [[f"{k * dt * (1e3 if in_ms else 1):.7f}"] if with_time else [] for k in range(n)]
    for key in channels:
        for row, value in zip(cells, values[key], strict=True):
            row.append(draw_format(rng, value))
    names = (["t"] if with_time else []) + channels
    style = draw(st.sampled_from(["none", "inline", "line"]))
    units = {key: UNITS[key] for key in channels if key in UNITS} if style != "none" else {}
    if in_ms and style != "none":
        units["t"] = ("ms", 1e-3)
    header = [draw(st.sampled_from(HEADER_LINES)) for _ in range(draw(st.integers(0, 4)))]
    quote = '"' if draw(st.booleans()) else ""
    spelled = [f"{key} [{units[key][0]}]" if style == "inline" and key in units else key for key in names]
    header.append(delimiter.join(f"{quote}{name}{quote}" if delimiter != " " else name for name in spelled))
    if style == "line" and units:
        # a unit of several words must stand in quotes between blanks
        row = [units.get(key, ("-",))[0] for key in names]
        header.append(delimiter.join(f'"{cell}"' if " " in cell else cell for cell in row))
    tail = delimiter if delimiter != " " and draw(st.booleans()) else ""
    body = [delimiter.join(row).replace(".", decimal) + tail for row in cells]
    end = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    text = end.join(header + body) + draw(st.sampled_from(["", end, end + end]))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"]))
    told: dict[str, Any] = {} if with_time else {"dt": dt}
    if in_ms and style == "none":
        told["units"] = {"time": "ms"}
    scaled = {key: array * units.get(key, ("", 1.0))[1] for key, array in values.items()}
    return Record(dt, name="log", **scaled), text.encode(encoding), told


def draw_format(rng: np.random.Generator, value: float) -> str:
    return [f"{value:.5f}", f"{value:.15e}", f"{value:+.5f}", f"{value:.17g}"][rng.integers(4)]
