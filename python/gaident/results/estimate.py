"""A parameter and what it is worth."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Estimate"]


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
        Whether the record determines the value to better than its own size.

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
