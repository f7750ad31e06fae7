"""The records as their controller read them: an outlier of the log alone is no part of what the controller answers.

A velocity that is a difference of the log's positions is the one that the controller formed of them, see `as_differenced`.

Where a torque is logged it tells which: an outlier that the controller read is answered by its torque.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.data.signals.lattice import digits_step, lattice_step
from gaident.diagnosis.controller.slow_forms import run_error
from gaident.diagnosis.records.hygiene import cleaned, outliers
from gaident.identification.logged_stretches import log_of, plateau_of
from gaident.identification.logged_torque import tells_of_controller
from gaident.models.drive_torque import as_differenced
from gaident.models.starts import noise_std
from gaident.policy.table import POLICY
from gaident.results.diagnosis import Diagnosis

__all__ = ["as_read", "in_terms_of_the_log", "outliers_of_the_log"]

Lines = NDArray[np.intp]
Vector = NDArray[np.float64]

MOST = 0.5  # no decision: a formula: the most of some lines
AROUND = np.arange(-1, 2)  # no decision: a formula: a line's velocity is in the torques from the line before to the one behind
TINY = 1e-300  # no decision: no division by 0
SPEED_STEP = 1e-6  # no decision: the step of a difference, of the highest speed


def as_read(recorded: Sequence[Record], cleaned: Sequence[Record], controller: Controller | None) -> tuple[Record, ...]:
    """The records as the controller read them: cleaned of outliers only where the logged torque follows better from that."""
    if controller is None or any(r.torque is None or not controller.replayable(r) for r in recorded):
        return tuple(cleaned)
    pairs = [
        (r, c) if r is c else min((r, c), (c, r), key=lambda pair: _replay_error(pair[0], controller))
        for r, c in zip(recorded, cleaned, strict=True)
    ]
    return tuple(best for best, _ in pairs)


def _replay_error(rec: Record, controller: Controller) -> float:
    """Variance of logged minus replayed torque [(N m)^2]: a load that was there before the record adds a constant."""
    assert rec.torque is not None
    return float(np.var(rec.torque - controller.torque_of(rec)))


def outliers_of_the_log(records: Sequence[Record], controller: Controller | None) -> tuple[tuple[Record, ...], tuple[Lines, ...]]:
    """(the records with what their controller read, also in the place of outliers, the lines of these).

    An outlier stands in the log alone where the velocity that the torque answers is nearer to its neighbours than to the outlier.
    With it the logged torque does not follow from the controller, and a form of controller would be looked for in vain.
    Where a log is slower than its controller, a velocity that is smooth between the lines spreads it over its neighbours, in the
    torque that drives a model, too.
    """
    found = [_of_the_log(as_differenced(r, controller), controller) for r in records]
    return tuple(r for r, _ in found), tuple(lines for _, lines in found)


def _of_the_log(rec: Record, controller: Controller | None) -> tuple[Record, Lines]:
    none = np.zeros(0, dtype=np.intp)
    if controller is None or controller.unknown or controller.loop != "sampled" or not tells_of_controller(rec, controller):
        return rec, none
    found, cascade = outliers(rec.velocity), cascade_of(controller)
    told = _told_lines(rec, found)
    lines = told
    while len(lines):
        interpolated = cleaned(rec, lines)
        without, spread = _answered(interpolated, lines, cascade)
        answered = without.velocity[lines]
        off = np.abs(answered - rec.velocity[lines])
        stays = (np.abs(answered - interpolated.velocity[lines]) < off) & (off > POLICY.check_deviations * spread)
        if stays.all():
            break
        lines = lines[stays]
    if not len(lines):
        return rec, none
    untold = np.setdiff1d(found, told)
    if len(untold) and len(lines) > MOST * len(told):
        without, lines = cleaned(without, untold), np.union1d(lines, untold)
    return (without, lines) if run_error([without], cascade) < run_error([rec], cascade) else (rec, none)


def _told_lines(rec: Record, lines: Lines) -> Lines:
    """Those of the lines around which the torque is not at its plateau: a torque at a limit answers no velocity.

    What they are, of the log alone or what the controller read, the others are taken to be, too.
    """
    assert rec.torque is not None
    size = np.abs(rec.torque)
    limited = np.flatnonzero(size >= POLICY.at_limit * plateau_of(size))
    return lines[~np.isin(lines[:, None] + AROUND, limited).any(axis=1)]


def _answered(rec: Record, lines: Lines, cascade: Cascade) -> tuple[Record, Vector]:
    """(the record with the velocities at these lines that the logged torque answers, their deviations) [rad/s], by least squares.

        torque - made(w) = sum over lines k of x_k d made/d w_k,   w_k + x_k

    Interpolated ones lack the noise that the controller read.
    Fitted is what changes from line to line: the velocity between the lines, which is lost, adds up in the integral.
    """

    def made(velocity: Vector) -> Vector:
        return log_of(rec.with_channels(velocity=velocity), len(rec), cascade, True).made(cascade)

    w = rec.velocity
    before, step = made(w), max(noise_std(w), SPEED_STEP * float(np.abs(w).max()))
    columns = np.array([made(w + step * (np.arange(len(w)) == k)) - before for k in lines]).T / step
    assert rec.torque is not None
    slopes, wanted = np.diff(columns, axis=0), np.diff(rec.torque - before)
    x, *_ = np.linalg.lstsq(slopes, wanted, rcond=None)
    spread = np.std(wanted - slopes @ x) / np.maximum(np.linalg.norm(slopes, axis=0), TINY)
    moved = w.copy()
    moved[lines] += x
    # The encoder, and the log, round these velocities as they round the others.
    others = np.delete(w, lines)
    for step, reach in ((lattice_step(others, rounded=True), POLICY.on_lattice), (digits_step(others), np.inf)):
        if not step > 0.0:
            continue
        rounded = step * np.round(moved[lines] / step)
        if np.all(np.abs(rounded - moved[lines]) < reach * step):
            moved[lines] = rounded
    return rec.with_channels(velocity=moved), spread


def in_terms_of_the_log(result: Diagnosis, logged: Mapping[str, Record]) -> Diagnosis:
    """The result with the records as they were logged; logged: digest of a record as its controller read it -> the logged one."""
    records, validation = ([logged.get(r.digest, r) for r in part] for part in (result.records, result.validation_records))
    return replace(
        result,
        records=tuple(records),
        validation_records=tuple(validation),
        digests=tuple(r.digest for r in records),
        validation_digests=tuple(r.digest for r in validation),
    )
