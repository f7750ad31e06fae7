"""Gains that are proposed for random drives (bench/loops/retune.py), and whether the true drive keeps what was asked for."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "loops"))

import retune
from rows.case import Case, Result, digest

__all__ = ["gains_kept", "retuned"]


def retuned(count: int, seed: int) -> list[Case]:
    each = len(retune.HIDDEN)
    return [Case("retuned", f"{n}/{seed}", n, seed) for n in range(count * each)]


def gains_kept(case: Case) -> Result:
    """Right: both margins are kept, by a loop that is stiffer or settles sooner; in set: by one that does not."""
    found = retune.measured(case.what, case.number)
    kept = found["stable"] and found["phase"] >= found["asked"][0] and found["gain"] >= found["asked"][1]
    better = found["stiffness"][1] > found["stiffness"][0] or found["settling"][1] < found["settling"][0]
    said = f"{'keeps' if kept else 'misses'} the margins, {'better' if better else 'no better'}"
    called = "right" if kept and better else "in set" if kept else "wrong" if not found["doubts"] else "missed"
    return Result(called, said, digest([f"{x:.3g}" for x in found["gains"]]))
