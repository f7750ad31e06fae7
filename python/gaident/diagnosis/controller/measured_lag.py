"""A measured torque behind the controller's: the lag of a current loop, as the measured current shows it without any plant.

With u the torque that the controller makes of command and velocity, held over each sample T, the torque behind a lag of the
first order is, where a line of the log is taken before (d = 1) or after (d = 0) the controller's new torque acts,

    u_m(n) = a u_m(n-1) + (1 - a) u(n-d) + I0 + noise,   a = exp(-T/tau)

tau is fitted, I0 is what the integrator held before the record. Held against this is the same torque without a lag, d samples
late and with other gains, by the information criterion with the noise of each.
Where the lag explains the log no worse, no gains are said to be other, and the torque that the controller makes drives the model:
it has no noise, and the lag stands between it and the shaft, where the search finds it in the motion too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.control.filtering import filtered
from gaident.control.pi import PI
from gaident.control.pi_torque import pi_torque
from gaident.data.record import Record
from gaident.data.torque_kind import COMMANDED, MEASURED
from gaident.diagnosis.controller.replay import replay
from gaident.diagnosis.controller.replay_causes import white_noise
from gaident.estimation.criterion import bic
from gaident.policy.table import POLICY

__all__ = ["Lag", "commanded", "lag_shown"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

SAMPLES_LATE = (0, 1)  # no decision: the ways in which a log is written
OLDER = (0, 1, 2)  # no decision: samples by which the log without a lag is late
FASTEST, SLOWEST = 0.05, 50.0  # no decision: samples; a lag that is searched for
STEP = 1e-4  # no decision: of a time constant, for a slope


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
        ms = 1e3  # no decision: in a second
        return say(text, ms * self.time_constant, ms * self.std, self.noise)


def lag_shown(records: Sequence[Record], controller: PI | None) -> Lag | None:
    """The lag behind which all measured torques stand; None where they need none, or other gains explain them better."""
    logs = [r for r in records if r.torque is not None]
    if controller is None or controller.loop != "sampled" or len(logs) < len(records) or any(r.dt != logs[0].dt for r in logs):
        return None
    if any(r.torque_is != MEASURED or r.command is None for r in logs) or all(replay(r, controller).follows for r in logs):
        return None
    dt = logs[0].dt
    made = [pi_torque(_command(r), r.velocity, r.dt, controller) for r in logs]
    logged = [_logged(r) for r in logs]
    tau, left, late = min((_fitted(made, logged, dt, d) for d in SAMPLES_LATE), key=lambda found: _power(found[1]))
    noise = [white_noise(off, u) for off, u in zip(left, logged, strict=True)]
    n, power = sum(len(u) for u in logged), _power(left)
    if not all(noise) or bic(power / n, n, 1) > _without(logs, controller) + POLICY.rival_margin:
        return None
    slope = np.concatenate(_left(made, logged, dt, tau * (1.0 + STEP), late)) - np.concatenate(left)
    std = float(np.sqrt(power / n / max(float(slope @ slope), 1e-300))) * STEP * tau
    return Lag(tau, std, float(np.sqrt(power / n))) if tau > POLICY.check_deviations * std else None


def commanded(rec: Record, controller: PI) -> Record:
    """The record with the torque that the controller makes of command and velocity, from what it held before."""
    made = pi_torque(_command(rec), rec.velocity, rec.dt, controller)
    held = 0.0 if rec.torque is None else float(np.mean(rec.torque - made))
    significant = rec.torque is not None and abs(held) > POLICY.above_noise * float(np.std(rec.torque - made))
    changed: dict[str, Any] = {"torque": made + held if significant else made}
    return rec.with_channels(torque_is=COMMANDED, **changed)


def _command(rec: Record) -> Vector:
    assert rec.command is not None
    return rec.command


def _logged(rec: Record) -> Vector:
    assert rec.torque is not None
    return rec.torque


def _power(parts: Sequence[Vector]) -> float:
    return float(sum(part @ part for part in parts))


def _behind(torque: Vector, dt: float, tau: float, late: int) -> Vector:
    """The torque behind the lag."""
    a = float(np.exp(-dt / tau))
    numerator = np.array([0.0, 1.0 - a] if late else [1.0 - a])
    return np.asarray(filtered(numerator, np.array([1.0, -a]), torque[None, :], [len(torque)])[0])


def _left(made: Sequence[Vector], logged: Sequence[Vector], dt: float, tau: float, late: int) -> list[Vector]:
    """Measured minus made torque behind the lag, each record without its mean: what the integrator held before it."""
    off = [u - _behind(v, dt, tau, late) for u, v in zip(logged, made, strict=True)]
    return [part - np.mean(part) for part in off]


def _fitted(made: Sequence[Vector], logged: Sequence[Vector], dt: float, late: int) -> tuple[float, list[Vector], int]:
    """(time constant that leaves least, what it leaves, late)."""
    from scipy.optimize import minimize_scalar

    ends = np.log(FASTEST * dt), np.log(SLOWEST * dt)
    found = minimize_scalar(
        lambda z: _power(_left(made, logged, dt, float(np.exp(z)), late)), bounds=ends, method="bounded", options={"xatol": 1e-8}
    )
    tau = float(np.exp(found.x))
    return tau, _left(made, logged, dt, tau, late), late


def _without(logs: Sequence[Record], controller: PI) -> float:
    """BIC of the best explanation without a lag: kp and ki free, command and velocity some samples older than the log's."""
    best = np.inf
    for older in OLDER:
        parts = []
        for rec in logs:
            e = _command(rec) - rec.velocity
            columns = [e, rec.dt * (np.cumsum(e) - 0.5 * e)] if controller.ki else [e]  # no decision: the trapezoidal rule
            table = np.column_stack([*columns, np.ones(len(e))])
            table, u = table[: len(e) - older], _logged(rec)[older:]
            own = [x - np.mean(x) for x in (*table.T[:-1], u)]
            parts.append(np.column_stack(own))
        rows = np.concatenate(parts)
        table, u = rows[:, :-1], rows[:, -1]
        off = u - table @ np.linalg.lstsq(table, u, rcond=1e-12)[0]
        best = min(best, bic(float(np.mean(off**2)), len(u), table.shape[1]))
    return best
