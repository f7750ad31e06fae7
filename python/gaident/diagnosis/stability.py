"""Whether what a diagnosis named is named again, when its records are varied a little.

Each variation is diagnosed like the records themselves, under the controller that was given:

    a part of them            the first half, the middle half, the second half of each
    half as many lines        every second line where a digital controller's torque is logged; else behind a low-pass
    more noise                one per cent of the velocity's rms, where no logged torque would have to follow from it
    another seed              of the search

A variation that cannot show a cause (`Diagnosis.not_testable`) does not count for it.
A cause that is beyond doubt is named in nearly all of them; one that is not may be what one stretch of the record looks like.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from gaident.control.cascade import Cascade
from gaident.control.controller import Controller
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.data.signals.difference import is_difference_of_lines
from gaident.data.torque_kind import MEAN
from gaident.diagnosis.diagnose import diagnose
from gaident.diagnosis.records.arguments import ProgressCallback
from gaident.errors import GaidentError, SettingsError
from gaident.results.diagnosis import Diagnosis
from gaident.results.what_if import Stability, Variation

__all__ = ["causes_of", "stability"]

Make = Callable[[Record], Record]

PARTS = (("first half", 0.0, 0.5), ("middle half", 0.25, 0.75), ("second half", 0.5, 1.0))  # no decision: which variations
NOISE = 0.01  # no decision: of the velocity's rms, which the result names so that a reader can weigh it
REPEATS = 2  # no decision: each of these variations stands in the result, and no threshold counts them
EVERY = 2  # no decision: a formula: half as many lines


def stability(
    dia: Diagnosis, records: Sequence[Record], pitch: float | None = None, progress: ProgressCallback | None = None
) -> Stability:
    """See `Diagnosis.stability`."""
    if progress is not None and not callable(progress):
        raise SettingsError(f"progress is {progress!r}: give a function of (fraction, message), or None")
    varied = list(_varied(records, dia.given_controller, dia.seed))
    found = []
    for i, (what, make, controller, seed) in enumerate(varied):

        def note(part: float, message: str, i: int = i, what: str = what) -> None:
            if progress is not None:
                progress((i + part) / len(varied), f"{what}: {message}")

        try:
            one = diagnose(
                [make(rec) for rec in records], controller, noise=dia.noise, seed=seed, progress=note, axis=dia.axis, pitch=pitch
            )
        except SettingsError:
            raise  # of an argument
        except GaidentError as error:
            found.append(Variation(what, "", refused=str(error)))
        else:
            sizes = {f.effect: next(iter(f.parameters.values())) for f in one.causes if f.parameters}
            found.append(Variation(what, one.verdict, causes_of(one), tuple(sorted(one.not_testable)), sizes=sizes))
    return Stability(dia.verdict, causes_of(dia), tuple(found), dia.axis)


def causes_of(dia: Diagnosis) -> tuple[tuple[str, ...], ...]:
    """Of each cause its name, then those from which it is not told apart."""
    return tuple((f.effect, *f.alternatives) for f in dia.causes)


def _varied(
    records: Sequence[Record], controller: Controller | None, seed: int
) -> Iterator[tuple[str, Make, Controller | None, int]]:
    """(what is varied, what makes it of a record, the controller, the seed)."""
    for name, low, high in PARTS:
        yield name, partial(_part, low, high), controller, seed
    sampled = controller is not None and controller.loop == "sampled"
    if not sampled:
        yield "every second sample", partial(Record.decimate, factor=EVERY), controller, seed
    elif all(rec.torque is not None and rec.torque_log != MEAN for rec in records) and len({rec.dt for rec in records}) == 1:
        slow = Cascade(controller, period=records[0].dt) if isinstance(controller, PI) else controller
        yield "every second line", _every_second, slow, seed
    if not any(_follows(rec, controller) for rec in records):
        for i in range(1, REPEATS + 1):
            yield f"1 % of noise, {i}", partial(_noisy, seed, i), controller, seed
    for i in range(1, REPEATS + 1):
        yield f"seed {seed + i}", _as_it_is, controller, seed + i


def _as_it_is(rec: Record) -> Record:
    return rec


def _part(low: float, high: float, rec: Record) -> Record:
    return rec[int(low * len(rec)) : int(high * len(rec))]


def _every_second(rec: Record) -> Record:
    channels: Mapping[str, Any] = {name: values[::EVERY] for name, values in rec.channels()}
    return rec.with_channels(dt=EVERY * rec.dt, **channels)


def _follows(rec: Record, controller: Controller | None) -> bool:
    """Whether a logged channel would have to follow from noise on the velocity."""
    torque = controller is not None and rec.torque is not None
    return torque or (rec.position is not None and is_difference_of_lines(rec.velocity, rec.position, rec.dt))


def _noisy(seed: int, repeat: int, rec: Record) -> Record:
    of_record = int(rec.digest[:8], 16)  # no decision: a formula: of the record, not of its place among others
    rng = np.random.default_rng([seed, repeat, of_record])
    size = NOISE * float(np.sqrt(np.mean(rec.velocity**2)))
    return rec.with_channels(velocity=rec.velocity + size * rng.standard_normal(len(rec)))
