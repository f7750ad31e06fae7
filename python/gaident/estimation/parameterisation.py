"""The parameters of an extended model as one vector, and back.

    one mass      x = [ln K, a | effects | start states]                  G(s) = K / (s + a)
    on a spring       [ln K, a, c | effects | start states]               G(s) = K s / (s^2 + a s + c)
    two masses        [ln K, a, e1, e0, f1, f0 | effects | start states]  G(s) = K (s^2 + f1 s + f0) / ((s + a) (s^2 + e1 s + e0))

K = 1/J is positive by construction: whatever the start, no fit can end at a negative inertia.
Below its resonance an axis on a spring or under gravity responds as if its inertia were negative.
c = k/J, k the stiffness of a spring between the axis and the ground.
a, c, e1, e0, f1, f0 are in units of their own size: for every entry a step of 1 is large and one of 1e-4 is small.
Pairs pass smoothly from complex to real roots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.term import Scales, Term
from gaident.models.effect_rows import core_key, effect_and_side
from gaident.models.effects import parameter_count, place_of, row_of
from gaident.models.factors import FactorCounts
from gaident.models.model import Model
from gaident.models.roots import quadratic_roots

__all__ = ["Parameterisation", "mechanism", "parameter_names"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def parameter_names(term: Term) -> tuple[str, ...]:
    """Names of an effect's parameters, in the order of the effects table, one wave's after the other's."""
    return tuple(p.name for p in row_of(term.name).of_waves(term.waves).parameters)


def mechanism(model: Model) -> Vector:
    """[K, a], [K, a, c] or [K, a, e1, e0, f1, f0] of a model of structure (1, 0), (1, 1) with a zero at 0, or (1, 2).

    Of three real poles the slowest is a.
    """
    if model.q == 1:
        one, other = model.poles
        return np.array([model.gain, -(one + other).real, (one * other).real])
    poles = sorted(model.poles, key=lambda r: (r.imag != 0.0, abs(r)))
    a, rest = -poles[0].real, poles[1:]
    values = [model.gain, a]
    for pair in (rest, model.zeros):
        if pair:
            values += [-(pair[0] + pair[1]).real, (pair[0] * pair[1]).real]
    return np.array(values)


def described(scales: Scales, model: Model) -> Scales:
    """Scales with what the mechanism of a model says."""
    values = mechanism(model)
    if len(values) < 6:  # no decision: how many numbers a mechanism has
        return replace(scales, two_masses=False)
    K, a, e1, e0, _, f0 = values
    JM = 1.0 / abs(K)
    # sum of pairwise A = K_G (1/J_M + 1/J_L) and prod B = K_G/J_L, dampings left out
    load = max(e0 + a * e1 - f0, 1e-3 * abs(e0))  # no decision: a unit: a scale
    KG = JM * load
    return replace(scales, two_masses=True, stiffness=KG, resonance=float(np.sqrt(abs(e0))))


@dataclass(frozen=True)
class Parameterisation:
    """What the entries of x mean.

    masses: 1 or 2. units: size of a, c or e1, ...; starts: start states of each record (0: it starts at rest).
    begun: velocity [rad/s] from which the first of these states counts, of each window of a record; empty: 0 of all.
    """

    masses: int
    units: tuple[float, ...]
    terms: tuple[Term, ...]
    starts: tuple[int, ...]
    scales: Scales
    begun: tuple[float, ...] = ()

    @classmethod
    def of(cls, model: Model, scales: Scales, moving: Sequence[bool], begun: Sequence[float] = ()) -> Parameterisation:
        """That of a linear model of one mass, one mass on a spring, or two (effects are added by `extended`).

        Its scales are the given ones with the values of the model's mechanism.
        """
        values = mechanism(model)
        floor = 2.0 / scales.duration  # no decision: a unit: a scale
        units = [max(abs(values[1]), floor)]
        if len(values) == 3:  # no decision: how many numbers a mechanism has
            units.append(max(abs(values[2]), floor**2))
        for _, e0 in values[2:].reshape(-1, 2) if len(values) > 3 else ():  # no decision: how many
            w = max(np.sqrt(abs(e0)), floor)
            units += [w, w * w]
        masses = 2 if len(values) > 3 else 1  # no decision: how many numbers a mechanism has
        starts = tuple(model.order if m else 0 for m in moving)
        return cls(masses, tuple(float(u) for u in units), (), starts, described(scales, model), tuple(begun))

    @property
    def on_a_spring(self) -> bool:
        """Whether a spring is between the one mass and the ground."""
        return len(self.units) == 2

    @property
    def kind(self) -> str:
        """The mechanism in words; two fits of the same kind have the same base parameters."""
        return "two masses" if self.masses == 2 else "one mass on a spring" if self.on_a_spring else "one mass"

    @cached_property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects, in the order in which they were added."""
        return tuple(t.name for t in self.terms)

    def extended(self, term: Term) -> Parameterisation:
        """With one effect more, behind the others."""
        return replace(self, terms=(*self.terms, term))

    def without(self, effect: str) -> Parameterisation:
        """With one effect less."""
        return replace(self, terms=tuple(t for t in self.terms if t.name != effect))

    def term(self, effect: str) -> Term:
        """The term of one of the effects."""
        return next(t for t in self.terms if t.name == effect)

    @property
    def structure(self) -> FactorCounts:
        """The linear part as the core takes it: one real pole, and a pair of poles and of zeros for two masses; a spring makes
        it a pair of poles, and a zero at 0."""
        if self.on_a_spring:
            return FactorCounts(0, 1, 1, 0)
        return FactorCounts(1, 0, 0, 0) if self.masses == 1 else FactorCounts(1, 1, 0, 1)

    @property
    def base(self) -> int:
        """Number of base parameters, which come first."""
        return 1 + len(self.units)

    @cached_property
    def size(self) -> int:
        """Length of x."""
        return self.base + sum(t.size for t in self.terms) + sum(self.starts)

    @cached_property
    def _slots(self) -> dict[str, slice]:
        slots, at = {}, self.base
        for t in self.terms:
            slots[t.name] = slice(at, at + t.size)
            at = slots[t.name].stop
        return slots

    @cached_property
    def _ordered(self) -> tuple[Term, ...]:
        return tuple(sorted(self.terms, key=lambda t: place_of(t.name)))

    @cached_property
    def _units(self) -> Vector:
        return np.array(self.units)

    def slot(self, effect: str) -> slice:
        """Where an effect's coordinates stand."""
        return self._slots[effect]

    def base_vector(self, model: Model) -> Vector:
        """x of the base parameters of a model of this structure."""
        values = mechanism(model)
        return np.concatenate([[np.log(abs(values[0]))], values[1:] / np.array(self.units)])

    def start(self, model: Model) -> Vector:
        """x of a linear model that starts at rest; without effects."""
        return np.concatenate([self.base_vector(model), np.zeros(sum(self.starts))])

    def inserted(self, x: Vector, z: Vector) -> Vector:
        """x of `extended(...)`: the coordinates z go before the start states."""
        at = len(x) - sum(self.starts)
        return np.concatenate([x[:at], z, x[at:]])

    def removed(self, x: Vector, effect: str) -> Vector:
        """x of `without(effect)`."""
        s = self.slot(effect)
        return np.concatenate([x[: s.start], x[s.stop :]])

    def base_values(self, X: Matrix) -> Matrix:
        """Rows [K, a, ...] of rows of x."""
        values = np.empty((len(X), self.base))
        values[:, 0] = np.exp(np.minimum(np.maximum(X[:, 0], -300.0), 300.0))  # no decision: rounding: what a double can be
        np.multiply(X[:, 1 : self.base], self._units, out=values[:, 1:])
        return values

    def inertias(self, X: Matrix) -> Vector:
        """Inertia of the whole axis of each row of x [kg m^2]: 1/K, of two masses with the shaft locked."""
        values = self.base_values(X)
        gain = np.abs(values[:, 0])
        if self.masses == 2:
            gain = gain * np.abs(values[:, 5]) / np.maximum(np.abs(values[:, 3]), 1e-300)
        return np.asarray(1.0 / np.maximum(gain, 1e-300))

    def effect_values(self, X: Matrix, effect: str) -> Matrix:
        """Rows of an effect's parameters, in the order of the effects table."""
        return self.term(effect).natural(X[:, self.slot(effect)])

    def values(self, X: Matrix, left_out: Sequence[str] = (), began: float = 0.0) -> tuple[tuple[str, ...], Matrix]:
        """(effects in the order of the table, by the core's names, rows of base parameters and theirs) for `simulate_values`.

        began: when a window of a record begins [s], from which the core counts the time.
        """
        shown = [t for t in self._ordered if t.name not in left_out]
        if not shown and not self.on_a_spring:
            return (), self.base_values(X)
        zero = [np.zeros((len(X), 1))] if self.on_a_spring else []
        parts = [self.base_values(X), *zero, *(_of_core(t, _from(t, t.natural(X[:, self.slot(t.name)]), began)) for t in shown)]
        return tuple(t.name if t.waves == 1 else core_key(t.name) for t in shown), np.concatenate(parts, axis=1)

    def start_values(self, X: Matrix, record: int) -> Matrix | None:
        """Rows of start states of one record, None where it starts at rest."""
        n = self.starts[record]
        if n == 0:
            return None
        first = self.size - sum(self.starts) + sum(self.starts[:record])
        own = X[:, first : first + n]
        if self.begun:
            own = own + self.begun[record] * np.eye(n)[0]
        for t in self.terms:
            if t.poles is None:
                continue
            # In the difference operator d the free motion is S(d)/A(d) = S(d) B(d)/(A(d) B(d)): the same motion, B unexcited.
            values = t.natural(X[:, self.slot(t.name)])
            roots = [np.expm1(np.array(t.poles(row)) * self.scales.dt) for row in values]
            own = np.array([np.convolve(s, np.poly(r).real) for s, r in zip(own, roots, strict=True)])
        return own

    def standing(self, count: int, stored: float) -> Matrix | None:
        """So many rows of start states in a loop whose integral is a torque [N m] at standstill; None where it is 0."""
        if stored == 0.0:
            return None
        s = self.structure
        own = s.real_poles + 2 * s.pole_pairs + sum(2 for t in self.terms if t.poles is not None)
        return np.concatenate([np.zeros((count, own)), np.full((count, 1), stored)], axis=1)

    def linear(self, x: Vector) -> Model:
        """The linear mechanism of one x."""
        values = self.base_values(x[None, :])[0]
        if self.on_a_spring:
            return Model(float(values[0]), quadratic_roots(float(values[1]), float(values[2])), [0.0])
        poles = [complex(-values[1])]
        zeros: list[complex] = []
        if self.masses == 2:
            poles += quadratic_roots(float(values[2]), float(values[3]))
            zeros += quadratic_roots(float(values[4]), float(values[5]))
        return Model(float(values[0]), poles, zeros)

    def model(self, x: Vector) -> Model:
        """The model of one x, with its effects, the waves of each from the strongest on."""
        model = self.linear(x)
        for t in self.terms:
            row = t.natural(x[None, self.slot(t.name)])[0]
            row = row[t.strongest_first(row)]
            name, side = effect_and_side(t.name)
            values = dict(zip(parameter_names(t), (float(v) for v in row), strict=True))
            model = model.with_effect(name, side=side, **values)
        return model

    def limits(self) -> Matrix:
        """Lowest and highest value of each entry, (2, size), not to be written to."""
        return self._limits

    def steps(self) -> Vector:
        """What counts as a large change of each entry, not to be written to; 0: not moved by a fit."""
        return self._steps

    @cached_property
    def _limits(self) -> Matrix:
        rows: list[tuple[float, ...]] = [(-np.inf, np.inf)] * self.base
        for t in self.terms:
            rows += t.limits(self.scales)
        rows += [(-np.inf, np.inf)] * sum(self.starts)
        return _frozen(np.array(rows).T)

    @cached_property
    def _steps(self) -> Vector:
        rows = [1.0] * self.base
        for t in self.terms:
            rows += t.steps(self.scales)
        rows += [0.05 * self.scales.speed] * sum(self.starts)
        return _frozen(np.array(rows))


def _from(term: Term, rows: Matrix, began: float) -> Matrix:
    """Rows of parameters of an effect, as they are from another time on [s]."""
    return rows if began == 0.0 or term.later is None else term.later(rows, began)


def _of_core(term: Term, rows: Matrix) -> Matrix:
    """Rows of parameters as the core takes them: of several waves all that the effect can have, 0 for those that it has not."""
    if term.waves == 1:
        return rows
    return np.pad(rows, ((0, 0), (0, parameter_count(core_key(term.name)) - rows.shape[1])))


def _frozen(values: Matrix) -> Matrix:
    values.flags.writeable = False
    return values
