"""What is done with one log: read, diagnosed or identified, and turned into rows. It never raises; an error is a row."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gaident.control.controller import Controller
from gaident.data.readers import read
from gaident.data.record import Record
from gaident.diagnosis.blas import one_thread
from gaident.diagnosis.diagnose import diagnose
from gaident.drive.drive_file import Drive
from gaident.drive.temperature import temperature_of
from gaident.errors import GaidentError
from gaident.fleets.rows import rows_of
from gaident.identification.identify import identify
from gaident.processors import one_processor
from gaident.version import version

__all__ = ["METHODS", "Job", "Outcome", "FleetTask", "content_of", "lost", "perform", "shown"]

METHODS = ("diagnose", "identify")
HERE = "{log}"
CHANGED = f"{HERE}: the file changed while it was read; call again when it is complete"
"""Stands for the path in a message: two logs of the same content have one result."""

BLOCK = 1 << 20  # no decision: memory: bytes of a log that are read at once


@dataclass(frozen=True)
class FleetTask:
    """The settings that all logs have in common; `digest` names them."""

    method: str
    controller: Controller | None
    kind: str
    drive: Drive | None = None
    reading: Mapping[str, Any] = field(default_factory=dict)
    more: Mapping[str, Any] = field(default_factory=dict)  # further arguments of diagnose or identify
    temperature: str | None = None
    seed: int = 0
    version: str = field(default_factory=version)

    @property
    def digest(self) -> str:
        """Digest of everything on which a result depends but the log."""
        drive = self.drive
        parts = {
            "method": self.method,
            "controller": None if self.controller is None else self.controller.to_dict(),
            "kind": self.kind,
            "drive": None if drive is None else [drive.general, drive.columns, drive.units, drive.shift],
            "reading": self.reading,
            "more": self.more,
            "temperature": self.temperature,
            "seed": self.seed,
            "version": self.version,
        }
        return _digest(json.dumps(parts, sort_keys=True, default=repr).encode())

    def key(self, content: str, log: str) -> str:
        """Name of the result of a log: of its content, of its ending, by which its format is known, and of the settings."""
        return _digest(f"{content} {shown(Path(log).suffix.lower())} {self.digest}".encode())


@dataclass(frozen=True)
class Job:
    """One log to be worked on; content: digest of its bytes, key: the name of its result."""

    log: str
    content: str
    key: str


@dataclass(frozen=True)
class Outcome:
    """What became of a log; status "done", "failed" (it would fail again) or "lost" (it may be tried again)."""

    log: str
    key: str
    status: str
    error: str = ""
    seconds: float = 0.0
    row: Mapping[str, Any] = field(default_factory=dict)
    parameters: tuple[Mapping[str, Any], ...] = ()
    text: str = ""  # of the result's JSON


def lost(job: Job, why: str) -> Outcome:
    """A log whose worker ended without an answer."""
    return Outcome(job.log, job.key, "lost", why)


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def shown(name: str | bytes) -> str:
    """A name of a file as text that every table, message and page takes: what is not UTF-8 in it is written as \\xNN."""
    return os.fsencode(name).decode("utf-8", "backslashreplace")


def content_of(path: str) -> str:
    """Digest of a file's bytes; raises OSError."""
    digest = hashlib.sha256()
    with open(path, "rb") as stream:
        while block := stream.read(BLOCK):
            digest.update(block)
    return digest.hexdigest()


def perform(task: FleetTask, job: Job) -> Outcome:
    """The job's outcome; never raises but for Ctrl-C. It uses one processor."""
    try:
        with ExitStack() as stack:
            stack.enter_context(one_processor())
            stack.enter_context(one_thread())
            return _performed(task, job)
    except GaidentError as error:
        return _refused(job, error)
    except MemoryError:
        return lost(job, f"{HERE}: the memory was not enough; use fewer workers, or decimate the log")
    except OSError as error:
        return lost(job, f"{HERE}: cannot be read ({error.strerror or error}); check the file, and call again")
    except Exception as error:
        why = f"internal error, please report it: {type(error).__name__}: {_said(error, job)}"
        return Outcome(job.log, job.key, "failed", f"{HERE}: {why}")


def _refused(job: Job, error: GaidentError) -> Outcome:
    """What a log says that is still the one of the job fails again; one that is gone or another may be tried again."""
    try:
        same = content_of(job.log) == job.content
    except OSError as gone:
        return lost(job, f"{HERE}: cannot be read ({gone.strerror or gone}); check the file, and call again")
    return Outcome(job.log, job.key, "failed", _said(error, job)) if same else lost(job, CHANGED)


def _said(error: Exception, job: Job) -> str:
    """A message without the log's name, as text that a table takes."""
    return str(error).replace(job.log, HERE).encode("utf-8", "backslashreplace").decode()


def _performed(task: FleetTask, job: Job) -> Outcome:
    records = _records(task, job.log)
    temperature = None if task.temperature is None else _mean_of(task, job.log)
    if content_of(job.log) != job.content:
        return lost(job, CHANGED)
    given = {"controller": task.controller, "seed": task.seed, **task.more}
    whole: Callable[..., Any] = diagnose if task.method == METHODS[0] else identify
    if whole is diagnose:
        given["axis"] = task.kind
    result = whole(records, **given)
    row, parameters = rows_of(result, records, task.kind, temperature)
    return Outcome(job.log, job.key, "done", "", result.seconds, row, parameters, result.to_json())


def _records(task: FleetTask, log: str) -> list[Record]:
    # The name is no content of the log: what is saved of two equal logs is the same.
    if task.drive is not None:
        return task.drive.records(log)
    return [read(log, **task.reading)]


def _mean_of(task: FleetTask, log: str) -> float | None:
    """Mean of the column with the temperature, in its own unit; None where a log has no value of it."""
    known = temperature_of(log, str(task.temperature), task.reading if task.drive is None else task.drive.general)
    return float(known.mean()) if known.size else None
