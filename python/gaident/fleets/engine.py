"""Who works: processes of this machine, any executor, or a function like map; so many tasks are under way at a time, no more."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from contextlib import suppress
from functools import partial
from itertools import islice
from multiprocessing import connection, get_context, parent_process
from typing import Any

from gaident.errors import GaidentError, SettingsError
from gaident.fleets.task import HERE, FleetTask, Job, Outcome, lost, perform
from gaident.policy.table import POLICY
from gaident.processors import processors

__all__ = ["outcomes"]

Work = Callable[[Job], Outcome]
ENDED = f"{HERE}: the process that worked on it ended (killed, or out of memory); use fewer workers, and call again"
ANOTHER = "make another one and call again, what is done is kept"
NOT_STARTED = (
    "the worker processes do not start; in a script call this below if __name__ == '__main__':, or give "
    "executor=concurrent.futures.ThreadPoolExecutor(1)"
)


def outcomes(task: FleetTask, jobs: Iterable[Job], executor: object, workers: int | None) -> Generator[Outcome, None, None]:
    """What becomes of each job, in the order in which they end; closing it ends what is under way. Raises SettingsError."""
    work = partial(perform, task)
    if executor is None:
        return _by_processes(work, iter(jobs), processors() if workers is None else workers)
    if isinstance(executor, Executor) or (hasattr(executor, "submit") and hasattr(executor, "shutdown")):
        return _by_executor(work, iter(jobs), executor)
    if callable(executor):
        return _by_map(work, iter(jobs), executor)
    raise SettingsError(f"executor is {executor!r:.80}: give a concurrent.futures.Executor, a function like map, or None")


def _by_map(work: Work, jobs: Iterator[Job], mapped: Callable[..., Iterable[Outcome]]) -> Generator[Outcome, None, None]:
    while window := list(islice(jobs, POLICY.tasks_under_way)):
        try:
            made = mapped(work, window)
        except Exception as error:
            told = f"executor raises {type(error).__name__} ({error}): give a function like map, or an Executor"
            raise SettingsError(f"{told}, and call again, what is done is kept") from error
        for outcome in made if isinstance(made, Iterable) else [made]:
            if not isinstance(outcome, Outcome):
                raise SettingsError(f"executor gives {outcome!r:.80}: give a function like map, or an Executor")
            yield outcome


def _by_executor(work: Work, jobs: Iterator[Job], executor: Any) -> Generator[Outcome, None, None]:
    under_way: dict[Future[Outcome], Job] = {}
    try:
        while True:
            for job in islice(jobs, POLICY.tasks_under_way - len(under_way)):
                future = executor.submit(work, job)
                if not isinstance(future, Future):
                    remedy = "give a concurrent.futures.Executor, or a function like map"
                    raise SettingsError(f"executor.submit gives {future!r:.80}: {remedy}")
                under_way[future] = job
            if not under_way:
                return
            for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                job = under_way.pop(future)
                try:
                    outcome = future.result()
                except BrokenExecutor as error:
                    raise GaidentError(f"executor is broken ({error}): {ANOTHER}") from error
                except (Exception, CancelledError) as error:  # of the engine: a task raises nothing
                    outcome = lost(job, f"{ENDED} ({type(error).__name__})")
                yield outcome
    finally:
        for future in under_way:
            future.cancel()


class _Processes:
    """Processes of this machine that are started anew where one of them ends."""

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self.pool = self._started()

    def _started(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(self.workers, mp_context=get_context("spawn"), initializer=_begin)

    def ready(self) -> None:
        """Wait for the first process, which ignores Ctrl-C as all do. Raises BrokenExecutor where none starts."""
        main = threading.current_thread() is threading.main_thread()
        before = signal.signal(signal.SIGINT, signal.SIG_IGN) if main else None
        try:
            started = self.pool.submit(_ready)
        finally:
            if main:
                signal.signal(signal.SIGINT, before)
        started.result()

    def again(self) -> None:
        self.end()
        self.pool = self._started()

    def end(self) -> None:
        """End them, whatever they do."""
        running = list((getattr(self.pool, "_processes", None) or {}).values())
        self.pool.shutdown(wait=False, cancel_futures=True)
        for process in running:
            with suppress(OSError, ValueError):
                process.terminate()
        for process in running:
            with suppress(OSError, ValueError, AssertionError):
                process.join()


def _begin() -> None:
    """Ctrl-C is for the parent; where that ends, so does this process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:

        def watch() -> None:
            connection.wait([parent.sentinel])
            os._exit(1)

        threading.Thread(target=watch, daemon=True).start()


def _ready() -> bool:
    return True


def _by_processes(work: Work, jobs: Iterator[Job], workers: int) -> Generator[Outcome, None, None]:
    first = next(jobs, None)
    if first is None:
        return
    processes = _Processes(workers)
    try:
        try:
            processes.ready()
        except BrokenExecutor as error:
            raise GaidentError(NOT_STARTED) from error
        under_way: dict[Future[Outcome], Job] = {processes.pool.submit(work, first): first}
        while True:
            more = list(islice(jobs, POLICY.tasks_for_each * workers - len(under_way)))
            suspects: list[Job] = []
            for job in more:
                try:
                    under_way[processes.pool.submit(work, job)] = job
                except BrokenExecutor:
                    suspects.append(job)
            if not under_way and not suspects:
                return
            for future in list(wait(under_way, return_when=FIRST_COMPLETED).done):
                job = under_way.pop(future)
                try:
                    yield future.result()
                except BrokenExecutor:
                    suspects.append(job)
            if suspects:
                # One of those under way ended its process, and with it all others: each is tried alone.
                wait(under_way)
                suspects += [job for future, job in under_way.items() if future.exception() is not None]
                yield from (future.result() for future in under_way if future.exception() is None)
                under_way.clear()
                processes.again()
                for job in suspects:
                    try:
                        yield processes.pool.submit(work, job).result()
                    except BrokenExecutor:
                        yield lost(job, ENDED)
                        processes.again()
    finally:
        processes.end()
