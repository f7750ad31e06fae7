"""Which lines of long records a search works on: windows that lie over all of them, each in motion of another kind."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.dataset import DataSet
from gaident.estimation.objective import Objective
from gaident.estimation.records.driven import torque_in
from gaident.estimation.records.parted import parted
from gaident.estimation.records.places import Place
from gaident.models.starts import noise_std
from gaident.policy.table import POLICY

__all__ = ["blocks_over", "searched_in"]

Vector = NDArray[np.float64]


def searched_in(data: DataSet, kept: Sequence[NDArray[np.bool_]], first: Sequence[Place] = ()) -> Objective:
    """The objective over the lines that a search works on. kept: of each record, False for lines that are left out.

    first: lines that are in windows in any case.
    """
    places = _places(data, first)
    if not places:
        return Objective(data, np.concatenate(kept).astype(np.float64))
    lines = np.concatenate([kept[p.at][p.start : p.stop] for p in places])
    return Objective(parted(data, places), lines.astype(np.float64))


def _places(data: DataSet, first: Sequence[Place]) -> tuple[Place, ...]:
    """The windows that a search works on; empty where it works on all lines.

    Where the logged torque tells what drove the axis, a window may begin in the middle of a motion.
    Else only the loop can drive a model, or what the integrator stored is not known: it begins where the record does.
    """
    if sum(map(len, data.records)) <= POLICY.whole_samples:
        return ()
    told = data.torque_logged and data.found is None and not data.slower
    return _spread(data, first) if told else _begun(data)


def _begun(data: DataSet) -> tuple[Place, ...]:
    """The beginning of each record, where a loop is simulated from; all of them as many lines as a search works on at most."""
    share = max(POLICY.diagnosed_samples // len(data.records), POLICY.least_samples)
    order = np.argsort([len(r) for r in data.records], kind="stable")
    places, left = [], POLICY.diagnosed_samples
    for count, at in enumerate(order.tolist()):
        lines = min(len(data.records[at]), max(left // (len(order) - count), min(share, left)))
        if lines >= POLICY.least_samples:
            places.append(Place(at, 0, lines))
            left -= lines
    return tuple(sorted(places))


def blocks_over(data: DataSet, length: int) -> tuple[Place, ...]:
    """All lines of the records, in blocks of this length at most."""
    places = []
    for at, rec in enumerate(data.records):
        count = -(-len(rec) // length)
        ends = np.linspace(0, len(rec), count + 1).astype(int).tolist()
        places += [Place(at, start, stop) for start, stop in pairwise(ends)]
    return tuple(places)


def _spread(data: DataSet, first: Sequence[Place]) -> tuple[Place, ...]:
    """Windows that a search works on, chosen by what the axis does in them; first: those that are taken in any case.

    The beginning, the end, the fastest motion, the largest torque, the most reversals, the slowest motion; the rest evenly.
    The same data in two records is taken once.
    """
    once = {r.digest: at for at, r in reversed(list(enumerate(data.records)))}
    blocks = [p for p in blocks_over(data, POLICY.diagnosed_samples // POLICY.windows) if p.at in once.values()]
    count = max(POLICY.diagnosed_samples // max(p.stop - p.start for p in blocks), 1)
    seen = np.array([_seen(data, p) for p in blocks])
    ranked = [0, len(blocks) - 1, *(int(np.argmax(column)) for column in seen.T)]
    evenly = np.linspace(0, len(blocks) - 1, count).round().astype(int).tolist()
    asked = [b for p in first for b in blocks if b.at == p.at and b.start < p.stop and p.start < b.stop]
    chosen = dict.fromkeys([*list(dict.fromkeys(asked))[: count // 2], *(blocks[i] for i in ranked)])
    taken = list(chosen)[:count]
    for i in _farthest_first(evenly, len(blocks)):
        if len(taken) < count and blocks[i] not in taken:
            taken.append(blocks[i])
    return tuple(sorted(taken))


def _farthest_first(chosen: Sequence[int], count: int) -> list[int]:
    """Places among so many, in an order in which any number of the first ones lies over all of them; then all others."""
    order: list[int] = []
    rest = list(dict.fromkeys(chosen))
    while rest:
        far = max(rest, key=lambda i: (min((abs(i - j) for j in order), default=count), -i))
        order.append(far)
        rest.remove(far)
    return [*order, *(i for i in range(count) if i not in set(order))]


def _seen(data: DataSet, place: Place) -> tuple[float, float, float, float]:
    """(highest speed, largest torque, reversals, slowness of the motion) in a window."""
    lines = slice(place.start, place.stop)
    w, u = data.records[place.at].velocity[lines], torque_in(data.driven[place.at])[lines]
    sign = np.sign(w) * (np.abs(w) > POLICY.standing_noise * noise_std(w))
    sign = sign[sign != 0.0]
    moving = np.abs(w) > POLICY.standing_share * float(np.sqrt(np.mean(w**2)))
    slow = -float(np.median(np.abs(w))) if len(sign) and np.any(moving) else -np.inf
    return float(np.abs(w).max()), float(np.abs(u).max()), float(np.count_nonzero(np.diff(sign))), slow
