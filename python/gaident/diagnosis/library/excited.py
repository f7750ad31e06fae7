"""Which effects each command of the menu of experiments is good at: the ones that it excites and tells from others."""

from __future__ import annotations

__all__ = ["EXCITED"]

EXCITED: dict[str, tuple[str, ...]] = {
    "slow stairs": ("coulomb_friction", "stribeck_friction", "presliding_friction", "asymmetric_friction", "torque_dead_band"),
    "triangle across zero": ("coulomb_friction", "stribeck_friction", "asymmetric_friction", "quadratic_drag"),
    "reversals": ("backlash", "torque_dead_band", "presliding_friction", "coulomb_friction", "hardening_stiffness"),
    "random signal at speed": ("extra_resonance", "torque_lag", "transport_delay", "velocity_filter", "hardening_stiffness"),
    "random signal at standstill": ("backlash", "presliding_friction", "torque_dead_band", "coulomb_friction"),
    "steps of three sizes": ("torque_saturation", "command_rate_limit", "integrator_clamp"),
    "slow constant speeds": ("cogging", "velocity_ripple", "unbalance"),
    "holds up and down": ("unbalance", "load_torque", "asymmetric_friction", "coulomb_friction"),
    "repeated segment": ("friction_drift", "quadratic_drag"),
    "speeds mixed in time": ("quadratic_drag", "friction_drift", "asymmetric_friction", "coulomb_friction"),
    "creep below break-away": ("presliding_friction", "lugre_friction", "stribeck_friction", "torque_dead_band"),
}
"""Name of the command -> effects."""
