"""Filters and gains of a controller where its slow log does not tell when the command jumped: both are found together.

The times are a part of the noise (`lost_times`), which takes the numbers that are looked for; so each step is done with those of
the step before, about the times that are the most probable ones there (Gauss-Newton).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.control.between import Unsure, jumps_between, unsure_between
from gaident.control.pi import PI
from gaident.control.ticks import pushed_between
from gaident.data.record import Record
from gaident.data.torque_kind import MEAN
from gaident.diagnosis.controller.form_filters import Place, grid_of
from gaident.diagnosis.controller.form_regression import Law, Shape, fitted_shape, solved_shape
from gaident.diagnosis.controller.lost_times import LostTimes
from gaident.identification.replay.line_steps import LineSteps
from gaident.identification.replay.timed_record import TimedRecord
from gaident.policy.table import POLICY

__all__ = ["about", "cost_of_left", "jumps_of", "on_samples", "shape_between"]

Vector = NDArray[np.float64]

FIRST_FEED = 3  # no decision: a formula: place in the columns of `Law`
ROUNDS = 5  # no decision: of a solver: how many steps, the fourth one has converged
FOLLOWED = 2  # no decision: of a solver: so many of a grid's best starts are followed


def jumps_of(records: Sequence[Record], every: int, lengths: Sequence[int]) -> Unsure | None:
    """What the lines of all records, one after the other, do not tell of their commands; None where that is no jump, or known.

    lengths: lines of each that the regression has; a long record has more.
    None also for a log of means: its jumps are taken to fall on the lines.
    """
    if every == 1 or any(r.command is None or isinstance(r, TimedRecord) or r.torque_log == MEAN for r in records):
        return None
    commands = [r.command[:n] for r, n in zip(records, lengths, strict=True) if r.command is not None]
    if not any(len(jumps_between(c)) for c in commands):
        return None
    parts = [unsure_between(c, every) for c in commands]
    first = np.cumsum([0, *(len(c) for c in commands[:-1])])
    at = np.concatenate([part.at + start for part, start in zip(parts, first, strict=True)])
    drawn, jump, usual, spread, rise = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("drawn", "jump", "usual", "spread", "rise")
    )
    return Unsure(drawn, at, jump, usual, spread, rise)


def shape_between(
    law: Law, unsure: Unsure, places: tuple[Place, ...], given: PI, starts: Sequence[Vector] | None = None
) -> tuple[Law, Shape]:
    """(the regression with the most probable times as its noise, the filters' numbers that leave least of it).

    starts: of these numbers; None: a grid.
    """
    gains = np.array([given.kp, given.kp, given.ki, *np.zeros(2 + len(law.lengths))])
    tried: list[tuple[float, int, Law, Shape]] = []
    for start in starts or grid_of(places):
        one = _losing(law, unsure, Shape(places, start, gains, np.zeros(0)), unsure.usual)
        shape = solved_shape(one, places, start)
        tried.append((cost_of_left(one, shape.left), len(tried), one, shape))
    found = [_followed(one, shape) for _, _, one, shape in sorted(tried, key=lambda x: x[:2])[:FOLLOWED]]
    return min(found, key=lambda x: cost_of_left(x[0], x[1].left))


def cost_of_left(law: Law, left: Vector) -> float:
    """Twice the negative logarithm of the likelihood of what is left of the torque (n,) [N m], a step, but for a constant."""
    assert law.lost is not None
    least = np.finfo(np.float64).tiny
    return float(np.log(max(np.mean(left**2), least))) + law.lost.cost / len(left)


def _followed(law: Law, shape: Shape) -> tuple[Law, Shape]:
    for _ in range(ROUNDS):
        shape = fitted_shape(law, shape.places, 0.0, [shape.numbers])
        law = about(law, shape)
    return law, fitted_shape(law, shape.places, 0.0, [shape.numbers])


def about(law: Law, shape: Shape) -> Law:
    """The regression about the most probable times with these filters and numbers, `shape.left` left of it."""
    assert law.lost is not None
    return _losing(law, law.lost.steps.unsure, shape, law.lost.share(shape.left))


def on_samples(law: Law, shape: Shape) -> Law:
    """The same where every jump falls on the sample next to its most probable time."""
    assert law.lost is not None
    unsure = law.lost.steps.unsure.on_samples(law.lost.share(shape.left))
    return _losing(law, unsure, shape, unsure.usual)


def _pushed(law: Law, unsure: Unsure, shape: Shape) -> Vector:
    """The velocity at the controller's samples [rad/s] (n r,), which turns where the torque jumps with the command."""
    every, first, pushed = law.every, 0, []
    for lines in law.lengths:
        asked = law.command[first * every : (first + lines) * every]
        ticks = Law(asked, asked, asked, np.ones(len(asked), bool), (len(asked),), law.period)

        def torque_of(velocity: Vector, ticks: Law = ticks) -> Vector:
            made = replace(ticks, velocity=velocity).columns(shape.places, shape.numbers)
            torque: Vector = made[:, :FIRST_FEED] @ shape.coefficients[:FIRST_FEED]
            return torque

        own = unsure.at[unsure.jump & (unsure.at >= first) & (unsure.at < first + lines)] - first
        line = law.velocity[first * every : (first + lines) * every : every]
        pushed.append(pushed_between(line, every, torque_of, own))
        first += lines
    return np.concatenate(pushed)


def _losing(law: Law, unsure: Unsure, shape: Shape, share: Vector) -> Law:
    """The regression where the lines do not tell when the command jumped, about such shares (m,), with the numbers of a shape."""
    assert law.stretch is not None
    steps = LineSteps.of(law.stretch, unsure)
    told = replace(law, command=unsure.early(share).ravel(), lost=None)
    told = replace(told, velocity=_pushed(told, unsure, shape))
    lines = replace(told, stretch=None, used=np.ones(len(law.torque), bool))
    made = lines.columns(shape.places, shape.numbers) @ shape.coefficients
    off = np.where(steps.used, np.diff(law.torque - made), 0.0)
    others = [replace(lines, velocity=w).columns(shape.places, shape.numbers) @ shape.coefficients for w in law.velocities]
    unseen = np.where(steps.used, np.diff(np.array(others) - made), 0.0)
    count = POLICY.filter_memory * law.every
    asked = np.eye(1, count)[0]
    pulse = Law(asked, 0.0 * asked, asked, asked >= 0.0, (count,), law.period).columns(shape.places, shape.numbers)
    answer = pulse[:, :FIRST_FEED] @ shape.coefficients[:FIRST_FEED]
    rounding = float(np.finfo(np.float64).eps * np.abs(law.torque).max())
    return replace(told, lost=LostTimes.of(steps, share, off, unseen, answer, rounding))
