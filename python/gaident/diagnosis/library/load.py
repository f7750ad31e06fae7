"""Torques of the load that do not turn with the shaft."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gaident.diagnosis.library import triggers as t
from gaident.diagnosis.library.cause import AT_THE_SHAFT, NO_REVERSAL, Cause
from gaident.diagnosis.library.kinds import linear

__all__ = ["CAUSES"]


def _load_of_regression(values: Mapping[str, float]) -> dict[str, float] | None:
    return {"torque": values["offset"]} if "offset" in values else None


CAUSES: tuple[Cause, ...] = (
    linear(
        "load_torque", "torque", lambda s: -s.torque, lambda s: s.torque,
        lambda s: tuple(f * s.torque for f in (-0.1, -0.02, 0.02, 0.1)), lambda s: 0.02 * s.torque,
        constant=True,
        domains=AT_THE_SHAFT,
        curve=lambda w, p: np.full_like(w, -p["torque"]),
        excited_by=("holds up and down",),
        alike={NO_REVERSAL: ("constant torque",)},
        regressed=_load_of_regression,
        unseen=t.loaded_before,
    ),
)  # fmt: skip
