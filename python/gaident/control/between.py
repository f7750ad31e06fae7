"""A velocity command between the lines of its log: on ramps, at jumps, and what the lines alone do not tell.

Of an interval the lines tell its ends, x0 and x1.
The share s of the change that came early is the mean of the command at the r - 1 samples between them:

    mean = x0 + s (x1 - x0),   s = 0: it jumps at the next line; 1: right behind its own; 1/2: it goes straight

A jump between two lines that hold their values, or a ramp that is over within them, has any s from 0 to 1.
Where a curve bends, s is about that of the cubic through four lines; a corner in the interval, at which the slope changes
by b, moves the mean by up to b/8, and the lines show only a part of a ramp that is over within few of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.policy.table import POLICY

__all__ = [
    *("Unsure", "at_lines", "at_the_clock", "between_lines", "cubics", "jumps_between", "straight_part", "unsure_between"),
    "with_means",
]

Vector = NDArray[np.float64]

AROUND = 5  # no decision: a formula: an interval, two before and two after
TOUCHED = 3  # no decision: a formula: third differences of lines that an interval is part of
EVEN = 12.0**-0.5  # no decision: a formula: deviation of what is anywhere from 0 to 1


def at_the_clock(line: Vector, every: int) -> Vector:
    """A signal that goes straight from one line of the log to the next; after the last line it goes on."""
    if every == 1:
        return np.ascontiguousarray(line, dtype=np.float64)
    steps = np.diff(line)
    steps = np.append(steps, steps[-1])
    return (line[:, None] + steps[:, None] * (np.arange(every) / every)).ravel()


def at_lines(made: Vector, every: int, mean: bool, before: float = 0.0) -> Vector:
    """What the lines of a log contain (..., n) of signals at the controller's samples (..., n r); before: what they were earlier.

    The sample at each line, or, of a log of means, the mean of the r samples that end with it.
    """
    if not mean or every == 1:
        return np.asarray(made[..., ::every])
    earlier = np.full((*made.shape[:-1], every - 1), before)
    whole = np.concatenate([earlier, made], axis=-1)[..., : made.shape[-1]]
    return np.asarray(whole.reshape(*made.shape[:-1], -1, every).mean(axis=-1))


def between_lines(line: Vector, every: int) -> Vector:
    """A velocity command between the lines of its log: on a ramp it goes straight, at a jump it is held until the next line.

    An interval belongs to a ramp where the change over it is at most twice that over the interval before or after.
    Where a ramp begins, ends or bends between two lines, the ramp before goes over into the one after where they meet:

        x0 + b t = x1 - a (1 - t),   t = (x1 - x0 - a)/(b - a)

    x0, x1 are the lines of the interval, b and a the changes over the intervals before and after, t from 0 to 1.
    """
    if every == 1:
        return np.ascontiguousarray(line, dtype=np.float64)
    steps = np.append(_ramps(line), 0.0)
    t = np.arange(every) / every
    made = line[:, None] + steps[:, None] * t
    at, before, after = _bends(np.diff(line))
    meeting = (line[at + 1] - line[at] - after) / (before - after)
    rise, fall = line[at, None] + before[:, None] * t, line[at + 1, None] - after[:, None] * (1.0 - t)
    made[at] = np.where(t < meeting[:, None], rise, fall)
    return np.asarray(made).ravel()


def _bends(steps: Vector) -> tuple[NDArray[np.intp], Vector, Vector]:
    """Intervals within which one ramp goes over into another one, and the changes over the intervals before and after them.

    Each of the ramps goes straight over two intervals, and the change over the interval is between theirs.
    """
    if len(steps) < AROUND:
        return np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0)
    earlier, before, here, after, later = np.lib.stride_tricks.sliding_window_view(steps, AROUND).T
    bend = np.abs(after - before)
    straight = np.maximum(np.abs(before - earlier), np.abs(later - after)) <= POLICY.ramp_straight * bend
    between = (np.minimum(before, after) < here) & (here < np.maximum(before, after))
    (at,) = np.nonzero(straight & between)
    return at + AROUND // 2, before[at], after[at]


def _ramps(line: Vector) -> Vector:
    """Change over each interval of a velocity command that belongs to a ramp, otherwise 0; shape (n - 1,)."""
    steps = np.diff(line)
    size = np.abs(steps)
    near = np.maximum(np.append(0.0, size[:-1]), np.append(size[1:], 0.0))
    return np.where(size <= POLICY.ramp * near, steps, 0.0)


def straight_part(line: Vector, is_position: bool) -> tuple[str, Vector]:
    """How a command goes from line to line, and the part of it that goes straight where it is mixed; shape (n,) or (0,).

    "held": it changes at the lines only; "straight"; "mixed": the sum of two such commands.
    A part that goes straight is 0 at the first line, so that nothing of it lies before the record.
    """
    steps = np.diff(line) if is_position else _ramps(line)
    if not np.any(steps):
        return "held", np.zeros(0)
    if line[0] == 0.0 and np.array_equal(steps, np.diff(line)):
        return "straight", np.zeros(0)
    return "mixed", np.concatenate([[0.0], np.cumsum(steps)])


def with_means(line: Vector, kind: str, straight: Vector, known: Vector) -> tuple[Vector, str, Vector]:
    """A command (n,), its kind and straight part of `straight_part`, with a held part so that the means over each line are those
    of the command at the controller's samples, known (n, r)."""
    if kind == "straight":
        kind, straight = "mixed", line.copy()
    moving = straight if len(straight) else np.zeros(len(line))
    goes = at_the_clock(moving, known.shape[1]).reshape(known.shape)
    return moving + (known - goes).mean(axis=1), kind, straight


@dataclass(frozen=True, eq=False)
class Unsure:
    """Intervals of a velocity command (n,) [rad/s], r samples to a line, of which the lines do not tell how it goes.

    at (m,): their numbers; jump (m,): whether it jumps there; rise (m,): the change over them [rad/s].
    usual, spread (m,): s as expected, and its deviation.
    drawn (n, r): the command at the samples as expected, straight at a jump.
    """

    drawn: NDArray[np.float64]
    at: NDArray[np.intp]
    jump: NDArray[np.bool_]
    usual: Vector
    spread: Vector
    rise: Vector

    @property
    def every(self) -> int:
        """Samples to a line."""
        return int(self.drawn.shape[1])

    def early(self, share: Vector) -> Vector:
        """The command at the samples (n, r), where such shares (m,) of the changes come early."""
        made = self.drawn.copy()
        sample = np.arange(self.every)
        held = self.held(share)[:, None]
        jumps = made[self.at, :1] + self.rise[:, None] * np.clip(sample + 1.0 - held, 0.0, 1.0)
        bends = made[self.at] + _tents((share - self.usual) * self.rise, self.every)
        made[self.at] = np.where(self.jump[:, None], jumps, bends)
        return made

    def with_jumps_on_lines(self) -> Unsure:
        """The same where every jump is known to fall on the next line."""
        held = self.drawn.copy()
        held[self.at[self.jump]] = held[self.at[self.jump], :1]
        bends = ~self.jump
        rest = (self.at[bends], self.jump[bends], self.usual[bends], self.spread[bends], self.rise[bends])
        return Unsure(held, *rest)

    def on_samples(self, share: Vector) -> Unsure:
        """The same where every jump is known to fall on the sample next to such shares (m,)."""
        steps = self.every - 1
        usual = np.where(self.jump, np.round(share * steps) / steps, self.usual)
        return replace(self, usual=usual, spread=np.where(self.jump, POLICY.negligible / steps, self.spread))

    def held(self, share: Vector) -> Vector:
        """Samples of each interval (m,) before its jump, from 1 to r."""
        return self.every - share * (self.every - 1)

    def middle(self, share: Vector) -> NDArray[np.intp]:
        """The sample of each interval (m,) at which the command changes most with its share."""
        held = np.minimum(self.held(share).astype(np.intp), self.every - 1)
        return np.where(self.jump, held, self.every // 2)


def jumps_between(line: Vector) -> NDArray[np.intp]:
    """The intervals in which a velocity command (n,) jumps."""
    steps = np.diff(line)
    return np.flatnonzero((steps != 0.0) & (_ramps(line) == 0.0))


def _tents(means: Vector, every: int) -> Vector:
    """Triangles over intervals, 0 at the lines, with these means (m,) over the samples between them; (m, every)."""
    tent = 1.0 - np.abs(2.0 * np.arange(every) / every - 1.0)
    made: Vector = np.outer(means, (every - 1) * tent / tent.sum())
    return made


def unsure_between(line: Vector, every: int) -> Unsure:
    """What the lines of a velocity command (n,) [rad/s] do not tell."""
    steps = np.diff(line)
    bends = np.diff(steps)
    before, after = np.append(steps[:1], bends), np.append(bends, -steps[-1:])  # it stands before the record and behind it
    least = POLICY.rounded_command * float(np.abs(line).max(initial=0.0))
    met = np.zeros(len(steps), dtype=np.bool_)
    met[_bends(steps)[0]] = True
    straight = np.minimum(np.abs(before), np.abs(after)) <= least  # it continues the ramp of one side
    size = np.abs(steps)
    (at,) = np.nonzero((size > least) & (met | ~straight))
    jump = (_ramps(line)[at] == 0.0) & ~met[at]
    straight_on = at_the_clock(line, every).reshape(-1, every)
    curved = cubics(line[at], steps[at], before[at], after[at], every)
    drawn = np.where(met[at, None], between_lines(line, every).reshape(-1, every)[at], curved)
    drawn[jump] = straight_on[at[jump]]
    drawn_share = (drawn[:, 1:].mean(axis=1) - line[at]) / steps[at]
    usual = np.clip(drawn_share, 0.0, 1.0)  # a cubic may overshoot where a ramp ends
    drawn += _tents((usual - drawn_share) * steps[at], every)
    uneven = np.abs(np.diff(np.concatenate([[0.0, 0.0], bends, [0.0, 0.0]])))
    uneven = np.lib.stride_tricks.sliding_window_view(uneven, TOUCHED).max(axis=1)
    spread = np.where(met[at], POLICY.ramp_straight, 1.0) * POLICY.corner_unsure * uneven[at] / size[at]
    straight_on[at] = drawn
    spread = np.clip(np.where(jump, EVEN, spread), POLICY.negligible, EVEN)
    return Unsure(straight_on, at, jump, usual, spread, steps[at])


def cubics(line: Vector, rise: Vector, bent: Vector, bent_after: Vector, every: int) -> Vector:
    """Cubics from lines (n,) over intervals in which they rise so much (n,), at the samples (n, every).

    bent, bent_after: second differences of the lines at the beginning and the end of each interval (n,).
    """
    t = np.arange(every) / every
    made: Vector = np.outer(line, np.ones(every)) + np.outer(rise, t)
    made += 0.5 * t * (t - 1.0) * (np.outer(bent, 2.0 - t) + np.outer(bent_after, 1.0 + t)) / 3.0
    return made
