"""Thresholds by the open records, and the tables of the closed ones: pure functions of the lines that naming.py writes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from blind_tables import listing, table
from scipy.stats import binom, norm

from blind_judge import CLASSES, EQUIVALENT
from drive_rig import OUTSIDE

Line = dict[str, Any]

LEAST_GAIN = 0.02
"""Share of the linear model's error that the oracle has to gain, or the record shows no gain."""


def wilson(hits: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Wilson's interval of a rate."""
    z = float(norm.ppf(0.5 + 0.5 * level))
    middle, half = (hits + 0.5 * z * z) / (n + z * z), z / (n + z * z) * np.sqrt(hits * (n - hits) / n + 0.25 * z * z)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def rate(flags: Iterable[bool]) -> str:
    """Count and interval."""
    listed = list(flags)
    if not listed:
        return "-"
    low, high = wilson(sum(listed), len(listed))
    return f"{sum(listed)}/{len(listed)} [{100 * low:.0f}, {100 * high:.0f}]"


def right(line: Line, judged: Mapping[str, Any]) -> bool:
    """Nothing named where nothing is hidden, no wrong name outside the library, else every effect, and no wrong name.

    Of an effect that no record tells from another one, its own name is asked for here too: a method may know such classes.
    """
    hidden = line["cell"]["effects"]
    if not hidden:
        return not judged["named"]
    if set(hidden) & set(OUTSIDE):
        return not judged["wrong"]
    return bool(judged["in_set"] and not judged["wrong"])


def chosen_threshold(lines: Sequence[Line], price: float = 1.0) -> str | None:
    """The threshold with the most right records less `price` for each with a wrong name; of several the middle one."""
    if not lines:
        return None
    scores = []
    for threshold in lines[0]["answers"]:
        judged = [(x, x["answers"][threshold]["judged"]) for x in lines]
        scores.append(sum(right(x, j) - price * bool(j["wrong"]) for x, j in judged))
    best = [t for t, score in zip(lines[0]["answers"], scores, strict=True) if score == max(scores)]
    return best[len(best) // 2]


def middle(lines: Sequence[Line]) -> str:
    """The threshold in the middle of the grid, where no open record chooses one."""
    grid = list(lines[0]["answers"])
    return grid[len(grid) // 2]


def gain(line: Line, answer: Mapping[str, Any]) -> float | None:
    """Fall of the held-out rmse over the oracle's; None where there is none, or nothing to gain."""
    oracle, before, after = line.get("oracle"), line.get("before"), answer["rmse"]
    if oracle is None or after is None or not before or before - oracle < LEAST_GAIN * before:
        return None
    return float((before - after) / (before - oracle)) if np.isfinite(after) else -np.inf


def left_over(line: Line, answer: Mapping[str, Any]) -> float | None:
    """The held-out rmse over the linear model's, in %; None where there is none."""
    before, after = line.get("before"), answer["rmse"]
    return None if after is None or not before else float(100.0 * after / before)


def median_interval(values: Sequence[float], level: float = 0.95) -> tuple[float, float]:
    """Of the median, by order statistics: exact for independent values, at least `level`; infinite for fewer than six."""
    n = len(values)
    out = int(binom.ppf(0.5 - 0.5 * level, n, 0.5))  # P(fewer than out of n below the median) stays within the tail
    if out < 1:
        return -np.inf, np.inf
    ordered = sorted(values)
    return ordered[out - 1], ordered[n - out]


def middle_of(values: Iterable[float | None], digits: int = 3) -> str:
    """Median, its interval, and how many there are."""
    known = [v for v in values if v is not None]
    if not known:
        return "-"
    low, high = median_interval(known)
    return f"{np.median(known):.{digits}g} [{low:.{digits}g}, {high:.{digits}g}] (n = {len(known)})"


def report(lines: Sequence[Line], lines_of_code: Mapping[str, int], names_nothing: Sequence[str]) -> str:
    """All tables. Asserts that every method saw the same records."""
    by_phase = {phase: [x for x in lines if x["phase"] == phase and "answers" in x] for phase in ("open", "closed")}
    digests: dict[str, str] = {}
    for x in by_phase["closed"] + by_phase["open"]:
        key = x["key"].rsplit("/", 1)[0]
        assert digests.setdefault(key, x["digest"]) == x["digest"], f"{x['method']} saw another record: {key}"
    closed = by_phase["closed"]
    names, lenient, figures, mistakes = [], [], [], []
    for method in [m for m in lines_of_code if any(x["method"] == m for x in closed)]:
        mine = [x for x in closed if x["method"] == method]
        opened = [x for x in by_phase["open"] if x["method"] == method]
        threshold = chosen_threshold(opened) or middle(mine)
        answers = [(x, x["answers"][threshold]) for x in mine]
        judged = [(x, a["judged"]) for x, a in answers]
        if method not in names_nothing:
            names.append([method, _shown(mine, threshold), *_names_row(judged)])
            mistakes.append([method, *_mistakes(judged)])
            loose = chosen_threshold(opened, 0.0) or threshold
            lenient.append([method, _shown(mine, loose), *_names_row([(x, x["answers"][loose]["judged"]) for x in mine])])
        gains = [gain(x, a) for x, a in answers if x["cell"]["group"] in ("effects", "pairs")]
        errors = [e for _, j in judged for e in j["parameter_errors"].values()]
        outside = [left_over(x, a) for x, a in answers if x["cell"]["group"] == "outside"]
        figures.append([method, middle_of(gains), middle_of(outside), middle_of((100.0 * e for e in errors), 2),
                        middle_of(x["seconds"] for x in mine), f"{max(x['seconds'] for x in mine):.3g}",
                        lines_of_code[method]])  # fmt: skip
    head = ["method", "threshold", "false alarms", "exact", "in set", "wrong name", "of them its equivalent", "two: both found",
            "loops: in set", "outside: wrong name"]  # fmt: skip
    parts = [
        f"{len({x['key'].rsplit('/', 1)[0] for x in closed})} closed records, thresholds by "
        f"{len({x['key'].rsplit('/', 1)[0] for x in by_phase['open']})} open ones; counts with Wilson's 95 % intervals in %",
        table(head, names),
        "The same with thresholds for the most right records, a wrong name costs no more than a missed one:",
        table(head, lenient),
        "Medians with their 95 % intervals by order statistics:",
        table(
            [
                "method",
                "held-out gain over the oracle's",
                "outside: error left [%]",
                "parameter error [%]",
                "seconds",
                "longest",
                "lines",
            ],
            figures,
        ),
        table(["method", "clean: named", "hidden: named wrongly"], mistakes),
    ]
    crashed = [f"- {x['key']}: {x['crash']}" for x in lines if "crash" in x]
    return "\n\n".join(parts + (["Crashes:\n\n" + "\n".join(crashed)] if crashed else []))


def _shown(lines: Sequence[Line], threshold: str) -> str:
    """A threshold, nothing for a method that has none to choose."""
    return f"{float(threshold):g}" if len(lines[0]["answers"]) > 1 else ""


def _names_row(judged: Sequence[tuple[Line, Mapping[str, Any]]]) -> list[str]:
    clean = [(x, j) for x, j in judged if not x["cell"]["effects"]]
    loops = [(x, j) for x, j in judged if x["cell"]["group"] == "loops" and x["cell"]["effects"]]
    one = [(x, j) for x, j in judged if x["cell"]["group"] == "effects"]
    apart = [(x, j) for x, j in one if x["cell"]["effects"][0] not in CLASSES]
    pairs = [(x, j) for x, j in judged if x["cell"]["group"] == "pairs"]
    outside = [(x, j) for x, j in judged if x["cell"]["group"] == "outside"]
    wrong = [(x, j) for x, j in (*one, *pairs, *loops) if j["wrong"]]
    alike = [{EQUIVALENT.get(e, e) for e in x["cell"]["effects"]} >= set(j["wrong"]) for x, j in wrong]
    return [
        rate(bool(j["named"]) for _, j in clean),
        rate(j["exact"] for _, j in apart),
        rate(j["in_set"] for _, j in one),
        rate(bool(j["wrong"]) for _, j in (*one, *pairs, *loops)),
        str(sum(alike)),
        rate(j["in_set"] for _, j in pairs),
        rate(j["in_set"] for _, j in loops),
        rate(bool(j["wrong"]) for _, j in outside),
    ]


def _mistakes(judged: Sequence[tuple[Line, Mapping[str, Any]]]) -> list[str]:
    from collections import Counter

    clean = Counter(name for x, j in judged if not x["cell"]["effects"] for name in j["named"])
    wrong = Counter(name for x, j in judged if x["cell"]["effects"] for name in j["wrong"])
    return [listing(clean), listing(wrong)]
