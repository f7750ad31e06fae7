"""What is left, in size: what is significant need not matter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

__all__ = ["Relevance"]


@dataclass(frozen=True)
class Relevance:
    """How large what is left is beside the noise and the accuracy that was asked for.

    With the rms error e of the extended model on the held-out data, and s, what noise leaves of it,

        left = sqrt(e^2 - s^2),   0 where e < s

    Attributes
    ----------
    velocity : float
        What is left of the free run's velocity beyond the noise, rms [rad/s].
    noise : float
        What noise leaves of the free run: that of the velocity, and of a measured torque that drives the model [rad/s].
    torque : float or None
        What is left of the torque beyond the noise, rms [N m]; None where no torque is logged.
    torque_noise : float or None
        What noise leaves of the force error [N m].
    velocity_accuracy, torque_accuracy : float or None
        What was asked for [rad/s], [N m]; None: nothing.
    bent : tuple of str
        Names in `Diagnosis.mechanics` that what is left can have moved by more than their standard deviation.
    shares : mapping of str to float
        Part of the squared error, before whitening, that a free function of each driver takes away, 0 to 1; empty where nothing
        is left of it, and in older files.

    See Also
    --------
    diagnose : Makes it.
    """

    velocity: float
    noise: float
    torque: float | None = None
    torque_noise: float | None = None
    velocity_accuracy: float | None = None
    torque_accuracy: float | None = None
    bent: tuple[str, ...] = ()
    shares: Mapping[str, float] = field(default_factory=dict, hash=False)

    @property
    def asked(self) -> bool:
        """Whether an accuracy was asked for."""
        return self.velocity_accuracy is not None or self.torque_accuracy is not None

    @property
    def negligible(self) -> str:
        """Why what is left does not matter: "accuracy": all that was asked is met; "noise": it is less than the noise; or ""."""
        if self.asked:
            return "accuracy" if self._within(self.velocity_accuracy, self.torque_accuracy) else ""
        return "noise" if self._within(self.noise, self.torque_noise) else ""

    def _within(self, velocity: float | None, torque: float | None) -> bool:
        fast_enough = velocity is None or self.velocity < velocity
        return fast_enough and (torque is None or (self.torque is not None and self.torque < torque))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {**asdict(self), "bent": list(self.bent), "shares": dict(self.shares)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Relevance:
        """Return what `to_dict` gave."""
        return cls(**{**data, "bent": tuple(data["bent"])})
