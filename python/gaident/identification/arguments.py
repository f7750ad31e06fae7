"""What identify() is given, checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from gaident.arguments import A_CONTROLLER, COMMAND, CONTINUOUS_LOOP, NO_CONTROLLER, TORQUE, arg
from gaident.checks import is_whole
from gaident.control.controller import Controller, checked_controller
from gaident.data.frequency.response import FrequencyResponse
from gaident.data.record import Record
from gaident.errors import RecordError, SettingsError, SpaceError
from gaident.models.search_space import SearchSpace
from gaident.results.settings import Settings

__all__ = ["check_arithmetic", "check_numbers", "checked_records", "checked_space", "distinct", "parted"]


def parted(rec: object) -> tuple[list[Record], list[FrequencyResponse]]:
    """(records, frequency responses) of what identify() is given. Raises RecordError where it is something else."""
    given = [rec] if isinstance(rec, Record | FrequencyResponse) else list(rec) if isinstance(rec, Sequence) else []
    if not given or not all(isinstance(r, Record | FrequencyResponse) for r in given):
        raise RecordError(
            f"rec is {type(rec).__name__}: give a gaident.Record or FrequencyResponse, or a list of them, at least one"
        )
    return [r for r in given if isinstance(r, Record)], [r for r in given if isinstance(r, FrequencyResponse)]


def checked_records(rec: Record | Sequence[Record], controller: Controller | None) -> list[Record]:
    """The records as a list, once each has the input that drives the model. Raises RecordError and SettingsError."""
    records = [rec] if isinstance(rec, Record) else list(rec) if isinstance(rec, Sequence) else None
    if not records or not all(isinstance(r, Record) for r in records):
        raise RecordError(f"rec is {type(rec).__name__}: give a gaident.Record or a list of them, at least one")
    checked_controller(controller)
    if controller is not None and not controller.one_equation:
        return records
    for i, r in enumerate(records):
        where = f"record {i} ({r.name})" if r.name else f"record {i}"
        if controller is not None and r.command is None:
            raise RecordError(
                f"{where} has no command, which drives the loop with a controller: give {COMMAND}, or "
                f"{NO_CONTROLLER} to identify from torque to velocity"
            )
        if controller is None and r.torque is None:
            raise RecordError(
                f"{where} has no torque, which drives the model in open loop: give {TORQUE}, or "
                f"{A_CONTROLLER} to identify in closed loop"
            )
    return records


def check_numbers(trials: object, seed: object, workers: object, progress: object) -> None:
    """Raises SettingsError where one is no whole number in its range, workers may be None, or progress is no function."""
    if progress is not None and not callable(progress):
        raise SettingsError(f"progress is {progress!r:.80}: give a function of (fraction, message), or None")
    for name, value, low, high in (("trials", trials, 1, 10**6), ("seed", seed, 0, 2**63 - 1), ("workers", workers, 1, 1024)):
        if value is None and name == "workers":
            continue
        if not is_whole(value) or not low <= value <= high:
            raise SettingsError(f"{name} is {value!r}: it must be a whole number from {low} to {high}")


def check_arithmetic(settings: Settings, controller: Controller | None) -> None:
    """Raises SettingsError where a drive's arithmetic is asked for in a loop that it does not know."""
    if settings.in_drive and (
        controller is None or controller.loop != "continuous" or any(map(math.isfinite, controller.limits))
    ):
        raise SettingsError(
            f"settings.arithmetic is {settings.arithmetic!r}: a drive's search knows the paper's loop only, continuous and "
            'without limits; give such a controller, or arithmetic="double"'
        )


def distinct(records: Sequence[Record]) -> list[str]:
    """The records' digests; a RecordError where two are the same."""
    digests = [r.digest for r in records]
    for i, digest in enumerate(digests):
        first = digests.index(digest)
        if first < i:
            names = [f"record {k} ({records[k].name})" if records[k].name else f"record {k}" for k in (i, first)]
            raise RecordError(
                f"{names[0]} contains the same data as {names[1]}: counted twice it would halve every variance; leave one out"
            )
    return digests


def checked_space(space: SearchSpace, controller: Controller | None) -> SearchSpace:
    """The space, with p from 1 on where the torque is held. Raises SpaceError."""
    if not isinstance(space, SearchSpace):
        raise SpaceError(f"space is {space!r}: give a gaident.SearchSpace, or None to derive it from the data")
    if (controller is None or controller.loop == "sampled") and space.p[0] < 1:
        if space.p[1] < 1:
            raise SpaceError(
                f"p is {space.p!r}: with a held torque the plant needs at least one pole more than zeros; "
                f"use {arg('p', '(1, 3)')}, or {CONTINUOUS_LOOP}"
            )
        return replace(space, p=(1, space.p[1]))
    return space
