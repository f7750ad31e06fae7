"""The parameters of an extended model as one vector, and back.

    one mass   x = [ln |K|, a | effects | start states]                  G(s) = K / (s + a)
    two masses x = [ln |K|, a, e1, e0, f1, f0 | effects | start states]  G(s) = K (s^2 + f1 s + f0) / ((s + a) (s^2 + e1 s + e0))

a, e1, e0, f1, f0 in units of their own size, so that a step of 1 is large and one of 1e-4 small for every entry. Pairs pass
smoothly from complex to real roots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.candidates import CANDIDATES, Scales
from gaident.models.effects import place_of, table
from gaident.models.factors import Structure
from gaident.models.model import Model
from gaident.models.roots import quadratic_roots

__all__ = [
    "Layout",
    "as_two_masses",
    "described",
    "evenly_damped",
    "is_mechanism",
    "mechanism",
    "parameter_names",
    "swings",
    "two_masses",
]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def parameter_names(effect: str) -> tuple[str, ...]:
    """Names of an effect's parameters, in the order of the effects table."""
    return next(tuple(p.name for p in row.parameters) for row in table() if row.name == effect)


def mechanism(model: Model) -> Vector:
    """[K, a] or [K, a, e1, e0, f1, f0] of a model of structure (1, 0) or (1, 2); of three real poles the slowest is a."""
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
    if len(values) == 2:
        return replace(scales, two_masses=False)
    K, a, e1, e0, _, f0 = values
    JM = 1.0 / abs(K)
    # sum of pairwise A = K_G (1/J_M + 1/J_L) and prod B = K_G/J_L, dampings left out
    load = max(e0 + a * e1 - f0, 1e-3 * abs(e0))
    KG = JM * load
    return replace(scales, two_masses=True, stiffness=KG, resonance=float(np.sqrt(abs(e0))))


@dataclass(frozen=True)
class Layout:
    """What the entries of x mean.

    masses: 1 or 2. sign: of K. units: size of a, e1, ...; starts: start states of each record (0: it starts at rest). looped: the
    command drives the model through the controller, instead of the torque: what happens in a gap is so sensitive to its start
    that without the loop's grip a simulation loses its way, at the truth too.
    """

    masses: int
    sign: float
    units: tuple[float, ...]
    effects: tuple[str, ...]
    starts: tuple[int, ...]
    scales: Scales
    looped: bool = False
    own_angle: bool = False

    @classmethod
    def of(cls, model: Model, scales: Scales, moving: Sequence[bool], looped: bool = False) -> Layout:
        """The layout of a linear model of one or two masses (effects are added by `extended`)."""
        values = mechanism(model)
        floor = 2.0 / scales.duration
        units = [max(abs(values[1]), floor)]
        for _, e0 in values[2:].reshape(-1, 2):
            w = max(np.sqrt(abs(e0)), floor)
            units += [w, w * w]
        masses = 1 if len(values) == 2 else 2
        starts = tuple((1, 3)[masses - 1] if m else 0 for m in moving)
        return cls(masses, float(np.sign(values[0])), tuple(float(u) for u in units), (), starts, scales, looped)

    def extended(self, effect: str) -> Layout:
        """With one effect more, behind the others."""
        return replace(self, effects=(*self.effects, effect))

    def without(self, effect: str) -> Layout:
        """With one effect less."""
        return replace(self, effects=tuple(e for e in self.effects if e != effect))

    @property
    def structure(self) -> Structure:
        """The linear part as the core takes it: one real pole, and a pair of poles and of zeros for two masses."""
        return Structure(1, 0, 0, 0) if self.masses == 1 else Structure(1, 1, 0, 1)

    @property
    def base(self) -> int:
        """Number of base parameters, which come first."""
        return 1 + len(self.units)

    @cached_property
    def size(self) -> int:
        """Length of x."""
        return self.base + sum(CANDIDATES[e].size for e in self.effects) + sum(self.starts)

    @cached_property
    def _slots(self) -> dict[str, slice]:
        slots, at = {}, self.base
        for e in self.effects:
            slots[e] = slice(at, at + CANDIDATES[e].size)
            at = slots[e].stop
        return slots

    @cached_property
    def _ordered(self) -> tuple[str, ...]:
        return tuple(sorted(self.effects, key=place_of))

    def slot(self, effect: str) -> slice:
        """Where an effect's coordinates stand."""
        return self._slots[effect]

    def base_vector(self, model: Model) -> Vector:
        """x of the base parameters of a model of this structure."""
        values = mechanism(model)
        return np.concatenate([[np.log(abs(values[0]))], values[1:] / np.array(self.units)])

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
        values[:, 0] = self.sign * np.exp(np.clip(X[:, 0], -300.0, 300.0))
        values[:, 1:] = X[:, 1 : self.base] * np.array(self.units)
        return values

    def effect_values(self, X: Matrix, effect: str) -> Matrix:
        """Rows of an effect's parameters, in the order of the effects table."""
        return CANDIDATES[effect].natural(X[:, self.slot(effect)])

    def values(self, X: Matrix, left_out: Sequence[str] = ()) -> tuple[tuple[str, ...], Matrix]:
        """(effects in the order of the table, rows of base parameters and theirs) for `simulate_values`."""
        names = tuple(e for e in self._ordered if e not in left_out)
        return names, np.hstack([self.base_values(X), *(self.effect_values(X, e) for e in names)])

    def start_values(self, X: Matrix, record: int) -> Matrix | None:
        """Rows of start states of one record, None where it starts at rest."""
        n = self.starts[record]
        if n == 0:
            return None
        first = self.size - sum(self.starts) + sum(self.starts[:record])
        own = X[:, first : first + n]
        if "extra_resonance" not in self.effects:
            return own
        # In the difference operator d the free motion is S(d)/A(d) = S(d) B(d)/(A(d) B(d)): the same motion, B unexcited.
        rows = []
        for s, (wp, zp, *_) in zip(own, self.effect_values(X, "extra_resonance"), strict=True):
            roots = np.expm1(np.array(quadratic_roots(2.0 * zp * wp, wp * wp)) * self.scales.dt)
            rows.append(np.convolve(s, np.poly(roots).real))
        return np.array(rows)

    def model(self, x: Vector) -> Model:
        """The model of one x, with its effects."""
        values = self.base_values(x[None, :])[0]
        poles = [complex(-values[1])]
        zeros: list[complex] = []
        if self.masses == 2:
            poles += quadratic_roots(float(values[2]), float(values[3]))
            zeros += quadratic_roots(float(values[4]), float(values[5]))
        model = Model(float(values[0]), poles, zeros)
        for e in self.effects:
            row = self.effect_values(x[None, :], e)[0]
            model = model.with_effect(e, **dict(zip(parameter_names(e), (float(v) for v in row), strict=True)))
        return model

    def limits(self) -> Matrix:
        """Lowest and highest value of each entry, (2, size)."""
        rows: list[tuple[float, ...]] = [(-np.inf, np.inf)] * self.base
        for e in self.effects:
            rows += CANDIDATES[e].limits(self.scales)
        rows += [(-np.inf, np.inf)] * sum(self.starts)
        return np.array(rows).T

    def steps(self) -> Vector:
        """What counts as a large change of each entry; 0: not moved by a fit."""
        rows = [1.0] * self.base
        for e in self.effects:
            rows += CANDIDATES[e].steps(self.scales)
        rows += [0.05 * self.scales.speed] * sum(self.starts)
        return np.array(rows)


def two_masses(layout: Layout, x: Vector) -> Model:
    """The drive of two masses whose resonance is the extra one of x: K (wp/wz)^2 (s^2 + ...)/((s + a)(s^2 + ...)).

    On one mass the extra resonance is the second mass; on two it takes the place of theirs, K f0/e0 the gain of the whole.
    """
    K, a, *pairs = layout.base_values(x[None, :])[0]
    if pairs:
        K *= pairs[3] / pairs[1]
    wp, zp, wz, zz = layout.effect_values(x[None, :], "extra_resonance")[0]
    poles = [complex(-a), *quadratic_roots(2.0 * zp * wp, wp**2)]
    return Model(K * (wp / wz) ** 2, poles, quadratic_roots(2.0 * zz * wz, wz**2))


def as_two_masses(layout: Layout, x: Vector) -> tuple[Layout, Vector]:
    """The drive of two masses whose resonance is the extra one of x, with the other effects; start states at 0."""
    model = two_masses(layout, x)
    longer = Layout.of(model, described(layout.scales, model), [n > 0 for n in layout.starts], layout.looped)
    y = longer.base_vector(model)
    for e in layout.effects:
        if e != "extra_resonance":
            longer = longer.extended(e)
            y = np.concatenate([y, x[layout.slot(e)]])
    return longer, np.concatenate([y, np.zeros(sum(longer.starts))])


def evenly_damped(layout: Layout, x: Vector) -> Vector:
    """Two masses with the damping of the zeros that the rest implies: f1 = a + (e1 - a) f0/e0.

    With bearings in proportion to the inertias, D_M/J_M = D_L/J_L = a, the shaft's damping D_G makes

        e1 = a + D_G (1/J_M + 1/J_L),   f1 = a + D_G/J_L,   f0/e0 = J_M/(J_M + J_L)

    A linear fit of a shaft with a gap damps the zeros instead, as if bearings of the load braked and those of the motor drove it.
    A gap put into such a mechanism makes it no better, whatever its width; in a passive one the cost has one broad valley.
    """
    _, a, e1, e0, _, f0 = layout.base_values(x[None, :])[0]
    if not 0.0 < f0 < e0:
        return x
    even = x.copy()
    even[4] = (a + (e1 - a) * f0 / e0) / layout.units[3]
    return even


def is_mechanism(layout: Layout, x: Vector) -> bool:
    """Whether two masses are two masses on a shaft: sum of pairwise A = K_G (1/J_M + 1/J_L) is above prod B = K_G/J_L."""
    if layout.masses == 1:
        return True
    _, a, e1, e0, _, f0 = layout.base_values(x[None, :])[0]
    return bool(e0 + a * e1 > f0)


def swings(layout: Layout, x: Vector) -> bool:
    """Whether two masses are damped as those on a shaft: e1 < 2 zeta sqrt(e0), f1 < 2 zeta sqrt(f0), zeta = 0.5."""
    if layout.masses == 1:
        return True
    _, _, e1, e0, f1, f0 = layout.base_values(x[None, :])[0]
    return bool(e0 > 0.0 and f0 > 0.0 and abs(e1) < np.sqrt(e0) and abs(f1) < np.sqrt(f0))
