"""Fewer samples without aliasing: a linear-phase low-pass whose delay is taken out, sample by sample as a log comes in."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gaident.checks import is_whole
from gaident.errors import RecordError

__all__ = ["Decimator", "decimated", "factor_of", "low_passed", "means_ahead", "reach"]

_HALF = 25  # no decision: a formula: a low-pass
"""Taps on each side, in samples of the decimated signal."""

_KAISER = 8.0  # no decision: a formula: a low-pass
"""beta: what leaks is 72 dB down."""

_CORNER = 0.9  # no decision: a formula: a low-pass
"""-6 dB, of the new Nyquist frequency; with these taps the band passes up to 0.8 and is stopped from 1.0 on."""


def factor_of(value: object, argument: str = "decimate", form: str = "={!r}") -> int:
    """`value` as a whole number from 1. Raises RecordError, which shows argument and value in this form."""
    # no decision: what an argument may be
    if not is_whole(value) or not 1 <= value <= 100_000:
        raise RecordError(f"{argument}{form.format(value)}: give a whole number from 1 to 100000, of samples that become one")
    return int(value)


class Decimator:
    """Every `factor`-th sample of the low-passed signal.

        y(k) = sum_j h(j) x(k M - j),   j = -L..L,   M = factor, L = 25 M
        h(j) = sinc(0.9 j / M) kaiser(j; beta = 8), normalised to a sum of 1

    held: x is the torque that each sample holds until the next one, half a sample later than the value at its line.
    Its taps are those of the spectrum

        H_held(W) = H(W) jW/(e^jW - 1),   W = 2 pi f dt

    so that of a rigid axis, J (v(n+1) - v(n)) = dt x(n), y is J dv/dt of what this low-pass makes of v.
    Above its resonances every axis is rigid.
    Linear phase, and as the sum runs from -L to L its delay of L samples is compensated: y(k) belongs to the time of x(k M), and
    all channels keep their phase against each other.
    Up to 80 % of the new Nyquist frequency 1/(2 M dt) a signal passes to within 0.03 %, from that frequency on it is damped by 72
    dB and more. At both ends the signal is continued by its reflection about its end point.
    What comes out does not depend on how the samples are divided between calls of `push`.
    The filter is symmetric: an edge shows up to 25 new samples before it comes.
    """

    def __init__(self, factor: int, held: bool = False) -> None:
        self.factor = factor_of(factor)
        self.half = reach(self.factor)
        self.taps = _taps(self.half, self.factor, held)
        # Samples not yet done with; the first stands `half` before the next y, once the start was continued.
        self.kept = np.zeros(0)
        self.begun = self.half == 0
        self.out: list[NDArray[np.float64]] = []

    def push(self, x: NDArray[np.float64]) -> None:
        """The next samples, any number of them."""
        if self.half == 0:
            self.out.append(x)
            return
        self.kept = np.concatenate([self.kept, x])
        if not self.begun and self.kept.size > self.half:
            self.kept = np.concatenate([_reflected(self.kept, self.half), self.kept])
            self.begun = True
        if self.begun:
            self._give(self.kept)

    def finish(self) -> NDArray[np.float64]:
        """All samples y, shape (ceil(n / factor),)."""
        if self.half and self.kept.size:
            if not self.begun:
                self.kept = np.pad(self.kept, (self.half, 0), "reflect", reflect_type="odd")
            self._give(np.pad(self.kept, (0, self.half), "reflect", reflect_type="odd"))
        return np.concatenate(self.out) if self.out else np.zeros(0)

    def _give(self, x: NDArray[np.float64]) -> None:
        count = (x.size - 2 * self.half - 1) // self.factor + 1
        if count < 1:
            return
        from scipy.signal import upfirdn

        # The first y stands at 2 L = 50 M of the whole convolution.
        y = upfirdn(self.taps, x[: (count - 1) * self.factor + 2 * self.half + 1], 1, self.factor)
        self.out.append(np.ascontiguousarray(y[2 * _HALF : 2 * _HALF + count]))
        self.kept = x[count * self.factor :]


@lru_cache(maxsize=16)
def _taps(half: int, ratio: float, held: bool = False) -> NDArray[np.float64]:
    """h(-half..half), normalised; not to be written to."""
    j = np.arange(-half, half + 1)
    taps = np.sinc(_CORNER * j / ratio) * np.kaiser(2 * half + 1, _KAISER)
    taps /= taps.sum()
    if held and half:
        W = 2.0 * np.pi * np.arange(1, half + 1) / len(taps)
        taps = np.fft.irfft(np.fft.rfft(taps) * np.append(1.0, 1j * W / np.expm1(1j * W)), len(taps))
    taps.flags.writeable = False
    return np.asarray(taps)


def reach(factor: int) -> int:
    """Samples on either side that a low-passed sample is made of; closer to an end it contains what was never logged."""
    return _HALF * factor if factor > 1 else 0


def low_passed(x: NDArray[np.float64], ratio: float, held: bool = False) -> NDArray[np.float64]:
    """x behind the same low-pass, not decimated, for a sample rate `ratio` times as slow; x itself up to 1.05."""
    if ratio <= 1.05:  # no decision: a low-pass with its corner at the Nyquist frequency does nothing
        return x
    from scipy.signal import oaconvolve

    half = int(np.ceil(_HALF * ratio))
    return np.asarray(oaconvolve(np.pad(x, half, "reflect", reflect_type="odd"), _taps(half, ratio, held), "valid"))


def decimated(x: NDArray[np.float64], factor: int, held: bool = False) -> NDArray[np.float64]:
    """All of x at once, see Decimator."""
    decimator = Decimator(factor, held)
    decimator.push(x)
    return decimator.finish()


def means_ahead(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of a low-passed signal at its lines (n,), the means over the lines that follow.

    y(k) = sum_j h(j) x(k - j),   h(j) = mean over 0 < s < 1 of sinc(j + s) kaiser(j + s; beta = 8)
    """
    return np.asarray(np.convolve(np.pad(x, (_HALF, _HALF), "reflect", reflect_type="odd"), _ahead(), "valid"))


@lru_cache(maxsize=1)
def _ahead() -> NDArray[np.float64]:
    """h(-half..half), normalised."""
    middles = (np.arange(64) + 0.5) / 64  # no decision: a grid: of an integral
    at = np.arange(-_HALF, _HALF + 1)[:, None] + middles
    taps = np.mean(np.sinc(at) * np.i0(_KAISER * np.sqrt(np.maximum(1.0 - (at / (_HALF + 1)) ** 2, 0.0))), axis=1)
    return np.asarray(taps / taps.sum())


def _reflected(x: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """`count` samples before x, reflected about its first."""
    y: NDArray[np.float64] = 2.0 * x[0] - x[count:0:-1]
    return y
