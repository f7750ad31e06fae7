"""How a number of the policy is declared: its group, the cases that show it, and its value, unit and source."""

from __future__ import annotations

import json
from dataclasses import field
from pathlib import Path
from typing import Any

__all__ = [
    "AHEAD",
    "CALIBRATED",
    "COURSES",
    "DRIVES",
    "EFFORT",
    "ENCODER",
    "FORMS",
    "GAIN",
    "HEADERS",
    "INSTRUMENTS",
    "LAGS",
    "LOOP",
    "NOISE",
    "NUMBERS",
    "PERIODS",
    "PITCHES",
    "PROFILES",
    "PROPOSALS",
    "REAL",
    "REGRESSION",
    "RESPONSES",
    "RETUNED",
    "SAMPLED",
    "SHIFTED",
    "SHORT",
    "SHORT_MOVES",
    "SHOWN_BY",
    "SLOWER",
    "SUCCESS",
    "UNLOGGED",
    "WINDING",
    "calibrated",
    "cause",
    "check",
    "course",
    "effort",
    "experiment",
    "gain",
    "linear",
    "loop",
    "noise",
    "reading",
    "record",
    "remedy",
]

CALIBRATED: dict[str, Any] = json.loads(Path(__file__).with_name("calibrated.json").read_text(encoding="utf-8"))
"""What the blind bench wrote: its command, count of records, seed, level; by number the value and the largest one measured."""

# The cases that show a row: what `python bench/policy.py ROW` runs (bench/rows/cases.py says which records each of them has).
DRIVES = "drives"
SHORT = "short"
LOOP = "loop"
SLOWER = "slower"
SHIFTED = "shifted"
REAL = "real"
REGRESSION = "regression"
SUCCESS = "success"
WINDING = "winding"
FORMS = "forms"
LOGS = "logs"
ENCODER = "encoder"
PERIODS = "periods"
PROFILES = "profiles"
AHEAD = "ahead"
SAMPLED = "sampled"
SHORT_MOVES = "short_moves"
LAGS = "lags"
PROPOSALS = "proposals"
UNLOGGED = "unlogged"
RESPONSES = "responses"
INSTRUMENTS = "instruments"
HEADERS = "headers"
PITCHES = "pitches"
NUMBERS = "numbers"
RETUNED = "retuned"
COURSES = "courses"
SHOWN_BY = (
    *(DRIVES, SHORT, LOOP, SLOWER, SHIFTED, REAL, REGRESSION, SUCCESS, WINDING, FORMS, LOGS),
    *(ENCODER, PERIODS, PROFILES, AHEAD, SAMPLED, SHORT_MOVES, LAGS),
    *(PROPOSALS, UNLOGGED, RESPONSES, INSTRUMENTS, HEADERS, PITCHES, NUMBERS, RETUNED, COURSES),
)

GAIN = "Is the gain enough?"
NOISE = "Is this noise?"
CAUSE = "Is a finding a cause?"
SECOND = "Does a second method agree?"
CONTROLLER = "Does the logged torque follow from the controller?"
READING = "How is a log read?"
RECORD = "What does a record show?"
LINEAR = "Which linear model?"
EXPERIMENTS = "What may an experiment ask of the axis?"
REMEDIES = "Which gains are proposed?"
FLEETS = "What does the course of a parameter show?"
EFFORT = "Effort"


def _row(group: str, value: float, unit: str, source: str, cases: str = "", command: str = "") -> Any:
    told = {"group": group, "unit": unit, "source": source, "cases": cases, "command": command}
    return field(default=value, metadata=told)


def calibrated(group: str, name: str, unit: str, source: str) -> Any:
    """A row with the value that the blind bench wrote."""
    measured = CALIBRATED["numbers"][name]
    source = f"{source}; extrapolated to `noise_level`, the largest of {measured['records']} records is {measured['largest']:.3g}"
    return _row(group, measured["value"], unit, source, DRIVES, CALIBRATED["command"])


def gain(value: float, unit: str, source: str, cases: str) -> Any:
    return _row(GAIN, value, unit, source, cases)


def noise(value: float, unit: str, source: str, cases: str) -> Any:
    return _row(NOISE, value, unit, source, cases)


def cause(value: float, unit: str, source: str, cases: str) -> Any:
    return _row(CAUSE, value, unit, source, cases)


def check(value: float, unit: str, source: str, cases: str) -> Any:
    return _row(SECOND, value, unit, source, cases)


def loop(value: float, unit: str, source: str, cases: str = LOOP) -> Any:
    return _row(CONTROLLER, value, unit, source, cases)


def reading(value: float, unit: str, source: str, cases: str = LOGS) -> Any:
    return _row(READING, value, unit, source, cases)


def record(value: float, unit: str, source: str, cases: str) -> Any:
    return _row(RECORD, value, unit, source, cases)


def linear(value: float, unit: str, source: str, cases: str) -> Any:
    return _row(LINEAR, value, unit, source, cases)


def experiment(value: float, unit: str, source: str) -> Any:
    return _row(EXPERIMENTS, value, unit, source, PROPOSALS)


def remedy(value: float, unit: str, source: str) -> Any:
    return _row(REMEDIES, value, unit, source, RETUNED)


def course(value: float, unit: str, source: str) -> Any:
    return _row(FLEETS, value, unit, source, COURSES)


def effort(value: float, unit: str, source: str) -> Any:
    return _row(EFFORT, value, unit, source)
