from .diagnosis_plots import (
    plot_evidence,
    plot_orders,
    plot_residual,
    plot_reversals,
    plot_torque_velocity,
)
from .plots import (
    plot_bode,
    plot_convergence,
    plot_identification,
    plot_poles_zeros,
    plot_structures,
)
from .progress_bar import progress
from .response_plots import plot_response
from .summary import identification_summary, mechanics_comparison

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
    "progress",
]
