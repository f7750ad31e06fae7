"""Unexplained dependence: what the error still depends on, named by its driver and never by a cause.

Each driver is one family, or several, of torques that span the functions of it: piecewise linear ones of velocity, torque and
position, harmonics of the angle, elasto-plastic elements (what depends on the past path), single frequencies in time.
A load, dry friction and a torque constant that change in time are a family each; so is a wave of the angle of an order that the
model contains, at the shaft or of the sensor, whose size is any parabola of the speed.
The linear part of the model answers to each; what the answers explain of the whitened error, beyond what the model's own
parameters could, is the gain in BIC units; the best family's is the driver's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.control.filtering import clamped_sum
from gaident.diagnosis.selection.screening.spectrum import lines
from gaident.estimation.criterion import cost_of
from gaident.estimation.least_squares import scored
from gaident.estimation.noise_model import WHITE, ShaftNoise
from gaident.estimation.objective import Fit, Innovations, Objective
from gaident.estimation.prediction import coupling_response, twist
from gaident.estimation.projection import project_out
from gaident.policy.table import POLICY

__all__ = ["Dependence", "beside_torque_noise", "dependence", "families", "without_torque"]

KNOTS = np.array([1.0, 4.0, 12.0, 30.0, 60.0])  # no decision: multiples of the first knot, whose place is a row of the policy

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Dependence:
    """Gains [BIC units] by driver, and the strongest where it counts, from `needed` on.

    least: squared raw errors beside each driver's family; unwhitened: the same before whitening, by which output errors count.
    rest: the squared errors before whitening beside the model alone.
    """

    gains: dict[str, float]
    least: dict[str, float]
    unwhitened: dict[str, float]
    needed: float
    line: tuple[float, float] | None = None  # (frequency [Hz], torque [N m]) where "time" is one
    whitened: bool = True
    rest: float = 0.0

    @property
    def shares(self) -> dict[str, float]:
        """Part of the squared error before whitening that each driver's family takes away; empty where there is none."""
        return {d: max(1.0 - left / self.rest, 0.0) for d, left in self.unwhitened.items()} if self.rest > 0.0 else {}

    @property
    def strongest(self) -> str | None:
        """The driver that explains most, counted or not: of whitened errors by gain, of output errors by what is left."""
        if not self.whitened:
            return min(self.unwhitened, key=lambda d: self.unwhitened[d], default=None)
        return max(self.gains, key=lambda d: self.gains[d], default=None)

    @property
    def driver(self) -> str | None:
        """The driver that explains most, None where nothing significant is left."""
        name = self.strongest
        return name if name is not None and self.gains[name] > self.needed and self.matters(name) else None

    def matters(self, driver: str) -> bool:
        """Whether a function of it takes away a share of the error before whitening.

        With many exact samples, what no user would miss is significant.
        A single frequency is looked for beyond the family of its driver, and is small by nature.
        """
        if driver == "time" and self.line is not None:
            return True
        return self.unwhitened[driver] <= (1.0 - POLICY.driver_share) * self.rest


def dependence(objective: Objective, fit: Fit) -> Dependence:
    """Every driver's gain over the model.

    In 5 to 7 % of records of 500 and 1000 samples without effects the largest gain is above 0, in 26 % of steps of 250: the noise
    filter, which is fitted again without the family, is uncertain by more. What counts as a gain is calibrated on such records.
    """
    data = objective.data
    J, error = objective.sensitivities(fit.hypothesis, fit.x)
    families = _families(objective, fit, error)
    account = _Account(objective, J, error, fit)
    none = account.bic(np.zeros((0, len(error))))
    gains, columns = {}, {}
    for driver, rows in families.items():
        bics = [account.bic(family) for family in rows]
        best = int(np.argmin(bics))
        gains[driver], columns[driver] = none - bics[best], rows[best]
    line = None
    for _, pairs in lines(project_out(J, error[None, :])[0], data.lengths):
        # A frequency that was searched for counts as a number more.
        gain = none - account.bic(pairs) - cost_of(1, objective.information)
        if gain > gains["time"] and (found := _torque_of_line(objective, fit, J, error, pairs)) is not None:
            gains["time"], line = gain, found
    beside = {driver: np.vstack([J, rows]) for driver, rows in columns.items()}
    least = {driver: objective.raw_rest(rows, error) for driver, rows in beside.items()}
    unwhitened = {driver: objective.unwhitened_rest(rows, error) for driver, rows in beside.items()}
    whitened = isinstance(objective.family, Innovations)
    needed = POLICY.dependence_gain * (1.0 + (POLICY.short_record / objective.count if whitened else 0.0))
    rest = objective.unwhitened_rest(J, error)
    return Dependence({driver: float(gain) for driver, gain in gains.items()}, least, unwhitened, needed, line, whitened, rest)


def families(objective: Objective, fit: Fit) -> dict[str, Matrix]:
    """Driver -> rows that span what its free functions do to the error, before all filters."""
    return {driver: np.vstack(rows) for driver, rows in _families(objective, fit, objective.error(fit)).items()}


def _families(objective: Objective, fit: Fit, error: Vector) -> dict[str, list[Matrix]]:
    data, parameters, x = objective.data, fit.parameters, fit.x
    w = objective.measured - error
    # Numbers for a family; from 290 samples on there is room for all.
    room = max(len(w) // POLICY.function_samples, POLICY.least_functions)
    torques: dict[str, list[Matrix]] = {
        "velocity": [_hats_by_sign(w)],
        "position": [_of_position(data.angle, w)],
        "torque": [_hats(data.torque, POLICY.function_knots)],
        "past": [_of_path(data.angle, data.lengths)],
        "time": _drifts(data.time, w, None if data.torque_measured else data.torque),
    }
    if data.command is not None:
        torques["command"] = [_hats(data.command, POLICY.function_knots)]
    response, shown = fit.predictor.torque_response, fit.predictor.sensor_response
    found = {driver: [response(parameters, x, rows) for rows in of] for driver, of in torques.items()}
    if orders := _orders(fit):
        shaft, sensor = _waves(orders, data.angle, w)
        found["position"].append(np.vstack([response(parameters, x, shaft), shown(parameters, x, sensor)]))
    if parameters.masses == 2:
        of_twist = coupling_response(data, parameters, x, _of_path(twist(data, parameters, x), data.lengths))
        found["past"] = [np.vstack([*found["past"], of_twist])]
    return {driver: [_strongest(rows, room) for rows in of] for driver, of in found.items()}


def beside_torque_noise(objective: Objective, fit: Fit) -> Dependence:
    """Every driver's gain over a model that a measured torque drives.

    The noise of that torque makes errors of the colour of the mechanism, slow ones and such that swing: a noise model of torques
    at the shaft whitens them, and each sample counts. The torque is no driver here: a function of it contains its noise.
    """
    shaft = ShaftNoise(fit.parameters.linear(fit.x), objective.data.dt, None)
    whitened = objective.under(Innovations(shaft))
    return without_torque(dependence(whitened, scored(whitened, fit)))


def without_torque(left: Dependence) -> Dependence:
    """The same without the torque as a driver."""
    gains, least, unwhitened = (
        {d: value for d, value in values.items() if d != "torque"} for values in (left.gains, left.least, left.unwhitened)
    )
    return replace(left, gains=gains, least=least, unwhitened=unwhitened)


def _strongest(rows: Matrix, room: int) -> Matrix:
    """As many combinations of the rows as a short record has room for: the principal components of the rows, each of size 1.

    They are the same whatever the order of the rows, and contain of all of them as much as so few can.
    """
    sizes = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    if len(rows) <= room or not np.all(np.isfinite(sizes)):
        return rows
    unit = rows[sizes > 0.0] / sizes[sizes > 0.0][:, None]
    _, vectors = np.linalg.eigh(unit @ unit.T)
    return np.asarray(vectors[:, ::-1][:, :room].T @ unit)


class _Account:
    """BIC of the error with some columns taken out, each set under a noise filter of its own (two rounds of GLS)."""

    def __init__(self, objective: Objective, J: Matrix, error: Vector, fit: Fit) -> None:
        self.objective, self.J, self.error, self.noise, self.closed = objective, J, error, fit.noise, fit.predictor.closed

    def bic(self, columns: Matrix) -> float:
        sizes = np.sqrt(np.einsum("ij,ij->i", columns, columns))
        columns = columns[sizes > 1e-9 * max(float(sizes.max(initial=0.0)), 1e-300)]
        rows = np.vstack([self.J, columns])
        noise = self.noise
        best = np.inf
        for again in (True, True, False):
            A, v = self.objective.whitened(rows, noise), self.objective.whitened(self.error[None, :], noise)[0]
            scale = np.sqrt(np.einsum("ij,ij->i", A, A))
            scale[scale == 0.0] = 1.0
            coefficients, _, rank, _ = np.linalg.lstsq((A / scale[:, None]).T, v, rcond=1e-8)
            left = v - (coefficients / scale) @ A
            best = min(best, self.objective.bic(float(left @ left), noise, int(rank)))
            if again:
                noise = self.objective.noise_of(self.error - (coefficients / scale) @ rows, self.closed)
        return float(best)


def _hats(s: Vector, count: int) -> Matrix:
    """Piecewise linear functions of s with knots at its quantiles: they sum to 1."""
    knots = np.unique(np.quantile(s, np.linspace(0.0, 1.0, count)))
    if len(knots) < 2:
        return np.ones((1, len(s)))
    return np.array([np.interp(s, knots, np.eye(len(knots))[i]) for i in range(len(knots))])


def _hats_by_sign(w: Vector) -> Matrix:
    """Functions of velocity that may jump at 0: hats in |w| on either side."""
    top = float(np.abs(w).max()) or 1.0
    shares = np.minimum(np.asarray(POLICY.slow_knot * KNOTS), 1.0)
    knots = top * np.unique([0.0, *shares, 1.0])
    hats = np.array([np.interp(np.abs(w), knots, np.eye(len(knots))[i]) for i in range(len(knots))])
    rows = np.vstack([hats * (w > 0.0), hats * (w < 0.0)])
    rows = rows[np.abs(rows).sum(axis=1) > 0.0]
    return rows if len(rows) else np.ones((1, len(w)))


def _of_position(angle: Vector, w: Vector) -> Matrix:
    """Slow functions of the angle, with and without the direction of motion; the first turns' harmonics."""
    turned = float(np.ptp(angle))
    direction = np.sign(w)
    shapes = [f(k * angle) for k in (1.0, 2.0) for f in (np.sin, np.cos) if k * turned > 1.0]
    shapes += list(_hats(angle, POLICY.angle_knots)[1:])
    rows = [s * d for s in shapes for d in (np.ones_like(w), direction)]
    return np.array(rows).reshape(-1, len(w))


def _of_path(angle: Vector, lengths: tuple[int, ...]) -> Matrix:
    """Elasto-plastic elements: each follows the angle until it yields at a width of its own, and so depends on the past."""
    travel = float(np.ptp(angle)) or 1.0
    widths = travel * np.geomspace(POLICY.least_width, POLICY.most_width, POLICY.path_widths)
    rows = np.empty((len(widths), len(angle)))
    at = 0
    for n in lengths:
        steps = np.diff(angle[at : at + n], prepend=angle[at])
        for row, width in zip(rows, widths.tolist(), strict=True):
            row[at : at + n] = clamped_sum(steps, width)
        at += n
    return rows / widths[:, None]


def _drifts(t: Vector, w: Vector, u: Vector | None) -> list[Matrix]:
    """What changes in the course of a record: a load, friction, a torque constant; u None: the torque contains noise."""
    s = t / (float(t.max()) or 1.0)
    dry = _hats(s, POLICY.time_knots)[1:] * np.sign(w)
    families = [np.array([s, s * s]), np.vstack([dry, s * w])]
    return families if u is None else [*families, np.array([s * u, s * s * u])]


def _orders(fit: Fit) -> list[float]:
    """The orders of the angle that the model contains."""
    terms = [t for t in fit.parameters.terms if t.harmonic]
    found = [t.orders_in(fit.x[fit.parameters.slot(t.name)]) if t.chooses_order else [1.0] for t in terms]
    return [float(order) for orders in found for order in orders]


def _waves(orders: Sequence[float], angle: Vector, w: Vector) -> tuple[Matrix, Matrix]:
    """(torques at the shaft (6 n, samples), errors of the sensor (4 n, samples)) of n orders; speeds in parts of the largest."""
    speed = np.abs(w) / (float(np.abs(w).max()) or 1.0)
    pairs = np.vstack([f(order * angle) for order in orders for f in (np.sin, np.cos)])
    return np.vstack([pairs, pairs * speed, pairs * speed**2]), np.vstack([pairs * w, pairs * w * speed])


def _torque_of_line(objective: Objective, fit: Fit, jacobian: Matrix, error: Vector, pairs: Matrix) -> tuple[float, float] | None:
    """(frequency [Hz], amplitude [N m]) of a torque a cos(wt) + b sin(wt), fitted to the error beside the model's parameters.

    jacobian (parameters, N) and error (N,) raw; pairs: rows cos(wt), sin(wt) of each record, 0 outside it, t from its start.
    Of several records the amplitude is the rms of theirs, each by its samples.
    None: in a loop that grows beyond all numbers no torque has a finite response.
    """
    answers = fit.predictor.torque_response(fit.parameters, fit.x, pairs)
    if not np.isfinite(answers).all():
        return None
    rows = objective.whitened(np.vstack([jacobian, answers]), WHITE)
    sizes = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    sizes[sizes == 0.0] = 1.0
    v = objective.whitened(error[None, :], WHITE)[0]
    found = np.linalg.lstsq((rows / sizes[:, None]).T, v, rcond=1e-8)[0] / sizes
    radians_per_sample = float(np.arctan2(pairs[1, 1], pairs[0, 1]))
    powers = np.sum(found[-len(pairs) :].reshape(-1, 2) ** 2, axis=1)
    amplitude = float(np.sqrt(np.average(powers, weights=objective.lengths)))
    return radians_per_sample / (2.0 * np.pi * fit.parameters.scales.dt), amplitude
