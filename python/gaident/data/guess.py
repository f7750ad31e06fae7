"""Which column of a log is which channel, as far as names, units and the values themselves tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gaident.data.column_score import LOAD_QUANTITY, spoken_for
from gaident.data.formats.units import factor
from gaident.data.listing import ColumnInfo, Listing
from gaident.data.record import CHANNELS
from gaident.policy.table import POLICY

__all__ = ["Guess", "guess_channels", "position_and_velocity", "slope_between", "unit_from_position", "unit_from_velocity"]


@dataclass(frozen=True)
class Guess:
    """Channel -> column, with why; what the file says of its unit stands in the column.

    undecided: channel -> columns for which as much speaks, or of which only the user knows what they are.
    """

    channels: Mapping[str, ColumnInfo]
    reasons: Mapping[str, str]
    time: ColumnInfo | None
    undecided: Mapping[str, tuple[ColumnInfo, ...]] = field(default_factory=dict)


def guess_channels(listing: Listing) -> Guess:
    """The most likely column of each channel; one that nothing speaks for, or as much for several columns, is left out.

    A sensor at the load has what no other channel may have.
    """
    usable = [c for c in listing.columns if c.samples > 1 and c.lowest is not None and c.lowest != c.highest and not c.is_time]
    longest = max((c.samples for c in usable), default=0)
    usable = [c for c in usable if c.samples == longest or c.sample_time is not None]
    scored: dict[str, list[tuple[int, ColumnInfo, str]]] = {channel: [] for channel in CHANNELS}
    asked: dict[str, list[ColumnInfo]] = {channel: [] for channel in CHANNELS}
    for column in usable:
        for channel in CHANNELS:
            score, reason, unsure = spoken_for((column.name, *column.names), column.unit, channel)
            if score >= POLICY.words_needed and unsure:
                asked[channel].append(column)
            elif score >= POLICY.words_needed:
                scored[channel].append((score, column, reason))
    channels: dict[str, ColumnInfo] = {}
    reasons: dict[str, str] = {}
    undecided: dict[str, tuple[ColumnInfo, ...]] = {}
    for channel in ("velocity", "command", "torque", "position", "position_command"):
        free = [row for row in scored[channel] if row[1].name not in {c.name for c in channels.values()}]
        best = max((score for score, _, _ in free), default=0)
        first = [row for row in free if row[0] == best]
        if len(first) == 1:
            _, channels[channel], reasons[channel] = first[0]
        elif first or asked[channel]:
            undecided[channel] = (*(column for _, column, _ in first), *asked[channel])
    doubtful = {column.name for columns in undecided.values() for column in columns}
    for channel in LOAD_QUANTITY:
        named = [row for row in scored[channel] if row[1].name not in doubtful | {c.name for c in channels.values()}]
        if len(named) == 1:
            _, channels[channel], reasons[channel] = named[0]
    order = {channel: channels[channel] for channel in CHANNELS if channel in channels}
    return Guess(order, reasons, _time(listing, longest), undecided)


def _time(listing: Listing, longest: int) -> ColumnInfo | None:
    """The column that is called as time is; else one that rises evenly, if there is only one."""
    named = [c for c in listing.columns if c.is_time]
    if named:
        return named[0]
    even = [c for c in listing.columns if c.rises_evenly and c.samples == longest and c.lowest is not None]
    return even[0] if len(even) == 1 else None


_VELOCITY_UNITS = ("rad/s", "rpm", "deg/s", "rps", "m/s", "mm/s", "m/min", "mm/min")


def slope_between(position: NDArray[np.float64], velocity: NDArray[np.float64], dt: float) -> tuple[float, float]:
    """(k, correlation) of d position/dt = k velocity + c; (0, 0) where one of them rests."""
    rate, own = np.gradient(position, dt)[1:-1], velocity[1:-1]
    rate, own = rate - rate.mean(), own - own.mean()
    power, other = float(own @ own), float(rate @ rate)
    if power == 0.0 or other == 0.0:
        return 0.0, 0.0
    both = float(rate @ own)
    return both / power, both / float(np.sqrt(power * other))


def unit_from_position(velocity: NDArray[np.float64], position: NDArray[np.float64], dt: float, linear: bool) -> str | None:
    """The unit of a velocity, from the slope of a position in SI; None where none fits to within 2 %."""
    size, correlation = slope_between(position, velocity, dt)
    if correlation < POLICY.one_course:
        return None
    for unit in _VELOCITY_UNITS:
        if unit.startswith("m") == linear and abs(size / factor("velocity", unit) - 1.0) < POLICY.unit_shown:
            return unit
    return None


def unit_from_velocity(command: NDArray[np.float64], velocity: NDArray[np.float64], linear: bool) -> str | None:
    """The unit of a velocity command, from a velocity in SI that follows it; None where it does not to within 25 %."""
    power = float(command @ command)
    size = float(command @ velocity) / power if power > 0.0 else 0.0
    if size <= 0.0 or float(command @ velocity) < POLICY.one_course * np.sqrt(power * float(velocity @ velocity)):
        return None
    for unit in _VELOCITY_UNITS:
        if unit.startswith("m") == linear and abs(np.log(size / factor("velocity", unit))) < np.log(POLICY.near_rpm):
            return unit
    return None


def position_and_velocity(values: Mapping[str, NDArray[np.float64]], dt: float) -> tuple[str, str] | None:
    """The two columns of which one is the derivative of the other, beyond doubt; None where no pair or several are."""
    found = [
        (a, b) for a in values for b in values if a != b and abs(slope_between(values[a], values[b], dt)[1]) > POLICY.derivative
    ]
    return found[0] if len(found) == 1 else None
