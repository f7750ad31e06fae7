"""The numbers of a joint, which every form of it reads; `gaident.JointParameters` says what each is."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["JointNumbers"]


@dataclass(frozen=True)
class JointNumbers:
    """See `gaident.JointParameters`."""

    inertia: float
    damping: float
    friction: float
    load: float
    motor: tuple[float, float, float]
    shaft: tuple[float, float] | None
    breakaway: float
    stribeck_velocity: float
    lag: float
    torque_limit: float | None
    kp: float | None
    ki: float | None
    position_gain: float | None
    left_out: tuple[str, ...]
    doubts: tuple[str, ...]
    axis: str

    @property
    def at_load(self) -> tuple[float, float, float]:
        """(inertia, damping, friction) of the load; zeros where the axis is one mass."""
        whole = (self.inertia, self.damping, self.friction)
        return tuple(a - b for a, b in zip(whole, self.motor, strict=True))  # type: ignore[return-value]
