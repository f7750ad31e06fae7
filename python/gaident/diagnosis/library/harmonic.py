"""What returns with every turn of the shaft: torques, an inertia, and the ripple of an encoder; and what returns in time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library import triggers as t
from gaident.diagnosis.library.cause import AT_THE_SHAFT, NO_REVERSAL, Cause
from gaident.diagnosis.library.coordinates import HIGHEST_LOBE, HIGHEST_ORDER
from gaident.diagnosis.library.kinds import harmonic, tone
from gaident.policy.table import POLICY

__all__ = ["CAUSES"]

Vector = NDArray[np.float64]


def _behind_ripple(seen: Vector, velocity: Vector, values: Vector) -> Vector:
    """theta = theta_m - sum of a (sin(n theta + phase) - sin(phase)) over the waves, two rounds: a is small."""
    angle = seen
    for _ in range(2):
        before, angle = angle, seen
        for amplitude, order, phase in values.reshape(-1, 3):  # no decision: numbers of a wave
            angle = angle - amplitude * (np.sin(order * before + phase) - np.sin(phase))
    return angle


def _gravity_of_regression(values: Mapping[str, float]) -> dict[str, float] | None:
    if "gravity_amplitude" not in values:
        return None
    return {"amplitude": values["gravity_amplitude"], "phase": values["gravity_phase"]}


FREQUENCIES = 5000  # no decision: a formula: of a spectrum of 10 000 lines
"""How many a hum is the best of."""

CAUSES: tuple[Cause, ...] = (
    harmonic(
        "unbalance", "shaft", 1, False, "torque",
        domains=AT_THE_SHAFT,
        needs=(t.rotary, t.moves, t.part_of_a_turn),
        excited_by=("slow constant speeds", "holds up and down"),
        alike={NO_REVERSAL: ("torque once per turn",)},
        regressed=_gravity_of_regression,
    ),
    harmonic(
        "cogging", "shaft", 2, True, "torque",
        domains=AT_THE_SHAFT,
        orders=(2, HIGHEST_ORDER),
        alike={NO_REVERSAL: ("torque n times per turn",)},
        needs=(t.periodic, t.moves, t.period_of_an_order),
        unseen=t.orders_beyond,
        excited_by=("slow constant speeds",),
    ),
    harmonic(
        "velocity_ripple", "sensor", 1, True, "velocity",
        domains=AT_THE_SHAFT,
        orders=(1, HIGHEST_ORDER),
        seen_angle=_behind_ripple,
        needs=(t.periodic, t.moves, t.period_of_an_order),
        unseen=t.orders_beyond,
        excited_by=("slow constant speeds",),
    ),
    harmonic(
        "position_inertia", "mechanism", 1, True, "inertia",
        domains=AT_THE_SHAFT,
        excludes=frozenset({"extra_resonance"}),
        least=POLICY.inertia_share,
        orders=(1, HIGHEST_LOBE),
        needs=(t.periodic, t.moves, t.period_of_a_lobe),
        unseen=t.lobes_beyond,
        excited_by=("random signal at speed", "speeds mixed in time"),
    ),
    tone(
        "torque_hum",
        domains=frozenset({"time"}),
        orders=(1, FREQUENCIES),
        needs=(t.one_record, t.torque_commanded),
        unseen=t.frequencies_beyond,
        excited_by=("slow constant speeds",),
    ),
)  # fmt: skip
