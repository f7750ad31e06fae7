"""A winding's resistance and back-EMF constant from a log of voltage, current and velocity, by least squares."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, minimize_scalar

from gaident.checks import LONGEST, real_number
from gaident.data.record import Record
from gaident.data.signals.arrays import channel
from gaident.data.signals.decimation import decimated
from gaident.data.winding import Winding, mean_of_ends, share_of_end
from gaident.errors import RecordError
from gaident.estimation.regression.motion import ORDER, cutoff_of, low_passed
from gaident.estimation.regression.regression import covariance, solve
from gaident.estimation.regression.rows import decimation_of
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["WindingFit", "estimate_winding"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

PASSES = 3  # no decision: of a solver
GRID = 33  # no decision: of a solver: so many shares are tried before the best one's neighbourhood
SLOWEST = 0.99  # no decision: of a solver: x/(1 + x) of a time constant of a hundred samples
SHARE_FOUND = 1e-7  # no decision: of a solver
STEPS = (1e-9, 1e3)  # no decision: of a solver: samples, between which the deviation of a time constant is looked for
NAMES = {"resistance": "Ohm", "back_emf_constant": "V s/rad", "inductance": "H", "offset": "V"}


@dataclass(frozen=True)
class WindingFit:
    """What `estimate_winding` found.

    Attributes
    ----------
    winding : Winding
        With these values, an inductance only where it is determined.
    parameters : mapping of str to Estimate
        "resistance", "back_emf_constant", "inductance" and "offset".
    error : float
        The rms of the voltage that is left over that of the voltage [1].
    cutoff_hz : float
        Corner of the zero-phase filter that all three passed [Hz].
    held : bool
        Whether the voltage was taken as held from line to line; else it goes on between the lines.
    end : float
        h [1], the share that the mean over a held voltage's time has of the current at its end.

    See Also
    --------
    estimate_winding : Makes it, with an example.
    """

    winding: Winding
    parameters: Mapping[str, Estimate]
    error: float
    cutoff_hz: float
    held: bool = True
    end: float = 1.0

    def mean_current(self, current: ArrayLike, velocity: ArrayLike, dt: float) -> Vector:
        """Return the mean current over each sample, from the sampled one, as `Winding.mean_current`.

            (1 - h) i(n) + h i(n+1) + (h - 1/2) ke/R (w(n+1) - w(n)),   h = `end`

        Parameters
        ----------
        current, velocity : array_like, shape (n,)
            i [A], w [rad/s].
        dt : float
            Sample time [s].

        Returns
        -------
        ndarray of shape (n,)
            The mean current [A]. Of a voltage that goes on between the lines it is the current itself.
        """
        if not self.held:
            return channel(current, "current")
        return mean_of_ends(channel(current, "current"), channel(velocity, "velocity"), self.end, self.winding)

    def summary(self) -> str:
        """Return the values with their deviations, a line each."""
        lines = [f"{name.replace('_', ' ')}  {e.value:.5g} +- {e.std:.2g} {e.unit}" for name, e in self.parameters.items()]
        return "\n".join([*lines, f"{100 * self.error:.2g} % of the voltage is left, below {self.cutoff_hz:g} Hz"])


def estimate_winding(
    voltage: ArrayLike, current: ArrayLike, velocity: ArrayLike, dt: float, *, cutoff_hz: float | None = None
) -> WindingFit:
    """Estimate a winding's resistance and back-EMF constant from voltage, current and velocity.

        U(n) = R ((i(n) + i(n+1))/2 + (1 + a)/(1 - a) (i(n+1) - i(n))/2) + ke ((1 - h) w(n) + h w(n+1)) + U0
        a = exp(-1/x),   h = 1/(1 - a) - x,   x = L/(R dt)

    by least squares in R, ke, x and U0, all signals behind the same zero-phase filter and decimated.
    Under a voltage that is held over each sample the current goes with the time constant L/R to where it would settle,

        i(n+1) = a i(n) + (1 - a) (U(n) - U0 - ke w)/R

    and h weighs a velocity that goes straight from sample to sample.
    Where a mechanical time constant has only four samples the line is bent: x comes out 0.03 too small, and R 0.6 %.
    The current is sampled at the end of the time of U(n).
    Of a motor that only accelerates itself the current is nearly the velocity's change, so that R and a small x are told apart
    badly: that is in their deviations.
    The winding has the inductance where x is above 0 by `winding_sure` deviations.
    Some logs have the voltage of the sample before.
    Without an inductance the current is then sampled at h of its voltage's time,

        U(n) = R ((1 - h) i(n) + h i(n+1)) + ke ((1 - h) w(n) + h w(n+1)) + U0

    which holds where h is below 1 by `winding_sure` deviations.
    Of a voltage that goes on between the lines, as that of a current controller faster than the log, each line is a sample:

        (U(n) + U(n+1))/2 = R (i(n) + i(n+1))/2 + ke (w(n) + w(n+1))/2 + (L/dt) (i(n+1) - i(n)) + U0

    A voltage that most lines repeat is held.
    Of another one the equation counts that leaves the smaller share of the voltage.
    Where both leave alike shares, to within `voltage_alike`, their difference is in the deviations.
    The deviations know that neighbouring errors are alike (Newey and West 1987).

    Parameters
    ----------
    voltage, current, velocity : array_like, shape (n,)
        U [V], i [A], w [rad/s]; of a linear motor w in m/s. The back-EMF constant is a DC motor's torque constant.
    dt : float
        Sample time [s].
    cutoff_hz : float, optional
        Corner of the filter [Hz]; None: as `inverse_dynamics` chooses it from the noise of the velocity.

    Returns
    -------
    WindingFit
        Frozen: `winding`, `parameters`, `error`, `cutoff_hz`, `held`, `summary()`.

    Raises
    ------
    RecordError
        Arrays that a Record would refuse, a motion that does not tell resistance from back-EMF, or values without sense.

    Notes
    -----
    Voltage and velocity alone do not tell a back-EMF from viscous friction: J dw/dt = (kt/R) U - (D + kt ke/R) w has two
    coefficients of U and w for three unknowns. The current does, or R and kt from the data sheet.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> t = 1e-3 * np.arange(4000)
    >>> i, w = np.sin(30 * t) + np.sin(7 * t), 40 * np.sin(3 * t)
    >>> found = ga.estimate_winding(0.5 * i + 0.05 * w, i, w, dt=1e-3)
    >>> round(found.winding.resistance, 3), round(found.winding.torque_constant, 3)
    (0.5, 0.05)
    """
    U, i, w = channel(voltage, "voltage"), channel(current, "current"), channel(velocity, "velocity")
    if not len(U) == len(i) == len(w):
        raise RecordError(f"voltage, current and velocity have {len(U)}, {len(i)} and {len(w)} samples: give the same of each")
    rec = Record(dt, velocity=w, torque=i)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return _estimated(U, i, w, rec, cutoff_hz)


def _estimated(U: Vector, i: Vector, w: Vector, rec: Record, cutoff_hz: float | None) -> WindingFit:
    nyquist = 0.5 / rec.dt  # no decision: a formula
    remedy = f"give a corner between {1.0 / LONGEST:g} and {nyquist:g} Hz, or None"
    cutoff = cutoff_of(rec, ORDER) if cutoff_hz is None else real_number(cutoff_hz, "cutoff_hz", RecordError, remedy)
    if not 1.0 / LONGEST <= cutoff < nyquist:
        raise RecordError(f"cutoff_hz={cutoff_hz!r}: {remedy}")
    factor = decimation_of(None, cutoff, rec.dt)
    repeated = float(np.mean(np.diff(U) == 0.0)) > 0.5  # no decision: a formula: most of them
    rows = _Rows.of([low_passed(x, rec.dt, cutoff, ORDER) for x in (U, i, w)], factor)
    held, straight = _held(rows, rec.dt), _straight(rows, rec.dt)
    of, still = (held, True) if repeated or held.error <= straight.error else (straight, False)
    if not repeated and max(held.error, straight.error) < (1.0 + POLICY.voltage_alike) * of.error:
        of = replace(of, stds=np.hypot(of.stds, np.abs(held.values - straight.values)))
    found = {
        name: Estimate(float(x), float(s), unit, identifiable=bool(s < abs(x)))
        for (name, unit), x, s in zip(NAMES.items(), of.values, of.stds, strict=True)
    }
    found["inductance"] = replace(found["inductance"], identifiable=of.deviations > 1.0)
    for name in ("resistance", "back_emf_constant"):
        e = found[name]
        if not e.value > POLICY.winding_sure * e.std:
            raise RecordError(
                f"the {name.replace('_', ' ')} comes out as {e.value:.3g} +- {e.std:.2g} {e.unit}: voltage, current and velocity "
                "do not determine it; check their units and signs, and give a motion with load and speed apart, such as "
                "reversals and ramps"
            )
    shown = of.deviations > POLICY.winding_sure
    winding = Winding(found["resistance"].value, found["back_emf_constant"].value, found["inductance"].value if shown else 0.0)
    return WindingFit(winding, found, of.error, cutoff, still, of.end)


@dataclass(frozen=True)
class _Fitted:
    """values, stds: R, ke, L, U0. deviations: by how many the inductance is above 0. error: share of the voltage that is left.

    end: h.
    """

    values: Vector
    stds: Vector
    deviations: float
    error: float
    end: float = 1.0


class _Rows(NamedTuple):
    """Voltage, current and velocity of the rows: at each line (U, i, w) and at the one behind it (U1, i1, w1)."""

    U: Vector
    U1: Vector
    i: Vector
    i1: Vector
    w: Vector
    w1: Vector

    @classmethod
    def of(cls, signals: Sequence[Vector], factor: int) -> _Rows:
        """Every so-many-th of U, i and w, without the ends, where the filter has no past."""
        return cls(*(decimated(np.ascontiguousarray(x), factor)[2:-2] for s in signals for x in (s[:-1], s[1:])))

    def regressed(self, columns: Sequence[Vector], of: Vector) -> _Regressed:
        """The columns' coefficients, and last that of a constant."""
        if len(of) < POLICY.least_rows:
            raise RecordError(f"only {len(of)} rows are left behind the filter; give a longer record")
        X = np.column_stack([*columns, np.ones(len(of))])
        theta, _ = solve(X, of)
        left = of - X @ theta
        return _Regressed(theta, X, left, float(np.sqrt(left @ left / (of @ of))))


class _Regressed(NamedTuple):
    """theta: coefficients of the columns of X; left: of the voltage; error: its share."""

    theta: Vector
    X: Matrix
    left: Vector
    error: float


def _held(rows: _Rows, dt: float) -> _Fitted:
    """Under a voltage that is held over each sample."""
    ends = _sampled_behind_a_step(rows)
    return _settling(rows, dt) if ends is None else ends


def _sampled_behind_a_step(rows: _Rows) -> _Fitted | None:
    """A current that follows at once, sampled within its voltage's time; None where it is not surely before that time's end."""
    end = 0.5  # no decision: of a solver: a start
    for _ in range(PASSES):
        found = rows.regressed((0.5 * (rows.i1 + rows.i), (1.0 - end) * rows.w + end * rows.w1, rows.i1 - rows.i), rows.U)
        R, c = float(found.theta[0]), float(found.theta[2])
        end = float(np.clip(0.5 + c / R, 0.0, 1.0)) if R > 0.0 else 0.5  # no decision: a formula, and the start of the passes
    cov = covariance([found.X], [found.left])
    unsure = float(np.sqrt(4.0 * cov[2, 2] - 4.0 * cov[0, 2] + cov[0, 0]))  # of 2c - R
    if not R - 2.0 * c > POLICY.winding_sure * unsure:  # no decision: a formula: 2c - R
        return None
    std = np.sqrt(np.diag(cov))
    return _Fitted(np.array([R, found.theta[1], 0.0, found.theta[3]]), std * [1, 1, 0, 1], 0.0, found.error, end)


def _settling(rows: _Rows, dt: float) -> _Fitted:
    """A current that goes with the time constant L/R to where it would settle, sampled at the end of its voltage's time."""

    def columns(x: float) -> tuple[Vector, Vector]:  # of R and ke; x = L/(R dt)
        gone = 1.0 if x == 0.0 else -np.expm1(-1.0 / x)  # 1 - a
        end = share_of_end(x)
        i = 0.5 * (rows.i1 + rows.i) + 0.5 * (2.0 - gone) / gone * (rows.i1 - rows.i)
        return i, (1.0 - end) * rows.w + end * rows.w1

    def error(share: float) -> float:
        return rows.regressed(columns(share / (1.0 - share)), rows.U).error

    grid = np.linspace(0.0, SLOWEST, GRID)
    best = int(np.argmin([error(s) for s in grid]))
    around = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, GRID - 1)])
    share = float(minimize_scalar(error, bounds=around, method="bounded", options={"xatol": SHARE_FOUND}).x)
    if error(0.0) <= error(share):
        share = 0.0
    x = share / (1.0 - share)
    found = rows.regressed(columns(x), rows.U)
    R, ke, offset = found.theta

    def spread(step: float) -> Matrix:  # covariance of R, ke, x, U0, the slope of x taken over such a step
        over, at = columns(x + step), columns(x)
        slope = (R * (over[0] - at[0]) + ke * (over[1] - at[1])) / step
        return covariance([np.column_stack([found.X[:, :2], slope, found.X[:, 2]])], [found.left])

    def beyond(log_step: float) -> float:  # log of the deviation of x that follows, over the step
        variance = float(spread(math.exp(log_step))[2, 2])
        return math.log(variance) / 2.0 - log_step if variance > 0.0 else -math.inf

    # The slope is that over one deviation of x: at x = 0 the current's part has none, and grows with exp(-1/x).
    # Without a voltage, or without noise, no step is one; the end that is nearest then says as much.
    first, last = map(math.log, STEPS)
    step = brentq(beyond, first, last) if beyond(last) < 0.0 < beyond(first) else first if beyond(first) <= 0.0 else last
    cov = spread(math.exp(step))
    std = np.sqrt(np.diag(cov))
    deviations = x / float(std[2]) if std[2] > 0.0 else np.inf * x  # of x
    slopes = np.array([x, 0.0, R, 0.0])  # of L/dt = R x
    std[2] = dt * np.sqrt(max(float(slopes @ cov @ slopes), 0.0))
    return _Fitted(np.array([R, ke, R * dt * x, offset]), std, deviations, found.error, share_of_end(x))


def _straight(rows: _Rows, dt: float) -> _Fitted:
    """Under a voltage that goes straight from line to line."""
    columns = (0.5 * (rows.i1 + rows.i), 0.5 * (rows.w1 + rows.w), (rows.i1 - rows.i) / dt)
    found = rows.regressed(columns, 0.5 * (rows.U1 + rows.U))
    std = np.sqrt(np.diag(covariance([found.X], [found.left])))
    L = float(found.theta[2])
    return _Fitted(found.theta, std, L / float(std[2]) if std[2] > 0.0 else np.inf * L, found.error)
