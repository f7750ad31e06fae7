"""Single frequencies in time: what stands out of the spectrum of an error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.policy.table import POLICY

__all__ = ["lines"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def lines(error: Vector, lengths: tuple[int, ...]) -> list[tuple[float, Matrix]]:
    """The frequencies [rad per sample] that stand highest above the error's spectrum, with rows cos, sin of every record.

    The frequency is that of all records, phase and size are each record's own: a hum knows nothing of when a log begins.
    """
    longest = max(lengths)
    width, half = POLICY.spectrum_mean, POLICY.peak_half_width
    if longest < POLICY.spectrum_samples:
        return []
    parts = np.split(error, np.cumsum(lengths)[:-1])
    windowed = np.array([np.fft.rfft((e - e.mean()) * np.hanning(len(e)), longest) for e in parts])
    spectrum: Vector = np.sum(np.abs(windowed) ** 2, axis=0)
    kernel = np.ones(width) / width
    level = np.convolve(np.pad(spectrum, width // 2, mode="reflect"), kernel, mode="valid")
    height = spectrum / np.maximum(level, 1e-300)
    height[:half] = 0.0
    found = []
    for _ in range(POLICY.starts):
        k = int(np.argmax(height))
        f = 2.0 * np.pi * _peak(spectrum, k) / longest
        rows = np.zeros((2 * len(lengths), len(error)))
        at = 0
        for i, n in enumerate(lengths):
            rows[2 * i : 2 * i + 2, at : at + n] = np.cos(f * np.arange(n)), np.sin(f * np.arange(n))
            at += n
        found.append((f, rows))
        height[max(k - half, 0) : k + half + 1] = 0.0
    return found


def _peak(spectrum: Vector, k: int) -> float:
    """Frequency of a peak between the lines of a Hann-windowed spectrum."""
    if not 0 < k < len(spectrum) - 1:
        return float(k)
    a, b, c = np.log(spectrum[k - 1 : k + 2] + 1e-300)
    curve = a - 2.0 * b + c
    return float(k + (0.5 * (a - c) / curve if curve < 0.0 else 0.0))
