"""An effect as an estimation sees it: coordinates that a fit can move, with bounds, starts and kinship.

The estimation knows no effect by name.
What it has to know of one is data of its `Term`; the terms themselves stand in the library of the diagnosis.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Limiting

__all__ = ["PHASE", "Scales", "Term", "limiting_of"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Natural = Callable[[Matrix], Matrix]
Rows = list[tuple[float, ...]]

PHASE = 1.0  # no decision: a formula: rad; by so much a phase is off where its two components are off by the amplitude


IN_SERIES = ("actuator", "sensor", "plant")
"""Places between the torque and the measured velocity, one behind the other."""


@dataclass(frozen=True)
class Scales:
    """The sizes that bounds and starts are made of, from the records and the model so far."""

    dt: float  # s
    duration: float  # s, of the longest record
    speed: float  # rad/s, largest
    torque: float  # N m, largest
    acceleration: float  # rad/s^2, largest slope of the command, inf without one
    travel: float  # rad
    friction: float  # N m, Coulomb level as fitted alone, else a guess
    stiffness: float  # N m/rad of the shaft; nan where the model has one mass
    resonance: float  # rad/s of the model's fastest pole pair; nan where it has none
    two_masses: bool
    integral: float  # N m, largest torque: no integrator state is larger
    blocks: int = 1  # samples of the log in one of dt: a long record is searched on a coarser grid first
    period_seen: bool = False  # the period was estimated from the records; a fit may change it

    @property
    def log_dt(self) -> float:
        """Sample time of the log [s]: what the bounds of delays and lags are made of."""
        return self.dt / self.blocks


@dataclass(frozen=True, eq=False)
class Term:
    """One effect as the fit sees it.

    natural: coordinates (n, k) -> parameters (n, m) in the order of the effects table; coordinates: its inverse for one vector.
    limits, starts: bounds (k pairs) and start rows for given scales.
    steps: of each coordinate, a change that matters.
    0 where a search chooses it, not a slope (an order, of a period that is known).
    nested: names of simpler effects that this one contains.
    family: of effects that exclude each other in one model, but for a steep drag beside friction with a level; "" for none.
    excludes: names of other effects that cannot be in the same model.
    beside: names of effects of which one must be in the model, because this one depends on its torque; empty where none must.
    """

    name: str
    place: str
    natural: Natural
    coordinates: Callable[[Mapping[str, float]], Vector]
    limits: Callable[[Scales], Rows]
    starts: Callable[[Scales], Rows]
    steps: Callable[[Scales], tuple[float, ...]]
    nested: tuple[str, ...] = ()
    shared: Mapping[str, tuple[int, ...]] = field(default_factory=dict)  # nested effect -> its coordinates here; else the first
    family: str = ""
    excludes: frozenset[str] = frozenset()
    beside: frozenset[str] = frozenset()
    harmonic: str = (
        ""  # of "torque", "friction", "inertia" or "velocity": phase and size follow from two columns per order of the angle
    )
    in_time: bool = False  # a sine of the time: phase and size follow from two columns per frequency
    least: float = 0.0  # of its first parameter: what is less is no cause
    components: int = 0  # the first of the two coordinates that these columns belong to
    waves: int = 1  # how many it has, of as many at most: their coordinates stand one behind the other
    most_waves: int = 1
    orders: tuple[int, int] = (1, 1)  # lowest and highest order of a harmonic, or the number of frequencies of a sine of the time
    neutral: Callable[[float, Scales], tuple[float, ...]] | None = None  # the nested effect of this level as this one
    from_nothing: bool = False  # its first parameter is its size: at 0 there is no effect
    proportional: bool = False  # its torque is proportional to its one coordinate
    multimodal: bool = False  # one stop or impact more makes another local minimum: fitted in the loop first, searched globally
    domains: frozenset[str] = frozenset()  # signals whose free function imitates it
    levels: bool = False  # its first coordinate is the level of dry friction
    steep: bool = False  # a drag that rises more steeply from rest than in proportion to the velocity
    bends: bool = False  # its torque does so, or falls from rest and rises again: it bends over the velocity
    time_varying: bool = False  # its size changes in the course of a record: a mean over the record is none of its parameters
    at_peaks: bool = False  # it acts at the largest torques only
    smooth: bool = True  # what it makes of a small change is small; a function of the user's may round, or jump at a threshold
    late: bool = False  # it makes the measured velocity late, which a logged angle shows
    resonates: bool = False  # a pair of poles and zeros in series with the mechanism, equivalent to a second mass
    later: Callable[[Matrix, float], Matrix] | None = (
        None  # of the time: natural parameters in a record that begins so much later
    )
    poles: Callable[[Vector], tuple[complex, ...]] | None = None  # poles in series [rad/s] of natural parameters
    seen_angle: Callable[[Vector, Vector, Vector], Vector] | None = None  # (seen angle, velocity, parameters) -> true angle
    limiting: Callable[[Vector], Limiting] | None = None  # what an effect in the controller limits there
    other_side: str = ""  # name of the same effect at the other end of the shaft
    at_load: bool = False  # of two masses: it acts there
    curve: Callable[[Vector, Mapping[str, float]], Vector] | None = None  # static torque at velocities [rad/s], as friction
    scales: Mapping[str, float] = field(default_factory=dict)  # parameter whose 0 is nothing special -> what is much for it

    def stands_with(self, effects: Iterable[str]) -> bool:
        """Whether a model with these effects contains what its torque depends on."""
        return not self.beside or not self.beside.isdisjoint(effects)

    def excluded_in(self, there: Iterable[Term], shown: Collection[str] = ()) -> bool:
        """Whether a model with these effects contains another of its family that takes its place.

        shown: effects that the records show without a model.
        Such a drag stands beside dry friction: one has no level, the other no course over the velocity.
        Else what a friction lacks near rest would pass for a drag.
        """
        others = [t for t in there if self.family and t.family == self.family]
        return any(not (t.steep ^ self.steep and {t.name, self.name} & {*shown}) for t in others)

    @cached_property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.limits(_UNIT))

    @property
    def simplest(self) -> bool:
        """Whether all others of its family contain it."""
        return bool(self.family) and not self.nested

    @property
    def search_cost(self) -> float:
        """2 ln m, what it costs in BIC units to have chosen the best one of m orders or frequencies; 0 without a choice.

        The extended BIC of Chen and Chen (2008, Biometrika 95, 759) with gamma = 1, m the number of models of this size that were
        tried: chance alone makes the best of m candidates better by x with at most m times the probability of one.
        Of several waves each order was chosen.
        """
        return 2.0 * self.waves * float(np.log(self.orders[1] - self.orders[0] + 1))

    @property
    def in_controller(self) -> bool:
        """Whether it changes what the controller makes of command and velocity."""
        return self.place == "controller"

    @property
    def replayable(self) -> bool:
        """Whether a replay of the controller contains it; a user-defined effect there acts in the simulated loop alone."""
        return self.limiting is not None

    @property
    def impacts(self) -> bool:
        """Whether masses hit each other through it: a gap, or a coupling that is hard somewhere."""
        return self.multimodal and self.in_coupling

    @property
    def in_series(self) -> bool:
        """Whether it is linear: a delay, a lag, a filter or a resonance between the torque and the measured velocity."""
        return self.place in IN_SERIES and not (self.domains or self.harmonic)

    @property
    def turns_with_the_shaft(self) -> bool:
        """Whether its torque is a harmonic of the angle."""
        return self.harmonic in ("torque", "friction", "inertia")

    @property
    def chooses_order(self) -> bool:
        """Whether it is a harmonic whose order is one of its numbers, the last of its coordinates, or of those of each wave."""
        return bool(self.harmonic) and self.orders[1] > self.orders[0]

    def orders_in(self, z: Vector) -> Vector:
        """The order of each wave, where it chooses them; z: its coordinates."""
        return z.reshape(self.waves, -1)[:, -1]

    def strongest_first(self, values: Vector) -> NDArray[np.intp]:
        """The places of its parameters, the waves from the strongest on; of one wave as they are."""
        waves = values.reshape(self.waves, -1)
        order = np.argsort(-waves[:, 0], kind="stable")
        return np.arange(len(values)).reshape(waves.shape)[order].ravel()

    @property
    def in_coupling(self) -> bool:
        """Whether it acts between two masses."""
        return self.place == "coupling"

    @property
    def needs_two_masses(self) -> bool:
        """Whether only a model of two masses may have it."""
        return self.in_coupling or self.at_load


def limiting_of(effects: Mapping[Term, Vector]) -> Limiting:
    """What all effects at the controller limit, each with its parameters."""
    also = Limiting()
    for term, values in effects.items():
        assert term.limiting is not None
        also = also.and_also(term.limiting(values))
    return also


_UNIT = Scales(1e-3, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 100.0, True, 1.0)
