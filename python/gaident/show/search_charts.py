"""Charts of the search behind an identification: structures, convergence, poles and zeros."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gaident.results.estimate import Estimate
from gaident.results.identification import Identification
from gaident.show.chart import Chart, Panel, Trace

__all__ = ["convergence_chart", "roots_chart", "roots_of", "structures_chart"]

SHOWN = 12


def structures_chart(idn: Identification) -> Chart:
    """BIC of the best structures above the lowest, one bar each, with its name on it."""
    ordered = sorted(idn.structures, key=lambda s: (s.delta_bic, s.p + 2 * s.q))[:SHOWN]
    chosen, rivals = (idn.p, idn.q), {(r.p, r.q) for r in idn.rivals}
    kinds = ["reported" if (s.p, s.q) == chosen else "rival" if (s.p, s.q) in rivals else "other" for s in ordered]
    height = np.array([max(s.delta_bic, 1.0) for s in ordered])
    place = np.arange(len(ordered), dtype=np.float64)
    traces = []
    for kind, role in (("reported", "faster"), ("rival", "noise"), ("other", "faint")):
        mine = np.array([k == kind for k in kinds])
        if np.any(mine):
            traces.append(Trace(place[mine], height[mine], kind, role, "bars"))
    ends = np.array([-0.6, len(ordered) - 0.4])
    traces.append(Trace(ends, np.full(2, 10.0), "margin 10", "ink", dash="dash"))
    names = tuple((x, f"({s.p},{s.q})") for x, s in zip(place.tolist(), ordered, strict=True))
    text = (
        f"The best {len(ordered)} of {len(idn.structures)} structures (p,q). The smallest within the margin of the lowest is "
        "reported; a bar at 1 stands for 0 to 1."
    )
    top = 3.0 * max(float(height.max()), 10.0)
    panel = Panel("BIC above the lowest", tuple(traces), log=True, limits=(0.8, top))
    return Chart("structures", "structure (p,q)", (panel,), text, limits=(-0.6, len(ordered) - 0.4), ticks=names, height=320)


def convergence_chart(idn: Identification) -> Chart:
    """Best fitness (6) per generation, one line per trial."""
    best = min(range(len(idn.trials)), key=lambda i: float(idn.trials[i].fitness))
    order = [i for i in range(len(idn.trials)) if i != best] + [best]
    traces = []
    for i in order:
        history = np.asarray(idn.trials[i].history, dtype=np.float64)
        front = i == best
        label = "best trial" if front and len(order) > 1 else "other trials" if i == order[0] and len(order) > 1 else ""
        traces.append(
            Trace(np.arange(1.0, len(history) + 1.0), history, label, "faster" if front else "faint", width=1.8 if front else 1.0)
        )
    positive = all(float(t.y.min(initial=1.0)) > 0.0 for t in traces)
    panel = Panel("best fitness (6)", tuple(traces), log=positive)
    return Chart(
        "convergence", "generation", (panel,), "The genetic search: the best fitness so far, before the local fits.", height=300
    )


def roots_chart(idn: Identification, hz: bool = False) -> Chart:
    """Poles and zeros in the s-plane [rad/s], or divided by 2 pi [Hz], with two standard deviations."""
    scale, u = (1.0 / math.tau, "Hz") if hz else (1.0, "rad/s")
    traces = []
    for kind, role in (("pole", "linear"), ("zero", "faster")):
        points = roots_of(idn.parameters, kind)
        if not points:
            continue
        x, y, dx, dy = (scale * np.array(values) for values in zip(*points, strict=True))
        traces.append(Trace(x, y, f"{kind}s", role, "crosses" if kind == "pole" else "rings", spread=2.0 * dy))
        for xi, yi, d in zip(x.tolist(), y.tolist(), dx.tolist(), strict=True):
            if d > 0.0:
                traces.append(Trace(np.array([xi - 2.0 * d, xi + 2.0 * d]), np.array([yi, yi]), "", role, width=1.2, hover=False))
    panel = Panel(f"imaginary part [{u}]", tuple(traces))
    ends = np.concatenate([t.x for t in traces]) if traces else np.zeros(1)
    low, high = float(ends.min()), float(ends.max())
    room = 0.15 * (high - low) or 1.0
    text = "Poles and zeros in the s-plane, bars of 2 standard deviations."
    return Chart("roots", f"real part [{u}]", (panel,), text, limits=(low - room, high + room), height=380)


def roots_of(parameters: Mapping[str, Estimate], kind: str) -> list[tuple[float, float, float, float]]:
    """(real, imaginary, their deviations) of every pole or zero; 0 where no deviation is known."""
    points = []
    for name, e in parameters.items():
        if not name.startswith(f"{kind}_"):
            continue
        if "_pair_" not in name:
            points.append((e.value, 0.0, _finite(e.std), 0.0))
        elif name.endswith("_real"):
            im = parameters[name.removesuffix("_real") + "_imaginary"]
            points += [(e.value, sign * im.value, _finite(e.std), _finite(im.std)) for sign in (1.0, -1.0)]
    return points


def _finite(std: float) -> float:
    return std if math.isfinite(std) else 0.0
