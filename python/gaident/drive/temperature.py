"""The temperature of a log: a column beside the channels of its record, in its own unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.readers import read_columns
from gaident.errors import ReadError

__all__ = ["temperature_of"]

TEXT = ("delimiter", "decimal", "skip", "encoding")


def temperature_of(log: str, name: str, general: Mapping[str, Any]) -> NDArray[np.float64]:
    """The values of a column that are known, in the order of the log; general: how it is read, as a drive file has it.

    Raises ReadError where there is no such column.
    """
    found = read_columns(log, **{key: general[key] for key in TEXT if key in general})
    values = found.get(name)
    if values is None:
        values = {column.split(" [")[0]: of for column, of in found.items()}.get(name)
    if values is None:
        raise ReadError(f"{log}: there is no column {name!r} with the temperature; it has {', '.join(found)}")
    return np.asarray(values[np.isfinite(values)], dtype=np.float64)
