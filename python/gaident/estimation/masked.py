"""Samples that are left out, and the straight lines over them: a filter that runs over a record sees no gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Bridges"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Bridges:
    """Where lines stand in for samples, of records in one row.

    gaps: masked samples. before, after: the samples of their record that count before and after each. share: its place between
    these two, from 0 to 1. blank: samples of records in which none counts.
    """

    gaps: Index
    before: Index
    after: Index
    share: Vector
    blank: Index

    @classmethod
    def of(cls, weight: Vector, lengths: Sequence[int]) -> Bridges:
        """Those over the samples of weight 0, of records of these lengths."""
        gaps, before, after, blank = ([np.zeros(0, dtype=np.intp)] for _ in range(4))
        first = 0
        for n in lengths:
            counts = weight[first : first + n] > 0.0
            known, masked = first + np.flatnonzero(counts), first + np.flatnonzero(~counts)
            first += n
            if len(known) == 0:
                blank.append(masked)
                continue
            right = np.searchsorted(known, masked)
            gaps.append(masked)
            before.append(known[np.maximum(right - 1, 0)])
            after.append(known[np.minimum(right, len(known) - 1)])
        left, right = np.concatenate(before), np.concatenate(after)
        masked = np.concatenate(gaps)
        share = np.clip((masked - left) / np.maximum(right - left, 1), 0.0, 1.0)
        return cls(masked, left, right, share, np.concatenate(blank))

    def over(self, E: Matrix) -> Matrix:
        """Rows with a straight line over the masked samples of each record.

        At a record's ends its nearest sample that counts goes on; a record of which none counts is 0.
        """
        if len(self.gaps) == 0 and len(self.blank) == 0:
            return E
        E = E.copy()
        E[:, self.gaps] = E[:, self.before] + self.share * (E[:, self.after] - E[:, self.before])
        E[:, self.blank] = 0.0
        return E
