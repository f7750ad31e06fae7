"""frequency_response: what a record shows of the plant, as data for an identification.

Two ways, with U, W, R the spectra of torque, velocity and instrument r (the command of a loop; in open loop the torque itself).
Noise that the loop brings back is not in r, so that it biases neither.

Where r is periodic, with P periods after the first, and R the same in each:

    G(k) = sum_p W_p conj(R) / sum_p U_p conj(R),   var G = sum_p |W_p - G U_p|^2 / ((P - 1) P |mean U|^2)

Else by local polynomials (R. Pintelon, J. Schoukens, "System Identification: A Frequency Domain Approach", 2nd ed., 2012, ch. 7):
over the 2 m + 1 lines around line k, by least squares,

    [U; W](k + i) = (A_0 + A_1 i + A_2 i^2) R(k + i) + B_0 + B_1 i + B_2 i^2 + noise,   G(k) = A_0w / A_0u

where B takes what the start and the end of the record make (leakage), and the noise's covariance is that of what is left.
The windows do not overlap: values at different frequencies have independent errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import TORQUE
from gaident.axis import say
from gaident.control.controller import Controller, checked_controller
from gaident.data.frequency.response import FrequencyResponse
from gaident.data.record import Record
from gaident.errors import RecordError
from gaident.models.held_torque import held_mean

__all__ = ["frequency_response"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]

PERIODS = 3  # no decision: of statistics: the first settles, two say what the noise is
EXCITED = 1e-3  # no decision: a grid: of the largest line of a period; smaller ones excite nothing
NARROW = 6  # no decision: a grid: lines to either side of a window, two for each coefficient
WIDE = 0.01  # no decision: a grid: the same as a share of the window's frequency, where that is more
UNKNOWN = 6  # no decision: a formula: coefficients of a window
NEAR = 4  # no decision: a grid: lines to either side that share a deviation, where each has a few periods only
MOST_LINES = 600  # no decision: memory and time: frequencies of a response
USABLE = 0.8  # no decision: a formula: of half the log's sampling frequency, where the controller is faster than the log


@dataclass(frozen=True)
class _Lines:
    """Values at lines of a spectrum [Hz]; std: of the complex value."""

    frequency: Vector
    value: Complex
    std: Vector
    coherence: Vector
    how: str


def frequency_response(rec: Record, controller: Controller | None = None) -> FrequencyResponse:
    """Return the frequency response from torque to velocity that a record shows.

    With a command that changes it is the instrument, so that noise which the loop brings back does not bias the response.
    A periodic one (a multisine) of three periods or more is averaged over its periods; else local polynomials are fitted.

    Parameters
    ----------
    rec : Record
        A record with torque and velocity; from 200 lines on, and the more the better it resolves.
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
        Where there is no torque and none can be made, where what should excite the axis never changes, and for a record that is
        too short.

    References
    ----------
    R. Pintelon, J. Schoukens, "System Identification: A Frequency Domain Approach", 2nd ed., 2012, chapters 2 and 7.

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
    period = _period(drive)
    lines = _periodic(torque, rec.velocity, drive, period, rec.dt) if period else _local(torque, rec.velocity, drive, rec.dt)
    notes = [lines.how]
    value, std, keep = lines.value, lines.std, np.isfinite(lines.std) & (lines.std > 0.0) & (np.abs(lines.value) > 0.0)
    dt: float | None = rec.dt
    if every > 1:
        # Between the lines the torque is that of a faster hold, whose mean delay is half its sample.
        s = 2j * math.pi * lines.frequency * rec.dt / every
        hold = -np.expm1(-s) / s
        value, std, dt = value / hold, std / np.abs(hold), None
        keep &= lines.frequency < USABLE * 0.5 / rec.dt  # no decision: a formula: half the sampling frequency
    found = np.flatnonzero(keep)
    if len(found) > MOST_LINES:
        # Evenly spaced in the logarithm of the frequency.
        places = np.geomspace(1.0, float(len(found)), MOST_LINES) - 1.0
        found = found[np.unique(np.rint(places).astype(int))]
    if len(found) < 8:  # no decision: what an argument may be: a response has so many frequencies at least
        raise RecordError(
            f"the record of {len(rec)} lines shows a response at {len(found)} frequencies only: use a longer record"
        )
    return FrequencyResponse(
        lines.frequency[found], value[found], std[found], lines.coherence[found], dt=dt, name=rec.name, notes=notes
    )


def _constant(x: Vector) -> bool:
    """But for the rounding of its numbers."""
    return float(np.ptp(x)) <= 1e-9 * float(np.abs(x).max())


def _period(x: Vector) -> int:
    """Lines of the shortest period that x repeats exactly at least three times; 0: none."""
    n = len(x)
    first = x[: max(1, n // PERIODS // 4)]  # no decision: a grid: what a candidate has to repeat at once
    # A period begins where the value of the first line comes back.
    for period in np.flatnonzero(x[1 : n // PERIODS + 1] == x[0]) + 1:
        p = int(period)
        size = min(len(first), n - p)
        if np.array_equal(x[p : p + size], first[:size]) and np.array_equal(x[p:], x[:-p]) and np.ptp(x[:p]) > 0.0:
            return p
    return 0


def _periodic(u: Vector, w: Vector, r: Vector, period: int, dt: float) -> _Lines:
    """Means over the periods but the first, and how they scatter."""
    count = len(r) // period
    first = len(r) - (count - 1) * period  # the last whole periods

    def spectra(x: Vector) -> Complex:
        found: Complex = np.fft.rfft(x[first:].reshape(count - 1, period), axis=1)
        return found

    U, W, R = spectra(u), spectra(w), np.fft.rfft(r[first : first + period])
    line = np.arange(1, (period - 1) // 2 + 1)
    line = line[np.abs(R[line]) > EXCITED * np.abs(R[line]).max()]
    U, W = U[:, line], W[:, line]
    mean_u, mean_w = U.mean(axis=0), W.mean(axis=0)
    value = mean_w / mean_u
    left = np.sum(np.abs(W - value * U) ** 2, axis=0) / (count - 2)
    near = (len(line) - 1) // 2
    window = np.ones(2 * (NEAR if near > NEAR else near) + 1)
    shared = np.convolve(left, window, "same") / np.convolve(np.ones(len(line)), window, "same")
    std = np.sqrt(shared / (count - 1)) / np.abs(mean_u)
    coherence = 1.0 / (1.0 + shared / (count - 1) / np.maximum(np.abs(mean_w) ** 2, 1e-300))
    how = f"Mean of {count - 1} periods of {period} lines, the first left out."
    return _Lines(line / (period * dt), value, std, coherence, how)


def _local(u: Vector, w: Vector, r: Vector, dt: float) -> _Lines:
    """Local polynomials over windows of the spectrum."""
    n = len(r)
    U, W, R = (np.fft.rfft(x - x.mean())[1 : (n - 1) // 2 + 1] for x in (u, w, r))  # lines 1, 2, ...
    rows: list[tuple[float, complex, float, float]] = []
    start = 0
    while True:
        half = _half(start)
        size = 2 * half + 1
        if start + size > len(R):
            break
        part = slice(start, start + size)
        i = np.arange(-half, half + 1) / half
        own = R[part] / np.sqrt(np.mean(np.abs(R[part]) ** 2) + 1e-300)
        basis = np.stack([own, own * i, own * i**2, np.ones(size), i, i**2], axis=1)
        rows.append((start + half + 1.0, *_window(basis, np.stack([U[part], W[part]], axis=1), r is u)))
        start += size
    line, value, std, coherence = np.array(rows, complex).reshape(-1, 4).T
    how = f"Local polynomials over {2 * NARROW + 1} lines of the spectrum and more, {1.0 / (n * dt):.2g} Hz apart."
    return _Lines(line.real / (n * dt), value, std.real, coherence.real, how)


def _half(line: int) -> int:
    """Lines to either side of a window that begins at a line."""
    return NARROW if WIDE * line < NARROW else int(WIDE * line)


def _window(basis: Complex, signals: Complex, open_loop: bool) -> tuple[complex, float, float]:
    """(G, its standard deviation, coherence) at the middle of a window; signals: torque and velocity (lines, 2)."""
    q, triangle = np.linalg.qr(basis)
    size = np.abs(np.diag(triangle))
    # no decision: rounding: instrument and start are one there
    if not float(size.min()) > 1e-6 * float(size.max()):
        return 1.0 + 0.0j, math.inf, 0.0
    found = np.linalg.solve(triangle, q.conj().T @ signals)
    left = signals - basis @ found
    noise = (left.conj().T @ left) / (len(basis) - UNKNOWN)  # covariance of torque and velocity
    of_torque, of_velocity = found[0]
    if not abs(of_torque) > 0.0:
        return 1.0 + 0.0j, math.inf, 0.0
    value = complex(of_velocity / of_torque)
    weights = np.array([-value, 1.0])
    scatter = float((weights @ noise.T @ weights.conj()).real) if not open_loop else float(noise[1, 1].real)
    inverse = np.linalg.solve(triangle, np.eye(len(triangle)))
    variance = max(scatter, 0.0) * float(np.sum(np.abs(inverse[0]) ** 2)) / abs(of_torque) ** 2
    power = abs(value) ** 2
    # Exact signals leave rounding, which still is an error.
    variance = max(variance, (1e-12 * abs(value)) ** 2)
    return value, math.sqrt(variance), power / (power + variance)
