"""Several axes of one log, read in one call."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gaident.data.assemble import assemble
from gaident.data.formats.delimited import TextOptions
from gaident.data.formats.frames import is_frame
from gaident.data.formats.units import QUANTITIES
from gaident.data.readers import open_log
from gaident.data.record import Record
from gaident.data.wanted import wanted_of
from gaident.errors import ReadError, RecordError

__all__ = ["read_axes"]

CHANNEL_BY_CHANNEL = ("columns", "units", "shift")
"""Arguments that are mappings, of which an axis may have a part of its own."""


def read_axes(path: str | os.PathLike[str] | Any, axes: Mapping[str, Mapping[str, Any]], **common: Any) -> dict[str, Record]:
    """Read several axes of one log, each to a Record, in the order given.

    Parameters
    ----------
    path : str, path-like or pandas.DataFrame
        As in `read`; the log is opened once.
    axes : mapping of str to mapping
        Name of the axis -> channel -> column, as `columns` of `read` takes them, for example
        ``{"x": {"velocity": "axis1.w", "torque": "axis1.u"}, "y": {...}}``.
        Beside the channels stand arguments of `read` that hold for this axis alone:
        ``"units"``, ``"counts_per_turn"``, ``"gear_ratio"``, ...
    **common : Any
        Arguments of `read` that hold for all: ``columns`` (``{"time": "t"}``), ``units``, ``dt``, ``decimate``, ...
        An axis's own come before them, those of mappings channel by channel.

    Returns
    -------
    dict of str to Record
        Records of one sample time; each is named "LOG AXIS", or as its own ``"name"`` says.

    Raises
    ------
    ReadError, RecordError
        As `read`, with the axis in front.

    Examples
    --------
    >>> import pandas as pd
    >>> import numpy as np
    >>> import gaident as ga
    >>> t = 1e-3 * np.arange(100)
    >>> log = pd.DataFrame({"t": t, "a1.n": 60 * t, "a1.M": 0 * t + 0.5, "a2.n": -30 * t, "a2.M": 0 * t - 0.25})
    >>> axes = {"x": {"velocity": "a1.n", "torque": "a1.M"}, "y": {"velocity": "a2.n", "torque": "a2.M"}}
    >>> found = ga.read_axes(log, axes, columns={"time": "t"}, units={"velocity": "rpm"})
    >>> {name: round(float(rec.velocity[-1]), 3) for name, rec in found.items()}
    {'x': 0.622, 'y': -0.311}
    """
    if not isinstance(axes, Mapping) or not axes or not all(isinstance(own, Mapping) for own in axes.values()):
        raise ReadError(f"axes={axes!r:.80} is no mapping of axes; give axes={{'x': {{'velocity': 'axis1.w', ...}}, ...}}")
    for key in CHANNEL_BY_CHANNEL:
        for given, where in ((common, ""), *((own, f"axis {name!r}: ") for name, own in axes.items())):
            value = given.get(key)
            if value is not None and not isinstance(value, Mapping):
                raise ReadError(f"{where}{key} is {value!r:.80}: give a mapping of channels, {{'velocity': ...}}, or None")
    text = {key: common.pop(key, None) for key in TextOptions.__dataclass_fields__}
    found = {}
    with open_log(path, TextOptions(**text)) as table:
        stem = "" if is_frame(path) else Path(path).stem
        for name, own in axes.items():
            asked = dict(common) | {key: value for key, value in own.items() if key not in QUANTITIES}
            for key in CHANNEL_BY_CHANNEL:
                asked[key] = {**(common.get(key) or {}), **(own.get(key) or {})} or None
            asked["columns"] = {**(asked["columns"] or {}), **{k: v for k, v in own.items() if k in QUANTITIES}} or None
            try:
                found[name] = assemble(table, wanted_of(**asked), f"{stem} {name}".strip())
            except TypeError as error:
                raise ReadError(f"axis {name!r}: {str(error).partition(' ')[2]}; give channels, and arguments of read") from None
            except (ReadError, RecordError) as error:
                raise type(error)(f"axis {name!r}: {error.marked}") from None
    return found
