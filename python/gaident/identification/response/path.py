"""What a frequency response contains beside the axis: a delay tau and a lag T of the torque's path.

    G(f) = H(f) G_axis(f),   H(f) = exp(-j omega tau) / (1 + j omega T)

The delay is that of the controller's computing and of a bus, the lag that of a current loop.
Behind a hold both lie between the hold and the axis: G is then the held response of the whole, exactly.
Looked for where no chain of masses holds without them.
From each start of a grid the structures are searched anew.
From each chain of masses tau alone, T alone, then both are fitted together with the factors x (Levenberg-Marquardt, MINPACK):

    J(x, log tau, log T) = sum |e_k|^2,   e_k = sqrt(2) (G_k - G(f_k; x, tau, T)) / sigma_k
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.data.frequency.response import FrequencyResponse
from gaident.identification.response.held import held_response, held_transfer
from gaident.identification.response.weighed import Weighed
from gaident.models.effects import Effect
from gaident.models.effects_linear import DELAY, LAG
from gaident.models.factors import FactorCounts, factor_parameters, model_from_factor_parameters
from gaident.models.model import Model

__all__ = ["NO_PATH", "Path", "Together", "fitted", "is_start", "lags_after", "starts", "with_lag"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]

GRID = tuple(0.5 + 2.0 * k for k in range(5))  # no decision: a grid: rad, the phase of a path at the highest frequency
LAGS = (0.5,)  # no decision: a grid: parts of a path that its lag begins from; the rest is the delay
LEAST = 0.05  # no decision: a grid: rad at the highest frequency, of a delay that begins from nearly nothing
FRACTION = 1e-2  # no decision: of a solver: the least unit of a factor, in units of the lowest frequency
EVALUATIONS = 200  # no decision: of a solver
STEP = 1.5e-8  # no decision: rounding: a forward difference
TOLERANCE = 1e-12  # no decision: of a solver
NOTHING = 1e-5  # no decision: rounding: rad at the highest frequency, of a path
EVERYTHING = 1e3  # no decision: rounding: rad at the lowest frequency; a longer lag is an integrator

EFFECTS = {"delay": (DELAY, "delay"), "lag": (LAG, "time_constant")}
"""Unknown -> the effect that it is of the model, and its parameter."""

HIGHEST = {name: Effect(effect, {parameter: 0.0}).row.parameters[0].highest for name, (effect, parameter) in EFFECTS.items()}


@dataclass(frozen=True)
class Path:
    """A delay [s] and a lag [s], each None where there is none."""

    delay: float | None = None
    lag: float | None = None

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of what there is, in the order of the model's effects."""
        return tuple(name for name in EFFECTS if getattr(self, name) is not None)

    @property
    def values(self) -> Vector:
        """The unknowns [s]."""
        return np.array([getattr(self, name) for name in self.unknowns])

    @property
    def total(self) -> float:
        """By how much a slow torque comes late [s]."""
        return float(np.sum(self.values))

    def behind(self, axis: Model) -> Model:
        """The axis behind the path: with its effects."""
        for name in self.unknowns:
            effect, parameter = EFFECTS[name]
            axis = axis.with_effect(effect, **{parameter: getattr(self, name)})
        return axis

    def inverse(self, response: FrequencyResponse, axis: Model | None) -> Complex:
        """1/H at the frequencies of a response; axis: behind a hold, None: an inertia."""
        omega, dt = response.omega, response.dt
        if dt is None:
            made: Complex = np.exp(1j * omega * (self.delay or 0.0)) * (1.0 + 1j * omega * (self.lag or 0.0))
            return made
        axis = axis or Model(1.0, [0.0])
        return held_response(axis, omega, dt) / held_response(self.behind(axis), omega, dt)


NO_PATH = Path()


@dataclass(frozen=True)
class Together:
    """An axis and a path fitted together. of_axis: e by the axis' `factor_parameters`, of_path: by the path's unknowns [s]."""

    axis: Model
    path: Path
    of_axis: Matrix  # (2 n, parameters)
    of_path: Matrix  # (2 n, unknowns)

    def covariance(self, std: float) -> Matrix | None:
        """Of the parameters of the axis, then of the unknowns; std: of the errors; None where the data leave one open."""
        columns = np.hstack([self.of_axis, self.of_path])
        size = np.linalg.norm(columns, axis=0)
        if not np.all(np.isfinite(size)) or np.any(size == 0.0):
            return None
        q, r = np.linalg.qr(columns / size)
        if np.min(np.abs(np.diag(r))) < len(q) * np.finfo(float).eps:
            return None
        inverse = np.linalg.inv(r) / size[:, None]
        made: Matrix = std**2 * inverse @ inverse.T
        return made

    def freed(self, layout: Matrix) -> Matrix:
        """J'J of the axis' parameters where the path is unknown, too; layout: d(these parameters)/d(those wanted).

        What the path can do is taken out of their columns.
        """
        q, _ = np.linalg.qr(self.of_path)
        left = self.of_axis @ layout
        left = left - q @ (q.T @ left)
        made: Matrix = left.T @ left
        return made


def is_start(delay: float, highest: float) -> bool:
    """Whether a delay [s] is one to begin from; highest: frequency [rad/s]."""
    return 0.0 < delay <= min(GRID[-1] / highest, HIGHEST["delay"])


def starts(highest: float) -> list[Path]:
    """Paths to begin from: none, then delays; highest: frequency [rad/s]."""
    return [NO_PATH, *(Path(phase / highest) for phase in GRID if is_start(phase / highest, highest))]


def with_lag(total: float) -> list[Path]:
    """Paths with a lag that come late by `total` [s]: a lag alone, then a delay and a lag."""
    return [Path(lag=total), *(Path((1.0 - part) * total, part * total) for part in LAGS)]


def lags_after(delay: float | None, lag: float, highest: float) -> list[Path]:
    """Paths of a lag [s] that is known about: alone, and after a delay [s]; highest: frequency [rad/s]."""
    return [Path(lag=lag), Path(delay or LEAST / highest, lag)]


def fitted(parts: Sequence[Weighed], axis: Model, path: Path, tolerance: float) -> Together | None:
    """Axis and path fitted together to responses, from a start on; None where they run away, or a path vanishes.

    tolerance: relative fall of J that ends it.
    """
    from scipy.optimize import least_squares

    counts, names = FactorCounts.of(axis), path.unknowns
    start = np.concatenate([factor_parameters(axis)[1], np.log(path.values)])
    # In units of the start; a root near 0 in units of the lowest frequency.
    low = min(float(p.response.omega[0]) for p in parts)
    size = np.ones(len(start))
    size[: counts.size] = np.maximum(np.abs(start[: counts.size]), low * FRACTION)
    weights = [np.sqrt(2.0) / (p.size * p.response.relative_std * np.abs(p.response.velocity_response)) for p in parts]

    def errors(x: Matrix) -> Matrix:
        """Of each row of x."""
        numbers = x * size
        late = dict(zip(names, np.exp(numbers[:, counts.size :, None]).swapaxes(0, 1), strict=True))
        found = [
            w * (p.response.velocity_response - _response(numbers[:, : counts.size], counts, late, p.response))
            for w, p in zip(weights, parts, strict=True)
        ]
        made: Matrix = np.concatenate(found, axis=1).view(np.float64)
        return made

    def columns_at(x: Vector) -> Matrix:
        step = STEP * np.maximum(1.0, np.abs(x))
        found = errors(np.vstack([x, x + np.diag(step)]))
        made: Matrix = ((found[1:] - found[0]) / step[:, None]).T
        return made

    with np.errstate(all="ignore"):  # what runs away is no result
        done = least_squares(
            lambda x: errors(x[None])[0],
            start / size,
            columns_at,
            method="lm",
            x_scale="jac",
            max_nfev=EVALUATIONS,
            ftol=tolerance,
            xtol=TOLERANCE,
            gtol=TOLERANCE,
        )
        numbers, columns = done.x * size, done.jac / size
        values, highest = np.exp(numbers[counts.size :]), max(float(p.response.omega[-1]) for p in parts)
    inside = (values * highest > NOTHING) & (values * low < EVERYTHING) & (values <= [HIGHEST[name] for name in names])
    if not np.all(np.isfinite(numbers)) or numbers[0] * axis.gain <= 0.0 or not np.all(inside):
        return None
    return Together(
        model_from_factor_parameters(numbers[: counts.size], counts),
        Path(**dict(zip(names, map(float, values), strict=True))),
        -columns[:, : counts.size],
        -columns[:, counts.size :] / values,
    )


def _response(x: Matrix, counts: FactorCounts, late: dict[str, Matrix], response: FrequencyResponse) -> Complex:
    """G(f; x, tau, T), shape (m, n), for each of m rows of factors; delay and lag: shape (m, 1)."""
    at, gain, omega = 1 + counts.real_poles + 2 * counts.pole_pairs, x[:, :1], response.omega
    delay, lag = late.get("delay", np.zeros((1, 1))), late.get("lag")
    of_poles, of_zeros = (x[:, 1:at], counts.real_poles), (x[:, at:], counts.real_zeros)
    if response.dt is None:
        s: Complex = np.asarray(1j * omega, complex)
        made: Complex = gain * np.exp(-s * delay) * _product(*of_zeros, s) / _product(*of_poles, s)
        return made if lag is None else made / (1.0 + s * lag)
    poles = _roots(*of_poles)
    if lag is not None:
        poles, gain = np.hstack([poles, -1.0 / lag]), gain / lag
    return held_transfer(gain, poles, _roots(*of_zeros), delay, omega, response.dt)


def _product(x: Matrix, reals: int, s: Complex) -> Complex:
    made = np.ones((len(x), len(s)), complex)
    for i in range(reals):
        made *= s + x[:, i : i + 1]
    for i in range(reals, x.shape[1], 2):
        made *= (s + x[:, i : i + 1]) * s + x[:, i + 1 : i + 2]
    return made


def _roots(x: Matrix, reals: int) -> Complex:
    e1, e0 = x[:, reals::2], x[:, reals + 1 :: 2]
    apart = np.sqrt(e1 * e1 - 4.0 * e0 + 0j)
    return np.hstack([-x[:, :reals] + 0j, 0.5 * (apart - e1), -0.5 * (apart + e1)])
