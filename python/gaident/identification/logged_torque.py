"""Whether the torque of a log that is slower than its controller follows from command and velocity through that controller.

The controller runs at its own clock on the logged signals; d is the logged torque minus what it makes at the lines of the log.
What the velocity did between the lines is lost: d is compared with what other interpolations of it make of the torque,

    a straight line instead of a cubic spline, and that spline with white noise between the lines, as large as that at the lines,

which the integrator adds up: all three without their correlation from line to line, rho (Cochrane and Orcutt 1949).
An anti-windup at a limit decides also at samples between the lines whether the integral changes.
So the integral after a limit is uncertain by its change in one line where the torque reaches the limit,
and by that in one line where it leaves it: 2 ki dt |e| together. Only stretches between limits are compared.

Where it does not follow, one number of the controller at a time is estimated from the same signals, as one that is not known
(`corrected`). Identification and diagnosis use what comes out. No plant is involved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, joined, say, unit_text
from gaident.control.cascade import FEEDFORWARDS, Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.control.filters import LowPass
from gaident.control.found import FoundNumbers
from gaident.control.pi import RULES
from gaident.control.position import P
from gaident.control.ticks import smooth_between
from gaident.data.record import Record
from gaident.data.signals.lattice import rounding_step
from gaident.errors import GaidentError
from gaident.identification.controller_numbers import Numbers, with_estimates
from gaident.identification.logged_stretches import Log, centred, correlation, log_of, whitened
from gaident.identification.number_words import read_as
from gaident.identification.replay.driven_records import follows_not, torque_driven
from gaident.models.starts import noise_std, starts_moving
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = [
    "Corrected",
    "comparable",
    "corrected",
    "noise_between",
    "not_followed",
    "off_by",
    "smoothed_again",
    "tells_of_controller",
]

Vector = NDArray[np.float64]


def not_followed(records: Sequence[Record], controller: Controller | None) -> tuple[Text, ...]:
    """A sentence for each record whose logged torque does not follow from this controller; () where none can be compared.

    Compared are logs slower than the controller that start at rest and contain what it reads.
    """
    if controller is None:
        return ()
    doubts = []
    for rec in records:
        if not comparable(rec, controller):
            continue
        assert rec.torque is not None
        off = _off(rec, controller)
        if off > 0.0:
            size = float(np.sqrt(np.mean(rec.torque**2)))
            doubts.append(follows_not(rec.name if len(records) > 1 else "", off, size))
    return tuple(doubts)


def comparable(rec: Record, controller: Controller) -> bool:
    """Whether a record that is slower than this controller starts at rest and contains torque and all that it reads."""
    return controller.log_every(rec.dt) > 1 and tells_of_controller(rec, controller)


def tells_of_controller(rec: Record, controller: Controller) -> bool:
    """Whether a record starts at rest and contains the torque and all that this controller reads."""
    needed = (rec.torque, *(getattr(rec, channel) for channel in controller.reads))
    return (
        all(signal is not None for signal in needed) and len(rec) >= POLICY.least_samples and not starts_moving(rec, controller)
    )


def _off(rec: Record, controller: Controller) -> float:
    """Rms of logged minus made torque [N m], where that is more than the velocity between the lines can make; or 0."""
    cascade = cascade_of(controller)
    log = log_of(rec, len(rec), cascade, whole=cascade.velocity.anti_windup == "none").pushed(cascade)
    return off_by(rec, log, cascade, lambda one, straight: one.made(cascade, straight))


def off_by(rec: Record, log: Log, cascade: Cascade, made_of: Callable[[Log, bool], Vector]) -> float:
    """The same of any law; made_of: its torque [N m] (n,) of a log, and whether the velocity goes straight between its lines.

    cascade: what the control error and the gain of its integral are taken of.
    """
    made = made_of(log, False)
    left = log.torque - made
    others = [made_of(one, straight) - made for one, straight in _others(log, rec)]
    rho = correlation(np.sum(others, axis=0), log.stretch)

    def rms(d: Vector, rho: float) -> float:
        return float(np.sqrt(np.mean(centred(*whitened(d, log.stretch, rho), False) ** 2)))

    possible, drifting = (float(np.sqrt(sum(rms(other, r) ** 2 for other in others))) for r in (rho, 0.0))
    noise = noise_std(left, rounding_step(log.torque))  # of a measured, or rounded, torque
    off, size = rms(left, 0.0), float(np.sqrt(np.mean(log.torque**2)))
    # Noise is as large in the whole as from line to line, but for what adds up in the integrator: another controller is not.
    white = off <= POLICY.undecided_ratio * float(np.hypot(noise, POLICY.interpolation * drifting))
    measured = min(noise, POLICY.replay_noise * float(np.std(log.torque))) if white else 0.0
    follows = (
        rms(left, rho) <= max(POLICY.interpolation * possible, POLICY.undecided_ratio * measured)
        or off <= POLICY.negligible * size
    )
    return (
        0.0
        if follows and _as_before_a_limit(log, cascade.asked(rec) - rec.velocity, cascade, left, POLICY.interpolation * possible)
        else off
    )


def _left(records: Sequence[Record], controller: Controller) -> float:
    """Root mean square of logged minus made torque [N m]."""
    cascade = cascade_of(controller)
    logs = [log_of(r, len(r), cascade, whole=cascade.velocity.anti_windup == "none") for r in records]
    return float(np.sqrt(np.mean(np.concatenate([log.torque - log.made(cascade) for log in logs]) ** 2)))


def _as_before_a_limit(log: Log, error: Vector, cascade: Cascade, left: Vector, possible: float) -> bool:
    """Whether what is left (n,) [N m] behind each limit is what it was before, but for what the integral moves at its ends.

    error: what the integrator reads at the lines [rad/s].
    """
    before = np.flatnonzero((log.stretch[:-1] >= 0) & (log.stretch[1:] < 0))
    after = np.flatnonzero((log.stretch[:-1] < 0) & (log.stretch[1:] >= 0)) + 1
    pairs = list(zip(before, after[after > before.min(initial=len(left))], strict=False))  # the last limit may have no end
    ki = cascade.velocity.ki or 0.0
    open_by = [2.0 * ki * log.dt * float(np.abs(error[a : b + 1]).max()) for a, b in pairs]
    return all(abs(left[b] - left[a]) <= by + possible for (a, b), by in zip(pairs, open_by, strict=True))


def noise_between(rec: Record, count: int, every: int) -> Vector:
    """White noise (count,) as large as the velocity's at the lines [rad/s], on the controller's samples between them."""
    noise: Vector = noise_std(rec.velocity) * np.random.default_rng(0).standard_normal(count)
    noise[::every] = 0.0
    return noise


def smoothed_again(rec: Record, velocity: Vector, every: int) -> Vector:
    """The velocity between the lines (n r,) as it would be taken of lines with as much noise again [rad/s]."""
    line = velocity[::every]
    made = smooth_between(line + noise_std(rec.velocity) * np.random.default_rng(1).standard_normal(len(line)), every)
    made[::every] = line
    return made


def _others(log: Log, rec: Record) -> list[tuple[Log, bool]]:
    """The log with other velocities between its lines, and whether the velocity goes straight there."""
    noise = noise_between(rec, len(log.velocity), len(log.velocity) // len(log.source))
    return [(log, True), (replace(log, velocity=log.velocity + noise), False)]


class Corrected(NamedTuple):
    """The controller with another number, the estimate of it, a sentence on that; found: that number in the controller."""

    controller: Controller
    estimates: Mapping[str, Estimate]
    note: Text
    found: FoundNumbers | None = None


def corrected(records: Sequence[Record], controller: Controller) -> Corrected | None:
    """The other way to read its command, the rule of its integral, or the one number, with which all torques follow.

    None where no change is enough, or several numbers are as good.
    A rule goes before a number: it has none, and on the lines a rectangular integral is a trapezoidal one with kp +- ki T/2.
    """
    following = [other for other in controller.readings(records[0].dt)[1:] if not _doubts(records, other)]
    if following:
        closest = min(following, key=lambda other: _left(records, other))
        return Corrected(closest, {}, say("With {} it does: all simulations use this.", read_as(closest, controller)))
    if (rule := _other_rule(records, cascade_of(controller))) is not None:
        return rule
    found = []
    of = cascade_of(controller)
    for given, one in _with_one_open(of):
        numbers = _following(records, one)
        if numbers is None or numbers.controller is None:
            continue
        if all(abs(e.value - _given(of, n)) <= POLICY.check_deviations * e.std for n, e in numbers.estimates.items()):
            continue  # none of them is another number than the given one
        negative = [name for name, e in numbers.estimates.items() if name in FEEDFORWARDS and e.value < 0.0]
        if negative:  # no drive brakes where its command asks for acceleration
            late = _late(records, of) if "acceleration_feedforward" in negative else None
            found += [] if late is None else [late]
            continue
        values = [_value(name, e) for name, e in numbers.estimates.items()]
        moved = read_as(numbers.controller, controller)
        also = say(", and {},", moved) if moved else ""
        text = "With {} (given: {}){} it does: all simulations use this."
        found.append(
            Corrected(numbers.controller, numbers.estimates, say(text, joined(" and ", values), given, also), numbers.found)
        )
    return found[0] if len(found) == 1 else None


def _following(records: Sequence[Record], one: Cascade) -> Numbers | None:
    """Its unknown numbers, with which all torques follow; None where they do not, or the records lack what shows them."""
    try:
        numbers = with_estimates(records, one)
    except GaidentError:
        return None
    refused = numbers.controller is None or numbers.doubt or _doubts(records, numbers.controller)
    return None if refused else numbers


def _late(records: Sequence[Record], cascade: Cascade) -> Corrected | None:
    """The cascade with a command that acts late, as behind a low pass: to first order in its frequency that is a delay.

    Under kp a delay tau of the command looks like an acceleration feedforward of -kp tau.
    """
    if cascade.driven_by != "command":
        return None
    numbers = _following(records, replace(cascade, command_filters=(*cascade.command_filters, LowPass(None))))
    if numbers is None or numbers.controller is None:
        return None
    ((_, time),) = numbers.estimates.items()
    text = (
        "With a command that acts {:.3g} ms late, as behind a low pass with this time constant, it does: all simulations use "
        "this. That is a filter of the command, or the way to the drive."
    )
    return Corrected(numbers.controller, numbers.estimates, say(text, 1e3 * time.value), numbers.found)


def _other_rule(records: Sequence[Record], cascade: Cascade) -> Corrected | None:
    """The cascade with the one other rule of its integral with which the torque of all records follows."""
    rules = {name: replace(cascade, velocity=replace(cascade.velocity, rule=name)) for name in RULES}
    found = [(name, one) for name, one in rules.items() if name != cascade.velocity.rule and not _doubts(records, one)]
    if len(found) != 1:
        return None
    name, one = found[0]
    return Corrected(one, {}, say("With the rule {} of its integral it does: all simulations use this.", repr(name)))


def _given(cascade: Cascade, name: str) -> float:
    """A number of the controller by its name, see `Controller.unknown`."""
    named = ((part, name.removeprefix(before)) for before, part in cascade.parts if name.startswith(before))
    return next(float(getattr(part, field)) for part, field in named if hasattr(part, field))


def _value(name: str, e: Estimate) -> Text:
    """ "position gain 40 1/s" of "position.gain", "kp 0.02 N m s/rad" of "velocity.kp"."""
    words = name.removeprefix("velocity.").replace(".", " ").replace("_", " ")
    return say("{} {:.4g}", words, e.value) if e.unit == "1" else say("{} {:.4g} {}", words, e.value, unit_text(e.unit))


def _doubts(records: Sequence[Record], controller: Controller | None) -> tuple[Text, ...]:
    return (*torque_driven(records, controller).doubts, *not_followed(records, controller))


def _with_one_open(cascade: Cascade) -> Iterator[tuple[Text, Cascade]]:
    """(what was given, the cascade with it as None)."""
    unknown: dict[str, Any] = {"kp": None, "ki": None}
    pi = cascade.velocity
    yield say("{:.4g} and {:.4g}", pi.kp, pi.ki), replace(cascade, velocity=replace(pi, **unknown))
    if cascade.position is not None:
        yield say("{:.4g}", cascade.position.gain), replace(cascade, position=P(None))
    for name in FEEDFORWARDS:
        if cascade.position is not None or name != "velocity_feedforward":
            open_one: dict[str, Any] = {name: None}
            yield say("{:.4g}", getattr(cascade, name)), replace(cascade, **open_one)
