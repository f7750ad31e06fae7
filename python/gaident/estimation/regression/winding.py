"""A winding's resistance and back-EMF constant from a log of voltage, current and velocity, by least squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.checks import real_number
from gaident.data.record import Record
from gaident.data.signals.arrays import channel
from gaident.data.signals.decimation import decimated
from gaident.data.winding import Winding
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

    See Also
    --------
    estimate_winding : Makes it, with an example.
    """

    winding: Winding
    parameters: Mapping[str, Estimate]
    error: float
    cutoff_hz: float
    held: bool = True

    def summary(self) -> str:
        """Return the values with their deviations, a line each."""
        lines = [f"{name.replace('_', ' ')}  {e.value:.5g} +- {e.std:.2g} {e.unit}" for name, e in self.parameters.items()]
        return "\n".join([*lines, f"{100 * self.error:.2g} % of the voltage is left, below {self.cutoff_hz:g} Hz"])


def estimate_winding(
    voltage: ArrayLike, current: ArrayLike, velocity: ArrayLike, dt: float, *, cutoff_hz: float | None = None
) -> WindingFit:
    """Estimate a winding's resistance and back-EMF constant from voltage, current and velocity.

        U(n) = R (i(n) + i(n+1))/2 + ke ((1 - h) w(n) + h w(n+1)) + c (i(n+1) - i(n)) + U0

    by least squares, all signals behind the same zero-phase filter and decimated.
    Under a voltage that is held over each sample the current goes with the time constant L/R to where it would settle, so that

        i(n+1) = a i(n) + (1 - a) (U(n) - U0 - ke w)/R,   a = exp(-R dt/L)
        c = R/2 (1 + a)/(1 - a),   L = R dt/ln((2c + R)/(2c - R)),   h = 1/(1 - a) - L/(R dt)

    h weighs a velocity that goes straight from sample to sample; it is 1/2 in a first pass, and that of the L found in two more.
    With 2c <= R the current follows within the sample, and no inductance is determined; then h = 1/2 + c/R, which is 1 where the
    current is sampled at the end of the sample's voltage, and 0 where it is at its begin.
    The winding has the inductance where 2c is above R by `winding_sure` deviations of the difference: of that L is a logarithm,
    so that an L of an eighth of a sample or less cannot be told from none, whatever the deviation of L.
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
    remedy = f"give a corner between 0 and {0.5 / rec.dt:g} Hz, or None"  # no decision: a formula: the Nyquist frequency
    cutoff = cutoff_of(rec, ORDER) if cutoff_hz is None else real_number(cutoff_hz, "cutoff_hz", RecordError, remedy)
    if not 0.0 < cutoff < 0.5 / rec.dt:  # no decision: a formula: the Nyquist frequency
        raise RecordError(f"cutoff_hz={cutoff_hz!r}: give a corner between 0 and {0.5 / rec.dt:g} Hz, or None")
    factor = decimation_of(None, cutoff, rec.dt)
    repeated = float(np.mean(np.diff(U) == 0.0)) > 0.5  # no decision: a formula: most of them
    U, i, w = (low_passed(x, rec.dt, cutoff, ORDER) for x in (U, i, w))
    held, straight = _held(U, i, w, rec.dt, factor), _straight(U, i, w, rec.dt, factor)
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
    return WindingFit(winding, found, of.error, cutoff, still)


@dataclass(frozen=True)
class _Fitted:
    """values, stds: R, ke, L, U0. deviations: by how many the inductance is above 0. error: share of the voltage that is left."""

    values: Vector
    stds: Vector
    deviations: float
    error: float


def _regressed(columns: Sequence[Vector], of: Vector, factor: int) -> tuple[Vector, Matrix, float]:
    """(coefficients, their covariance, share of the voltage that is left)."""
    X, y = (np.column_stack([decimated(np.ascontiguousarray(c), factor) for c in part])[2:-2] for part in (columns, (of,)))
    if len(X) < POLICY.least_rows:
        raise RecordError(f"only {len(X)} rows are left of {len(of) + 1} samples behind the filter; give a longer record")
    theta, _ = solve(X, y[:, 0])
    left = y[:, 0] - X @ theta
    return theta, covariance([X], [left]), float(np.sqrt(left @ left / (y[:, 0] @ y[:, 0])))


def _held(U: Vector, i: Vector, w: Vector, dt: float, factor: int) -> _Fitted:
    """Under a voltage that is held over each sample."""
    later = 0.5  # no decision: of a solver: a start
    for _ in range(PASSES):
        columns = (0.5 * (i[1:] + i[:-1]), (1.0 - later) * w[:-1] + later * w[1:], np.diff(i), np.ones(len(i) - 1))
        theta, cov, error = _regressed(columns, U[:-1], factor)
        later = _later(float(theta[0]), float(theta[2]))
    R, c = float(theta[0]), float(theta[2])
    std = np.sqrt(np.diag(cov))
    # Not L by its own deviation: near 0 it is a logarithm of the excess.
    excess, unsure = 2.0 * c - R, float(np.sqrt(4.0 * cov[2, 2] - 4.0 * cov[0, 2] + cov[0, 0]))
    theta[2] = _inductance(R, excess, dt)
    std[2] = 0.5 * (_inductance(R, excess + unsure, dt) - _inductance(R, excess - unsure, dt))
    return _Fitted(theta, std, excess / unsure if unsure > 0.0 else np.inf * excess, error)


def _straight(U: Vector, i: Vector, w: Vector, dt: float, factor: int) -> _Fitted:
    """Under a voltage that goes straight from line to line."""
    columns = (0.5 * (i[1:] + i[:-1]), 0.5 * (w[1:] + w[:-1]), np.diff(i) / dt, np.ones(len(i) - 1))
    theta, cov, error = _regressed(columns, 0.5 * (U[1:] + U[:-1]), factor)
    std = np.sqrt(np.diag(cov))
    return _Fitted(theta, std, float(theta[2] / std[2]) if std[2] > 0.0 else np.inf * float(theta[2]), error)


def _inductance(R: float, excess: float, dt: float) -> float:
    """L = R dt/ln((2c + R)/(2c - R)) of the excess 2c - R; 0 without one."""
    if not (R > 0.0 and excess > 0.0):  # no decision: a formula: the logarithm has no value there
        return 0.0
    return float(R * dt / np.log1p(2.0 * R / excess))


def _later(R: float, c: float) -> float:
    """h, the weight of the velocity at the sample's end; of a current that follows within the sample, that of its instant."""
    slow = R / _inductance(R, 2.0 * c - R, 1.0) if 2.0 * c > R > 0.0 else 0.0  # no decision: a formula; R dt/L
    if slow > 0.0:
        return float(1.0 / -np.expm1(-slow) - 1.0 / slow)
    return float(np.clip(0.5 + c / R, 0.0, 1.0)) if R > 0.0 else 0.5  # no decision: a formula, and the start of the passes
