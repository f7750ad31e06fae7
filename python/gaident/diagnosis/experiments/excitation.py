"""What records excited, and what they therefore cannot judge: "no evidence of X" and "X was never triggered" are two answers.

Figures are of all records together; plain physics only.
Whether two effects that were triggered can be told apart is another question, which the rival fits answer.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.axis import TURN, Text, period_of, say, turns
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.data.torque_kind import MEASURED
from gaident.diagnosis.library.terms import LIBRARY, not_testable, one_sided
from gaident.diagnosis.library.triggers import Motions, SeenMotion
from gaident.errors import RecordError
from gaident.estimation.regression.sensor_lag import velocity_lag
from gaident.models.drive_torque import torque_of
from gaident.models.model import Model
from gaident.models.starts import noise_std
from gaident.policy.table import POLICY

__all__ = ["Excitation", "decided_by_the_angle", "excitation", "position_of"]

Vector = NDArray[np.float64]

TINY = 1e-300  # no decision: no division by 0


@dataclass(frozen=True)
class Excitation:
    """What the records did.

    duration          [s], of all records
    highest_speed     max |w| [rad/s]
    speeds            distinct speeds held, signed, ascending [rad/s]; standstill is 0.0
    reversals         changes of the velocity's sign, noise left out
    slow              time moving below a tenth of the highest speed [s]
    standstill        time at rest [s]
    highest_torque    max |u| [N m]; torque_share: of the controller's torque limit (nan without one)
    opposed           share of the moving time in which torque and velocity have opposite signs
    revolutions       travel (farthest minus nearest position) in turns
    steps             distinct sizes of command jumps [rad/s], ascending
    repeated          a speed held in the first third is held in the last third too
    not_testable      effect -> why the records say nothing about it
    one_sided         effect -> which sizes of it would not have shown
    """

    duration: float
    highest_speed: float
    speeds: tuple[float, ...]
    reversals: int
    slow: float
    standstill: float
    highest_torque: float
    torque_share: float
    opposed: float
    revolutions: float
    steps: tuple[float, ...]
    repeated: bool
    not_testable: Mapping[str, Text]
    one_sided: Mapping[str, Text]

    @property
    def sentence(self) -> Text:
        """The figures in words."""
        moving = [v for v in self.speeds if v]
        held = f"{len(moving)} speed{'s' if len(moving) != 1 else ''} held" if moving else "no speed held"
        share = f" ({100.0 * self.torque_share:.0f} % of the limit)" if math.isfinite(self.torque_share) else ""
        return say(
            "{:.3g} s, up to {:.4g} {rad/s} and {:.3g} {N m}{}; {}, {} reversal{}, {}, {:.2g} s slow and {:.2g} s at rest.",
            self.duration,
            self.highest_speed,
            self.highest_torque,
            share,
            held,
            self.reversals,
            "s" if self.reversals != 1 else "",
            turns(self.revolutions * TURN, 3),
            self.slow,
            self.standstill,
        )


def excitation(
    records: Record | Sequence[Record],
    controller: Controller | None = None,
    model: Model | None = None,
    axis: str = "rotary",
    pitch: float | None = None,
) -> Excitation:
    """Looks at one record or several; with `model`, its structure too decides what can be judged. axis: rotary or linear.

    pitch: of a linear axis, as `period_of` takes it [m].

    Raises RecordError where there is no record, or a record has no torque and nothing to make it from.
    """
    listed = [records] if isinstance(records, Record) else list(records)
    if not listed:
        raise RecordError("records is empty: give at least one Record")
    top = max(float(np.abs(rec.velocity).max()) for rec in listed)
    motions = [_motion(rec, controller, top) for rec in listed]
    seen = Motions(tuple(motions), controller, model, axis, period_of(axis, pitch))
    speeds = _distinct([v for m in motions for v in m.held], POLICY.apart * top)
    torque = max(float(np.abs(m.torque).max()) for m in motions)
    limit = math.inf if controller is None else controller.limits[0]
    moving = sum(int(np.sum(m.moving)) for m in motions)
    opposed = sum(int(np.sum(m.moving & (np.sign(m.torque) * np.sign(m.velocity) < 0.0))) for m in motions)
    return Excitation(
        duration=sum(rec.duration for rec in listed),
        highest_speed=top,
        speeds=speeds,
        reversals=sum(_changes(m.velocity, m.velocity_floor) for m in motions),
        slow=sum(m.dt * int(np.sum(m.moving & (np.abs(m.velocity) < POLICY.slow * top))) for m in motions),
        standstill=sum(m.dt * int(np.sum(~m.moving)) for m in motions),
        highest_torque=torque,
        torque_share=torque / limit if math.isfinite(limit) else math.nan,
        opposed=opposed / moving if moving else 0.0,
        revolutions=max(float(np.ptp(m.position)) for m in motions) / TURN,
        steps=_distinct([s for m in motions for s in m.jumps], POLICY.apart * max(top, TINY)),
        repeated=any(m.repeated for m in motions),
        not_testable=not_testable(seen),
        one_sided=one_sided(seen),
    )


def position_of(rec: Record) -> Vector:
    """The record's position [rad], shape (n,), or its velocity integrated from 0."""
    if rec.position is not None:
        return rec.position
    w = rec.velocity
    return np.concatenate([[0.0], np.cumsum(0.5 * rec.dt * (w[1:] + w[:-1]))])


def _motion(rec: Record, controller: Controller | None, top: float) -> SeenMotion:
    w = rec.velocity
    u = torque_of(rec, bare_pi(controller))
    floor = max(POLICY.above_noise * noise_std(w), POLICY.negligible * top, TINY)
    smooth = _smoothed(w, max(POLICY.smoothed_samples, len(w) // POLICY.smoothed_parts))
    moving = np.abs(smooth) > floor
    position = position_of(rec)
    command = rec.command
    jumps = [] if command is None else _jumps(command, top)
    held, early, late = _held(smooth, rec.dt, floor, top)
    torque_floor = max(POLICY.above_noise * noise_std(u), POLICY.still * float(np.abs(u).max()), TINY)
    repeated = any(abs(a - b) < POLICY.apart * top for a in early for b in late if a)
    shape = moving, tuple(held), tuple(jumps), repeated
    measured = rec.torque is not None and rec.torque_is == MEASURED
    return SeenMotion(rec.dt, w, smooth, u, position, command, floor, torque_floor, *shape, rec.torque is not None, measured)


def _smoothed(x: Vector, width: int) -> Vector:
    """Moving average over an odd `width`, the ends repeated."""
    half = min(width, len(x)) // 2
    total = np.concatenate([[0.0], np.cumsum(np.concatenate([np.full(half, x[0]), x, np.full(half, x[-1])]))])
    smooth: Vector = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
    return smooth


def _held(smooth: Vector, dt: float, floor: float, top: float) -> tuple[list[float], list[float], list[float]]:
    """Speeds held (velocity within 2 % of the highest, for long enough): all, those of the first and of the last third."""
    band = 2.0 * max(POLICY.still * top, floor)  # no decision: a formula: from one side of a speed to the other
    held, early, late = [], [], []
    n, start = len(smooth), 0
    third = n / 3  # no decision: the first and the last third, for how even a record is
    low = high = float(smooth[0])
    values = smooth.tolist()
    for i in range(1, n + 1):
        if i < n:
            value = values[i]
            lower, higher = value if value < low else low, value if value > high else high
            if higher - lower <= band:
                low, high = lower, higher
                continue
        middle = (start + i) // 2
        # On a ramp the halves of the stretch differ by half the band.
        first, second = smooth[start:middle], smooth[middle:i]
        if i - start >= POLICY.held_samples and abs(np.median(first) - np.median(second)) < POLICY.no_ramp * band:
            level = float(np.median(smooth[start:i]))
            level = 0.0 if abs(level) <= floor else level
            held.append(level)
            early += [level] if start < third else []
            late += [level] if i > 2 * third else []
        if i < n:
            start, low, high = i, values[i], values[i]
    return held, early, late


def _jumps(command: Vector, top: float) -> list[float]:
    """Sizes of the command's jumps [rad/s]: within one sample, above 2 % of the highest speed; the first from rest."""
    steps = np.abs(np.diff(command, prepend=0.0))
    return [float(s) for s in steps if s > POLICY.still * top]


def _distinct(values: Sequence[float], apart: float) -> tuple[float, ...]:
    """Ascending values of which each is more than `apart` above the last one kept; zero is kept as zero."""
    kept: list[float] = []
    for value in sorted(values):
        if not kept or value - kept[-1] > apart or (value == 0.0) != (kept[-1] == 0.0):
            kept.append(value)
    return tuple(kept)


def _changes(x: Vector, floor: float) -> int:
    """Changes of sign between values beyond +-floor."""
    signs = np.sign(x[np.abs(x) > floor])
    return int(np.sum(signs[1:] != signs[:-1]))


def decided_by_the_angle(records: Sequence[Record]) -> set[str]:
    """Effects that a logged angle says are not there: a late velocity, where it is not late behind the angle.

    Beside a measured torque only.
    With a commanded one, what acts alike at the actuator would then stand alone,
    on the word of an angle that the drive may have integrated from the same velocity.
    """
    lags = [velocity_lag(r) if r.torque_is == MEASURED else None for r in records]
    if any(lag is None or abs(lag) > POLICY.lag_said for lag in lags):
        return set()
    return {t.name for t in LIBRARY.values() if t.late}
