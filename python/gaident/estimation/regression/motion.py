"""The motion behind a record: position, velocity, acceleration and torque through one zero-phase filter.

    x_f   = Butterworth(order, cutoff) forward and backward of x, the same for every channel: no phase, -6 dB at the cutoff
    w     = (q_f(n+1) - q_f(n-1))/(2 dt) from the position, else the filtered velocity
    a     = (w(n+1) - w(n-1))/(2 dt)

The practice of M. Gautier, "Dynamic identification of robots with power model", ICRA 1997, and of A. Janot,
P.-O. Vandanjon, M. Gautier, IEEE Transactions on Control Systems Technology 22(1):132-145, 2014.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.control.filtering import zero_phase
from gaident.data.record import Record
from gaident.data.windows.window import integrated
from gaident.models.held_torque import torque_at_lines
from gaident.models.starts import noise_std
from gaident.policy.table import POLICY

__all__ = ["ORDER", "Motion", "cutoff_of", "low_passed", "motion_of", "noise_share", "torque_noise"]

Vector = NDArray[np.float64]
Spectrum = tuple[Vector, Vector, float]  # frequencies [Hz], power density, level of the noise

ORDER = 4  # no decision: the order of the Butterworth filter of all regressions; the cutoff decides what is left


@dataclass(frozen=True, eq=False)
class Motion:
    """Arrays (n,) at the record's rate; `still` marks the samples at which the sign of the velocity is not known."""

    dt: float  # s
    position: Vector  # rad
    velocity: Vector  # rad/s
    acceleration: Vector  # rad/s^2
    torque: Vector | None  # N m
    threshold: float  # rad/s
    still: NDArray[np.bool_]
    spectrum: Spectrum  # of the sensor's signal, see `noise_share`


def motion_of(rec: Record, cutoff_hz: float, order: int, standstill: float | None = None) -> Motion:
    """The filtered motion of a record; standstill: velocity [rad/s] up to which it stands, None by the rule, 0.0 never."""
    if rec.position is not None:
        position = low_passed(rec.position, rec.dt, cutoff_hz, order)
        velocity = np.gradient(position, rec.dt)
    else:
        velocity = low_passed(rec.velocity, rec.dt, cutoff_hz, order)
        position = integrated(rec, velocity)
    torque = None if rec.torque is None else low_passed(torque_at_lines(rec), rec.dt, cutoff_hz, order)
    spectrum = _spectrum(rec)
    # Standstill, and 1/cutoff before and after: the velocity is below its noise, or far below its own rms.
    noise, rms = _velocity_noise(rec, spectrum, cutoff_hz, order), float(np.sqrt(np.mean(velocity**2)))
    least = max(POLICY.standing_noise * noise, POLICY.standing_share * rms)
    threshold = least if standstill is None else standstill
    still = _beside(np.abs(velocity) <= threshold, max(1, round(min(1.0 / (cutoff_hz * rec.dt), float(len(velocity))))))
    if standstill == 0.0:
        still = np.zeros(len(velocity), dtype=bool)
    return Motion(rec.dt, position, velocity, np.gradient(velocity, rec.dt), torque, threshold, still, spectrum)


def _beside(still: NDArray[np.bool_], width: int) -> NDArray[np.bool_]:
    """`still`, and `width` samples before and after: so far the filters carry the unknown friction into the motion."""
    from scipy.ndimage import maximum_filter1d

    return np.asarray(maximum_filter1d(still, 2 * width + 1, mode="constant", cval=False))


def low_passed(x: Vector, dt: float, cutoff_hz: float, order: int) -> Vector:
    """x behind the Butterworth filter run forward and backward; a straight line between its ends passes as it is."""
    line = x[0] + (x[-1] - x[0]) / (x.size - 1) * np.arange(x.size)
    # no decision: a formula: a filter settles beyond the ends
    extension = min(max(15, math.ceil(min(2.0 / (cutoff_hz * dt), float(x.size)))), x.size - 1)
    low_pass = _sections(order, cutoff_hz * 2.0 * dt)  # no decision: a formula
    return np.asarray(zero_phase(low_pass, (x - line)[None, :], extension)[0] + line)


@lru_cache(maxsize=64)
def _sections(order: int, cutoff: float) -> Any:
    """The Butterworth filter in second-order sections; cutoff: in parts of the Nyquist frequency."""
    from scipy.signal import butter

    return butter(order, cutoff, output="sos")


def cutoff_of(rec: Record, order: int) -> float:
    """The cutoff [Hz]: the highest at which noise makes up at most a thousandth of the acceleration's power.

    The noise of the sensor (of the position where it is logged, else of the velocity) is taken as white with the level that its
    spectrum has between 0.35 and 0.475 of the sample rate; what is signal there makes the cutoff lower, never higher.
    At most a tenth and at least a two-hundredth of the sample rate.
    """
    grid = POLICY.highest_band / rec.dt * np.geomspace(1.0, POLICY.lowest_band / POLICY.highest_band, 60)
    spectrum = _spectrum(rec)
    fit = (float(fc) for fc in grid if noise_share(rec, float(fc), order, spectrum) <= POLICY.acceleration_noise)
    return _round(next(fit, float(grid[-1])))


def noise_share(rec: Record, cutoff_hz: float, order: int, spectrum: Spectrum | None = None) -> float:
    """Share of noise in the power of the filtered acceleration, from 0 to 1; spectrum: that of the record's motion, if known."""
    f, power, level = spectrum or _spectrum(rec)
    weight = _gain(rec, f, cutoff_hz, order, 2)
    whole = float(np.sum(weight * power))
    return min(level * float(np.sum(weight)) / whole, 1.0) if whole > 0.0 else 1.0


def _velocity_noise(rec: Record, spectrum: Spectrum, cutoff_hz: float, order: int) -> float:
    """Standard deviation of the noise of the filtered velocity [rad/s]."""
    f, _, level = spectrum
    return float(np.sqrt(level * np.sum(_gain(rec, f, cutoff_hz, order, 1)) * (f[1] - f[0])))


def torque_noise(rec: Record, cutoff_hz: float, order: int) -> float:
    """Standard deviation of the filtered torque's noise [N m], white with that of its third differences: steps are no noise."""
    assert rec.torque is not None
    f: Vector = np.fft.rfftfreq(len(rec), rec.dt).astype(np.float64)
    return noise_std(rec.torque) * float(np.sqrt(np.mean(_twice(rec, f, cutoff_hz, order) ** 2)))


def _twice(rec: Record, f: Vector, cutoff_hz: float, order: int) -> Vector:
    """Gain of the filter, run forward and backward, at frequencies f [Hz]."""
    # no decision: a formula: next to the Nyquist frequency
    warped = np.tan(np.pi * np.minimum(f, 0.499 / rec.dt) * rec.dt) / math.tan(math.pi * cutoff_hz * rec.dt)
    with np.errstate(over="ignore"):  # far above the corner nothing passes
        return np.asarray(1.0 / (1.0 + warped ** (2 * order)))


def _gain(rec: Record, f: Vector, cutoff_hz: float, order: int, derivative: int) -> Vector:
    """Squared gain from the sensor's signal to the velocity (derivative 1) or acceleration (2), at frequencies f [Hz]."""
    twice = _twice(rec, f, cutoff_hz, order)
    slope = np.sin(2.0 * np.pi * f * rec.dt) / rec.dt
    steps = derivative if rec.position is not None else derivative - 1
    return np.asarray((twice * slope**steps) ** 2)


def _spectrum(rec: Record) -> Spectrum:
    """(frequencies [Hz], power density of the sensor's signal, level of its noise)."""
    from scipy.signal import welch

    x = rec.velocity if rec.position is None else rec.position
    line = x[0] + (x[-1] - x[0]) / (x.size - 1) * np.arange(x.size)
    f, power = welch(x - line, 1.0 / rec.dt, nperseg=min(x.size, 2048))  # no decision: a grid: the lines of a spectrum
    high = (f >= POLICY.noise_from / rec.dt) & (f <= POLICY.noise_to / rec.dt)
    return f, power, float(np.median(power[high])) if np.any(high) else 0.0


def _round(value: float) -> float:
    """To three digits, so that what is said is what was used."""
    return float(f"{value:.3g}")
