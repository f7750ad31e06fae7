"""Two logs of one run, each with its own clock: where the second lies on the first's time axis, and how sure that is.

    y(t') = g x(t) + c + e,   t = t0 + (1 + rho) t'

x: a channel of the first log over its clock t; y: the same motion in the second over its clock t'; t0: offset, rho: difference of
the clocks' rates, g and c: scale and zero of the second sensor.
They are found coarsely by the cross-correlation over the lag for a range of rho, then by least squares in (t0, rho, g, c).
The covariance is the sandwich (J'J)^-1 S (J'J)^-1 with the autocorrelation of e in S (Newey, West, "A simple, positive
semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix", Econometrica 55, 1987).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.checks import real_number
from gaident.data.record import CHANNELS, Record
from gaident.data.record_checks import at_its_lines, is_held
from gaident.data.signals.arrays import MINIMUM_SAMPLES, channel, positive_number, sample_time
from gaident.data.signals.decimation import low_passed
from gaident.data.signals.lags import LagFit, coarse_lags, refine
from gaident.data.signals.resampling import held_means
from gaident.data.signals.wraps import Unwrapper
from gaident.data.torque_kind import MEAN, SAMPLE, SMOOTH
from gaident.errors import RecordError
from gaident.estimation.criterion import gained
from gaident.policy.table import POLICY

__all__ = ["Alignment", "align"]

_WIDER = 2.0  # no decision: times max_rate: bound of the rate in the fit; bounds of a fit
_ANY = 50.0  # no decision: times max_rate: the bound of a second fit, where the first one ends at its bound; bounds of a fit
MOST_APART = 1e5  # no decision: what an argument may be: one sample time in that of the other log
FASTEST_RATE = 0.1  # no decision: what an argument may be: clocks whose rates differ by more are none
_ORDER = ("velocity", "position", "command", "torque")


@dataclass(frozen=True)
class Alignment:
    """What `align` found: `t = offset + (1 + rate) t'` leads from the second log's clock t' to the first's t.

    Attributes
    ----------
    record : Record
        The first record, cut to what both cover, with the channels taken over from the second.
    offset : float
        Offset t0 [s].
    offset_std : float
        Its standard deviation [s].
    rate : float
        Difference of the clocks' rates rho [1]; 0 where the logs show none.
    rate_std : float
        Standard deviation of the difference of the rates [1].
    rate_seen : bool
        Whether the logs show a difference of the clocks' rates.
    gain : float
        Scale of the second log's channel against the first's [1] (1 where both have the same unit).
    correlation : float
        Correlation of the two channels, aligned [1].
    uncertainty : float
        Largest error of the time axis within the record, two standard deviations [s].

    See Also
    --------
    align : Makes it, with an example.
    """

    record: Record
    offset: float
    offset_std: float
    rate: float
    rate_std: float
    rate_seen: bool
    gain: float
    correlation: float
    uncertainty: float

    def summary(self) -> str:
        """Return the result as text, a few lines."""
        rate = f"{self.rate * 1e6:+.1f} +- {self.rate_std * 1e6:.1f} ppm"  # no decision: printed: a number
        if not self.rate_seen:
            rate = f"no difference seen (to +- {2e6 * self.rate_std:.3g} ppm)"  # no decision: printed: a number
        samples = self.uncertainty / self.record.dt
        # no decision: printed: a number
        worst = "" if samples < 0.5 else "; too much for phase: log both with one clock where that matters"
        return (
            f"the second log begins {self.offset:.6g} +- {self.offset_std:.2g} s after the first (its clock's zero)\n"
            f"rate of its clock: {rate}\n"  # no decision: printed: a number
            f"correlation {self.correlation:.4f}, scale {self.gain:.4g}\n"
            f"time axis right to {self.uncertainty:.2g} s ({samples:.2g} samples){worst}\n"
            f"{len(self.record)} samples in common"
        )


def align(
    rec: Record,
    other: Record | Mapping[str, ArrayLike],
    dt: float | None = None,
    *,
    on: str | tuple[str, str] | None = None,
    take: Sequence[str] | None = None,
    within: tuple[float, float] | None = None,
    max_rate: float = 1e-3,  # no decision: what an argument may be
) -> Alignment:
    """Bring the channels of a second log, which has a clock of its own, onto the first record's time axis.

    The channels taken over are low-passed where `rec` samples more slowly, then interpolated (monotone cubic).
    Positions of a mapping that wrap are continued first, as those of a record were.

    Parameters
    ----------
    rec : Record
        The record whose clock stays.
    other : Record, or mapping of str to array_like, shape (m,)
        The second log: a record, or channel -> values of a log that makes none.
    dt : float, optional
        Sample time of `other` [s], where it is no record.
    on : str or tuple of str, optional
        The channel in which both show the same motion, or (rec's, other's).
        Its unit and sign may differ: the scale is estimated too.
        None: the first that both have of velocity, position, command, torque.
    take : sequence of str, optional
        Channels of `other` that go into the result; None: those that `rec` lacks.
    within : tuple of float, optional
        (lowest, highest) offset [s] that is possible, where the motion repeats itself.
    max_rate : float
        Largest difference of the clocks' rates to look for [1] (quartz against quartz stays below 2e-4).

    Returns
    -------
    Alignment
        The joined record, the offset and the difference of the rates with standard deviations.

    Raises
    ------
    RecordError
        Where the logs cannot tell: no motion, no resemblance, two offsets that fit equally well, or a rate beyond `max_rate`.

    References
    ----------
    W. K. Newey, K. D. West, "A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance
    matrix", Econometrica 55, 1987 (the standard deviations).

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> def velocity(t):
    ...     return 10.0 * np.tanh(40.0 * (t - 0.5)) + 3.0 * np.tanh(30.0 * (t - 1.1))
    >>> w = velocity(1e-3 * np.arange(2000))
    >>> rec = ga.Record(1e-3, command=w, velocity=w)
    >>> later = 0.25 + 2e-3 * np.arange(800)  # the second log begins 0.25 s after the first
    >>> found = ga.align(rec, {"velocity": velocity(later), "torque": np.cos(later)}, dt=2e-3)
    >>> round(found.offset, 3), [name for name, values in found.record.channels()]
    (0.25, ['command', 'velocity', 'torque'])
    """
    if not isinstance(rec, Record):
        raise RecordError(f"rec is a {type(rec).__name__}: give a gaident.Record")
    theirs, their_dt = _channels(other, dt)
    _check_wishes(rec.dt, their_dt, take, within, max_rate)
    mine = dict(rec.channels())
    first, second = _common(mine, theirs, on)
    limit = positive_number(max_rate, "max_rate", "", "give for example 1e-3")
    x, y = mine[first], theirs[second]
    _check_lengths(len(x) * rec.dt, rec.dt, len(y) * their_dt, their_dt)
    for values, whose, name in ((x, "rec", first), (y, "other", second)):
        if np.ptp(values) == 0.0:
            raise RecordError(f"{whose}'s {name} is constant: there is no motion to align by; give on= with another channel")
    fit = _best(x, rec.dt, y, their_dt, within, limit, (first, second))
    if abs(fit.rate) >= _WIDER * limit:
        free = refine(x, rec.dt, y, their_dt, fit.offset, fit.rate, _ANY * limit)
        if free is not None and gained(fit.variance, free.variance, free.independent) > POLICY.rival_margin:
            raise RecordError(
                f"the clocks' rates differ by about {free.rate:.2g}, which is beyond max_rate={max_rate!r}; check the sample "
                "times of both logs, or give a larger max_rate"
            )
    seen = abs(fit.rate) > POLICY.rate_seen * fit.std[1]
    if not seen:
        equal = refine(x, rec.dt, y, their_dt, fit.offset + fit.rate * fit.centre, 0.0, limit, free_rate=False)
        fit = (equal or fit).with_rate_std(fit.std[1])
    return _result(rec, other, theirs, their_dt, take, fit, seen)


def _channels(other: object, dt: float | None) -> tuple[dict[str, NDArray[np.float64]], float]:
    if isinstance(other, Record):
        if dt is not None:
            raise RecordError(f"dt={dt!r} is for channels without a Record; other is one, leave dt out")
        return dict(other.channels()), other.dt
    if not isinstance(other, Mapping):
        raise RecordError(f"other={other!r:.60} is neither a Record nor a mapping of channels; give {{'velocity': ...}} with dt=")
    if dt is None:
        raise RecordError("other contains channels without a Record: give their sample time dt= [s] too")
    unknown = next((name for name in other if name not in CHANNELS), None)
    if unknown is not None:
        raise RecordError(f"other: {unknown!r} is no channel; known are {', '.join(CHANNELS)}")
    found = {str(name): channel(values, str(name)) for name, values in other.items()}
    if len({len(values) for values in found.values()}) != 1:
        listed = ", ".join(f"{name} {len(values)}" for name, values in found.items())
        raise RecordError(f"other: give channels of equal length ({listed or 'none is given'})")
    for name in found.keys() & {"position", "load_position"}:  # between two sides of a jump there is nothing
        found[name] = Unwrapper().push(found[name])
    return found, sample_time(dt, "give the sample time of other in seconds")


def _common(mine: Mapping[str, object], theirs: Mapping[str, object], on: object) -> tuple[str, str]:
    if on is None:
        both = next((name for name in _ORDER if name in mine and name in theirs), None)
        if both is None:
            raise RecordError(
                f"rec has {', '.join(mine)} and other {', '.join(theirs)}: they share no channel to be aligned by; "
                "give on=(rec's, other's), two that show the same motion"
            )
        return both, both
    pair = (on, on) if isinstance(on, str) else on
    if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] not in mine or pair[1] not in theirs:
        raise RecordError(f"on={on!r}: give a channel of rec ({', '.join(mine)}) and one of other ({', '.join(theirs)})")
    return str(pair[0]), str(pair[1])


def _check_wishes(mine: float, theirs: float, take: object, within: object, max_rate: object) -> None:
    """Raises RecordError for arguments that ask for nothing that can be done."""
    if not mine / MOST_APART <= theirs <= mine * MOST_APART:
        raise RecordError(
            f"rec has dt={mine:g} s and other {theirs:g} s: logs whose sample times differ by more than {MOST_APART:g} show no "
            "motion in common; check both"
        )
    if take is not None and (
        isinstance(take, str) or not isinstance(take, Sequence) or not all(isinstance(t, str) for t in take)
    ):
        raise RecordError(f"take is {take!r:.80}: give a list of channels, or None")
    if within is not None:
        remedy = "give the lowest and the highest offset in seconds, or None"
        if not isinstance(within, Sequence) or isinstance(within, str | bytes) or len(within) != 2:
            raise RecordError(f"within is {within!r:.80}: {remedy}")
        low, high = (real_number(value, "within", RecordError, remedy) for value in within)
        if not low < high:
            raise RecordError(f"within is {within!r:.80}: {remedy}")
    if not positive_number(max_rate, "max_rate", "", "give for example 1e-3") <= FASTEST_RATE:
        raise RecordError(f"max_rate is {max_rate!r}: give at most {FASTEST_RATE:g}, for example 1e-3")


def _check_lengths(mine: float, dt: float, theirs: float, their_dt: float) -> None:
    """Raises RecordError for logs of so many seconds, the shorter of which is no more than a few samples of the slower."""
    if min(mine, theirs) < MINIMUM_SAMPLES * max(dt, their_dt):
        raise RecordError(
            f"rec lasts {mine:g} s at dt={dt:g} s and other {theirs:g} s at dt={their_dt:g} s: the shorter log must last "
            f"{MINIMUM_SAMPLES} samples of the slower one; check the sample times, or give longer logs"
        )


def _best(
    x: NDArray[np.float64],
    dt: float,
    y: NDArray[np.float64],
    their_dt: float,
    within: tuple[float, float] | None,
    max_rate: float,
    names: tuple[str, str],
) -> LagFit:
    """The fit of the best offset. Raises RecordError where none is, or where another one is as good."""
    starts = coarse_lags(x, dt, y, their_dt, within, max_rate)
    tried = [refine(x, dt, y, their_dt, offset, rate, _WIDER * max_rate) for offset, rate in starts]
    fits = [fit for fit in tried if fit is not None and (within is None or within[0] <= fit.offset <= within[1])]
    if not fits:
        raise RecordError(f"within={within!r} leaves no offset at which the logs overlap; give a wider one")
    best = min(fits, key=lambda fit: fit.variance)
    what = names[0] if names[0] == names[1] else f"rec's {names[0]} and other's {names[1]}"
    if best.correlation < POLICY.aligned:
        raise RecordError(
            f"the logs cannot be aligned by {what}: the best correlation is {best.correlation:.2f}; are they of the same run? "
            "give on= with channels that show the same motion; where the logs last many minutes, cut both to a part first"
        )
    for fit in fits:
        apart = abs(fit.offset - best.offset)
        if apart > best.width and gained(fit.variance, best.variance, best.independent) < POLICY.rival_margin:
            raise RecordError(
                f"the logs cannot be aligned by {what} alone: the motion repeats itself, and offsets of {best.offset:.6g} s and "
                f"{fit.offset:.6g} s fit equally well; give within=(lowest, highest), or a run with one edge of its own"
            )
    return best


def _result(
    rec: Record,
    other: object,
    theirs: dict[str, NDArray[np.float64]],
    their_dt: float,
    take: Sequence[str] | None,
    fit: LagFit,
    seen: bool,
) -> Alignment:
    from scipy.interpolate import PchipInterpolator

    mine = dict(rec.channels())
    taken = [name for name in theirs if name not in mine] if take is None else list(take)
    missing = next((name for name in taken if name not in theirs), None)
    if missing is not None:
        raise RecordError(f"take: other has no {missing!r}; it has {', '.join(theirs)}")
    if "torque" in taken and isinstance(other, Record) and other.torque_log == MEAN:
        theirs = theirs | {"torque": at_its_lines(theirs["torque"])}
    inner = (rec.time - fit.offset) / (1.0 + fit.rate)
    end = (len(next(iter(theirs.values()))) - 1) * their_dt
    common = np.flatnonzero((inner >= 0.0) & (inner <= end))
    if common.size < MINIMUM_SAMPLES:
        raise RecordError(f"the logs have {common.size} samples in common, but at least {MINIMUM_SAMPLES} are needed")
    start, stop = int(common[0]), int(common[-1]) + 1
    axis: NDArray[np.float64] = their_dt * np.arange(float(len(next(iter(theirs.values())))))
    ratio = rec.dt / (their_dt * (1.0 + fit.rate))
    held = {"torque"} if isinstance(other, Record) and is_held(other.torque_is, other.torque_log) else set[str]()
    passed = {name: low_passed(theirs[name], ratio, name in held) for name in taken}
    ends: NDArray[np.float64] = np.append(inner[start:stop], inner[stop - 1] + rec.dt / (1.0 + fit.rate))
    new = {
        name: held_means(ends, axis, x) if name in held and x is theirs[name] else PchipInterpolator(axis, x)(ends[:-1])
        for name, x in passed.items()
    }
    channels: Mapping[str, Any] = {name: values[start:stop] for name, values in mine.items()} | new
    kind = other.torque_is if "torque" in taken and isinstance(other, Record) else None
    line = None
    if "torque" in taken:  # what was low-passed goes on between the lines
        logged = other.torque_log if isinstance(other, Record) else SAMPLE
        line = SMOOTH if logged == MEAN or passed["torque"] is not theirs["torque"] else logged
    record = rec.with_channels(torque_is=kind, torque_log=line, **channels)
    far = max(abs(inner[start] - fit.centre), abs(inner[stop - 1] - fit.centre))
    uncertainty = 2.0 * float(np.hypot(fit.centre_std, far * fit.std[1]))
    return Alignment(record, fit.offset, fit.std[0], fit.rate, fit.std[1], seen, fit.gain, fit.correlation, uncertainty)
