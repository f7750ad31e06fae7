"""Many models against one record at once, side by side in the core."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gaident import _core
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.data.windows.window import began
from gaident.errors import GaidentError, ModelError
from gaident.models.discrete import require_strictly_proper
from gaident.models.effect_rows import effect_and_side, key_of
from gaident.models.effects import parameter_count
from gaident.models.factors import FactorCounts
from gaident.models.model import Model
from gaident.models.own_effects import OWN
from gaident.models.simulation_input import (
    AnyModel,
    Signal,
    check_start,
    check_workers,
    checked_substeps,
    core_record,
    input_for,
    input_of,
    models_of,
    states_of,
)

OwnList = list[tuple[str, Callable[..., Any], Signal]]


def simulate_many(
    models: Sequence[AnyModel],
    rec: Record,
    controller: Controller | None = None,
    *,
    initial_states: ArrayLike | None = None,
    substeps: int | None = None,
    workers: int = 1,
) -> Signal:
    """Return the velocities of many models for one record.

    Each row is what `simulate` gives for its model; models of one structure with the same effects run side by side.

    Parameters
    ----------
    models : sequence of Model, OneMass or TwoMass
        The drives.
    rec : Record
        With a controller its command drives the loop, without one its torque drives the models.
    controller : PI or Cascade, optional
        The velocity loop; None: open loop.
    initial_states : array_like, shape (len(models), states), optional
        See `run`; then all models have the same number of states. None: at rest.
    substeps : int, optional
        See `run`.
    workers : int
        Threads; the result does not depend on it.

    Returns
    -------
    ndarray, shape (len(models), len(rec))
        Velocities [rad/s].

    Raises
    ------
    RecordError, ModelError
        As `run`.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> rec = ga.Record(1e-3, torque=np.full(100, 0.2), velocity=np.zeros(100))
    >>> ga.simulate_many([ga.OneMass(J, 0.0) for J in (1e-3, 2e-3)], rec)[:, -1].round(6).tolist()
    [19.8, 9.9]
    """
    plants = models_of(models)
    check_workers(workers)
    source, starts = None, np.zeros((0, 0))
    for structure in {(plant.p, plant.q): plant for plant in plants}.values():
        source, _ = input_of(structure, rec, controller)
    if source is None:
        return np.zeros((0, len(rec)))
    if initial_states is not None:
        starts = states_of(initial_states, "initial_states")
        if starts.ndim != 2 or len(starts) != len(plants):
            raise ModelError(f"initial_states has the shape {starts.shape}: give one row per model, {len(plants)}")
        for i, plant in enumerate(plants):
            check_start(plant, controller, starts[i], "command" if controller is not None else "torque")
    record = core_record(rec, source, controller, float(source[0]) if controller is None and starts.size else 0.0)
    return simulated_with_effects(record, plants, starts, checked_substeps(substeps), workers, False)[0]


def simulate_values(
    structure: FactorCounts,
    effects: Sequence[str],
    values: ArrayLike,
    rec: Record,
    controller: Controller | None = None,
    *,
    initial_states: ArrayLike | None = None,
    substeps: int | None = None,
    workers: int = 1,
) -> Signal:
    """Return the velocities of models given as numbers: the inner loop of a fit.

    Values are not checked against their bounds: what makes no drive gives undefined numbers.

    Parameters
    ----------
    structure : FactorCounts
        That of the linear part.
    effects : sequence of str
        Names of effects, with "@load" behind those at the load.
    values : array_like, shape (m, k)
        A row per model: the natural parameters of the linear part in the order of `factor_parameters`, then those of each effect
        named, in the order of `gaident.effects.table()`.
    rec, controller, initial_states, substeps, workers
        As `simulate_many` takes them.

    Returns
    -------
    ndarray, shape (m, len(rec))
        Velocities [rad/s].

    Raises
    ------
    ModelError
        For a wrong shape or unknown names.
    """
    source, _ = input_for(structure.p, rec, controller)
    loaded = LoadedRecord.of(rec, controller, 0.0 if controller is not None or initial_states is None else float(source[0]))
    return loaded.velocities(structure, effects, values, initial_states=initial_states, substeps=substeps, workers=workers)


@dataclass(frozen=True, eq=False)
class LoadedRecord:
    """A record and its loop as the core takes them: made once for all simulations of a fit. before: as in `core_record`."""

    core: _core.EffectRecord
    rec: Record
    controller: Controller | None
    before: float

    @classmethod
    def of(cls, rec: Record, controller: Controller | None, before: float = 0.0) -> LoadedRecord:
        """Of a record that has what drives the loop; RecordError else. before: as in `core_record`."""
        source, _ = input_for(1, rec, controller)
        return cls(core_record(rec, source, controller, before), rec, controller, before)

    def turned(self, angle: Signal) -> LoadedRecord:
        """The same with another angle [rad] (n,)."""
        source, _ = input_for(1, self.rec, self.controller)
        return replace(self, core=core_record(self.rec, source, self.controller, self.before, angle))

    def velocities(
        self,
        structure: FactorCounts,
        effects: Sequence[str],
        values: ArrayLike,
        *,
        initial_states: ArrayLike | None = None,
        substeps: int | None = None,
        workers: int = 1,
        shown: str = "velocity",
    ) -> Signal:
        """As `simulate_values` gives them; shown: as the core has it, also the load's motion."""
        require_strictly_proper(structure.p, self.controller)
        table = np.ascontiguousarray(values, dtype=np.float64)
        starts = np.zeros((0, 0)) if initial_states is None else np.ascontiguousarray(initial_states, dtype=np.float64)
        built_in, own = _parted(structure, effects, table)
        if start := began(self.rec):
            own = [(acts, partial(_asked_later, ask, start), rows) for acts, ask, rows in own]
        names = [e for e in effects if not _is_own(e)]
        asked = tuple(structure), names, starts, checked_substeps(substeps), workers, own
        try:
            if not own:
                return self.core.simulate_values(built_in, *asked, shown)
            with np.errstate(all="ignore"):  # of the user's functions
                return self.core.simulate_values(built_in, *asked, shown)
        except GaidentError:
            raise
        except ValueError as reason:
            raise ModelError(str(reason)) from None


def simulated_with_effects(
    record: _core.EffectRecord, plants: Sequence[Model], starts: Signal, steps: int, workers: int, every: bool, load: bool = False
) -> tuple[Signal, ...]:
    """The core's simulation of models, those with the same user-defined effects at once; as `_core.EffectRecord.simulate`."""
    acting = [tuple(e.key for e in plant.own_effects()) for plant in plants]
    if not any(acting):
        return record.simulate([plant.core() for plant in plants], starts, steps, workers, every, load=load)
    found: list[Signal] | None = None
    for keys in dict.fromkeys(acting):
        index = [i for i, mine in enumerate(acting) if mine == keys]
        own: OwnList = []
        for key in keys:
            rows = [next(e.values for e in plants[i].effects if e.key == key) for i in index]
            own.append(_asked(key, np.array(rows, dtype=np.float64)))
        some = starts[index] if starts.size else starts
        with np.errstate(all="ignore"):
            parts = record.simulate([plants[i].core() for i in index], some, steps, workers, every, own=own, load=load)
        if found is None:
            found = [np.empty((len(plants) if part.size else 0, part.shape[1])) for part in parts]
        for whole, part in zip(found, parts, strict=True):
            if part.size:
                whole[index] = part
    assert found is not None
    return tuple(found)


def _asked_later(ask: Callable[..., Any], began: float, *given: Any) -> Any:
    """A user-defined effect in a window, at the time of the record; given: velocity, angle, torque, command, time, values."""
    velocity, angle, torque, command, time, *values = given
    return ask(velocity, angle, torque, command, time + began, *values)


def _is_own(key: str) -> bool:
    return effect_and_side(key)[0] in OWN


def _asked(key: str, values: Signal) -> tuple[str, Callable[..., Any], Signal]:
    """A user-defined effect as the core takes it: where it acts, what it asks, a row of values for each model."""
    name, side = effect_and_side(key)
    return key_of(OWN[name].acts, side), OWN[name].ask, values


def _parted(structure: FactorCounts, effects: Sequence[str], values: Signal) -> tuple[Signal, OwnList]:
    """Rows of values of `simulate_values` without the columns of user-defined effects, and these."""
    if not any(map(_is_own, effects)):
        return values, []
    at = 1 + structure.real_poles + 2 * structure.pole_pairs + structure.real_zeros + 2 * structure.zero_pairs
    kept, own = [values[:, :at]], []
    for e in effects:
        columns = values[:, at : at + parameter_count(e)]
        at += parameter_count(e)
        if _is_own(e):
            own.append(_asked(e, np.ascontiguousarray(columns)))
        else:
            kept.append(columns)
    if values.shape[1] != at:
        raise ModelError(f"values has {values.shape[1]} columns: {at} are needed for {structure} with {', '.join(effects)}")
    return np.ascontiguousarray(np.hstack(kept)), own
