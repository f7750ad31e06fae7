"""The effects that a linear system can contain, as transfer functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import zip_longest
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.data.signals.arrays import floats
from gaident.errors import ModelError
from gaident.models.roots import quadratic_roots

__all__ = ["DELAY", "LAG", "LATE", "LINEAR", "Transfer", "response_of"]


class Transfer(NamedTuple):
    """gain prod(s - zeros) / prod(s - poles) exp(-s delay), 1 at standstill."""

    gain: float = 1.0
    poles: tuple[complex, ...] = ()
    zeros: tuple[complex, ...] = ()
    delay: float = 0.0  # s

    @property
    def late(self) -> float:
        """By how much a slow signal comes out later than it went in [s]: minus the slope of the phase over omega at 0."""
        turned = sum(1.0 / zero for zero in self.zeros) - sum(1.0 / pole for pole in self.poles)
        return self.delay + complex(turned).real


def _resonance(values: Sequence[float]) -> Transfer:
    """(wp/wz)^2 (s^2 + 2 zz wz s + wz^2)/(s^2 + 2 zp wp s + wp^2)."""
    wp, zp, wz, zz = values
    poles, zeros = (tuple(quadratic_roots(2.0 * zeta * w, w * w)) for zeta, w in ((zp, wp), (zz, wz)))  # no decision: a formula
    return Transfer((wp / wz) ** 2, poles, zeros)


def _lag(values: Sequence[float]) -> Transfer:
    """1/(tau s + 1)."""
    (tau,) = values
    return Transfer(1.0 / tau, (complex(-1.0 / tau),)) if tau > 0.0 else Transfer()


def _tracking(values: Sequence[float]) -> Transfer:
    """1/(1 + s/b)^2."""
    (b,) = values
    return Transfer(b * b, (complex(-b), complex(-b))) if np.isfinite(b) else Transfer()


def _delay(values: Sequence[float]) -> Transfer:
    return Transfer(delay=values[0])


LINEAR: dict[str, Callable[[Sequence[float]], Transfer]] = {
    "extra_resonance": _resonance,
    "transport_delay": _delay,
    "torque_lag": _lag,
    "velocity_filter": _lag,
    "velocity_observer": _tracking,
}
"""Effect -> its transfer function, from its parameters in the order of the table."""

DELAY, LAG = "transport_delay", "torque_lag"  # of the torque's path

LATE: dict[str, Callable[[Sequence[float], float], float]] = {
    "velocity_difference": lambda values, period: 0.5 * values[0] * period,
}
"""Effect -> by how much it makes a velocity late [s], from its parameters and the controller's sample time [s].

Of a mean over k samples that is its phase; its size, sin(x)/x with x = k omega T/2, is at most 1.
"""


def frequencies(omega: ArrayLike) -> NDArray[np.float64]:
    """`omega` [rad/s] as an array; raises ModelError for what is no number and no array of numbers."""
    try:
        return floats(omega)
    except TypeError:
        raise ModelError(f"omega is {omega!r:.80}: give frequencies in rad/s") from None


def response_of(parts: Sequence[Transfer], omega: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Product of the parts at j omega [rad/s], of the shape of omega; not finite where that is a pole."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        s = 1j * omega
        response = np.exp(-s * sum(part.delay for part in parts))
        for part in parts:
            response *= part.gain
            # Zero over pole in turn, so that no partial product leaves the range of the numbers.
            for pole, zero in zip_longest(part.poles, part.zeros):
                if zero is not None:
                    response *= s - zero
                if pole is not None:
                    response /= s - pole
    return np.asarray(response, dtype=np.complex128)
