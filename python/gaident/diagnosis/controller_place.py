"""Effects of the controller, decided without a plant: does the logged torque follow from command and measured velocity?"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.candidates import CANDIDATES, Scales
from gaident.diagnosis.driven import AT_CONTROLLER, Driven
from gaident.diagnosis.replay import replay
from gaident.diagnosis.result import Finding
from gaident.identification.covariance import Estimate
from gaident.models.effects import table

__all__ = ["AtController", "controller_findings"]

Vector = NDArray[np.float64]


@dataclass
class AtController:
    """Which effects of the controller need no plant any more, and those that are there, with parameters."""

    decided: tuple[str, ...] = ()
    effects: dict[str, dict[str, float]] = field(default_factory=dict)


def controller_findings(driven: Driven, scales: Scales) -> tuple[list[Finding], AtController, list[str]]:
    """(findings, what is decided, notes). Without a logged torque nothing is decided here."""
    if driven.controller is None or not driven.torque_logged or driven.command is None:
        return [], AtController(), []
    replays = [replay(r, driven.controller) for r in driven.records]
    if all(r.follows for r in replays):
        return [], AtController(AT_CONTROLLER), []
    notes: list[str] = []
    error = driven.replayed_error({})
    plain = float(error @ error)
    best: tuple[float, str, float] | None = None
    for effect in AT_CONTROLLER:
        value, cost = _fitted(driven, scales, effect)
        if best is None or cost < best[0]:
            best = (cost, effect, value)
    assert best is not None
    cost, effect, value = best
    n = len(error)
    floor = n * max(max(r.resolution for r in replays), 1e-9 * scales.torque) ** 2
    if cost < 0.02 * plain or cost < 4.0 * floor:
        gain = float(n * np.log(plain / max(cost, floor, 1e-300)) - np.log(n))
        parameter = next(r for r in table() if r.name == effect).parameters[0]
        name, unit = parameter.name, parameter.unit
        text = (
            f"The logged torque does not follow from command and velocity (rms {np.sqrt(plain / n):.3g} N m); with "
            f"{name} {value:.4g} {unit} of the {effect.replace('_', ' ')} it does, to {np.sqrt(cost / n):.2g} N m rms. "
            "No model of the plant is involved."
        )
        std = _std(driven, effect, value, cost)
        finding = Finding(effect, {name: Estimate(value, std, unit)}, (), 1.0 - float(np.sqrt(cost / plain)), gain, None, text)
        return [finding], AtController(AT_CONTROLLER, {effect: {name: value}}), notes
    notes += list(dict.fromkeys(r.sentence for r in replays if not r.follows))
    return [], AtController(AT_CONTROLLER), notes


def _fitted(driven: Driven, scales: Scales, effect: str) -> tuple[float, float]:
    """(value, cost) of the effect that comes closest to the logged torque: grid, then golden section on the logarithm."""
    from scipy.optimize import minimize_scalar

    low, high = CANDIDATES[effect].limits(scales)[0]

    def cost(z: float) -> float:
        e = driven.replayed_error({effect: float(np.exp(z))})
        return float(e @ e)

    grid = np.linspace(low, high, 25)
    costs = [cost(z) for z in grid]
    k = int(np.argmin(costs))
    bracket = (grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)])
    found = minimize_scalar(cost, bounds=bracket, method="bounded", options={"xatol": 1e-7})
    return (float(np.exp(found.x)), float(found.fun)) if found.fun < costs[k] else (float(np.exp(grid[k])), costs[k])


def _std(driven: Driven, effect: str, value: float, cost: float) -> float:
    """Standard deviation from the slope of the replay."""
    h = 1e-4 * value
    slope = (driven.replayed_error({effect: value + h}) - driven.replayed_error({effect: value - h})) / (2.0 * h)
    power = float(slope @ slope)
    return float(np.sqrt(cost / len(slope) / power)) if power > 0.0 else float("inf")
