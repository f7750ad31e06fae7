"""Frequency responses that a record shows by itself: how many of their points stand above the coherence of chance.

Drives of two masses under noise of several sizes, driven by a torque or in a loop; and velocities that are noise alone.
"""

from __future__ import annotations

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga
from gaident.identification.response.averaged import measured_response, sampled_response

__all__ = ["responses", "shown_points"]

DT = 1e-3
NOISES = (0.05, 1.0, 20.0)  # rad/s


def responses(count: int, seed: int) -> list[Case]:
    made = [(there, noise) for there in (True, False) for noise in NOISES]
    return [Case("responses", f"{'drive' if there else 'noise alone'}/{noise:g}/{seed}/{n}", (there, noise), n + 1000 * seed)
            for n in range(count) for there, noise in made]  # fmt: skip


def shown_points(case: Case) -> Result:
    """Of a drive the points that are shown lie near its response; of noise alone a tenth of the points is shown at most."""
    there, noise = case.what
    rng = np.random.default_rng(case.number)
    model = ga.TwoMass(JM=2e-4, JL=6e-4, KG=15.0, DM=1e-3, DL=1e-3, DG=0.01).model()
    torque = np.repeat(rng.choice([-0.5, 0.5], 1500), 4)
    rec = ga.Record(DT, torque=torque, velocity=np.zeros(len(torque)))
    velocity = ga.simulate(model, rec) if there else np.zeros(len(torque))
    found = measured_response(rec.with_channels(velocity=velocity + noise * rng.standard_normal(len(torque))))
    shown = found.coherence > found.threshold
    truth = sampled_response(model, found.frequency[shown], DT)
    near = np.abs(found.value[shown] - truth) < 4.0 * found.std[shown] + 0.05 * np.abs(truth)
    if there:
        called = "missed" if not shown.any() else "right" if near.mean() > 0.9 else "wrong"
    else:
        called = "right" if shown.mean() <= 0.1 else "false alarm"
    return Result(called, f"{int(shown.sum())} of {len(shown)} points", digest(""))
