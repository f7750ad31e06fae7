"""The filters beside a drive's velocity controller, at the controller's own clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from gaident import _core
from gaident.checks import known_keys, real_number
from gaident.errors import ControllerError

__all__ = ["Filter", "LowPass", "Notch", "filter_of", "filters_of"]

MOST_FILTERS = 8  # no decision: what an argument may be


def _above_zero(value: object, name: str) -> float | None:
    """A number above 0, or None: not known."""
    if value is None:
        return None
    number = real_number(value, name, ControllerError)
    if number <= 0.0:
        raise ControllerError(f"{name} is {number:g}: give a number > 0")
    return number


@dataclass(frozen=True)
class LowPass:
    """Low pass of first order, 1/(tau s + 1), exact for an input that is held from one controller sample to the next.

        y(n) = y(n-1) + (1 - exp(-T/tau)) (u(n) - y(n-1))

    Parameters
    ----------
    time_constant : float
        tau [s], > 0; None: not known, and estimated by `identify` and `diagnose` where the torque is logged.

    Raises
    ------
    ControllerError
        For a time constant that is not above 0.

    Examples
    --------
    >>> import gaident as ga
    >>> ga.LowPass(time_constant=0.4e-3)
    LowPass(time_constant=0.0004)
    """

    time_constant: float

    if TYPE_CHECKING:

        def __init__(self, time_constant: float | None) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_constant", _above_zero(self.time_constant, "time_constant"))

    def digital(self, period: float) -> _core.DigitalFilter:
        """The filter at the sample time `period` [s]."""
        return _core.low_pass(self.time_constant, period)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON or TOML."""
        return {"kind": "low pass", **asdict(self)}


@dataclass(frozen=True)
class Notch:
    """Notch, or general filter of second order that leaves a constant as it is.

        (s^2 + 2 zn w s + w^2)/(s^2 + 2 zd w s + w^2),   w = 2 pi frequency

    It is made digital by the bilinear transformation that keeps w in its place.

    Parameters
    ----------
    frequency : float
        Of the notch [Hz], > 0 and below half the controller's sampling frequency.
    numerator_damping, denominator_damping : float
        zn >= 0 and zd > 0; at the frequency the filter lets zn/zd pass.
        Each of the three may be None: not known, and estimated as that of a `LowPass`.

    Raises
    ------
    ControllerError
        For numbers outside of these ranges.

    Examples
    --------
    >>> import gaident as ga
    >>> ga.Notch(frequency=85.0, numerator_damping=0.1, denominator_damping=0.7).frequency
    85.0
    """

    frequency: float
    numerator_damping: float
    denominator_damping: float

    if TYPE_CHECKING:

        def __init__(
            self, frequency: float | None, numerator_damping: float | None, denominator_damping: float | None
        ) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "frequency", _above_zero(self.frequency, "frequency"))
        object.__setattr__(self, "denominator_damping", _above_zero(self.denominator_damping, "denominator_damping"))
        if self.numerator_damping is None:
            return
        damping = real_number(self.numerator_damping, "numerator_damping", ControllerError)
        if damping < 0.0:
            raise ControllerError(f"numerator_damping is {damping:g}: give a number >= 0")
        object.__setattr__(self, "numerator_damping", damping)

    def digital(self, period: float) -> _core.DigitalFilter:
        """The filter at the sample time `period` [s]; raises ControllerError where the frequency is too high for it."""
        highest = 0.5 / period  # no decision: a formula: the Nyquist frequency
        if self.frequency >= highest:
            raise ControllerError(
                f"frequency is {self.frequency:g} Hz: a notch of a controller with the period {period:g} s lies below "
                f"{highest:g} Hz; check frequency and period"
            )
        return _core.notch(
            frequency=self.frequency,
            numerator_damping=self.numerator_damping,
            denominator_damping=self.denominator_damping,
            period=period,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON or TOML."""
        return {"kind": "notch", **asdict(self)}


Filter: TypeAlias = LowPass | Notch


def filter_of(data: Mapping[str, Any]) -> LowPass | Notch:
    """The filter of what `to_dict` gave; raises ControllerError."""
    if not isinstance(data, Mapping):
        raise ControllerError(f"a filter is {data!r:.80}: give the dictionary that to_dict gave")
    numbers: dict[str, Any] = {key: value for key, value in data.items() if key != "kind"}
    if data.get("kind") == "low pass":
        known_keys(numbers, "the low pass", ("time_constant",), ("time_constant",), ControllerError)
        return LowPass(**numbers)
    if data.get("kind") == "notch":
        names = ("frequency", "numerator_damping", "denominator_damping")
        known_keys(numbers, "the notch", names, names, ControllerError)
        return Notch(**numbers)
    raise ControllerError(f'kind is {data.get("kind")!r}: a filter is a "low pass" or a "notch"')


def filters_of(given: object, name: str) -> tuple[Filter, ...]:
    """The filters of an argument; ControllerError where it is no sequence of them, or too long."""
    if isinstance(given, LowPass | Notch):
        given = (given,)
    if not isinstance(given, Sequence) or not all(isinstance(f, LowPass | Notch) for f in given):
        raise ControllerError(f"{name} is {given!r}: give a sequence of LowPass and Notch")
    if len(given) > MOST_FILTERS:
        raise ControllerError(f"{name} has {len(given)} filters: give at most {MOST_FILTERS}")
    return tuple(given)
