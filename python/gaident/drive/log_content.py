"""What a log contains beyond the names of its columns: axes, gaps in its time, motion by its values, sizes of its units."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.data.column_score import LOAD_QUANTITY
from gaident.data.formats.units import Constants, factor
from gaident.data.guess import Guess, guess_channels, position_and_velocity
from gaident.data.listing import Listing
from gaident.errors import ReadError
from gaident.policy.table import POLICY

__all__ = ["axes_of", "factor_of", "gaps_of", "kind_of_axis", "with_content"]

_OF_AN_AXIS = re.compile(r"([A-Za-z0-9_-]+)[.:/|\\]")
"""How the name of a column begins where the log contains several axes: X.n_act, axis1/torque."""


def axes_of(listing: Listing) -> dict[str, tuple[Listing, Guess]]:
    """Axis -> its own columns, those that belong to all with them, and their channels; {} where the log contains one axis.

    An axis is what the names of a motion and of what drives it begin with.
    """
    begins = {c.name: found[1] if (found := _OF_AN_AXIS.match(c.name)) else "" for c in listing.columns}
    common = {c.name for c in listing.columns if c.is_time or not begins[c.name]}
    axes = {}
    for name in dict.fromkeys(begins.values()):
        own = replace(listing, columns=tuple(c for c in listing.columns if c.name in common or begins[c.name] == name))
        guess = guess_channels(own)
        moved = any(begins[guess.channels[ch].name] == name for ch in ("velocity", "position") if ch in guess.channels)
        driven = any(begins[guess.channels[ch].name] == name for ch in ("command", "torque") if ch in guess.channels)
        if name and moved and driven:
            axes[name] = own, guess
    return axes if len(axes) > 1 else {}


def gaps_of(time: NDArray[np.float64] | None) -> tuple[int, float]:
    """(pauses of a time that is even between them, its usual step); (0, 0.0) where there is none, or it is uneven besides."""
    steps = np.diff(time) if time is not None else np.zeros(0)
    usual = float(np.median(steps)) if len(steps) else 0.0
    if not usual > 0.0:
        return 0, 0.0
    pauses = steps > POLICY.pause * usual
    even = np.abs(steps[~pauses] - usual) <= POLICY.clock_jitter * usual
    return (int(pauses.sum()), usual) if pauses.any() and even.all() else (0, 0.0)


def with_content(listing: Listing, guess: Guess, values: Mapping[str, NDArray[np.float64]]) -> Guess:
    """What no name tells: a pair of columns of which one is the derivative of the other.

    values: the columns in the file's units, {} where the log is too long to be looked into.
    """
    if "velocity" in guess.channels:
        return guess
    open_ = {"position", *LOAD_QUANTITY}
    taken = {c.name for channel, c in guess.channels.items() if channel not in open_} | {guess.time.name if guess.time else ""}
    enough = [c for c in listing.columns if c.samples > POLICY.derivative_samples]
    moving = [c for c in enough if c.lowest != c.highest and not c.note and not c.rises_evenly]
    longest = max((c.samples for c in moving), default=0)
    candidates = {c.name: values[c.name] for c in moving if c.samples == longest and c.name not in taken and c.name in values}
    pair = position_and_velocity(candidates, 1.0) if len(candidates) <= POLICY.paired_columns else None
    if pair is None or ("position" in guess.channels and pair[0] != guess.channels["position"].name):
        return guess
    by_name = {c.name: c for c in listing.columns}
    found = dict(zip(("position", "velocity"), (by_name[name] for name in pair), strict=True))
    reasons = {"position": "the log's velocity is its derivative", "velocity": "the derivative of the log's position"}
    rest = {channel: c for channel, c in guess.channels.items() if c.name not in pair}
    return replace(guess, channels={**rest, **found}, reasons={**guess.reasons, **reasons})


def factor_of(channel: str, unit: str | None) -> float | None:
    """Factor to SI, constants of the drive taken as 1; None where the unit is not known."""
    if unit is None:
        return None
    try:
        return factor(channel, unit, Constants(1.0, 1.0, 1.0, 1.0, reference_speed=1.0))
    except ReadError:
        return None


def kind_of_axis(units: Mapping[str, str | None]) -> str:
    """ "linear" where a channel of the motor is in a unit of such an axis, else "rotary"; units: channel -> what the log says."""
    own = ((channel, unit) for channel, unit in units.items() if channel not in LOAD_QUANTITY)
    return "linear" if any(_is_linear(channel, unit) for channel, unit in own) else "rotary"


def _is_linear(channel: str, unit: str | None) -> bool:
    """Whether a channel in this unit is one of a linear axis."""
    if unit is None or factor_of(channel, unit) is None:
        return False
    plain = unit.casefold().replace(" ", "")
    return plain.startswith(("m/", "mm", "um", "met")) or plain in ("m", "n", "kn", "mn", "newton")
