"""Tests of the residual that stay valid under feedback. They order suspicions and raise alarms; they never name a cause.

Each is a likelihood ratio: the residual e = w_measured - w_simulated is explained by what a change of the model's own parameters
does, against that and the columns under test, each with its own autoregressive noise,

    LR = n ln(var v0 / var v1),   v = e - columns, whitened.

The columns come from outside the loop (command, simulated motion); correlations with the measured torque, which carries the
noise, are not used. A colour found under the null only would make smooth columns significant, one found on the bare residual
would swallow the effect. (Ljung: model error models; Billings and Voon: even and odd powers; directed score tests.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.diagnosis.directed import torque_columns
from gaident.diagnosis.excitation import position_of
from gaident.diagnosis.problem import orthonormal_rows
from gaident.diagnosis.state_space import discretised, disturbed
from gaident.errors import RecordError
from gaident.identification.noise import Autoregression, chi2_tail, fit_autoregression, ljung_box, whiten
from gaident.identification.starts import starts_moving
from gaident.models.controller import PI
from gaident.models.model import Model
from gaident.models.pi_torque import pi_torque
from gaident.models.simulate import initial_state, simulate

__all__ = ["ResidualTests", "parameter_sensitivities", "residual_tests"]

Vector = NDArray[np.float64]
Rows = NDArray[np.float64]

LEVEL = 1e-4
LAGS = (0, 1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64)
BLOCK = 50  # samples over which the power is averaged to see it change


@dataclass(frozen=True)
class ResidualTests:
    """p-values of "nothing of this kind is left", small ones speak against it.

    white          the whitened residual is white (Ljung-Box)
    command        nothing depends on the command at any lag (torque from the past in open loop)
    even, odd      nothing depends on even, on odd powers of the command beyond its first
    stationary     first and last third of each record have the same residual power
    directed       kind of missing torque -> nothing of its shape is left, see `directed.torque_columns`
    linear_share   of the whitened residual's power that a linear model of the command explains (model error model)
    nonlinear_share  what the torques of `directed` explain beyond that
    power_share    of the residual's own power, not whitened, that goes with command and motion (some does by chance)
    noise          the noise model, its deviation in rad/s
    """

    white: float
    command: float
    even: float
    odd: float
    stationary: float
    directed: Mapping[str, float]
    linear_share: float
    nonlinear_share: float
    power_share: float
    noise: Autoregression

    @property
    def alarms(self) -> tuple[str, ...]:
        """Names of the tests that are significant (p < 1e-4), directed ones by rising p-value."""
        own = [name for name in ("command", "even", "odd", "stationary") if getattr(self, name) < LEVEL]
        return (*own, *(name for name, p in sorted(self.directed.items(), key=lambda item: item[1]) if p < LEVEL))

    @property
    def sentence(self) -> str:
        """What is left, in words; no cause."""
        if not self.alarms:
            colour = "" if self.white >= LEVEL else ", beyond a colour of its own"
            return f"Nothing is left in the residual that depends on command or motion{colour}."
        what = []
        if self.linear_share > 0.05 and self.linear_share > self.nonlinear_share:
            what.append("mostly linear (dynamics that the model lacks or has wrong)")
        elif self.nonlinear_share > 0.05:
            what.append("mostly nonlinear in the motion")
        if self.even < LEVEL or self.odd < LEVEL:
            kinds = [name for name in ("even", "odd") if getattr(self, name) < LEVEL]
            what.append(f"with {' and '.join(kinds)} powers of the command")
        if self.stationary < LEVEL:
            what.append("different at the record's start and end")
        kind = f", {', '.join(what)}" if what else ""
        return (
            f"Something is left in the residual{kind}: {100 * self.power_share:.0f} % of its power goes with command and motion "
            f"(whitened {100 * self.linear_share:.0f} % linear, {100 * self.nonlinear_share:.0f} % more by torques)."
        )


def residual_tests(
    model: Model,
    records: Record | Sequence[Record],
    controller: PI | None = None,
    simulated: Sequence[Vector] | None = None,
    sensitivities: Rows | None = None,
) -> ResidualTests:
    """Tests what the model leaves of the records.

    model          the linear model (of an extended one its linear part); decides how a missing torque shows in the velocity
    simulated      velocities [rad/s] of the model under test, one array per record; None: of the linear model
    sensitivities  of the simulated velocity to the parameters under test, (parameters, all samples); None: to gain and roots of
                   the linear model

    Raises RecordError where there is no record or a record lacks the input.
    """
    listed = [records] if isinstance(records, Record) else list(records)
    if not listed:
        raise RecordError("records is empty: give at least one Record")
    outputs = [_simulated(model, rec, controller) for rec in listed] if simulated is None else list(simulated)
    residuals = [rec.velocity - y for rec, y in zip(listed, outputs, strict=True)]
    lengths = [len(e) for e in residuals]
    own = parameter_sensitivities(model, listed, controller) if sensitivities is None else np.atleast_2d(sensitivities)
    linear, even, odd = _command_columns(listed, controller)
    directed = _directed(model, listed, outputs, controller)
    error = np.concatenate(residuals)
    order = _order(_rest(error, own), lengths)
    base = _explained(error, own, lengths, order)

    def p_value(extra: Rows, beside: Rows, null: _Fit) -> float:
        fit = _explained(error, np.vstack([beside, extra]), lengths, order, null)
        added = fit.columns - null.columns
        dof = len(error) - fit.columns - fit.noise.order * len(lengths) + 0.5 * added
        if added < 1 or dof < 1 or not fit.power > 0.0:
            return 1.0
        return chi2_tail(dof * math.log(max(null.power / fit.power, 1.0)), added)

    with_command = np.vstack([own, linear])
    null = _explained(error, with_command, lengths, order, base)
    p_directed = {name: p_value(rows, own, base) for name, rows in directed.items()}
    best = sorted(p_directed, key=p_directed.__getitem__)[:3]
    p_command = p_value(linear, own, base)
    found = np.vstack([own, linear if p_command < p_directed[best[0]] else directed[best[0]]])
    noise = _explained(error, found, lengths, order).noise

    def left(rows: Rows) -> float:
        v = _rest(_white(error[None], noise, lengths)[0], _white(rows, noise, lengths))
        return float(v @ v)

    total, line = left(own), left(with_command)
    plain, rest = (_rest(error, rows) for rows in (own, np.vstack([with_command, *directed.values()])))
    power = float(plain @ plain)
    more = left(np.vstack([with_command, *(directed[name] for name in best)]))
    v = _split(_rest(_white(error[None], noise, lengths)[0], _white(own, noise, lengths)), lengths)
    return ResidualTests(
        white=ljung_box(v, min(20, len(error) // 5)),
        command=p_command,
        even=p_value(even, with_command, null),
        odd=p_value(odd, with_command, null),
        stationary=_stationary(v),
        directed=p_directed,
        linear_share=1.0 - line / total if total > 0.0 else 0.0,
        nonlinear_share=(line - more) / total if total > 0.0 else 0.0,
        power_share=1.0 - float(rest @ rest) / power if power > 0.0 else 0.0,
        noise=noise,
    )


class _Fit(NamedTuple):
    """What is left of the residual: mean square of its white part, number of independent columns, noise model."""

    power: float
    columns: int
    noise: Autoregression


def _explained(error: Vector, rows: Rows, lengths: Sequence[int], order: int, null: _Fit | None = None) -> _Fit:
    """The residual less the rows: weights and noise model by turns, each the best for the other.

    From the plain least-squares weights, and from the noise model of the null, which alone must not do better.
    """
    starts = [_colour(_rest(error, rows), lengths, order)] + ([] if null is None else [null.noise])
    fits = []
    for noise in starts:
        for _ in range(3):
            v, white = _white(error[None], noise, lengths)[0], _white(rows, noise, lengths)
            sizes = np.linalg.norm(white, axis=1)
            sizes[sizes == 0.0] = 1.0
            scaled = white / sizes[:, None]
            weights = np.linalg.pinv(scaled @ scaled.T, rcond=1e-10, hermitian=True) @ (scaled @ v)
            left = error - (weights / sizes) @ rows
            noise = _colour(left, lengths, order)
        fits.append(noise)
    best = min(fits, key=lambda noise: noise.std)
    return _Fit(best.std**2, len(orthonormal_rows(rows)), best)


def _order(left: Vector, lengths: Sequence[int]) -> int:
    """Order of the noise model, one for all hypotheses: twice that of BIC, as a sum of two noises has no finite one."""
    return min(2 * fit_autoregression(_split(left, lengths)).order, min(lengths) // 20)


def _colour(left: Vector, lengths: Sequence[int], order: int) -> Autoregression:
    """Coefficients by least squares: those of the autocovariance are biased where the colour is strong."""
    parts = _split(left, lengths)
    if order == 0:
        return Autoregression(np.zeros(0), float(np.sqrt(np.mean(left**2))))
    past = np.concatenate([np.array([x[order - i : len(x) - i] for i in range(1, order + 1)]).T for x in parts])
    now = np.concatenate([x[order:] for x in parts])
    gram = past.T @ past
    phi = np.linalg.solve(gram + 1e-12 * np.trace(gram) / order * np.eye(order), past.T @ now)
    return Autoregression(phi, float(np.sqrt(np.mean((now - past @ phi) ** 2))))


def _white(rows: Rows, noise: Autoregression, lengths: Sequence[int]) -> Rows:
    return np.array([np.concatenate([whiten(x, noise.phi) for x in _split(row, lengths)]) for row in rows])


def parameter_sensitivities(model: Model, records: Sequence[Record], controller: PI | None) -> Rows:
    """Change of the simulated velocity with gain and roots of the model (central differences), (p + 2 q + 1, all samples)."""
    rows = []
    for step in _changes(model):
        up, down = (
            np.concatenate([_simulated(_changed(model, step, sign), rec, controller) for rec in records]) for sign in (1.0, -1.0)
        )
        row = up - down
        if np.all(np.isfinite(row)):
            rows.append(row)
    return np.array(rows) if rows else np.zeros((0, sum(len(rec) for rec in records)))


Change = tuple[float, dict[int, complex], dict[int, complex]]


def _changes(model: Model) -> list[Change]:
    """(relative change of gain, changes of poles, of zeros), one free parameter each."""
    changes: list[Change] = [(1e-4, {}, {})]
    for kind, roots in enumerate((model.poles, model.zeros)):
        for i, root in enumerate(roots):
            if root.imag < 0.0:
                continue  # moves with its pair
            size = 1e-4 * max(abs(root), 1e-2)
            for step in (size + 0j, 1j * size) if root.imag > 0.0 else (size + 0j,):
                moved = {i: step}
                if root.imag > 0.0:
                    moved[roots.index(root.conjugate())] = step.conjugate()
                changes.append((0.0, moved, {}) if kind == 0 else (0.0, {}, moved))
    return changes


def _changed(model: Model, change: Change, sign: float) -> Model:
    gain, poles, zeros = change
    return Model(
        model.gain * (1.0 + sign * gain),
        [root + sign * poles.get(i, 0.0) for i, root in enumerate(model.poles)],
        [root + sign * zeros.get(i, 0.0) for i, root in enumerate(model.zeros)],
    )


def _simulated(model: Model, rec: Record, controller: PI | None) -> Vector:
    limited = controller is not None and controller.limited
    state = initial_state(model, rec, controller) if not limited and starts_moving(rec, controller) else None
    return simulate(model, rec, controller, state)


def _command_columns(records: Sequence[Record], controller: PI | None) -> tuple[Rows, Rows, Rows]:
    """(linear, even, odd) columns: lags of the command itself, of its square and modulus, of its cube and r|r|."""
    sources: list[Vector] = []
    for rec in records:
        source = rec.torque if controller is None else rec.command
        if source is None:
            raise RecordError(f"the record has no {'torque' if controller is None else 'command'}, which drives the simulation")
        sources.append(source / max(float(np.abs(source).max()), 1e-300))
    shortest = min(len(x) for x in sources)
    # A measured torque may carry the noise of its own sample.
    lags = tuple(k for k in LAGS if k < shortest // 4 and not (controller is None and k == 0))
    few = lags[::3]
    one = np.concatenate([np.ones(len(x)) for x in sources])

    def block(powers: Sequence[Callable[[Vector], Vector]], chosen: Sequence[int]) -> Rows:
        return np.array([np.concatenate([_lagged(f(x), k) for x in sources]) for f in powers for k in chosen])

    linear = np.vstack([one, block([lambda x: x], lags)])
    return linear, block([np.square, np.abs], few), block([lambda x: x**3, lambda x: x * np.abs(x)], few)


def _directed(model: Model, records: Sequence[Record], outputs: Sequence[Vector], controller: PI | None) -> dict[str, Rows]:
    """How each kind of missing torque would show in the velocity, (columns, all samples)."""
    top = max(float(np.abs(y).max()) for y in outputs)
    found: dict[str, list[list[Vector]]] = {}
    for rec, w in zip(records, outputs, strict=True):
        if controller is not None and rec.command is not None:
            u = pi_torque(rec.command, w, rec.dt, controller)
        else:
            u = np.zeros_like(w) if rec.torque is None else rec.torque
        theta = position_of(rec) if rec.position is not None else rec.dt * np.cumsum(w)
        loop = disturbed(discretised(model, rec.dt, "sampled" if controller is None else controller.loop), controller, rec.dt)
        for name, columns in torque_columns(w, theta, u, rec.time, top).items():
            shown = [loop.response(f) for f in columns]
            found.setdefault(name, [[] for _ in shown])
            for kept, response in zip(found[name], shown, strict=True):
                kept.append(response)
    rows = {name: np.array([np.concatenate(column) for column in columns]) for name, columns in found.items()}
    return {name: block[np.all(np.isfinite(block), axis=1)] for name, block in rows.items()}


def _rest(v: Vector, rows: Rows) -> Vector:
    """v without what the rows explain."""
    basis = orthonormal_rows(rows)
    return v - basis.T @ (basis @ v)


def _stationary(parts: Sequence[Vector]) -> float:
    """p-value of equal power in first and last thirds, by the spread of block means of the squared residual."""
    groups = []
    for third in (slice(None, 1), slice(-1, None)):
        blocks = [b for x in parts for t in np.array_split(x, 3)[third] for b in np.array_split(t, max(2, len(t) // BLOCK))]
        groups.append(np.log(np.array([max(float(np.mean(b**2)), 1e-300) for b in blocks])))
    first, last = groups
    variance = first.var(ddof=1) / len(first) + last.var(ddof=1) / len(last)
    # Student's t with the blocks' degrees of freedom, by its normal limit: t^2 -> nu ln(1 + t^2/nu).
    nu = len(first) + len(last) - 2
    t2 = float((first.mean() - last.mean()) ** 2 / variance) if variance > 0.0 else 0.0
    return chi2_tail(max(nu - 0.5, 0.5) * math.log1p(t2 / nu), 1)


def _lagged(x: Vector, k: int) -> Vector:
    out = np.zeros_like(x)
    out[k:] = x[: len(x) - k]
    return out


def _split(row: Vector, lengths: Sequence[int]) -> list[Vector]:
    return np.split(row, np.cumsum(lengths)[:-1])
