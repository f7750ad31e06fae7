"""Channels that a log wrote on another line than the others: found, moved back, and said.

What the controller issued at a sample follows from what it read there. With its gains known (or free), the law

    u(n) = kp (r(n-a) - w(n-b)) + ki dt sum + I0

shows a and b; what the motion tells of the torque's place is its lag L (estimation/regression/torque_lag.py, [samples], positive
where the torque stands behind its motion).
Of a torque that the log wrote s samples late, in a drive that computes for d_c and acts after d_p samples, both not negative,

    b = s + d_c,   L = s - d_p,   therefore   L <= s <= b

A controller that reads the future (b < 0), and a motion before its torque (L > 0), are the log's beyond doubt.
Where the law holds for b > 0 alone, the log and a delay of the drive are not told apart by it.
Moving a commanded torque by b is right in either case: a delay of the drive then stands where the model has one,
between torque and shaft, and is found there.
A measured torque stands behind that delay, and is moved only where L agrees.

Where velocity and position are logged, they are of one motion: which of the two stands whole samples beside the other, the torque
says (`_of_angle`).

A motion behind its torque needs no explanation where the torque follows from the controller, which reads and writes on the same
lines, or where what the model has accounts for it.
Delay, lag, filter and the age of the velocity make a slow motion late by their sum.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, called, joined, say
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.data.torque_kind import MEASURED
from gaident.diagnosis.controller.as_read import in_terms_of_the_log
from gaident.estimation.criterion import gained
from gaident.estimation.regression.sensor_lag import velocity_lag
from gaident.estimation.regression.torque_lag import TorqueLag, torque_lag
from gaident.identification.notes import reading_notes
from gaident.identification.replay.replay import replay
from gaident.models.effects_linear import LINEAR
from gaident.models.starts import noise_std
from gaident.policy.table import POLICY
from gaident.results.diagnosis import Diagnosis

__all__ = ["Aligned", "aligned"]

Vector = NDArray[np.float64]

BESIDE = ("position", "load_position", "load_velocity")
"""What stands beside the velocity in a log."""
REFUTED = say("the given controller does not make this {torque}, and without it")
SHARES = (0.0, 0.5, -0.5)  # no decision: a formula: the rules of differencing that exist
"""Of ki dt, by which the newest error counts more than half: trapezoidal and rectangular integrals."""


@dataclass(frozen=True)
class Aligned:
    """The records with their channels on the lines where the law holds.

    given: digest of a record as it is here -> as it was given. notes: what was moved, and what may have to be.
    behind: note on a motion behind its torque -> the record's name, the motion's lag and the sample time [s].
    velocity_late: whether a velocity stands whole samples behind its position, and was not moved.
    """

    records: tuple[Record, ...]
    validation: tuple[Record, ...]
    notes: tuple[Text, ...] = ()
    shifts: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    given: Mapping[str, Record] = field(default_factory=dict)
    behind: Mapping[Text, tuple[str, TorqueLag, float]] = field(default_factory=dict)
    velocity_late: bool = False

    @property
    def may_be_early(self) -> bool:
        """Whether the torque may have been written early, or the velocity late: the motion is behind by whole samples."""
        return self.velocity_late or any(_whole(lag) and round(lag.lag) != 0 for _, lag, _ in self.behind.values())

    def noted(self, result: Diagnosis) -> Diagnosis:
        """The result, in terms of the records that were given; a motion behind its torque is explained where the model does."""
        given = in_terms_of_the_log(result, self.given)
        notes = [_accounted(*self.behind[note], result) or note if note in self.behind else note for note in self.notes]
        return replace(given, notes=(*notes, *result.notes), log_shifts=self.shifts)


def aligned(
    records: Sequence[Record], validation: Sequence[Record], controller: PI | None, follows: bool = False, refuted: bool = False
) -> Aligned:
    """The records without shifts of their logs, those that the controller's law shows beyond doubt.

    follows: a controller that is no bare PI makes the logged torques, so that these are on the lines of what it read.
    refuted: a controller is given that does not make them.
    """
    notes: dict[Text, None] = dict.fromkeys(reading_notes((*records, *validation)))
    shifts: dict[str, Mapping[str, int]] = {}
    given: dict[str, Record] = {}
    behind: dict[Text, tuple[str, TorqueLag, float]] = {}
    late: list[Record] = []

    def one(rec: Record) -> Record:
        moves, note = _of_law(rec, controller)
        lag = torque_lag(rec) if controller is None and not follows else None
        if lag is not None:
            of_angle = _of_angle(velocity_lag(rec), lag)
            moves, note = of_angle or _of_motion(lag, refuted)
            if of_angle is not None:
                lag = None  # of the position's line, which is not the motion's
                late.extend([rec] * (not moves))
        if note:
            name = f"{rec.name}: " if len(records) + len(validation) > 1 and rec.name else ""
            note = joined("", (name, note))
            notes[note] = None
            if lag is not None and lag.lag < 0.0:
                behind[note] = name, lag, rec.dt
        moved = rec.shifted(**moves) if moves else rec
        if moves:
            shifts[rec.digest] = moves
        given[moved.digest] = rec
        return moved

    moved = tuple(map(one, records)), tuple(map(one, validation))
    return Aligned(*moved, tuple(notes), shifts, given, behind, bool(late))


def _of_law(rec: Record, controller: PI | None) -> tuple[Mapping[str, int], Text]:
    """(channel -> samples by which it is moved, note) of a record with a controller; ({}, "") where there is no shift."""
    if controller is None or rec.torque is None or rec.command is None:
        return {}, Text("")
    said = replay(rec, controller)
    if said.follows is not False:
        return {}, Text("")
    a, b = _shift_of_law(rec, controller)
    if (a, b) == (0, 0):
        return {}, Text("")
    moves = _moves(rec, a, b)
    after = replay(rec.shifted(**moves), controller)
    if after.follows is False and after.cause in ("", "shift"):
        return {}, Text("")
    lag = torque_lag(rec)
    if rec.torque_is == MEASURED and b > 0 and not (lag is not None and lag.lag > b - POLICY.lag_seen / 2):
        return {}, _measured_note(b, lag)
    return moves, _moved_note(moves, b, lag)


def _shift_of_law(rec: Record, controller: PI) -> tuple[int, int]:
    """(a, b): by how many samples command and velocity are older than the log's where the law, its gains free, holds.

    (0, 0) where another shift is not better beyond doubt, or b not sure.
    Of an undetermined a, as a constant command leaves it, that of the fewest channels.
    """
    assert rec.command is not None and rec.torque is not None
    r, w, u = (x[: POLICY.most_samples] for x in (rec.command, rec.velocity, rec.torque))
    farthest = POLICY.log_late
    inner = slice(farthest, len(u) - farthest)
    # Noise of a measured torque lifts the highest line above the limit, and lowers others at it.
    highest = min(float(np.abs(u).max()), controller.limits[0])
    noise = POLICY.above_noise * noise_std(u) if rec.torque_is == MEASURED else 0.0
    within = np.abs(u[inner]) < POLICY.at_limit * highest - noise
    n, top = int(within.sum()), float(np.std(u))
    if n < POLICY.least_rows or not top > 0.0:
        return 0, 0
    steps = range(-farthest, farthest + 1)
    least = (1e-6 * float(np.abs(u).max())) ** 2
    left: dict[tuple[int, int], float] = {}
    for a in steps:
        for b in steps:
            e = _older(r, a) - _older(w, b)
            for share in SHARES if controller.ki else SHARES[:1]:
                columns = [e, np.cumsum(e) - (0.5 - share) * e, np.ones(len(e))] if controller.ki else [e, np.ones(len(e))]
                table = np.column_stack(columns)[inner][within]
                table /= np.maximum(np.linalg.norm(table, axis=0), 1e-300)
                off = u[inner][within] - table @ np.linalg.lstsq(table, u[inner][within], rcond=1e-12)[0]
                left[a, b] = min(left.get((a, b), np.inf), float(off @ off) / n)
    best = min(left.values())
    if best > (POLICY.replay_noise * top) ** 2:
        return 0, 0
    worse = {shift: gained(value + least, best + least, n) for shift, value in left.items()}
    alike = [shift for shift, units in worse.items() if units < POLICY.log_shift]
    if len({b for _, b in alike}) > 1:  # what the torque was made of is not sure
        return 0, 0
    return min(alike, key=lambda s: (s != (0, 0), not (s[0] == s[1] or 0 in s), s[0] != s[1], abs(s[0]) + abs(s[1]), s))


def _older(x: Vector, k: int) -> Vector:
    """x(n-k); what lies beyond the ends repeats them."""
    k = int(k)
    return x if k == 0 else np.concatenate([np.full(k, x[0]), x[:-k]] if k > 0 else [x[-k:], np.full(-k, x[-1])])


def _moves(rec: Record, a: int, b: int) -> dict[str, int]:
    """Channel -> samples by which it is moved, as few channels as possible; positions and the load stay beside the velocity."""
    if a == b:
        return {"torque": -b}
    moves = {"command": a} if a else {}
    if b:
        moves |= {"velocity": b} | {name: b for name, _ in rec.channels() if name in BESIDE}
    return moves


def _samples(k: float) -> str:
    size = f"{abs(k):.3g}"
    return f"{size} sample{'' if size == '1' else 's'}"


def _moved_note(moves: Mapping[str, int], b: int, lag: TorqueLag | None) -> Text:
    late = [
        say("the {} {} {}", called(name), _samples(k), "late" if k < 0 else "early")
        for name, k in moves.items()
        if name not in BESIDE
    ]
    done = ", ".join(f"{name} by {k:+d}" for name, k in moves.items())
    text = say(
        "The log wrote {} against the rest: only so does the {torque} follow from command and velocity through the controller. "
        "The channels were moved ({}), and everything below is of that.",
        joined(" and ", late),
        done,
    )
    if b < 0:
        return say("{} As logged, the controller would have acted before it measured.", text)
    if b > 0 and (lag is None or lag.lag < b - POLICY.lag_seen):
        same = "{} A drive that computes for {} makes the same log; that delay would show below as a transport delay."
        return say(same, text, _samples(b))
    return text


def _measured_note(b: int, lag: TorqueLag | None) -> Text:
    text = (
        "The measured {torque} is {} behind the controller's, exactly: the log may have written it late, or the drive needs that "
        "long. {}; nothing was moved. Where you know that it is the log, read it with {}."
    )
    where = "The motion does not tell which"
    if lag is not None:
        where = f"The motion puts it {_samples(lag.lag)} {'behind' if lag.lag > 0 else 'before'} its place"
    return say(text, _samples(b), where, f"shift torque={-b}")


def _of_angle(behind: float | None, lag: TorqueLag) -> tuple[Mapping[str, int], Text] | None:
    """(channel -> samples by which it is moved, note) where velocity and position stand on different lines; else None.

    behind: of the velocity, behind the position [samples]; lag: of the torque, behind the motion that the position shows.
    """
    whole = 0 if behind is None else round(behind)
    if behind is None or whole == 0 or abs(behind - whole) >= POLICY.lag_whole:
        return None
    apart = say("The velocity stands {} {} the position", _samples(behind), "behind" if behind > 0.0 else "before")
    if _whole(lag) and round(lag.lag) == whole:  # velocity and torque agree
        text = (
            "{}, and the {torque} stands where the velocity does: the log wrote the position {} {}. It was moved by {:+d}, and "
            "everything below is of that."
        )
        return {"position": whole}, say(text, apart, _samples(whole), "early" if whole > 0 else "late", whole)
    if not (_whole(lag) and round(lag.lag) == 0):
        return None
    if behind < 0.0:
        text = (
            "{}, which no sensor does, and the {torque} stands where the position does: the log wrote the velocity {} early. It "
            "was moved by {:+d}, and everything below is of that."
        )
        return {"velocity": -whole}, say(text, apart, _samples(whole), -whole)
    text = (
        "{}, and the {torque} stands where the position does: a sensor that is late, or a log that wrote the velocity late, and "
        "no delay of the drive, whatever is called so below. Where you know that it is the log, read it with {}. Nothing was "
        "moved."
    )
    return {}, say(text, apart, f"shift velocity={-whole}")


def _of_motion(lag: TorqueLag, refuted: bool) -> tuple[Mapping[str, int], Text]:
    """(channel -> samples by which it is moved, note) of a torque in open loop, where no law of a controller proves anything.

    A motion that comes whole samples before its torque is the log's: no axis does that, and there is nothing to find in it.
    Up to half a sample more is a torque that goes on between the lines, as that of a controller faster than the log.
    Another part of a sample is a filter of the torque; a motion behind its torque may be a delay of the drive. Neither is moved.
    """
    if not _said(lag):
        return {}, Text("")
    if whole := _written_late(lag):
        moved = say(
            "The motion comes {} before the logged {torque} that makes it, which no axis does: the log wrote the {torque} {} "
            "late (or the velocity early). The {torque} was moved by {:+d}, and everything below is of that.",
            _samples(lag.lag),
            _samples(whole),
            -whole,
        )
        more = "{} The part of a sample that is left is what a {torque} that goes on between the lines comes to."
        return {"torque": -whole}, moved if _whole(lag) else say(more, moved)
    whole = round(lag.lag)
    remedy = f"where you know that it is the log, read it with shift torque={-whole}. Nothing was moved."
    if lag.lag > 0.0:
        text = (
            "The motion comes {} before the logged {torque} that makes it, which no axis does: the log wrote the {torque} late "
            "(or the velocity early), or the {torque} was filtered on its way into the log; {}"
        )
    else:
        text = (
            "The motion follows the logged {torque} by {} more than an axis needs: a delay of the drive or of the velocity's "
            "sensor, or a log that wrote the {torque} early; {} the data cannot tell; {}"
        )
        return {}, say(text, _samples(lag.lag), REFUTED if refuted else "without a controller", remedy)
    return {}, say(text, _samples(lag.lag), remedy)


def _whole(lag: TorqueLag) -> bool:
    """Whether a lag is a whole number of samples, and no other one within its deviation."""
    apart = abs(lag.lag - round(lag.lag))
    told = apart + POLICY.contradiction * lag.std < 0.5  # no decision: rounding: the nearest whole number
    return apart < POLICY.lag_whole and told


def _written_late(lag: TorqueLag) -> int:
    """By how many whole samples a log wrote a torque late: its motion comes that and up to half a sample before it; else 0."""
    whole = int(np.floor(lag.lag + POLICY.lag_whole))
    rest, unsure = lag.lag - whole, POLICY.contradiction * lag.std
    sure = rest - unsure < 0.5 and unsure < POLICY.lag_whole  # no decision: a formula: a straight line is half a sample late
    return whole if whole >= 1 and sure else 0


def _said(lag: TorqueLag) -> bool:
    """Whether a lag is so large, beyond its deviation, that it is said."""
    return abs(lag.lag) - POLICY.contradiction * lag.std >= POLICY.lag_seen and abs(lag.lag) >= POLICY.lag_said


def _accounted(name: str, lag: TorqueLag, dt: float, result: Diagnosis) -> Text | None:
    """What is said of a motion behind its torque where a model has what makes it late; None where it has not.

    Where what is left would not be said of a record by itself, nothing is left to explain.
    """
    late = {e.name: LINEAR[e.name](e.values).late / dt for e in result.model.effects if e.name in LINEAR}
    parts = [say("the {}", called(effect)) for effect, lines in late.items() if lines > 0.0]
    if result.velocity_age > 0.0:
        parts.append(Text("the age of the velocity"))
    made = sum(late.values()) + max(result.velocity_age, 0.0)
    if not parts or _said(replace(lag, lag=lag.lag + made)):
        return None
    text = (
        "{}The motion follows the logged {torque} by {} more than an axis needs. The model has what makes that: {}, {} together. "
        "A log that wrote the {torque} early would look the same."
    )
    return say(text, name, _samples(lag.lag), joined(" and ", parts), _samples(made))
