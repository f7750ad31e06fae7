"""Methods of records, models and results whose work stands in a higher room, and the winding that a reader estimates.

`model.to_c(...)`, `idn.plot()` and `dia.summary()` belong to the object that a user has, but what they do is the work of rooms
that stand above it: export, text, pictures, the report.
A lower room imports no higher one.
It asks for the function by its name here, `provided("write_c")`, and the composition root, gaident/__init__.py, says in one
table where each name is found.
The module is imported when its function is first asked for.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["picture", "provide", "provided"]

_PLACES: dict[str, str] = {}


def provide(places: Mapping[str, str]) -> None:
    """Adds names, each with its place "module:function"."""
    _PLACES.update(places)


def provided(name: str) -> Callable[..., Any]:
    """The function that stands behind a name; raises LookupError for a name that nothing provides."""
    if name not in _PLACES:
        raise LookupError(f"{name!r} is provided by nothing: give it a place in gaident/__init__.py")
    module, function = _PLACES[name].split(":")
    found: Callable[..., Any] = getattr(importlib.import_module(module), function)
    return found


def picture(name: str, *values: object, **named: object) -> Figure:
    """What a function that draws makes of these values."""
    figure: Figure = provided(name)(*values, **named)
    return figure
