"""The frequency response from torque to velocity that a record shows by itself, without a model's structure.

    S_ab(f) = mean over half-overlapping Hann windows of A conj(B), summed over a twelfth of an octave

    G(f)   = S_wr / S_ur                                       r: the command; without one the torque itself, which is H1
    S_vv   = S_ww - 2 Re(conj(G) S_wu) + |G|^2 S_uu            what G does not explain
    var G  = S_vv S_rr / ((K - 1) |S_ur|^2)                    K: independent averages, of which G takes one
    1/K    = sum over pairs of the m windows and c frequencies of |rho|^2 / (m c)^2
    coherence = min(|S_wr|^2 / (S_ww S_rr), |S_ur|^2 / (S_uu S_rr))

Inside a loop, noise on the velocity comes back in the torque, and H1 then tends to -1/C where the noise is large.
The command does not know the noise: with it as the instrument (joint input-output) that bias is gone.
A record has finite windows, and a drive is not linear; a model simulated on the same record and put through the same estimate
suffers both alike, so that these two may be compared where the bare curve of the model may not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import TORQUE
from gaident.axis import say
from gaident.control.pi import PI
from gaident.control.pi_torque import pi_torque
from gaident.data.frequency.response import FrequencyResponse
from gaident.data.record import Record
from gaident.data.torque_kind import MEASURED
from gaident.errors import RecordError
from gaident.identification.response.held import held_response
from gaident.models.held_torque import held_mean
from gaident.models.model import Model
from gaident.models.simulate import Run, run
from gaident.policy.table import POLICY
from gaident.results.frequency import AveragedResponse, Responses

__all__ = ["measured_response", "response_of", "responses_of", "sampled_response", "simulated_response"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]

WINDOWS = 8  # no decision: at least, half-overlapping: the resolution of a spectrum, and its deviations are reckoned with it
LONGEST = 4096  # no decision: samples of a window: the resolution of a spectrum, and its deviations are reckoned with it
PER_OCTAVE = 12  # no decision: a grid: frequencies of a curve

SAME = np.array([1.0, 4.0 / 9.0, 1.0 / 36.0])  # no decision: a formula: a Hann window
NEXT = np.array([1.0 / 36.0, (4.0 / (9.0 * np.pi)) ** 2, 1.0 / 144.0, (4.0 / (45.0 * np.pi)) ** 2])  # no decision: a formula
"""|rho|^2 of white noise behind Hann windows, 0, 1, 2, ... frequencies apart: in one window, and in the next one."""


def response_of(rec: Record, model: Model, controller: PI | None = None) -> Responses:
    """Everything that a Bode diagram of a model against its record shows.

    Raises RecordError as `measured_response`, ModelError for p = 0 outside the continuous loop.
    """
    measured = measured_response(rec, controller)
    with np.errstate(over="ignore", invalid="ignore"):
        done = run(model, rec, controller)
    # no decision: drawn: beyond, a curve runs away
    sound = bool(np.all(np.isfinite(done.velocity)) and np.abs(done.velocity).max() < 1e3 * np.abs(rec.velocity).max())
    low, high = float(measured.frequency[0]), float(measured.frequency[-1])
    fine = _fine(model, low, high)
    alike = sound and rec.torque_is != MEASURED  # a model answers the noise of a measured torque, which the drive did not
    own = sampled_response(model, fine, rec.dt, controller)
    return Responses(measured, simulated_response(done, rec) if alike else None, fine, own)


def responses_of(given: Sequence[FrequencyResponse], model: Model | None) -> Responses:
    """The same of responses that were given, all in one, and of a model; None: without one."""
    frequency = np.concatenate([r.frequency_hz for r in given])
    order = np.argsort(frequency, kind="stable")
    value = np.concatenate([r.velocity_response for r in given])
    nothing = [np.zeros(len(r)) for r in given]
    std = [n if r.std is None else r.relative_std * np.abs(r.velocity_response) for r, n in zip(given, nothing, strict=True)]
    coherence = [n + 1.0 if r.coherence is None else r.coherence for r, n in zip(given, nothing, strict=True)]
    measured = AveragedResponse(
        frequency[order], value[order], np.concatenate(std)[order], np.concatenate(coherence)[order],
        np.concatenate(nothing), instrument=False, windows=0, resolution=0.0, given=True,
    )  # fmt: skip
    if model is None:
        return Responses(measured, None, np.zeros(0), np.zeros(0, complex))
    fine = _fine(model, float(frequency.min()), float(frequency.max()))
    dt = next((r.dt for r in given if r.dt is not None), None)
    if dt is not None:
        fine = fine[fine < 0.5 / dt]  # no decision: a formula: half the sampling frequency
    own = model.linear.frequency_response(2.0 * np.pi * fine) if dt is None else sampled_response(model, fine, dt)
    return Responses(measured, None, fine, own)


def _fine(model: Model, low: float, high: float) -> Vector:
    """Frequencies [Hz] at which a curve is drawn, more of them where it has its peaks."""
    fine = np.geomspace(low, high, 600)  # no decision: drawn: points of a curve
    roots = [r for r in (*model.poles, *model.zeros) if r.imag > 0.0]
    # no decision: drawn: points of a curve
    near = [(r.imag + max(abs(r.real), 1e-6 * r.imag) * np.linspace(-5.0, 5.0, 61)) / (2.0 * np.pi) for r in roots]
    return np.unique(np.concatenate([fine, *(f[(f > low) & (f < high)] for f in near)]))


def measured_response(rec: Record, controller: PI | None = None) -> AveragedResponse:
    """The response that a record shows. controller: of its loop, makes the torque where none is logged; None: open loop.

    Raises RecordError where there is neither a torque nor command and controller, for a torque that never changes, and for a loop
    whose command never does: torque and velocity then show the controller, not the drive.
    """
    if controller is not None and (rec.command is None or _constant(rec.command)):
        raise RecordError(
            say(
                "the command of this loop never changes: {torque} and velocity then show minus the inverse of the controller as "
                "much as the drive; use a record whose command changes after its start"
            )
        )
    torque = held_mean(rec).torque
    if torque is None:
        if controller is None or rec.command is None:
            raise RecordError(f"the record has no torque, and no controller to make it from: give {TORQUE} or PI(...)")
        torque = pi_torque(rec.command, rec.velocity, rec.dt, controller)
    if _constant(torque):
        text = "the {torque} never changes, so that it excites no frequency; use a record whose {torque} changes"
        raise RecordError(say(text))
    found = _estimate(torque, rec.velocity, rec.command, rec.dt)
    return replace(found, torque_measured=rec.torque is not None and rec.torque_is == MEASURED)


def simulated_response(run: Run, rec: Record) -> AveragedResponse:
    """The same estimate of a simulated run of that record: what the model would have shown."""
    return _estimate(run.torque, run.velocity, rec.command, rec.dt)


def sampled_response(model: Model, frequency: Vector, dt: float, controller: PI | None = None) -> Complex:
    """The linear part of a model as the loop samples it: zero-order hold, or bilinear; frequency [Hz] (n,), below 1/(2 dt)."""
    omega = 2.0 * np.pi * frequency
    if controller is not None and controller.loop == "continuous":
        return model.mechanism.frequency_response(2.0 / dt * np.tan(0.5 * omega * dt))
    return held_response(model, omega, dt)


def _constant(x: Vector) -> bool:
    """But for the rounding of its numbers."""
    return float(np.ptp(x)) <= 1e-9 * float(np.abs(x).max())


def _averages(windows: int, count: NDArray[np.intp]) -> Vector:
    """K for `count` (n,) neighbouring frequencies: the number of independent ones that would scatter as much."""

    def pairs(rho: Vector) -> Vector:
        apart = np.arange(len(rho))
        times = np.where(apart == 0, 1.0, 2.0) * np.maximum(1.0 - apart / count[:, None], 0.0)
        return np.asarray(times @ rho)

    return np.asarray(windows * count / (pairs(SAME) + 2.0 * (1.0 - 1.0 / windows) * pairs(NEXT)))


def _estimate(u: Vector, w: Vector, command: Vector | None, dt: float) -> AveragedResponse:
    """From torque u to velocity w; a command that never changes is no instrument."""
    n = len(w)
    size = max(16, min(2 * n // (WINDOWS + 1), LONGEST))  # no decision: a grid: the lines of a spectrum
    starts = range(0, n - size + 1, max(1, size // 2))
    instrument = command is not None and not _constant(command)
    window = np.hanning(size + 2)[1:-1]

    def spectra(x: Vector) -> Complex:
        parts = np.stack([x[a : a + size] for a in starts])
        found: Complex = np.fft.rfft((parts - parts.mean(axis=1, keepdims=True)) * window)[:, 1:-1]
        return found

    W, U = spectra(w), spectra(u)
    R = spectra(command) if command is not None and instrument else U
    f = np.arange(1, W.shape[1] + 1) / (size * dt)
    first = np.flatnonzero(np.diff(np.floor(PER_OCTAVE * np.log2(f)), prepend=-np.inf))
    count = np.diff(np.append(first, len(f)))

    def cross(a: Complex, b: Complex) -> Complex:
        summed: Complex = np.add.reduceat(np.mean(a * b.conj(), axis=0), first)
        return summed

    ww, uu, rr = (cross(x, x).real for x in (W, U, R))
    wr, ur, wu = cross(W, R), cross(U, R), cross(W, U)
    averages = _averages(len(starts), count)
    with np.errstate(divide="ignore", invalid="ignore"):
        value = wr / ur
        # no decision: a formula: a square that is written out
        unexplained = np.maximum(ww - 2.0 * (value.conj() * wu).real + np.abs(value) ** 2 * uu, 0.0)
        std = np.sqrt(unexplained * rr / np.maximum(averages - 1.0, 0.0)) / np.abs(ur)
        coherence = np.minimum(np.abs(wr) ** 2 / (ww * rr), np.abs(ur) ** 2 / (uu * rr))
    known = np.isfinite(value) & np.isfinite(coherence)
    frequency = np.add.reduceat(f, first) / count
    with np.errstate(divide="ignore"):
        threshold = 1.0 - POLICY.coherence_level ** (1.0 / np.maximum(averages - 1.0, 0.0))
    return AveragedResponse(
        frequency=frequency[known],
        value=value[known],
        std=np.nan_to_num(std)[known],
        coherence=np.minimum(coherence, 1.0)[known],
        threshold=threshold[known],
        instrument=instrument,
        windows=len(starts),
        resolution=1.0 / (size * dt),
    )
