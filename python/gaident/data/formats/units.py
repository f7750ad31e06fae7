"""Units of logs, and what they are in SI. One table; to add a unit, add a row."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass

from gaident.arguments import arg
from gaident.data.signals.arrays import is_number
from gaident.errors import ReadError

__all__ = ["QUANTITIES", "Constants", "factor", "is_any_unit", "is_unit", "known_units", "needed_constant", "of_other_axis"]

_TURN = 2.0 * math.pi  # no decision: a unit; rad

_COUNTS = ("counts_per_turn", "[counts per turn, after edge evaluation]")
_AMPERE = ("torque_constant", "[N m/A, or N/A]")
_VOLT = ("torque_per_volt", "[N m/V, or N/V]")
_RATED = ("rated_torque", "[N m, or N]")
_REFERENCE = ("reference_speed", "[rad/s, or m/s]")
_HEX = 1.0 / 0x4000  # no decision: a unit; drives count 100 % as 4000 hex


@dataclass(frozen=True)
class _Unit:
    """SI value = factor * value, times (or, for counts, divided by) the constant of the drive it needs.

    axis: "rotary" or "linear" where only such an axis is measured in it; "": either.
    """

    factor: float
    constant: tuple[str, str] | None = None
    divide: bool = False
    axis: str = ""


def _turning(factor: float, constant: tuple[str, str] | None = None, divide: bool = False) -> _Unit:
    return _Unit(factor, constant, divide, "rotary")


def _straight(factor: float) -> _Unit:
    return _Unit(factor, axis="linear")


# First spelling of each row is what messages list.
_VELOCITY: dict[tuple[str, ...], _Unit] = {
    ("rad/s", "rad/sec", "rad s-1", "rad s^-1"): _turning(1.0),
    ("rpm", "1/min", "r/min", "rev/min", "u/min", "min-1", "min^-1", "min⁻¹", "turns/min", "tr/min", "giri/min", "upm"): _turning(
        _TURN / 60.0
    ),
    ("rps", "rev/s", "turn/s", "turns/s", "u/s", "tr/s", "giri/s"): _turning(_TURN),
    ("deg/s", "°/s", "deg/sec", "degree/s", "degrees/s", "grad/s"): _turning(_TURN / 360.0),
    ("counts/s", "count/s", "cnt/s", "inc/s", "pulses/s", "ticks/s"): _turning(_TURN, _COUNTS, divide=True),
    ("m/s", "m/sec", "m s-1"): _straight(1.0),
    ("mm/s", "mm/sec", "mm s-1"): _straight(1e-3),
    ("m/min",): _straight(1.0 / 60.0),
    ("mm/min",): _straight(1e-3 / 60.0),
    ("%", "percent", "% of reference", "% of reference speed", "% of rated speed"): _Unit(0.01, _REFERENCE),
    ("‰", "per mille", "0.1 %", "promille"): _Unit(1e-3, _REFERENCE),
    ("4000 hex", "4000h", "0x4000"): _Unit(_HEX, _REFERENCE),
}
_POSITION: dict[tuple[str, ...], _Unit] = {
    ("rad", "radian", "radians"): _turning(1.0),
    ("mrad",): _turning(1e-3),
    ("deg", "°", "degree", "degrees", "grad"): _turning(_TURN / 360.0),
    ("turn", "turns", "rev", "revs", "umdr", "umdrehungen", "giri"): _turning(_TURN),
    ("counts", "count", "cnt", "inc", "pulses", "ticks"): _turning(_TURN, _COUNTS, divide=True),
    ("m", "metre", "meter"): _straight(1.0),
    ("mm",): _straight(1e-3),
    ("um",): _straight(1e-6),
}
_LOAD_VELOCITY = {names: unit if unit.constant is None else _Unit(1.0) for names, unit in _VELOCITY.items()}
_LOAD_POSITION = {names: unit if unit.constant is None else _Unit(1.0) for names, unit in _POSITION.items()}
"""The load's sensor has counts and a full scale of its own, and its scale is estimated: such values stay as they are."""
_TORQUE: dict[tuple[str, ...], _Unit] = {
    ("N m", "newton metre", "newton meter"): _turning(1.0),
    ("mN m", "N mm"): _turning(1e-3),
    ("kN m",): _turning(1e3),
    ("N", "newton"): _straight(1.0),
    ("mN",): _straight(1e-3),
    ("kN",): _straight(1e3),
    ("%", "percent", "% rated", "% of rated", "% of rated torque"): _Unit(0.01, _RATED),
    ("‰", "per mille", "0.1 %", "promille"): _Unit(1e-3, _RATED),
    ("4000 hex", "4000h", "0x4000"): _Unit(_HEX, _RATED),
    ("A", "amp", "ampere", "arms", "aeff"): _Unit(1.0, _AMPERE),
    ("mA",): _Unit(1e-3, _AMPERE),
    ("V", "volt"): _Unit(1.0, _VOLT),
    ("mV",): _Unit(1e-3, _VOLT),
}
_VOLTAGE: dict[tuple[str, ...], _Unit] = {("V", "volt"): _Unit(1.0), ("mV",): _Unit(1e-3)}
_CURRENT: dict[tuple[str, ...], _Unit] = {("A", "amp", "ampere", "arms", "aeff"): _Unit(1.0), ("mA",): _Unit(1e-3)}
_TIME: dict[tuple[str, ...], _Unit] = {
    ("s", "sec", "second", "seconds"): _Unit(1.0),
    ("ms", "msec", "millisecond", "milliseconds"): _Unit(1e-3),
    ("us", "usec", "microsecond", "microseconds"): _Unit(1e-6),
    ("ns",): _Unit(1e-9),
    ("min", "minute", "minutes"): _Unit(60.0),
}
# Units that stand in logs beside ours; they mark a line of units, and no channel of a record has them.
_OTHERS = ("-", "--", "1", "unit", "units", "none", "n/a", "hz", "khz", "w", "kw", "k", "°c", "degc", "bar",
           "pa", "bool", "rad/s^2", "rad/s²", "m/s^2", "m/s²", "kg", "j", "var", "va")  # fmt: skip


def _spelling(unit: str) -> str:
    """One spelling for `N m`, `Nm`, `N.m`, `N*m`, `N·m`; `µ` is `u`; capitals do not matter, but for MN."""
    plain = unit.strip().replace("\N{MICRO SIGN}", "u").replace("\N{GREEK SMALL LETTER MU}", "u")
    for mark in (" ", "\N{NO-BREAK SPACE}", ".", "*", "·", "⋅", "_"):
        plain = plain.replace(mark, "")
    # The one prefix whose capital changes the meaning: a meganewton is no millinewton.
    return plain if plain.startswith("MN") else plain.casefold()


def _by_spelling(table: dict[tuple[str, ...], _Unit]) -> dict[str, _Unit]:
    return {_spelling(name): unit for names, unit in table.items() for name in names}


_TABLES = {
    "command": _VELOCITY,
    "velocity": _VELOCITY,
    "torque": _TORQUE,
    "position": _POSITION,
    "position_command": _POSITION,
    "load_position": _LOAD_POSITION,
    "load_velocity": _LOAD_VELOCITY,
    "voltage": _VOLTAGE,
    "current": _CURRENT,
    "time": _TIME,
}
_UNITS = {quantity: _by_spelling(table) for quantity, table in _TABLES.items()}
_OURS = {spelling for units in _UNITS.values() for spelling in units}
_ANY = _OURS | {_spelling(name) for name in _OTHERS}

QUANTITIES = tuple(_TABLES)
"""What a unit can be given for: the channels of a Record, what a torque is worked out from, and time."""


@dataclass(frozen=True)
class Constants:
    """What belongs to the drive and turns its own units into SI; None where unknown.

    counts_per_turn  encoder counts per turn of the motor
    torque_constant  [N m/A] (linear: [N/A])
    rated_torque     what 100 % means [N m] (linear: [N])
    torque_per_volt  [N m/V] (linear: [N/V])
    resistance       of the motor's winding [Ohm], for a torque from its voltage
    inductance       of it [H]
    back_emf_constant  [V s/rad] (linear: [V s/m]); None: as the torque constant
    screw            [m] that a turn of the motor moves: lengths and forces are then those of the motor's angle and torque
    reference_speed  what 100 % of a speed means [rad/s] (linear: [m/s])
    """

    counts_per_turn: float | None = None
    torque_constant: float | None = None
    rated_torque: float | None = None
    torque_per_volt: float | None = None
    resistance: float | None = None
    inductance: float | None = None
    back_emf_constant: float | None = None
    screw: float | None = None
    reference_speed: float | None = None

    def check(self) -> None:
        """Raise ReadError unless each constant is None or a positive finite number."""
        for name, value in vars(self).items():
            if value is None:
                continue
            number = _number(value)
            if number is None or not math.isfinite(number) or number <= 0:
                raise ReadError(f"{arg(name, repr(value))}, but it must be a positive finite number; correct it or leave it out")


def known_units(quantity: str, axis: str = "") -> tuple[str, ...]:
    """The units of a quantity ("velocity", "time", ...), main spellings; axis: without those of the other kind of axis."""
    return tuple(names[0] for names, unit in _TABLES[quantity].items() if not axis or unit.axis in ("", axis))


def of_other_axis(quantity: str, unit: str, axis: str) -> bool:
    """Whether only the other kind of axis is measured in this unit: a linear one turns at no rpm."""
    row = _UNITS[quantity].get(_spelling(unit))
    return row is not None and row.axis not in ("", axis)


def is_unit(text: str, quantity: str | None = None) -> bool:
    """Whether `text` is the spelling of a unit from the table; quantity: of that one alone."""
    return _spelling(text) in (_OURS if quantity is None else _UNITS[quantity])


def is_any_unit(text: str) -> bool:
    """Whether `text` may stand in a line of units: ours, those of other quantities, a dash."""
    return _spelling(text) in _ANY


def factor(quantity: str, unit: str | float, constants: Constants | None = None) -> float:
    """What a value in `unit` is multiplied by to get SI (rad, rad/s, N m, s; linear m, m/s, N).

    quantity   one of QUANTITIES, "velocity" for example
    unit       a spelling from the table, or the factor itself as a number (finite, not 0; negative turns the
               sign)
    constants  of the drive, for counts, A, V and %

    Raises ReadError with the known units, or with the constant that is missing.
    """
    constants = Constants() if constants is None else constants
    constants.check()
    if quantity not in _UNITS:
        raise ReadError(f"quantity={quantity!r} has no units; give one of {', '.join(QUANTITIES)}")
    number = _number(unit)
    if number is not None:
        if not math.isfinite(number) or number == 0.0:
            raise ReadError(f"units: {quantity}={unit!r} must be finite and not 0; give the factor to SI")
        return number
    listed = ", ".join(known_units(quantity))
    if not isinstance(unit, str):
        raise ReadError(f"units: {quantity}={unit!r} is neither text nor a number; give one of {listed}, or a factor")
    row = _UNITS[quantity].get(_spelling(unit))
    if row is None:
        raise ReadError.at(
            "units",
            f"{unit!r} is no unit of {quantity}{_guess(quantity, unit)}",
            f"known are {listed}; or give the factor to SI as a number, {arg('units', '0.5', quantity)}",
        )
    if row.constant is None:
        return row.factor * (_of_the_motor(quantity, constants.screw) if row.axis == "linear" else 1.0)
    name, meaning = row.constant
    value: float | None = getattr(constants, name)
    if value is None:
        raise ReadError(f"units: {quantity} in {unit!r} needs a constant of the drive; give {arg(name, '...')} {meaning}")
    return row.factor / value if row.divide else row.factor * value


def _of_the_motor(quantity: str, screw: float | None) -> float:
    """What turns SI of a linear axis into that of the motor on its screw: q = 2 pi x/l, M = F l/(2 pi)."""
    if screw is None:
        return 1.0
    return screw / _TURN if quantity == "torque" else _TURN / screw


def needed_constant(quantity: str, unit: str) -> str | None:
    """The constant of the drive that a value in this unit needs ("rated_torque" for %); None: none, or unknown."""
    row = _UNITS[quantity].get(_spelling(unit))
    return None if row is None or row.constant is None else row.constant[0]


def _number(value: object) -> float | None:
    """`value` as a float (too large: infinity), None if it is no number."""
    if not is_number(value):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _guess(quantity: str, unit: str) -> str:
    given = _spelling(unit)
    near = difflib.get_close_matches(given, _UNITS[quantity], n=5)
    near.sort(key=lambda known: sorted(known) != sorted(given))  # letters in another order come first: rmp is rpm, not rps
    return f" (did you mean {near[0]!r}?)" if near else ""
