"""What a record's sample time, channels and kind of torque have to be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.checks import one_of
from gaident.data.signals.arrays import positive_number
from gaident.data.torque_kind import COMMANDED, TORQUE_KINDS
from gaident.errors import RecordError

__all__ = ["equally_long", "sample_time", "torque_kind"]


def sample_time(dt: object) -> float:
    """The sample time [s], once it is a number above 0. Raises RecordError."""
    return positive_number(dt, "dt", "s", f"give the sample time in seconds, for example {arg('dt', '1e-3')}")


def torque_kind(torque_is: object, torque: NDArray[np.float64] | None) -> str:
    """What the torque is, once it is one of the two and there is a torque. Raises RecordError."""
    kind = one_of(torque_is, "torque_is", TORQUE_KINDS, RecordError)
    if kind != COMMANDED and torque is None:
        raise RecordError(f"torque_is={kind!r}, but the record has no torque; give torque=, or leave torque_is out")
    return kind


def equally_long(channels: dict[str, NDArray[np.float64] | None]) -> dict[str, NDArray[np.float64] | None]:
    """The channels, once they are. Raises RecordError."""
    lengths = {key: len(values) for key, values in channels.items() if values is not None}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{key} {length}" for key, length in lengths.items())
        raise RecordError(
            f"the channels have unequal lengths ({listed} samples); cut them to the same samples, "
            "or, where they come from two clocks, bring two records together with align"
        )
    return channels
