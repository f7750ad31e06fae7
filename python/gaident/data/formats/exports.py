"""What some drive tools write in a way of their own, which a header does not show: one function each, in one table.

Sources: Beckhoff Infosys, "TwinCAT Scope: Export in csv" (TE13xx) and "Scope Settings" (TcScope2); Mitsubishi Electric,
MR Configurator2, waveform saved as CSV; National Instruments, exported logs with a header block per channel.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from gaident.data.formats.dialect import Dialect, parse_number, split
from gaident.data.formats.header import Header, Heading
from gaident.data.formats.stored import unique_keys
from gaident.data.formats.text import Line

__all__ = ["END_MARK", "refined", "scope_layout"]

END_MARK = "EOF"
"""What TwinCAT Scope writes as the last line where it is asked to."""

_SAMPLE_TIME = re.compile(r"SampleTime\s*\[ms\]", re.IGNORECASE)
_SCOPE_DELIMITERS = "\t;,|"
_DECIMAL = {",": re.compile(r"\d,\d"), ".": re.compile(r"\d\.\d")}
_TOP = 80  # no decision: a format: lines in which a header ends


def scope_layout(lines: Sequence[Line]) -> tuple[Dialect, Header] | None:
    """Dialect and header of a TwinCAT Scope export; None if it is none.

    The header has the file's name and times, then a row for each property of the channels (Name, SampleTime[ms],
    SymbolName, Unit, ...) whose label stands above each time column again; rows end early where slower channels have no
    more values.
    """
    # no decision: a format: how such a file begins
    if not lines or not lines[0][1].startswith("Name") or len(lines[0][1]) < 5 or lines[0][1][4] not in _SCOPE_DELIMITERS:
        return None
    delimiter = lines[0][1][4]
    top = [(at, split(text, delimiter)) for at, (_, text) in enumerate(lines[:_TOP])]
    rates = next((at for at, cells in top if _SAMPLE_TIME.fullmatch(cells[0])), None)
    named = next((at for at, cells in reversed(top[:rates]) if cells[0] == "Name"), 0) if rates is not None else 0
    if rates is None or named == 0:
        return None
    properties = {cells[0]: cells for _, cells in top[named:]}
    start = next((at for at, cells in top[named:] if not any(c.isalpha() for c in cells[0])), len(lines))
    body = [text for _, text in lines[start:]]
    decimal = "." if delimiter == "," else next((mark for mark in _DECIMAL if any(map(_DECIMAL[mark].search, body))), ".")
    headings = _scope_headings(properties, decimal)
    if body and len(split(body[0], delimiter)) == len(headings) - 1:
        headings = tuple(replace(heading, clock=None) for heading in headings[1:])  # exported without time columns
    dialect = Dialect(delimiter, decimal, (True,) * len(headings), ragged=True)
    return dialect, Header(headings, start)


def _scope_headings(properties: dict[str, list[str]], decimal: str) -> tuple[Heading, ...]:
    names = properties["Name"]
    keys = unique_keys(["Time" if name == "Name" else name for name in names])
    units, symbols = properties.get("Unit", []), properties.get("SymbolName", [])
    rates = next(cells for label, cells in properties.items() if _SAMPLE_TIME.fullmatch(label))
    found: list[Heading] = []
    clock: str | None = None
    for k, name in enumerate(names):
        if name == "Name":
            clock = keys[k]
            found.append(Heading(clock, ("Time",), "ms"))
            continue
        rate = parse_number(rates[k], ",") or parse_number(rates[k], ".") if k < len(rates) else None
        unit = units[k].split(" (")[0].strip("() ") if k < len(units) else ""
        others = {name, *symbols[k : k + 1], *(symbol.rsplit(".", 1)[-1] for symbol in symbols[k : k + 1])} - {"", keys[k]}
        period = None if rate is None else rate * 1e-3
        found.append(Heading(keys[k], tuple(sorted(others)), None if unit in ("", "None") else unit, clock, period))
    return tuple(found)


def refined(lines: Sequence[Line], header: Header, dialect: Dialect) -> Header:
    """The header with what only one tool's export says."""
    top = [split(text, dialect.delimiter) for _, text in lines[: header.start]]
    for manner in _MANNERS:
        header = manner(top, header)
    return header


def _national_instruments(top: Sequence[Sequence[str]], header: Header) -> Header:
    """Pairs of columns, time [s] and value, below the labels Timestamp, Interval, Channel name, Unit."""
    rows = {cells[0]: cells for cells in top if cells}
    names = rows.get("Channel name")
    if names is None or "Interval" not in rows or len(names) != len(header.headings):
        return header
    headings = list(header.headings)
    clock = None
    for k, name in enumerate(names):
        if name == "Channel name":
            clock = f"Time #{k}"
            headings[k] = Heading(clock, (headings[k].key, *headings[k].names), "s")
        else:
            interval = parse_number(rows["Interval"][k], ".") if k < len(rows["Interval"]) else None
            headings[k] = replace(headings[k], clock=clock, period=interval)
    return replace(header, headings=tuple(headings))


# MR Configurator2 prints no units but that of the time; its manual has them.
_TRACE_UNITS = {
    "servo motor speed": "r/min",
    "speed command": "r/min",
    "motor speed": "r/min",
    "torque": "%",
    "torque command": "%",
    "instantaneous torque": "%",
    "effective load ratio": "%",
    "droop pulses": "pulses",
    "droop pulses (by 1 pls.)": "pulses",
    "command pulse frequency": "kpulses/s",
}


def _mitsubishi(top: Sequence[Sequence[str]], header: Header) -> Header:
    labels = {cells[0].casefold() for cells in top if cells}
    if "number of sampling data" not in labels or not any(label.startswith("sampling time interval") for label in labels):
        return header
    return replace(header, headings=tuple(map(_with_trace_unit, header.headings)))


def _with_trace_unit(heading: Heading) -> Heading:
    units = (_TRACE_UNITS.get(name.casefold()) for name in (heading.key, *heading.names))
    return heading if heading.unit else replace(heading, unit=next((unit for unit in units if unit), None))


_MANNERS: tuple[Callable[[Sequence[Sequence[str]], Header], Header], ...] = (_national_instruments, _mitsubishi)
