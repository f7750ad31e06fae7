"""Local polynomials over windows of a record's spectrum, where the instrument is strong enough for them.

Over the lines k + i of a window, by least squares, with R, U, W the spectra of instrument, torque and velocity (R. Pintelon,
J. Schoukens, "System Identification: A Frequency Domain Approach", 2nd ed., 2012, ch. 7):

    [U; W](k + i) = (A_0 + ... + A_d (i - i_0)^d) R(k + i) + B_0 + B_1 i + B_2 i^2 + noise,   G(k + i_0) = A_0w / A_0u

where B takes what the start and the end of the record make (leakage), and the noise's covariance is that of what is left.
d is 2 and i_0 the middle where the instrument fills the window.
Where it is a single line of a multisine, a slope of A is no other than B: then d is 0, and i_0 the place where a slope does not
change A_0; the other excited lines of the window are left out.

An estimate stands where three things hold, of which two are of the instrument alone:

    apart      of the power of R enough is left beside what B and the slopes of A take
    covered    a term that the polynomials do not have, R i^(d+1), R i^(d+2), i^3 or i^4, shows in what is left about as much
               as it changes A_0: then the stated deviation has it
    strong     the torque follows the instrument: |A_0u|^2 is above its variance by a factor, the F test of an instrument
               (D. Staiger, J. H. Stock, "Instrumental variables regression with weak instruments", Econometrica 65, 1997)

Without the last the loop shows U = -C W, what the controller makes of noise, and that without any scatter.

The variance of the noise W - G U is the mean of neighbouring windows, or a window's own where that is larger beyond chance: there
the polynomials miss something.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.identification.response.instrument import EMPTY, MIXED, WEAK, Lines, Unshown, chosen_lines, near_mean, strong
from gaident.policy.table import POLICY

__all__ = ["local_lines"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]
Places = NDArray[np.intp]

NARROW = 6  # no decision: a grid: lines to either side of a window, two for each coefficient
WIDE = 0.01  # no decision: a grid: the same as a share of the window's frequency, where that is more
BESIDE = 2  # no decision: a grid: lines to either side that the largest line of a peak is above
WIDEST = 4  # no decision: a grid: times NARROW, within which a single line finds enough empty ones
SLOPES = 2  # no decision: a formula: order of A, where the instrument fills the window


@dataclass(frozen=True)
class _Window:
    """A window. line: of its estimate; first, last: of its lines; power: of R beside the rest; torque, velocity: A_0."""

    line: float
    first: int
    last: int
    power: float
    freedom: int
    torque: complex
    velocity: complex
    noise: Complex  # covariance of torque and velocity (2, 2)


@dataclass(frozen=True)
class _Spectra:
    """Lines 1, 2, ... of instrument (n,), and torque and velocity (n, 2)."""

    instrument: Complex
    signals: Complex

    @property
    def size(self) -> Vector:
        made: Vector = np.abs(self.instrument)
        return made

    def fit(self, lines: Places, middle: int, d: int) -> _Window | None:
        """Of a window; None: its instrument is not apart, or what the polynomials miss is not covered."""
        half = max(middle - int(lines[0]), int(lines[-1]) - middle)
        i = (lines - middle) / half
        own = self.instrument[lines] / math.sqrt(float(np.mean(np.abs(self.instrument[lines]) ** 2)))
        leak = np.linalg.qr(np.stack([np.ones(len(i)), i, i**2], axis=1).astype(complex))[0]
        at = 0.0
        if d == 0:
            bare = _beside(own, leak)
            slope = complex(np.vdot(bare, own * i)) / float(np.vdot(bare, bare).real + 1e-300)  # no decision: by 0
            at = slope.real
            if not abs(at) * half < 1.0:  # no decision: a formula: between the lines next to the excited one
                return None
        j = i - at
        slopes = np.stack([*(own * j**power for power in range(1, d + 1)), *leak.T], axis=1)
        others = np.linalg.qr(slopes / np.linalg.norm(slopes, axis=0))[0]
        bare = _beside(own, others)
        power = float(np.vdot(bare, bare).real)
        share = power / len(lines)
        if not share > POLICY.instrument_apart:
            return None
        whole = np.concatenate([others, bare[:, None] / math.sqrt(power)], axis=1)
        freedom = len(lines) - whole.shape[1]
        missed = np.stack([own * j ** (d + 1), own * j ** (d + 2), i**3 + 0j, i**4 + 0j], axis=1)
        changes = np.abs(bare.conj() @ missed / power) ** 2 * share
        shows = np.sum(np.abs(_beside(missed, whole)) ** 2, axis=0) / freedom
        if np.any(changes > POLICY.instrument_covered * shows + 1e-12):  # no decision: rounding
            return None
        torque, velocity = bare.conj() @ self.signals[lines] / power
        left = _beside(self.signals[lines], whole)
        noise = (left.T @ left.conj()) / freedom
        scale = float(np.mean(np.abs(self.instrument[lines]) ** 2))
        size = math.sqrt(scale)
        return _Window(
            middle + 1.0 + at * half, int(lines[0]), int(lines[-1]), power * scale, freedom, torque / size, velocity / size, noise
        )


def local_lines(torque: Vector, velocity: Vector, instrument: Vector, periods: int, dt: float) -> Lines:
    """The response where an estimate stands; periods: that the instrument has, 0 where it does not repeat itself."""
    n = len(instrument)
    U, W, R = (np.fft.rfft(x - x.mean())[1 : (n - 1) // 2 + 1] for x in (torque, velocity, instrument))
    per = 1.0 / (n * dt)
    fits, failed = _windows(_Spectra(R, np.stack([U, W], axis=1)), periods)
    left_out = [Unshown(first * per, last * per, why) for first, last, why in failed]
    how = f"Local polynomials over {2 * NARROW + 1} lines of the spectrum and more, {per:.2g} Hz apart."
    if not fits:
        nothing = np.zeros(0)
        return Lines(nothing, np.zeros(0, complex), nothing, nothing, how, left_out)
    line, power, freedom = (np.array([getattr(f, key) for f in fits], float) for key in ("line", "power", "freedom"))
    of_torque, of_velocity = (np.array([getattr(f, key) for f in fits], complex) for key in ("torque", "velocity"))
    noise = np.array([f.noise for f in fits])
    with np.errstate(divide="ignore", invalid="ignore"):
        value = of_velocity / of_torque
    if np.array_equal(instrument, torque):
        keep, scatter = np.ones(len(fits), bool), noise[:, 1, 1].real
    else:
        keep = strong(of_torque, power, noise[:, 0, 0].real, freedom)
        weights = np.stack([-value, np.ones(len(fits))], axis=1)
        scatter = np.einsum("ka,kab,kb->k", weights, noise, weights.conj()).real
    scatter = np.where(keep, np.maximum(scatter, 0.0), 0.0)
    shared = near_mean(scatter, np.where(keep, freedom, 1e-12))  # no decision: by 0
    scatter = np.where(scatter > POLICY.noise_alone * shared, scatter, shared)
    left_out += [Unshown(f.first * per, f.last * per, WEAK) for f, k in zip(fits, keep, strict=True) if not k]
    line, value, power, scatter, of_torque = line[keep], value[keep], power[keep], scatter[keep], of_torque[keep]
    size = np.abs(value)
    # Exact signals leave rounding, which still is an error.
    variance = np.maximum(scatter / power / np.abs(of_torque) ** 2, (1e-12 * size) ** 2)
    return Lines(line * per, value, np.sqrt(variance), size**2 / (size**2 + variance), how, left_out)


def _beside(x: Complex, others: Complex) -> Complex:
    """What orthonormal columns leave of x."""
    made: Complex = x - others @ (others.conj().T @ x)
    return made


def _windows(spectra: _Spectra, periods: int) -> tuple[list[_Window], list[tuple[int, int, str]]]:
    """Windows that share no line of the instrument, and (first line, last line, why) of those without an estimate."""
    size = spectra.size
    if not len(size):
        return [], []
    quiet = size < POLICY.instrument_empty * size.max()
    if periods > 1:
        quiet |= np.arange(1, len(size) + 1) % periods != 0
    lines = np.flatnonzero(~quiet & (size > POLICY.instrument_line * size.max()))
    if not len(lines):
        return [], [(1, len(size), EMPTY)]
    # Whole periods have empty lines between those of the command: of two periods every other one.
    alone = bool(np.mean(quiet[: int(lines[-1]) + 1]) >= 0.5)  # no decision: a formula: the same in numbers
    excited = np.zeros(len(size), bool)
    excited[chosen_lines(lines) if alone else lines] = True
    fits: list[_Window] = []
    failed: list[tuple[int, int, str]] = []
    start = 0
    while True:
        half = NARROW if WIDE * start < NARROW else int(WIDE * start)
        if start + 2 * half + 1 > len(size):
            return fits, failed
        part = np.arange(start, start + 2 * half + 1)
        before, start = start, start + len(part)
        filled = None if alone or quiet[part].all() else spectra.fit(part, before + half, SLOPES)
        if filled is not None:
            fits.append(filled)
            continue
        count = len(fits)
        for k in part[excited[part]].tolist():
            if alone:
                about = _quiet_about(k, quiet)
            else:
                begin = fits[-1].last if fits else -1
                top = size[k] == size[max(0, k - BESIDE) : k + BESIDE + 1].max()
                about = np.arange(k - NARROW, k + NARROW + 1) if top and begin < k - NARROW and k + NARROW < len(size) else None
            one = None if about is None else spectra.fit(about, k, 0)
            if one is not None:
                fits.append(one)
                start = start if alone else max(start, one.last + 1)
        if len(fits) == count:
            failed.append((before + 1, before + len(part), MIXED if excited[part].any() else EMPTY))


def _quiet_about(k: int, quiet: NDArray[np.bool_]) -> Places | None:
    """A line of whole periods with empty ones about it, as many as a window has; None: there are not so many near it."""
    for half in range(NARROW, WIDEST * NARROW):
        lines = np.arange(max(0, k - half), min(len(quiet), k + half + 1))
        chosen: Places = lines[quiet[lines] | (lines == k)]
        if len(chosen) > 2 * NARROW:
            return chosen
    return None
