"""Why a logged torque does not follow from command and velocity: the simple reasons, simplest first."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, joined, say
from gaident.control.filtering import filtered, rate_limited
from gaident.control.pi import PI
from gaident.control.pi_torque import HOLDS, held_torque, pi_torque
from gaident.identification.adequacy import white_lags
from gaident.identification.noise import chi2_tail, ljung_box
from gaident.policy.table import POLICY

__all__ = ["Explanation", "beside_spikes", "control_error", "explain", "rounded_command", "under_load", "white_noise"]

Vector = NDArray[np.float64]

SUM_ROUNDING = 1e-9  # no decision: of the largest torque, what a sum is exact to
Allows: TypeAlias = Callable[[Vector, tuple[float, float], int], bool]
"""Whether what is off [N m] under limits of torque and integrator, from a sample on, is no more than rounding."""

# By how much of ki dt the newest error counts more than half, and the one before less: the rule of integration in words.
RULES = {0.0: "", 0.5: "a rectangular integral", -0.5: "a rectangular integral that lacks the newest error"}
RARE = 100  # no decision: a formula: one of so many samples
RPM = 30.0 / np.pi  # no decision: a unit: rpm in 1 rad/s


@dataclass(frozen=True, eq=False)
class Explanation:
    """A changed controller; its torque [N m], shape (n,), but for `edge` samples at both ends. Cause and value as in `Replay`.

    controller: the changed one, where a PI has what was changed.
    """

    torque: Vector
    cause: str
    value: float
    sentence: Text
    edge: int = 0
    changes: int = 1  # how many settings differ from the configured controller; the fewer the better
    controller: PI | None = None

    def off(self, logged: Vector) -> Vector:
        """Logged minus explained torque [N m], without the edges."""
        return (logged - self.torque)[self.edge : len(logged) - self.edge]


class _Gains(NamedTuple):
    """Gains as a fit gives them, of either sign: those of a PI are not negative."""

    kp: float  # N m s/rad
    ki: float  # N m/rad


class _Case(NamedTuple):
    """The data that every reason is checked against."""

    command: Vector
    velocity: Vector
    dt: float
    controller: PI
    logged: Vector

    def torque(self, controller: PI, start: float = 0.0) -> Vector:
        return pi_torque(self.command, self.velocity, self.dt, controller, start)


def explain(command: Vector, velocity: Vector, dt: float, controller: PI, logged: Vector, allowed: Allows) -> Explanation | None:
    """The first reason that leaves only rounding as `allowed` says; else the best one, if it leaves white noise."""
    case = _Case(command, velocity, dt, controller, logged)
    best, least = None, np.inf
    for reason in (_start, _limits, _anti_windup, _rate, _linear):
        for found in reason(case):
            off = found.off(logged)
            used = found.controller or controller
            if allowed(off, used.limits, found.edge) or rounded_command(off, command, dt, used):
                return found
            rms = float(np.sqrt(np.mean(off**2)))
            if rms < POLICY.better_reason * least:  # a later, more complicated reason must be better
                best, least = found, rms
    return best if best is not None and white_noise(best.off(logged), logged) else None


def rounded_command(off: Vector, command: Vector, dt: float, controller: PI) -> bool:
    """Whether the error `off` [N m] is that of a command which is off by no more than the decimals of a log.

    A command that is held has the same error for as long, which adds up in the integrator.
    The error d(n) of the command that makes off(n), h = ki dt/2:

        off(n) - off(n-1) = (kp + h) d(n) - (kp - h) d(n-1)
    """
    d = control_error(off, controller, dt)
    return d is not None and float(np.abs(d).max()) <= POLICY.rounded_command * float(np.abs(command).max())


def control_error(torque: Vector, controller: PI, dt: float) -> Vector | None:
    """The control error e [rad/s] that makes this torque u [N m], h = ki dt/2:

        (kp + h) e(n) = (kp - h) e(n-1) + u(n) - u(n-1)

    Both are 0 before the record. None where a limit hides it, or where the recursion is unstable.
    """
    kp, h = controller.kp, 0.5 * controller.ki * dt  # no decision: a formula: the trapezoidal rule
    if kp <= h or controller.limited:
        return None
    rise = np.array([1.0, -1.0]) / (kp + h)
    decay = np.array([1.0, (h - kp) / (kp + h)])
    error: Vector = filtered(rise, decay, torque[None, :], [len(torque)])[0]
    return error


def white_noise(off: Vector, logged: Vector) -> float:
    """Standard deviation [N m] of `off` where it is white noise small against the torque; 0.0 where it is not.

    Noise is everywhere.
    What a filter that the controller lacks makes of rare steps may pass a test of whiteness, but few samples hold its squares.
    """
    spread = float(np.std(off))
    if not spread < POLICY.replay_noise * float(np.std(logged)) or _rare(off):
        return 0.0
    centred = chi2_tail(len(off) * (float(np.mean(off)) / max(spread, 1e-300)) ** 2, 1) > POLICY.test_level
    return spread if centred and ljung_box([off], white_lags([len(off)])) > POLICY.test_level else 0.0


def beside_spikes(off: Vector, logged: Vector) -> float:
    """Standard deviation [N m] of `off` without its largest hundredth where that is spikes of a measured torque; 0.0 where not.

    All of it is white then, and so is the rest: of what a filter makes of steps the rest is not, and of a limit it is 0.
    """
    spread = float(np.std(off))
    if not spread < POLICY.replay_noise * float(np.std(logged)) or ljung_box([off], white_lags([len(off)])) <= POLICY.test_level:
        return 0.0
    rest = off.copy()
    rest[np.argsort(np.abs(off))[-_most(off) :]] = 0.0
    return white_noise(rest, logged)


def _rare(off: Vector) -> bool:
    """Whether the largest hundredth of samples holds more than `rare_errors` of the squares."""
    squares = np.sort(off**2)
    return float(np.sum(squares[-_most(off) :])) > POLICY.rare_errors * float(np.sum(squares))


def _most(off: Vector) -> int:
    """A hundredth of the samples."""
    return max(len(off) // RARE, 1)


def _start(case: _Case) -> Iterator[Explanation]:
    """A record that starts under load: the integral is not 0 where it begins."""
    start = float(np.median(case.logged - case.torque(case.controller)))
    yield under_load(case.torque(case.controller, start), start)


def under_load(torque: Vector, start: float) -> Explanation:
    """The explanation of a torque [N m] that is made with so much in the integrator before the record [N m]."""
    sentence = say("with {:.4g} {N m} in the integrator at the record's start: the record begins under load.", start)
    return Explanation(torque, "initial_integral", start, sentence)


def _limits(case: _Case) -> Iterator[Explanation]:
    """Clamps that are not configured act where the log shows their plateaus."""
    controller, highest = case.controller, float(np.abs(case.logged).max())
    if not highest > 0.0:
        return
    for limited in _limited(case):
        limit = float(limited.limits[0])
        for share, words in _rules(controller):
            alike = _trapezoidal(limited, share, case.dt)
            torque = case.torque(alike)
            acting = _acting(torque, limit)
            if (share and acting < POLICY.plateau) or not _cuts(case, torque, share):  # the largest torque has another reason
                continue
            sentence = say("It does with {}a {torque} limit of {:.4g} {N m}, which acts at {} samples.", words, limit, acting)
            yield Explanation(torque, "torque_limit", limit, sentence, controller=alike)
    proportional = controller.kp * (case.command - case.velocity)
    for torque_limit in (controller.torque_limit, highest):
        free = np.ones(len(proportional), bool) if torque_limit is None else np.abs(case.logged) < POLICY.at_limit * torque_limit
        clamp = float(np.abs((case.logged - proportional)[free]).max(initial=0.0))
        if not clamp > 0.0:
            continue
        limited = replace(controller, torque_limit=torque_limit, integrator_limit=clamp)
        torque = case.torque(limited)
        more = "" if torque_limit == controller.torque_limit else say(" and a {torque} limit of {:.4g} {N m}", torque_limit)
        acting = int(np.sum(np.abs(torque - proportional) >= POLICY.at_limit * clamp))
        if not acting:
            continue
        sentence = say("It does with the integral clamped to {:.4g} {N m}{}; the clamp acts at {} samples.", clamp, more, acting)
        yield Explanation(torque, "integrator_limit", clamp, sentence, controller=limited)


def _limited(case: _Case) -> list[PI]:
    """The controller with limits that are not configured: the log's highest torque, the middle of its noisy plateau."""
    size = np.abs(case.logged)
    highest = float(size.max())
    if case.controller.torque_limit is not None and highest >= POLICY.at_limit * case.controller.torque_limit:
        return []
    middle = float(np.median(size[size > POLICY.noisy_plateau * highest]))
    return [replace(case.controller, torque_limit=limit) for limit in dict.fromkeys((highest, middle))]


def _rules(controller: PI) -> Iterator[tuple[float, str]]:
    """(share, words to go before others) of the rules of integration; only one rule without an integral gain."""
    for share, words in RULES.items():
        if share == 0.0 or controller.ki:
            yield share, f"{words} and " if words else ""


def _trapezoidal(controller: PI, share: float, dt: float) -> PI:
    """The PI whose trapezoidal integral does, within the limits, what this one does with a rule of that share."""
    return replace(controller, kp=max(controller.kp + share * controller.ki * dt, 0.0))


def _cuts(case: _Case, torque: Vector, share: float) -> bool:
    """Whether a limited torque comes closer than that of the same rule of integration without this limit, which is not exact."""
    without = case.logged - case.torque(_trapezoidal(case.controller, share, case.dt))
    if float(np.abs(without).max()) <= SUM_ROUNDING * float(np.abs(case.logged).max()):
        return False
    return float(np.sum((case.logged - torque) ** 2)) < POLICY.better_reason**2 * float(np.sum(without**2))


def _acting(torque: Vector, limit: float) -> int:
    return int(np.sum(np.abs(torque) >= POLICY.at_limit * limit))


def _anti_windup(case: _Case) -> Iterator[Explanation]:
    """A torque limit, configured or seen as a plateau of the log, at which the integrator does not wind up."""
    if not case.controller.ki or not np.any(case.logged):
        return
    for limited in _limited(case) or [case.controller]:
        limit = float(limited.limits[0])
        for share, integral in _rules(limited):
            for rule, words in HOLDS.items():
                torque = held_torque(case.command, case.velocity, case.dt, limited, rule, share=share)
                acting = _acting(torque, limit)
                if acting < POLICY.plateau or not _cuts(case, torque, share):
                    continue
                text = "It does with {}{} (anti-windup): the limit of {:.4g} {N m} acts at {} samples."
                sentence = say(text, integral, words, limit, acting)
                alike = _trapezoidal(limited, share, case.dt)
                yield Explanation(torque, "anti_windup", limit, sentence, controller=alike)


def _rate(case: _Case) -> Iterator[Explanation]:
    """A rate limit ahead of the controller: the command it must have seen, solved from the torque,

        u(n) - u(n-1) = (kp + h) e(n) - (kp - h) e(n-1),  h = ki dt/2,  r(n) = e(n) + w(n),

    moves with the slope of the limit where it is not the logged one.
    """
    error = control_error(case.logged, case.controller, case.dt)
    if error is None:
        return
    seen = error + case.velocity
    behind = np.abs(seen - case.command)[1:] > POLICY.negligible * float(np.abs(case.command).max())
    slopes = np.abs(np.diff(seen))[behind] / case.dt
    if len(slopes) == 0:
        return
    middle = float(np.median(slopes))
    near = slopes[np.abs(slopes - middle) <= POLICY.same_slope * middle]
    if len(near) == 0 or not middle > 0.0:
        return
    rate = float(np.mean(near))
    for start in (float(case.command[0]), 0.0):
        limited = rate_limited(case.command, rate, case.dt, start)
        torque = pi_torque(limited, case.velocity, case.dt, case.controller)
        sentence = say("It does with the command limited to a slope of {:.4g} {rad/s^2} ahead of the controller.", rate)
        yield Explanation(torque, "command_rate", rate, sentence)


def _linear(case: _Case) -> Iterator[Explanation]:
    """u(n) = kp' e(n - shift) + ki' dt sum e + I0 by least squares, for every rule of integration and shift.

    A rectangular integral is a trapezoidal one with kp + ki dt/2 or kp - ki dt/2: what keeps the configured gains comes first.
    """
    yield from sorted(_fitted(case), key=lambda found: found.changes)


def _fitted(case: _Case) -> Iterator[Explanation]:
    top = case.controller.limits[0]
    # Samples by which what the controller saw may be older (+) than the log's.
    for shift in (0, *(s for k in range(1, POLICY.log_late + 1) for s in (k, -k))):
        e = _shifted(case.command - case.velocity, shift)
        for share, _ in _rules(case.controller):
            columns = [e, case.dt * _sum(e, share), np.ones(len(e))] if case.controller.ki else [e, np.ones(len(e))]
            table = np.column_stack(columns)
            used = np.abs(case.logged) < POLICY.at_limit * top
            used[: abs(shift)] = used[len(used) - abs(shift) :] = False
            sizes = np.linalg.norm(table[used], axis=0)
            if not np.all(sizes > 0.0):
                continue
            solved = np.linalg.lstsq(table[used] / sizes, case.logged[used], rcond=1e-12)[0] / sizes
            torque = np.clip(table @ solved, -top, top)
            gains = _Gains(kp=float(solved[0]), ki=float(solved[1]) if case.controller.ki else 0.0)
            yield _named(case.controller, gains, case.dt, float(solved[-1]), shift, share, torque)


def _named(controller: PI, gains: _Gains, dt: float, start: float, shift: int, share: float, torque: Vector) -> Explanation:
    """Says what of a fitted controller differs from the configured one."""
    kp, ki = gains.kp, gains.ki
    differs: list[str] = []
    cause, value = "", np.nan
    if shift:
        age = "older" if shift > 0 else "newer"
        differs.append(f"command and velocity {abs(shift)} sample{'s' if abs(shift) > 1 else ''} {age} than the log's")
        cause, value = "shift", float(shift)
    if share:
        differs.append(RULES[share])
        cause = cause or "integration_rule"
    factors = [found / given for found, given in ((kp, controller.kp), (ki, controller.ki)) if given]
    fitted_kp = abs(kp) > POLICY.same_value * ki and not controller.kp
    if any(abs(f - 1.0) > POLICY.same_value for f in factors) or fitted_kp:
        if max(factors) - min(factors) <= POLICY.same_value * abs(factors[0]) and not fitted_kp:
            turned = " (a reversed sign)" if factors[0] < 0.0 else ""
            differs.append(say("its {torque} multiplied by {:.5g}{}: {}", factors[0], turned, _check_unit(factors[0])))
            cause, value = "scale", factors[0]
        else:
            differs.append(say("kp = {:.4g} {N m s/rad} and ki = {:.4g} {N m/rad}", kp, ki))
            cause, value = "gains", np.nan
    if abs(start) > POLICY.negligible * float(np.abs(torque).max()):
        differs.append(say("an integral that starts at {:.4g} {N m}", start))
        if not cause:
            cause, value = "initial_integral", start
    sentence = say("It does with {}.", joined(", and ", differs or ["these gains"]))
    same_kp = kp + share * ki * dt  # of a trapezoidal integral
    known = cause in ("gains", "scale", "integration_rule") and same_kp >= 0.0 and ki >= 0.0 and same_kp + ki > 0.0
    found = replace(controller, kp=same_kp, ki=ki) if known else None
    return Explanation(torque, cause or "gains", value, sentence, abs(shift), len(differs) + 2 * (cause in ("", "gains")), found)


def _check_unit(factor: float) -> Text:
    units = say("check the units of the {torque}, of the speeds and of the gains")
    if abs(factor * RPM - 1.0) <= POLICY.same_value:
        return Text("speeds in rpm seem to be taken for rad/s; check their unit", units.linear)
    return units


def _sum(e: Vector, share: float) -> Vector:
    return np.cumsum(e) - (0.5 - share) * e


def _shifted(x: Vector, shift: int) -> Vector:
    """x(n - shift); what lies beyond the ends repeats them."""
    if shift == 0:
        return x
    if shift > 0:
        return np.concatenate([np.full(shift, x[0]), x[:-shift]])
    return np.concatenate([x[-shift:], np.full(-shift, x[-1])])
