"""Text tables with known values in random dialects, some with a fault, and what a reader may make of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

__all__ = ["Case", "case"]

RPM = 2.0 * np.pi / 60.0
VELOCITIES = {"rad/s": 1.0, "rpm": RPM, "1/min": RPM, "deg/s": np.pi / 180.0, "°/s": np.pi / 180.0, "": 1.0}
TORQUES = {"Nm": 1.0, "mNm": 1e-3, "N m": 1.0, "": 1.0}
TIMES = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}
NAMES = [
    *(
        ("velocity", "torque", "time"),
        ("w", "u", "t"),
        ("Drehzahl ist", "Moment", "Zeit"),
        ("Axis1.ActVel", "Axis1.Torque", "Axis1.Time"),
    ),
    *(("n_ist", "M_ist", "t_log"), ("speed, actual", "torque, actual", "time, log"), ("vitesse réelle", "couple", "temps")),
]
NUMBERS: list[Callable[[float], str]] = [
    *(lambda x: f"{x:.3f}", lambda x: f"{x:.6f}", lambda x: f"{x:.1f}", lambda x: f"{x:.5e}", lambda x: f"{x:.9E}"),
    *(lambda x: f"{x:g}", lambda x: repr(float(x)), lambda x: f"{x:+.4f}", lambda x: f"{x:.0f}", lambda x: f"{x:10.4f}"),
]
FIXED = (0, 1, 2, 3, 4, 7, 9)  # of these, a number that is cut short shows


@dataclass
class Case:
    """A file, how it is read, and what must come of it.

    content   bytes of the file
    columns   channel -> column
    dt        sample time that is given [s], None: by the file
    step      sample time of the run [s]
    values    channel -> values in SI of the rows that stand whole in the file
    must      "read": as it is; "refuse": an error; "either": values as they are, or an error; "noted": a note, or an error
    blocks    whether the file is read block by block, as a long one is
    what      the dialect and the fault, for a message
    """

    content: bytes
    columns: dict[str, Any]
    dt: float | None
    step: float
    values: dict[str, np.ndarray]
    must: str
    blocks: bool
    what: dict[str, Any] = field(default_factory=dict)


class _Table:
    """A table as it is written: drawn once, then damaged."""

    def __init__(self, draw: np.random.Generator) -> None:
        self.draw = draw
        self.rows = int(draw.integers(25, 90))
        self.step = float(draw.choice([1e-3, 5e-4, 2e-3, 4e-3, 0.01]))
        self.delimiter = str(draw.choice([",", ";", "\t", "|", " "]))
        self.decimal = "." if self.delimiter == "," else str(draw.choice([".", ".", ","]))
        self.quoted = bool(self.delimiter != " " and draw.random() < 0.2)
        if self.delimiter == "," and self.quoted and draw.random() < 0.3:
            self.decimal = ","
        # A mark between thousands, which nobody can tell from a decimal mark, or which is none of a plain number.
        marks = [m for m in (",", ".", "'", "\u202f") if m != self.decimal and (m != self.delimiter or self.quoted)]
        self.thousands = str(draw.choice(marks)) if draw.random() < 0.08 else ""
        self.end = str(draw.choice(["\n", "\n", "\r\n", "\r"]))
        self.trailing = bool(self.delimiter != " " and draw.random() < 0.1)
        self.has_time = bool(draw.random() < 0.85)
        self.gives_dt = bool(not self.has_time or draw.random() < 0.2)
        self.last = bool(draw.random() < 0.8)
        self.what: dict[str, Any] = {}
        self._names()
        self._numbers()

    def _names(self) -> None:
        draw = self.draw
        velocity, torque, time = NAMES[int(draw.integers(len(NAMES)))]
        if self.delimiter == " " or (self.delimiter == "," and not self.quoted):
            velocity, torque, time = (n.replace(", ", "_").replace(" ", "_") for n in (velocity, torque, time))
        self.units = {
            "velocity": str(draw.choice(list(VELOCITIES))),
            "torque": str(draw.choice(list(TORQUES))),
            "time": str(draw.choice(list(TIMES)[1:])),
        }
        names = {"time": time, "velocity": velocity, "torque": torque}
        order = ["time"] * self.has_time + [str(c) for c in draw.permutation(["velocity", "torque"])]
        self.extra = "state" if draw.random() < 0.25 else ""
        if self.extra:
            order.insert(int(draw.integers(self.has_time, len(order) + 1)), "state")
        self.order, self.names = order, {**names, "state": "state"}
        self.header = str(draw.choice(["inline", "inline", "row", "none"]))
        if self.header == "none" or (self.header == "row" and self.delimiter == " "):
            self.header = "none" if self.header == "none" else "inline"
        if self.header == "none":
            self.units = {"velocity": "", "torque": "", "time": "s"}
        self.encoding = str(draw.choice(["utf-8", "utf-8", "utf-8-sig", "utf-16", "latin-1", "cp1252", "utf-16-le"]))

    def _numbers(self) -> None:
        draw = self.draw
        scale = float(10.0 ** draw.integers(-1, 4))
        phase = np.arange(self.rows) * float(draw.uniform(0.05, 0.4))
        shapes = {"velocity": scale * np.sin(phase) + 0.3 * scale, "torque": np.cos(phase) * float(10.0 ** draw.integers(-1, 2))}
        self.forms = {c: int(draw.integers(len(NUMBERS))) for c in ("velocity", "torque")}
        self.cells: dict[str, list[str]] = {c: [NUMBERS[self.forms[c]](x) for x in v] for c, v in shapes.items()}
        start = float(draw.choice([0.0, 0.0, 0.1, 100.0]))
        unit = TIMES[self.units["time"]]
        digits = 7 if unit == 1.0 else 4 if unit == 1e-3 else 1
        self.cells["time"] = [f"{(start + k * self.step) / unit:.{digits}f}" for k in range(self.rows)]
        self.dates = str(draw.choice(["", "", "", "", "", "epoch", "text"])) if self.has_time else ""
        if self.delimiter == " " and self.dates == "text":
            self.dates = ""
        if self.dates == "epoch":
            self.units["time"] = ""
            second = float(draw.choice([1.0, 1e-3, 1e-6]))
            first = float(draw.choice([1772359872.0, 1600000000.25]))
            digits = {1.0: 4, 1e-3: 2, 1e-6: 0}[second]
            self.cells["time"] = [f"{(first + k * self.step) / second:.{digits}f}" for k in range(self.rows)]
        elif self.dates == "text":
            self.units["time"] = ""
            self.cells["time"] = [f"2026-03-01 10:11:{12 + k * self.step:07.4f}" for k in range(self.rows)]
            self.gives_dt = True
        self.cells["state"] = [("on" if k % 2 else "off") for k in range(self.rows)]
        # What is read is what is printed.
        self.values = {c: np.array([float(text) for text in self.cells[c]]) for c in ("velocity", "torque")}

    def printed(self, channel: str, k: int) -> str:
        """A cell as the dialect has it."""
        text = self.cells[channel][k]
        if channel == "state":
            return f'"{text}"' if self.quoted else text
        if self.thousands and channel != "time" and "e" not in text.lower():
            sign = "-" if text.strip().startswith("-") else ""
            whole, dot, rest = text.strip().lstrip("+-").partition(".")
            text = f"{sign}{int(whole):,}".replace(",", "\0") + dot + rest
        text = text.replace(".", self.decimal).replace("\0", self.thousands)
        return f'"{text}"' if self.quoted else text

    def line(self, k: int) -> str:
        """A row."""
        return self.delimiter.join(self.printed(c, k) for c in self.order) + self.delimiter * self.trailing

    def above(self) -> list[str]:
        """The lines above the numbers."""
        draw = self.draw

        def cell(text: str) -> str:
            return f'"{text}"' if self.quoted or self.delimiter in text.strip() else text

        titles = {c: self.names[c] for c in self.order}
        units = {c: self.units.get(c, "") for c in self.order}
        if self.delimiter == " ":
            units = {c: u.replace(" ", "") for c, u in units.items()}
        lines = []
        if draw.random() < 0.2:
            lines += ["Log of a drive", "made on 2026-03-01 10:11:12"][: int(draw.integers(1, 3))]
        if draw.random() < 0.2:
            mark = str(draw.choice(["#", "%", "//"]))
            lines += [f"{mark} exported by hand", f"{mark} 3.5 axes"][: int(draw.integers(1, 3))]
        tail = self.delimiter * self.trailing
        if self.header == "inline":
            blank = "" if self.delimiter == " " else " "
            shown = [f"{titles[c]}{blank}[{units[c]}]" if units[c] else titles[c] for c in self.order]
            lines.append(self.delimiter.join(map(cell, shown)) + tail)
        elif self.header == "row":
            lines.append(self.delimiter.join(cell(titles[c]) for c in self.order) + tail)
            if any(units.values()):
                lines.append(self.delimiter.join(cell(units[c] or "-") for c in self.order) + tail)
        return lines

    def columns(self) -> dict[str, Any]:
        """How each channel is named to the reader."""
        named = self.header != "none"
        found: dict[str, Any] = {c: self.names[c] if named else f"#{self.order.index(c)}" for c in ("velocity", "torque")}
        if self.dates == "text":
            found["time"] = None
        elif self.has_time:
            found["time"] = self.names["time"] if named else f"#{self.order.index('time')}"
        return found

    def in_si(self, channel: str, rows: Any) -> np.ndarray:
        """Some rows of a channel as a record must have them."""
        units = VELOCITIES if channel == "velocity" else TORQUES
        return self.values[channel][rows] * units[self.units[channel]]


def case(seed: int, number: int) -> Case:
    """The case of this number."""
    draw = np.random.default_rng([seed, number])
    table = _Table(draw)
    lines = [table.line(k) for k in range(table.rows)]
    whole = np.arange(table.rows)
    fault = str(draw.choice(["none", "lost", "cut", "doubled", "again", "nan", "empty", "mark", "merged", "letter", "narrow"]))
    must = "read"
    last = table.last
    k = int(draw.integers(2, table.rows - 2))
    cells = [table.printed(c, k) for c in table.order] + [""] * table.trailing
    at = table.order.index(str(draw.choice(["velocity", "torque"])))
    if fault in ("mark", "letter", "nan", "empty", "narrow") and table.quoted:
        fault = "none"  # what stands in quotation marks is no number anyway
    if fault in ("lost", "doubled", "again") and (not table.has_time or table.dates == "text"):
        fault = "none"  # nothing shows it
    if fault == "lost":
        count = int(draw.integers(1, 4))
        del lines[k : k + count]
        must = "refuse" if k + count < table.rows else "either"
        whole = np.delete(whole, np.arange(k, min(k + count, table.rows)))
    elif fault == "doubled":
        lines = lines + (table.above() if draw.random() < 0.3 else []) + lines
        must = "refuse"
    elif fault == "again":
        lines.insert(k, lines[k])
        must = "refuse"
    elif fault in ("nan", "empty", "letter"):
        new = {"nan": str(draw.choice(["nan", "NaN", "inf", "-INF"])), "empty": "", "letter": cells[at].strip() + "O"}[fault]
        if table.delimiter == " " and fault == "empty":
            cells.pop(at)
        else:
            cells[at] = new
        lines[k] = table.delimiter.join(cells)
        must = "refuse"
    elif fault == "mark":
        other = "," if table.decimal == "." else "."
        changed = cells[at].replace(table.decimal, other)
        fault = fault if changed != cells[at] and other != table.delimiter else "none"
        if fault != "none":
            cells[at] = changed
            lines[k] = table.delimiter.join(cells)
            must = "refuse"
    elif fault == "merged":
        lines[k : k + 2] = [lines[k] + lines[k + 1]]
        must = "refuse"
    elif fault == "narrow":
        del cells[at]
        lines[k] = table.delimiter.join(cells)
        must = "refuse"
    blocks = bool(draw.random() < 0.3)
    if table.thousands and must == "read":
        must = "either"
    # Nothing says which the separator and the decimal mark are.
    if table.delimiter == "," and table.decimal == "," and must == "read":
        must = "either"
    above = table.above()
    text = table.end.join([*above, *lines]) + (table.end if last else "")
    if fault == "cut":
        text, must, whole = _cut(table, [*above, *lines], draw)
    content = text.encode(table.encoding, errors="replace")
    dt = table.step if table.gives_dt else None
    what = {
        "fault": fault,
        **{key: getattr(table, key) for key in ("delimiter", "decimal", "thousands", "quoted", "header", "encoding", "trailing")},
        **{"forms": table.forms, "order": table.order, "dt": dt, "dates": table.dates, "end": table.end, "last": last},
    }
    values = {c: table.in_si(c, whole) for c in ("velocity", "torque")}
    return Case(content, table.columns(), dt, table.step, values, must, blocks, what)


def _cut(table: _Table, lines: list[str], draw: np.random.Generator) -> tuple[str, str, np.ndarray]:
    """(text that ends within its last line, what must come of it, the rows that stand whole in it)."""
    row = lines[-1]
    keep = int(draw.integers(1, len(row)))
    text = table.end.join([*lines[:-1], row[:keep]])
    rest = row[keep:]
    before, complete = np.arange(table.rows - 1), np.arange(table.rows)
    # Where only separators, blanks or quotation marks are missing, the numbers stand whole.
    if not rest.strip(' "' + table.delimiter):
        return text, "either", complete
    # Where nothing of the last cell's number shows that it is cut, a note says so; where others are no longer, nobody can know.
    last = table.order[-1]
    cut_cell = row[:keep].count(table.delimiter) == row.count(table.delimiter) - table.trailing
    if cut_cell and last == "state":
        return text, "either", complete
    shows = last in ("time", "state") or table.forms[last] in FIXED
    if cut_cell and not shows:
        cell = row[:keep].rpartition(table.delimiter)[2].strip()
        others = max(len(table.printed(last, k).strip()) for k in range(table.rows - 1))
        return text, "noted" if len(cell) < others else "unknown", complete
    return text, "either", before
