"""Which controllers are looked for: the ranges of a filter's and of a gain's numbers, with unit, source and command.

The period is that of the controller. A number that ends at one of these is none that the log shows.
"""

from __future__ import annotations

from dataclasses import dataclass

from gaident.policy.declared import FORMS, NUMBERS, loop

__all__ = ["ControllerRanges"]


@dataclass(frozen=True)
class ControllerRanges:
    """See the module; `gaident.policy.table.rows()` lists these rows among the others."""

    filter_fastest: float = loop(
        0.05, "periods", "time constant of a filter at least: a shorter one leaves e^-20 of a step to the next sample", NUMBERS
    )
    filter_slowest: float = loop(1e5, "periods", "the same at most: 100 s at 1 kHz, beyond which it is an integrator", NUMBERS)
    limit_apart: float = loop(
        0.8, "1", "of the highest torque behind a filter, the limit before it at least, and that torque of the limit", FORMS
    )
    notch_slowest: float = loop(
        1e-4, "1", "of the controller's sampling frequency, the lowest of a notch: 0.1 Hz at 1 kHz", NUMBERS
    )
    notch_fastest: float = loop(
        0.495, "1", "the same, the highest: at half of it a digital notch is none, and nearer to it two look alike", NUMBERS
    )
    most_zero_damping: float = loop(
        5.0, "1", "damping of a notch's zeros at most: beyond, it is two low passes far apart", NUMBERS
    )
    least_pole_damping: float = loop(5e-3, "1", "damping of a notch's poles at least: a drive's filter rings less", NUMBERS)
    most_pole_damping: float = loop(10.0, "1", "the same at most: beyond, its poles are two low passes far apart", NUMBERS)
    least_position_gain: float = loop(
        1e-3, "1/s", "of a position controller at least: an axis takes minutes to its place", NUMBERS
    )
    most_position_gain: float = loop(1e5, "1/s", "the same at most: no velocity loop is as fast", NUMBERS)
