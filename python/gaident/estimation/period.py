"""The length with which a force returns on a linear axis, where it is not given: the pitch of a screw, or of the poles.

    u = J a + (B+ w or B- w) + (C+ or -C-) + A cos(2 pi x/P) + B sin(2 pi x/P)

Inertia and friction are fitted alone, the last two columns are compared with what they leave, for every P that the path shows a
few times.
P is the period where BIC falls by more than the limit for a free function of one signal, and by a material share.
The limit is that high because P is fitted too, and many values were tried.
At constant speed a hum of one frequency is such a wave too.
So P must explain more than any frequency in time, by the margin of two rivals.

The strongest wave may be a harmonic of the pitch: where other harmonics of a longer pitch stand beside it, that pitch is taken.
A pitch is a round number: of all lengths within `round_deviations` the one with the fewest digits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.estimation.criterion import effective_samples, gained
from gaident.estimation.projection import project_out
from gaident.estimation.regression.motion import ORDER, cutoff_of
from gaident.estimation.regression.rows import decimation_of, rows_of
from gaident.policy.table import POLICY

__all__ = ["period_of_place"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

TERMS = ("inertia", "viscous_by_direction", "coulomb_by_direction")
AT_ONCE = 1 << 21  # no decision: memory; numbers of a block of waves


@dataclass(frozen=True, eq=False)
class _Left:
    """What inertia and friction leave of the torques, one array for each record; base: their columns as rows, (k, n)."""

    errors: tuple[Vector, ...]
    base: tuple[Matrix, ...]

    @property
    def power(self) -> float:
        """Sum of squares."""
        return sum(float(e @ e) for e in self.errors)

    def worth(self, along: Sequence[Vector], waves: Vector) -> Vector:
        """By how much the sum of squares falls with cos and sin of each wave number, of every record by itself."""
        found = np.zeros(len(waves))
        for x, error, base in zip(along, self.errors, self.base, strict=True):
            block = max(AT_ONCE // len(x), 1)
            for at in range(0, len(waves), block):
                turned = 2.0 * np.pi * np.outer(waves[at : at + block], x)
                a, b = project_out(base, np.cos(turned)), project_out(base, np.sin(turned))
                aa, bb, ab = (np.einsum("ij,ij->i", *pair) for pair in ((a, a), (b, b), (a, b)))
                ea, eb, det = a @ error, b @ error, aa * bb - ab**2
                clear = det > 1e-9 * aa * bb
                fall = (bb * ea**2 - 2.0 * ab * ea * eb + aa * eb**2) / np.where(clear, det, 1.0)
                found[at : at + block] += np.where(clear, fall, 0.0)
        return found

    def beside(self, along: Sequence[Vector], wave: float) -> _Left:
        """What a wave leaves."""
        bases = [
            np.vstack([base, np.cos(2.0 * np.pi * wave * x), np.sin(2.0 * np.pi * wave * x)])
            for x, base in zip(along, self.base, strict=True)
        ]
        return _Left(tuple(project_out(b, e[None, :])[0] for b, e in zip(bases, self.errors, strict=True)), tuple(bases))


def period_of_place(records: Sequence[Record]) -> float | None:
    """The length [m] with which a torque of these records returns; None where none shows. records: each with its torque."""
    dt = records[0].dt
    cutoff = min(cutoff_of(r, ORDER) for r in records)
    factor = decimation_of(None, cutoff, dt)
    rows = [rows_of(r, TERMS, cutoff, ORDER, factor, None) for r in records]
    rows = [r for r in rows if len(r.torque) >= POLICY.least_rows]
    if not rows:
        return None
    places, bases = [r.position for r in rows], [r.columns.T for r in rows]
    errors = tuple(project_out(base, r.torque[None, :])[0] for base, r in zip(bases, rows, strict=True))
    left = _Left(errors, tuple(bases))
    travel = max(float(np.ptp(x)) for x in places)
    speed = float(np.median(np.abs(np.concatenate([r.of(("viscous_by_direction",)).sum(axis=1) for r in rows]))))
    band = 0.5 * POLICY.seen_band / (factor * dt)  # no decision: a formula: half the sampling frequency
    low, high = POLICY.seen_path / travel, band / speed
    if not low < high or not left.power > 0.0:
        return None
    waves = np.linspace(low, high, POLICY.lengths)
    waves = waves[:: max(int(POLICY.lengths / (POLICY.finer * travel * (high - low))), 1)]
    at = float(waves[int(np.argmax(left.worth(places, waves)))])
    beside = left.beside(places, at)
    if not _counts(left, beside, len(waves)):
        return None
    samples = effective_samples(*beside.errors)
    times = [r.time for r in rows]
    longest = max(float(np.ptp(t)) for t in times)
    frequencies = np.arange(1.0, POLICY.finer * band * longest) / (POLICY.finer * longest)  # Hz
    hum = left.power - float(left.worth(times, frequencies).max(initial=0.0))
    if gained(hum, beside.power, samples) < POLICY.rival_margin:
        return None
    wave, std = _refined(left, places, at, 1.0 / (POLICY.finer * travel), samples)
    whole = _whole(beside, places, wave, travel)
    return _round(whole / wave, whole * std / wave**2)


def _counts(before: _Left, after: _Left, tried: int) -> bool:
    """Whether a wave is there: two amplitudes and its length, the best of so many."""
    gain = gained(before.power, after.power, effective_samples(*after.errors), 3)  # no decision: how many numbers a wave has
    chance = 2.0 * math.log(tried)  # no decision: 2 ln m, what the best of m costs, see `Term.search_cost`
    return gain - chance > POLICY.dependence_gain and before.power - after.power > POLICY.material_share * before.power


def _refined(left: _Left, places: Sequence[Vector], wave: float, reach: float, samples: float) -> tuple[float, float]:
    """(wave number of the least sum of squares, its standard deviation) [1/m], next to one of the grid."""
    from scipy.optimize import minimize_scalar

    def fall(f: float) -> float:
        return float(left.worth(places, np.array([f]))[0])

    best = float(minimize_scalar(lambda f: -fall(f), bounds=(wave - reach, wave + reach), method="bounded").x)
    h = 0.2 * reach  # no decision: the step of a difference
    curvature = (2.0 * fall(best) - fall(best - h) - fall(best + h)) / h**2
    rest = left.power - fall(best)
    return best, math.sqrt(2.0 * rest / (samples * curvature)) if curvature > 0.0 else reach


def _whole(left: _Left, places: Sequence[Vector], wave: float, travel: float) -> int:
    """How many of the waves that were found make a pitch: other parts of it stand beside them. left: beside the wave."""
    for parts in range(POLICY.pitch_parts, 1, -1):
        others = [j for j in range(1, 2 * parts) if j % parts and math.gcd(j, parts) == 1]
        if wave * travel < POLICY.seen_path * parts:
            continue
        worth = left.worth(places, wave * np.array(others) / parts)
        best = wave * others[int(np.argmax(worth))] / parts
        if _counts(left, left.beside(places, best), POLICY.pitch_parts**2):
            return parts
    return 1


def _round(length: float, std: float) -> float:
    """The length with the fewest digits within its deviations."""
    for digits in range(1, 9):  # no decision: printed: digits of a length
        written = float(f"{length:.{digits}g}")
        if abs(written - length) <= POLICY.round_deviations * std:
            return written
    return length
