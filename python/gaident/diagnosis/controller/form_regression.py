"""The regression that shows the form of a controller: linear in gains and feedforwards, not in the filters' numbers.

    u = F (kp (b C r - V w) + ki I(C r - V w) + a_ff a* + f_ff sign(r)) + u0        F, V, C: filters of torque, velocity, command

For given filters this is a linear least squares in (kp, kp b, ki, a_ff, f_ff, u0).
The filters' numbers are searched outside of it (variable projection, Golub and Pereyra 1973).
u0 is what the integrator stored before the record began.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.control.between import at_lines
from gaident.control.cascade import Cascade
from gaident.control.filtering import filtered
from gaident.control.pi import PI
from gaident.control.ticks import straight_between
from gaident.data.record import Record
from gaident.diagnosis.controller.form_filters import Place, bounds_of, equation_of, filters, grid_of
from gaident.diagnosis.controller.lost_times import LostTimes
from gaident.identification.logged_stretches import centred, correlation_of, log_of, numbered, whitened
from gaident.identification.logged_torque import noise_between, smoothed_again
from gaident.identification.replay.replay import rounding_of
from gaident.policy.table import POLICY

__all__ = ["Law", "Shape", "fitted_shape", "law_of", "least", "quiet_law", "slope", "solved_shape"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
FILTER_STEP = 1e-5  # no decision: the step of a difference; of a filter's number


@dataclass(frozen=True, eq=False)
class Law:
    """Records one after the other, r controller samples to a line of the log.

    command, velocity: at the controller's samples [rad/s] (n r,); torque: as logged [N m] (n,); used (n,): where no limit acts;
    lengths: lines of each record; period: of the controller [s].
    With r = 1 all used lines count alike, and the start of the integrator is fitted.
    In a slower log each signal x is fitted as x(k) - rho x(k-1), without its mean in each stretch between two limits,
    see `logged_stretches`.
    velocities: others that have the same lines [rad/s] (n r,) each; () where the log has all samples.
    straight: the velocity straight between its lines [rad/s] (n r,).
    steps: that the velocities of each record are rounded to [rad/s], where r = 1.
    mean: of each record, whether its torque is of means since the line before; () where none is.
    interpolated: what another velocity between the lines changes of the torque of a bare PI [N m] (n,); None: as `velocities`.
    around: a given position controller with its feedforward, at whose output `command` is; its velocity controller is not used.
    fed: then slope and sign of v*, which a feedforward of the torque takes (2, n r).
    lost: where the lines do not tell when the command jumped: steps of the signals are fitted, see `lost_times`.
    """

    command: Vector
    velocity: Vector
    torque: Vector
    used: NDArray[np.bool_]
    lengths: tuple[int, ...]
    period: float
    every: int = 1
    stretch: NDArray[np.intp] | None = None
    rho: float = 0.0
    velocities: tuple[Vector, ...] = ()
    straight: Vector | None = None
    steps: tuple[float, ...] = ()
    lost: LostTimes | None = None
    mean: tuple[bool, ...] = ()
    interpolated: Vector | None = None
    around: Cascade | None = None
    fed: Matrix | None = None

    @property
    def others(self) -> tuple[Law, ...]:
        """The same of a slower log with the velocity straight between the lines, and without correlation, for the uncertainty."""
        return () if self.straight is None else (replace(self, velocity=self.straight), replace(self, rho=0.0))

    def whole(self, pi: PI, **more: Any) -> Cascade:
        """The controller with this PI, and what stands around it."""
        return replace(self.around or Cascade(pi), velocity=pi, **more)

    def columns(self, places: Sequence[Place], numbers: Vector) -> Matrix:
        """(n used, 5 + records) [-w, r, integral of e by the trapezoidal rule, slope of r, sign of r, starts], filtered."""
        ticks = [length * self.every for length in self.lengths]
        seen = {"command_filters": self.command, "velocity_filters": self.velocity}
        torque: list[tuple[Vector, Vector]] = []
        for (place, _), f in zip(places, filters(places, numbers, self.period), strict=True):
            b, a = equation_of(f, self.period)
            if place == "torque_filters":
                torque.append((b, a))
            else:
                seen[place] = filtered(b, a, seen[place][None, :], ticks)[0]
        r, w = seen["command_filters"], seen["velocity_filters"]
        half = 0.5 * self.period * np.ones(2)  # no decision: a formula: the trapezoidal rule
        integral = filtered(half, np.array([1.0, -1.0]), (r - w)[None, :], ticks)[0]
        fed = self.fed
        if fed is None:
            slope = np.append(np.diff(self.command), 0.0) / self.period
            slope[np.cumsum(ticks) - 1] = 0.0
            fed = np.stack([slope, np.sign(self.command)])
        rows: Matrix = np.concatenate([np.stack([-w, r, integral]), fed])
        for b, a in torque:
            rows = filtered(b, a, rows, ticks)
        starts = np.repeat(np.eye(len(self.lengths)), self.lengths, axis=1)
        parts = zip(np.split(rows, np.cumsum(ticks)[:-1], axis=1), self.mean or (False,) * len(ticks), strict=True)
        lines = np.concatenate([at_lines(part, self.every, mean) for part, mean in parts], axis=1)
        return self._fitted(np.concatenate([lines, starts]))

    @cached_property
    def logged(self) -> Vector:
        """The torque [N m] (n used,)."""
        torque = self._fitted(self.torque[None, :])[:, 0]
        return torque if self.lost is None else torque - self.lost.expected

    def _fitted(self, rows: Matrix) -> Matrix:
        """(n used, signals) of signals at the lines (signals, n)."""
        if self.lost is not None:
            return self.lost.whitened(rows)
        if self.stretch is None:
            return rows.T[self.used]
        stretch, rho = self.stretch, self.rho
        return np.array([centred(*whitened(row, stretch, rho), False) for row in rows]).T

    @property
    def floor(self) -> float:
        """Root mean square [N m] below which what is left of a slower log shows nothing of a bare PI."""
        assert self.interpolated is not None and self.stretch is not None
        d, _ = whitened(self.interpolated, self.stretch, self.rho)
        return POLICY.interpolation * float(np.sqrt(np.mean(d**2)))

    def correlated_as(self, shape: Shape) -> Law:
        """The same of a slower log, with the correlation from line to line of what these filters and gains leave."""
        assert self.stretch is not None
        plain = replace(self, rho=0.0)
        left = plain.logged - plain.columns(shape.places, shape.numbers) @ shape.coefficients
        return replace(self, rho=correlation_of(left, self.stretch[self.stretch >= 0]))

    def unseen(self, shape: Shape) -> float:
        """Root mean square of the torque that the unknown velocity between the lines may make [N m]; 0 where r = 1.

        The proportional part depends on the line itself. Behind a filter it also depends on the samples between the lines.
        """
        made = self.columns(shape.places, shape.numbers)
        others = [replace(self, velocity=w).columns(shape.places, shape.numbers) for w in self.velocities]
        return float(np.sqrt(sum(float(np.mean(((made - other) @ shape.coefficients) ** 2)) for other in others)))

    def of_other(self, other: Law, coefficients: Vector) -> tuple[Vector, NDArray[np.intp]]:
        """(the change of the torque by another velocity between the lines [N m], stretch of each line)."""
        assert self.stretch is not None
        none = np.zeros(0)
        off = (replace(self, rho=0.0).columns((), none) - replace(other, rho=0.0).columns((), none)) @ coefficients
        return off, self.stretch[self.stretch >= 0]


@dataclass(frozen=True, eq=False)
class Shape:
    """Filters as the logs show them, all gains free; coefficients: of `Law.columns`; left: what they leave [N m] (n used,)."""

    places: tuple[Place, ...]
    numbers: Vector
    coefficients: Vector
    left: Vector

    @property
    def rms(self) -> float:
        """Root mean square of `left` [N m]."""
        return float(np.sqrt(np.mean(self.left**2)))


def law_of(
    records: Sequence[Record], given: PI, every: int = 1, steps: tuple[float, ...] = (), around: Cascade | None = None
) -> tuple[Law, float] | None:
    """(the regression's data, root mean square that the log's rounding, or what is between its lines, makes of a replay [N m]).

    given: its torque limit and gains. steps: that the velocities of each record are rounded to [rad/s], where every is 1, or
    nothing. around: of a slower log, a given position controller, see `Law`. None where a signal or too much is missing.
    """
    share = max(POLICY.searched_samples // len(records), 1)
    parts = [rec[:share] for rec in records]
    read = ("torque", *(("command",) if around is None else around.reads))
    if any(getattr(r, channel) is None for r in parts for channel in read):
        return None
    lengths = tuple(len(r) for r in parts)
    period = records[0].dt / every
    torque = np.concatenate([r.torque for r in parts if r.torque is not None])
    limit = given.limits[0]
    if every == 1:
        command, velocity = (np.concatenate([getattr(r, name) for r in parts]) for name in ("command", "velocity"))
        used = np.abs(torque) < POLICY.at_limit * limit
        steps = steps or (0.0,) * len(records)
        law = Law(command, velocity, torque, used, lengths, period, steps=steps)
        logged = [(r, r.command, r.torque) for r in records]
        rounded = zip(logged, steps, strict=True)
        floor = max(rounding_of(r, c, given, u, q) for (r, c, u), q in rounded if c is not None and u is not None)
    else:
        cascade = replace(around or Cascade(given), velocity=given, period=period)
        logs = [log_of(r, share, cascade, False) for r in records]
        logs = [log.pushed(cascade) if log.mean else log for log in logs]  # the torque shows how the velocity turns at a jump
        stretch = numbered([log.stretch for log in logs])
        asked = None if around is None else [log.asked(cascade) for log in logs]
        command = np.concatenate([log.command for log in logs] if asked is None else [one for one, _ in asked])
        smooth = np.concatenate([log.velocity for log in logs])
        straight = np.concatenate([straight_between(log.velocity[::every], every) for log in logs])
        used = stretch >= 0
        law = Law(
            command,
            smooth,
            torque,
            used,
            lengths,
            period,
            every,
            stretch,
            straight=straight,
            mean=tuple(log.mean for log in logs),
            around=around,
            fed=None if asked is None else np.concatenate([fed for _, fed in asked], axis=1),
        )
        coefficients = np.array([given.kp, given.kp, given.ki, *np.zeros(2 + len(records))])
        off, own = law.of_other(replace(law, velocity=straight), coefficients)
        pairs = list(zip(records, logs, strict=True))
        noise = np.concatenate([noise_between(rec, len(log.velocity), every) for rec, log in pairs])
        again = np.concatenate([smoothed_again(rec, log.velocity, every) for rec, log in pairs])
        others = straight, smooth + noise, again
        law = replace(law, rho=correlation_of(off, own), velocities=others, interpolated=_at(used, off))
        floor = law.floor
    return _with_enough(law, floor)


def quiet_law(law: Law, memory: int) -> Law | None:
    """The regression in the stretches of small torques; memory: in lines of the log.

    A limit acts at large torques only: also a limit before a filter, whose output shows no plateau, or one with an anti-windup.
    A stretch begins `memory` lines after the last large torque, when its effect in the filters is over, and has its own integral.
    It ends well before the next large torque, which a filter delays. None where too little is left.
    """
    ahead = memory // 4  # no decision: a filter shows half of a step much sooner than all of it
    parts = []
    at = 0
    for length in law.lengths:
        size = np.abs(law.torque[at : at + length])
        at += length
        loud = size > POLICY.quiet_torque * float(size.max())
        around = np.convolve(loud, np.ones(memory + ahead + 1))[ahead : ahead + length] > 0.5  # no decision: rounding of a count
        begins = ~around & np.append(True, around[:-1])
        parts.append(np.where(around, -1, np.cumsum(begins) - 1))
    stretch = numbered(parts)
    quiet = replace(law, used=stretch >= 0, stretch=stretch)
    several = int(stretch.max(initial=-1)) > 0  # where one record alone is left, other forms fit as well
    return quiet if several and _with_enough(quiet, 0.0) is not None else None


def _with_enough(law: Law, floor: float) -> tuple[Law, float] | None:
    """Where enough lines are used."""
    used, torque = law.used, law.torque
    enough = int(np.sum(used)) >= POLICY.least_samples and bool(np.any(torque[used]))
    return (law, floor) if enough else None


def _at(used: NDArray[np.bool_], values: Vector) -> Vector:
    """Values where they are used, 0 elsewhere."""
    whole = np.zeros(len(used))
    whole[used] = values
    return whole


def fitted_shape(law: Law, places: tuple[Place, ...], enough: float, starts: Sequence[Vector] = ()) -> Shape:
    """The filters' numbers that leave least, from the best of these starts, or of a grid; enough: rms [N m] that ends it."""
    from scipy.optimize import least_squares

    def off(numbers: Vector) -> Vector:
        q, _ = np.linalg.qr(_scaled(law.columns(places, numbers))[0])
        left: Vector = law.logged - q @ (q.T @ law.logged)
        return left

    if not places:
        return solved_shape(law, places, np.zeros(0))
    low, high = bounds_of(places)
    grid = starts or grid_of(places)
    costs = np.array([np.sum(off(start) ** 2) for start in grid])
    size = float(np.sqrt(np.mean(law.logged**2)))
    best: Shape | None = None
    followed_up = POLICY.starts if len(places) == 1 else 1  # the grid of two filters is fine enough
    for k in np.argsort(costs, kind="stable")[:followed_up]:
        inside = np.clip(grid[k], low + 1e-9, high - 1e-9)
        found = least_squares(
            lambda x: off(x) / size, inside, bounds=(low, high), xtol=1e-12, ftol=1e-6, gtol=1e-15, max_nfev=POLICY.filter_fit
        )
        shape = solved_shape(law, places, found.x)
        if best is None or shape.rms < best.rms:
            best = shape
        if best.rms <= enough:
            break
    assert best is not None
    return best


def solved_shape(law: Law, places: tuple[Place, ...], numbers: Vector) -> Shape:
    """Filters with these numbers, and the gains that leave least beside them."""
    table, sizes = _scaled(law.columns(places, numbers))
    coefficients = np.linalg.lstsq(table, law.logged, rcond=1e-12)[0]
    return Shape(places, numbers, coefficients / sizes, law.logged - table @ coefficients)


def _scaled(table: Matrix) -> tuple[Matrix, Vector]:
    sizes = np.linalg.norm(table, axis=0)
    sizes[sizes == 0.0] = 1.0
    return table / sizes, sizes


def least(M: Matrix, wanted: Vector) -> tuple[Vector, float]:
    """(solution, sum of squares left)."""
    if M.shape[1] == 0:
        return np.zeros(0), float(wanted @ wanted)
    sizes = np.linalg.norm(M, axis=0)
    sizes[sizes == 0.0] = 1.0
    solved = np.linalg.lstsq(M / sizes, wanted, rcond=1e-12)[0] / sizes
    left = wanted - M @ solved
    return solved, float(left @ left)


def slope(f: Callable[[Vector], Vector], x: Vector, k: int) -> Vector:
    step = FILTER_STEP * max(abs(float(x[k])), 1.0)
    moved = step * np.eye(len(x))[k]
    return (f(x + moved) - f(x - moved)) / (2.0 * step)
