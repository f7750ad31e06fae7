"""Results in the units that a user works with, rpm, % of the rated torque, degrees, mm/s, beside SI.

Values in sentences stay in SI; tables have a column beside, and axes of pictures are in the user's units.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from gaident.axis import unit as unit_of
from gaident.checks import one_of, real_number
from gaident.data.formats.units import Constants, factor, known_units, of_other_axis
from gaident.errors import SettingsError
from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import ANGULAR, Estimate, of_axis
from gaident.results.identification import Identification
from gaident.show.chart import Chart, Panel, Trace
from gaident.show.wording import number, with_std

if TYPE_CHECKING:
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

__all__ = ["Scales", "beside", "figure_in_units", "in_units", "scales_of", "shown_in", "with_column"]

Scales = Mapping[str, tuple[str, float]]
"""SI unit as the axis has it -> (the user's unit, its number in one SI unit)."""

_SI = {"velocity": "rad/s", "torque": "N m", "position": "rad"}
_TITLE = re.compile(r"\[([^\]]+)\]$")


def scales_of(units: Mapping[str, str | float] | None, axis: str) -> Scales:
    """The user's units: {"velocity": "rpm", "torque": "%", "position": "deg"}, and the constants that they need.

    Constants are those of `gaident.read` (rated_torque, torque_constant, counts_per_turn; a screw: mm, mm/s, N of a rotary axis).
    Raises SettingsError for another key and for a unit of the other kind of axis, ReadError for one that is not known or that
    lacks its constant.
    """
    if units is None:
        return {}
    if not isinstance(units, Mapping):
        raise SettingsError(f"units is {units!r:.80}: give a dictionary, for example {{'velocity': 'rpm'}}")
    named = [f.name for f in fields(Constants)]
    for key in units:
        one_of(key, "units: the quantity", (*_SI, *named), SettingsError)
    given = {key: real_number(value, key, SettingsError) for key, value in units.items() if key in named}
    constants = Constants(**{**given, **({"screw": None} if axis == "linear" else {})})
    found = {}
    for quantity, rotary in _SI.items():
        wanted = units.get(quantity)
        if wanted is None:
            continue
        if not isinstance(wanted, str):
            raise SettingsError(f"units: {quantity} is {wanted!r}: name a unit, for example 'rpm'")
        of_motor = axis == "rotary" and constants.screw is not None  # lengths are those of its screw
        if of_other_axis(quantity, wanted, axis) and not of_motor:
            listed = ", ".join(known_units(quantity, axis))
            raise SettingsError(f"units: {quantity} is {wanted!r}, which no {axis} axis is measured in: give one of {listed}")
        size, si = factor(quantity, wanted, constants), unit_of(rotary, axis)
        if wanted != si:
            found[si] = wanted, 1.0 / size
    return found | _derived(found, axis)


def _derived(found: Scales, axis: str) -> dict[str, tuple[str, float]]:
    """The units of gains and of viscous friction, where a torque has one of the user: % per rpm."""
    torque = unit_of("N m", axis)
    if torque not in found:
        return {}
    name, size = found[torque]
    made = {}
    for rotary, of in (("N m s/rad", "rad/s"), ("N m/rad", "rad")):
        under, per = found.get(si := unit_of(of, axis), (si, 1.0))
        made[unit_of(rotary, axis)] = f"{name}/{f'({under})' if '/' in under else under}", size / per
    return made


def beside(scales: Scales, name: str, value: float, std: float | None, si: str) -> str:
    """A value in the user's unit, "5.01 +- 0.02 %"; "" where it has none."""
    if si not in scales or name in ANGULAR or not np.isfinite(value):
        return ""
    shown, size = scales[si]
    return f"{with_std(size * value, None if std is None else size * std) if std else number(size * value)} {shown}"


def with_column(
    rows: Sequence[tuple[str, ...]], what: str, sizes: Sequence[float | None], si: str, scales: Scales
) -> list[tuple[str, ...]]:
    """Rows of a table, the first its head, with their sizes [si] in the user's unit as a last column, where there is one."""
    if si not in scales:
        return list(rows)
    shown, per = scales[si]
    column = (f"{what} [{shown}]", *("" if x is None or not np.isfinite(x) else number(per * x) for x in sizes))
    return [(*row, more) for row, more in zip(rows, column, strict=True)]


def shown_in(result: Diagnosis | Identification, scales: Scales, axis: str) -> dict[str, object]:
    """The figures of a result in the user's units, for JSON; {} where none was asked for."""
    if not scales:
        return {}
    v = unit_of("rad/s", axis)
    name, size = scales.get(v, (v, 1.0))
    data: dict[str, object] = {"units": {si: {"unit": shown, "per_si": per} for si, (shown, per) in scales.items()}}
    if isinstance(result, Identification):
        return {**data, "rmse": {"value": size * result.rmse, "unit": name}}
    data |= {when: {"rmse": size * fit.rmse, "unit": name} for when, fit in (("before", result.before), ("after", result.after))}
    data["findings"] = [
        {
            "effect": f.effect,
            "sides": list(f.sides),
            "parameters": {key: _estimate(key, e, scales, axis) for key, e in f.parameters.items()},
        }
        for f in result.findings
    ]
    return data


def _estimate(name: str, e: Estimate, scales: Scales, axis: str) -> dict[str, object]:
    e = of_axis(name, e, axis)
    shown, size = (e.unit, 1.0) if name in ANGULAR else scales.get(e.unit, (e.unit, 1.0))
    return {"value": size * e.value, "std": None if e.std is None else size * e.std, "unit": shown}


def in_units(chart: Chart, scales: Scales) -> Chart:
    """The chart with its axes in the user's units."""
    x, size = _title(chart.x, scales)
    limits = None if chart.limits is None else (chart.limits[0] * size, chart.limits[1] * size)
    panels = tuple(_panel(panel, size, scales) for panel in chart.panels)
    ticks = tuple((place * size, text) for place, text in chart.ticks)
    return replace(chart, x=x, limits=limits, ticks=ticks, panels=panels) if scales else chart


def _title(title: str, scales: Scales) -> tuple[str, float]:
    """(the title with the user's unit in brackets, what its values are multiplied by)."""
    found = _TITLE.search(title)
    si, _, density = ("", "", "") if found is None else found[1].partition("/√Hz") if "/√Hz" in found[1] else (found[1], "", "")
    if found is None or si not in scales:
        return title, 1.0
    shown, size = scales[si]
    behind = found[1].removeprefix(si) + density
    return f"{title[: found.start()]}[{shown}{behind}]", size


def _panel(panel: Panel, along: float, scales: Scales) -> Panel:
    y, size = _title(panel.y, scales)

    def trace(t: Trace) -> Trace:
        return replace(t, x=t.x * along, y=t.y * size, spread=None if t.spread is None else t.spread * size)

    return replace(
        panel,
        y=y,
        traces=tuple(map(trace, panel.traces)),
        bands=tuple(replace(b, low=b.low * size, high=b.high * size) for b in panel.bands),
        marks=tuple(replace(m, x=m.x * along, y=None if m.y is None else m.y * size) for m in panel.marks),
        limits=None if panel.limits is None else (panel.limits[0] * size, panel.limits[1] * size),
        ticks=tuple(tick * size for tick in panel.ticks),
    )


def figure_in_units(figure: Figure, scales: Scales) -> Figure:
    """The figure with its linear axes in the user's units: ticks at round numbers of theirs. The drawn data stay in SI."""
    for ax in figure.axes if scales else ():
        for axis in (ax.xaxis, ax.yaxis):
            title, size = _title(axis.get_label_text(), scales)
            if size != 1.0 and axis.get_scale() == "linear":
                axis.set_label_text(title)
                _rescale(axis, size)
    return figure


def _rescale(axis: Axis, size: float) -> None:
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    class Round(MaxNLocator):
        def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
            return [tick / size for tick in super().tick_values(vmin * size, vmax * size)]

    axis.set_major_locator(Round(nbins=8, steps=[1, 2, 2.5, 5, 10]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{size * value + 0.0:.6g}"))
