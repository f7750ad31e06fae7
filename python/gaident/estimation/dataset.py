"""The records as an estimation sees them: what drove the motor, where it stood, how it began, how noisy the velocity is.

A model is driven by the torque that the controller issued: as logged or, without a log, as the controller makes it from the
command and the *measured* velocity.
Noise inside the loop then acts in the model as on the drive; the true parameters leave sensor noise and disturbance torques.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.axis import TURN, period_of
from gaident.control.controller import Controller
from gaident.control.differencing import older
from gaident.control.filtering import filtered
from gaident.control.found import FoundNumbers
from gaident.control.pi import PI, bare_pi
from gaident.data.record import Record
from gaident.data.torque_kind import MEASURED
from gaident.data.windows.window import began
from gaident.estimation.mean_velocity import halved, means, with_middles
from gaident.estimation.period import period_of_place
from gaident.estimation.records.driven import angle_of, driven_under, freed, replayed, torque_in
from gaident.estimation.records.places import Place, cut
from gaident.estimation.term import Term, limiting_of
from gaident.models.drive_torque import as_late, torque_of
from gaident.models.made_torque import load_before, stored_torque
from gaident.models.simulate_many import LoadedRecord
from gaident.models.simulation_input import followed
from gaident.models.starts import noise_std, rounding_noise, starts_moving, torque_before
from gaident.policy.table import POLICY

__all__ = ["DataSet"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

MOST_SUBSTEPS = 5  # no decision: powers of two, 32 substeps of a sample at most: how exact a simulation is
FINEST = 0.125e-3  # no decision: s, of a substep: the accuracy that friction on a stiff shaft needs


@dataclass(frozen=True, eq=False)
class DataSet:
    """Records, each also as driven by its torque (`driven`), both with an angle, measured or integrated from the velocity.

    controller: what closed the loop on the drive; None: unknown, the torque drives the model. `loop` is what a simulation closes.
    turned: the record itself with that angle; free: torque-driven, without an angle that was not measured.
    read: the records as the controller read them, which may contain samples that the fit leaves out.
    finest: no substep of a simulation is much shorter [s]; finer: times as many are taken.
    resolution: step of the lattice of all velocities [rad/s], 0: none.
    known_noise: standard deviation of the velocity's noise where the records cannot show it; axis: "rotary" or "linear".
    loop_follows: whether the logged torque is what the controller makes; torque_measured: it was measured, behind the actuator.
    period: of what depends on the place [rad, m], orders count in it; None: not known. period_seen: it is what the records show.
    age: of the measured velocity [lines of the log]; half a controller sample where it is the difference of an encoder's angle.
    A torque that drives a model is delayed by the age. In a simulated loop the velocity is that difference.
    other_ages: ages that are possible too; a model that does not exclude them is less certain by what they change.
    found: numbers of the controller that the records show; their uncertainty is part of every deviation.
    clocked: whether the sample time of the controller was given.
    places: of windows, where they lie in the records of `whole`; empty where the records are whole.
    """

    records: tuple[Record, ...]
    controller: Controller | None
    driven: tuple[Record, ...]
    turned: tuple[Record, ...]
    free: tuple[Record, ...]
    moving: tuple[bool, ...]
    spoiled: bool = False
    read: tuple[Record, ...] = ()
    finest: float = FINEST
    finer: int = 1
    resolution: float = 0.0
    known_noise: float | None = None
    loop_follows: bool = True
    torque_measured: bool = False
    axis: str = "rotary"
    period: float | None = TURN
    period_seen: bool = False
    age: float = 0.0
    other_ages: tuple[float, ...] = ()
    found: FoundNumbers | None = None
    clocked: bool = False
    places: tuple[Place, ...] = ()
    whole: DataSet | None = None

    @classmethod
    def of(
        cls,
        records: Sequence[Record],
        controller: Controller | None,
        spoiled: bool = False,
        read: Sequence[Record] | None = None,
        resolution: float = 0.0,
        axis: str = "rotary",
        pitch: float | None = None,
    ) -> DataSet:
        """The records as driven by their torque; spoiled: some velocities are not what the controller read."""
        driven = tuple(driven_under(r, torque_of(r, bare_pi(controller))) for r in records)
        turned = tuple(r.with_channels(position=angle_of(a)) for r, a in zip(records, driven, strict=True))
        free = freed(records, driven)
        moving = tuple(starts_moving(r, None) for r in driven)
        seen = tuple(records if read is None else read)
        measured = any(r.torque_is == MEASURED for r in records)
        found = cls(tuple(records), controller, driven, turned, free, moving, spoiled, seen, resolution=resolution)
        return replace(found, torque_measured=measured, axis=axis, period=period_of(axis, pitch))

    def under(self, controller: Controller) -> DataSet:
        """The same records, whose torque is not logged, under another controller."""
        pi = bare_pi(controller)
        driven = tuple(driven_under(r, controller.torque_of(r) if pi is None else torque_of(r, pi)) for r in self.records)
        return replace(self, controller=controller, driven=driven, free=freed(self.records, driven), found=None)

    def with_its_period(self) -> DataSet:
        """The same with the period that the records show, where none is known."""
        shown = period_of_place(self.driven) if self.period is None else None
        return self if shown is None else replace(self, period=shown, period_seen=True)

    def aged(self, lines: float, others: Sequence[float] = ()) -> DataSet:
        """The same with a measured velocity that is so many lines of the log old; others: ages that are possible too."""
        return replace(self, age=lines, other_ages=tuple(others))

    def older(self, loop: Controller | None) -> Controller | None:
        """A loop in which the velocity has its age: it is the difference of the angle over a sample of the controller."""
        return None if loop is None else older(loop, self.age)

    def as_old(self, rec: Record) -> Record:
        """A record whose torque is as late as the velocity is old: a linear model that it drives gives the velocity that is seen.

        That is the mean of the velocities at the ends of a line; `gaident.estimation.mean_velocity` has what is nearer.
        """
        return as_late(rec, self.age)

    def ready(self, rec: Record, at: int) -> Record:
        """A record whose simulation `seen` takes for the velocity that the sensor shows; at: its place among the records."""
        if not self.differenced:
            return self.as_old(rec)
        if rec.position is not None and self.records[at].position is None:  # integrated from the velocity, the angle is as old
            rec = rec.with_channels(position=rec.position + self.age * self.dt * rec.velocity)
        return with_middles(rec)

    def ready_angle(self, angle: Vector, at: int) -> Vector:
        """Another angle (n,) [rad] of a record, for the one made `ready`."""
        if not self.differenced:
            return angle
        rec = self.records[at]
        return halved(angle + self.age * self.dt * rec.velocity if rec.position is None else angle)

    def seen(self, rows: Matrix) -> Matrix:
        """Rows of velocities that the sensor shows, of those that a record made `ready` gives."""
        return means(rows) if self.differenced else rows

    def steps_of(self, substeps: int | None) -> int | None:
        """Substeps of a sample of a record made `ready`, from those of a sample."""
        return substeps // 2 if self.differenced and substeps is not None else substeps  # no decision: a formula

    @property
    def differenced(self) -> bool:  # the velocity is the difference of the angle from each line of the log to the next
        return self.age == 0.5  # no decision: a mean over a line is half of it old

    @property
    def dt(self) -> float:
        """Sample time [s]."""
        return self.records[0].dt

    @cached_property
    def angle_logged(self) -> bool:
        """Whether every record contains the angle."""
        return all(r.position is not None for r in self.records)

    @cached_property
    def torque_logged(self) -> bool:
        """Whether every record contains the controller's torque, and not one that the given controller was made to give."""
        return all(r.torque is not None for r in (self.read or self.records))

    def substeps(self, controller: Controller | None) -> int:
        """Substeps for every model with effects not smooth, of a sample of log or controller; two for a mean of the log."""
        sample = self.dt if controller is None else self.dt / controller.log_every(self.dt)
        least = int(self.differenced and controller is None)
        return self.finer << min(max(math.ceil(math.log2(sample / self.finest)), least), MOST_SUBSTEPS)

    @property
    def loop_only(self) -> bool:
        """Whether no torque is known that drove the motor: only the simulated loop can drive a model.

        A replayed torque keeps the error that one wrong velocity adds to its integral.
        A torque logged less often than the controller samples is not known between the lines.
        """
        lost = self.slower or (self.spoiled and not self.torque_logged)
        return lost and self.fits_in_loop

    @cached_property
    def fits_in_loop(self) -> bool:
        """Whether command and controller drive a model in fits too, from standstill.

        Of a bare PI at the log's rate the integrator must have been empty before the records; else the torque drives the model.
        """
        return self.simulates_loop and not (self.pi is not None and any(self.stored))

    @property
    def left_in_loop(self) -> bool:
        """Whether the loop drives a model in a free run: it is the drive's, and does not only replace a measured torque."""
        return self.fits_in_loop and self.loop_follows

    @cached_property
    def simulates_loop(self) -> bool:
        """Whether command and controller can drive a model from standstill, with what the integrator stored.

        False where a commanded torque of the log does not follow from them.
        False where a measured torque does not follow from them and the log is slower than the controller.
        False where the torque tells all that the controller did and a record cannot be replayed to check it.
        """
        loop = self.loop
        if loop is None or any(self.moving) or not (self.loop_follows or (self.torque_measured and not self.slower)):
            return False
        checked = not self.told_by_torque or all(loop.replayable(r) for r in self.read or self.records)
        return checked and all(loop.command_of(r) is not None for r in self.records)

    @cached_property
    def stored(self) -> tuple[float, ...]:
        """What the integrator stored before each of the records, for a load [N m]."""
        loop = self.controller
        if self.whole is not None:
            return tuple(0.0 if p.start else self.whole.stored[p.at] for p in self.places)
        return tuple(0.0 if loop is None else stored_torque(r, loop) for r in self.records)

    @cached_property
    def loop(self) -> Controller | None:
        """What a simulated loop is closed over; None without a controller."""
        return None if self.controller is None else self.older(self.controller)

    @property
    def pi(self) -> PI | None:
        """What a simulated loop is closed over, where it is a bare PI."""
        return bare_pi(self.controller)

    @property
    def open_runs(self) -> bool:
        """Whether the torque drives a free run, for lack of a loop that can be simulated."""
        return self.pi is None and not self.fits_in_loop

    @cached_property
    def observed(self) -> DataSet:
        """The same under a share s of the controller, with commands r: s C (r - w_measured) = u, the records' torques."""
        assert self.pi is not None
        pi, half, share = self.pi, 0.5 * self.pi.ki * self.dt, POLICY.observer_share
        own = PI(kp=share * pi.kp, ki=share * pi.ki)
        b, a = np.array([1.0, -1.0]) / (share * (pi.kp + half)), np.array([1.0, (half - pi.kp) / (pi.kp + half)])
        pairs = zip(self.records, self.driven, self.turned, strict=True)
        commands = [(r, t, r.velocity + filtered(b, a, torque_in(d)[None, :], [len(d)])[0]) for r, d, t in pairs]
        records, turned = (tuple(part[i].with_channels(command=part[2]) for part in commands) for i in (0, 1))
        return replace(self, controller=own, records=records, turned=turned)

    @property
    def told_by_torque(self) -> bool:
        """See `Controller.told_by_torque`."""
        return self.controller is not None and self.controller.told_by_torque(self.dt)

    @property
    def slower(self) -> bool:
        """Whether the log has fewer lines than the controller samples: the torque is then known on the lines only."""
        return self.controller is not None and self.controller.log_every(self.dt) > 1

    @property
    def known_between(self) -> bool:
        """Whether it is known which torque drives the motor between the lines of the log.

        It follows from the controller, or the log has a line for each of the samples that the controller was given.
        """
        return self.loop_follows or (self.clocked and not self.slower)

    def loaded(self, records: Sequence[Record], controller: Controller | None) -> tuple[LoadedRecord, ...]:
        """Records as the core takes them, in this loop; those of the data set itself are loaded once.

        Where their torque drives a model they are made ready for a velocity of this age: see `ready`.
        """
        for name in ("records", "driven", "turned", "free"):
            if records is getattr(self, name):
                key = name, controller
                if key not in self._loaded:
                    self._loaded[key] = tuple(self.load(r, i, controller) for i, r in enumerate(records))
                return self._loaded[key]
        return tuple(self.load(r, i, controller) for i, r in enumerate(records))

    def load(self, rec: Record, at: int, controller: Controller | None) -> LoadedRecord:
        """One record as the core takes it; at: its place among the records."""
        if controller is not None:
            return LoadedRecord.of(rec, controller)
        ready = self.ready(rec, at)
        return LoadedRecord.of(ready, None, torque_before(ready, self._loads[at]))

    @cached_property
    def _loads(self) -> tuple[float, ...]:
        """What the integrator stored before each record for a load [N m]."""
        if self.whole is not None:
            return tuple(0.0 if p.start else self.whole._loads[p.at] for p in self.places)
        return tuple(load_before(r, self.controller) for r in self.records)

    @cached_property
    def _loaded(self) -> dict[tuple[str, Controller | None], tuple[LoadedRecord, ...]]:
        return {}

    @cached_property
    def begun(self) -> tuple[float, ...]:
        """Velocity at the first line of each window [rad/s], from which its start state is sought; empty without windows."""
        return tuple(float(r.velocity[0]) for r in self.records) if self.whole is not None else ()

    @property
    def windowed(self) -> bool:
        """Whether some records are windows that begin in the middle of one."""
        return any(p.start for p in self.places)

    @cached_property
    def lengths(self) -> tuple[int, ...]:
        """Samples of each record."""
        return tuple(len(r) for r in self.records)

    @cached_property
    def velocity(self) -> Vector:
        """Measured velocity, records one after the other [rad/s]."""
        return np.concatenate([r.velocity for r in self.records])

    @cached_property
    def torque(self) -> Vector:
        """Torque, records one after the other [N m]."""
        return np.concatenate([torque_in(r) for r in self.driven])

    @cached_property
    def angle(self) -> Vector:
        """Motor angle, records one after the other [rad]."""
        return np.concatenate([angle_of(r) for r in self.driven])

    @cached_property
    def travel(self) -> float:
        """The largest travel of a record [rad]."""
        return max(float(np.ptp(angle_of(r))) for r in (self.whole or self).driven)

    @cached_property
    def duration(self) -> float:
        """Duration of the longest record [s]."""
        return max(r.duration for r in (self.whole or self).records)

    @cached_property
    def time(self) -> Vector:
        """Time since each record's start, records one after the other [s]."""
        return np.concatenate([began(r) + r.time for r in self.records])

    @cached_property
    def command(self) -> Vector | None:
        """Command, records one after the other [rad/s]; None where one record has none."""
        commands = [r.command for r in self.records if r.command is not None]
        return np.concatenate(commands) if len(commands) == len(self.records) else None

    @cached_property
    def noise(self) -> float:
        """Standard deviation of white noise on the velocity, as its third differences show it [rad/s]."""
        seen = np.mean([noise_std(r.velocity) for r in self.records])
        return max(float(seen), self.rounding) if self.known_noise is None else self.known_noise

    @cached_property
    def rounding(self) -> float:  # what the lattice of the velocities makes of their noise [rad/s]
        return float(np.mean([rounding_noise(r.velocity, self.resolution, self.age > 0.0) for r in self.records]))

    def noise_of(self, error: Vector) -> float:
        """The same as a model's errors show it, where the motion has third differences: of a log slower than its controller."""
        if not self.slower or self.known_noise is not None or not np.all(np.isfinite(error)):
            return self.noise
        seen = float(np.mean([noise_std(e) for e in np.split(error, np.cumsum(self.lengths)[:-1])]))
        return min(self.noise, max(seen, self.rounding))

    def replayed(self, effects: Mapping[Term, Vector]) -> tuple[Record, ...]:
        """The records as driven by the torque that the controller makes with effects of its own, each with its parameters."""
        if self.whole is not None:
            return cut(self.whole.replayed(effects), self.whole.turned, self.places)
        rows = zip(self.records, self.read, self.stored, strict=True)
        return tuple(driven_under(r, replayed(read, self.controller, effects, stored)) for r, read, stored in rows)

    def replayed_error(self, effects: Mapping[Term, Vector]) -> Vector:
        """Logged torque minus the controller's replay with these effects, records one after the other [N m]."""
        assert self.controller is not None
        known = [len(r) - self.controller.ahead(r.dt) for r in self.read]
        rows = zip(self.read, known, self.stored, strict=True)
        return np.concatenate([(torque_in(r) - replayed(r, self.controller, effects, held))[:n] for r, n, held in rows])

    def with_effects(self, effects: Mapping[Term, Vector]) -> DataSet:
        """The same with records and controller as effects at the controller, which are known, make them in the simulated loop."""
        if not effects or self.pi is None:
            return self
        also, torque = limiting_of(effects), self.pi.torque_limit
        records, turned = (tuple(followed(r, also.slope) for r in part) for part in (self.records, self.turned))
        limited = self.pi.with_limits(torque, min(also.integrator, self.pi.limits[1]))
        return replace(self, records=records, turned=turned, controller=limited)
