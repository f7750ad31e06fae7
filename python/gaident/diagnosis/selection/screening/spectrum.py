"""Single frequencies in time: what stands out of the spectrum of an error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.policy.table import POLICY

__all__ = ["in_phase", "lines"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

BLOCKS = 20  # no decision: a grid: of a window, whose sums are taken
FINER = 4  # no decision: a grid: points for each half turn between the first window and the last
GRID = 1024  # no decision: a block in memory


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


def in_phase(error: Vector, lengths: tuple[int, ...], at: Vector, radians: float) -> float:
    """The frequency near this one [rad per sample] whose sine has one phase in windows of records; at (n,): line in the record.

        the highest |sum over lines of error hanning(window) exp(-i radians at)|

    A window of n lines tells a frequency by 2 pi/n; windows that lie N lines apart tell those in it that are 2 pi/N apart.
    """
    parts = [(e - e.mean()) * np.hanning(len(e)) for e in np.split(error, np.cumsum(lengths)[:-1])]
    turning = np.concatenate(parts) * np.exp(-1j * radians * at)
    width, span = 2.0 * np.pi / min(lengths), float(np.ptp(at)) + 1.0
    # Within a block the phase turns by a twentieth of a turn at most.
    block = max(min(lengths) // BLOCKS, 1)
    first = np.concatenate([start + np.arange(0, n, block) for start, n in zip(np.cumsum((0, *lengths)), lengths, strict=False)])
    sums, middle = np.add.reduceat(turning, first), at[first] + 0.5 * (block - 1)
    count = int(np.ceil(width * span / np.pi * FINER))
    best, beyond = 0.0, 0.0
    for part in np.array_split(np.linspace(-width, width, 2 * count + 1), max(count // GRID, 1)):
        heights = np.abs(np.exp(-1j * part[:, None] * middle) @ sums)
        if (top := int(np.argmax(heights))) >= 0 and heights[top] > beyond:
            best, beyond = float(part[top]), float(heights[top])
    return radians + best


def _peak(spectrum: Vector, k: int) -> float:
    """Frequency of a peak between the lines of a Hann-windowed spectrum."""
    if not 0 < k < len(spectrum) - 1:
        return float(k)
    a, b, c = np.log(spectrum[k - 1 : k + 2] + 1e-300)
    curve = a - 2.0 * b + c
    return float(k + (0.5 * (a - c) / curve if curve < 0.0 else 0.0))
