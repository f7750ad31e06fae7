"""A result as rows: one of the log, and one of each parameter. What the columns mean stands in docs/how-to/fleets.md."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gaident.data.record import Record
from gaident.diagnosis.library.terms import LIBRARY, level_of
from gaident.models.effect_rows import by_wave
from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import Estimate, of_axis
from gaident.results.finding import Finding
from gaident.results.identification import Identification

__all__ = ["LOG_COLUMNS", "PARAMETER_COLUMNS", "rows_of"]

LOG_COLUMNS: dict[str, type] = {
    "log": str,
    "time": str,
    "status": str,
    "error": str,
    "verdict": str,
    "causes": str,
    "alternatives": str,
    "sides": str,
    "driver": str,
    "not_testable": str,
    "temperature": float,
    "samples": int,
    "dt": float,
    "duration": float,
    "torque_logged": bool,
    "loop_follows": bool,
    "fit_linear": float,
    "fit_extended": float,
    "rmse": float,
    "noise": float,
    "force_error": float,
    "kind": str,
    "content": str,
    "settings": str,
    "version": str,
    "result": str,
}
PARAMETER_COLUMNS: dict[str, type] = {
    "log": str,
    "time": str,
    "of": str,
    "effect": str,
    "side": str,
    "order": int,
    "parameter": str,
    "value": float,
    "std": float,
    "unit": str,
    "at_bound": bool,
    "identifiable": bool,
    "alternatives": str,
    "verdict": str,
    "temperature": float,
    "result": str,
}

Row = Mapping[str, Any]


def rows_of(
    result: Diagnosis | Identification, records: Sequence[Record], kind: str, temperature: float | None
) -> tuple[Row, tuple[Row, ...]]:
    """(row of the log, rows of its parameters), without what the log's name says."""
    row: dict[str, Any] = {
        "temperature": temperature,
        "samples": sum(len(r.velocity) for r in records),
        "dt": records[0].dt,
        "duration": sum(len(r.velocity) * r.dt for r in records),
        "torque_logged": all(r.torque is not None for r in records),
        "kind": kind,
    }
    found: list[Row] = []
    if isinstance(result, Identification):
        row |= {"verdict": "", "fit_linear": result.fit_percent, "rmse": result.rmse}
        found += _listed("linear model", result.parameters, kind)
    else:
        causes = result.causes
        row |= {
            "verdict": result.verdict,
            "causes": "; ".join(f.effect for f in causes),
            "alternatives": "; ".join("|".join(f.alternatives) for f in causes),
            "sides": "; ".join("|".join(f.sides) for f in causes),
            "driver": result.driver,
            "not_testable": "; ".join(sorted(result.not_testable)),
            "loop_follows": result.loop_follows,
            "fit_linear": result.before.fit_percent,
            "fit_extended": result.after.fit_percent,
            "rmse": result.after.rmse,
            "noise": result.after.noise_floor,
            "force_error": result.after.force_error,
        }
        found += _listed("mechanics", result.mechanics, kind)
        found += _listed("friction", _levels(result.findings), kind)
        for finding in result.findings:
            found += _of_finding(finding, kind)
        if result.regression is not None:
            found += _listed("regression", result.regression.parameters, kind)
        found += _listed("controller", result.controller_numbers, kind)
    return row, tuple({**p, "verdict": row["verdict"], "temperature": temperature} for p in found)


def _levels(findings: Sequence[Finding]) -> dict[str, Estimate]:
    """The dry friction of the axis, whichever of its forms was named: the levels of both ends together."""
    known = [level_of(f.parameters) for f in findings if f.effect in LIBRARY and LIBRARY[f.effect].levels]
    if not known:
        return {}
    std = math.hypot(*(e.std for e in known))
    sure = all(e.identifiable for e in known)
    return {"dry_friction": Estimate(sum(e.value for e in known), std, known[0].unit, any(e.at_bound for e in known), sure)}


def _of_finding(finding: Finding, kind: str) -> Iterator[Row]:
    # Each wave under its order: which one is the strongest may change from log to log.
    for parameters in by_wave(finding.parameters):
        order = parameters.get("order")
        for row in _listed("cause" if not finding.is_noise else "record", parameters, kind):
            yield {
                **row,
                "effect": finding.effect,
                "side": "|".join(finding.sides),
                "order": None if order is None else round(of_axis("order", order, kind).value),
                "alternatives": "|".join(finding.alternatives),
            }


def _listed(of: str, parameters: Mapping[str, Estimate], kind: str) -> Iterator[Row]:
    for name, estimate in parameters.items():
        e = of_axis(name, estimate, kind)
        yield {
            "of": of,
            "effect": "",
            "side": "",
            "parameter": name,
            "value": e.value,
            "std": e.std,
            "unit": e.unit,
            "at_bound": e.at_bound,
            "identifiable": e.identifiable,
            "alternatives": "",
        }
