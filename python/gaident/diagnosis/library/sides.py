"""A shaft effect at the load of two masses: the row of the same effect at the motor, under keys of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gaident.axis import Text, called, say
from gaident.diagnosis.library.cause import Cause
from gaident.models.effect_rows import SIDES, effect_and_side, end_words, key_of
from gaident.models.effects import row_of

__all__ = ["at_load", "at_motor", "called_of", "name_of", "sides_of"]


def at_load(cause: Cause, excludes: frozenset[str]) -> Cause:
    """The same effect at the load; excludes: what changes the mechanism linearly, which does not go together with it.

    A torque of one frequency in time acts at one end: two of them that cancel each other show as little as none.
    """

    def there(name: str) -> str:
        return key_of(name, SIDES[1])

    return replace(
        cause,
        name=there(cause.name),
        nested=tuple(there(n) for n in cause.nested),
        shared={there(n): places for n, places in cause.shared.items()},
        family=f"{cause.family} at the load" if cause.family else "",
        excludes=cause.excludes | excludes | ({cause.name} if cause.in_time else set()),
        beside=frozenset(there(n) for n in cause.beside),
        other_side=cause.name,
        at_load=True,
        alike={},
    )


def name_of(key: str) -> str:
    """An effect's name, whatever its side."""
    return effect_and_side(key)[0]


def called_of(key: str) -> Text:
    """An effect in words for a field of `say`, at the load with its side."""
    name, side = effect_and_side(key)
    return say("{} {}", called(name), end_words((side,))) if side == SIDES[1] else called(name)


def at_motor(cause: Cause) -> Cause:
    """The row with the name of the same effect at the load, where there is one."""
    return replace(cause, other_side=key_of(cause.name, SIDES[1])) if SIDES[1] in row_of(cause.name).sides else cause


def sides_of(key: str, rivals: Sequence[str], one_place: bool) -> tuple[str, ...]:
    """The sides that data allow for an effect; rivals: keys of what they cannot tell from it.

    one_place: whether both ends are the same place in the model, as with one mass, or nothing can be tried at the load of it.
    """
    allowed = {effect_and_side(k)[1] for k in (key, *rivals) if name_of(k) == name_of(key)}
    return tuple(s for s in row_of(key).sides if one_place or s in allowed)
