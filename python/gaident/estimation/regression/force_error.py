"""The force error: the torque that was there, minus the torque that a model needs for the measured motion.

    e(n) = F[F[s](n) - m(n)],   m the torque under which the model moves as F[w], F[theta]
    force_error = sqrt(mean e(n)^2)   over the samples in motion

F is the zero-phase filter of the inverse-dynamics regression: what makes m has passed it once, and so has s.
Both pass it once more.
s is the torque at the shaft: the logged torque behind the model's actuator, and behind its sensor's filter, which acts alike; but
not behind that filter where a logged angle makes the motion, and the velocity is late behind it.

m is found by simulation: a stiff PI loop leads the mechanism, with its effects at shaft and coupling, along the filtered motion.
Its torque is m. Without effects that is inverse filtering, m = w/G.

The force error needs no initial state and integrates nothing.
Where an axis integrates, or falls under gravity, small errors of every sample add up in a free run, but not in this figure.
Theory: docs/theory/inverse-dynamics.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from gaident.checks import LONGEST, is_whole, real_number
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.data.torque_kind import MEAN, MEASURED
from gaident.data.windows.window import integrated, window_of
from gaident.errors import ModelError, RecordError, SettingsError
from gaident.estimation.regression.motion import ORDER, Motion, cutoff_of, low_passed, motion_of, noise_share, torque_noise
from gaident.estimation.regression.sensor_lag import angle_is_ahead
from gaident.models.held_torque import held_from_lines, held_torque
from gaident.models.model import Model
from gaident.models.simulate import run, simulate
from gaident.policy.table import POLICY
from gaident.results.inverse_dynamics import InverseDynamics

__all__ = ["FilteredRecords", "ForceError", "band_of", "effects_before_the_shaft", "force_error", "in_pieces"]

Vector = NDArray[np.float64]
TorqueOf = Callable[[Record], Vector]

LEAD = 8  # no decision: a formula: of a piece, the part before it in which a filter begins


@dataclass(frozen=True)
class ForceError:
    """The force error of a model on records.

    Attributes
    ----------
    rms : float
        Root mean square of logged torque minus needed torque [N m].
    torque_rms : float
        Root mean square of the torque at the shaft over the same samples [N m].
    noise_floor : float
        What noise of the sensor, and of a measured torque, leave of `rms` at most [N m].
    cutoff_hz : float
        Corner of the filter that all channels passed [Hz].
    order : int
        Order of the filter in each direction.
    samples : int
        Samples in motion, over which the figures are taken.

    See Also
    --------
    force_error : Makes it.
    """

    rms: float
    torque_rms: float
    noise_floor: float
    cutoff_hz: float
    order: int
    samples: int

    @property
    def percent(self) -> float:
        """Of the torque's rms [%]."""
        return 100.0 * self.rms / self.torque_rms if self.torque_rms > 0.0 else math.nan


def force_error(
    model: Model | InverseDynamics | TorqueOf,
    records: Record | Sequence[Record],
    *,
    cutoff_hz: float | None = None,
    order: int = ORDER,
    first: int | Sequence[int] = 0,
) -> ForceError:
    """How far the torque of records is from the torque that a model needs for their motion.

    Parameters
    ----------
    model : Model or InverseDynamics or callable
        A Model with p = 1, positive gain and stable zeros, an InverseDynamics, or a function that gives the needed torque [N m]
        of a record, an array (n,).
    records : Record or sequence of Record
        One Record or several of one sample time, each with its torque.
    cutoff_hz : float, optional
        Corner of the filter [Hz]. None: what `inverse_dynamics` would choose, at most half of the model's lowest antiresonance.
    order : int
        Order of the Butterworth filter, 1 to 10; it runs forward and backward.
    first : int or sequence of int
        Sample of each record from which the error counts, one number or one for each record.

    Returns
    -------
    ForceError
        Frozen: `rms`, `torque_rms`, `percent`, `noise_floor`, the filter and the number of samples.

    Raises
    ------
    RecordError
        No torque, or nothing that moves from `first` on.
    ModelError
        A model that cannot be led along a motion: another p, a gain that is not positive, an unstable zero.
    SettingsError
        A setting out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> t = 1e-3 * np.arange(4000)
    >>> w, a = 5 * np.sin(5 * t), 25 * np.cos(5 * t)
    >>> rec = ga.Record(1e-3, velocity=w, torque=2e-3 * a + 0.01 * w + 0.1 * np.sign(w))
    >>> round(ga.force_error(ga.OneMass(J=2e-3, D=0.01).model(), rec).rms, 2)
    0.1
    """
    given = [records] if isinstance(records, Record) else list(records) if _has_items(records) else []
    firsts: list[Any] = list(first) if _has_items(first) else [first] * len(given)
    if not given or not all(isinstance(r, Record) and r.torque is not None for r in given):
        raise RecordError("records: give one Record or several, each with its torque, which the force error compares")
    if len(firsts) != len(given):
        raise SettingsError(f"first has {len(firsts)} numbers for {len(given)} records; give one number, or one for each record")
    if any(not is_whole(n) or n < 0 for n in firsts):
        raise SettingsError(f"first is {first!r:.80}: give a whole number of samples, 0 or more, or one for each record")
    if not isinstance(model, Model | InverseDynamics) and not callable(model):
        raise SettingsError(f"model is {model!r:.80}: give a Model, what inverse_dynamics found, or a function of a record")
    # no decision: what an argument may be
    if not is_whole(order) or not 1 <= order <= 10:
        raise SettingsError(f"order={order!r}: give a whole number from 1 to 10, the filter's order in each direction")
    nyquist = 0.5 / given[0].dt  # no decision: a formula
    remedy = f"give a corner between {1.0 / LONGEST:g} and {nyquist:g} Hz, or None"
    given_hz = None if cutoff_hz is None else real_number(cutoff_hz, "cutoff_hz", SettingsError, remedy)
    cutoff = band_of(model, given, int(order)) if given_hz is None else given_hz
    if not 1.0 / LONGEST <= cutoff < nyquist:
        raise SettingsError(f"cutoff_hz={cutoff_hz!r}: {remedy}")
    filtered = FilteredRecords(tuple(given), tuple(firsts), cutoff, int(order))
    return filtered.force_error(model, filtered.torques(model))


@dataclass(frozen=True, eq=False)
class FilteredRecords:
    """Records with their torque, from the sample `first` of each on, behind one filter: force errors of several models.

    angles: with which the effects of the angle turn in a record, where that is not the motion's own (n,); None: it is.
    """

    records: tuple[Record, ...]
    first: tuple[int, ...]
    cutoff_hz: float
    order: int = ORDER
    angles: tuple[Vector | None, ...] | None = None

    @property
    def motions(self) -> Iterable[Motion]:
        """The filtered motion of each record; of long ones it is made anew when it is asked for."""
        return self._motions if sum(map(len, self.records)) <= POLICY.whole_samples else self._made()

    @cached_property
    def _motions(self) -> tuple[Motion, ...]:
        return tuple(self._made())

    def _made(self) -> Iterable[Motion]:
        return map(self._motion, self.records, self.angles or (None,) * len(self.records))

    def _motion(self, rec: Record, angle: Vector | None) -> Motion:
        motion = motion_of(rec, self.cutoff_hz, self.order)
        return motion if angle is None else replace(motion, position=low_passed(angle, rec.dt, self.cutoff_hz, self.order))

    def torques(self, model: Model | InverseDynamics | TorqueOf) -> list[tuple[Vector, Vector]]:
        """(logged minus needed torque, torque at the shaft) of each record, over its samples in motion [N m]."""
        cutoff, order, parts = self.cutoff_hz, self.order, []
        for rec, motion, start in zip(self.records, self.motions, self.first, strict=True):
            kept = in_motion(motion, cutoff, start)
            at_shaft, needed = _torques(model, rec, motion, cutoff, order)
            e, s = (low_passed(x, rec.dt, cutoff, order)[kept] for x in (at_shaft - needed, at_shaft))
            parts.append((e, s))
        return parts

    def force_error(self, model: Model | InverseDynamics | TorqueOf, torques: Sequence[tuple[Vector, Vector]]) -> ForceError:
        """The force error of a model with these `torques`. Raises RecordError where nothing moves."""
        count = sum(len(e) for e, _ in torques)
        if count == 0:
            raise RecordError("nothing moves from `first` on, so there is no force error; give records that move")
        left, whole = (sum(float(part[i] @ part[i]) for part in torques) for i in (0, 1))
        moved = zip(self.records, self.motions, strict=True)
        powers = [_noise_power(model, rec, m, self.cutoff_hz, self.order) for rec, m in moved]
        floor = sum(len(e) * power for (e, _), power in zip(torques, powers, strict=True))
        rms, size, least = (float(np.sqrt(x / count)) for x in (left, whole, floor))
        return ForceError(rms if math.isfinite(rms) else math.inf, size, least, self.cutoff_hz, self.order, count)


def in_pieces(rec: Record, first: int) -> list[tuple[Record, int]]:
    """A long record from the sample `first` on, in pieces each with its own first sample; a shorter one as it is.

    A force error knows no past: of a piece it lacks what the filter does to its ends.
    """
    if len(rec) <= POLICY.whole_samples:
        return [(rec, first)]
    length = POLICY.most_samples
    angle = integrated(rec) if rec.position is None else rec.position
    ends = np.linspace(first, len(rec), max((len(rec) - first) // length, 1) + 1).astype(int).tolist()
    lead = length // LEAD
    return [(window_of(rec, max(start - lead, 0), stop, angle), min(start, lead)) for start, stop in pairwise(ends)]


def band_of(model: object, records: Sequence[Record], order: int = ORDER, below: float = POLICY.swing_band) -> float:
    """The cutoff [Hz] over these records: the regression's, at most `below` times the model's lowest antiresonance."""
    zeros = [abs(z) for z in model.zeros if z.imag > 0.0] if isinstance(model, Model) else []
    highest = below * min(zeros, default=math.inf) / (2.0 * math.pi)
    return float(min(highest, *(cutoff_of(r, order) for r in records)))


def in_motion(motion: Motion, cutoff_hz: float, first: int = 0) -> NDArray[np.bool_]:
    """The samples that count: in motion, from `first` on, away from both ends of the record."""
    kept = ~motion.still  # a copy
    edge = math.ceil(POLICY.force_edge / (cutoff_hz * motion.dt))
    kept[: max(edge, first)] = kept[max(len(kept) - edge, 0) :] = False
    return kept


def _torques(
    model: Model | InverseDynamics | TorqueOf, rec: Record, motion: Motion, cutoff_hz: float, order: int
) -> tuple[Vector, Vector]:
    """(F[s], m), arrays (n,)."""
    assert rec.torque is not None and motion.torque is not None
    if isinstance(model, Model):
        return low_passed(_at_shaft(model, rec), rec.dt, cutoff_hz, order), _led(model, rec, motion, cutoff_hz)
    if isinstance(model, InverseDynamics):
        model = replace(model, cutoff_hz=cutoff_hz, order=order).torque
    needed = np.asarray(model(rec), dtype=np.float64)
    if needed.shape != rec.torque.shape:
        raise SettingsError(f"model gives an array of the shape {needed.shape} for a record of {len(rec)} samples")
    return motion.torque, needed


def _has_items(value: object) -> TypeGuard[Iterable[Any]]:
    """Whether it is several values; an array without a dimension is one, though NumPy gives it an iterator."""
    return isinstance(value, Iterable) and bool(getattr(value, "ndim", 1))


def effects_before_the_shaft(model: Model) -> list[str]:
    """Effects between the logged torque and the shaft: of the actuator, and a sensor's filter, which acts like a lag there."""
    return [e.name for e in model.effects if e.row.place == "actuator" or (e.row.place == "sensor" and not e.row.turns)]


def _at_shaft(model: Model, rec: Record) -> Vector:
    """The logged torque behind the actuator [N m], its mean over each sample: an inertia of 1 makes it a velocity's change."""
    assert rec.torque is not None
    logged = held_torque(rec) if rec.torque_log == MEAN else rec.torque
    seen = [e.name for e in model.effects if e.row.place == "sensor"] if angle_is_ahead(rec) else []
    ahead = set(effects_before_the_shaft(model)) - set(seen)
    if not ahead:
        return logged
    unit = Model(1.0, [0.0], effects=[e for e in model.effects if e.name in ahead])
    torque = np.append(logged, logged[-1])
    padded = Record(rec.dt, torque=torque, velocity=np.zeros(len(torque)))
    return np.asarray(np.diff(simulate(unit, padded)) / rec.dt)


def _led(model: Model, rec: Record, motion: Motion, cutoff_hz: float) -> Vector:
    """The torque of a stiff loop that leads the model's mechanism along a filtered motion [N m] (n,).

    A commanded torque is held over each sample, so its mean over the sample is given, as beside a log of means; beside another
    measured torque the value at the sample.
    """
    from scipy.interpolate import CubicSpline

    if model.p != 1 or not model.gain > 0.0 or any(z.real > 0.0 for z in model.zeros):
        raise ModelError(
            f"{model.mechanism!r} cannot be led along a motion, which takes p = 1, a positive gain and stable zeros: give one "
            "mass, two, or a regression"
        )
    out = {*effects_before_the_shaft(model), *(e.name for e in model.effects if e.row.place == "controller")}
    mechanism = Model(model.gain, model.poles, model.zeros, [e for e in model.effects if e.name not in out])
    n = len(rec)
    fine = max(1, math.ceil(POLICY.led_steps * cutoff_hz * rec.dt))
    dt = rec.dt / fine
    grid, at = np.arange(n) * rec.dt, np.arange(n * fine) * dt
    w = CubicSpline(grid, motion.velocity)
    kp = POLICY.inversion_gain / (model.gain * dt)
    wanted = w(np.minimum(at, grid[-1]))
    # The loop follows late by dt/`inversion_gain`, so the command leads by as much.
    command = wanted + dt / POLICY.inversion_gain * w(np.minimum(at, grid[-1]), 1)
    position = CubicSpline(grid, motion.position)(np.minimum(at, grid[-1]))
    state = np.zeros(mechanism.order + 2 * any(e.row.place == "plant" for e in mechanism.effects) + 1)
    state[0] = motion.velocity[0]
    loop = PI(kp=kp, ki=POLICY.inversion_integral * kp / dt)
    with np.errstate(all="ignore"):
        for _ in range(POLICY.led):
            led = run(mechanism, Record(dt, command=command, velocity=command, position=position), loop, state)
            command = command + np.where(np.isfinite(led.velocity), wanted - led.velocity, 0.0)
    held = led.torque.reshape(n, fine)
    sampled = rec.torque_log != MEAN and not held_from_lines(rec)
    return np.asarray(held[:, 0] if sampled else held.mean(axis=1))


def _noise_power(model: Model | InverseDynamics | TorqueOf, rec: Record, motion: Motion, cutoff_hz: float, order: int) -> float:
    """Variance of what noise leaves [(N m)^2]: J times that of the acceleration, and that of a measured torque."""
    if isinstance(model, Model):
        omega = math.pi * cutoff_hz
        inertia = abs(float((1.0 / model.mechanism.frequency_response(omega)).imag)) / omega
    else:
        inertia = model.parameters["inertia"].value if isinstance(model, InverseDynamics) else 0.0
    share = noise_share(rec, cutoff_hz, order, motion.spectrum)
    power = share * float(np.mean(motion.acceleration**2)) * inertia**2
    return power + (torque_noise(rec, cutoff_hz, order) ** 2 if rec.torque_is == MEASURED else 0.0)
