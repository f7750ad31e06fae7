"""A beam search over a graph of models.

A model is grown by moves that add, and reduced by moves that drop or replace.
Each model has a score, the lower the better, which contains a penalty for every effect.
So all moves are decided by the same comparison.
The search continues with the best few models: of two causes at once, each alone may explain less than a third effect does.

This file knows neither effects nor records: its tests run it on a counting problem.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

__all__ = ["Beam", "reduced"]

STEPS = 32  # no decision: each step of a reduction drops an effect or is better; the bound guards against a cycle of equals

State = TypeVar("State")
Move = Callable[[State], Iterable[State]]


@dataclass(frozen=True)
class Beam(Generic[State]):
    """A search.

    score: the lower the better. key: the same for the same model, whatever its parameters. grow: models with one effect more,
    best first. worth(fuller, simpler): the decision whether a grown model is worth what it adds. reduce: moves to other models;
    prefers(other, model): whether the other one takes the model's place. search: the same model again, with more effort; asked
    for once of each model that leads. leaves_noise(model): whether a model does, so that no other way to explain the same is
    followed. size: effects in a model; most: at most. width, reach: how many models are carried on, and how far behind the
    best. margin: within which the smaller model is taken.
    """

    score: Callable[[State], float]
    key: Callable[[State], Hashable]
    grow: Move[State]
    reduce: Sequence[Move[State]]
    worth: Callable[[State, State], bool]
    prefers: Callable[[State, State], bool]
    search: Callable[[State], State]
    leaves_noise: Callable[[State], bool]
    size: Callable[[State], int]
    most: int
    width: int
    reach: float
    margin: float

    def run(self, starts: Sequence[State]) -> State:
        """The model that the search ends with.

        The best model is grown until nothing that it grows to is worth it.
        Where it does not leave noise, the others of the beam are grown then: one of them may lead further.
        """
        beam = self._best(starts)
        grown: set[Hashable] = set()
        searched: set[Hashable] = set()
        while True:
            wanted = [s for s in beam if self.key(s) not in grown and self.size(s) < self.most]
            leads = wanted and wanted[0] is beam[0]
            if not wanted or not (leads or not self.leaves_noise(beam[0])):
                break
            grown.add(self.key(wanted[0]))
            found = self.children(wanted[0])
            if not found:
                continue
            beam = self._best([*beam, *found])
            if self.key(beam[0]) not in searched:
                searched.add(self.key(beam[0]))
                beam = self._best([*beam, self.search(beam[0])])
        near = [s for s in beam if self.score(s) <= self.score(beam[0]) + self.margin]
        return min(near, key=lambda s: (self.size(s), self.score(s)))

    def children(self, state: State) -> list[State]:
        """What a model is grown to, each reduced; only those that are worth what they add."""
        found: list[State] = []
        for child in self.grow(state):
            if len(found) == self.width:
                break
            if self.worth(child, state):
                child = reduced(child, self.reduce, self.prefers, self.score)
                if self.score(child) < self.score(state):
                    found.append(child)
        return found

    def _best(self, states: Sequence[State]) -> list[State]:
        """Of each model the best, the best `width` within reach."""
        best: dict[Hashable, State] = {}
        for s in sorted(states, key=self.score):
            best.setdefault(self.key(s), s)
        kept = list(best.values())[: self.width]
        return [s for s in kept if self.score(s) <= self.score(kept[0]) + self.reach]


def reduced(
    state: State, moves: Sequence[Move[State]], prefers: Callable[[State, State], bool], score: Callable[[State], float]
) -> State:
    """The model after every reduction that is preferred, until there is none."""
    for _ in range(STEPS):
        for move in moves:
            tries = [other for other in move(state) if prefers(other, state)]
            if tries:
                state = min(tries, key=score)
                break
        else:
            break
    return state
