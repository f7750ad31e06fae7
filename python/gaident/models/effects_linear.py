"""The effects that a linear system can hold, as transfer functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from gaident.models.roots import quadratic_roots

__all__ = ["LINEAR", "Transfer"]


class Transfer(NamedTuple):
    """gain prod(s - zeros) / prod(s - poles) exp(-s delay), 1 at standstill."""

    gain: float = 1.0
    poles: tuple[complex, ...] = ()
    zeros: tuple[complex, ...] = ()
    delay: float = 0.0  # s


def _resonance(values: Sequence[float]) -> Transfer:
    """(wp/wz)^2 (s^2 + 2 zz wz s + wz^2)/(s^2 + 2 zp wp s + wp^2)."""
    wp, zp, wz, zz = values
    poles, zeros = (tuple(quadratic_roots(2.0 * zeta * w, w * w)) for zeta, w in ((zp, wp), (zz, wz)))
    return Transfer((wp / wz) ** 2, poles, zeros)


def _lag(values: Sequence[float]) -> Transfer:
    """1/(tau s + 1)."""
    (tau,) = values
    return Transfer(1.0 / tau, (complex(-1.0 / tau),)) if tau > 0.0 else Transfer()


def _delay(values: Sequence[float]) -> Transfer:
    return Transfer(delay=values[0])


LINEAR: dict[str, Callable[[Sequence[float]], Transfer]] = {
    "extra_resonance": _resonance,
    "transport_delay": _delay,
    "torque_lag": _lag,
    "velocity_filter": _lag,
}
"""Effect -> its transfer function, from its parameters in the order of the table."""
