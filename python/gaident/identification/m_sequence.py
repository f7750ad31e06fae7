"""Maximum-length binary sequences: the command of the conventional identification (section III-C of the paper)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.checks import is_whole, real_number
from gaident.errors import SettingsError

__all__ = ["m_sequence"]

LONGEST_HOLD = 1_000_000  # no decision: what an argument may be: samples

# Taps t of primitive polynomials x^n + x^t + ... + 1 by register length n, fewest taps and smallest first
# (E. J. Watson, "Primitive polynomials (mod 2)", Math. Comp. 16, 1962).
TAPS: dict[int, tuple[int, ...]] = {
    **{2: (1,), 3: (1,), 4: (1,), 5: (2,), 6: (1,), 7: (1,), 8: (4, 3, 2), 9: (4,), 10: (3,), 11: (2,)},
    **{12: (6, 4, 1), 13: (4, 3, 1), 14: (5, 3, 1), 15: (1,), 16: (5, 3, 2), 17: (3,), 18: (5, 2, 1), 19: (5, 2, 1)},
    **{20: (3,), 21: (2,), 22: (1,), 23: (5,), 24: (4, 3, 1)},
}


def m_sequence(register: int, amplitude: float = 1.0, hold: int = 1, offset: float = 0.0, seed: int = 1) -> NDArray[np.float64]:
    """Return one period of an M-sequence, hold * (2^register - 1) samples of offset +- amplitude.

        b(k) = b(k - n) xor b(k - n + t) xor ... for the taps t;   r(m) = offset + amplitude (1 - 2 b(m // hold))

    Within one period each run of n bits but the one of zeros occurs once, so the sequence is white up to its period.

    Parameters
    ----------
    register : int
        Length n of the shift register, 2 to 24.
    amplitude : float
        Amplitude [rad/s] (of a torque [N m]), > 0.
    hold : int
        Samples for which each bit stays, >= 1: the spectrum is flat up to about 0.4/(hold dt) [Hz].
    offset : float
        Mean level, in the unit of the amplitude.
    seed : int
        What stands in the register at first, 1 to 2^n - 1: shifts the sequence.

    Returns
    -------
    ndarray, shape (hold * (2^n - 1),)
        The sequence, in the unit of the amplitude.

    Raises
    ------
    SettingsError
        For a value out of its range.

    References
    ----------
    E. J. Watson, "Primitive polynomials (mod 2)", Mathematics of Computation 16, 1962 (the taps).

    Examples
    --------
    >>> import gaident as ga
    >>> ga.m_sequence(3, amplitude=2.0).tolist()
    [-2.0, 2.0, 2.0, -2.0, 2.0, -2.0, -2.0]
    """
    lengths = f"{min(TAPS)} to {max(TAPS)}"
    if not is_whole(register) or int(register) not in TAPS:
        raise SettingsError(f"register is {register!r}: give a whole number of bits from {lengths}")
    if not is_whole(hold) or not 1 <= hold <= LONGEST_HOLD:
        raise SettingsError(f"hold is {hold!r}: give a whole number of samples, from 1 to {LONGEST_HOLD}")
    n, samples = int(register), 2 ** int(register) - 1
    if not is_whole(seed) or not 1 <= seed <= samples:
        raise SettingsError(f"seed is {seed!r}: give a whole number from 1 to {samples}")
    height = real_number(amplitude, "amplitude", SettingsError, "give a finite number > 0 in rad/s")
    level = real_number(offset, "offset", SettingsError, "give a finite number in rad/s")
    if height <= 0.0:
        raise SettingsError(f"amplitude is {height:g}: give a finite number > 0 in rad/s")
    bits = [(int(seed) >> i) & 1 for i in range(n)]
    taps = TAPS[n]
    for k in range(n, samples):
        bit = bits[k - n]
        for t in taps:
            bit ^= bits[k - n + t]
        bits.append(bit)
    return np.repeat(level + height * (1.0 - 2.0 * np.array(bits[:samples], dtype=np.float64)), int(hold))
