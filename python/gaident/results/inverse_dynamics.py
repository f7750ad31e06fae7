"""What an inverse-dynamics regression found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.providers import provided
from gaident.results.estimate import Estimate
from gaident.results.saved import undamaged

__all__ = ["InverseDynamics"]


@dataclass(frozen=True)
class InverseDynamics:
    """The result of `inverse_dynamics`: what the torque of an axis is made of.

    Attributes
    ----------
    parameters : dict of str to Estimate
        In the axis' units: inertia, viscous or viscous_positive and viscous_negative, coulomb or coulomb_positive and
        coulomb_negative, offset, gravity_amplitude and gravity_phase, spring.
    terms : tuple of str
        The terms that belong, by the criterion or as asked for.
    coefficients : tuple of float
        Coefficients of the columns of these terms, in their order, SI units.
    cutoff_hz : float
        Corner of the filter [Hz].
    order : int
        Order of the filter.
    decimation : int
        Samples that became one row.
    axis : {"rotary", "linear"}
        Kind of the axis.
    dt : float
        Sample time of the records [s].
    standstill : float or None
        Velocity of standstill as asked for [rad/s]; None: by the rule.
    slowest : float
        Samples with a velocity up to this are left out [rad/s]; the largest of the records.
    samples : int
        Rows of the regression.
    effective_samples : float
        How many independent rows they are worth.
    noise_share : float
        Share of noise in the acceleration's power [1]: so much the inertia may be too small.
    force_error : float
        norm(u - u_model)/norm(u) over the rows [1], 0.04 for 4 %.
    force_error_held_out : float
        The same on data that were not fitted [1].
    held_out : str
        Which data these are.
    rivals : tuple of (tuple of str, float)
        (terms, BIC units worse) of the choices within 10 units.
    not_tried : tuple of str
        Terms that these records cannot show, with the reason.
    digests : tuple of str
        Digests of the records, see `Record.digest`.
    terms_not_tried : tuple of str
        The terms of `not_tried` alone.

    See Also
    --------
    inverse_dynamics : Makes it, with an example.
    """

    parameters: dict[str, Estimate] = field(hash=False)
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
    terms_not_tried: tuple[str, ...] = ()

    def torque(self, record: Record) -> NDArray[np.float64]:
        """Return the torque that this motion needs [N m], shape (n,) like `record.velocity`.

        The motion passes the filter of the regression, so the torque has its band.
        Below the velocity of standstill dry friction is a straight line through zero: the motion does not say what it is at rest.
        Raises SettingsError where the filter's corner is not below half of the record's sample rate.
        """
        return np.asarray(provided("regression_torque")(self, record))

    def error(self, records: Record | Sequence[Record]) -> float:
        """Return the relative force error norm(u - u_model)/norm(u) on records with a torque, samples at standstill left out.

        Raises RecordError where a record has no torque or does not move, SettingsError as `torque` does.
        """
        return float(provided("regression_error")(self, [records] if isinstance(records, Record) else records))

    def summary(self) -> str:
        """Return what was found and what it is worth; plain text, no line break at the end."""
        return str(provided("inverse_dynamics_summary")(self))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        own = {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "parameters"}
        return {**own, "parameters": {name: vars(e) for name, e in self.parameters.items()}}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> InverseDynamics:
        """The inverse of `to_dict`. Raises GaidentError where the data are something else."""
        with undamaged("regression"):
            lists = {name: tuple(data[name]) for name in ("terms", "coefficients", "not_tried", "digests")}
            lists["terms_not_tried"] = tuple(data.get("terms_not_tried", ()))  # not in the files of earlier versions
            rivals = tuple((tuple(terms), float(worse)) for terms, worse in data["rivals"])
            parameters = {name: Estimate(**e) for name, e in data["parameters"].items()}
            return cls(**{**data, **lists, "rivals": rivals, "parameters": parameters})

    def __repr__(self) -> str:
        listed = ", ".join(f"{name} {e.value:.4g}" for name, e in self.parameters.items())
        return f"InverseDynamics({listed}; force error {100 * self.force_error:.3g} %)"
