"""read_response: a text file with a measured frequency response to a FrequencyResponse."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.checks import checked_path, known_keys, real_number
from gaident.data.formats.delimited import TextOptions, open_text
from gaident.data.formats.table import Column, LogTable
from gaident.data.frequency.columns import COLUMNS, SI, UNITS
from gaident.data.frequency.response import FrequencyResponse
from gaident.data.signals.arrays import positive_number, sample_time
from gaident.errors import ReadError, RecordError

__all__ = ["read_response"]

Vector = NDArray[np.float64]

_UNIT = re.compile(r"(.*?)[\s/_]*[\[(<{/_ ]\s*(khz|hz|rad/s|db|deg|grad|°|rad|%|1)\s*[\])>}]?", re.IGNORECASE)


def read_response(
    path: str | os.PathLike[str],
    columns: Mapping[str, str | int] | None = None,
    units: Mapping[str, str] | None = None,
    kind: str = "torque to velocity",
    dt: float | None = None,
    *,
    scale: float = 1.0,
    amplitude: float | None = None,
    name: str | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    skip: int | None = None,
    encoding: str | None = None,
) -> FrequencyResponse:
    """Read a frequency response from a text table: frequency, and magnitude and phase or real and imaginary part.

    Rows may come in any order; a row at 0 Hz is left out, and so are rows from half the sampling frequency on. Notes say so.

    Parameters
    ----------
    path : str or path-like
        The file.
    columns : mapping of str to str or int, optional
        Quantity -> column: frequency, magnitude, phase, real, imaginary, coherence, std.
        One that is not given is guessed by its name.
    units : mapping of str to str, optional
        Quantity -> unit: frequency "Hz", "kHz" or "rad/s"; magnitude "dB" or "1" (plain numbers); phase "deg" or "rad";
        coherence "1" or "%". What is not given is taken from the column's name.
    kind : {"torque to velocity", "torque to position", "torque to acceleration"}
        What was measured, see `FrequencyResponse`.
    dt : float, optional
        Sample time [s] of a measurement by a drive, see `FrequencyResponse`.
    scale : float
        What 1 of the file is in rad/s/(N m) (m/s/N; or rad, rad/s^2 per N m, by `kind`); pi/30 for rpm/(N m).
        A negative one turns the sign.
    amplitude : float, optional
        Amplitude of the torque that excited the axis [N m], see `FrequencyResponse`.
    name : str, optional
        What reports call it; None: the file's name.
    delimiter, decimal, skip, encoding : optional
        How the text is written, see `read`; None: found out.

    Returns
    -------
    FrequencyResponse
        The response.

    Raises
    ------
    ReadError
        Where a column or a unit is missing, with what to give; as `read` for damaged files.
    RecordError
        As `FrequencyResponse`.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import gaident as ga
    >>> rows = [f"{f},{20 - 0.1 * f},{-90 - f}" for f in range(1, 31)]
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "bode.csv"
    >>> _ = file.write_text("\\n".join(["frequency [Hz],magnitude [dB],phase [deg]", *rows]))
    >>> ga.read_response(file)
    FrequencyResponse('bode.csv', 30 frequencies, 1..30 Hz, torque to velocity)
    """
    file = checked_path(path, "path", ReadError)
    if not file.is_file():
        raise ReadError(f"{path}: there is no such file; give the path of a text table")
    scale = real_number(scale, "scale", ReadError, "give a number, what 1 of the file is in SI units")
    if scale == 0.0:
        raise ReadError("scale is 0: give what 1 of the file is in SI units; a negative number turns the sign")
    dt = None if dt is None else sample_time(dt)
    if amplitude is not None:
        amplitude = positive_number(amplitude, "amplitude", "N m", "give the torque's amplitude, or leave it out")
    table = open_text(str(path), file, TextOptions(delimiter, decimal, skip, encoding))
    if table.batches is not None:
        raise ReadError(f"{path}: too long for a frequency response; give a table of frequencies, or read a log with read()")
    found = _columns(table, {} if columns is None else columns)
    asked = known_keys({} if units is None else units, "units", list(UNITS), (), ReadError)
    at_zero = found["frequency"].whole() == 0.0
    values = {key: table.numbers(_without(column, at_zero), key) for key, column in found.items()}
    for key in ("magnitude", "real", "imaginary", "std"):
        if key in found and not (key == "magnitude" and key in asked):
            _refuse_other_size(table, key, found[key])
    factor = {key: _factor(table, key, found[key], asked.get(key)) for key in found if key in UNITS}
    frequency = values["frequency"] * factor["frequency"]
    if "real" in found:
        response = values["real"] + 1j * values["imaginary"]
    else:
        decibels = math.isnan(factor["magnitude"])
        # no decision: a unit: decibels
        size = 10.0 ** (values["magnitude"] / 20.0) if decibels else values["magnitude"] * factor["magnitude"]
        response = size * np.exp(1j * values["phase"] * factor["phase"])
    more: dict[str, Any] = {}
    if "coherence" in found:
        more["coherence"] = values["coherence"] * factor["coherence"]
    if "std" in found:
        more["std"] = values["std"] * abs(scale)
    order = np.argsort(frequency, kind="stable")
    notes = []
    if at_zero.any():
        notes.append(f"{table.path}: the row at 0 Hz is left out.")
    if dt is not None:
        below = frequency[order] < 0.5 / dt  # no decision: a formula: half the sampling frequency
        if not below.all():
            notes.append(f"{table.path}: {int(np.sum(~below))} rows from half the sampling frequency on are left out.")
            order = order[below]
    arrays: dict[str, Any] = {key: array[order] for key, array in more.items()}
    called = file.name if name is None else name
    with np.errstate(over="ignore"):  # the response refuses what is not finite
        response = scale * response[order]
    try:
        return FrequencyResponse(
            frequency[order], response, kind=kind, dt=dt, amplitude=amplitude, name=called, notes=notes, **arrays
        )
    except RecordError as error:
        raise ReadError(f"{table.path}: {error}") from None


def _columns(table: LogTable, given: Mapping[str, str | int]) -> dict[str, Column]:
    """The column of each quantity. Raises ReadError where one is missing."""
    asked = known_keys(given, "columns", list(COLUMNS), (), ReadError)
    found = {key: table.find(given[key], key) for key in asked}
    free = [column for column in table.columns if column.key not in {c.key for c in found.values()}]
    for key, pattern in COLUMNS.items():
        if key in found:
            continue
        named = [column for column in free if re.fullmatch(rf"({pattern})(\W.*)?", _parted(column)[0].strip(), re.IGNORECASE)]
        if len(named) > 1:
            names = ", ".join(repr(column.key) for column in named)
            raise ReadError(
                f"{table.path}: {len(named)} columns may be the {key}: {names}; say which in {_given('columns', key)}"
            )
        if named:
            found[key] = named[0]
    parts = ("real", "imaginary") if "real" in found or "imaginary" in found else ("magnitude", "phase")
    for key in ("frequency", *parts):
        if key not in found:
            raise ReadError(
                f"{table.path}: no column is known to be the {key}; {table.said()}; name it in {_given('columns', key)}"
            )
    for key in ("magnitude", "phase") if parts[0] == "real" else ():
        found.pop(key, None)
    return found


def _without(column: Column, rows: NDArray[np.bool_]) -> Column:
    """A column without some rows; a cell of theirs that is no number is none of it."""
    bad = None if column.bad is None or rows[column.bad[0]] else column.bad
    return replace(column, values=column.whole()[~rows], bad=bad)


def _refuse_other_size(table: LogTable, quantity: str, column: Column) -> None:
    """Raises ReadError where a value has a unit that is not SI: `scale` says what 1 of it is."""
    unit = _parted(column)[1]
    plain = "" if unit is None else re.sub(r"[\s()*·]", "", unit).casefold()
    if plain in SI or (quantity == "magnitude" and plain == "db"):
        return
    first = f"give {_given('units', quantity)} as '1'" if quantity == "magnitude" else "leave the unit out of its name"
    given = arg("response_scale", "...", python="scale=...")
    raise ReadError(
        f"{table.path}: the {quantity} in column {column.key!r} is in {unit!r}: {first}, and say in {given} what 1 of it is in "
        "rad/s/(N m), pi/30 for rpm/(N m)"
    )


def _given(argument: str, key: str) -> str:
    """How a message names an argument; the command line has an option of its own for responses."""
    return arg(f"response_{argument}", "...", key, f"{argument}={{{key!r}: ...}}")


def _parted(column: Column) -> tuple[str, str | None]:
    """(name, unit or None) of a column: as the table parted it, or by its spelling."""
    if column.unit is not None:
        return (column.names[0] if column.names else column.key), column.unit
    match = _UNIT.fullmatch(column.key.strip())
    return (match[1], match[2]) if match else (column.key, None)


def _factor(table: LogTable, quantity: str, column: Column, given: object) -> float:
    """What 1 of a column is. Raises ReadError where nothing says it."""
    known = UNITS[quantity]
    unit = _parted(column)[1] if given is None else given
    if unit is None and quantity == "coherence":
        unit = "1"
    if isinstance(unit, str) and unit.strip().casefold() in known:
        return known[unit.strip().casefold()]
    names = " or ".join(repr({"hz": "Hz", "khz": "kHz", "db": "dB"}.get(u, u)) for u in known)
    said = "does not say its unit" if unit is None else f"has the unit {unit!r}"
    raise ReadError(f"{table.path}: the {quantity} in column {column.key!r} {said}: give {names} in {_given('units', quantity)}")
