"""fleet(): every log diagnosed, nothing lost, kept as a dataset."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from gaident.axis import checked_axis
from gaident.checks import checked_path, known_keys, one_of, size_of_drive, yes_or_no
from gaident.control.controller import Controller, checked_controller
from gaident.drive.drive_file import Drive, read_drive_file, unfilled_of
from gaident.errors import SettingsError
from gaident.files import write_whole
from gaident.fleets.dataset import TABLES, best_format, part_file, parts_of, read_part, remove_part, write_part
from gaident.fleets.engine import outcomes
from gaident.fleets.index import Index, opened, result_path
from gaident.fleets.names import Names, named_logs, names_of
from gaident.fleets.task import METHODS, FleetTask, Job, Outcome, content_of, shown
from gaident.identification.arguments import check_numbers

__all__ = ["Fleet", "fleet", "kept_fleet"]

READING = (
    *("columns", "units", "dt", "counts_per_turn", "torque_constant", "rated_torque", "torque_per_volt", "resistance"),
    *("inductance", "back_emf_constant", "screw", "reference_speed", "velocity_cutoff_hz", "decimate", "resample", "gear_ratio"),
    *("load_side", "torque_is", "torque_log", "shift", "delimiter", "decimal", "skip", "encoding"),
)

ProgressCallback = Callable[[float, str], None]


@dataclass(frozen=True)
class Fleet:
    """What `fleet` has done.

    Attributes
    ----------
    out : str
        The folder of the dataset.
    logs : int
        Logs that were given.
    done : int
        Logs that have a result.
    failed : int
        Logs that have none; the table of logs says of each why, and what to do.
    there : int
        Of all these, how many were worked on before and were not worked on again.
    seconds : float
        Time that it took [s].

    See Also
    --------
    fleet : Makes it, with an example.
    """

    out: str
    logs: int
    done: int
    failed: int
    there: int
    seconds: float

    def rows(self, table: str = "logs") -> Iterator[dict[str, Any]]:
        """Read a table row by row, each with its axis and its month.

        Parameters
        ----------
        table : {"logs", "parameters"}
            Which table.

        Yields
        ------
        dict
            Column -> value.

        Raises
        ------
        GaidentError
            Where there is no such table.
        """
        one_of(table, "table", ("logs", "parameters"), SettingsError)
        for axis, month, file in parts_of(Path(self.out), table):
            for row in read_part(file, table):
                yield {"axis": axis, "month": month, **row}

    def first_failed(self) -> list[str]:
        """Return why logs failed, a sentence each, of the first ten of them."""
        failed = (row["error"] for row in self.rows() if row["status"] == "failed")
        return list(islice(failed, 10))  # no decision: printed

    def summary(self) -> str:
        """Return how many logs are done and failed, and where the results are."""
        rate = (self.logs - self.there) / self.seconds if self.seconds > 0.0 else 0.0
        told = f"{self.logs} logs: {self.done} done, {self.failed} failed, {self.there} of them before; {rate:.3g} logs/s"
        return f"{told}\nwritten: {self.out}"


def fleet(
    logs: object,
    controller: Controller | None = None,
    axis: str = "rotary",
    executor: object = None,
    out: str | os.PathLike[str] = "fleet.parquet",
    resume: bool = True,
    *,
    drive: str | os.PathLike[str] | Drive | None = None,
    read: Mapping[str, Any] | None = None,
    names: str | Names | None = None,
    method: str = "diagnose",
    quick: bool = False,
    noise: float | None = None,
    pitch: float | None = None,
    temperature: str | None = None,
    seed: int = 0,
    workers: int | None = None,
    progress: ProgressCallback | None = None,
) -> Fleet:
    """Diagnose many logs, each by itself, and keep what was found as a dataset.

    A log that cannot be read or diagnosed is a row with the reason and the remedy.
    The result of a log belongs to the digest of its content, of the settings and of the version of gaident: what is there is not
    made again, and a run that was killed goes on where it was.
    The folder `out` contains the tables logs and parameters, by axis and month, and the JSON of each result, see
    docs/how-to/fleets.md.

    Parameters
    ----------
    logs : str, path-like or iterable of them
        Paths and patterns, such as "logs/**/*.csv".
    controller : PI or Cascade, optional
        As `diagnose` takes it; None: that of `drive`, or open loop.
    axis : {"rotary", "linear"}
        Kind of all axes; with `drive`, what that says counts.
    executor : Executor or callable, optional
        Who works: any `concurrent.futures.Executor`, or a function like `map`; None: processes of this machine.
    out : str or path-like
        Folder of the dataset; a run adds to what it contains.
    resume : bool
        Keep results that are there; False: make those of the given logs again.
    drive : str, path-like or Drive, optional
        The drive file with what belongs to the axes, in place of `controller` and `read`.
    read : mapping, optional
        Further arguments of `read`: columns, units, dt and others.
    names : str or callable, optional
        Whose a log is and of when: a regular expression with the groups axis and time, which is looked for in the path, or a
        function of the path that returns both, the name and a datetime (UTC where it has no time zone).
        None: the axis is the log's folder, the time the date in its name, or in that of a folder, or the file's last change.
    method : {"diagnose", "identify"}
        What is done with each log.
    quick : bool
        As `diagnose` takes it: stop at the first cause.
    noise : float, optional
        Standard deviation of the velocity noise [rad/s], as `diagnose` takes it.
    pitch : float, optional
        Of linear axes, the length with which cogging returns [m], as `diagnose` takes it.
    temperature : str, optional
        Column with the temperature; its mean over each log stands in the tables, in its own unit.
    seed : int
        Seed of the random numbers of every log.
    workers : int, optional
        Processes, where there is no `executor`; None: one for each processor.
    progress : callable, optional
        Called now and then with (fraction done, message), see `gaident.progress`.

    Returns
    -------
    Fleet
        How many are done, how many failed, and where the dataset is.

    Raises
    ------
    GaidentError
        Names the argument, its value and the remedy; never because of a log.
    OSError
        Where the dataset cannot be written; what is done is kept.

    Examples
    --------
    >>> import os
    >>> import numpy as np
    >>> import gaident as ga
    >>> os.makedirs("logs/press", exist_ok=True)
    >>> torque = np.repeat([1.0, -1.0, 0.5, -0.5], 100)
    >>> velocity = ga.simulate(ga.OneMass(J=0.01, D=0.05), ga.Record(1e-3, torque=torque, velocity=0.0 * torque))
    >>> for day in (1, 2):
    ...     noisy = velocity + 0.01 * np.random.default_rng(day).standard_normal(400)
    ...     table = np.column_stack([1e-3 * np.arange(400), torque, noisy])
    ...     name = f"logs/press/2026-03-0{day}.csv"
    ...     np.savetxt(name, table, delimiter=",", header="time,torque,velocity", comments="")
    >>> found = ga.fleet("logs/*/*.csv", out="fleet.parquet", executor=map)
    >>> found.logs, found.done, found.failed
    (2, 2, 0)
    >>> [(row["axis"], row["time"][:10], row["verdict"]) for row in found.rows()]
    [('press', '2026-03-01', 'adequate'), ('press', '2026-03-02', 'adequate')]
    """
    began = time.perf_counter()
    task = _task(controller, axis, drive, read, method, quick, noise, pitch, temperature, seed)
    yes_or_no(resume, "resume", SettingsError)
    check_numbers(1, seed, workers, progress)
    folder, named = checked_path(out, "out", SettingsError), names_of(names)
    if folder.exists() and not folder.is_dir():
        raise SettingsError(f"out is {os.fspath(out)!r}: this is a file; name a folder")
    with opened(folder) as index:
        kind = index.about("format")
        if kind is None:
            index.keep("format", kind := best_format())
        run = _Run(index, folder, task, resume, progress, index.list_logs(named_logs(logs, named)))
        try:
            with closing(outcomes(task, run.jobs(), executor, workers)) as ended:
                for outcome in ended:
                    run.keep(outcome)
        finally:
            _written(index, folder, kind)
        counts = index.counts()
    done = counts.get("done", 0)
    return Fleet(os.fspath(out), run.total, done, sum(counts.values()) - done, run.there, time.perf_counter() - began)


def kept_fleet(folder: str | os.PathLike[str]) -> Fleet:
    """A dataset that is there, to be read. Raises GaidentError where there is none."""
    path = checked_path(folder, "fleet", SettingsError)
    statuses = [row["status"] for _, _, file in parts_of(path, "logs") for row in read_part(file, "logs")]
    done = statuses.count("done")
    return Fleet(os.fspath(path), len(statuses), done, len(statuses) - done, len(statuses), 0.0)


def _task(
    controller: Controller | None,
    axis: str,
    drive: object,
    read: Mapping[str, Any] | None,
    method: str,
    quick: bool,
    noise: float | None,
    pitch: float | None,
    temperature: str | None,
    seed: int,
) -> FleetTask:
    """The settings, checked as far as they can be without a log."""
    one_of(method, "method", METHODS, SettingsError)
    yes_or_no(quick, "quick", SettingsError)
    if temperature is not None and not isinstance(temperature, str):
        raise SettingsError(f"temperature is {temperature!r:.80}: give the name of the column with the temperature, or None")
    if temperature == "":
        raise SettingsError("temperature is '': give the name of the column with the temperature, or None")
    if noise is not None:
        noise = size_of_drive(noise, "noise", SettingsError, "give its standard deviation in rad/s, above 0, or None")
    if pitch is not None:
        pitch = size_of_drive(pitch, "pitch", SettingsError, "give the length with which cogging returns in m, above 0, or None")
    given = None if drive is None else drive if isinstance(drive, Drive) else _drive(checked_path(drive, "drive", SettingsError))
    if given is not None and (controller is not None or read is not None):
        raise SettingsError("drive is given beside controller or read: the drive file says both; leave these out")
    reading = known_keys({} if read is None else read, "read", READING, (), SettingsError)
    for name, value in reading.items():
        if not _is_plain(value):
            raise SettingsError(f"read: {name} is {value!r:.80}: give text, numbers, or mappings and lists of them")
    used = given.controller() if given is not None else checked_controller(controller)
    kind = given.axis if given is not None else checked_axis(axis)
    more: dict[str, Any] = {}
    if method == METHODS[0]:
        more = {"quick": quick, "noise": noise, "pitch": pitch if given is None or pitch is not None else given.pitch}
        if given is not None and given.expected:
            more["expected"] = given.expected
    elif quick or noise is not None or pitch is not None:
        raise SettingsError("method is 'identify': quick, noise and pitch belong to a diagnosis; leave them out")
    return FleetTask(method, used, kind, given, reading, more, temperature, seed)


def _is_plain(value: object) -> bool:
    """Whether a value can be sent to a process, and its digest is the same tomorrow."""
    if isinstance(value, Mapping):
        return all(isinstance(name, str) and _is_plain(part) for name, part in value.items())
    if isinstance(value, (list, tuple)):
        return all(_is_plain(part) for part in value)
    return value is None or isinstance(value, (str, bool, int, float))


def _drive(path: Path) -> Drive:
    """A drive file of one axis, whose settings all axes have."""
    s = read_drive_file(str(path))
    about = {key: value for key, value in s["report"].items() if value}
    parts = (s[""], s["columns"], s["units"], s["controller"], s["space"], s["limits"], s["shift"], s["show"], about)
    return Drive(*parts, unfilled_of(str(path)))


class _Run:
    """One run over the logs: what is to be done, and what is kept of it."""

    def __init__(
        self, index: Index, folder: Path, task: FleetTask, resume: bool, progress: ProgressCallback | None, total: int
    ) -> None:
        self.index, self.folder, self.task, self.resume, self.total = index, folder, task, resume, total
        self.settings = task.digest
        self.told = (lambda fraction, message: None) if progress is None else progress
        self.there = self.done = self.failed = 0
        self.began = time.perf_counter()

    def jobs(self) -> Iterator[Job]:
        """The logs that have no result; the result of each other one is entered."""
        for file, path in self.index.logs():
            content, why = _content(path)
            if not content and self.index.done_before(file):  # moved away since: what was found of it stays
                self.there += 1
                self._count("done")
                continue
            key = self.task.key(content or shown(file), path)
            self.index.key_of(file, content, self.settings, self.task.version, key)
            if not content:
                self.keep(Outcome(path, key, "lost", why))
            elif (status := self.index.known(key, self.resume)) is not None:
                self.there += 1
                self._count(status)
            else:
                yield Job(path, content, key)

    def keep(self, outcome: Outcome) -> None:
        """Keep an outcome: its JSON first, so that no row names a file that is not there."""
        if outcome.text:
            target = self.folder / result_path(outcome.key)
            target.parent.mkdir(parents=True, exist_ok=True)
            write_whole(target, outcome.text.encode())
        self.index.done(outcome)
        self._count(outcome.status)

    def _count(self, status: str) -> None:
        self.done += status == "done"
        self.failed += status != "done"
        worked = self.done + self.failed - self.there
        rate = worked / max(time.perf_counter() - self.began, 1e-9)
        self.told((self.done + self.failed) / self.total, f"{self.done} done, {self.failed} failed, {rate:.3g} logs/s")


def _content(path: str) -> tuple[str, str]:
    """(digest of a log, "") or ("", why it has none)."""
    try:
        return content_of(path), ""
    except FileNotFoundError:
        return "", "{log}: there is no such log; check the path, and call again"
    except OSError as error:
        return "", f"{{log}}: cannot be read ({error.strerror or error}); check the file, and call again"


def _written(index: Index, folder: Path, kind: str) -> None:
    """Write the parts of the dataset that have changed; raises OSError, and GaidentError where pyarrow is missing."""

    def there(axis: str, month: str) -> bool:
        return all(part_file(folder, table, axis, month, kind).is_file() for table in TABLES)

    for axis, month in index.stale(there):
        rows = list(index.part(axis, month))
        if not rows:  # its logs have other names now
            for table in TABLES:
                remove_part(folder, table, axis, month, kind)
            index.written(axis, month)
            continue
        write_part(folder, "logs", axis, month, [row for row, _ in rows], kind)
        write_part(folder, "parameters", axis, month, [p for _, parameters in rows for p in parameters], kind)
        index.written(axis, month)
