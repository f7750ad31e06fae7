"""What the logged torque says of the controller, decided without a plant: gains, limits, effects at its place.

Where the logged torque follows from command and velocity through the controller, no plant is needed to explain it.
Where it follows only with other gains, these are used. Where it follows only with a limit, that limit is a finding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, called, joined, say, unit_text
from gaident.control.controller import Controller
from gaident.control.pi import PI
from gaident.control.pi_torque import HOLDS, held_torque, pi_torque
from gaident.data.record import Record
from gaident.diagnosis.library.settings import ANTI_WINDUP, OF_SETTING
from gaident.diagnosis.library.terms import in_controller
from gaident.estimation.criterion import gained
from gaident.estimation.dataset import DataSet
from gaident.estimation.records.driven import torque_in
from gaident.estimation.term import Scales, Term
from gaident.identification.replay.causes import white_noise
from gaident.identification.replay.replay import Replay, replay
from gaident.models.effects import table
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

__all__ = ["AsLogged", "AtController", "as_logged", "controller_findings", "under_shown"]

Vector = NDArray[np.float64]

LIMITS = ("torque_limit", "integrator_limit", "anti_windup")  # causes that a replay finds
SHOWN = {
    "torque_limit": say("plateau of the logged {torque}"),
    "integrator_limit": Text("highest integral that the log shows"),
}
"""Limits of a PI that a log may show -> what shows them."""
SUM_ROUNDING = 1e-9  # no decision: of the largest torque, what a sum is exact to


@dataclass(frozen=True)
class AtController:
    """Which effects of the controller need no plant any more, and those that are there, with parameters.

    controller: the given one with the limits that were found; None: none were. follows: whether the logged torque follows from
    all that, or there is none.
    """

    decided: tuple[str, ...] = ()
    effects: dict[str, dict[str, float]] = field(default_factory=dict)
    controller: Controller | None = None
    follows: bool = True


@dataclass(frozen=True)
class AsLogged:
    """The controller as the logged torques show it, and what differs as notes and findings."""

    controller: PI | None
    notes: tuple[Text, ...] = ()
    findings: tuple[Finding, ...] = ()


def as_logged(records: Sequence[Record], controller: PI | None) -> AsLogged:
    """The controller with the gains that all logged torques show where they do not follow from the given ones.

    Where only some records have a torque, theirs says what the gains of the others are.
    A rectangular integral is a trapezoidal one with kp + ki dt/2, or kp - ki dt/2 where it lacks the newest error.
    """
    logged = [r for r in records if r.torque is not None]
    if controller is None or not logged or any(r.command is None for r in records):
        return AsLogged(controller)
    replays = [replay(r, controller) for r in logged]
    as_given = AsLogged(controller)
    off = [r for r in replays if r.follows is False]
    found = [r.controller for r in off if r.controller is not None and r.cause in ("gains", "scale", "integration_rule")]
    if not found or len(found) < len(replays):
        return as_given
    gains = np.array([[c.kp, c.ki] for c in found])
    if np.any(np.ptp(gains, axis=0) > POLICY.same_gains * gains.max(axis=0)):
        return as_given
    kp, ki = (float(g) for g in gains.mean(axis=0))
    if all(r.cause == "integration_rule" for r in off):
        same = "All simulations use kp = {:.4g} {N m s/rad}, with which a trapezoidal integral makes the same {torque}."
        used = say(same, kp)
    else:
        used = say(
            "All simulations use these (kp = {:.4g} {N m s/rad}, ki = {:.4g} {N m/rad}, trapezoidal integral) instead of the "
            "given ones ({:.4g} and {:.4g}).",
            kp,
            ki,
            controller.kp,
            controller.ki,
        )
    if all(r.cause == "scale" for r in off):
        either = (
            " The log does not say which is wrong, the gains or a factor of the {torque} (its unit, a rated {torque}, a "
            "{torque} constant). If the gains are as given, {inertia}, friction and every other {torque} below are {:.4g} times "
            "as large."
        )
        used = joined("", (used, say(either, 1.0 / abs(off[0].value))))
    shown = replace(controller, kp=kp, ki=ki)
    return AsLogged(shown, (off[0].sentence, used), (_gains_finding(logged, shown, replays),))


def _gains_finding(records: Sequence[Record], shown: PI, off: Sequence[Replay]) -> Finding:
    """The finding that the torques follow from other gains, or with another rule of integration, than the given ones."""
    n, floor, errors, left = sum(len(r) for r in records), 0.0, [], []
    for rec, seen in zip(records, off, strict=True):
        assert rec.command is not None and rec.torque is not None
        errors.append(rec.command - rec.velocity)
        left.append(rec.torque - pi_torque(rec.command, rec.velocity, rec.dt, shown))
        floor += len(rec) * max(seen.resolution, SUM_ROUNDING * float(np.abs(rec.torque).max())) ** 2
    before, after = sum(len(r) * r_off.rms**2 for r, r_off in zip(records, off, strict=True)), float(sum(d @ d for d in left))
    integrals = [records[0].dt * np.cumsum(e) for e in errors]
    std = float(np.sqrt(max(after, floor) / n))
    kp_std, ki_std = (std / max(float(np.sqrt(sum(x @ x for x in part))), 1e-300) for part in (errors, integrals))
    gains = {"kp": Estimate(shown.kp, kp_std, "N m s/rad"), "ki": Estimate(shown.ki, ki_std, "N m/rad")}
    alone = all(r.cause == "integration_rule" for r in off)
    name = "integration_rule" if alone else "other_gains"
    fall = 1.0 - float(np.sqrt(min(after / before, 1.0)))
    gain = gained(before, max(after, floor), n, 1 if alone else 2)
    return Finding(name, {} if alone else gains, (), fall, gain, None, off[0].sentence, place="controller")


def controller_findings(data: DataSet, scales: Scales, by_law: bool) -> tuple[list[Finding], AtController, list[Text]]:
    """(findings, what is decided, notes). Without a logged torque nothing is decided here.

    by_law: whether the torques follow from a law of the integral that no controller here has; all is decided then.
    """
    if by_law:
        return [], AtController(_decided()), []
    controller = data.controller
    if controller is None or not all(r.torque is not None and controller.replayable(r) for r in data.read):
        return [], AtController(), []
    replays = [replay(r, controller) for r in data.read]
    off = [r for r in replays if not r.follows]
    if not off:
        return [], AtController(_decided()), []
    said = [(rec.name or f"a record of {len(rec)} samples", r) for rec, r in zip(data.read, replays, strict=True)]
    texts = (say("{}: {}", name, r.sentence) if len(said) > 1 else r.sentence for name, r in said if not r.follows)
    notes = list(dict.fromkeys(texts))
    plain = data.replayed_error({})
    logged = np.concatenate([torque_in(r) for r in data.read])
    floor = len(plain) * max(max(r.resolution for r in replays), SUM_ROUNDING * scales.torque) ** 2
    shown = None if data.pi is None else _limits_shown(off, data.pi)
    if shown is not None:
        return _limit_findings(data, shown, off, plain, floor, notes)
    steps = (float(np.abs(np.diff(controller.asked(r), prepend=0.0)).max()) / r.dt for r in data.read)
    scales = replace(scales, acceleration=max(steps) or float("inf"))
    # A command that never changes has no slope, and shows no limit of one.
    terms = [term for term in in_controller() if np.isfinite(term.limits(scales)).all()]
    best = min(((*_fitted(data, scales, term), term) for term in terms), key=lambda found: found[1])
    value, cost, term = best
    effect = term.name
    n, before = len(plain), float(plain @ plain)
    left = data.replayed_error({term: np.array([value])})
    std = _std(data, term, value, cost)
    better = cost < POLICY.better_reason**2 * before and np.isfinite(std)  # a limit that cuts nothing explains nothing
    # A controller that winds up in the replay is off by more than the torque itself: less of that explains nothing yet.
    most = POLICY.replay_left * min(before, float(np.sum((logged - np.mean(logged)) ** 2)))
    if cost < most or (better and (cost < POLICY.replay_rms**2 * floor or white_noise(left, logged))):
        parameter = next(r for r in table() if r.name == effect).parameters[0]
        name, unit = parameter.name, parameter.unit
        text = say(
            "The logged {torque} does not follow from command and velocity (rms {:.3g} {N m}); with {} {:.4g} {} of the {} it "
            "does, to {:.2g} {N m} rms. No model of the plant is involved.",
            np.sqrt(before / n),
            name,
            value,
            unit_text(unit),
            called(effect),
            np.sqrt(cost / n),
        )
        finding = _finding(effect, name, Estimate(value, std, unit), before, cost, floor, n, text)
        limited = _with_limit(controller, effect, value)
        return [finding], AtController(_decided(), {effect: {name: value}}, limited), []
    return [], AtController(_decided(), follows=False), notes


def _with_limit(controller: Controller, effect: str, value: float) -> Controller | None:
    """The controller with the limit that an effect at its place is; None where the effect is no limit of its own."""
    torque, integrator = controller.limits
    if effect == OF_SETTING["integrator_limit"]:
        return controller.with_limits(torque, value)
    return controller.with_limits(value, integrator) if effect == OF_SETTING["torque_limit"] else None


def _decided() -> tuple[str, ...]:
    """Effects that a replay of the controller decides."""
    return tuple(t.name for t in in_controller())


def _limits_shown(off: Sequence[Replay], controller: PI) -> PI | None:
    """The controller with the limits that all replays that do not follow agree on; None where they do not, or there are none."""
    found = [r.controller for r in off if r.controller is not None and r.cause in LIMITS]
    if len(found) < len(off):
        return None
    limits = np.array([c.limits for c in found])
    low, high = limits.min(axis=0), limits.max(axis=0)
    if np.any(low < (1.0 - POLICY.same_value) * high):
        return None
    torque, clamp = (None if not np.isfinite(x) else float(x) for x in high)
    return replace(controller, torque_limit=torque, integrator_limit=clamp)


def _limit_findings(
    data: DataSet, shown: PI, off: Sequence[Replay], plain: Vector, floor: float, notes: list[Text]
) -> tuple[list[Finding], AtController, list[Text]]:
    """What the limits that the log shows are findings of; the note that the replay wrote is their evidence."""
    given = data.pi
    assert given is not None
    n, before, after = len(plain), float(plain @ plain), _left_with(data, shown)
    anti_windup = any(r.cause == "anti_windup" for r in off)
    if not anti_windup and shown.limits[1] == given.limits[1]:
        notes = []  # the finding says it all
    findings: list[Finding] = []
    effects: dict[str, dict[str, float]] = {}
    if shown.kp != given.kp and shown.ki == given.ki:  # as trapezoidal: kp + ki dt/2, or kp - ki dt/2
        gain = gained(_left_with(data, replace(shown, kp=given.kp)), max(after, floor), n, 1)
        findings.append(Finding("integration_rule", {}, (), 0.0, gain, None, off[0].sentence, place="controller"))
    for setting, words in SHOWN.items():
        effect, value, was = OF_SETTING[setting], getattr(shown, setting), getattr(given, setting)
        if value is None or value == was:
            continue
        effects[effect] = {"limit": value}
        text = say("{} The limit is the {}; no model of the plant is involved.", off[0].sentence, words)
        std = max(*(r.resolution for r in off), float(np.sqrt(after / n)))
        findings.append(_finding(effect, "limit", Estimate(value, std, "N m"), before, after, floor, n, text))
    if anti_windup:
        notes = []
        gain = gained(_left_with(data, shown, holds=False), max(after, floor), n, 1)
        findings.append(Finding(ANTI_WINDUP, {}, (), 0.0, gain, None, off[0].sentence, place="controller"))
        notes.append(
            Text(
                "The simulated controller does not hold its integrator at the limit: its free run winds up where the drive's "
                "does not, and says nothing about the mechanics there."
            )
        )
    decided = (*_decided(), *(OF_SETTING[s] for s in SHOWN))
    return findings, AtController(decided, effects, shown, follows=not anti_windup), notes


def _left_with(data: DataSet, controller: PI, holds: bool = True) -> float:
    """Squared error of the logged torques that a limited controller leaves [(N m)^2]; holds: also with an anti-windup."""
    total = 0.0
    for r in data.read:
        assert r.command is not None and r.torque is not None
        made = [pi_torque(r.command, r.velocity, r.dt, controller)]
        made += [held_torque(r.command, r.velocity, r.dt, controller, rule) for rule in HOLDS if holds]
        total += min(float(np.sum((r.torque - u) ** 2)) for u in made)
    return total


def _finding(
    effect: str, name: str, estimate: Estimate, before: float, after: float, floor: float, n: int, text: Text
) -> Finding:
    gain = gained(before, max(after, floor), n, 1)
    fall = 1.0 - float(np.sqrt(min(after / before, 1.0)))
    return Finding(effect, {name: estimate}, (), fall, gain, None, text, place="controller")


def _fitted(data: DataSet, scales: Scales, term: Term) -> tuple[float, float]:
    """(value, cost) of the effect that comes closest to the logged torque: grid, then golden section on the logarithm."""
    from scipy.optimize import minimize_scalar

    low, high = term.limits(scales)[0]

    def cost(z: float) -> float:
        e = data.replayed_error({term: np.array([np.exp(z)])})
        return float(e @ e)

    grid = np.linspace(low, high, POLICY.limits)
    costs = [cost(z) for z in grid]
    k = int(np.argmin(costs))
    bracket = (grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)])
    found = minimize_scalar(cost, bounds=bracket, method="bounded", options={"xatol": 1e-7})  # no decision: of a solver
    return (float(np.exp(found.x)), float(found.fun)) if found.fun < costs[k] else (float(np.exp(grid[k])), costs[k])


def _std(data: DataSet, term: Term, value: float, cost: float) -> float:
    """Standard deviation from the slope of the replay."""
    h = 1e-4 * value
    low, high = (data.replayed_error({term: np.array([v])}) for v in (value - h, value + h))
    slope = (high - low) / (2.0 * h)
    power = float(slope @ slope)
    return float(np.sqrt(cost / len(slope) / power)) if power > 0.0 else float("inf")


def under_shown(data: DataSet, at: AtController, closed: bool) -> DataSet:
    """The records under the controller with what the log shows of it; closed: whether a loop with it can be the drive's.

    Limits that the log shows are part of every loop that is simulated in a fit.
    """
    known: dict[Term, Vector] = {t: np.array(list(at.effects[t.name].values())) for t in in_controller() if t.name in at.effects}
    shown = at.controller or data.controller
    missing = bool(known) and data.told_by_torque and shown is data.controller  # a limit that its simulated loop would lack
    found = replace(data, controller=shown, loop_follows=at.follows and not missing and closed)
    return found if at.controller is not None else found.with_effects(known)
