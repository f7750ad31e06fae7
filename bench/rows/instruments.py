"""Frequency responses of records under commands of many kinds: whether the stated deviations hold, and where none is given.

A drive of two masses in a loop and in open loop, under noise of two sizes.
Right: errors over deviations have an rms of 0.6 to 1.6, as of few frequencies; refused: fewer than eight frequencies are left.
"""

from __future__ import annotations

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga
from gaident.errors import RecordError
from gaident.identification.response.averaged import sampled_response

__all__ = ["instruments", "shown_response"]

DT = 1e-3
NOISES = (0.1, 3.0)  # rad/s
COMMANDS = (
    "periods",
    "periods of few digits",
    "two periods",
    "one period",
    "no common period",
    "chirp",
    "steps",
    "PRBS",
    "moves",
)


def instruments(count: int, seed: int) -> list[Case]:
    cells = [(name, noise, closed) for name in COMMANDS for noise in NOISES for closed in (True, False)]
    return [Case("instruments", f"{what[0]}/{what[1]:g}/{'loop' if what[2] else 'open'}/{seed}/{n}", what, n + 1000 * seed)
            for n in range(count) for what in cells]  # fmt: skip


def command(name: str, rng: np.random.Generator) -> np.ndarray:
    """rad/s, of 1 to 8 s."""
    t = np.arange(8000) * DT
    lines = np.arange(2, 400, 3)
    phases = rng.uniform(0.0, 2.0 * np.pi, lines.size)
    periods = 0.8 * np.cos(2.0 * np.pi * np.outer(t, lines) + phases).sum(axis=1)
    if name == "no common period":
        f = np.geomspace(1.03, 390.0, 60) * (1.0 + 0.01 * rng.standard_normal(60))
        return 0.8 * np.cos(2.0 * np.pi * np.outer(t, f) + phases[:60]).sum(axis=1)
    if name == "moves":
        speeds = np.repeat(rng.uniform(-25.0, 25.0, 11), 2)[:-1]
        return np.interp(np.arange(5000), np.cumsum([0, *rng.integers(60, 400, 20)]), speeds)
    return {
        "periods": periods,
        "periods of few digits": np.round(periods, 3),
        "two periods": periods[:2500],
        "one period": periods[:1000],
        "chirp": 8.0 * np.sin(2.0 * np.pi * (1.0 + 399.0 / 16.0 * t) * t),
        "steps": np.repeat(rng.uniform(-20.0, 20.0, 40), 100),
        "PRBS": 20.0 * np.repeat(rng.choice([-1.0, 1.0], 2000), 4),
    }[name]


def shown_response(case: Case) -> Result:
    """A record's response against the drive's."""
    name, noise, closed = case.what
    rng = np.random.default_rng(case.number)
    model = ga.TwoMass(JM=2e-4, JL=3e-4, KG=12.0, DM=1e-3, DL=1e-3, DG=2e-3).model()
    r = command(name, rng)
    n, still, loop = noise * rng.standard_normal(len(r)), np.zeros(len(r)), ga.PI(kp=0.02, ki=0.4)
    if closed:
        done = ga.run(model, ga.Record(DT, command=r - n, velocity=still), loop)
        rec = ga.Record(DT, command=r, velocity=done.velocity + n, torque=done.torque)
    else:
        rec = ga.Record(DT, torque=r / 16.0, velocity=ga.simulate(model, ga.Record(DT, torque=r / 16.0, velocity=still)) + n)
    try:
        fr = ga.frequency_response(rec, loop if closed else None)
    except RecordError as error:
        return Result("refused", str(error).partition(": ")[2], digest(str(error)))
    off = np.abs(fr.response - sampled_response(model, fr.frequency_hz, DT)) / fr.std
    size = float(np.sqrt(np.mean(off**2)))
    # no decision: of few frequencies the rms of errors over deviations lies so far from 1
    called = "right" if 0.6 < size < 1.6 else "wrong"
    return Result(
        called, f"{len(fr)} frequencies, {fr.frequency_hz[0]:.3g} to {fr.frequency_hz[-1]:.3g} Hz", digest(f"{size:.6g}")
    )
