"""JSON of results: numbers that JSON lacks are written as objects."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from gaident.axis import unit
from gaident.models.effect_rows import by_wave
from gaident.models.effects import row_of
from gaident.results.estimate import Estimate, of_axis

__all__ = ["decoded", "json_text", "on_axis"]

ROOTS = "rad/s"
"""Unit of the poles and zeros of a model, on a linear axis too: no motion of the axis."""


def json_text(data: Mapping[str, Any]) -> str:
    """JSON of plain data; nan and inf, which JSON lacks, become objects {"number": "nan"}."""
    return json.dumps(_encoded(dict(data)), indent=1, allow_nan=False)


_WORDS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


def _encoded(x: Any) -> Any:
    if isinstance(x, dict):
        return {k: _encoded(v) for k, v in x.items()}
    if isinstance(x, (list, tuple)):
        return [_encoded(v) for v in x]
    if isinstance(x, float) and not math.isfinite(x):
        return {"number": "nan" if math.isnan(x) else "inf" if x > 0 else "-inf"}
    return x


def decoded(x: Any) -> Any:
    """What json_text had to encode, back as numbers."""
    if isinstance(x, dict):
        if set(x) == {"number"} and x["number"] in _WORDS:
            return _WORDS[x["number"]]
        return {k: decoded(v) for k, v in x.items()}
    if isinstance(x, list):
        return [decoded(v) for v in x]
    return x


def on_axis(data: Mapping[str, Any], axis: str) -> dict[str, Any]:
    """Plain data of a result in the words and units of its axis: what `to_dict` gives has those of a rotary one.

    Its sentences on a linear axis, `linear_axis`, stand in the places of the others then.
    """
    return dict(data) if axis == "rotary" else _on_linear(dict(data), {}, "", False)


def _on_linear(x: Any, sentences: Mapping[str, str], name: str, of_model: bool) -> Any:
    """name: the key above x; of_model: whether x is one of the numbers of a linear model."""
    if isinstance(x, list):
        return [_on_linear(v, sentences, name, of_model) for v in x]
    if not isinstance(x, dict):
        return sentences.get(x, x) if isinstance(x, str) else x
    if {"value", "std", "unit"} <= x.keys():
        if of_model and x["unit"] == ROOTS:
            return x
        e = of_axis(name, Estimate(x["value"], x["std"], x["unit"]), "linear")
        return {**x, "value": e.value, "std": e.std, "unit": e.unit}
    if {"parameter", "at_most", "unit"} <= x.keys():
        e = of_axis(x["parameter"], Estimate(x["at_most"], 0.0, x["unit"]), "linear")
        return {**x, "at_most": e.value, "unit": e.unit}
    if {"value", "low", "high", "unit"} <= x.keys():
        return {**x, "unit": unit(x["unit"], "linear")}
    known = {**sentences, **x.get("linear_axis", {})}
    if name == "effects" and {"name", "parameters"} <= x.keys():
        return {**x, **_effect_on_linear(x["name"], x["parameters"])}
    numbers = "fitness" in x and "model" in x  # of an identification
    return {k: _on_linear(v, known, k, of_model or (numbers and k == "parameters")) for k, v in x.items() if k != "linear_axis"}


def _effect_on_linear(name: str, parameters: Mapping[str, float | None]) -> dict[str, Any]:
    """The parameters of an effect of a model, each with its unit, which `Effect.from_dict` reads; None: an infinite limit."""
    units = {p.name: p.unit for p in row_of(name).of_waves(len(by_wave(parameters))).parameters}
    shown = {k: of_axis(k, Estimate(math.inf if v is None else v, 0.0, units[k]), "linear") for k, v in parameters.items()}
    values = {k: e.value if math.isfinite(e.value) else None for k, e in shown.items()}
    return {"parameters": values, "units": {k: e.unit for k, e in shown.items()}}
