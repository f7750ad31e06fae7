"""FrequencyResponse: one measured frequency response of a drive."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.arguments import arg
from gaident.checks import one_of
from gaident.data.frequency.columns import KINDS
from gaident.data.record_checks import readable, texts
from gaident.data.signals.arrays import positive_number, sample_time
from gaident.errors import RecordError
from gaident.providers import picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FrequencyResponse"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]

LEAST = 8  # no decision: what an argument may be: a response has so many frequencies at least
LARGEST = 1e30  # no decision: what an argument may be: a size whose square is still a number


class FrequencyResponse:
    """One measured frequency response G(f) from the motor's torque; immutable.

    It takes the place of a `Record` in `identify`, alone, in a list of responses, or beside records.

    Parameters
    ----------
    frequency_hz : array_like, shape (n,)
        Frequencies [Hz], ascending, above 0; n >= 8.
    response : array_like of complex, shape (n,)
        G at these frequencies, rad/s, rad or rad/s^2 per N m by `kind`; `magnitude * exp(1j * phase)`.
    std : array_like, shape (n,), optional
        Standard deviation of the complex value, sqrt(mean |error|^2), in its unit.
    coherence : array_like, shape (n,), optional
        Coherence of the measurement, above 0 up to 1.
        Without `std` it says how much each frequency counts beside the others.
        Without both the errors are taken to be in proportion to the magnitude.
    kind : {"torque to velocity", "torque to position", "torque to acceleration"}
        What was measured.
    dt : float, optional
        Sample time [s], where the torque was held over each sample and the velocity read at the samples: what a drive
        or a controller measures. None: the response of the axis itself, as an analyser in continuous time measures it.
    amplitude : float, optional
        Amplitude of the torque that excited the axis [N m].
        With it several responses of one axis show which way gain and resonance move with the amplitude.
    name : str
        What reports call it.
    notes : sequence of str
        What was noticed when it was made; results repeat it.

    Raises
    ------
    RecordError
        Unequal lengths, fewer than 8 frequencies, one that is not above the one before, or from half the sampling frequency on;
        numbers that are not finite; a magnitude, deviation or coherence that is not above 0; another `kind`.

    See Also
    --------
    frequency_response : Makes one of a record.
    read_response : Reads one from a text file.

    Notes
    -----
    A linear axis has m/s, m or m/s^2 per N.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> f = np.geomspace(2.0, 400.0, 60)
    >>> drive = ga.OneMass(J=2e-3, D=0.01)
    >>> fr = ga.FrequencyResponse(f, drive.model().frequency_response(2.0 * np.pi * f))
    >>> fr
    FrequencyResponse(60 frequencies, 2..400 Hz, torque to velocity)
    >>> idn = ga.identify(fr)
    >>> idn.p, idn.q, round(idn.mechanics.J, 6)
    (1, 0, 0.002)
    """

    frequency_hz: Vector
    response: Complex
    std: Vector | None
    coherence: Vector | None
    kind: str
    dt: float | None
    amplitude: float | None
    name: str
    notes: tuple[str, ...]

    def __init__(
        self,
        frequency_hz: ArrayLike,
        response: ArrayLike,
        std: ArrayLike | None = None,
        coherence: ArrayLike | None = None,
        kind: str = "torque to velocity",
        *,
        dt: float | None = None,
        amplitude: float | None = None,
        name: str = "",
        notes: Sequence[str] = (),
    ) -> None:
        kind = one_of(kind, "kind", KINDS, RecordError)
        frequency = _numbers(frequency_hz, "frequency_hz")
        value = _numbers(response, "response", np.complex128)
        found: dict[str, Any] = {"response": value}
        for key, given in (("std", std), ("coherence", coherence)):
            found[key] = None if given is None else _numbers(given, key)
        for key, array in found.items():
            if array is not None and len(array) != len(frequency):
                raise RecordError(
                    f"{key} has {len(array)} values and frequency_hz {len(frequency)}: give one of each for every frequency"
                )
        if len(frequency) < LEAST:
            raise RecordError(f"frequency_hz has {len(frequency)} values: give at least {LEAST} frequencies")
        _above(frequency, "frequency_hz", "0 Hz")
        steps = np.flatnonzero(np.diff(frequency) <= 0.0)
        if len(steps):
            i = int(steps[0]) + 1
            raise RecordError(
                f"frequency_hz[{i}] = {frequency[i]:g} is not above the one before, {frequency[i - 1]:g}: sort all arrays by "
                "frequency, and give each frequency once"
            )
        _above(np.abs(value), "abs(response)", "0")
        for key in ("std", "coherence"):
            if found[key] is not None:
                _above(found[key], key, "0")
        if found["coherence"] is not None and float(found["coherence"].max()) > 1.0:
            i = int(np.argmax(found["coherence"]))
            raise RecordError(
                f"coherence[{i}] = {found['coherence'][i]:g}: it lies between 0 and 1; give it as a share, not in %"
            )
        if dt is not None:
            dt = sample_time(dt)
            if frequency[-1] >= 0.5 / dt:  # no decision: a formula: half the sampling frequency
                raise RecordError(
                    f"frequency_hz[{len(frequency) - 1}] = {frequency[-1]:g} is not below half the sampling frequency, "
                    f"{0.5 / dt:g} Hz of {arg('dt', f'{dt:g}')}: leave out what lies above, or correct dt"
                )
        if amplitude is not None:
            amplitude = positive_number(amplitude, "amplitude", "N m", "give the torque's amplitude, or leave it out")
        fields = {
            "frequency_hz": frequency,
            **found,
            "kind": kind,
            "dt": dt,
            "amplitude": amplitude,
            "name": readable(name),
            "notes": tuple(texts(notes)),
        }
        for key, content in fields.items():
            object.__setattr__(self, key, content)

    def __setattr__(self, key: str, value: object) -> None:
        raise AttributeError(f"a FrequencyResponse is immutable: make another one with another {key}")

    def __len__(self) -> int:
        return len(self.frequency_hz)

    def __repr__(self) -> str:
        name = f"{self.name!r}, " if self.name else ""
        held = "" if self.dt is None else f", dt={self.dt:g} s"
        f = self.frequency_hz
        return f"FrequencyResponse({name}{len(self)} frequencies, {f[0]:.4g}..{f[-1]:.4g} Hz, {self.kind}{held})"

    @property
    def omega(self) -> Vector:
        """Angular frequencies [rad/s], shape (n,)."""
        return 2.0 * math.pi * self.frequency_hz

    @property
    def velocity_response(self) -> Complex:
        """From torque to velocity [rad/s/(N m)], shape (n,): G(f), times j omega or over it where `kind` is another one."""
        made: Complex = self.response * (1j * self.omega) ** KINDS[self.kind]
        return made

    @property
    def relative_std(self) -> Vector:
        """What each value is off by, over its magnitude [1], shape (n,).

        Without `std` up to a factor: sqrt(1/coherence - 1), not below a thousandth of its largest; without both 1.
        """
        if self.std is not None:
            share: Vector = self.std / np.abs(self.response)
            return share
        if self.coherence is None:
            return np.ones(len(self))
        lost = np.sqrt(np.maximum(1.0 / self.coherence - 1.0, 0.0))
        most = float(lost.max())
        # no decision: rounding: of a coherence that is printed as 1
        return np.maximum(lost / most, 1e-3) if most > 0.0 else np.ones(len(self))

    @property
    def digest(self) -> str:
        """SHA-256 of the numbers, kind and dt, as text; amplitude, name and notes do not count."""
        found = hashlib.sha256(f"gaident frequency response 1 {self.kind} {self.dt!r}".encode())
        for array in (self.frequency_hz, self.response, self.std, self.coherence):
            found.update(b"-" if array is None else np.ascontiguousarray(array).tobytes())
        return found.hexdigest()

    def band(self, lowest_hz: float | None = None, highest_hz: float | None = None) -> FrequencyResponse:
        """Return the part between two frequencies, ends included.

        Parameters
        ----------
        lowest_hz, highest_hz : float, optional
            The ends [Hz]; None: that of the data.

        Returns
        -------
        FrequencyResponse
            The part.

        Raises
        ------
        RecordError
            Where fewer than 8 frequencies are left, or an end is no positive number.
        """
        keep = np.ones(len(self), bool)
        if lowest_hz is not None:
            keep &= self.frequency_hz >= positive_number(lowest_hz, "lowest_hz", "Hz", "give a frequency in Hz")
        if highest_hz is not None:
            keep &= self.frequency_hz <= positive_number(highest_hz, "highest_hz", "Hz", "give a frequency in Hz")
        std, coherence = (None if a is None else a[keep] for a in (self.std, self.coherence))
        same: dict[str, Any] = {"dt": self.dt, "amplitude": self.amplitude, "name": self.name, "notes": self.notes}
        return FrequencyResponse(self.frequency_hz[keep], self.response[keep], std, coherence, self.kind, **same)

    def plot(self, axis: str = "rotary") -> Figure:
        """Draw magnitude, phase and, where it is known, coherence over frequency [Hz].

        Parameters
        ----------
        axis : {"rotary", "linear"}
            "linear": units of m and N.

        Returns
        -------
        matplotlib.figure.Figure
            The picture.
        """
        return picture("plot_frequency_response", (self,), axis=axis)


def _numbers(values: ArrayLike, argument: str, kind: type[Any] = np.float64) -> NDArray[Any]:
    """A copy of one dimension, all finite. Raises RecordError."""
    try:
        array = np.asarray(values)
        if array.dtype.kind not in ("iufc" if kind is np.complex128 else "iuf"):
            raise TypeError(f"dtype {array.dtype}")
        with np.errstate(over="ignore"):
            copy = np.array(array, dtype=kind)
    except (TypeError, ValueError, MemoryError) as reason:
        what = "complex" if kind is np.complex128 else "real"
        raise RecordError(f"{argument} is {values!r:.60} ({reason}): give {what} numbers, one for each frequency") from None
    if copy.ndim != 1:
        raise RecordError(f"{argument} has the shape {copy.shape}: give one dimension, a number for each frequency")
    bad = np.flatnonzero(~np.isfinite(copy))
    if len(bad):
        raise RecordError(f"{argument}[{bad[0]}] = {copy[bad[0]]}: every value must be finite; leave that frequency out")
    if copy.size and float(np.abs(copy).max()) > LARGEST:
        i = int(np.argmax(np.abs(copy)))
        raise RecordError(f"{argument}[{i}] = {copy[i]:g} is beyond {LARGEST:g}: correct its unit")
    copy.flags.writeable = False
    return copy


def _above(array: Vector, argument: str, least: str) -> None:
    """Raises RecordError where a value is not above 0."""
    bad = np.flatnonzero(~(array > 0.0))
    if len(bad):
        raise RecordError(f"{argument}[{bad[0]}] = {array[bad[0]]:g}: it must be above {least}; leave that frequency out")
