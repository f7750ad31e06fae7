"""What an integral may do that no `PI` has: replayed on command and velocity at the controller's clock, no plant is involved.

    e = r - w,   u = kp (b r - w) + I,   clamped to +-L,   T the controller's period, g the rule's share of the newest error

decay       in a sample in which u is limited, I is q times what it was before that sample, 0 <= q <= 1
            (ODrive: q = 0.99, its decay factor in Firmware/MotorControl/controller.cpp; q = 1: held in every limited sample)
dead band   abs(e) <= d counts as 0; of a larger error all of it, or what it is beyond d
reset       I begins at 0 in a sample in which the command changes its sign, or is 0, or in which e changes its sign
            (the last one: Clegg 1958)

The number is that with the least squares of logged minus made torque at the lines, without its correlation from line to line.
A law is shown where what is left is no more than what the velocity between the lines can make (`logged_torque.off_by`).
Of a log with a line for each of the controller's samples nothing is lost: a law is shown where the torques follow to the rounding
of the log (`replay.Allowed`), or to white noise of a torque that was measured.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, MutableMapping, Sequence
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Cascade
from gaident.control.pi import PI, RULES
from gaident.control.simplest import simplest
from gaident.control.smoothing import expected_at
from gaident.control.ticks import straight_between
from gaident.data.record import Record
from gaident.data.torque_kind import MEAN, MEASURED
from gaident.identification.logged_stretches import Log, log_of, plateau_of
from gaident.identification.logged_torque import comparable, not_followed, off_by, tells_of_controller
from gaident.identification.replay.causes import white_noise
from gaident.identification.replay.replay import Allowed, replay, velocity_steps
from gaident.policy.table import POLICY

__all__ = ["DEAD_BAND", "DECAY", "RESET", "Scheme", "SchemeShown", "scheme_shown"]

Vector = NDArray[np.float64]

DECAY, DEAD_BAND, RESET = "decay", "dead band", "reset"
LOST = np.append(0.0, np.geomspace(1e-4, 0.5, 16))  # no decision: a grid: of 1 - q
ROUNDS = 2  # no decision: of a solver: how many steps, a third one changes nothing
SEARCHED = 50_000  # no decision: samples of a record that a number is searched in; all of them have to follow
BANDS = np.geomspace(1e-4, 0.5, 24)  # no decision: a grid: of the largest error


@dataclass(frozen=True)
class Scheme:
    """One law; number: q of a decay, d of a dead band [rad/s]; variant: what `VARIANTS` says."""

    kind: str
    variant: str
    number: float = 0.0

    def torque(self, pi: PI, command: Vector, velocity: Vector, period: float, noise: Vector) -> Vector:
        """Of signals at the controller's samples [rad/s] (n,), from rest: the torque there [N m] (n,).

        noise: deviation of what a velocity there lacks of what the controller read [rad/s] (n,).
        """
        assert pi.kp is not None and pi.ki is not None and pi.command_weight is not None
        error = command - velocity
        if self.kind == DEAD_BAND:
            error = _outside(error, self.number, self.variant == "beyond", noise)
        proportional = pi.kp * (error + (pi.command_weight - 1.0) * command)
        newest = RULES[pi.rule]
        steps = pi.ki * period * (newest * error + (1.0 - newest) * np.append(0.0, error[:-1]))
        limit = pi.limits[0]
        if self.kind == DECAY:
            return _decaying(proportional, steps, limit, self.number, newest == 0.0)
        integral = np.cumsum(steps)
        if self.kind == RESET:
            begins = np.flatnonzero(_resets(self.variant, command, error))
            before = np.append(0.0, integral)[begins]
            lasting = np.diff(np.concatenate([begins, [len(error)]]))
            integral[begins[0] if len(begins) else len(error) :] -= np.repeat(before, lasting)
        return np.clip(proportional + integral, -limit, limit)


VARIANTS = {DECAY: ("",), DEAD_BAND: ("whole", "beyond"), RESET: ("command reverses", "command is 0", "error reverses")}
"""Kind -> its variants."""


def _outside(error: Vector, width: float, beyond: bool, noise: Vector) -> Vector:
    """What of an error counts outside of a dead band (n,); where noise of this deviation v is on it, its expectation:

    E(x; x > d) = e (1 - P(a)) + v p(a),   a = (d - e)/v,   P, p: of the standard normal distribution; the other end likewise
    """
    from scipy.special import ndtr

    over = error - np.clip(error, -width, width)
    made: Vector = over if beyond else np.where(over != 0.0, error, 0.0)
    unsure = noise > 0.0
    e, v = error[unsure], noise[unsure]
    above, below = (width - e) / v, (-width - e) / v
    density = v * (np.exp(-0.5 * above**2) - np.exp(-0.5 * below**2)) / np.sqrt(2.0 * np.pi)
    lost = width if beyond else 0.0
    made[unsure] = (e - lost) * ndtr(-above) + (e + lost) * ndtr(below) + density
    return made


def _decaying(proportional: Vector, steps: Vector, limit: float, kept: float, late: bool) -> Vector:
    """u of an integral of which only a share is kept in each limited sample, whose own error it does not add.

    late: whether each step is the error of the sample before, as where the integral moves behind the torque.
    """
    integral, was, made = 0.0, False, []
    for p, step in zip(proportional.tolist(), steps.tolist(), strict=True):
        now = integral if late and was else integral + step
        u = p + now
        was = u > limit or u < -limit
        if was:
            integral = kept * (now if late else integral)
            made.append(limit if u > limit else -limit)
        else:
            integral = now
            made.append(u)
    return np.array(made)


def _resets(variant: str, command: Vector, error: Vector) -> NDArray[np.bool_]:
    if variant == "command is 0":
        return np.asarray(command == 0.0)
    signal = command if variant == "command reverses" else error
    sign = np.sign(signal)
    at = np.maximum.accumulate(np.where(sign != 0.0, np.arange(len(sign)), 0))
    last = sign[at]  # of the last value that is not 0
    return np.append(False, last[1:] * last[:-1] < 0.0)


@dataclass(frozen=True)
class SchemeShown:
    """A law from which the logged torques follow, beside these gains, rule and limit.

    std: of its number. samples: lines that were compared. before, left: rms of logged minus made torque [N m], of the given
    controller, or with what a `PI` has at that limit, and with the law. closer: whether the torques follow from that, too.
    """

    scheme: Scheme
    controller: Cascade
    std: float
    before: float
    left: float
    samples: int
    closer: bool = False

    def made(self, rec: Record) -> Vector:
        """The torque at the controller's samples [N m] (n r,)."""
        return _made(self.scheme, self.controller, _log_of(rec, self.controller))


_KEPT: MutableMapping[Record, dict[tuple[object, ...], SchemeShown | None]] = WeakKeyDictionary()


def scheme_shown(records: Sequence[Record], controller: Cascade) -> SchemeShown | None:
    """The law beside a velocity controller without filters and feedforward that makes the logged torques; or None.

    What `PI` has is not looked for: its integral is not held or tracked, and has no clamp of its own.
    Of a controller that holds its integral, and from which the torques follow, a decay is told that comes closer: it differs by
    little in each limited sample, and what a slow log lost hides that.
    The answer is kept for as long as the first record is.
    """
    if not records:
        return None
    kept = _KEPT.setdefault(records[0], {})
    key = (*(r.digest for r in records[1:]), controller)
    if key not in kept:
        kept[key] = _shown(records, controller)
    return kept[key]


def _shown(records: Sequence[Record], controller: Cascade) -> SchemeShown | None:
    pi = replace(controller.velocity.winding_up, integrator_limit=None)
    bare = Cascade(pi, controller.period, delay=controller.delay)
    plain = replace(controller, velocity=replace(pi, torque_limit=controller.velocity.torque_limit)) == bare
    at_rate = all(bare.log_every(r.dt) == 1 for r in records)
    told = tells_of_controller if at_rate else comparable
    if not plain or any(r.torque_log == MEAN or not told(r, bare) for r in records):
        return None
    alone = simplest(controller, (r.dt for r in records))
    if at_rate and all(one.follows or one.cause or one.velocity_noise for one in (replay(r, alone) for r in records)):
        return None
    closer = not at_rate and not not_followed(records, controller)
    if closer and controller.velocity.anti_windup != "hold":
        return None
    if pi.torque_limit is None:
        plateau = plateau_of(np.concatenate([np.abs(r.torque) for r in records if r.torque is not None]))
        pi = replace(pi, torque_limit=plateau if np.isfinite(plateau) else None)
        bare = replace(bare, velocity=pi)
    whole = [_log_of(r, bare) for r in records]
    logs = [_log_of(r[:SEARCHED], bare) for r in records] if at_rate else whole
    if closer and max(float(np.abs(log.torque).max()) for log in logs) < POLICY.at_limit * pi.limits[0]:
        return None
    at_limit = [] if pi.torque_limit is None else [replace(pi, anti_windup="hold")]
    known = [controller, bare, *(replace(bare, velocity=one) for one in at_limit)]
    if at_rate and any(
        all(_follows_exactly(r, log, log.made(one), one) for r, log in zip(records, whole, strict=True)) for one in known
    ):
        return None  # what a `PI` has explains the torques
    before = min(_rms([log.torque - log.made(one) for log in logs]) for one in known)
    kinds = _kinds(pi, closer)
    found = min((_fitted(logs, kind, variant, bare) for kind, variant in kinds), key=lambda one: one[0], default=None)
    if found is None:
        return None
    left, scheme = found
    if closer and not left < before:
        return None
    for rule in [] if closer else [rule for rule in RULES if rule != pi.rule]:  # the torques follow with the one that is given
        other = replace(bare, velocity=replace(pi, rule=rule))
        again = _fitted(logs, scheme.kind, scheme.variant, other)
        if again[0] < POLICY.each_number * left:
            (left, scheme), bare = again, other
    scheme, std = _number(logs, scheme, bare, at_rate)
    if at_rate:
        scheme, std = _as_the_log_tells(records, whole, scheme, bare, std)
    left = _rms(_left(logs, scheme, bare))
    of_one = _exact if at_rate else _follows
    follows = closer or all(of_one(rec, log, scheme, bare) for rec, log in zip(records, whole, strict=True))
    decays = not closer or 1.0 - scheme.number > POLICY.check_deviations * std
    part = float(np.sqrt(POLICY.replay_left)) if at_rate else POLICY.each_number
    if not (follows and decays and left < part * before):
        return None
    return SchemeShown(scheme, bare, std, before, left, sum(len(log.torque) for log in logs), closer)


def _follows(rec: Record, log: Log, scheme: Scheme, controller: Cascade) -> bool:
    """Whether the torque of a slower log follows, as far as its lines can tell."""
    return off_by(rec, log, controller, lambda one, straight: _made(scheme, controller, one, straight)[:: _every(one)]) == 0.0


def _exact(rec: Record, log: Log, scheme: Scheme, controller: Cascade) -> bool:
    """Whether the torque of a log at the controller's rate follows, as one that is replayed has to (`replay`)."""
    return _follows_exactly(rec, log, _made(scheme, controller, log), controller)


def _follows_exactly(rec: Record, log: Log, made: Vector, controller: Cascade) -> bool:
    """The same of any torque (n,) [N m]; controller: whose gains and limits say what rounding makes."""
    pi, off = controller.velocity, log.torque - made
    measured = rec.torque_is == MEASURED and white_noise(off, log.torque) > 0.0
    return measured or any(one(off, pi.limits) for one in _allowed(rec, log, pi))


def _allowed(rec: Record, log: Log, pi: PI) -> list[Allowed]:
    return [Allowed.of(rec, log.command, pi, log.torque, step) for (step,) in velocity_steps([rec])]


def _as_the_log_tells(
    records: Sequence[Record], logs: Sequence[Log], scheme: Scheme, controller: Cascade, std: float
) -> tuple[Scheme, float]:
    """(the law, the deviation of its number) of a log with every sample, by what its rounding leaves open.

    An integral that is held, where the torques follow from that too.
    A dead band that counts all of a larger error lies anywhere between two errors that occur.
    Another number is told by the torque only where what it changes is more than rounding may make.
    """
    if scheme.kind == RESET:
        return scheme, std
    held = Scheme(DECAY, "", 1.0)
    if scheme.kind == DECAY and all(_exact(r, log, held, controller) for r, log in zip(records, logs, strict=True)):
        return held, 0.0
    if scheme.variant == "whole":
        sizes = np.sort(np.concatenate([np.abs(log.command - log.velocity) for log in logs]))
        at = int(np.searchsorted(sizes, scheme.number))
        low, high = float(sizes[max(at - 1, 0)]), float(sizes[min(at, len(sizes) - 1)])
        # no decision: a formula: an even distribution
        return replace(scheme, number=0.5 * (low + high)), max(std, (high - low) / float(np.sqrt(12.0)))
    step = _step(scheme)
    up, down = (replace(scheme, number=scheme.number + by) for by in (step, -step))
    slope = np.concatenate([(_made(up, controller, log) - _made(down, controller, log)) / (2.0 * step) for log in logs])
    power = float(np.sqrt(np.mean(slope**2)))
    rounding = max(min(one.torque for one in _allowed(r, log, controller.velocity)) for r, log in zip(records, logs, strict=True))
    return scheme, max(std, rounding / power) if power > 0.0 else np.inf


def _kinds(pi: PI, decays: bool) -> Iterator[tuple[str, str]]:
    """What may be: an integral decays at a limit only; decays: nothing else is asked for."""
    for kind, variants in VARIANTS.items():
        if (kind == DECAY and pi.torque_limit is not None) or (kind != DECAY and not decays):
            yield from ((kind, variant) for variant in variants)


def _log_of(rec: Record, controller: Cascade) -> Log:
    return log_of(rec, len(rec), controller, True).pushed(controller)


def _every(log: Log) -> int:
    return len(log.velocity) // len(log.source)


def _made(scheme: Scheme, controller: Cascade, log: Log, straight: bool = False) -> Vector:
    """The torque at the controller's samples [N m] (n r,)."""
    every = _every(log)
    line = log.velocity[::every]
    velocity = straight_between(line, every) if straight else log.velocity
    noise = np.full(len(velocity), float(np.std(line - expected_at(line))))
    noise[::every] = 0.0  # a line has what the controller read
    return scheme.torque(controller.velocity, log.command, velocity, log.dt / every, noise)


def _fitted(logs: Sequence[Log], kind: str, variant: str, controller: Cascade) -> tuple[float, Scheme]:
    """(rms of logged minus made torque [N m], the law with the number that leaves least)."""

    def left(number: float) -> float:
        return _rms(_left(logs, Scheme(kind, variant, number), controller))

    if kind == RESET:
        return left(0.0), Scheme(kind, variant)
    if kind == DECAY:
        return _least(lambda lost: left(1.0 - lost), LOST, lambda lost: Scheme(kind, variant, 1.0 - lost))
    largest = max(float(np.abs(log.command - log.velocity).max()) for log in logs)
    return _least(left, BANDS * largest, lambda width: Scheme(kind, variant, width))


def _number(logs: Sequence[Log], scheme: Scheme, controller: Cascade, at_rate: bool) -> tuple[Scheme, float]:
    """(the law with its number by c(k) = d(k) - rho d(k-1), d: logged minus made torque, its deviation).

    What the velocity did between the lines adds up in d (Cochrane and Orcutt 1949).
    scheme: with the number that leaves least without rho.
    The deviation contains what a velocity that goes straight between the lines, another rule of integration, no correlation, and
    only the lines within the torque's limit would change: one step of the integral, of a sample more or less before the limit,
    comes back at each way out of it. A log at the controller's rate shows the rule, too.
    """
    if scheme.kind == RESET:
        return scheme, 0.0
    rho, uncorrelated = 0.0, scheme.number

    def of(number: float) -> Scheme:
        return replace(scheme, number=number)

    def nearest(beside: Cascade, shown: Sequence[NDArray[np.bool_]] | None = None) -> Scheme:
        def error(number: float) -> float:
            off = _left(logs, of(number), beside)
            parts = off if shown is None else [d[there] for d, there in zip(off, shown, strict=True)]
            return _rms([d[1:] - rho * d[:-1] for d in parts])

        grid = scheme.number + _step(scheme) * np.linspace(-20.0, 20.0, 41)  # no decision: a grid
        if scheme.kind == DECAY:
            grid = np.clip(grid, 0.0, 1.0) if shown is None else np.union1d(np.clip(grid, 0.0, 1.0), 1.0 - LOST)
        return _least(error, grid, of)[1]

    for _ in range(ROUNDS):
        left = _left(logs, scheme, controller)
        power = sum(float(d @ d) for d in left)
        together = sum(float(d[1:] @ d[:-1]) for d in left)
        rho = float(np.clip(together / power, 0.0, 1.0)) if power > 0.0 else 0.0
        scheme = nearest(controller)
    others = [] if at_rate else [replace(controller, velocity=replace(controller.velocity, rule=rule)) for rule in RULES]
    by_rule = max((abs(nearest(other).number - scheme.number) for other in others), default=0.0)
    limit = POLICY.at_limit * controller.velocity.limits[0]
    shown, within = [np.abs(log.torque) < limit for log in logs], 0.0
    if scheme.kind == DECAY and not at_rate and any(one.any() for one in shown):
        within = nearest(controller, shown).number - scheme.number

    def made(by: float = 0.0, straight: bool = False) -> Vector:
        torques = (_made(of(scheme.number + by), controller, log, straight)[:: _every(log)] for log in logs)
        return np.concatenate([u[1:] - rho * u[:-1] for u in torques])

    step, here = _step(scheme), made()
    slope = (made(step) - made(-step)) / (2.0 * step)
    power = float(slope @ slope)
    if not power > 0.0:
        return scheme, float("inf")
    straight = float(slope @ (made(straight=True) - here)) / power
    left_of = _rms([d[1:] - rho * d[:-1] for d in _left(logs, scheme, controller)])
    other = straight**2 + by_rule**2 + within**2 + (scheme.number - uncorrelated) ** 2
    return scheme, float(np.sqrt(left_of**2 / power + other))


def _step(scheme: Scheme) -> float:
    """A small part of its number, or of what a decay loses: the step of a difference."""
    lost = max(1.0 - scheme.number, LOST[1]) if scheme.kind == DECAY else scheme.number
    return 1e-2 * lost  # no decision: the step of a difference


def _least(error: Callable[[float], float], grid: Vector, made: Callable[[float], Scheme]) -> tuple[float, Scheme]:
    """The best of a grid, and the minimum between its neighbours."""
    from scipy.optimize import minimize_scalar

    values = [error(float(x)) for x in grid]
    best = int(np.argmin(values))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    # no decision: of a solver
    found = minimize_scalar(error, bounds=(low, high), method="bounded", options={"xatol": 1e-6 * (high - low)})
    return min((values[best], made(float(grid[best]))), (float(found.fun), made(float(found.x))), key=lambda one: one[0])


def _left(logs: Sequence[Log], scheme: Scheme, controller: Cascade) -> list[Vector]:
    """Logged minus made torque at the lines [N m]."""
    return [log.torque - _made(scheme, controller, log)[:: _every(log)] for log in logs]


def _rms(parts: Sequence[Vector]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
