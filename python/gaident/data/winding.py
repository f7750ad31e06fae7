"""The winding of a motor: from its voltage and velocity to its torque."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.checks import real_number
from gaident.control.filtering import filtered
from gaident.data.signals.arrays import channel, positive_number, sample_time
from gaident.errors import RecordError
from gaident.policy.table import POLICY

__all__ = ["Winding"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Winding:
    """A winding with back-EMF, of a DC motor or of the torque-forming axis of a servo motor.

        U = R i + L di/dt + ke w,   u = kt i

    Parameters
    ----------
    resistance : float
        R [Ohm], above 0.
    torque_constant : float
        kt [N m/A], above 0; of a linear motor N/A.
    inductance : float
        L [H], from 0 on. 0: the current follows at once.
    back_emf_constant : float, optional
        ke [V s/rad], above 0; None: as the torque constant, which holds for a DC motor in SI units.
        With the peak values of a three-phase motor in dq coordinates kt = 1.5 ke.

    Raises
    ------
    RecordError
        A value out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> winding = ga.Winding(resistance=0.5, torque_constant=0.05)
    >>> bool(np.allclose(winding.torque(np.full(100, 6.0), np.full(100, 20.0), dt=1e-3), 0.05 * (6 - 0.05 * 20) / 0.5))
    True
    """

    resistance: float
    torque_constant: float
    inductance: float = 0.0
    back_emf_constant: float | None = None

    def __post_init__(self) -> None:
        units = {"resistance": "Ohm", "torque_constant": "N m/A", "back_emf_constant": "V s/rad"}
        for name, unit in units.items():
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, positive_number(value, name, unit, f"give it in {unit}"))
        inductance = real_number(self.inductance, "inductance", RecordError)
        if inductance < 0.0:
            raise RecordError(f"inductance={self.inductance!r} H: it must be 0 or more; 0 leaves it out")
        object.__setattr__(self, "inductance", inductance)

    @property
    def emf(self) -> float:
        """The back-EMF constant ke [V s/rad]."""
        return self.torque_constant if self.back_emf_constant is None else self.back_emf_constant

    def current(self, voltage: ArrayLike, velocity: ArrayLike, dt: float) -> Vector:
        """Return the current i of a voltage U that is held over each sample, and a velocity w.

            i(n+1) = a i(n) + (1 - a) (U(n) - ke (w(n) + w(n+1))/2)/R,   a = exp(-R dt/L)
            i(0) = (U(0) - ke w(0))/R in motion, 0 at rest

        A motor at rest, |ke w(0)| within `rest_emf` of the largest voltage, is one whose voltage begins at sample 0.

        Parameters
        ----------
        voltage : array_like, shape (n,)
            U [V].
        velocity : array_like, shape (n,)
            w [rad/s].
        dt : float
            Sample time [s].

        Returns
        -------
        ndarray of shape (n,)
            i [A].

        Raises
        ------
        RecordError
            Arrays that a Record would refuse, or of unequal lengths.
        """
        return self._currents(voltage, velocity, dt)[0]

    def torque(self, voltage: ArrayLike, velocity: ArrayLike, dt: float) -> Vector:
        """Return the mean torque over each sample: what a record's torque, held until the next one, stands for.

            u(n) = kt (s(n) + (i(n) - s(n)) (1 - a) L/(R dt)),   s(n) = (U(n) - ke (w(n) + w(n+1))/2)/R

        Parameters
        ----------
        voltage : array_like, shape (n,)
            U [V].
        velocity : array_like, shape (n,)
            w [rad/s].
        dt : float
            Sample time [s].

        Returns
        -------
        ndarray of shape (n,)
            u [N m].
        """
        current, steady, dt = self._currents(voltage, velocity, dt)
        if self.inductance == 0.0:
            return self.torque_constant * steady
        samples = self.inductance / (self.resistance * dt)  # of the time constant L/R
        return np.asarray(self.torque_constant * (steady + (current - steady) * samples * -np.expm1(-1.0 / samples)))

    def mean_current(self, current: ArrayLike, dt: float, velocity: ArrayLike | None = None) -> Vector:
        """Return the mean over each sample of a current that was sampled at its ends, under a voltage held in between.

            (1 - h) i(n) + h i(n+1) + (h - 1/2) ke/R (w(n+1) - w(n))
            h = 1/(1 - a) - x,   a = exp(-1/x),   x = L/(R dt)

        The current goes with the time constant L/R to where it would settle, which the back-EMF lowers while the velocity goes
        straight from w(n) to w(n+1).
        Without an inductance it jumps, and falls to i(n+1) then; with a large one this is the mean of both.

        Parameters
        ----------
        current : array_like, shape (n,)
            i [A].
        dt : float
            Sample time [s].
        velocity : array_like, shape (n,), optional
            w [rad/s]; None: one that changes little within a sample.

        Returns
        -------
        ndarray of shape (n,)
            The mean current [A]; after the last sample it stays as it is.

        Raises
        ------
        RecordError
            An array that a Record would refuse, unequal lengths, or a sample time that is not above 0.
        """
        i, dt = channel(current, "current"), sample_time(dt)
        w = np.zeros(len(i)) if velocity is None else channel(velocity, "velocity")
        if len(w) != len(i):
            raise RecordError(f"current has {len(i)} samples, velocity {len(w)}: give them of the same samples")
        return mean_of_ends(i, w, share_of_end(self.inductance / (self.resistance * dt)), self)

    def _currents(self, voltage: ArrayLike, velocity: ArrayLike, dt: float) -> tuple[Vector, Vector, float]:
        """(i(n), s(n) that it goes to, dt), checked."""
        U, w = channel(voltage, "voltage"), channel(velocity, "velocity")
        dt = sample_time(dt)
        if len(U) != len(w):
            raise RecordError(f"voltage has {len(U)} samples, velocity {len(w)}: give them of the same samples")
        towards = (U - 0.5 * self.emf * (w + np.concatenate([w[1:], w[-1:]]))) / self.resistance
        if self.inductance == 0.0:
            return (U - self.emf * w) / self.resistance, towards, dt
        a = float(np.exp(-self.resistance * dt / self.inductance))
        at_rest = abs(self.emf * w[0]) <= POLICY.rest_emf * float(np.abs(U).max())
        first = np.zeros(1) if at_rest else (U[:1] - self.emf * w[:1]) / self.resistance
        more = filtered(np.array([1.0 - a]), np.array([1.0, -a]), (towards[:-1] - first)[None, :], [len(U) - 1])[0]
        return np.concatenate([first, first + more]), towards, dt


def share_of_end(x: float) -> float:
    """h = 1/(1 - exp(-1/x)) - x of a time constant of x samples [1]; 1 where the current follows at once."""
    return float(-1.0 / np.expm1(-1.0 / x) - x) if x > 0.0 else 1.0


def mean_of_ends(current: Vector, velocity: Vector, share: float, winding: Winding) -> Vector:
    """The mean current over each sample [A] from those at its ends, as `Winding.mean_current`; share: h."""
    i, w = (np.concatenate([x, x[-1:]]) for x in (current, velocity))
    braked = winding.emf / winding.resistance * np.diff(w)
    return np.asarray((1.0 - share) * i[:-1] + share * i[1:] + (share - 0.5) * braked)
