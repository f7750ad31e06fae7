"""A parameter and what it is worth."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

from gaident.axis import unit
from gaident.errors import GaidentError
from gaident.models.effect_rows import wave_of

__all__ = ["ANGULAR", "Estimate", "check_complete", "of_axis"]

ANGULAR = frozenset({"phase", "frequency", "zero_frequency", "bandwidth"})
"""Parameters of effects that are an angle within a period or an angular frequency: in rad and rad/s on a linear axis too."""


@dataclass(frozen=True)
class Estimate:
    """One parameter: its value and standard deviation.

    Attributes
    ----------
    value : float
        The value in `unit`.
    std : float
        Its standard deviation in `unit`; nan for a parameter at a bound of its search range, inf where the record says nothing
        about it.
    unit : str
        The unit; "1" for none.
    at_bound : bool
        Whether the value is at a bound of its search range.
    identifiable : bool
        Whether the record determines the value to better than its own size, a phase to better than 1 rad.
    of_controller : float
        The part of `std` that numbers and clock of the controller bring in, where the records had to show these: its square is
        part of that of `std`. 0 where they were given.

    Examples
    --------
    >>> import gaident as ga
    >>> friction = ga.Estimate(0.0399, 0.0001, "N m")
    >>> f"{friction.value:.3f} +- {friction.std:.4f} {friction.unit}"
    '0.040 +- 0.0001 N m'
    """

    value: float
    std: float
    unit: str
    at_bound: bool = False
    identifiable: bool = True
    of_controller: float = 0.0


def check_complete(names: Collection[str]) -> None:
    """Raise GaidentError where the saved parameters of a model lack one: its gain, or one of the four of a pair of roots."""
    pairs = {name.rsplit("_", 1)[0] for name in names if "_pair_" in name}
    needed = ["gain", *(f"{pair}_{what}" for pair in sorted(pairs) for what in ("real", "imaginary", "frequency", "damping"))]
    missing = next((name for name in needed if name not in names), None)
    if missing is not None:
        raise GaidentError(f"parameters lacks {missing}, which a model with these others has; save it again")


def of_axis(name: str, estimate: Estimate, axis: str) -> Estimate:
    """A parameter as a reader of the axis has it: on a linear one N for N m, and an order in periods to a metre.

    There a model counts an order as a rotary axis does, periods in 2 pi m: 628.3 of it are 100 1/m.
    """
    if axis == "linear" and estimate.unit == "1/turn":
        part = estimate.of_controller / math.tau
        return replace(estimate, value=estimate.value / math.tau, std=estimate.std / math.tau, unit="1/m", of_controller=part)
    return estimate if wave_of(name)[0] in ANGULAR else replace(estimate, unit=unit(estimate.unit, axis))
