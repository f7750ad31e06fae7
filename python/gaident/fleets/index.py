"""What is done: a small database in the folder of a fleet, which a process that is killed at any moment leaves whole.

A log is a file: `file` is its path without links, whichever of its names was given, `path` the name that was given.
Both are bytes, as a name need not be UTF-8.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gaident.errors import GaidentError
from gaident.files import lock_alone
from gaident.fleets.dataset import INDEX
from gaident.fleets.task import Outcome, shown

__all__ = ["Index", "opened", "result_path"]

TABLES = """
CREATE TABLE IF NOT EXISTS about (name TEXT PRIMARY KEY, value TEXT);
CREATE TABLE IF NOT EXISTS logs (
    file BLOB PRIMARY KEY, path BLOB, axis TEXT, time TEXT, content TEXT, settings TEXT, version TEXT, key TEXT, run INTEGER
) WITHOUT ROWID;
CREATE INDEX IF NOT EXISTS of_file ON logs (content, file);
CREATE INDEX IF NOT EXISTS of_run ON logs (run, path);
CREATE INDEX IF NOT EXISTS of_part ON logs (axis, substr(time, 1, 7), time, path);
CREATE INDEX IF NOT EXISTS of_key ON logs (key);
CREATE TABLE IF NOT EXISTS results (key TEXT PRIMARY KEY, status TEXT, error TEXT, row TEXT, parameters TEXT, run INTEGER);
CREATE TABLE IF NOT EXISTS stale (axis TEXT, month TEXT, PRIMARY KEY (axis, month));
"""
FULL = "{}: the disk is full, or the file cannot be written ({}); make room and call again, what is done is kept"
DAMAGED = "{}: cannot be used ({}); remove it, and the logs are worked on again"
PAGE = 500  # no decision: memory: rows that are read at once


def result_path(key: str) -> str:
    """Where the JSON of a result stands in the folder of a fleet; folders of a few files each are quick."""
    return f"results/{key[:2]}/{key[2:4]}/{key}.json"


def month_of(time: str) -> str:
    """The month of a time: 2026-03."""
    return time.rpartition("-")[0]


class Index:
    """Logs with their axis, time and key, results by their key, and the parts of the dataset that are to be written again."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / INDEX
        self.base = sqlite3.connect(self.path)
        self.base.execute("PRAGMA journal_mode=WAL")
        self.base.execute("PRAGMA synchronous=NORMAL")
        self.base.executescript(TABLES)
        self.run = int(self.about("run") or 0) + 1
        with self.changed():
            self.base.execute("INSERT OR REPLACE INTO about VALUES ('run', ?)", (str(self.run),))

    @contextmanager
    def changed(self) -> Iterator[sqlite3.Connection]:
        """A change, which is made as a whole or not at all; raises GaidentError where the disk takes none."""
        try:
            with self.base:
                yield self.base
        except sqlite3.OperationalError as error:
            raise GaidentError(FULL.format(self.path, error)) from error

    def about(self, name: str) -> str | None:
        row = self.base.execute("SELECT value FROM about WHERE name = ?", (name,)).fetchone()
        return None if row is None else str(row[0])

    def keep(self, name: str, value: str) -> None:
        with self.changed() as base:
            base.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (name, value))

    def list_logs(self, named: Iterable[tuple[str, str, str]]) -> int:
        """Enter (path, axis, time) of the logs of this run; returns how many there are.

        Of several names of one file the first by the alphabet counts, and of several runs the last.
        """
        with self.changed() as base:
            for name, axis, time in named:
                path, file = os.fsencode(name), os.fsencode(os.path.realpath(name))
                query = "SELECT axis, substr(time, 1, 7), path, time, run FROM logs WHERE file = ?"
                before = base.execute(query, (file,)).fetchone()
                if before is None:
                    values = (file, path, axis, time, self.run)
                    base.execute("INSERT INTO logs (file, path, axis, time, run) VALUES (?, ?, ?, ?, ?)", values)
                    continue
                if before[4] == self.run and before[2] <= path:
                    continue
                if (before[0], before[2], before[3]) != (axis, path, time):
                    parts = [(before[0], before[1]), (axis, month_of(time))]
                    base.executemany("INSERT OR IGNORE INTO stale VALUES (?, ?)", parts)
                changed = (path, axis, time, self.run, file)
                base.execute("UPDATE logs SET path = ?, axis = ?, time = ?, run = ? WHERE file = ?", changed)
            return int(base.execute("SELECT count(*) FROM logs WHERE run = ?", (self.run,)).fetchone()[0])

    def logs(self) -> Iterator[tuple[bytes, str]]:
        """(file, path) of the logs of this run, by their paths."""
        last = b""
        while True:
            query = "SELECT file, path FROM logs WHERE run = ? AND path > ? ORDER BY path LIMIT ?"
            rows = self.base.execute(query, (self.run, last, PAGE)).fetchall()
            if not rows:
                return
            for file, path in rows:
                yield file, os.fsdecode(path)
            last = rows[-1][1]

    def key_of(self, file: bytes, content: str, settings: str, version: str, key: str) -> None:
        """Say which result belongs to a log."""
        with self.changed() as base:
            old = base.execute("SELECT key, content FROM logs WHERE file = ?", (file,)).fetchone()
            if old is None or old[0] != key:
                if content and not (old and old[1]):
                    self._moved(base, file, content)
                values = (content, settings, version, key, file)
                base.execute("UPDATE logs SET content = ?, settings = ?, version = ?, key = ? WHERE file = ?", values)
                self._stale(base, "file", file)

    def _moved(self, base: sqlite3.Connection, file: bytes, content: str) -> None:
        """Where a new log has the content of one whose file is gone, it is that log under another name: the old name goes."""
        query = "SELECT file FROM logs WHERE content = ? AND file <> ? AND run < ? ORDER BY file"
        for (other,) in base.execute(query, (content, file, self.run)).fetchall():
            if not os.path.lexists(other):
                self._stale(base, "file", other)
                base.execute("DELETE FROM logs WHERE file = ?", (other,))
                return

    def done_before(self, file: bytes) -> bool:
        """Whether a result of a log is there, whatever it was made of."""
        query = "SELECT 1 FROM logs JOIN results USING (key) WHERE file = ? AND status = 'done'"
        return self.base.execute(query, (file,)).fetchone() is not None

    def known(self, key: str, resume: bool) -> str | None:
        """The status of a result that need not be made again; without `resume` only those of this run."""
        row = self.base.execute("SELECT status, run FROM results WHERE key = ? AND status <> 'lost'", (key,)).fetchone()
        return None if row is None or not (resume or row[1] == self.run) else str(row[0])

    def done(self, outcome: Outcome) -> None:
        """Enter a result."""
        text = [json.dumps(part, allow_nan=True) for part in (outcome.row, outcome.parameters)]
        values = (outcome.key, outcome.status, outcome.error, *text, self.run)
        with self.changed() as base:
            base.execute("INSERT OR REPLACE INTO results VALUES (?, ?, ?, ?, ?, ?)", values)
            self._stale(base, "key", outcome.key)

    def _stale(self, base: sqlite3.Connection, column: str, value: str | bytes) -> None:
        """Parts of the dataset that contain such logs are to be written again."""
        base.execute(
            f"INSERT OR IGNORE INTO stale SELECT DISTINCT axis, substr(time, 1, 7) FROM logs WHERE {column} = ?", (value,)
        )

    def stale(self, there: Callable[[str, str], bool]) -> list[tuple[str, str]]:
        """(axis, month) of the parts of the dataset that are to be written; there: whether the files of a part are."""
        parts = "SELECT DISTINCT axis, substr(time, 1, 7) FROM logs JOIN results ON results.key = logs.key"
        missing = [part for part in self.base.execute(parts).fetchall() if not there(*part)]
        if missing:
            with self.changed() as base:
                base.executemany("INSERT OR IGNORE INTO stale VALUES (?, ?)", missing)
        return [(a, m) for a, m in self.base.execute("SELECT axis, month FROM stale ORDER BY axis, month")]

    def written(self, axis: str, month: str) -> None:
        with self.changed() as base:
            base.execute("DELETE FROM stale WHERE axis = ? AND month = ?", (axis, month))

    def part(self, axis: str, month: str) -> Iterator[tuple[Mapping[str, Any], list[Mapping[str, Any]]]]:
        """(row of a log, rows of its parameters) of one part, in the order of time."""
        query = """SELECT path, time, content, settings, version, logs.key, status, error, row, parameters
            FROM logs JOIN results ON results.key = logs.key WHERE axis = ? AND substr(time, 1, 7) = ? ORDER BY time, path"""
        for values in self.base.execute(query, (axis, month)):
            path, time, content, settings, version, key, status, error, row, parameters = values
            path = shown(path)
            about = {"log": path, "time": time, "result": result_path(key) if status == "done" else None}
            state = {
                "status": "failed" if status == "lost" else status,
                "error": error.replace("{log}", path) or None,
                "content": content,
                "settings": settings,
                "version": version,
            }
            yield {**json.loads(row), **about, **state}, [{**p, **about} for p in json.loads(parameters)]

    def counts(self) -> dict[str, int]:
        """How many logs of this run have which status."""
        query = "SELECT status, count(*) FROM logs JOIN results ON results.key = logs.key WHERE logs.run = ? GROUP BY status"
        return {status: int(n) for status, n in self.base.execute(query, (self.run,))}

    def close(self) -> None:
        self.base.close()


@contextmanager
def opened(folder: Path) -> Iterator[Index]:
    """The index of a folder, which no other process has at the same time.

    Raises GaidentError where one has, or the file is none.
    """
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT)
    try:
        try:
            lock_alone(descriptor)
        except BlockingIOError:
            raise GaidentError(f"out is {folder}: another process writes there; wait for it, or name another folder") from None
        try:
            index = Index(folder)
        except sqlite3.DatabaseError as error:
            raise GaidentError(DAMAGED.format(folder / INDEX, error)) from error
        try:
            yield index
        finally:
            index.close()
    finally:
        os.close(descriptor)
