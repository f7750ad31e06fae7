"""Results as pandas tables."""

from __future__ import annotations

from dataclasses import asdict, fields
from math import nan
from typing import Any

from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import Estimate, of_axis
from gaident.results.identification import Identification

__all__ = ["diagnosis_table", "identification_table"]


def _pandas() -> Any:
    try:
        import pandas
    except ImportError as reason:
        raise ImportError('to_pandas needs pandas: pip install "gaident[pandas]"') from reason
    return pandas


def identification_table(idn: Identification) -> Any:
    """One row per parameter: of the model, of the torque's path, of the mechanics; see `Identification.to_pandas`.

    at_bound: of the mechanics, whether any parameter that they follow from sits at a bound of its search range.
    of_controller: 0, as the deviations of an identification are those under the controller that it uses.
    """
    rows = [{"of": "model", "parameter": name, **asdict(e)} for name, e in idn.parameters.items()]
    rows += [{"of": "path", "parameter": name, **asdict(e)} for name, e in idn.path.items()]
    drive = idn.mechanics
    if drive is not None:
        bound = any(e.at_bound for e in idn.parameters.values())  # it follows from all of them
        for name, unit in drive.UNITS.items():
            value, std = getattr(drive, name), drive.std.get(name, nan)
            rows.append({"of": "mechanics", "parameter": name, **asdict(Estimate(value, std, unit, bound, std < abs(value)))})
    columns = ["of", "parameter", *(f.name for f in fields(Estimate))]
    return _pandas().DataFrame(rows, columns=columns).set_index(["of", "parameter"])


def diagnosis_table(dia: Diagnosis) -> Any:
    """One row per parameter of each finding; see `Diagnosis.to_pandas`."""
    rows = []
    for order, finding in enumerate(dia.findings, 1):
        for name in finding.parameters:
            estimate = of_axis(name, finding.parameters[name], dia.axis)
            rows.append(
                {
                    "order": order,
                    "effect": finding.effect,
                    "parameter": name,
                    **asdict(estimate),
                    "named": finding.named,
                    "alternatives": ", ".join(finding.alternatives),
                    "gain": finding.gain,
                    "delta_bic": finding.delta_bic,
                    "p_value": finding.p_value,
                    "is_noise": finding.is_noise,
                    "place": finding.place,
                    "sides": ", ".join(finding.sides),
                    "evidence": finding.evidence,
                }
            )
    columns = [*("order", "effect", "parameter"), *(f.name for f in fields(Estimate)), *("named", "alternatives"),
               *("gain", "delta_bic", "p_value", "is_noise", "place", "sides", "evidence")]  # fmt: skip
    return _pandas().DataFrame(rows, columns=columns).set_index(["effect", "parameter"])
