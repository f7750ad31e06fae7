"""The chapter "What to do": other gains, feedforward, and what mending each cause would bring."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gaident.axis import called, percent, said, unit, velocity_unit, word
from gaident.policy.table import POLICY
from gaident.results.retuning import Retuning
from gaident.show.chart import Chart, Panel, Trace, series
from gaident.show.html import Html, Row, filled_table, joined, number, table, tag, typeset
from gaident.show.report.parts import Charts, Section, box, needs_record, sentences
from gaident.show.report.retuning_words import added_filters, asked_words, figure_rows, gain_rows
from gaident.show.report.views import Beforehand, Followed, LoopCurves, Mended, Remedies, View
from gaident.show.response_plots import phase_line
from gaident.show.units import Scales, beside

__all__ = ["remedies_section"]

ROLES = {"before": "linear", "after": "extended"}
HIDDEN = 0.005  # no decision: printed: 0 %
SPEEDS = 5  # no decision: printed: speeds of each direction


def remedies_section(view: View, drawn: Charts) -> Section:
    """Doubts about the model first, then what follows from it."""
    do, axis = view.remedies, view.axis
    if do is None:
        missing = "Other gains, feedforward and what a repair brings need the record."
        return Section("remedies", "What to do", needs_record(view, missing))
    return Section(
        "remedies",
        "What to do",
        _doubts(do.doubts, axis),
        _gains(do, view, drawn),
        _feedforward(do, view, drawn),
        _mended(do, view),
    )


def _doubts(doubts: Sequence[str], axis: str) -> Html:
    """The first line says it, then what else there is."""
    if not doubts:
        return Html()
    first, *others = doubts
    end = tag("p", "Do not act on this chapter before that is settled.")
    return box(tag("p", tag("b", typeset(said(first, axis)))), sentences(others, axis), end, kind="warn")


def _reason(what: str, why: str, axis: str) -> Html:
    text = said(why, axis)
    return box(tag("p", typeset(f"{what}: {text}{'' if text.endswith('.') else '.'}")), kind="quiet")


def _gains(do: Remedies, view: View, drawn: Charts) -> Html:
    axis = view.axis
    head, tuned = tag("h3", "Other gains for the velocity loop"), do.retuning
    if tuned is None:
        return joined((head, _reason("No gains are proposed", do.no_gains, axis)))
    gains: list[Row] = [tuple(map(typeset, row)) for row in gain_rows(tuned, axis, view.scales)]
    added = tag("p", f"Added in the path of the {word('torque', axis)}: {'; '.join(added_filters(tuned))}.")
    order = (0, 1, 3, 5, 2, 4)  # the values first: on a narrow screen a table goes on beyond its edge
    figures: list[Row] = [tuple(typeset(row[k]) for k in order) for row in figure_rows(tuned, axis)]
    unstable = "Under the given gains the identified drive is not stable."
    return joined(
        (
            head,
            filled_table(("", "before", "proposed", "unit", "before", "proposed"), gains),
            added if added_filters(tuned) else Html(),
            box(sentences(beyond, axis), kind="warn") if (beyond := [d for d in tuned.doubts if d not in do.doubts]) else Html(),
            tag("p", typeset(asked_words(tuned, axis))),
            box(tag("p", unstable), kind="warn") if tuned.before.stable.value < 1.0 else Html(),
            drawn.put(_loop_chart(do.loops)),
            drawn.put(_step_chart(do.loops, axis)),
            table(("", "before", "after", "unit", "before: 95 % of the drives", "after: 95 % of the drives"), [figures]),
            sentences((*tuned.simulated, *tuned.notes), axis),
            _more(tuned),
        )
    )


def _more(tuned: Retuning) -> Html:
    command = "gaident retune RESULT.json --dt {:.6g} --phase-margin {:g} --gain-margin {:g} --step {:.6g} --most-times {:g}"
    text = command.format(tuned.period, tuned.phase_margin, tuned.gain_margin, tuned.step, POLICY.raised)
    return tag("p", tag("small", "With other margins, a limit of the step or filters: "), tag("code", text, class_="command"))


def _loop_chart(loops: tuple[LoopCurves, ...]) -> Chart:
    size = tuple(Trace(c.frequency, np.abs(c.loop), c.name, ROLES[c.name], width=1.5) for c in loops)
    phase = tuple(Trace(c.frequency, phase_line(c.loop), "", ROLES[c.name], width=1.5) for c in loops)
    ends = np.array([min(c.frequency[0] for c in loops), max(c.frequency[-1] for c in loops)])
    one = Trace(ends, np.ones(2), "", "faint", width=1.0, dash="dot", hover=False)
    panels = (
        Panel("size of the loop", (*size, one), log=True, height=1.3),
        Panel("phase [deg]", phase, limits=(-200.0, 200.0), ticks=(-180.0, -90.0, 0.0, 90.0, 180.0)),
    )
    text = (
        "The velocity loop of the identified drive, broken at the controller's output: the phase margin is read where its size "
        "is 1, the gain margin where its phase is -180 deg."
    )
    return Chart("loop", "frequency [Hz]", panels, text, log=True, height=460)


def _step_chart(loops: tuple[LoopCurves, ...], axis: str) -> Chart | None:
    traces = tuple(
        Trace(c.time, c.velocity, c.name, ROLES[c.name], width=1.5)
        for c in loops
        if c.time is not None and c.velocity is not None
    )
    if not traces:
        return None
    end = max(float(t.x[-1]) for t in traces)
    text = f"Answer of the linear loop to a step of the velocity command by 1 {velocity_unit(axis)}, without limits."
    if len(traces) < len(loops):
        text += " The loop before is not stable and not drawn."
    panel = Panel(f"velocity [{velocity_unit(axis)}]", traces)
    return Chart("loop-step", "time after the step [s]", (panel,), text, limits=(0.0, end), height=300, shared=True)


def _feedforward(do: Remedies, view: View, drawn: Charts) -> Html:
    axis = view.axis
    head, found = tag("h3", "Feedforward"), do.tables
    if found is None:
        return joined((head, _reason("No feedforward is proposed", do.no_tables, axis)))
    torque = word("torque", axis)
    known = (
        ("in proportion to the acceleration", found.inertia, unit("kg m^2", axis)),
        ("in proportion to the velocity", found.viscous, unit("N m s/rad", axis)),
        ("constant", found.constant, unit("N m", axis)),
    )
    rows: list[Row] = [
        (what, number(value), typeset(si), typeset(beside(view.scales, "", value, None, si))) for what, value, si in known
    ]
    text = f"What the drive can add to the {torque} before an error arises, positive for a motion forwards."
    command = f"gaident feedforward RESULT.json --speed {found.velocity[-1]:.4g} --csv axis.csv --c axis.c"
    parts = [head, tag("p", text), filled_table(("", "value", "unit", ""), rows), _friction(found, view), _waves(found, axis)]
    parts += [sentences(found.notes, axis), _brought(found, view, drawn)]
    parts.append(tag("p", tag("small", "All of the tables as files: "), tag("code", command, class_="command")))
    return joined(parts)


def _friction(found: Beforehand, view: View) -> Html:
    """Friction at some speeds, in the user's units where there are some."""
    if not np.any(found.friction):
        return Html()
    half = len(found.velocity) // 2
    at = half + np.unique(np.linspace(0, half - 1, SPEEDS).round().astype(int))
    (speed, per_speed), (force, per_force) = (view.scales.get(si := unit(u, view.axis), (si, 1.0)) for u in ("rad/s", "N m"))
    rows: list[Row] = [
        (
            number(per_speed * float(found.velocity[k])),
            number(per_force * float(found.friction[k])),
            number(per_force * float(found.friction[2 * half - 1 - k])),
        )
        for k in at
    ]
    head = (f"speed [{speed}]", f"friction forwards, without the viscous part [{force}]", f"backwards [{force}]")
    return table(head, [rows])


def _waves(found: Beforehand, axis: str) -> Html:
    if not found.waves:
        return Html()
    force, linear = unit("N m", axis), axis == "linear"
    rows: list[Row] = [
        (said(called(w.effect), axis), number(w.order / math.tau if linear else w.order), number(w.sine), number(w.cosine))
        for w in found.waves
    ]
    return table(("", f"periods {word('per turn', axis)}", f"sine [{force}]", f"cosine [{force}]"), [rows])


def _brought(found: Beforehand, view: View, drawn: Charts) -> Html:
    """The following error without and with the tables, or why it is not there."""
    axis, followed = view.axis, found.following
    if followed is None:
        return _reason("What the tables bring is not simulated", found.no_following, axis)
    si, torque = unit(followed.unit, axis), unit("N m", axis)
    rows: list[Row] = []
    for name, loop, fall in followed.loops:
        less = "" if fall is None else typeset(percent(fall).removesuffix(" %"))
        own = typeset(beside(view.scales, "", loop.rms, None, si))
        rows.append((name, number(loop.rms), own, less, number(loop.largest), number(loop.torque)))
    most = f"largest {word('torque', axis)} [{torque}]"
    head = ("", f"following error, rms [{si}]", "", "less by [%]", f"largest [{si}]", most)
    return joined((filled_table(head, rows), drawn.put(_error_chart(followed, view)), sentences(followed.notes, axis)))


def _error_chart(followed: Followed, view: View) -> Chart:
    curves = (("before", followed.error_before), ("after", followed.error_after))
    traces = tuple(series(followed.time, error, name, ROLES[name]) for name, error in curves)
    panel = Panel(f"following error [{unit(followed.unit, view.axis)}]", traces)
    text = f"Command minus motion of the simulated loop on {followed.record}, as it is and with the tables."
    return Chart("following-error", "time [s]", (panel,), text, height=300, shared=True)


def _mended(do: Remedies, view: View) -> Html:
    axis = view.axis
    head, found = tag("h3", "If mended"), do.mended
    if found is None:
        return joined((head, _reason("What a repair brings is not shown", do.no_mended, axis)))
    return joined((head, _table_of(found, axis, view.scales)))


def _table_of(found: Mended, axis: str, scales: Scales) -> Html:
    si = unit(found.unit, axis)

    def row(what: str, error: float) -> Row:
        fall = 1.0 - error / found.now if found.now > 0.0 and math.isfinite(error) else math.nan
        less = "" if math.isnan(fall) else typeset(f"{round(100.0 * fall) + 0:d}")
        return what, number(error), typeset(beside(scales, "", error, None, si)), less

    rows: list[Row] = [("as it is", number(found.now), typeset(beside(scales, "", found.now, None, si)), "")]
    hidden = found.now > 0.0 and any(abs(error / found.now - 1.0) < HIDDEN for error in found.without.values())
    if found.retuned is not None:
        rows.append(row("with the proposed gains", found.retuned))
    twice = [effect for effect, _ in found.without]
    for (effect, side), error in found.without.items():
        at = f" at the {side}" if side and twice.count(effect) > 1 else ""
        rows.append(row(f"without {said(called(effect), axis)}{at}", error))
    text = (
        f"The following error (command minus motion, rms) of the extended model on {found.record}, simulated from rest: under "
        "the controller as it is, and with one cause taken out."
    )
    if hidden:
        text += f" A cause with 0 % does not show in it: the controller makes up for that with its {word('torque', axis)}."
    return joined((tag("p", text), filled_table(("", f"following error [{si}]", "", "less by [%]"), rows)))
