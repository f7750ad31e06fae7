"""What happens to the torque between the controller and the shaft."""

from __future__ import annotations

import numpy as np

from gaident.diagnosis.library import triggers as t
from gaident.diagnosis.library.cause import NO_REVERSAL, OF_THE_TORQUE, ONE_SIZE_UNLOGGED, Cause
from gaident.diagnosis.library.kinds import single

__all__ = ["CAUSES"]

CAUSES: tuple[Cause, ...] = (
    single(
        "torque_saturation", "actuator", "limit", lambda s: 0.01 * s.torque, lambda s: 1.0 * s.torque,
        lambda s: tuple(s.torque * np.array([0.97, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2])),
        domains=OF_THE_TORQUE,
        needs=(t.torque_changes,),
        unseen=t.torque_beyond,
        at_peaks=True,
        excited_by=("steps of three sizes",),
        alike={ONE_SIZE_UNLOGGED: ("limit",)},
    ),
    single(
        "torque_dead_band", "actuator", "width", lambda s: 1e-4 * s.torque, lambda s: 0.7 * s.torque,
        lambda s: tuple(s.torque * np.geomspace(0.003, 0.3, 7)),
        domains=OF_THE_TORQUE,
        needs=(t.torque_near_zero,),
        from_nothing=True,
        excited_by=("slow stairs", "reversals", "random signal at standstill", "creep below break-away"),
        alike={NO_REVERSAL: ("constant torque",)},
    ),
    single(
        "transport_delay", "actuator", "delay", lambda s: 0.02 * s.log_dt, lambda s: 10.0 * s.log_dt,
        lambda s: tuple(s.log_dt * np.array([0.3, 0.7, 1.0, 1.5, 2.2, 3.2, 4.5, 7.0])),
        needs=(t.torque_changes,),
        from_nothing=True,
        excited_by=("random signal at speed",),
    ),
    single(
        "torque_lag", "actuator", "time_constant", lambda s: 0.02 * s.log_dt, lambda s: 30.0 * s.log_dt,
        lambda s: tuple(s.log_dt * np.geomspace(0.25, 16.0, 6)),
        needs=(t.torque_changes,),
        from_nothing=True,
        excited_by=("random signal at speed",),
    ),
)  # fmt: skip
