"""What a model leaves in the lines of long records that no search has seen.

The records are predicted whole, in blocks whose start states are fitted, or in one run where the command drives the loop.
Of each piece of lines two figures are taken, of the errors before and behind the noise filter that was found:

    r = rms(piece)/max rms(pieces of the windows that were searched)

A piece is missed where either is above `noise_ratio`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, joined, say
from gaident.diagnosis.records.windows import blocks_over
from gaident.estimation.dataset import DataSet
from gaident.estimation.hypothesis import Fit, Hypothesis
from gaident.estimation.objective import LOST, Objective
from gaident.estimation.records.parted import parted
from gaident.estimation.records.places import Place
from gaident.policy.table import POLICY

__all__ = ["Beyond", "beyond_windows"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

TOGETHER = 8  # no decision: a block in memory: blocks that are predicted side by side
LEAD = 8  # no decision: of a block, the part before it in which what began in the middle of a motion settles
STATE_STEP = 1e-3  # no decision: the step of a difference, of the largest velocity
ROUNDS = 8  # no decision: of a solver: steps of Gauss and Newton to the start states, at most
SETTLED = 1e-6  # no decision: of a solver: where they end, of the largest velocity
TINY = 1e-300  # no decision: no division by 0


@dataclass(frozen=True, eq=False)
class Beyond:
    """error: of all lines, records one after the other [rad/s]; missed: pieces with how far each is missed, the worst first.

    words: what is said of both; none where all lines were searched.
    """

    error: Vector
    missed: tuple[tuple[Place, float], ...] = ()
    words: tuple[Text, ...] = ()


def beyond_windows(objective: Objective, final: Fit, whole: DataSet, kept: Sequence[NDArray[np.bool_]]) -> Beyond:
    """What a model that was found in windows leaves in all lines; kept: of each record, False for lines that are left out."""
    data = objective.data
    if not data.places:
        return Beyond(objective.error(final))
    everything = whole.aged(data.age, data.other_ages)
    inside = _pieces(objective, objective.error(final), final, data.places)
    most = np.max([r for _, r in inside], axis=0)
    errors = [np.zeros(len(r)) for r in whole.records]
    found: list[tuple[Place, float]] = []
    for seen, places, error, heads in _predicted(objective, final, everything, kept):
        at = 0
        for place, head in zip(places, heads, strict=True):
            lines = place.stop - place.start
            errors[place.at][place.start + head : place.stop] = error[at + head : at + lines]
            at += lines
        for place, figures in _pieces(seen, error, final, places, heads):
            found.append((place, float(np.max(figures / np.maximum(most, TINY)))))
    missed = sorted(
        ((p, r) for p, r in found if r > POLICY.noise_ratio and not any(_within(p, q) for q in data.places)),
        key=lambda pair: (-pair[1], pair[0]),
    )
    words = (_searched(data, whole), *_missed(missed, whole))
    return Beyond(errors[0] if len(errors) == 1 else np.concatenate(errors), tuple(missed), words)


def _within(piece: Place, window: Place) -> bool:
    return piece.at == window.at and window.start <= piece.start and piece.stop <= window.stop


def _missed(missed: Sequence[tuple[Place, float]], whole: DataSet) -> list[Text]:
    """Where a model misses the records, and by how much."""
    if not missed:
        return []
    share = sum(p.stop - p.start for p, _ in missed) / sum(whole.lengths)
    spans = sorted(_spans([p for p, _ in missed]), key=lambda p: p.start - p.stop)
    text = (
        "The model misses lines that were not searched: {:.3g} % of all, by errors up to {:.3g} times those of the searched "
        "ones, the longest of them {}. What happens there is not explained; diagnose these lines by themselves."
    )
    return [say(text, 100.0 * share, missed[0][1], joined(", ", [_span(whole, p) for p in spans[: POLICY.starts]]))]


def _searched(data: DataSet, whole: DataSet) -> Text:
    """How many lines were searched, and where."""
    lines, total = sum(data.lengths), sum(whole.lengths)
    if all(p.start == 0 for p in data.places):
        text = (
            "The search worked on {} of {} lines, from the beginning: the loop is simulated from rest only. The model was then "
            "compared with all lines."
        )
        return say(text, lines, total)
    text = (
        "The search worked on {} of {} lines, in {} windows that lie over all of them; the model was then compared with all "
        "lines."
    )
    return say(text, lines, total, len(data.places))


Predicted = tuple[Objective, Sequence[Place], Vector, Sequence[int]]


def _predicted(objective: Objective, final: Fit, whole: DataSet, kept: Sequence[NDArray[np.bool_]]) -> Iterator[Predicted]:
    """(objective over some lines, where they lie, raw error there, lines at the head of each that are not judged)."""
    data, starts = objective.data, final.parameters.starts
    own = final.x[: len(final.x) - sum(starts)]
    if final.predictor.closed or any(t.in_controller for t in final.parameters.terms):
        found = {p.at: part for p, part in zip(data.places, _split(final), strict=True)}
        parts = [found.get(at, np.zeros(0)) for at in range(len(whole.records))]
        velocity = {p.at: w for p, w in zip(data.places, data.begun, strict=True)}
        begun = tuple(velocity.get(at, 0.0) for at in range(len(parts)))
        states = replace(final.parameters, starts=tuple(map(len, parts)), begun=begun)
        hypothesis = Hypothesis(states, replace(final.predictor, data=whole))  # type: ignore[type-var]
        seen = Objective(whole, np.concatenate(kept).astype(np.float64), objective.family, counter=objective.counter)
        error = seen.errors(hypothesis, np.concatenate([own, *parts])[None, :])[0]
        yield seen, [Place(at, 0, len(r)) for at, r in enumerate(whole.records)], error, [0] * len(whole.records)
        return
    length = max(p.stop - p.start for p in data.places)
    blocks = blocks_over(whole, length)
    lead = length // LEAD
    longer = [p._replace(start=max(p.start - lead, 0)) for p in blocks]
    order = final.parameters.linear(final.x).order
    for first in range(0, len(blocks), TOGETHER):
        places = longer[first : first + TOGETHER]
        part = parted(whole, places)
        weight = np.concatenate([kept[p.at][p.start : p.stop] for p in places]).astype(np.float64)
        seen = Objective(part, weight, objective.family, counter=objective.counter)
        error = _with_starts(seen, final, own, order)
        yield seen, places, error, [b.start - p.start for b, p in zip(blocks[first : first + TOGETHER], places, strict=True)]


def _with_starts(objective: Objective, final: Fit, own: Vector, order: int) -> Vector:
    """The raw error under the start states that come closest, each of its own block."""
    data = objective.data
    states = replace(final.parameters, starts=tuple(order if m else 0 for m in data.moving), begun=data.begun)
    hypothesis = Hypothesis(states, replace(final.predictor, data=data))  # type: ignore[type-var]
    moving = [i for i, m in enumerate(data.moving) if m]
    z, steps = np.zeros((len(moving), order)), np.zeros((len(moving), order))
    ends = np.cumsum((0, *data.lengths))
    h = STATE_STEP * final.parameters.scales.speed

    def error(moved: Sequence[Matrix]) -> Matrix:
        return objective.errors(hypothesis, np.array([np.concatenate([own, s.ravel()]) for s in moved]))

    for _ in range(ROUNDS if moving and order else 0):
        E = error([z, *(z + h * np.eye(order)[k] for k in range(order))])
        if np.max(np.abs(E)) >= LOST:
            break
        V = objective.bridged(E) * objective.counted
        for row, i in enumerate(moving):
            v = V[:, ends[i] : ends[i + 1]]
            slopes = (v[1:] - v[0]) / h
            steps[row] = np.linalg.lstsq(slopes.T, v[0], rcond=1e-9)[0]
        z = z - steps
        if np.max(np.abs(steps)) < SETTLED * final.parameters.scales.speed:
            break
    return np.asarray(error([z])[0])


def _split(final: Fit) -> list[Vector]:
    """The start states of each window."""
    starts = final.parameters.starts
    return np.split(final.x[len(final.x) - sum(starts) :], np.cumsum(starts)[:-1])


def _pieces(
    objective: Objective, error: Vector, final: Fit, places: Sequence[Place], heads: Sequence[int] | None = None
) -> list[tuple[Place, Vector]]:
    """Pieces of lines, each with the rms of its error before and behind the noise filter."""
    E = error[None, :]
    inertias = objective.inertias(final.hypothesis, final.x[None, :])
    rows = np.vstack([objective.bridged(E), objective.whitened(E, final.noise, inertias)]) ** 2 * objective.counted
    found, at = [], 0
    for place, head in zip(places, heads or [0] * len(places), strict=True):
        lines = place.stop - place.start
        count = max((lines - head) // POLICY.missed_lines, 1)
        ends = np.linspace(head, lines, count + 1).astype(int)
        sums = np.add.reduceat(np.vstack([rows, objective.counted])[:, at : at + lines], ends[:-1], axis=1)
        for start, stop, column in zip(ends[:-1].tolist(), ends[1:].tolist(), sums.T, strict=True):
            if column[2] > 0.5 * (stop - start):  # no decision: a formula: most of its lines
                piece = Place(place.at, place.start + start, place.start + stop)
                found.append((piece, np.sqrt(np.where(np.isfinite(column[:2]), column[:2], LOST) / column[2])))
        at += lines
    return found


def _spans(pieces: Sequence[Place]) -> list[Place]:
    """Pieces that follow each other as one."""
    spans: list[Place] = []
    for p in sorted(pieces):
        if spans and spans[-1].at == p.at and spans[-1].stop >= p.start:
            spans[-1] = spans[-1]._replace(stop=max(p.stop, spans[-1].stop))
        else:
            spans.append(p)
    return spans


def _span(data: DataSet, place: Place) -> Text:
    name = data.records[place.at].name
    text = say("{:.6g} s to {:.6g} s", place.start * data.dt, place.stop * data.dt)
    return say("{} of {}", text, name) if name and len(data.records) > 1 else text
