"""Coarse to fine: which part of long records the search looks at.

A search needs samples that carry excitation rather than all there are.
It runs on one window of each of the records that move most, some ten thousand samples together;
what it finds is then fitted, compared and judged on all samples (`identify`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.policy.table import POLICY

__all__ = ["search_parts"]


def search_parts(records: Sequence[Record], controller: PI | None, moving: Sequence[bool]) -> list[tuple[Record, bool]]:
    """(part of a record, whether it starts in motion) for the search; records of no more than twice the part are taken whole."""
    total = sum(len(r) for r in records)
    budget = min(max(POLICY.searched_samples, total // POLICY.searched_share), POLICY.most_samples)
    if total <= 2 * budget:
        return list(zip(records, moving, strict=True))
    length = max(POLICY.searched_samples // 2, budget // len(records))
    windows = [_window(r, controller, m, length) for r, m in zip(records, moving, strict=True)]
    parts: list[tuple[Record, bool]] = []
    taken = 0
    # sorted() keeps the order of equals: the result does not depend on chance.
    for _, start, stop, i in sorted(((*w, i) for i, w in enumerate(windows)), key=lambda w: -w[0]):
        if taken >= budget:
            break
        parts.append((records[i][start:stop], moving[i] if start == 0 else True))
        taken += stop - start
    return parts


def _window(rec: Record, controller: PI | None, moving: bool, length: int) -> tuple[float, int, int]:
    """(rank among records, first sample, end) of the window of a record that is excited most.

    Excitation: changes of the input and spread of the velocity, each relative to the most in this record.
    A start at rest needs no unknown state and is taken already for half of the most.
    Records are ranked by the variance of the velocity in their window.
    A window begins at a whole number of its `grid` equal blocks.
    """
    source = rec.torque if controller is None else rec.command
    assert source is not None  # checked on entry to identify()
    if len(rec) <= length:
        return float(np.var(rec.velocity)), 0, len(rec)
    block = length // POLICY.grid
    edges = range(0, len(rec) - block + 1, block)
    changes = np.array([np.sum(np.diff(source[a : a + block + 1]) ** 2) for a in edges])
    sums = np.array([np.sum(rec.velocity[a : a + block]) for a in edges])
    squares = np.array([np.sum(rec.velocity[a : a + block] ** 2) for a in edges])
    over = [np.convolve(x, np.ones(POLICY.grid), "valid") for x in (changes, sums, squares)]
    spread = np.maximum(over[2] - over[1] ** 2 / (block * POLICY.grid), 0.0)
    score = _relative(over[0]) + _relative(spread)
    best = int(np.argmax(score))
    if not moving and score[0] >= POLICY.from_rest * score[best]:
        best = 0
    start = best * block
    return float(np.var(rec.velocity[start : start + length])), start, start + length


def _relative(x: NDArray[np.float64]) -> NDArray[np.float64]:
    top = float(x.max())
    return x / top if top > 0.0 else x
