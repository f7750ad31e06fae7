"""Which data are held out: the records for validation, or the end of each record. Both parts hold motion.

With w the velocity of a record of N samples, the cut is

    at = fitted_share N                            where neither part's rms w is below held_out_motion of the other's,
    at : sum |w(n < at)| = fitted_share sum |w|    elsewhere.

The first is of the time, the second of the path.
Where that leaves less than `least_fitted` of the samples to fit, or fewer than `least_samples` to hold out, there is no cut.
On an axis at rest a friction holds what a linear model lets drift: the error would fall by any amount, and show nothing.

A record for validation counts where it moves,

    rms w > max(min(standing_noise s, held_out_motion W), standing_share W),

s the noise of its velocity, W the rms velocity of the records that are fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, joined, percent, say
from gaident.data.record import Record
from gaident.diagnosis.records.hygiene import quantisation
from gaident.models.starts import noise_std
from gaident.policy.table import POLICY
from gaident.results.fitness import IN_SAMPLE

__all__ = ["VALIDATION", "Held", "held_out_from", "held_parts"]

Vector = NDArray[np.float64]

VALIDATION = "validation records"


class Held(NamedTuple):
    """What is held out.

    scored: records, each with the first sample that is held out; words: which data these are; part: of each record that is fitted
    the samples that are, None where all are; notes: what is said of records that are left out.
    """

    scored: list[tuple[Record, int]]
    words: str
    part: tuple[int, ...] | None
    notes: tuple[Text, ...] = ()


def held_parts(records: Sequence[Record], validation: Sequence[Record], noise: float | None) -> Held:
    """What is held out of these records; noise: standard deviation of the velocity [rad/s], None: of each record its own."""
    moving = [r for r in validation if not _rests(r, records, noise)]
    notes = _left_out([r for r in validation if not any(r is m for m in moving)], bool(moving))
    if moving:
        return Held([(r, 0) for r in moving], VALIDATION, None, notes)
    cuts = [held_out_from(r) if len(r) >= POLICY.least_held_out else None for r in records]
    short = any(len(r) < POLICY.least_held_out for r in records)
    if short or all(at is None for at in cuts):
        return Held([(r, 0) for r in records], IN_SAMPLE, None, notes)
    scored = [(r, at) for r, at in zip(records, cuts, strict=True) if at is not None]
    by_time = all(at == int(POLICY.fitted_share * len(r)) for r, at in scored)
    of = "the record" if by_time else "its path"
    rest = percent(1.0 - POLICY.fitted_share)
    words = f"the last {rest} of {of}, parameters fitted to the first {percent(POLICY.fitted_share)}"
    return Held(scored, words, tuple(len(r) if at is None else at for r, at in zip(records, cuts, strict=True)), notes)


def held_out_from(rec: Record) -> int | None:
    """The first sample that is held out: of the last part of the time or, where one of the parts hardly moves, of the path.

    None where no cut leaves motion in both parts.
    """
    at = int(POLICY.fitted_share * len(rec))
    before, after = _rms(rec.velocity[:at]), _rms(rec.velocity[at:])
    if min(before, after) >= POLICY.held_out_motion * max(before, after):
        return at
    path = np.cumsum(np.abs(rec.velocity))
    at = int(np.searchsorted(path, POLICY.fitted_share * path[-1]))
    return at if POLICY.least_fitted * len(rec) <= at <= len(rec) - POLICY.least_samples else None


def _rests(rec: Record, fitted: Sequence[Record], noise: float | None) -> bool:
    own = noise_std(rec.velocity, quantisation((rec,))) if noise is None else noise
    motion = _rms(np.concatenate([r.velocity for r in fitted]))
    least = min(POLICY.standing_noise * own, POLICY.held_out_motion * motion)
    return _rms(rec.velocity) <= max(least, POLICY.standing_share * motion)


def _left_out(resting: Sequence[Record], others: bool) -> tuple[Text, ...]:
    """others: whether other records for validation move."""
    if not resting:
        return ()
    names = joined(", ", (Text(r.name) for r in resting if r.name))
    which = say(" ({})", names) if names else Text("")
    instead = "" if others else " What is held out is of the records that were given to fit."
    text = "{} of the records for validation{} hold{} no motion: no model is judged by {}.{}"
    one = len(resting) == 1
    return (say(text, len(resting), which, "s" if one else "", "it" if one else "them", instead),)


def _rms(w: Vector) -> float:
    return float(np.sqrt(np.mean(w**2))) if len(w) else 0.0
