"""gaident: from a drive's log to a model, its structure and parameters, and what they are worth.

import gaident as ga

rec = ga.read("run1.csv", columns={"command": "w_ref", "velocity": "w"}, units={"velocity": "rpm"})
idn = ga.identify(rec, controller=ga.PI(kp=0.0232, ki=1.367))
print(idn.summary())
"""

from __future__ import annotations

import lazy_loader

from gaident.providers import provide

# The public names stand in __init__.pyi; a name's module is imported when the name is first used.
_of_stub, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

# What methods of records, models and results call in rooms above their own, see gaident/providers.py.
provide(
    {
        # Record and its reader, Limits
        "plot_record": "gaident.show.plots:plot_record",
        "record_html": "gaident.show.record_html:record_html",
        "estimate_winding": "gaident.estimation.regression.winding:estimate_winding",
        "limits_of": "gaident.diagnosis.experiments.first_experiment:limits_of",
        # Model
        "to_scipy": "gaident.export.lti:to_scipy",
        "to_control": "gaident.export.lti:to_control",
        "write_c": "gaident.export.c_source:write_c",
        # Identification
        "identification_summary": "gaident.show.summary:identification_summary",
        "identification_html": "gaident.show.report.notebook:identification_html",
        "identification_table": "gaident.export.tables:identification_table",
        "plot_identification": "gaident.show.plots:plot_identification",
        "plot_poles_zeros": "gaident.show.plots:plot_poles_zeros",
        "plot_convergence": "gaident.show.plots:plot_convergence",
        "plot_structures": "gaident.show.plots:plot_structures",
        # Diagnosis
        "diagnosis_summary": "gaident.show.diagnosis_summary:diagnosis_summary",
        "diagnosis_html": "gaident.show.report.notebook:diagnosis_html",
        "diagnosis_table": "gaident.export.tables:diagnosis_table",
        "plot_diagnosis": "gaident.reporting.figures:plot_diagnosis",
        "stability": "gaident.diagnosis.stability:stability",
        "stability_summary": "gaident.show.wording:stability_summary",
        "run_as_seen": "gaident.estimation.mean_velocity:run_as_seen",
        "timed_record": "gaident.identification.replay.command_timing:timed_record",
        # InverseDynamics
        "regression_torque": "gaident.estimation.regression.prediction:regression_torque",
        "regression_error": "gaident.estimation.regression.prediction:regression_error",
        "inverse_dynamics_summary": "gaident.show.inverse_dynamics_summary:inverse_dynamics_summary",
        # Retuning
        "retuning_summary": "gaident.remedies.summary:retuning_summary",
        "plot_retuning": "gaident.remedies.pictures:plot_retuning",
        # both
        "plot_bode": "gaident.reporting.figures:plot_bode",
        # FrequencyResponse, and an Identification of some
        "plot_frequency_response": "gaident.reporting.figures:plot_frequency_response",
    }
)


def __getattr__(name: str) -> object:
    if name == "__version__":
        from gaident.version import version

        return version()
    return _of_stub(name)
