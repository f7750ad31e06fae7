"""Reader for the trace of SINUMERIK Operate: an XML file of sessions, signals and records.

The layout is that of a trace in the public repository hailongchenn/sinumerik-trace-viewer, and of what eliasrhoden/Trace-Tools
and two more public readers take it for:

    <traceSession> ... <traceData> <dataFrame>
      <frameHeader dropOuts="0" .../>
      <dataSignal id="f6" name="/Nck/!SD/nckServoDataActVelMot32 [u1, 7]" description="..." interval="0.002000"
                  datapointCount="22709" unitsType="velo" .../>
      <rec time="0.004000" f4="-0.000172"/>

A record names the signals that have changed; a signal keeps its value until then, and no record stands where none has.
Each signal is sampled every `interval` seconds, from the record that names it first.

No unit of length, speed or torque is in the file: what `unitsType` calls "velo" is 1/min for a rotary axis (in that trace the
slope of the position in degrees is 6 times it), another one for a linear axis. A current is in A.
"""

from __future__ import annotations

import math
from contextlib import ExitStack
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.delimited import TextOptions
from gaident.data.formats.stored import check_unpacked
from gaident.data.formats.table import Column, LogTable, first_line
from gaident.errors import ReadError

__all__ = ["open_sinumerik"]

_UNITS = {"current": "A"}
_ROOT = "traceSession"
FARTHEST = 2.0**53  # no decision: a number: the last of the whole numbers that a float counts


class _Signal:
    """One signal as its records pass: the samples at which it was written, and what it was."""

    def __init__(self, path: str, attributes: dict[str, str]) -> None:
        self.key = attributes.get("id", "")
        self.name = attributes.get("name", "") or self.key
        self.description = attributes.get("description", "")
        self.unit = _UNITS.get(attributes.get("unitsType", ""))
        self.interval = _number(path, attributes.get("interval", ""), f"interval of the signal {self.name!r}")
        if not self.interval > 0.0:
            raise ReadError(f"{path}: the signal {self.name!r} has the interval {self.interval:g} s; record the trace again")
        self.count = int(_number(path, attributes.get("datapointCount", "0"), f"datapointCount of the signal {self.name!r}"))
        self.times: list[float] = []
        self.values: list[float] = []

    def places(self, path: str) -> NDArray[np.float64]:
        """The samples at which it was written, whole numbers from 0 on, and the one behind its last."""
        with np.errstate(over="ignore"):
            at = np.minimum(np.rint((np.array(self.times) - self.times[0]) / self.interval), FARTHEST)
        if (np.diff(at) < 0).any():
            raise ReadError(f"{path}: the times of its records do not increase; record the trace again")
        return np.append(at, max(float(at[-1]) + 1.0, float(self.count)))

    def samples(self, places: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """(time of the first sample [s], all samples, the last value held where nothing was written)."""
        return self.times[0], np.repeat(self.values, np.diff(places).astype(np.int64))


def open_sinumerik(path: str, file: Path, options: TextOptions, stack: ExitStack) -> LogTable:
    """The signals of a trace by their addresses, descriptions and numbers (`f6`) as other names, and a time for each rate.

    Raises ReadError for another XML file, several recordings in one file, and one that has lost points.
    """
    trace = _Trace(path, file.stat().st_size)
    try:
        for event, element in ElementTree.iterparse(file, events=("start", "end")):
            trace.pass_by(event, element)
    except ReadError:
        raise
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # the latter two: of an encoding that Python lacks
        raise ReadError(f"{path}: not a whole XML file ({first_line(error)}); copy it again") from None
    return trace.table()


class _Trace:
    """What a file contains, as its elements pass."""

    def __init__(self, path: str, size: int) -> None:
        self.path, self.size, self.root, self.frames = path, size, "", 0
        self.signals: dict[str, _Signal] = {}

    def pass_by(self, event: str, element: ElementTree.Element) -> None:
        if event == "start":
            self.root = self.root or element.tag
            if self.root != _ROOT:
                raise ReadError(f"{self.path}: the XML file contains <{self.root}>, no trace of SINUMERIK; export the log as CSV")
            self.frames += element.tag == "dataFrame"
            if self.frames > 1:
                raise ReadError(f"{self.path}: the file contains several recordings; save each in a file of its own")
            return
        if element.tag == "frameHeader" and _number(self.path, element.get("dropOuts", "0"), "dropOuts") != 0.0:
            lost = element.get("dropOuts")
            raise ReadError(f"{self.path}: {lost} points of the trace were lost (dropOuts); record fewer signals, or slower")
        if element.tag == "dataSignal":
            signal = _Signal(self.path, element.attrib)
            self.signals[signal.key] = signal
        elif element.tag == "rec":
            time = _number(self.path, element.get("time", ""), "time of a record")
            for key, text in element.attrib.items():
                if key in self.signals:
                    self.signals[key].times.append(time)
                    self.signals[key].values.append(
                        _number(self.path, text, f"value of {self.signals[key].name!r} at {time:g} s")
                    )
            element.clear()

    def table(self) -> LogTable:
        written = [signal for signal in self.signals.values() if signal.times]
        if not written:
            raise ReadError(f"{self.path}: the trace contains no records; record it again")
        clocks: dict[tuple[float, float, int], str] = {}
        columns = []
        places = [signal.places(self.path) for signal in written]
        # A value that is held for long is a few letters: what they stand for is counted before it is made.
        check_unpacked(self.path, int(2 * 8 * sum(float(at[-1]) for at in places)), self.size)
        for signal, at in zip(written, places, strict=True):
            start, values = signal.samples(at)
            rate = start, signal.interval, values.size
            clock = clocks.setdefault(rate, f"time of {signal.interval:g} s from {start:g} s" if clocks else "time")
            names = tuple(dict.fromkeys(name for name in (signal.description, signal.key) if name and name != signal.name))
            columns.append(Column(signal.name, values, names, signal.unit, clock=clock))
        times = [
            Column(name, np.round(start + interval * np.arange(count), 9), unit="s")
            for (start, interval, count), name in clocks.items()
        ]
        silent = tuple(signal.name for signal in self.signals.values() if not signal.times)
        return LogTable(self.path, (*times, *columns), others=silent)


def _number(path: str, text: str, what: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ReadError(f"{path}: the {what} is {text!r}, no finite number; copy the file again")
    return number
