from .diagnosis_plots import plot_evidence
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
    "plot_poles_zeros",
    "plot_response",
    "plot_structures",
    "progress",
]
