"""A library with rows that are made: of user-defined effects, from their parameters alone, and of shaft effects at the load."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.cause import Cause
from gaident.diagnosis.library.sides import at_load, at_motor, name_of
from gaident.diagnosis.library.triggers import in_a_loop
from gaident.models.effects import Row, table
from gaident.models.own_effects import starts
from gaident.policy.table import POLICY

__all__ = ["Library"]

Matrix = NDArray[np.float64]

STEP_OF_RANGE = 0.05  # no decision: of the range between the bounds: what makes a difference


class Library(Mapping[str, Cause]):
    """The built-in terms, and behind them those of the user-defined effects that are registered now.

    Those at the load are made where they are asked for by key, and are not iterated over: a search comes to them from the motor's
    side.
    """

    def __init__(self, built_in: Mapping[str, Cause]) -> None:
        self._built_in = {name: at_motor(row) for name, row in built_in.items()}
        self._own: dict[str, tuple[Row, Cause]] = {}
        self._at_load: dict[str, Cause] = {}

    def __getitem__(self, effect: str) -> Cause:
        if effect in self._built_in:
            return self._built_in[effect]
        if effect in self._at_load:
            return self._at_load[effect]
        name = name_of(effect)
        if name in self._built_in and self._built_in[name].other_side == effect:
            return self._at_load.setdefault(effect, at_load(self._built_in[name], self._linear()))
        row = next((row for row in table() if row.own and row.name == name), None)
        if row is None:
            raise KeyError(effect)
        known = self._own.get(effect)
        if known is None or known[0] is not row:
            known = self._own[effect] = (row, self._term_of(row, effect))
        return known[1]

    def _term_of(self, row: Row, effect: str) -> Cause:
        """Of a user-defined effect at the motor, or under its key there at the load."""
        cause = at_motor(_term(row))
        if effect == row.name:
            return cause
        if effect != cause.other_side:
            raise KeyError(effect)
        return at_load(cause, self._linear())

    def _linear(self) -> frozenset[str]:
        """What changes the mechanism linearly: no effect at the load goes together with it."""
        return frozenset(t.name for t in self._built_in.values() if t.resonates)

    def __iter__(self) -> Iterator[str]:
        yield from self._built_in
        yield from (row.name for row in table() if row.own)

    def __len__(self) -> int:
        return sum(1 for _ in self)


def _term(row: Row) -> Cause:
    logs = [i for i, p in enumerate(row.parameters) if p.logarithmic]

    def natural(z: Matrix) -> Matrix:
        out = z.copy()
        out[:, logs] = np.exp(z[:, logs])
        return out

    def coordinates(p: Mapping[str, float]) -> NDArray[np.float64]:
        z = np.array([p[q.name] for q in row.parameters])
        z[logs] = np.log(np.maximum(z[logs], 1e-300))
        return z

    def along(i: int, value: float) -> float:
        return float(np.log(value)) if i in logs else value

    limits = [(along(i, p.lowest), along(i, p.highest)) for i, p in enumerate(row.parameters)]
    # Fewer values of each parameter, the more there are.
    count = next(n for n in range(POLICY.own_values, 0, -1) if n ** len(row.parameters) <= POLICY.own_starts or n == 1)
    axes = [[along(i, v) for v in starts(p, count)] for i, p in enumerate(row.parameters)]
    rows = list(itertools.islice(itertools.product(*axes), POLICY.own_starts))
    steps = tuple(1.0 if p.logarithmic else STEP_OF_RANGE * (p.highest - p.lowest) for p in row.parameters)

    return Cause(
        row.name,
        row.place,
        natural,
        coordinates,
        lambda scales: list(limits),
        lambda scales: list(rows),
        lambda scales: steps,
        needs=(in_a_loop,) if row.place == "controller" else (),
        smooth=False,
    )
