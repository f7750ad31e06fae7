"""A measured torque behind the controller's: the lag of a current loop, as the measured current shows it without any plant.

With u the torque that the controller makes of command and velocity, held over each sample T, the torque behind a lag of the
first order is, where a line of the log is taken before (d = 1) or after (d = 0) the controller's new torque acts,

    u_m(n) = a u_m(n-1) + (1 - a) u(n-d) + I0 + noise,   a = exp(-T/tau)

tau is fitted, I0 is what the integrator stored before the record.
Compared with this is the same torque without a lag, d samples late and with other gains,
by the information criterion with the noise of each, on the same lines of the log:
none at the torque limit, and of each record none of the first, which a log without a lag may lack.
A torque that is only late has a = 0: a lag is found where a is beyond its deviations, as tau is above 0 whatever the log says,
and where no whole number of lines by which the torque is late comes near in that criterion.
Where the lag explains the log no worse, no gains are said to be other, and the torque that the controller makes drives the model:
it has no noise, and the lag stands between it and the shaft, where the search finds it in the motion too.

In a log slower than its controller the lag is a low pass in the path of the given controller's torque (`behind_a_lag`).
Its time is the one with which the whole run comes closest to the logged torque.
It stands where a torque that is late by whole lines does not come as close.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.control.filtering import filtered
from gaident.control.filters import LowPass
from gaident.control.pi import PI
from gaident.control.pi_torque import pi_torque
from gaident.data.record import Record
from gaident.data.torque_kind import COMMANDED, MEASURED, SAMPLE
from gaident.diagnosis.controller.form_findings import Driver
from gaident.diagnosis.controller.slow_forms import follow, run_error, time_std
from gaident.estimation.criterion import bic, gained
from gaident.identification.logged_torque import comparable
from gaident.identification.replay.causes import white_noise
from gaident.identification.replay.replay import replay
from gaident.models.drive_torque import driven_by
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding
from gaident.show.wording import with_std

__all__ = ["Lag", "behind_a_lag", "commanded", "lag_shown"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

LAG_TIMES = 16  # no decision: a grid: times of a low pass
LAG_EXACT = 1e-6  # no decision: of a solver: where its search ends, of the logarithm of a time
SAMPLES_LATE = (0, 1)  # no decision: a grid: the ways in which a log is written
POLE_STEP = 1e-4  # no decision: the step of a difference, of a lag's pole
NEAR = 1e-3  # no decision: of a range's end, within which a search stands at it


@dataclass(frozen=True)
class Lag:
    """Time constant of the measured torque behind the controller's [s], its standard deviation, and the noise on it [N m]."""

    time_constant: float
    std: float
    noise: float

    @property
    def note(self) -> Text:
        """What is said of it."""
        text = (
            "The measured {torque} follows from command and velocity through this controller behind a lag of {:.4g} +- {:.2g} "
            "ms, to white noise of {:.2g} {N m} rms. What the controller makes, without that noise, drives the model; the lag "
            "is between it and the shaft."
        )
        ms = 1e3  # no decision: a unit: in a second
        return say(text, ms * self.time_constant, ms * self.std, self.noise)


def lag_shown(records: Sequence[Record], controller: PI | None) -> Lag | None:
    """The lag behind which all measured torques stand; None where they need none, or other gains explain them better."""
    logs = [r for r in records if r.torque is not None]
    if controller is None or controller.loop != "sampled" or len(logs) < len(records) or any(r.dt != logs[0].dt for r in logs):
        return None
    if any(r.torque_is != MEASURED or r.command is None for r in logs) or all(replay(r, controller).follows for r in logs):
        return None
    dt = logs[0].dt
    parts = [part for rec in logs if np.sum((part := _part(rec, controller)).used) >= POLICY.least_samples]
    if not parts:
        return None
    a, left, late = min((_fitted(parts, d) for d in SAMPLES_LATE), key=lambda found: _power(found[1]))
    noise = [white_noise(off, part.logged[part.used]) for off, part in zip(left, parts, strict=True)]
    n, power = sum(map(len, left)), _power(left)
    least, margin = bic(power / n, n, 1), POLICY.rival_margin
    if not all(noise) or least > min(_late(parts) - margin, _without(parts, controller) + margin):
        return None
    tau = -dt / float(np.log(a))
    if not POLICY.fastest_lag * (1.0 + NEAR) < tau / dt < POLICY.slowest_lag * (1.0 - NEAR):
        return None
    step = POLE_STEP * (1.0 - a)
    slope = (np.concatenate(_left(parts, a + step, late)) - np.concatenate(left)) / step
    std = float(np.sqrt(power / n / max(float(slope @ slope), 1e-300)))
    if not a > POLICY.check_deviations * std:
        return None
    return Lag(tau, std * tau**2 / (a * dt), float(np.sqrt(power / n)))


def commanded(rec: Record, controller: PI) -> Record:
    """The record with the torque that the controller makes of command and velocity, from what it stored before."""
    start = 0.0 if rec.torque is None else _stored_before(rec, controller)
    torque = pi_torque(_command(rec), rec.velocity, rec.dt, controller, start)
    return rec.with_channels(torque_is=COMMANDED, torque_log=SAMPLE, torque=torque)


@dataclass(frozen=True, eq=False)
class _Part:
    """A record, what its controller makes of it and what is logged [N m], (n,) each; used: lines that are compared."""

    record: Record
    made: Vector
    logged: Vector
    used: NDArray[np.bool_]


def _part(rec: Record, controller: PI) -> _Part:
    made = pi_torque(_command(rec), rec.velocity, rec.dt, controller, _stored_before(rec, controller))
    used = _free(made, controller)
    used[: POLICY.log_late] = False
    return _Part(rec, made, _logged(rec), used)


def _older() -> range:
    """Samples by which the log may be late."""
    return range(POLICY.log_late + 1)


def _free(made: Vector, controller: PI) -> NDArray[np.bool_]:
    """Lines at which the made torque is not at the limit, nor was, as late as a log may be.

    The logged torque is not asked: near the limit it would choose lines by their noise.
    """
    limit = POLICY.at_limit * controller.limits[0]
    free = np.ones(len(made), bool)
    for older in _older():
        free[older:] &= np.abs(made[: len(made) - older]) < limit
    return free


def _stored_before(rec: Record, controller: PI) -> float:
    """What the integrator stored before the record [N m], where it is beyond the noise; else 0."""
    logged, command = _logged(rec), _command(rec)
    off = logged - pi_torque(command, rec.velocity, rec.dt, replace(controller, torque_limit=None))
    below = np.abs(logged) < POLICY.noisy_plateau * controller.limits[0]
    if not np.any(below):
        return 0.0
    stored = float(np.median(off[below]))
    free = _free(pi_torque(command, rec.velocity, rec.dt, controller, stored), controller)
    if not np.any(free):
        return 0.0
    stored = float(np.mean(off[free]))
    return stored if abs(stored) > POLICY.above_noise * float(np.std(off[free])) else 0.0


def _command(rec: Record) -> Vector:
    assert rec.command is not None
    return rec.command


def _logged(rec: Record) -> Vector:
    assert rec.torque is not None
    return rec.torque


def _power(parts: Sequence[Vector]) -> float:
    return float(sum(part @ part for part in parts))


def _behind(torque: Vector, a: float, late: int) -> Vector:
    """The torque behind the lag with the pole a."""
    numerator = np.array([0.0, 1.0 - a] if late else [1.0 - a])
    return np.asarray(filtered(numerator, np.array([1.0, -a]), torque[None, :], [len(torque)])[0])


def _left(parts: Sequence[_Part], a: float, late: int) -> list[Vector]:
    """Measured minus made torque behind the lag, each record without its mean: what the integrator stored before it."""
    off = [(part.logged - _behind(part.made, a, late))[part.used] for part in parts]
    return [d - np.mean(d) for d in off]


def _fitted(parts: Sequence[_Part], late: int) -> tuple[float, list[Vector], int]:
    """(pole that leaves least, what it leaves, late)."""
    from scipy.optimize import minimize_scalar

    def pole(z: float) -> float:
        return float(np.exp(-np.exp(-z)))

    ends = np.log(POLICY.fastest_lag), np.log(POLICY.slowest_lag)
    found = minimize_scalar(lambda z: _power(_left(parts, pole(z), late)), bounds=ends, method="bounded", options={"xatol": 1e-8})
    a = pole(float(found.x))
    return a, _left(parts, a, late), late


def _late(parts: Sequence[_Part]) -> float:
    """BIC of the torque that the controller makes, without a lag, by some samples late."""
    best = np.inf
    for older in _older():
        off = [part.logged[lines] - part.made[lines - older] for part in parts for lines in [np.flatnonzero(part.used)]]
        left = np.concatenate([d - np.mean(d) for d in off])
        best = min(best, bic(float(np.mean(left**2)), len(left), 0))
    return best


def _without(parts: Sequence[_Part], controller: PI) -> float:
    """BIC of the best explanation without a lag: kp and ki free, command and velocity some samples older than the log's."""
    best = np.inf
    for older in _older():
        pieces = []
        for part in parts:
            rec = part.record
            columns = [_command(rec) - rec.velocity]
            if controller.ki:
                integral = replace(controller, kp=0.0, torque_limit=None)
                columns.append(pi_torque(_command(rec), rec.velocity, rec.dt, integral))
            lines = np.flatnonzero(part.used)
            own = [*(x[lines - older] for x in columns), part.logged[lines]]
            pieces.append(np.column_stack([x - np.mean(x) for x in own]))
        rows = np.concatenate(pieces)
        table, u = rows[:, :-1], rows[:, -1]
        sizes = np.maximum(np.linalg.norm(table, axis=0), 1e-300)
        off = u - (table / sizes) @ np.linalg.lstsq(table / sizes, u, rcond=1e-12)[0]
        best = min(best, bic(float(np.mean(off**2)), len(u), table.shape[1]))
    return best


def behind_a_lag(records: Sequence[Record], validation: Sequence[Record], given: Controller) -> Driver | None:
    """The given controller with a low pass in the path of its torque, where measured torques of a slower log show one; else None.

    A motor's current lags behind what its controller asks for, by the current loop or by a filter.
    That is a part of what is read as "follows", and so it is looked for whether the torques follow without it or not.
    """
    from scipy.optimize import minimize_scalar

    cascade = cascade_of(given)
    if cascade.torque_filters or any(r.torque_is != MEASURED or not comparable(r, cascade) for r in records):
        return None

    def lagging(time: float) -> Cascade:
        return replace(cascade, torque_filters=(LowPass(time),))

    def fitted(older: int) -> tuple[float, float, int]:
        """(what is left [N m], time constant [s], older) of a torque older by so many controller samples; inf at an end."""

        def left(logarithm: float) -> float:
            return run_error(records, lagging(float(np.exp(logarithm))), older)

        k = int(np.argmin([left(x) for x in grid]))
        if not 0 < k < LAG_TIMES - 1:
            return np.inf, 0.0, older
        best = minimize_scalar(left, bounds=(grid[k - 1], grid[k + 1]), method="bounded", options={"xatol": LAG_EXACT})
        return float(best.fun), float(np.exp(best.x)), older

    grid = np.log(records[0].dt * np.geomspace(POLICY.fastest_lag, POLICY.slowest_lag, LAG_TIMES))
    fits = sorted(map(fitted, SAMPLES_LATE))
    behind, time, older = fits[0]
    without = run_error(records, cascade)
    if not behind < POLICY.each_number * without or not follow(records, lagging(time)):
        return None
    late = min(_late_by_lines(records, cascade, lines) for lines in range(1, POLICY.log_late + 1))
    if not behind < POLICY.better_reason * late:
        return None
    sample = records[0].dt / cascade.log_every(records[0].dt)
    # Within a sample of the controller it is not known when the current is measured, and when the next command acts.
    std = float(np.hypot(time_std(records, lagging, time, older), sample / np.sqrt(12.0)))
    time = float(np.mean([other for left, other, _ in fits if np.isfinite(left)]))
    if not time > POLICY.check_deviations * std:
        return None
    text = (
        "The measured {torque} lags behind what the controller asks for, by a low pass of {} ms: with it that follows to "
        "{:.2g} {N m} rms, without it to {:.2g} {N m}. That is the current loop, or a filter of it that was not given."
    )
    ms = 1e3  # no decision: a unit: in a second
    note, n = say(text, with_std(ms * time, ms * std), behind, without), sum(map(len, records))
    lag = {"time_constant": Estimate(time, std, "s")}
    finding = Finding("torque_filter", lag, (), 0.0, gained(n * without**2, n * behind**2, n, 1), None, note, place="controller")
    driven, later = (tuple(driven_by(r, lagging(time)) for r in part) for part in (records, validation))
    return Driver(driven, later, lagging(time), (finding,), (note,), {})


def _late_by_lines(records: Sequence[Record], cascade: Cascade, lines: int) -> float:
    """What is left of the torque [N m], rms, where the log wrote it so many lines late."""
    moved = [r[:-lines].with_channels(torque=r.torque[lines:]) for r in records if r.torque is not None]
    return run_error(moved, cascade)
