"""The page's pictures as PNG: what they show is worked out here, how it is drawn stands in plots.py."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.diagnosis.library.terms import LIBRARY
from gaident.models.simulate import simulate
from gaident.paper.facts import STEP
from gaident.paper.friction import FrictionTest
from gaident.paper.plots import plot_bias, plot_engines, plot_friction, plot_identified, plot_nominal
from gaident.paper.reproduction import Reproduction

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["CAPTIONS", "figures"]

Vector = NDArray[np.float64]

CAPTIONS = {
    "fig6_nominal": f"Fig. 6 on the simulated rig: velocity step of {STEP:g} rad/s; model with the nominal parameters of "
    "Table III.",
    "fig7_generations": "Fig. 7 on the simulated rig: best fitness so far, mean of the trials. The dot is what the default "
    "engine reports after the local fits at its end.",
    "fig8_identified": "Fig. 8 on the simulated rig: the identified models, the best trial of each engine.",
    "bias_one_mass": "One mass: deviation of the mechanical parameters from the truth, mean and two standard deviations over the "
    "noise seeds. The axis is linear within 1 % and logarithmic beyond.",
    "bias_two_masses": "Two masses, the same. Plain least squares mostly has no physical two masses behind its polynomial.",
    "friction_one_mass": "One mass, the record of reversals: linear model, model extended by what diagnose named, friction law.",
    "friction_two_masses": "Two masses, the same.",
}


def figures(result: Reproduction) -> dict[str, bytes]:
    """File name without suffix -> PNG, for each of CAPTIONS."""
    tests = [part.step for part in result.parts]
    drawn: dict[str, Figure] = {
        "fig6_nominal": plot_nominal(tests),
        "fig7_generations": plot_engines(tests),
        "fig8_identified": plot_identified(tests),
    }
    for part, name in zip(result.parts, ("one_mass", "two_masses"), strict=True):
        drawn[f"bias_{name}"] = plot_bias(part.comparisons, ("rig without friction", "rig with friction"))
        drawn[f"friction_{name}"] = plot_friction(*_friction_curves(part.friction))
    return {name: _png(drawn[name]) for name in CAPTIONS}


def _friction_curves(f: FrictionTest) -> tuple[Record, Vector, Vector, tuple[Vector, Vector, Vector]]:
    """(record, linear and extended velocity, friction law)."""
    w = np.linspace(0.0, 50.0, 501)
    found = np.zeros_like(w)
    for finding in f.diagnosis.findings:
        term = LIBRARY.get(finding.effect)
        if term is not None and term.curve is not None:
            found = found - term.curve(np.maximum(w, 1e-9), {name: e.value for name, e in finding.parameters.items()})
    extended = simulate(f.diagnosis.model, f.reversals, f.diagnosis.controller)
    return f.reversals, f.diagnosis.identification.simulate(f.reversals), extended, (w, f.truth.level(w), found)


def _png(drawn: Figure) -> bytes:
    out = io.BytesIO()
    drawn.savefig(out, format="png")
    return out.getvalue()
