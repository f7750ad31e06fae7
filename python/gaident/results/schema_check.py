"""Saved results against the JSON Schema of the package, before anything is made of them.

Knows the words that results.schema.json uses; another one is an error of the package, which the tests would see.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from gaident.errors import GaidentError
from gaident.version import version

__all__ = ["check_saved"]

Schema = Mapping[str, Any]

_TYPES: dict[str, Callable[[Any], bool]] = {
    "object": lambda x: isinstance(x, dict),
    "array": lambda x: isinstance(x, list),
    "string": lambda x: isinstance(x, str),
    "boolean": lambda x: isinstance(x, bool),
    "null": lambda x: x is None,
    "number": lambda x: isinstance(x, int | float) and not isinstance(x, bool),
    "integer": lambda x: not isinstance(x, bool) and (isinstance(x, int) or (isinstance(x, float) and x.is_integer())),
}
_SAY_NOTHING = {"description", "title", "$schema", "$id", "$defs"}


def check_saved(data: Any, schema: Schema) -> None:
    """Raises GaidentError, naming the place, where the data of a file are not as the schema says."""
    fault = _Check(schema).fault(data, schema, ())
    if fault is not None:
        place, what = fault
        remedy = "the file is damaged; save it again"
        if _is_newer(made_by := data.get("gaident_version") if isinstance(data, dict) else None):
            remedy = f"the file is of gaident {made_by}, newer than this {version()}; load it with that"
        raise GaidentError(f"{'.'.join(map(str, place)) or 'the file'} {what}: {remedy}")


def _is_newer(made_by: object) -> bool:
    """Whether this is the number of a later version."""

    def numbers(text: str) -> list[int]:
        return [int(part) for part in re.findall(r"\d+", text)]

    return isinstance(made_by, str) and numbers(made_by) > numbers(version())


Place = tuple[str | int, ...]
Fault = tuple[Place, str] | None


class _Check:
    """The checks of one schema: each gives the first fault and its place, or None."""

    def __init__(self, root: Schema) -> None:
        self.root = root

    def fault(self, x: Any, schema: Schema | bool, at: Place) -> Fault:
        if isinstance(schema, bool):
            return None if schema else (at, "is not known")
        for word, value in schema.items():
            if word in _SAY_NOTHING or (word in ("then", "properties") and not isinstance(x, dict)):
                continue
            check = getattr(self, "_" + word.replace("$", "").lower(), None)
            if check is None:
                raise NotImplementedError(f"the schema uses {word!r}, which schema_check.py does not know")
            found: Fault = check(x, value, schema, at)
            if found is not None:
                return found
        return None

    def _ref(self, x: Any, name: str, schema: Schema, at: Place) -> Fault:
        return self.fault(x, self.root["$defs"][name.rpartition("/")[2]], at)

    def _type(self, x: Any, kinds: str | Sequence[str], schema: Schema, at: Place) -> Fault:
        named = [kinds] if isinstance(kinds, str) else kinds
        if any(_TYPES[kind](x) for kind in named):
            return None
        return at, f"is {x!r:.40} where {' or '.join(named)} is needed"

    def _enum(self, x: Any, allowed: Sequence[Any], schema: Schema, at: Place) -> Fault:
        known = any(x == a and type(x) is type(a) for a in allowed)
        return None if known else (at, f"is {x!r:.40}, which is none of {', '.join(map(repr, allowed)):.200}")

    def _const(self, x: Any, value: Any, schema: Schema, at: Place) -> Fault:
        return self._enum(x, [value], schema, at)

    def _required(self, x: Any, names: Sequence[str], schema: Schema, at: Place) -> Fault:
        missing = [name for name in names if name not in x] if isinstance(x, dict) else []
        return (at, f"lacks {', '.join(missing):.200}") if missing else None

    def _properties(self, x: Any, properties: Mapping[str, Schema], schema: Schema, at: Place) -> Fault:
        faults = (self.fault(x[name], part, (*at, name)) for name, part in properties.items() if name in x)
        return next((f for f in faults if f is not None), None)

    def _additionalproperties(self, x: Any, rest: Schema | bool, schema: Schema, at: Place) -> Fault:
        if not isinstance(x, dict):
            return None
        more = (name for name in x if name not in schema.get("properties", {}))
        return next((f for name in more if (f := self.fault(x[name], rest, (*at, name))) is not None), None)

    def _items(self, x: Any, part: Schema, schema: Schema, at: Place) -> Fault:
        if not isinstance(x, list):
            return None
        numbers = part.get("$ref") == "#/$defs/number"  # whole signals: looked at by their type alone
        for i, value in enumerate(x):
            if numbers and type(value) in (float, int):
                continue
            if (found := self.fault(value, part, (*at, i))) is not None:
                return found
        return None

    def _minitems(self, x: Any, least: int, schema: Schema, at: Place) -> Fault:
        return (at, f"has {len(x)} entries, {least} are needed") if isinstance(x, list) and len(x) < least else None

    def _maxitems(self, x: Any, most: int, schema: Schema, at: Place) -> Fault:
        return (at, f"has {len(x)} entries, at most {most} may be there") if isinstance(x, list) and len(x) > most else None

    def _minimum(self, x: Any, least: float, schema: Schema, at: Place) -> Fault:
        return (at, f"is {x!r}, less than {least:g}") if _TYPES["number"](x) and x < least else None

    def _maximum(self, x: Any, most: float, schema: Schema, at: Place) -> Fault:
        return (at, f"is {x!r}, more than {most:g}") if _TYPES["number"](x) and x > most else None

    def _exclusiveminimum(self, x: Any, least: float, schema: Schema, at: Place) -> Fault:
        return (at, f"is {x!r}, not above {least:g}") if _TYPES["number"](x) and not x > least else None

    def _pattern(self, x: Any, pattern: str, schema: Schema, at: Place) -> Fault:
        return (at, f"is {x!r:.40}, of another form") if isinstance(x, str) and re.search(pattern, x) is None else None

    def _anyof(self, x: Any, parts: Sequence[Schema], schema: Schema, at: Place) -> Fault:
        faults = [self.fault(x, part, at) for part in parts]
        # Of several, the fault that lies deepest is that of the part that was meant.
        return None if None in faults else max(filter(None, faults), key=lambda fault: len(fault[0]))

    def _oneof(self, x: Any, parts: Sequence[Schema], schema: Schema, at: Place) -> Fault:
        return self._anyof(x, parts, schema, at)

    def _allof(self, x: Any, parts: Sequence[Schema], schema: Schema, at: Place) -> Fault:
        return next((f for part in parts if (f := self.fault(x, part, at)) is not None), None)

    def _if(self, x: Any, condition: Schema, schema: Schema, at: Place) -> Fault:
        return None if self.fault(x, condition, at) is not None else self.fault(x, schema.get("then", True), at)

    def _then(self, x: Any, part: Schema, schema: Schema, at: Place) -> Fault:
        return None  # `if` asks it
