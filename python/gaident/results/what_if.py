"""What a drive would do without one of the effects that were found."""

from __future__ import annotations

from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.models.model import Model
from gaident.models.simulate import Run
from gaident.providers import provided
from gaident.results.saved import SavedResult

__all__ = ["WhatIf"]


class WhatIf(SavedResult):
    """A result with a model whose effects can be taken out."""

    model: Model
    controller: Controller | None
    velocity_age: float

    def simulate_without(self, effect: str, rec: Record | None = None, *, side: str | None = None) -> Run:
        """Simulate the drive as it would be with one cause mended.

        Parameters
        ----------
        effect : str
            Name of the effect that is taken out of `model`.
        rec : Record, optional
            Record whose command, or torque in the open loop, drives it; None: the first of the records used.
        side : {"motor", "load"}, optional
            The side where it is taken out; None: wherever it is.

        Returns
        -------
        Run
            Velocity, torque and position under `controller`, from rest; the velocity as the sensor shows it, `velocity_age` old.

        Raises
        ------
        GaidentError
            Where the model has no such effect, and where a loaded result is given no record.
        """
        if rec is not None and not isinstance(rec, Record):
            raise GaidentError(f"rec is {type(rec).__name__}: give a gaident.Record")
        if rec is None and not self.records:
            raise GaidentError(f"records: a loaded {self.KIND} contains no data; give simulate_without({effect!r}, rec)")
        mended, rec = self.model.without_effect(effect, side=side), self.records[0] if rec is None else rec
        found: Run = provided("run_as_seen")(mended, rec, self.controller, self.velocity_age)
        return found
