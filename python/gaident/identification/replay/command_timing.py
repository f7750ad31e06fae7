"""When, between the lines of a slow log, the velocity command changed: as the logged torque tells it.

Of a jump that falls between two lines, or a ramp that is over within them, the lines do not tell the time (`control.between`):
an unknown share s of the change comes early, in each such interval one.
The controller integrates its error.
So the torque at the lines tells the mean of the command over each interval, and more where filters remember it.
d is the logged torque minus what the controller makes of the measured velocity, D its differences:

    D(n) = sum over intervals i of  c_i(n) (s_i - s_i0) + v(n)

c_i: the controller's answer to a pulse of the command in that interval.
v: an autoregression (what the velocity did between the lines is lost); both sides are whitened by it.
No plant is involved, and stretches in which a limit acts are left out.
Of a jump at which a limit acts the velocity tells the time: it turns where the torque jumps (`_Timing.seen`).
With normal priors of the shares this is a linear least squares problem, solved again where a jump has moved (Gauss-Newton).

That every jump falls on a line is the simpler explanation, and stands unless the other has the higher evidence
(Laplace approximation; MacKay 1992): with the normal matrix N of the whitened equations and the priors' deviations S,

    2 ln(evidence) gained = |e_lines|^2 - |e|^2 - |S^-1 (s - s_prior)|^2 - ln det(1 + S N S)

D. J. C. MacKay, Bayesian interpolation, Neural Computation 4, 1992.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.control import core
from gaident.control.between import Unsure, unsure_between
from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.data.torque_kind import COMMANDED, MEAN
from gaident.identification.logged_stretches import Log, log_of, unlimited
from gaident.identification.logged_torque import comparable, not_followed
from gaident.identification.noise import Autoregression
from gaident.identification.replay.line_steps import LineSteps
from gaident.identification.replay.timed_record import TimedRecord, plain_of
from gaident.models.starts import noise_std
from gaident.policy.table import POLICY

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["timed", "timed_record"]

Vector = NDArray[np.float64]

WINDOW = np.arange(-3, 5)  # no decision: a formula: the lines around an interval, and it needs all of them inside of the record
SMOOTH = 3  # no decision: numbers of a parabola, which is smooth over so few lines
SHARE_STEP = 0.1  # no decision: the step of a difference
ROUNDS = 4  # no decision: of a solver: how many steps, the third one has converged


def timed(records: Sequence[Record], controller: Controller | None) -> tuple[Record, ...]:
    """The records, those that know when their command changed between their lines as `TimedRecord`.

    They know it where the log is slower than its controller, that is driven by a velocity command and known, and a commanded
    torque, no mean, is logged from rest.
    It then follows from this controller: one that is not the drive's, or another limit, is no time.
    A record that is timed already is timed anew.
    """
    plain = tuple(plain_of(rec) for rec in records)
    if controller is None or controller.unknown or controller.driven_by != "command":
        return plain
    return tuple(_timed(rec, controller) for rec in plain)


def timed_record(rec: Record, controller: Controller | None) -> Record:
    """One record as `timed` has it."""
    return timed([rec], controller)[0]


def _timed(rec: Record, controller: Controller) -> Record:
    every = controller.log_every(rec.dt)
    sampled = rec.torque_is == COMMANDED and rec.torque_log != MEAN
    if every == 1 or rec.command is None or not sampled or not comparable(rec, controller):
        return rec
    unsure = unsure_between(rec.command, every)
    timing = _Timing.of(rec, cascade_of(controller), unsure)
    if (
        not len(unsure.at)
        or (np.any(unsure.jump) and not len(controller.steps_at(rec.command)))
        or np.sum(timing.used) < POLICY.least_samples
    ):
        return rec
    between = timing.solved()
    if between is None:
        return rec
    found = TimedRecord.of(rec, between)
    return rec if not_followed([found], controller) else found


def _on_the_lines(early: NDArray[np.bool_], every: int) -> bool:
    """Whether all jumps fell on the lines, of which the torque shows so many early by a sample, and the others not.

    One on the line looks early with the probability `jump_misread`, as what the velocity does behind it is not known.
    So many have to be usual among those, and a jump at any of the `every` samples, which is on the line with the probability
    1/every, has to be excluded by the likelihood of all.
    """
    count, misread, anywhere = int(np.sum(early)), POLICY.jump_misread, 1.0 / every
    if count == 0:
        return True
    from scipy.special import bdtrc

    usual = float(bdtrc(count - 1, len(early), misread)) > POLICY.jumps_usual
    on_lines = len(early) - count
    ratio = on_lines * np.log((1.0 - misread) / anywhere) + count * np.log(misread / (1.0 - anywhere))
    return usual and bool(2.0 * ratio > POLICY.rival_margin)  # no decision: a formula: 2 ln of the odds


class _Seen(NamedTuple):
    """weight, right (m,): what is added to the normal equations of the shares, on the diagonal and to the right.

    gained: how much less is left than with jumps on the lines, in variances of the noise.
    """

    weight: Vector
    right: Vector
    gained: float


class _Shares(NamedTuple):
    """Shares (m,), which of them the torque by itself tells, beside all that it leaves around them, the command at the samples
    (n, r), and 2 ln(evidence) gained."""

    share: Vector
    told: NDArray[np.bool_]
    command: Vector
    gained: float


@dataclass(frozen=True, eq=False)
class _Timing:
    """log: with its command at the lines; pulse (k,): the controller's torque at its samples [N m] after 1 rad/s in one of them.

    used (n - 1,): differences of lines between limits, not beside one.
    """

    log: Log
    cascade: Cascade
    unsure: Unsure
    pulse: Vector
    used: NDArray[np.bool_]

    @classmethod
    def of(cls, rec: Record, cascade: Cascade, unsure: Unsure) -> _Timing:
        log = log_of(rec, len(rec), cascade, whole=False)
        every, stretch = unsure.every, log.stretch
        used = LineSteps.of(stretch, unsure).used
        free = replace(cascade, velocity=unlimited(cascade.velocity))
        count = min(POLICY.filter_memory, len(rec))
        still = np.zeros((count, every))
        asked = still.copy()
        asked[0, 0] = 1.0
        pulse = core.servo_torque(rec.dt, free.ticks(rec.dt, asked, None), still.ravel(), free.core_loop(rec.dt))
        return cls(log, cascade, unsure, pulse, used)

    @property
    def steps(self) -> LineSteps:
        return LineSteps(self.used, self.unsure)

    @property
    def rounding(self) -> float:
        """Of a torque [N m]: no noise is less."""
        return float(np.finfo(np.float64).eps * np.abs(self.log.torque).max())

    def off(self, between: Vector) -> Vector:
        """D (n - 1,) [N m] of a command at the samples (n, r) or at the lines (n,)."""
        made = replace(self.log, between=between).pushed(self.cascade).made(self.cascade)
        return np.where(self.used, np.diff(self.log.torque - made), 0.0)

    def solved(self) -> Vector | None:
        """The command at the samples (n, r); None where its lines explain the torque as well.

        Jumps fall on samples; half a sample is the age of a velocity, or another rule of integration.
        """
        found = self.shares()
        early = found.share * (self.unsure.every - 1) >= POLICY.jumped_early
        if np.any(self.unsure.jump) and _on_the_lines(early[found.told & self.unsure.jump], self.unsure.every):
            bends = self.unsure.with_jumps_on_lines()
            if not len(bends.at):
                return None
            found = replace(self, unsure=bends).shares()
        return found.command if found.gained > POLICY.rival_margin else None

    def shares(self) -> _Shares:
        """The shares with the highest probability."""
        from scipy.sparse import diags_array

        unsure = self.unsure
        usual, spread = unsure.usual, unsure.spread
        share = usual.copy()
        noise = self.steps.noise_of(self.off(unsure.early(share)), self.rounding)
        for round_ in range(ROUNDS):
            if round_ == ROUNDS - 1:
                share = self.on_lines_where_closer(share, noise)
            off = self.off(unsure.early(share))
            noise = self.steps.noise_of(off, self.rounding)
            white = self.steps.whitened(off[None, :], noise)[0]
            columns = self.steps.columns(share, self.pulse, noise)
            normal = (columns.T @ columns).tocsc()
            known = normal.diagonal() * POLICY.told_time**2 / (unsure.every - 1) ** 2
            told = known >= 1.0  # no decision: a formula
            seen = self.seen(share, ~told)
            normal = (normal + diags_array(seen.weight)).tocsc()
            share = np.clip(share + self.step(normal, columns.T @ white + seen.right, usual - share), 0.0, 1.0)
        left, lines = (
            float(np.sum(self.steps.whitened(self.off(command)[None, :], noise) ** 2))
            for command in (unsure.early(share), self.log.source)
        )
        prior = float(np.sum(((share - usual) / spread) ** 2))
        gained = lines - left + seen.gained - prior - self.log_det(normal)
        return _Shares(share, known >= self.left_around(share, noise), unsure.early(share), gained)

    def left_around(self, share: Vector, noise: Autoregression) -> Vector:
        """Mean square of what is left around each change (m,), in variances of the noise, and no less than that.

        Behind a large jump the velocity rings between the lines, and more is left than noise: a small jump there is not told.
        """
        size = np.cumsum(self.steps.whitened(self.off(self.unsure.early(share))[None, :], noise)[0] ** 2)
        end = np.minimum(self.unsure.at + len(WINDOW), len(size) - 1)
        first = np.maximum(self.unsure.at - 1, 0)
        left: Vector = np.maximum((size[end] - size[first]) / np.maximum(end - first, 1), 1.0)
        return left

    def on_lines_where_closer(self, share: Vector, noise: Autoregression) -> Vector:
        """Shares (m,), of each jump 0 where that leaves less around it: a limit between the lines makes other minima."""
        none = np.where(self.unsure.jump, 0.0, share)
        size = [np.cumsum(self.steps.whitened(self.off(self.unsure.early(s))[None, :], noise)[0] ** 2) for s in (share, none)]
        end = np.minimum(self.unsure.at + len(WINDOW), len(self.used) - 1)
        early, on_line = (x[end] - x[np.maximum(self.unsure.at - 1, 0)] for x in size)
        return np.where(on_line < early, none, share)

    def seen(self, share: Vector, blind: NDArray[np.bool_]) -> _Seen:
        """What the velocity tells of the jumps (m,) of which the torque tells nothing, as where a limit acts on either side.

        The torque pushes the velocity from the jump on, see `push_of`: what is left of it at the lines around is smooth.
        By how much the velocity is late, as one that is differenced or behind an actuator's lag, the other jumps tell.
        """
        every, line = self.unsure.every, self.log.velocity[:: self.unsure.every]
        inside = (self.unsure.at >= -WINDOW[0]) & (self.unsure.at + WINDOW[-1] < len(line))
        (jump,) = np.nonzero(self.unsure.jump & inside)
        weight, right = np.zeros((2, len(share)))
        if not np.any(blind[jump]):
            return _Seen(weight, right, 0.0)
        moved = share.copy()
        step = np.where(share[jump] < self.unsure.usual[jump], SHARE_STEP, -SHARE_STEP)
        moved[jump] += step
        (c, here), (_, other), (_, lines) = (
            replace(self.log, between=command).push(self.cascade)
            for command in (self.unsure.early(share), self.unsure.early(moved), self.log.source)
        )
        around = self.unsure.at[jump, None] + WINDOW
        parabola = np.broadcast_to(np.vander(WINDOW.astype(np.float64), SMOOTH), (len(jump), len(WINDOW), SMOOTH))

        def beside(push: Vector, x: Vector) -> Vector:
            """x around the jumps, without a parabola and what such a push takes off it."""
            basis = np.linalg.qr(np.concatenate([parabola, push[around][:, :, None]], axis=2))[0]
            rows: Vector = x[around] - (basis @ (basis.transpose(0, 2, 1) @ x[around][:, :, None]))[:, :, 0]
            return rows

        here, other, lines = (x[::every] for x in (here, other, lines))
        left, change, on_lines = beside(here, line), c * beside(here, other - here) / step[:, None], beside(lines, line)
        std = max(noise_std(line - c * here), float(np.finfo(np.float64).eps) * float(np.abs(line).max()))
        told, sure, pull = ~blind[jump], np.sum(change**2, axis=1), np.sum(change * left, axis=1)
        late = float(np.sum(pull[told]) / np.sum(sure[told])) if np.any(sure[told] > 0.0) else 0.0
        late_on_lines = float(np.sum(change * on_lines) / max(np.sum(sure), np.finfo(np.float64).tiny))
        left, on_lines = (left - late * change)[~told], (on_lines - late_on_lines * change)[~told]
        weight[jump] = np.where(told, 0.0, sure / std**2)
        right[jump] = np.where(told, 0.0, (pull - late * sure) / std**2)
        return _Seen(weight, right, float(np.sum(on_lines**2) - np.sum(left**2)) / std**2)

    def step(self, normal: csc_array, right: Vector, from_usual: Vector) -> Vector:
        """Of the shares, from the normal equations with their priors."""
        from scipy.sparse import diags_array
        from scipy.sparse.linalg import spsolve

        weight = self.unsure.spread**-2.0
        found: Vector = spsolve(normal + diags_array(weight, format="csc"), right + weight * from_usual)
        return np.atleast_1d(found)

    def log_det(self, normal: csc_array) -> float:
        """ln det(1 + S N S)."""
        from scipy.sparse import diags_array, eye_array
        from scipy.sparse.linalg import splu

        scaled = diags_array(self.unsure.spread)
        lower = splu((eye_array(normal.shape[0]) + scaled @ normal @ scaled).tocsc())
        return float(np.sum(np.log(np.abs(lower.U.diagonal()))))
