"""compare(): several models of a drive against the same records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.axis import said, say, unit
from gaident.checks import several
from gaident.control.controller import Controller, checked_controller
from gaident.data.record import Record
from gaident.data.signals.difference import is_difference_at_clock
from gaident.errors import GaidentError, SettingsError
from gaident.estimation.mean_velocity import run_as_seen
from gaident.estimation.regression.force_error import force_error
from gaident.models.drive_torque import HALF, as_late, as_read
from gaident.models.mechanics import OneMass, TwoMass
from gaident.models.model import Model
from gaident.models.simulation_input import as_model
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.show.wording import number, table

__all__ = ["ComparedModel", "ModelComparison", "compare"]

Vector = NDArray[np.float64]
Given = Model | OneMass | TwoMass | Identification | Diagnosis


@dataclass(frozen=True)
class ComparedModel:
    """One model against the records.

    Attributes
    ----------
    name : str
        As it was given.
    rmse : float
        Root mean square of the velocity's error in the free run of all records [rad/s]; inf where it runs away.
    fit_percent : float
        100 (1 - norm(error)/norm(velocity - mean velocity)) of the same run [%].
    largest : float
        Largest error [rad/s].
    force_error : float or None
        Rms of the logged torque minus the torque that the model needs for the measured motion [N m]; None where no torque is
        logged, or the model has no such torque.

    See Also
    --------
    compare : Makes it.
    """

    name: str
    rmse: float
    fit_percent: float
    largest: float
    force_error: float | None


@dataclass(frozen=True)
class ModelComparison:
    """Models against the same records, in the order in which they were given. Made by `compare`.

    Attributes
    ----------
    models : tuple of ComparedModel
        One for each model.

    See Also
    --------
    compare : Makes it, with an example.
    """

    models: tuple[ComparedModel, ...]

    @property
    def best(self) -> ComparedModel:
        """The model with the smallest error of the velocity."""
        return min(self.models, key=lambda m: m.rmse)

    def summary(self, axis: str = "rotary") -> str:
        """Return a table of the models; `axis`: "linear" for units of m and N."""
        v, u = unit("rad/s", axis), unit("N m", axis)
        rows = [("model", f"rmse [{v}]", "fit [%]", f"largest error [{v}]", said(say("{torque} error"), axis) + f" [{u}]")]
        for m in self.models:
            force = "" if m.force_error is None else number(m.force_error)
            rows.append((m.name, number(m.rmse), number(m.fit_percent), number(m.largest), force))
        return "\n".join(table(rows))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {"schema": "gaident/comparison", "schema_version": 1, "models": [asdict(m) for m in self.models]}


def compare(
    models: Mapping[str, Given] | Sequence[Given], rec: Record | Sequence[Record], controller: Controller | None = None
) -> ModelComparison:
    """Simulate several models on the same records, and say how far each is off.

    The records are as the first Diagnosis among the models used them, with its shifts of the log and its age of the velocity.
    Without one a velocity is half a sample of the controller old where it is the difference of the logged positions.

    Parameters
    ----------
    models : mapping of str to model, or sequence of models
        Models, mechanisms, identifications or diagnoses, of which the model counts. A sequence gets the names "1", "2", ...
    rec : Record or sequence of Record
        The records. Each run starts from rest.
    controller : PI or Cascade, optional
        The loop that the command drives; None: the logged torque drives each model.

    Returns
    -------
    ModelComparison
        A row for each model.

    Raises
    ------
    SettingsError
        For something else than models or records.
    RecordError
        Where a record lacks what drives the models.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> drive = ga.OneMass(J=0.01, D=0.05).model().with_effect("coulomb_friction", torque=0.3)
    >>> torque = np.repeat([0.8, -0.9, 0.5, -0.6], 100)
    >>> run = ga.run(drive, ga.Record(1e-3, torque=torque, velocity=0.0 * torque))
    >>> rec = ga.Record(1e-3, torque=torque, velocity=run.velocity)
    >>> found = ga.compare({"as it is": drive, "mended": drive.without_effect("coulomb_friction")}, rec)
    >>> found.best.name, found.models[0].rmse < 1e-9 < found.models[1].rmse
    ('as it is', True)
    """
    checked_controller(controller)
    named = dict(models) if isinstance(models, Mapping) else {str(i): m for i, m in enumerate(_listed(models), 1)}
    records = several(rec, Record, "rec", SettingsError, "give a gaident.Record or a list of them")
    if not named:
        raise SettingsError("models is empty: give one model at least")
    data = _taken(list(named.values()), records, controller)
    return ModelComparison(tuple(_compared(str(n), m, data) for n, m in named.items()))


def _listed(models: object) -> Sequence[Given]:
    if isinstance(models, str) or not isinstance(models, Sequence):
        raise SettingsError(f"models is {type(models).__name__}: give a list of models, or a dictionary, name -> model")
    return models


@dataclass(frozen=True, eq=False)
class _Taken:
    """The records as they are compared, and the loop; age: of their velocity against their torque [lines of the log]."""

    records: tuple[Record, ...]
    controller: Controller | None
    age: float

    @cached_property
    def spread(self) -> float:
        """Norm of the velocity less its mean in each record [rad/s]."""
        return float(np.linalg.norm(np.concatenate([r.velocity - np.mean(r.velocity) for r in self.records])))

    def error(self, model: Model) -> Vector:
        """Measured minus simulated velocity of all records [rad/s]."""
        runs = [run_as_seen(model, r, self.controller, self.age) for r in self.records]
        return np.concatenate([r.velocity - one.velocity for r, one in zip(self.records, runs, strict=True)])

    @property
    def led(self) -> list[Record]:
        """As their motion is that of their torque, which is as late as the velocity is old; a logged position has no age."""
        return [r if r.position is not None else as_late(r, self.age) for r in self.records]


def _taken(given: Sequence[Given], records: Sequence[Record], controller: Controller | None) -> _Taken:
    for dia in given:
        if isinstance(dia, Diagnosis):
            if controller is None:
                return _Taken(tuple(map(dia.as_used, records)), None, dia.velocity_age)
            return _Taken(tuple(as_read(r, controller, dia.log_shifts) for r in records), controller, dia.velocity_age)
    used = tuple(as_read(r, controller, {}) for r in records)
    every = [1 if controller is None else controller.log_every(r.dt) for r in used]
    made = all(is_difference_at_clock(r.velocity, r.position, r.dt, k) for r, k in zip(used, every, strict=True))
    return _Taken(used, controller, HALF / max(every) if made else 0.0)


def _compared(name: str, given: Given, data: _Taken) -> ComparedModel:
    model = given.model if isinstance(given, Identification | Diagnosis) else as_model(given)
    with np.errstate(over="ignore", invalid="ignore"):
        error = data.error(model)
        size, largest = float(np.linalg.norm(error)), float(np.max(np.abs(error)))
    if not np.isfinite(size):
        return ComparedModel(name, float("inf"), float("-inf"), float("inf"), None)
    force = None
    if all(r.torque is not None for r in data.records):
        try:
            force = force_error(model, data.led).rms
        except GaidentError:  # the model has no torque of a motion, or nothing moves
            force = None
    fit = 100.0 * (1.0 - size / data.spread) if data.spread > 0.0 else float("nan")
    return ComparedModel(name, size / float(np.sqrt(len(error))), fit, largest, force)
