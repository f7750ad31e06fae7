"""Search space: where gain, poles and zeros are looked for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from gaident.checks import known_keys
from gaident.errors import SpaceError

if TYPE_CHECKING:
    from gaident import _core

__all__ = ["SearchSpace"]

Range = tuple[float, float]


@dataclass(frozen=True)
class SearchSpace:
    """Search ranges of an identification; a pole or zero is -(real part) +- i (imaginary part).

    Parameters
    ----------
    gain : tuple of float
        Range of the gain K at p = 1, 1/J [rad/s^2/(N m)], both ends positive.
    real : tuple of float
        Range of the negated real parts [rad/s]; a negative lower end allows unstable roots.
    imaginary : tuple of float
        Range of the imaginary parts [rad/s], both ends >= 0.
    p : tuple of int
        Range of the number of poles in excess of zeros, 0 to 7.
    q : tuple of int
        Range of the number of zeros, 0 to 7.
    bits : int
        Bits per number of the genetic code, 2 to 16.
    gain_scale : float, optional
        K counts in units of gain_scale^(p-1) at other p [rad/s].
        None: sqrt(real[1]*imaginary[1])/10, and 1 (the same range for every p, as in the paper) with `Settings.paper()`.
    source : str
        Where the ranges come from, shown in the summary.

    Raises
    ------
    SpaceError
        For a range that is empty or out of what is allowed; with the remedy.

    Examples
    --------
    >>> import gaident as ga
    >>> ga.SearchSpace(gain=(1e3, 2e4), real=(0, 60), imaginary=(0, 250), p=(1, 2)).q
    (0, 3)
    >>> ga.SearchSpace.from_mechanics(inertia=(1e-4, 1e-3), resonance_hz=(10, 100)).gain
    (1000.0, 100000.0)
    """

    gain: Range = (1e3, 2e4)
    real: Range = (0.0, 60.0)
    imaginary: Range = (0.0, 250.0)
    p: tuple[int, int] = (0, 3)
    q: tuple[int, int] = (0, 3)
    bits: int = 10
    gain_scale: float | None = None
    source: str = field(default="given", compare=False)

    def __post_init__(self) -> None:
        for name in ("gain", "real", "imaginary", "p", "q"):
            value = getattr(self, name)
            pair = isinstance(value, Sequence) or (isinstance(value, np.ndarray) and value.ndim == 1)
            if isinstance(value, str) or not pair or len(value) != 2:
                raise SpaceError(f"{name} is {value!r}: give a pair (lowest, highest)")
            if not all(isinstance(v, Real) for v in value):
                raise SpaceError(f"{name} is {value!r}: both ends must be numbers")
            try:
                lo, hi = (float(v) for v in value)
            except OverflowError:
                raise SpaceError(f"{name} is {value!r}: both ends must be numbers") from None
            if not (math.isfinite(lo) and math.isfinite(hi)):
                raise SpaceError(f"{name} is {value!r}: both ends must be finite")
            if name in ("p", "q"):
                if lo != int(lo) or hi != int(hi) or not 0 <= lo <= hi <= 7:  # no decision: what an argument may be
                    raise SpaceError(f"{name} is {value!r}: give whole numbers with 0 <= lowest <= highest <= 7")
                object.__setattr__(self, name, (int(lo), int(hi)))
                continue
            if not lo < hi:
                raise SpaceError(f"{name} is {value!r}: the lowest must be below the highest")
            object.__setattr__(self, name, (lo, hi))
        if self.gain[0] <= 0.0:
            raise SpaceError(
                f"gain is {self.gain!r}: both ends must be positive, the gain is searched on a logarithmic scale; "
                "if velocity falls when torque rises, reverse the sign of one of them"
            )
        if self.imaginary[0] < 0.0:
            raise SpaceError(f"imaginary is {self.imaginary!r}: give the positive half, pairs are conjugate by themselves")
        # no decision: what an argument may be
        if isinstance(self.bits, bool) or not isinstance(self.bits, int) or not 2 <= self.bits <= 16:
            raise SpaceError(f"bits is {self.bits!r}: it must be a whole number from 2 to 16")
        if self.gain_scale is not None and not (isinstance(self.gain_scale, Real) and 0.0 < self.gain_scale < math.inf):
            raise SpaceError(f"gain_scale is {self.gain_scale!r}: give a frequency in rad/s, above 0, or None")

    @classmethod
    def from_mechanics(
        cls,
        inertia: Range,
        resonance_hz: Range,
        damping: Range | None = None,
        *,
        p: tuple[int, int] = (0, 3),  # no decision: a start: a range to search
        q: tuple[int, int] = (0, 3),  # no decision: a start: a range to search
        bits: int = 10,  # no decision: a grid: the resolution of a search
    ) -> SearchSpace:
        """Return the ranges of an axis as an engineer knows it.

        Parameters
        ----------
        inertia : tuple of float
            Total inertia at the motor shaft [kg m^2] (or mass [kg]); the motor's own may be down to a tenth of it.
        resonance_hz : tuple of float
            Lowest and highest frequency at which the mechanism may resonate [Hz].
            Antiresonances are looked for from half the lowest on.
        damping : tuple of float, optional
            Total viscous damping [N m s/rad]; None: up to where a pole is as fast as the highest resonance.
        p, q : tuple of int
            Ranges of the structural numbers, see `SearchSpace`.
        bits : int
            Bits per number of the genetic code.

        Returns
        -------
        SearchSpace
            The ranges.

        Raises
        ------
        SpaceError
            For a pair that is no range.
        """
        inertia = _pair("inertia", inertia, above_zero=True)
        resonance_hz = _pair("resonance_hz", resonance_hz, above_zero=True)
        damping = None if damping is None else _pair("damping", damping, above_zero=False)
        top = 2.0 * math.pi * resonance_hz[1]
        real = top if damping is None else max(damping[1] / inertia[0], 0.3 * top)  # no decision: a start: a range to search
        return cls(
            gain=(1.0 / inertia[1], 10.0 / inertia[0]),
            real=(0.0, real),
            imaginary=(math.pi * resonance_hz[0], top),
            p=p,
            q=q,
            bits=bits,
            source="from mechanics",
        )

    def ranges(self, paper: bool = False) -> _core.SearchRanges:
        """Return the same for the core; `paper`: with the same range of K for every p."""
        from gaident import _core

        scale = self.gain_scale
        if scale is None:
            # no decision: a start: the scale of a search
            scale = 1.0 if paper else 0.1 * math.sqrt(max(self.real[1], 1e-9) * self.imaginary[1])
        return _core.SearchRanges(
            gain=self.gain, real=self.real, imaginary=self.imaginary, p=self.p, q=self.q, bits=self.bits, gain_scale=scale
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> SearchSpace:
        """Return the space of what `to_dict` gave; raise SpaceError for unknown keys."""
        values: dict[str, Any] = known_keys(data, "the search space", [f.name for f in fields(cls)], (), SpaceError)
        return cls(**values)


def _pair(name: str, value: object, above_zero: bool) -> Range:
    """(lowest, highest) as floats, or SpaceError."""
    try:
        lo, hi = (float(v) for v in value)  # type: ignore[attr-defined]
    except (TypeError, ValueError, OverflowError):
        raise SpaceError(f"{name} is {value!r}: give a pair of numbers (lowest, highest)") from None
    if not ((lo > 0.0 or (lo == 0.0 and not above_zero)) and lo < hi < math.inf):
        least = "0 <" if above_zero else "0 <="
        raise SpaceError(f"{name} is {value!r}: give (lowest, highest) with {least} lowest < highest")
    return lo, hi
