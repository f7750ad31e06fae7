"""Where the instrument of a frequency response is strong enough, and what is said of the bands where it is not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.errors import RecordError
from gaident.policy.table import POLICY

__all__ = ["EMPTY", "MIXED", "WEAK", "Unshown", "Lines", "band_notes", "chosen_lines", "near_mean", "strong", "too_few"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]

MOST_LINES = 600  # no decision: memory and time: frequencies of a response
NEAR = 4  # no decision: a grid: windows or lines to either side that share what noise is
NAMED = 1.1  # no decision: which bands a sentence names: those whose ends differ by a tenth
MOST_NAMED = 3  # no decision: printed: bands of a sentence

EMPTY, WEAK, MIXED = "empty", "weak", "mixed"
WHY = {
    EMPTY: "the {command} excites almost nothing",
    WEAK: "the {torque} does not follow the {command} beyond noise",
    MIXED: "what the {command} does cannot be told from what the start and the end of the record make",
}
REMEDY = {
    EMPTY: "excite more frequencies, by a multisine, a chirp, or steps at random",
    WEAK: "use a larger {command}, one that excites more there (a multisine, steps at random), or a longer record of it",
    MIXED: "use a multisine of whole periods, steps at random, or a longer record",
}


@dataclass(frozen=True)
class Unshown:
    """A part of the spectrum [Hz] without an estimate, and why: EMPTY, WEAK or MIXED."""

    lowest: float
    highest: float
    why: str

    @property
    def middle(self) -> float:
        return 0.5 * (self.lowest + self.highest)


@dataclass(frozen=True)
class Lines:
    """Values at lines of a spectrum [Hz]; std: of the complex value."""

    frequency: Vector
    value: Complex
    std: Vector
    coherence: Vector
    how: str
    left_out: Sequence[Unshown]


def chosen_lines(found: NDArray[np.intp]) -> NDArray[np.intp]:
    """So many lines of the given ones as a response has at most, evenly spaced in the logarithm of the frequency."""
    if len(found) <= MOST_LINES:
        return found
    places = np.geomspace(1.0, float(len(found)), MOST_LINES) - 1.0
    chosen: NDArray[np.intp] = found[np.unique(np.rint(places).astype(int))]
    return chosen


def near_mean(x: Vector, weight: Vector) -> Vector:
    """Weighted mean of each value and its neighbours."""
    if not len(x):
        return x
    near = (len(x) - 1) // 2
    window = np.ones(2 * (NEAR if near > NEAR else near) + 1)
    made: Vector = np.convolve(x * weight, window, "same") / np.convolve(weight, window, "same")
    return made


def strong(torque: Complex, power: Vector, noise: Vector, freedom: Vector) -> NDArray[np.bool_]:
    """Whether the torque follows the instrument beyond its noise.

    torque: what it answers to 1 of the instrument; power: of the instrument; noise: variance of the torque's line.
    What neighbours answer says how strong the instrument is here, for a line must not be chosen by its own noise.
    """
    tiny = 1e-300  # no decision: by 0: no noise
    answered = np.abs(torque) ** 2
    own = answered * power > POLICY.instrument_alone * (noise + tiny)
    near = near_mean(answered, power) * power > POLICY.instrument_strong * (near_mean(noise, freedom) + tiny)
    found: NDArray[np.bool_] = own & near
    return found


def band_notes(found: Vector, left_out: Sequence[Unshown], command: str, highest: float) -> list[Text]:
    """Sentences about the bands without an estimate; found: the frequencies that have one; command: the instrument's name."""
    bands: dict[str, list[tuple[float, float]]] = {}
    for low, high in pairwise([0.0, *found.tolist(), highest]):
        inside = [b for b in left_out if low <= b.middle <= high]
        # Between the lines of a multisine nothing is excited by intention.
        inside = [b for b in inside if b.why != EMPTY or low == 0.0 or high == highest]
        if inside and high > NAMED * max(low, min(b.lowest for b in inside)):
            bands.setdefault(_widest(inside), []).append((low, high))
    notes = []
    for why, parts in bands.items():
        widest = sorted(sorted(parts, key=lambda band: band[0] / band[1])[:MOST_NAMED])
        where = [_named(low, high, highest) for low, high in widest]
        listed = " and ".join([", ".join(where[:-1]), where[-1]] if len(where) > 1 else where)
        notes.append(say(f"The response has no frequency {listed}: there {_said(WHY[why], command)}."))
    return notes


def too_few(count: int, left_out: Sequence[Unshown], command: str) -> RecordError:
    """The error of a record that shows a response at too few frequencies."""
    why = _widest(left_out)
    said = f"the record shows a response at {count} frequencies only: elsewhere {_said(WHY[why], command)}"
    return RecordError(say(f"{said}; {_said(REMEDY[why], command)}"))


def _named(low: float, high: float, highest: float) -> str:
    """A band in a sentence."""
    if low == 0.0:
        return f"below {high:.3g} Hz"
    return f"above {low:.3g} Hz" if high == highest else f"from {low:.3g} to {high:.3g} Hz"


def _widest(bands: Sequence[Unshown]) -> str:
    """The reason of most of some bands."""
    return max(WHY, key=lambda why: sum(b.highest - b.lowest for b in bands if b.why == why))


def _said(text: str, command: str) -> str:
    """With the instrument's name; {torque} stays for the axis."""
    return text.format(command=command, torque="{torque}")
