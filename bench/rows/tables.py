"""What was measured of the rows of the policy: a summary for each, the file that keeps them, and tables as markdown."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rows.watch import STEPS, moved

from gaident.policy.table import PolicyRow

MEASURED = Path(__file__).with_name("measured.json")
HEAD = ["row", "cases", "read in", "no decision changes", "at", "outcomes", "changed", "said", "other", "CPU s"]

Lines = Mapping[str, Mapping[str, Any]]


def summary(row: PolicyRow, base: Lines, found: Mapping[float, Mapping[str, Mapping[str, Any] | None]]) -> dict[str, Any]:
    """What a row decides: the lines of its cases as the policy is, and those at each other value; None: not run there."""
    turned = {step for line in base.values() for step in line["turned"].get(row.name, [])}
    return {
        "value": row.value,
        "cases": len(base),
        "used": sum(row.name in line["used"] for line in base.values()),
        "unchanged": [_last(row, [s for s in reversed(STEPS) if s < 0], turned), _last(row, [s for s in STEPS if s > 0], turned)],
        "outcomes": dict(Counter(line["outcome"] for line in base.values())),
        "at": [{"value": value} | _compared(base, lines) for value, lines in found.items()],
    }


def _compared(base: Lines, found: Mapping[str, Mapping[str, Any] | None]) -> dict[str, Any]:
    """The same cases at another value: what came out otherwise, of those that were run again."""
    lines = {key: line for key, line in found.items() if line is not None}
    again = [key for key in lines if lines[key] is not base[key]]
    same = [key for key in again if base[key]["said"] == lines[key]["said"]]
    changed = {key: f"{base[key]['outcome']} -> {lines[key]['outcome']}" for key in again}
    return {
        "again": len(again),
        "missing": len(found) - len(lines),
        "outcomes": dict(Counter(line["outcome"] for line in lines.values())),
        "changed": {key: text for key, text in changed.items() if base[key]["outcome"] != lines[key]["outcome"]},
        "said": len(again) - len(same),
        "other": sum(base[key]["detail"] != lines[key]["detail"] for key in same),
        "seconds": [round(sum(some[key]["seconds"] for key in again), 1) for some in (base, lines)],
    }


def _last(row: PolicyRow, steps: Sequence[float], turned: set[float]) -> float:
    """The value at the last of some steps before a decision changes; the row's own where the first changes one."""
    last = row.value
    for step in steps:
        value = moved(row, step)
        if step in turned:
            break
        last = last if value is None else value
    return last


def merged(found: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """What the file contains, with the rows and kinds of cases that were measured now in the place of the old ones."""
    there = json.loads(MEASURED.read_text(encoding="utf-8")) if MEASURED.exists() else []
    rows = {(each["name"], each["kind"]): dict(each) for each in [*there, *found]}
    return [rows[key] for key in sorted(rows) if rows[key]["used"]]


def decides_nothing(measured: Mapping[str, Any]) -> bool:
    """Whether a row can be moved both ways and everything that is said stays as it is."""
    return all(not at["missing"] and not at["said"] and not at["changed"] for at in measured["at"])


def report(found: Sequence[Mapping[str, Any]], head: bool = True) -> str:
    """A table: each row as it is, then at either value; and the cases whose outcome changed."""
    lines = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)] if head else []
    for each in found:
        low, high = each["unchanged"]
        span = f"{low:.3g} to {high:.3g}" if each["used"] else "not read"
        first = [f"`{each['name']}` = {each['value']:g}", each["cases"], each["used"], span]
        lines.append(_line([*first, "as it is", counts(each["outcomes"]), "", "", "", ""]))
        for at in each["at"]:
            before, after = at["seconds"]
            time = f"{after:g} for {before:g}" if at["again"] else f"{at['missing']} not run" if at["missing"] else ""
            lines.append(_line(["", "", "", "", f"{at['value']:.3g}", counts(at["outcomes"]), len(at["changed"]), at["said"],
                                at["other"], time]))  # fmt: skip
            lines += [f"<!-- {key}: {change} -->" for key, change in at["changed"].items()]
    return "\n".join(lines)


def counts(outcomes: Mapping[str, int]) -> str:
    order = ("right", "in set", "missed", "wrong", "false alarm", "refused", "crash")
    return ", ".join(f"{outcomes[name]} {name}" for name in order if outcomes.get(name))


def _line(cells: Sequence[Any]) -> str:
    return "| " + " | ".join(map(str, cells)) + " |"
