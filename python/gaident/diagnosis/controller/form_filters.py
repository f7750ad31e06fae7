"""The filters that the form of a controller may have: where they are, how their numbers are searched, their equations."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Filter
from gaident.control.filters import LowPass, Notch
from gaident.identification.number_ranges import FREQUENCIES, TIME_CONSTANTS, range_of

__all__ = ["FILTER_SETS", "FILTER_SETS_OF_ONE", "Place", "at_places", "bounds_of", "equation_of", "filters", "grid_of"]

Vector = NDArray[np.float64]
Place: TypeAlias = tuple[str, type[LowPass] | type[Notch]]
"""(argument of `Cascade`, kind of filter)."""


PLACES: tuple[Place, ...] = (
    ("torque_filters", LowPass),
    ("torque_filters", Notch),
    ("velocity_filters", LowPass),
    ("command_filters", LowPass),
)
FILTER_SETS: tuple[tuple[Place, ...], ...] = tuple(s for k in range(3) for s in combinations(PLACES, k))
"""None, one, and two filters, the fewer first."""
FILTER_SETS_OF_ONE = FILTER_SETS[: 1 + len(PLACES)]
"""What is searched together with the times of jumps between the lines."""

# Starts of the search: a low pass in samples, a notch as share of the sampling frequency, and its dampings.
NOTCHES = tuple(product(FREQUENCIES, ((0.1, 0.7), (0.3, 1.5))))
NUMBERS = {LowPass: ("time_constant",), Notch: ("frequency", "numerator_damping", "denominator_damping")}
"""Of each filter, searched as ln(tau/T); ln(f T), zn, ln(zd)."""


def filters(places: Sequence[Place], numbers: Vector, period: float) -> list[Filter]:
    """The filters of what the search moves."""
    made: list[Filter] = []
    at = 0
    for _, kind in places:
        if kind is LowPass:
            made.append(LowPass(float(np.exp(numbers[at])) * period))
            at += 1
        else:
            frequency, damping, pole = numbers[at : at + 3]
            made.append(Notch(float(np.exp(frequency)) / period, max(float(damping), 0.0), float(np.exp(pole))))
            at += 3
    return made


def at_places(places: Sequence[Place], numbers: Vector, period: float) -> dict[str, tuple[Filter, ...]]:
    """Argument of `Cascade` -> its filters."""
    made: dict[str, tuple[Filter, ...]] = {}
    for (place, _), f in zip(places, filters(places, numbers, period), strict=True):
        made[place] = (*made.get(place, ()), f)
    return made


def equation_of(f: Filter, period: float) -> tuple[Vector, Vector]:
    """(b, a) of the digital filter, as `LowPass` and `Notch` define it: s = g (1 - 1/z)/(1 + 1/z), g = w/tan(w T/2)."""
    if isinstance(f, LowPass):
        share = -np.expm1(-period / f.time_constant)
        return np.array([share]), np.array([1.0, share - 1.0])
    w = 2.0 * np.pi * f.frequency
    g = w / np.tan(0.5 * w * period)

    def polynomial(damping: float) -> Vector:
        middle, edge = g * g + w * w, 2.0 * damping * w * g
        return np.array([middle + edge, 2.0 * (w * w - g * g), middle - edge])

    a = polynomial(f.denominator_damping)
    return polynomial(f.numerator_damping) / a[0], a / a[0]


def bounds_of(places: Sequence[Place]) -> tuple[Vector, Vector]:
    """(lowest, highest) of the filters' numbers."""
    low, high = np.array([range_of(name, 1.0) for _, kind in places for name in NUMBERS[kind]]).reshape(-1, 2).T
    return low, high


def grid_of(places: Sequence[Place]) -> list[Vector]:
    """Starts of the filters' numbers."""
    return [np.concatenate([np.zeros(0), *start]) for start in product(*(_starts(kind) for _, kind in places))]


def _starts(kind: type[LowPass] | type[Notch]) -> list[Vector]:
    if kind is LowPass:
        return [np.array([np.log(tau)]) for tau in TIME_CONSTANTS]
    return [np.array([np.log(f), zn, np.log(zd)]) for f, (zn, zd) in NOTCHES]
