"""The page of the trends of a fleet: its axes as a table that sorts, changes, siblings, and the courses as small pictures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from html import escape
from pathlib import Path
from urllib.parse import quote

import numpy as np

from gaident.errors import GaidentError
from gaident.files import write_whole
from gaident.fleets.dataset import parts_of, read_part
from gaident.fleets.found import Course, Trends, day_of
from gaident.reporting.report import report_page
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.results.store import load

__all__ = ["write_page"]

MOST_DRAWN = 600  # no decision: drawn: pictures of a page, those with changes first
DIGITS = 3  # no decision: drawn: of a number at an axis, at least
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 300, 130, 56, 8, 8, 18  # no decision: drawn: pixels
ROOM = 0.08  # no decision: drawn: above and below the values
SECURITY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"

STYLE = """
body{font:15px/1.45 system-ui,sans-serif;margin:2em auto;max-width:1280px;padding:0 1em;color:#1c2733;background:#fff}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em}
.wide{overflow-x:auto}table{border-collapse:collapse;width:100%}
th,td{padding:.35em .7em;text-align:left;border-bottom:1px solid #dde3e9}
th{cursor:pointer;background:#f3f6f9;white-space:nowrap}th[aria-sort=ascending]::after{content:" \\25b2"}
th[aria-sort=descending]::after{content:" \\25bc"}td.n{text-align:right;font-variant-numeric:tabular-nums}
tr[data-to]{cursor:pointer}tr[data-to]:hover{background:#eef5fb}.many{display:flex;flex-wrap:wrap;gap:14px}
figure{margin:0;border:1px solid #dde3e9;border-radius:4px;padding:6px}figcaption{font-size:12px;max-width:300px}
figure.changed{border-color:#c2410c}svg text{font:10px system-ui,sans-serif;fill:#51606e}a{color:#0b5cad}.note{color:#51606e}
"""
SCRIPT = """
document.querySelectorAll('th').forEach(h=>h.addEventListener('click',()=>{
 const b=h.closest('table').tBodies[0],k=h.cellIndex,up=h.getAttribute('aria-sort')!=='ascending';
 h.parentNode.querySelectorAll('th').forEach(o=>o.removeAttribute('aria-sort'));h.setAttribute('aria-sort',up?'ascending':'descending');
 const v=r=>r.cells[k].dataset.v??r.cells[k].textContent;
 [...b.rows].sort((x,y)=>{const p=v(x),q=v(y),d=p-q;return (isNaN(d)?p.localeCompare(q):d)*(up?1:-1)}).forEach(r=>b.append(r))}));
document.querySelectorAll('tr[data-to]').forEach(r=>r.addEventListener('click',e=>{if(!e.target.closest('a'))location=r.dataset.to}));
"""

Cell = tuple[str, float | None]
"""What a cell shows, and the number that it is sorted by."""


def write_page(found: Trends, folder: Path, target: Path, reports: bool) -> None:
    """Write the page, and the reports that it opens where they are wanted. Raises OSError."""
    links = _reports(found, folder, target) if reports else {}
    failed = sum(a.failed for a in found.axes)
    counts = f"{len(found.axes)} axes, {sum(a.logs for a in found.axes)} logs, {failed} of them without a result."
    changes = len(found.changes)
    told = f"{changes or 'No'} change{'' if changes == 1 else 's'}."
    parts = [f"<h1>Fleet: {escape(folder.name)}</h1>", f"<p>{counts} {told}</p>"]
    by_axis: dict[str, int] = {}
    for change in found.changes:
        by_axis[change.axis] = by_axis.get(change.axis, 0) + 1
    apart: dict[str, list[str]] = {}
    for sibling in found.siblings:
        apart.setdefault(sibling.axis, []).append(sibling.quantity)
    heads: tuple[str, ...] = (
        "axis",
        "changes",
        "differs from its siblings in",
        "last log",
        "verdict",
        "causes",
        "logs",
        "without a result",
    )
    rows: list[tuple[str, Sequence[Cell]]] = [
        (
            links.get(a.log, ""),
            (
                *(_text(a.axis), _whole(by_axis.get(a.axis, 0)), _text(", ".join(apart.get(a.axis, [])))),
                *(_text(a.last.replace("T", " ")), _text(a.verdict), _text(a.causes.replace("_", " "))),
                *(_whole(a.logs), _whole(a.failed)),
            ),
        )
        for a in found.axes
    ]
    parts += [f"<p>{escape(found.nothing_to_say)}</p>"] * bool(found.nothing_to_say)
    parts += ["<h2>Axes</h2>", _table(heads, rows)]
    if found.changes:
        heads = ("axis", "what changed", "since", "seen on", "from", "to", "unit", "change [%]", "+- [%]")
        rows = [
            (
                links.get(c.log, ""),
                (
                    *(_text(c.axis), _text(c.quantity), _text(day_of(c.began)), _text(day_of(c.found))),
                    *(_number(c.before), _number(c.after), _text(c.unit), _percent(c.share), _percent(c.std)),
                ),
            )
            for c in reversed(found.changes)
        ]
        parts += ["<h2>Changes</h2>", _table(heads, rows)]
    if found.siblings:
        heads = ("axis", "what differs", "value", "middle of all axes", "unit", "spreads away")
        rows = [
            ("", (_text(s.axis), _text(s.quantity), _number(s.value), _number(s.middle), _text(s.unit), _number(s.spreads)))
            for s in found.siblings
        ]
        parts += ["<h2>Axes that differ from their siblings</h2>", _table(heads, rows)]
    parts += _pictures(found)
    if found.poor:
        heads = ("axis", "parameter", "why")
        rows = [("", (_text(c.axis), _text(c.quantity), _text(c.poor))) for c in found.poor]
        body = f"<details><summary>{len(rows)} of {len(found.courses)} courses</summary>{_table(heads, rows)}</details>"
        parts += ["<h2>Too poor to say</h2>", body]
    policy = f'<meta http-equiv="Content-Security-Policy" content="{SECURITY}">'
    head = f'<meta charset="utf-8">{policy}<title>Fleet: {escape(folder.name)}</title><style>{STYLE}</style>'
    body = "\n".join(parts)
    text = f'<!doctype html><html lang="en"><head>{head}</head><body>{body}<script>{SCRIPT}</script></body></html>\n'
    write_whole(target, text.encode())


def _reports(found: Trends, folder: Path, target: Path) -> dict[str, str]:
    """Log -> link to its report, for the last log of each axis and the first behind each change."""
    wanted = {a.log for a in found.axes if a.log} | {c.log for c in found.changes}
    beside = target.with_name(f"{target.stem}_reports")
    links: dict[str, str] = {}
    for axis, _, file in parts_of(folder, "logs"):
        for row in read_part(file, "logs"):
            if row["log"] not in wanted or not row["result"]:
                continue
            try:
                result = load(folder / row["result"])
            except GaidentError:
                continue  # it was removed: the row stays without a report
            if isinstance(result, (Diagnosis, Identification)):
                beside.mkdir(exist_ok=True)
                name = f"{Path(row['result']).stem}.html"
                about = {"axis": axis, "log": row["log"], "time": row["time"].replace("T", " ")}
                write_whole(beside / name, report_page(result, axis=row["kind"], about=about, live=False).encode())
                links[row["log"]] = f"{quote(beside.name)}/{name}"
    return links


def _text(text: str) -> Cell:
    return text, None


def _whole(number: int) -> Cell:
    return str(number), float(number)


def _number(number: float) -> Cell:
    return f"{number:.4g}", number


def _percent(share: float) -> Cell:
    return f"{100.0 * share:+.1f}", share


def _table(heads: Sequence[str], rows: Iterable[tuple[str, Sequence[Cell]]]) -> str:
    """rows: (what the row opens, "" for nothing, its cells)."""
    top = "".join(f"<th>{escape(h)}</th>" for h in heads)
    body = []
    for to, cells in rows:
        shown = [
            f"<td>{escape(text)}</td>" if value is None else f'<td class="n" data-v="{value!r}">{escape(text)}</td>'
            for text, value in cells
        ]
        if to:
            shown[0] = f'<td><a href="{escape(to)}">{escape(cells[0][0])}</a></td>'
        body.append(f"<tr{f' data-to={chr(34)}{escape(to)}{chr(34)}' if to else ''}>{''.join(shown)}</tr>")
    return f'<div class="wide"><table><thead><tr>{top}</tr></thead><tbody>{"".join(body)}</tbody></table></div>'


def _pictures(found: Trends) -> list[str]:
    """The courses, by parameter, those with changes first."""
    drawn = [c for c in found.courses if len(c.values) > 1]
    kept = sorted(drawn, key=lambda c: not c.changes)[:MOST_DRAWN]
    parts = []
    if len(kept) < len(drawn):
        parts.append(f'<p class="note">{len(kept)} of {len(drawn)} courses are drawn, those with changes first.</p>')
    for quantity in dict.fromkeys(c.quantity for c in kept):
        own = [_picture(c) for c in kept if c.quantity == quantity]
        parts += [f"<h2>{escape(quantity[:1].upper() + quantity[1:])}</h2>", f'<div class="many">{"".join(own)}</div>']
    return parts


def _picture(c: Course) -> str:
    """Values with their deviations, and a line for each level between changes."""
    t = np.array([datetime.fromisoformat(time).timestamp() for time in c.times])
    low, high = float(np.min(c.values - c.deviations)), float(np.max(c.values + c.deviations))
    room = ROOM * (high - low) or abs(high) or 1.0
    low, high = low - room, high + room
    span = float(t[-1] - t[0]) or 1.0

    def x(time: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (time - float(t[0])) / span

    def y(value: float) -> float:
        return TOP + (HEIGHT - TOP - BOTTOM) * (high - value) / (high - low)

    marks = [
        f'<path d="M{x(when):.1f} {y(v - s):.1f}V{y(v + s):.1f}" stroke="#9db4c8"/>'
        f'<circle cx="{x(when):.1f}" cy="{y(v):.1f}" r="1.8" fill="#0b5cad"/>'
        for when, v, s in zip(t, c.values, c.deviations, strict=True)
    ]
    begins = [datetime.fromisoformat(change.began).timestamp() for change in c.changes]
    ends = [float(t[0]), *begins, float(t[-1])]
    levels = [c.changes[0].before, *(change.after for change in c.changes)] if c.changes else [float(np.median(c.values))]
    lines = [
        f'<path d="M{x(ends[k]):.1f} {y(level):.1f}H{x(ends[k + 1]):.1f}" stroke="#c2410c" stroke-width="1.5"/>'
        for k, level in enumerate(levels)
    ]
    lines += [f'<path d="M{x(b):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#c2410c" stroke-dasharray="3 3"/>' for b in begins]
    shown = low + room, high - room
    # As many digits as tell the two apart, and one more.
    size = max(map(abs, shown))
    apart = shown[1] - shown[0]
    digits = max(DIGITS, 2 + int(np.ceil(np.log10(size / apart)))) if apart > 0.0 and size > 0.0 else DIGITS
    texts = [f'<text x="2" y="{y(v) + 3:.1f}">{v:.{digits}g}</text>' for v in shown]
    texts += [f'<text x="{LEFT}" y="{HEIGHT - 4}">{day_of(c.times[0])}</text>']
    texts += [f'<text x="{WIDTH - RIGHT}" y="{HEIGHT - 4}" text-anchor="end">{day_of(c.times[-1])}</text>']
    frame = f'<path d="M{LEFT} {TOP}V{HEIGHT - BOTTOM}H{WIDTH - RIGHT}" stroke="#9aa7b3" fill="none"/>'
    said = "; ".join(f"{100.0 * change.share:+.0f} % since {day_of(change.began)}" for change in c.changes)
    caption = f"<b>{escape(c.axis)}</b> [{escape(c.unit)}] {escape(said or c.poor)}"
    box = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" role="img" aria-label="{escape(c.axis)}"'
    drawn = "".join([frame, *marks, *lines, *texts])
    kind = ' class="changed"' if c.changes else ""
    return f"<figure{kind}><svg {box}>{drawn}</svg><figcaption>{caption}</figcaption></figure>"
