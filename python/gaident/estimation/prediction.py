"""Predictors: how the data drive a model.

    open loop    w = model(u),            u the torque that the controller issued, from the measured velocity
    closed loop  w = loop(r; model, PI),  r the command; the simulated controller reads the simulated velocity

The open loop shows everything that the torque does not explain; it integrates disturbance torques between the stops of dry
friction.
The closed loop keeps a simulation near the record: motion in a gap is so sensitive to its start that even the true drive,
simulated in open loop, departs from it.

The angle that effects depend on is the logged one (or the measured velocity, integrated), or that of the simulation itself.

`shown` says what of a simulation is given: the "velocity" that the sensor shows.
Of the load of two masses it is the "angle" [rad], the "lag", the angle less the motor's, or the "load velocity" [rad/s].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Controller
from gaident.control.filtering import filtered
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.data.torque_kind import MEASURED
from gaident.data.windows.window import began
from gaident.estimation.dataset import DataSet
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.records.driven import angle_of, freed
from gaident.estimation.term import Term
from gaident.models.effects import place_of
from gaident.models.model import Model
from gaident.models.own_effects import OWN
from gaident.models.roots import quadratic_roots
from gaident.models.simulate import simulate
from gaident.models.starts import noise_std

__all__ = [
    "ClosedLoop",
    "ObserverLoop",
    "OpenLoop",
    "Predictor",
    "coupling_response",
    "torque_noise_draws",
    "torque_noise_in",
    "twist",
]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
ALL = slice(None)


class Predictor(Protocol):
    """Simulated velocities of models, and what a torque at the shaft adds to them."""

    @property
    def data(self) -> DataSet:
        """The records, and what drives a model on them."""
        ...

    @property
    def closed(self) -> bool:
        """Whether the simulated controller closes the loop."""
        ...

    @property
    def own_angle(self) -> bool:
        """Whether effects of the angle turn with the simulated shaft."""
        ...

    def velocities(self, parameters: Parameterisation, X: Matrix) -> Matrix:
        """Simulated velocities of rows of x, (n, samples)."""
        ...

    def torque_response(self, parameters: Parameterisation, x: Vector, torques: Matrix) -> Matrix:
        """Velocity of the linear part of the model x, from rest, under rows of torque held over each sample."""
        ...

    def sensor_response(self, parameters: Parameterisation, x: Vector, errors: Matrix) -> Matrix:
        """What rows of an error of the sensor add to the velocity that it shows, with the linear part of the model x."""
        ...


@dataclass(frozen=True)
class OpenLoop:
    """The torque drives the model; with an effect in the controller that no replay contains, the command does.

    No replay contains what a controller did between the lines of a slower log.
    """

    data: DataSet
    own_angle: bool = False
    shown: str = "velocity"
    closed = False

    def velocities(self, parameters: Parameterisation, X: Matrix) -> Matrix:
        """See `Predictor`."""
        inside = [t for t in parameters.terms if t.in_controller]
        if not all(t.replayable for t in inside) or (inside and self.data.slower):
            return ClosedLoop(self.data, self.own_angle, self.shown).velocities(parameters, X)
        if inside:
            return self._replayed(parameters, X, inside)
        return self._under(parameters, X, self.data.free if self.own_angle else self.data.driven)

    def _under(self, parameters: Parameterisation, X: Matrix, records: Sequence[Record], left_out: Sequence[str] = ()) -> Matrix:
        """Rows of x under the torques of these records; left_out: effects that the torques contain already."""
        if not self.own_angle and _bends_the_angle(self.data, parameters):
            return np.vstack([_of_true_angle(self, parameters, x, records, None, left_out) for x in X])
        return _simulated(self, parameters, X, left_out, records)

    def _replayed(self, parameters: Parameterisation, X: Matrix, inside: Sequence[Term]) -> Matrix:
        """With effects of the controller the torque itself depends on x: rows that share it are simulated together."""
        parts = [parameters.effect_values(X, t.name) for t in inside]
        _, first, group = np.unique(np.hstack(parts), axis=0, return_index=True, return_inverse=True)
        out = np.empty((len(X), sum(self.data.lengths)))
        for i, row in enumerate(first.tolist()):
            of_row = np.flatnonzero(group.ravel() == i)
            records = self.data.replayed({t: part[row] for t, part in zip(inside, parts, strict=True)})
            records = freed(self.data.records, records) if self.own_angle else records
            out[of_row] = self._under(parameters, X[of_row], records, [t.name for t in inside])
        return out

    def torque_response(self, parameters: Parameterisation, x: Vector, torques: Matrix) -> Matrix:
        """See `Predictor`."""
        d = parameters.linear(x).discrete(parameters.scales.dt)
        return filtered(d.alpha, np.append(1.0, -d.beta), torques, self.data.lengths)

    def sensor_response(self, parameters: Parameterisation, x: Vector, errors: Matrix) -> Matrix:
        """See `Predictor`; the logged torque contains the controller's answer."""
        return errors


@dataclass(frozen=True)
class ClosedLoop:
    """The command drives controller and model."""

    data: DataSet
    own_angle: bool = False
    shown: str = "velocity"
    closed = True

    def velocities(self, parameters: Parameterisation, X: Matrix) -> Matrix:
        """See `Predictor`."""
        data = self.data
        inside = any(t.in_controller for t in parameters.terms)
        if not inside and not self.own_angle and _bends_the_angle(data, parameters):
            return np.vstack([_of_true_angle(self, parameters, x, data.turned, data.loop) for x in X])
        names, values = parameters.values(X)
        steps = substeps(data, parameters.terms, data.loop)
        records = data.records if self.own_angle else data.turned
        loaded = data.loaded(records, data.loop)
        starts = [parameters.standing(len(X), stored) for stored in data.stored]
        return _side_by_side(
            [
                r.velocities(parameters.structure, names, values, initial_states=start, substeps=steps, shown=self.shown)
                for r, start in zip(loaded, starts, strict=True)
            ]
        )

    def torque_response(self, parameters: Parameterisation, x: Vector, torques: Matrix) -> Matrix:
        """See `Predictor`; the controller answers to what the torque makes of the velocity."""
        return self.sensor_response(parameters, x, OpenLoop(self.data).torque_response(parameters, x, torques))

    def sensor_response(self, parameters: Parameterisation, x: Vector, errors: Matrix) -> Matrix:
        """See `Predictor`; the controller answers: e - T e, T the closed loop's response to the command.

        Of a cascade that is taken to be its velocity controller alone, at the log's rate.
        """
        loop = self.data.loop
        assert loop is not None
        pi = self.data.pi or PI(kp=loop.gains.kp, ki=loop.gains.ki)
        d = parameters.linear(x).discrete(parameters.scales.dt, pi)
        return errors - filtered(d.alpha, np.append(1.0, -d.beta), errors, self.data.lengths)


@dataclass(frozen=True)
class ObserverLoop:
    """The torque drives the model, and a share of the controller holds its velocity near the measured one.

        u = u_record + s C(q) (w_measured - w),   s = `observer_share`

    A predictor with a fixed observer (Ljung 1999, chapter 4).
    After some impacts the motion of a model that the torque alone drives depends on rounding errors.
    In the drive's loop, s = 1, the controller's whole answer to the noise of the sensor is missing from the simulation.
    An effect inside the controller is simulated in the drive's loop.
    """

    data: DataSet
    own_angle: bool = False
    shown: str = "velocity"
    closed = True

    def velocities(self, parameters: Parameterisation, X: Matrix) -> Matrix:
        """See `Predictor`."""
        return self._loop(parameters).velocities(parameters, X)

    def torque_response(self, parameters: Parameterisation, x: Vector, torques: Matrix) -> Matrix:
        """See `Predictor`."""
        return self._loop(parameters).torque_response(parameters, x, torques)

    def sensor_response(self, parameters: Parameterisation, x: Vector, errors: Matrix) -> Matrix:
        """See `Predictor`."""
        return self._loop(parameters).sensor_response(parameters, x, errors)

    @staticmethod
    def possible(data: DataSet) -> bool:
        """Under a bare PI at the log's rate that reads the velocity as it is."""
        return data.pi is not None and data.pi.loop == "sampled" and data.fits_in_loop and not data.age

    def _loop(self, parameters: Parameterisation) -> ClosedLoop:
        inside = any(t.in_controller for t in parameters.terms)
        return ClosedLoop(self.data if inside else self.data.observed, self.own_angle, self.shown)


def substeps(data: DataSet, terms: Sequence[Term], controller: Controller | None) -> int | None:
    """As many for every model with effects, so that no candidate has an advantage by finer simulation."""
    # User-defined effects are smooth, and take long to evaluate.
    acting = any(not t.resonates and t.name not in OWN for t in terms)
    return data.substeps(controller) if acting else None


def _simulated(
    predictor: OpenLoop,
    parameters: Parameterisation,
    X: Matrix,
    left_out: Sequence[str],
    records: Sequence[Record],
) -> Matrix:
    """Rows of x under the torques of the records, as the sensor shows the velocity.

    Of windows, rows that differ in the start of another one only are simulated once.
    """
    data, shown = predictor.data, predictor.shown
    steps = data.steps_of(substeps(data, parameters.terms, None))
    parts = []
    for i, r in enumerate(data.loaded(records, None)):
        names, values = parameters.values(X, left_out, began(r.rec))
        states = parameters.start_values(X, i)
        own = values if states is None else np.hstack([values, states])
        few, back = _different(own) if data.windowed else (ALL, ALL)
        known: dict[str, Any] = dict(initial_states=None if states is None else states[few], substeps=steps, shown=shown)
        parts.append(_seen(predictor, r.velocities(parameters.structure, names, values[few], **known))[back])
    return _side_by_side(parts)


def _different(rows: Matrix) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """(numbers of the rows that differ from each other, place of each row among these)."""
    _, first, back = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first, back.ravel()


def _seen(predictor: OpenLoop | ClosedLoop, rows: Matrix) -> Matrix:
    """See `DataSet.seen`; of the load, what stands on the lines of the log."""
    if predictor.shown == "velocity":
        return predictor.data.seen(rows)
    return rows[:, ::2] if predictor.data.differenced else rows


def _side_by_side(parts: Sequence[Matrix]) -> Matrix:
    """Velocities of all records, one after the other."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)


def _bends_the_angle(data: DataSet, parameters: Parameterisation) -> bool:
    """Whether the angle comes from a velocity that the sensor bends, and something else turns with the true one."""
    if data.angle_logged:
        return False
    turning = {t.name for t in parameters.terms if t.harmonic}
    return any(turning - {t.name} for t in parameters.terms if t.seen_angle is not None)


def _of_true_angle(
    predictor: OpenLoop | ClosedLoop,
    parameters: Parameterisation,
    x: Vector,
    records: Sequence[Record],
    controller: Controller | None,
    left_out: Sequence[str] = (),
) -> Matrix:
    """One x with the true angle, from which the sensor of this model makes the angle that was seen."""
    data = predictor.data
    # Back through the sensor: what stands last in the chain is taken back first.
    bending = sorted((t for t in parameters.terms if t.seen_angle), key=lambda t: -place_of(t.name))
    bent = [(t.seen_angle, parameters.effect_values(x[None, :], t.name)[0]) for t in bending]
    steps = substeps(data, parameters.terms, controller)
    parts = []
    for i, (loaded, driven) in enumerate(zip(data.loaded(records, controller), data.driven, strict=True)):
        angle = angle_of(driven)
        for true_angle, own in bent:
            assert true_angle is not None
            angle = true_angle(angle, driven.velocity, own)
        if controller is not None:
            run, states, taken = loaded.turned(angle), parameters.standing(1, data.stored[i]), steps
        else:
            run, states = loaded.turned(data.ready_angle(angle, i)), parameters.start_values(x[None, :], i)
            taken = data.steps_of(steps)
        known: dict[str, Any] = dict(initial_states=states, substeps=taken, shown=predictor.shown)
        names, values = parameters.values(x[None, :], left_out, began(loaded.rec))
        seen = run.velocities(parameters.structure, names, values, **known)
        parts.append(seen if controller is not None else _seen(predictor, seen))
    return np.concatenate(parts, axis=1)


def torque_noise_in(mechanism: Model, records: Sequence[Record]) -> float:
    """Rms error [rad/s] that the noise of measured torques makes of a free run; 0 where none was measured.

    White noise of the standard deviation s on a torque that is held makes s^2 mean_n sum_(k<n) h(k)^2, with h the response to one
    sample of torque. s is that of the torque's third differences: a command that goes in steps is no noise.
    """
    power, count = 0.0, sum(len(r) for r in records)
    for rec in records:
        if rec.torque is None or rec.torque_is != MEASURED:
            continue
        unit = np.zeros(len(rec))
        unit[0] = 1.0
        response = simulate(mechanism.mechanism, Record(rec.dt, torque=unit, velocity=np.zeros(len(rec))))
        power += noise_std(rec.torque) ** 2 * float(np.sum(np.cumsum(response**2)))
    return float(np.sqrt(power / max(count, 1)))


def torque_noise_draws(predictor: Predictor, parameters: Parameterisation, x: Vector, noise: float, count: int) -> Matrix:
    """What draws of the noise of measured torques make of the velocity of the model x, with noise of the velocity (count, n).

    noise: standard deviation of that of the velocity [rad/s]; that of the torques is as in `torque_noise_in`.
    """
    torques, velocities = [], []
    for rec in predictor.data.records:
        rng = np.random.default_rng(int(rec.digest, 16))  # the same draws of a record, whatever stands beside it
        size = noise_std(rec.torque) if rec.torque is not None and rec.torque_is == MEASURED else 0.0
        torques.append(size * rng.standard_normal((count, len(rec))))
        velocities.append(noise * rng.standard_normal((count, len(rec))))
    return predictor.torque_response(parameters, x, _side_by_side(torques)) + _side_by_side(velocities)


def twist(data: DataSet, parameters: Parameterisation, x: Vector) -> Vector:
    """Twist of the shaft of two masses, to scale, as the linear part of the model x has it: u e0/(s^2 + e1 s + e0)."""
    _, _, e1, e0, *_ = parameters.base_values(x[None, :])[0]
    row: Vector = _second_order(data, data.torque[None, :], e0, (), e1, e0)[0]
    return row


def coupling_response(data: DataSet, parameters: Parameterisation, x: Vector, torques: Matrix) -> Matrix:
    """Motor velocity under rows of a torque between the masses: -K s/(s^2 + e1 s + e0), open loop."""
    K, _, e1, e0, *_ = parameters.base_values(x[None, :])[0]
    return _second_order(data, torques, -K, (0.0,), e1, e0)


def _second_order(data: DataSet, rows: Matrix, gain: float, zeros: tuple[float, ...], e1: float, e0: float) -> Matrix:
    behind_hold = Model(1.0, quadratic_roots(max(e1, 0.0), abs(e0)), zeros).discrete(data.dt)
    return filtered(gain * behind_hold.alpha, np.append(1.0, -behind_hold.beta), rows, data.lengths)
