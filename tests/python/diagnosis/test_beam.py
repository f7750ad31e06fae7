"""The beam search, on a counting problem: a state is a set of numbers, and nothing is simulated."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import pytest

from gaident.diagnosis.selection.beam import Beam, reduced

State = frozenset[int]
COST = 1.0  # of each number in a set


def state(*numbers: int) -> State:
    return frozenset(numbers)


def scored(explained: dict[State, float]) -> Callable[[State], float]:
    """The cost of a set's numbers, less what each of its subsets explains."""
    return lambda s: COST * len(s) - sum(worth for part, worth in explained.items() if part <= s)


def drop(s: State) -> list[State]:
    return [s - {n} for n in sorted(s)]


@dataclass
class Counting:
    """Numbers up to `top` and what they explain; `asked`: the sets that were grown, `searched`: those searched again."""

    explained: dict[State, float]
    top: int = 5

    def __post_init__(self) -> None:
        self.score = scored(self.explained)
        self.asked: list[State] = []
        self.searched: list[State] = []

    def grow(self, s: State) -> list[State]:
        self.asked.append(s)
        return sorted((s | {n} for n in range(1, self.top + 1) if n not in s), key=lambda g: (self.score(g), sorted(g)))

    def search(self, s: State) -> State:
        self.searched.append(s)
        return s

    def beam(self, **changes: object) -> Beam[State]:
        beam = Beam(
            score=self.score,
            key=lambda s: s,
            grow=self.grow,
            reduce=(drop,),
            worth=lambda fuller, simpler: self.score(fuller) < self.score(simpler),
            prefers=lambda other, s: self.score(other) < self.score(s),
            search=self.search,
            leaves_noise=lambda s: False,
            size=len,
            most=4,
            width=3,
            reach=10.0,
            margin=0.0,
        )
        return replace(beam, **changes)  # type: ignore[arg-type]


def test_a_state_grows_by_what_is_worth_its_cost() -> None:
    problem = Counting({state(1): 5.0, state(3): 3.0, state(4): 0.5})
    assert problem.beam().run([state()]) == {1, 3}
    assert problem.asked[0] == set()
    assert {1, 3} in problem.asked, "the end is grown too: nothing beyond it is worth its cost"


def test_nothing_worth_its_cost_leaves_the_start() -> None:
    problem = Counting({state(1): 0.9})
    assert problem.beam().run([state()]) == set()
    assert problem.asked == [set()] and problem.searched == []


def test_what_another_explains_better_is_dropped_again() -> None:
    """2 alone is best, but is only a stand-in for 1 and 3 together."""
    problem = Counting({state(2): 4.0, state(1): 3.0, state(3): 3.0, state(1, 2): -2.0, state(2, 3): -2.0})
    assert problem.grow(state())[0] == {2}
    assert problem.beam().run([state()]) == {1, 3}
    assert problem.beam(reduce=()).run([state()]) == {1, 3}, "a beam of more than one finds it without a reduction"
    # One at a time: from 2 to 2 with 1, to all three, which is reduced by the stand-in.
    alone = Counting({state(2): 4.0, state(1): 3.0, state(3): 3.0, state(1, 2): -1.6, state(2, 3): -1.6})
    assert alone.beam(width=1).run([state()]) == {1, 3}
    assert alone.beam(width=1, reduce=()).run([state()]) == {1, 2, 3}


def test_a_pair_that_only_together_explains_is_found_beside_a_third_that_leads() -> None:
    """1 is the better start; 2 explains little alone, and nearly all with 3."""
    explained = {state(1): 4.0, state(2): 1.5, state(2, 3): 8.0, state(1, 2): -4.0}
    problem = Counting(explained)
    assert problem.beam().run([state()]) == {2, 3}
    assert problem.asked[:3] == [set(), {1}, {2}], "the best first, and then, as it leaves more than noise, the second"
    assert Counting(explained).beam(width=1).run([state()]) == {1}, "a greedy search stops at the third"


def test_where_the_best_leaves_noise_no_other_is_grown() -> None:
    problem = Counting({state(1): 4.0, state(2): 1.5, state(2, 3): 8.0, state(1, 2): -4.0})
    assert problem.beam(leaves_noise=lambda s: s == {1}).run([state()]) == {1}
    assert state(2) not in problem.asked


def test_within_the_margin_the_smaller_state_is_taken() -> None:
    problem = Counting({state(1): 4.0, state(2): 2.0, state(3): 2.0})
    assert problem.beam(margin=0.0).run([state()]) == {1, 2, 3}
    assert problem.beam(margin=1.0).run([state()]) == {1, 2}, "of 2 and 3 either one; in the order of the numbers the first"
    assert problem.beam(margin=1.9).run([state()]) == {1, 2}, "2 behind is beyond the margin"
    assert problem.beam(margin=2.0, width=6).run([state()]) == {1}


def test_of_equal_sizes_within_the_margin_the_better_is_taken() -> None:
    problem = Counting({state(1): 4.0, state(2): 4.5}, top=2)
    assert problem.beam(most=1, margin=3.0).run([state()]) == {2}


@pytest.mark.parametrize("width", [1, 2, 3])
def test_no_more_are_carried_on_than_the_width(width: int) -> None:
    problem = Counting({state(n): 2.0 + 0.1 * n for n in range(1, 6)})
    beam = problem.beam(width=width, most=1)
    assert len(beam.children(state())) == width
    assert beam.children(state()) == [state(n) for n in (5, 4, 3)[:width]]
    assert beam.run([state()]) == {5}


def test_what_is_behind_by_more_than_the_reach_is_given_up() -> None:
    explained = {state(1): 4.0, state(2): 1.5, state(2, 3): 8.0, state(1, 2): -4.0}
    assert Counting(explained).beam(reach=2.5).run([state()]) == {2, 3}
    near = Counting(explained)
    assert near.beam(reach=2.4).run([state()]) == {1}
    assert state(2) not in near.asked


def test_no_state_holds_more_than_the_most() -> None:
    problem = Counting({state(n): 5.0 for n in range(1, 6)})
    assert len(problem.beam(most=2).run([state()])) == 2
    assert max(len(s) for s in problem.asked) == 1
    assert problem.beam(most=0).run([state()]) == set()


def test_of_one_state_the_better_version_is_kept() -> None:
    """Key and score of (number, quality): the same model with better parameters takes its own place."""
    beam: Beam[tuple[int, float]] = Beam(
        score=lambda s: -s[1],
        key=lambda s: s[0],
        grow=lambda s: [(1, 3.0), (1, 5.0)] if s[0] == 0 else [],
        reduce=(),
        worth=lambda fuller, simpler: True,
        prefers=lambda other, s: False,
        search=lambda s: s,
        leaves_noise=lambda s: False,
        size=lambda s: s[0],
        most=3,
        width=2,
        reach=10.0,
        margin=0.0,
    )
    assert beam.run([(0, 0.0)]) == (1, 5.0)
    assert beam.run([(0, 0.0), (0, 9.0)]) == (0, 9.0)
    # What a search of the leader brings counts at once, and is asked for once of each.
    asked: list[tuple[int, float]] = []

    def search(s: tuple[int, float]) -> tuple[int, float]:
        asked.append(s)
        return s[0], s[1] + 1.0

    assert replace(beam, search=search).run([(0, 0.0)]) == (1, 6.0)
    assert asked == [(1, 5.0)]


def test_each_state_is_grown_once_and_each_leader_searched_once() -> None:
    problem = Counting({state(1): 5.0, state(2): 4.0, state(3): 3.0, state(4): 2.0})
    assert problem.beam().run([state()]) == {1, 2, 3, 4}
    assert len(problem.asked) == len(set(problem.asked))
    assert problem.searched == [state(1), state(1, 2), state(1, 2, 3), state(1, 2, 3, 4)]


def test_only_what_is_worth_it_is_a_child_and_it_is_reduced_first() -> None:
    problem = Counting({state(1): 3.0, state(2): 2.0, state(3): 2.0, state(1, 2): -1.9})
    children = problem.beam().children(state(1))
    assert children == [state(1, 3)], "2 beside 1 explains 0.1, and costs 1"
    # A child that is no better than its parent after its reductions is none.
    back = problem.beam(reduce=(lambda s: [state(1)],), prefers=lambda other, s: len(s) > 1)
    assert back.children(state(1)) == []


def test_a_better_child_behind_many_poor_ones_is_reached() -> None:
    """The width counts children that are worth it, not those that are looked at."""
    problem = Counting({state(5): 2.0})
    beam = problem.beam(grow=lambda s: [s | {n} for n in range(1, 6) if n not in s], width=1)
    assert beam.children(state()) == [state(5)]


def test_reductions_go_on_until_none_is_preferred() -> None:
    steps: list[tuple[State, State]] = []

    def prefers(other: State, s: State) -> bool:
        steps.append((other, s))
        return 1 in other

    assert reduced(state(1, 2, 3, 4), (drop,), prefers, lambda s: -sum(s)) == {1}
    # Of several that are preferred the best is taken: the largest sum that is left.
    taken = [s for s in (state(1, 3, 4), state(1, 4)) if any(old == s for _, old in steps)]
    assert taken == [state(1, 3, 4), state(1, 4)]


def test_the_first_move_with_a_preferred_result_is_made() -> None:
    def away(n: int) -> Callable[[State], Iterable[State]]:
        return lambda s: [s - {n}] if n in s else []

    order: list[int] = []

    def prefers(other: State, s: State) -> bool:
        (gone,) = s - other
        order.append(gone)
        return gone != 2

    assert reduced(state(1, 2, 3), (away(2), away(1), away(3)), prefers, len) == {2}
    assert order == [2, 1, 2, 3, 2], "after each step all moves are tried again from the first"


def test_a_cycle_of_equals_ends() -> None:
    turns: list[int] = []

    def turn(n: int) -> list[int]:
        turns.append(n)
        return [(n + 1) % 3]

    assert reduced(0, (turn,), lambda other, n: True, lambda n: 0.0) in {0, 1, 2}
    assert len(turns) < 100
    # And so does the search that uses it, where growing and reducing undo each other.
    problem = Counting({state(1): 5.0})
    undone = problem.beam(reduce=(lambda s: [state()],), prefers=lambda other, s: bool(s))
    assert undone.run([state()]) == set()
    assert problem.asked == [set()]


def test_no_endless_loop_where_every_state_is_worth_growing() -> None:
    """Growth that never ends is bounded by the most numbers, whatever `worth` says."""
    problem = Counting({state(n): 2.0 for n in range(1, 9)}, top=8)
    end = problem.beam(worth=lambda fuller, simpler: True, most=6).run([state()])
    assert len(end) == 6 and len(problem.asked) < 40


def test_several_starts_compete() -> None:
    problem = Counting({state(1): 3.0, state(2): 2.0, state(2, 3): 6.0})
    assert problem.beam(most=1).run([state(1), state(2)]) == {1}
    assert problem.beam(reach=0.5).run([state(1), state(2)]) == {1, 2, 3}
