"""Velocities that are the difference of an encoder's angle: how many lines of a turn their lattice shows.

Encoders with 2^n lines, with others, and lattices that are those of no encoder (behind a gear, beside a power of two by a share).
Each is logged as it is and with few decimals of rpm.
"""

from __future__ import annotations

import numpy as np
from rows.case import Case, Result, digest

from gaident.data.signals.lattice import encoder_lines

__all__ = ["encoders", "lines_shown"]

TURN, RPM = 2.0 * np.pi, np.pi / 30.0
BITS, OTHERS = (12, 14, 17, 20, 22), (10_000, 16_380, 20_000, 36_000, 65_500)
BESIDE = (5e-5, 2e-4, 3e-4, 1e-3)  # of a power of two, on either side
PERIODS, DECIMALS = (125e-6, 1e-3), (None, 5, 3, 2)


def encoders(count: int, seed: int) -> list[Case]:
    drawn = [(2.0**n, 0.0) for n in BITS] + [(float(n), 0.0) for n in OTHERS] + [(2.0**18, share) for share in BESIDE]
    made = [(n, share, T, decimals) for n, share in drawn for T in PERIODS for decimals in DECIMALS]
    return [Case("encoder", f"{n:g}/{share:g}/{T:g}/{decimals}/{seed}/{k}", (n, share, T, decimals), k + 1000 * seed)
            for k in range(count) for n, share, T, decimals in made]  # fmt: skip


def lines_shown(case: Case) -> Result:
    """No lines are expected of a lattice whose lines are no whole number; of few decimals none need show."""
    lines, share, T, decimals = case.what
    rng = np.random.default_rng([case.number, int(lines)])
    q = TURN / (lines * (1.0 + share * rng.choice([-1.0, 1.0])))
    t = T * np.arange(3000)
    swing = rng.uniform(0.05, 0.1) * np.sin(TURN * rng.uniform(0.5, 2.0) / t[-1] * t)
    angle = swing + np.cumsum(rng.normal(0.0, 3.0 * q, len(t)))
    w = np.diff(np.floor(angle / q)) * q / T
    w = w if decimals is None else np.round(w / RPM, decimals) * RPM
    found = encoder_lines(w, T, TURN)
    truth = 0 if share else round(lines)
    called = "right" if found == truth else "missed" if not found else "wrong" if truth else "false alarm"
    return Result(called, str(found), digest(""))
