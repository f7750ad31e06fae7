"""Preparing signals for a record: a velocity for logs that contain only a position."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.data.signals.arrays import channel, positive_number, sample_time
from gaident.errors import RecordError

__all__ = ["differentiate", "low_pass"]

_ORDER = 4  # no decision: a formula: the order of a low-pass
_SHORTEST_EXTENSION = 15  # no decision: within so many samples beyond the ends a filter settles, and more of them change nothing


def differentiate(position: ArrayLike, dt: float, cutoff_hz: float | None = None) -> NDArray[np.float64]:
    """Return the velocity of a position: a zero-phase low-pass, then central differences.

        w(n) = (x(n+1) - x(n-1)) / (2 dt),   x = position, low-pass filtered if cutoff_hz is given

    Parameters
    ----------
    position : array_like, shape (n,)
        Position [rad] or [m], n >= 20.
    dt : float
        Sample time [s].
    cutoff_hz : float, optional
        Corner of a Butterworth filter of order 4 [Hz], below the Nyquist frequency 1/(2 dt).
        It runs forward and backward: no phase, -6 dB at the corner. None: no filter.

    Returns
    -------
    ndarray, shape (n,)
        Velocity [rad/s] or [m/s]; the two ends are one-sided differences.

    Raises
    ------
    RecordError
        For a position that `Record` would refuse, dt <= 0, and a cutoff not below 1/(2 dt).

    References
    ----------
    A. Janot, M. Gautier, M. Brunot, "Data Set and Reference Models of EMPS", 2019 (filter and differences of its inverse model).

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> w = ga.differentiate(0.02 * np.arange(100), dt=1e-3)
    >>> bool(np.allclose(w, 20.0))
    True
    """
    x = channel(position, "position")
    dt = sample_time(dt)
    if cutoff_hz is not None:
        x = low_pass(x, dt, cutoff_hz)
    # The edges stay one-sided: a second-order edge formula would amplify encoder noise there by 2.5.
    w: NDArray[np.float64] = np.gradient(x, dt, edge_order=1)
    return w


def low_pass(x: NDArray[np.float64], dt: float, cutoff_hz: float) -> NDArray[np.float64]:
    """The filter of `differentiate` alone. Raises RecordError for a corner that is not between 0 and 1/(2 dt)."""
    nyquist = 0.5 / dt  # no decision: a formula: the Nyquist frequency
    cutoff_hz = positive_number(cutoff_hz, "cutoff_hz", "Hz", f"give a corner between 0 and {nyquist:g} Hz, or None")
    if cutoff_hz >= nyquist:
        raise RecordError(
            f"cutoff_hz={cutoff_hz:g} Hz, but it must be below the Nyquist frequency {nyquist:g} Hz "
            f"(dt={dt:g} s); "
            f"give a lower corner, or None for no filter"
        )
    from scipy.signal import butter, sosfiltfilt

    # The odd extension at the ends must outlast the filter's transient, or a start in motion would be distorted.
    # no decision: a formula: twice the filter's transient
    extension = max(_SHORTEST_EXTENSION, math.ceil(min(2.0 / (cutoff_hz * dt), float(x.size))))
    sections = butter(_ORDER, cutoff_hz * 2.0 * dt, output="sos")  # no decision: a formula
    # The straight line between the ends passes such a filter as it is.
    # Taken off first, it costs no digits when the encoder's offset is large,
    # and a record of constant speed stays exact up to its ends.
    line = x[0] + (x[-1] - x[0]) / (x.size - 1) * np.arange(x.size)
    try:
        smooth = sosfiltfilt(sections, x - line, padlen=min(extension, x.size - 1))
    except np.linalg.LinAlgError:  # its start states: the filter's poles are 1 to the last digit
        raise RecordError(
            f"cutoff_hz={cutoff_hz:g} Hz is too low for a filter at dt={dt:g} s; give a higher corner, or None for no filter"
        ) from None
    return np.asarray(smooth + line, dtype=np.float64)
