"""What an inverse-dynamics regression found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.errors import RecordError, SettingsError
from gaident.estimation.regression.motion import motion_of
from gaident.estimation.regression.rows import rows_of
from gaident.estimation.regression.torque_terms import columns_of
from gaident.providers import provided
from gaident.results.estimate import Estimate

__all__ = ["InverseDynamics"]


@dataclass(frozen=True, eq=False)
class InverseDynamics:
    """The result of `ga.inverse_dynamics`: what the torque of an axis is made of.

    parameters            name -> Estimate in the axis' units: inertia, viscous or viscous_positive and viscous_negative,
                          coulomb or coulomb_positive and coulomb_negative, offset, gravity_amplitude and
                          gravity_phase, spring
    terms                 the terms that belong, by the criterion or as asked for
    coefficients          of the columns of these terms, in their order
    cutoff_hz, order, decimation   the filter [Hz] and the samples that became one row
    axis, dt              "rotary" or "linear"; sample time of the records [s]
    standstill            the velocity of standstill as asked for [rad/s], None by the rule
    slowest               samples with a velocity up to this are left out [rad/s], the largest of the records
    samples, effective_samples     rows of the regression, and how many independent ones they are worth
    noise_share           of the acceleration's power: so much the inertia may be too small by noise
    force_error           |u - u_model|/|u| over the rows, 0.04 for 4 %
    force_error_held_out, held_out the same on data that were not fitted, and which data these are
    rivals                (terms, BIC units worse) of the choices within 10 units
    not_tried             terms that these records cannot show, with the reason
    digests               of the records
    """

    parameters: dict[str, Estimate]
    terms: tuple[str, ...]
    coefficients: tuple[float, ...]
    cutoff_hz: float
    order: int
    decimation: int
    axis: str
    dt: float
    standstill: float | None
    slowest: float
    samples: int
    effective_samples: float
    noise_share: float
    force_error: float
    force_error_held_out: float
    held_out: str
    rivals: tuple[tuple[tuple[str, ...], float], ...]
    not_tried: tuple[str, ...]
    digests: tuple[str, ...]

    def torque(self, record: Record) -> NDArray[np.float64]:
        """The torque [N m] that this motion needs, an array (n,) like `record.velocity`.

        The motion passes the filter of the regression, so the torque has its band. Below the velocity of standstill dry
        friction is a straight line through zero: what it is at rest, the motion does not say. Raises SettingsError where
        the filter's corner is not below half of the record's sample rate.
        """
        self._fits(record)
        motion = motion_of(record, self.cutoff_hz, self.order, self.standstill)
        return np.asarray(columns_of(self.terms, motion) @ np.array(self.coefficients))

    def error(self, records: Record | Sequence[Record]) -> float:
        """The relative force error |u - u_model|/|u| on records with a torque, samples at standstill left out.

        Raises RecordError where a record has no torque or does not move, SettingsError as `torque` does.
        """
        squares = whole = 0.0
        for record in [records] if isinstance(records, Record) else records:
            self._fits(record)
            if record.torque is None:
                raise RecordError(f"record {record.name!r} has no torque to compare with; log it")
            step = max(1, round(self.decimation * self.dt / record.dt))
            rows = rows_of(record, self.terms, self.cutoff_hz, self.order, step, self.standstill)
            left = rows.torque - rows.of(self.terms) @ np.array(self.coefficients)
            squares, whole = squares + float(left @ left), whole + float(rows.torque @ rows.torque)
        if not whole > 0.0:
            raise RecordError("the records have no motion with a torque: no relative force error; give records that move")
        return float(np.sqrt(squares / whole))

    def summary(self) -> str:
        """What was found and what it is worth; plain text, no line break at the end."""
        return str(provided("inverse_dynamics_summary")(self))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        own = {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "parameters"}
        return {**own, "parameters": {name: vars(e) for name, e in self.parameters.items()}}

    def __repr__(self) -> str:
        listed = ", ".join(f"{name} {e.value:.4g}" for name, e in self.parameters.items())
        return f"InverseDynamics({listed}; force error {100 * self.force_error:.3g} %)"

    def _fits(self, record: Record) -> None:
        if not self.cutoff_hz < 0.5 / record.dt:
            raise SettingsError(
                f"the record has dt={record.dt:g} s, too slow for the filter of {self.cutoff_hz:g} Hz that was used; "
                f"fit with cutoff_hz below {0.5 / record.dt:g}"
            )
