"""A winding's resistance and back-EMF constant from a log of voltage, current and velocity, by least squares."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

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

    See Also
    --------
    estimate_winding : Makes it, with an example.
    """

    winding: Winding
    parameters: Mapping[str, Estimate]
    error: float
    cutoff_hz: float

    def summary(self) -> str:
        """Return the values with their deviations, a line each."""
        lines = [f"{name.replace('_', ' ')}  {e.value:.5g} +- {e.std:.2g} {e.unit}" for name, e in self.parameters.items()]
        return "\n".join([*lines, f"{100 * self.error:.2g} % of the voltage is left, below {self.cutoff_hz:g} Hz"])


def estimate_winding(
    voltage: ArrayLike, current: ArrayLike, velocity: ArrayLike, dt: float, *, cutoff_hz: float | None = None
) -> WindingFit:
    """Estimate a winding's resistance and back-EMF constant from voltage, current and velocity.

        U_h(n) = R i(n) + ke w(n) + L (i(n+1) - i(n-1))/(2 dt) + U0,   U_h(n) = (U(n) + U(n-1))/2

    by least squares, all signals behind the same zero-phase filter and decimated.
    U_h is what a voltage that is held over each sample shows in a central difference.
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
        Frozen: `winding`, `parameters`, `error`, `cutoff_hz`, `summary()`.

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
    cutoff = cutoff_of(rec, ORDER) if cutoff_hz is None else float(cutoff_hz)
    if not 0.0 < cutoff < 0.5 / rec.dt:  # no decision: a formula: the Nyquist frequency
        raise RecordError(f"cutoff_hz={cutoff_hz!r}: give a corner between 0 and {0.5 / rec.dt:g} Hz, or None")
    factor = decimation_of(None, cutoff, rec.dt)
    held = 0.5 * (U + np.concatenate([U[:1], U[:-1]]))
    U, i, w = (low_passed(x, rec.dt, cutoff, ORDER) for x in (held, i, w))
    columns = (i, w, np.gradient(i, rec.dt), np.ones(len(i)))
    X, y = (np.column_stack([decimated(np.ascontiguousarray(c), factor) for c in part])[2:-2] for part in (columns, (U,)))
    if len(X) < POLICY.least_rows:
        raise RecordError(f"only {len(X)} rows are left of {len(w)} samples behind {cutoff:g} Hz; give a longer record")
    theta, _ = solve(X, y[:, 0])
    left = y[:, 0] - X @ theta
    std = np.sqrt(np.diag(covariance([X], [left])))
    found = {
        name: Estimate(float(x), float(s), unit, identifiable=bool(s < abs(x)))
        for (name, unit), x, s in zip(NAMES.items(), theta, std, strict=True)
    }
    for name in ("resistance", "back_emf_constant"):
        e = found[name]
        if not e.value > POLICY.winding_sure * e.std:
            raise RecordError(
                f"the {name.replace('_', ' ')} comes out as {e.value:.3g} +- {e.std:.2g} {e.unit}: voltage, current and velocity "
                "do not determine it; check their units and signs, and give a motion with load and speed apart, such as "
                "reversals and ramps"
            )
    inductance = found["inductance"]
    winding = Winding(
        found["resistance"].value,
        found["back_emf_constant"].value,
        inductance.value if inductance.value > POLICY.winding_sure * inductance.std else 0.0,
    )
    return WindingFit(winding, found, float(np.sqrt(left @ left / (y[:, 0] @ y[:, 0]))), cutoff)
