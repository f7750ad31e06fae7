"""How well a model does on held-out data, and one quantity by two methods."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gaident.results.estimate import Estimate

__all__ = ["IN_SAMPLE", "Comparison", "Fitness"]

IN_SAMPLE = "in-sample"
"""What a result says of figures that could not be held out; `Diagnosis.in_sample` asks for it."""


@dataclass(frozen=True)
class Fitness:
    """A model against held-out data, in the free run and by its force error.

    Attributes
    ----------
    rmse : float
        Root mean square of the free run's velocity error [rad/s].
    fit_percent : float
        100 (1 - norm(error)/norm(velocity - mean velocity)) [%].
    noise_floor : float
        Root mean square that the noise of the measured velocity alone leaves [rad/s].
    force_error : float or None
        Root mean square of the logged torque minus the torque that the model needs for the measured motion [N m]; None where no
        torque is logged, nothing moves, or the model diverges along that motion.
    torque_rms : float or None
        Root mean square of the torque itself, over the same samples [N m].
    force_floor : float or None
        What noise and, of an extended model, the filter leave of the force error at most [N m].

    See Also
    --------
    diagnose : Makes it.
    force_error : The same figure of any model on any records.
    """

    rmse: float
    fit_percent: float
    noise_floor: float
    force_error: float | None = None
    torque_rms: float | None = None
    force_floor: float | None = None

    @property
    def force_percent(self) -> float | None:
        """The force error as a percentage of the torque's rms."""
        if self.force_error is None or not self.torque_rms:
            return None
        return 100.0 * self.force_error / self.torque_rms


@dataclass(frozen=True)
class Comparison:
    """One quantity by two methods.

    name: "inertia", "dry friction", "gravity" or "ground stiffness"; differs: they contradict each other, and it matters.
    of_model: what the regression says of the records that the diagnosed model itself made; None where that was not asked.
    """

    name: str
    diagnosis: Estimate
    regression: Estimate
    differs: bool
    of_model: Estimate | None = None

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Comparison:
        """The inverse of `dataclasses.asdict`."""
        of_model = data.get("of_model")
        both = Estimate(**data["diagnosis"]), Estimate(**data["regression"])
        return cls(data["name"], *both, data["differs"], None if of_model is None else Estimate(**of_model))
