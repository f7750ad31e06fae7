"""Parameters with which every effect of the library shows in the drives of the tests."""

from __future__ import annotations

__all__ = ["SIZES"]

SIZES: dict[str, dict[str, float]] = {
    "coulomb_friction": {"torque": 0.05},
    "stribeck_friction": {"torque": 0.04, "static_torque": 0.07, "stribeck_velocity": 2.0},
    "asymmetric_friction": {
        "torque_positive": 0.05,
        "torque_negative": 0.035,
        "viscous_positive": 0.0,
        "viscous_negative": 4e-4,
    },
    "presliding_friction": {"torque": 0.05, "stiffness": 3.0},
    "lugre_friction": {
        "torque": 0.04,
        "static_torque": 0.07,
        "stribeck_velocity": 2.0,
        "stiffness": 10.0,
        "damping": 0.005,
    },
    "quadratic_drag": {"coefficient": 1.5e-5},
    "square_root_drag": {"coefficient": 5e-3},
    "load_torque": {"torque": 0.03},
    "unbalance": {"amplitude": 0.05, "phase": 0.3},
    "cogging": {"amplitude": 0.03, "order": 12.0, "phase": 0.4},
    "friction_drift": {"torque": 0.05, "rate": -0.2},
    "load_dependent_friction": {"torque": 0.04, "share": 0.2},
    "position_friction": {"torque": 0.05, "amplitude": 0.6, "order": 3.0, "phase": 0.4},
    "torque_hum": {"amplitude": 0.04, "frequency": 50.0, "phase": 0.3},
    "position_inertia": {"amplitude": 0.3, "order": 1.0, "phase": 0.4},
    "backlash": {"gap": 0.01},
    "hardening_stiffness": {"cubic_stiffness": 1e4},
    "hysteretic_coupling": {"torque": 0.1, "stiffness": 1.0},
    "torque_saturation": {"limit": 0.5},
    "torque_dead_band": {"width": 0.03},
    "transport_delay": {"delay": 0.73e-3},
    "torque_lag": {"time_constant": 1e-3},
    "integrator_clamp": {"limit": 0.05},
    "command_rate_limit": {"rate": 3000.0},
    "velocity_difference": {"samples": 3.0},
    "velocity_observer": {"bandwidth": 3000.0},
    "velocity_filter": {"time_constant": 1e-3},
    "velocity_ripple": {"amplitude": 0.005, "order": 2.0, "phase": 0.2},
    "velocity_quantisation": {"step": 0.6},
    "extra_resonance": {"frequency": 900.0, "damping": 0.02, "zero_frequency": 800.0, "zero_damping": 0.02},
}
