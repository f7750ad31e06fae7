"""frequency_response: what a record shows of the plant, as data for an identification.

Two ways, with U, W, R the spectra of torque, velocity and instrument r (the command of a loop; in open loop the torque itself).
Noise that the loop brings back is not in r, so that it biases neither.

Where r repeats itself, with P periods after the first:

    G(k) = sum_p W_p / sum_p U_p,   var G = sum_p |W_p - G U_p|^2 / ((P - 1) P |mean U|^2)

at the lines that r has.
Else, and of two periods, by local polynomials over the lines of the spectrum (`local.py`).

Where r excites nothing, or less than noise does, torque and velocity are what the loop makes of noise, G would be -1/C, and that
without any scatter: no value stands there, and the notes say so.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import TORQUE
from gaident.axis import say
from gaident.control.controller import Controller, checked_controller
from gaident.data.frequency.response import FrequencyResponse
from gaident.data.record import Record
from gaident.errors import RecordError
from gaident.identification.response.instrument import (
    EMPTY,
    WEAK,
    Lines,
    Unshown,
    band_notes,
    chosen_lines,
    near_mean,
    strong,
    too_few,
)
from gaident.identification.response.local import local_lines
from gaident.identification.response.repeated import period_of
from gaident.models.held_torque import held_mean
from gaident.policy.table import POLICY

__all__ = ["frequency_response"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]

PERIODS = 3  # no decision: of statistics: the first settles, two say what the noise is
SHORTEST = 220  # no decision: a formula: eight windows of 13 lines, of a spectrum that has half of a record's lines
USABLE = 0.8  # no decision: a formula: of half the log's sampling frequency, where the controller is faster than the log


def frequency_response(rec: Record, controller: Controller | None = None) -> FrequencyResponse:
    """Return the frequency response from torque to velocity that a record shows.

    With a command that changes it is the instrument, so that noise which the loop brings back does not bias the response.
    A periodic one (a multisine) of three periods or more is averaged over its periods; else local polynomials are fitted.
    There is a value at those frequencies only at which the instrument makes the torque move beyond noise, and is told from what
    the start and the end of the record make; the notes name the bands that are left out, and why.

    Parameters
    ----------
    rec : Record
        A record with torque and velocity; from 220 lines on, and the more the better it resolves.
    controller : PI or Cascade, optional
        Of its loop; None: open loop, the torque is independent of the velocity's noise.
        Without a logged torque it makes the torque.

    Returns
    -------
    FrequencyResponse
        With standard deviations and coherence.
        `dt` is the record's: the torque is held from line to line.
        In a log that is slower than its controller the torque is not; then it is the axis's own, `dt` None, up to 0.4/rec.dt.

    Raises
    ------
    RecordError
        Where there is no torque and none can be made, where what should excite the axis never changes, for a record that is too
        short, and where fewer than 8 frequencies are left: it says what the command lacks.

    References
    ----------
    R. Pintelon, J. Schoukens, "System Identification: A Frequency Domain Approach", 2nd ed., 2012, chapters 2 and 7.
    D. Staiger, J. H. Stock, "Instrumental variables regression with weak instruments", Econometrica 65, 1997.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> drive, loop = ga.OneMass(J=2e-3, D=0.01).model(), ga.PI(kp=0.2, ki=2.0)
    >>> command = 10.0 * np.repeat(np.random.default_rng(1).choice([-1.0, 1.0], 1000), 4)
    >>> done = ga.run(drive, ga.Record(1e-3, command=command, velocity=0.0 * command), loop)
    >>> fr = ga.frequency_response(ga.Record(1e-3, command=command, velocity=done.velocity, torque=done.torque), loop)
    >>> idn = ga.identify(fr)
    >>> idn.p, idn.q, round(idn.mechanics.J, 5)
    (1, 0, 0.002)
    """
    if not isinstance(rec, Record):
        raise RecordError(f"rec is {type(rec).__name__}: give a gaident.Record")
    checked_controller(controller)
    torque = held_mean(rec).torque
    if torque is None:
        if controller is None or not controller.replayable(rec):
            raise RecordError(f"the record has no torque, and no controller to make it from: give {TORQUE} or PI(...)")
        torque = controller.torque_of(rec)
    source = None if controller is None else controller.command_of(rec)
    if controller is not None and (source is None or _constant(source)):
        raise RecordError(
            say(
                "the command of this loop never changes: {torque} and velocity then show minus the inverse of the controller as "
                "much as the drive; use a record whose command changes after its start"
            )
        )
    drive = source if source is not None else rec.command if rec.command is not None and not _constant(rec.command) else torque
    every = 1 if controller is None else controller.log_every(rec.dt)
    if every > 1 and float(np.mean(np.diff(drive) == 0.0)) > 0.5:  # no decision: a formula: more lines than not
        raise RecordError(
            say(
                "the log is slower than its controller, and its command jumps: what the {torque} does between the lines is not "
                "what its spectrum shows; identify the record itself, or use a command that goes smoothly, as a multisine does"
            )
        )
    if _constant(rec.velocity):
        raise RecordError("the velocity never changes, so that it shows no response; use a record in which the axis moves")
    if _constant(torque):
        raise RecordError(say("the {torque} never changes, so that it excites no frequency; use a record whose {torque} changes"))
    name = "{torque}" if drive is torque else "command"
    lines = _lines(torque, rec.velocity, drive, rec.dt)
    highest = 0.5 / rec.dt  # no decision: a formula: half the sampling frequency
    value, std, keep = lines.value, lines.std, np.isfinite(lines.std) & (lines.std > 0.0) & (np.abs(lines.value) > 0.0)
    dt: float | None = rec.dt
    if every > 1:
        # Between the lines the torque is that of a faster hold, whose mean delay is half its sample.
        s = 2j * math.pi * lines.frequency * rec.dt / every
        hold = -np.expm1(-s) / s
        value, std, dt = value / hold, std / np.abs(hold), None
        highest *= USABLE
        keep &= lines.frequency < highest
    found = chosen_lines(np.flatnonzero(keep))
    if len(found) < 8:  # no decision: what an argument may be: a response has so many frequencies at least
        if len(rec) < SHORTEST:
            few = f"the record of {len(rec)} lines shows a response at {len(found)} frequencies only"
            raise RecordError(f"{few}: use a longer record, of {SHORTEST} lines or more")
        raise too_few(len(found), lines.left_out, name)
    notes = [lines.how, *band_notes(lines.frequency[found], lines.left_out, name, highest)]
    return FrequencyResponse(
        lines.frequency[found], value[found], std[found], lines.coherence[found], dt=dt, name=rec.name, notes=notes
    )


def _constant(x: Vector) -> bool:
    """But for the rounding of its numbers."""
    return float(np.ptp(x)) <= 1e-9 * float(np.abs(x).max())


def _lines(u: Vector, w: Vector, r: Vector, dt: float) -> Lines:
    """By the means of periods, or by local polynomials: where r repeats itself over its last whole periods."""
    period = period_of(r)
    count = len(r) // period if period else 0
    if count >= PERIODS:
        return _periodic(u, w, r, period, dt)
    first = len(r) - count * period if count else 0
    return local_lines(u[first:], w[first:], r[first:], count, dt)


def _periodic(u: Vector, w: Vector, r: Vector, period: int, dt: float) -> Lines:
    """Means over the periods but the first, and how they scatter."""
    count = len(r) // period
    first = len(r) - (count - 1) * period  # the last whole periods

    def spectra(x: Vector) -> Complex:
        found: Complex = np.fft.rfft(x[first:].reshape(count - 1, period), axis=1)
        return found

    U, W, R = spectra(u), spectra(w), spectra(r).mean(axis=0)
    line = np.arange(1, (period - 1) // 2 + 1)
    per = 1.0 / (period * dt)
    excited = np.abs(R[line]) > POLICY.instrument_line * np.abs(R[line]).max(initial=0.0)
    left_out = [Unshown((k - 0.5) * per, (k + 0.5) * per, EMPTY) for k in line[~excited]]
    line = line[excited]
    U, W, R = U[:, line], W[:, line], R[line]
    mean_u, mean_w = U.mean(axis=0), W.mean(axis=0)
    value = mean_w / mean_u
    even = np.ones(len(line))
    left = near_mean(np.sum(np.abs(W - value * U) ** 2, axis=0) / (count - 2), even)
    of_torque = near_mean(np.sum(np.abs(U - mean_u) ** 2, axis=0) / (count - 2), even)
    # Exact signals leave rounding, which still is an error.
    std = np.maximum(np.sqrt(left / (count - 1)) / np.abs(mean_u), 1e-12 * np.abs(value))
    coherence = 1.0 / (1.0 + left / (count - 1) / np.maximum(np.abs(mean_w) ** 2, 1e-300))
    keep = strong(mean_u / R, (count - 1) * np.abs(R) ** 2, of_torque, even)
    left_out += [Unshown((k - 0.5) * per, (k + 0.5) * per, WEAK) for k in line[~keep]]
    how = f"Mean of {count - 1} periods of {period} lines, the first left out."
    return Lines(line[keep] * per, value[keep], std[keep], coherence[keep], how, left_out)
