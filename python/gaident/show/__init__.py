"""Results as text and pictures: pure functions of what a result says about itself."""

from gaident.show.diagnosis_plots import (
    plot_evidence,
    plot_orders,
    plot_residual,
    plot_reversals,
    plot_torque_velocity,
)
from gaident.show.plots import (
    plot_bode,
    plot_convergence,
    plot_identification,
    plot_poles_zeros,
    plot_structures,
)
from gaident.show.response_plots import plot_response
from gaident.show.summary import identification_summary, mechanics_comparison

__all__ = [
    "identification_summary",
    "mechanics_comparison",
    "plot_bode",
    "plot_convergence",
    "plot_evidence",
    "plot_identification",
    "plot_orders",
    "plot_poles_zeros",
    "plot_residual",
    "plot_response",
    "plot_reversals",
    "plot_structures",
    "plot_torque_velocity",
]
