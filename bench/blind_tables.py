"""Tables of the blind tests, as markdown: pure functions of the result lines that blind.py writes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.stats import beta

from blind_judge import CLASSES, DRIVERS, EQUIVALENT
from drive_cases import ANYWHERE, EFFECTS, KINDS, NOISE_EFFECTS
from drive_rig import AT_LOAD, OUTSIDE

Line = dict[str, Any]
DELAYS = {"transport_delay", "velocity_filter", "torque_lag"}
SHORT = {"none": "none", "unexplained": "unexpl.", "abstained": "abst.", "abstained without it": "abst. w/o"}


def interval(hits: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Clopper-Pearson confidence interval of a rate."""
    tail = (1 - level) / 2
    low = 0.0 if hits == 0 else float(beta.ppf(tail, hits, n - hits + 1))
    high = 1.0 if hits == n else float(beta.ppf(1 - tail, hits + 1, n - hits))
    return low, high


def rate(hits: int, n: int) -> str:
    if not n:
        return "-"
    low, high = interval(hits, n)
    return f"{hits}/{n} = {100 * hits / n:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def share(flags: Iterable[bool]) -> str:
    """Rate without its interval, for cells of a table."""
    listed = list(flags)
    return f"{100 * sum(listed) / len(listed):.0f} %" if listed else "-"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows])


def median(values: Iterable[float | None]) -> str:
    known = [v for v in values if v is not None and np.isfinite(v)]
    return f"{np.median(known):.3g}" if known else "-"


def listing(counts: Counter[str], most: int = 5) -> str:
    return ", ".join(f"{name} {n}" for name, n in counts.most_common(most)) or "-"


def gain_ratio(line: Line) -> float | None:
    """Fall of the held-out rmse over the oracle's; None where the oracle gains under 2 %."""
    if "oracle" not in line or line["before"] - line["oracle"] < 0.02 * line["before"]:
        return None
    return float((line["before"] - line["after"]) / (line["before"] - line["oracle"]))


def right(line: Line, key: str) -> bool:
    return bool(line["judged"][key])


def clean_table(lines: list[Line]) -> str:
    rows = []
    for kind in KINDS:
        for noise in ("white", "encoder", "coloured", "all"):
            some = [x for x in lines if x["cell"]["kind"] == kind and noise in (x["cell"]["noise"], "all")]
            named = sum(right(x, "named") for x in some)
            found = Counter(f for x in some for each in x["judged"]["sets"] for f in each[:1])
            rows.append([kind, noise, rate(named, len(some)), rate(sum(right(x, "sets") for x in some), len(some)),
                         rate(sum(x["judged"]["verdict"] != "adequate" for x in some), len(some)), listing(found)])  # fmt: skip
    return table(["record", "noise", "something named", "anything reported", "verdict not adequate", "what"], rows)


def effect_table(lines: list[Line]) -> str:
    """One row per effect of a group of single-effect lines, and the totals the project promises."""
    rows = []
    for effect in EFFECTS:
        some = [x for x in lines if x["cell"]["effects"] == [effect]]
        if not some:
            continue
        errors: dict[str, list[float]] = {}
        for x in some:
            for name, value in x["judged"]["parameter_errors"].items():
                errors.setdefault(name.split(".")[1], []).append(value)
        rows.append([effect, len(some), share(right(x, "exact") for x in some), share(right(x, "in_set") for x in some),
                     sum(right(x, "wrong") for x in some), share(right(x, "extra") for x in some),
                     "; ".join(f"{name} {100 * np.median(v):.2g}" for name, v in errors.items()) or "-",
                     median(gain_ratio(x) for x in some),
                     share(right(x, "equivalents_together") for x in some) if effect in EQUIVALENT else ""])  # fmt: skip
    drive = [x for x in lines if x["cell"]["effects"][0] not in NOISE_EFFECTS]
    apart = [x for x in drive if x["cell"]["effects"][0] not in CLASSES]
    errors_all = [v for x in drive for v in x["judged"]["parameter_errors"].values()]
    total = [
        f"exact name outside structural classes: {rate(sum(right(x, 'exact') for x in apart), len(apart))}",
        f"truth in the reported set: {rate(sum(right(x, 'in_set') for x in drive), len(drive))}",
        f"a wrong name: {rate(sum(right(x, 'wrong') for x in drive), len(drive))}",
        f"median parameter error: {100 * float(np.median(errors_all)) if errors_all else float('nan'):.2g} %; "
        f"median held-out gain over the oracle's: {median(gain_ratio(x) for x in drive)}",
    ]
    head = [
        "hidden",
        "n",
        "exact",
        "in set",
        "wrong names",
        "extra findings",
        "median parameter errors [%]",
        "gain / oracle",
        "equivalents together",
    ]
    return table(head, rows) + "\n\n" + "\n".join(f"- {each}" for each in total)


def confusion(lines: list[Line]) -> str:
    """Rows: what was hidden; columns: what was named first, or how the diagnosis declined."""
    names = [e for e in EFFECTS if any(x["judged"]["column"] == e for x in lines)]
    columns = [*names, *SHORT]
    rows = []
    for truth in ((), *((e,) for e in (*EFFECTS, *OUTSIDE))):
        counts = Counter(x["judged"]["column"] for x in lines if tuple(x["cell"]["effects"]) == truth)
        if counts:
            rows.append([truth[0] if truth else "nothing", *(counts[c] or "" for c in columns)])
    return table(["hidden \\ named", *(SHORT.get(c, c.replace("_", " ")) for c in columns)], rows)


def limit_table(limits: list[Line]) -> str:
    plants = sorted({x["plant"] for x in limits})
    rows = []
    for effect in EFFECTS:
        some = {x["plant"]: x["limit"] for x in limits if x["effect"] == effect and "limit" in x}
        if some:
            texts = {name: f"{v['size']:.2g} ({v['rival'].replace('_', ' ')})" for name, v in some.items()}
            rows.append([effect, *(texts.get(name, "") for name in plants)])
    return table(["limit / typical size (nearest rival)", *plants], rows)


def limits_of(lines: list[Line]) -> dict[tuple[str, str], float]:
    """(effect, plant) -> factor at which the nearest rival leaves chi2 = 25."""
    return {(x["effect"], x["plant"]): float(x["limit"]["size"]) for x in lines if "limit" in x}


def limit_for(known: dict[tuple[str, str], float], effect: str, plant: str) -> float:
    """The limit on this plant; where that was not computed, the largest of the effect; without any, the typical size."""
    others = [size for (name, _), size in known.items() if name == effect]
    return known.get((effect, plant), max(others, default=1.0))


def curve_table(lines: list[Line], limits: list[Line]) -> str:
    """Detection against size over separability limit, per effect and in all; without limits against the size itself."""
    known = limits_of(limits)
    edges = [0, 0.5, 1, 2, 4, np.inf]
    bins = [f"{a:g}-{b:g}" for a, b in pairwise(edges)]
    above = [x["factor"] / limit_for(known, x["cell"]["effects"][0], x["plant"]) for x in lines]
    rows = []
    for effect in (*EFFECTS, "all"):
        row: list[object] = [effect]
        for low, high in pairwise(edges):
            some = [
                x for x, a in zip(lines, above, strict=True) if low <= a < high and effect in (x["cell"]["effects"][0], "all")
            ]
            row.append(f"{share(right(x, 'exact') for x in some)}, {share(right(x, 'in_set') for x in some)}, "
                       f"{share(right(x, 'wrong') for x in some)} of {len(some)}" if some else "")  # fmt: skip
        if any(row[1:]):
            rows.append(row)
    twice = [x for x, a in zip(lines, above, strict=True) if a > 2]
    apart = [x for x in twice if x["cell"]["effects"][0] not in CLASSES]
    below = [x for x, a in zip(lines, above, strict=True) if a < 1]
    total = [
        f"above twice the limit, exact outside classes: {rate(sum(right(x, 'exact') for x in apart), len(apart))}",
        f"above twice the limit, in set: {rate(sum(right(x, 'in_set') for x in twice), len(twice))}",
        f"below the limit, a wrong name: {rate(sum(right(x, 'wrong') for x in below), len(below))}",
    ]
    unit = "limit" if known else "typical size (no limits computed: run --limits)"
    head = ["hidden: exact, in set, wrong, of n", *(f"{each} x {unit}" for each in bins)]
    return table(head, rows) + "\n\n" + "\n".join(f"- {each}" for each in total)


def pair_table(lines: list[Line]) -> str:
    n = len(lines)
    both = sum(right(x, "in_set") for x in lines)
    third = sum(len(x["judged"]["sets"]) <= 2 and not x["judged"]["extra"] for x in lines)
    wrong = sum(right(x, "wrong") for x in lines)
    missed = Counter(" + ".join(x["cell"]["effects"]) for x in lines if not x["judged"]["in_set"])
    rates = {"both in the reported sets": both, "no third": third, "a wrong name": wrong}
    listed = [f"- {what}: {rate(hits, n)}" for what, hits in rates.items()]
    return "\n".join([*listed, f"- missed: {', '.join(missed) or '-'}"])


def outside_table(lines: list[Line]) -> str:
    rows = []
    for effect in OUTSIDE:
        some = [x["judged"] for x in lines if x["cell"]["effects"] == [effect]]
        drivers = Counter(str(j["driver"]) for j in some)
        names = Counter(name for j in some for name in j["wrong"])
        shares = [share(bool(j["wrong"]) for j in some), share(bool(j["parts"]) for j in some),
                  share(j["driver"] in DRIVERS[effect] for j in some)]  # fmt: skip
        rows.append([effect, len(some), *shares, listing(drivers), listing(names)])
    judged = [x["judged"] for x in lines]
    total = [f"a wrong name: {rate(sum(bool(j['wrong']) for j in judged), len(judged))}",
             f"driver right: {rate(sum(j['driver'] in DRIVERS[j['truth'][0]] for j in judged), len(judged))}"]  # fmt: skip
    head = ["hidden", "n", "wrong name", "true part named", "driver right", "drivers", "wrong names"]
    return table(head, rows) + "\n\n" + "\n".join(f"- {each}" for each in total)


def encoder_table(lines: list[Line]) -> str:
    n = len(lines)
    found = sum(any(DELAYS & set(each) for each in x["judged"]["sets"]) for x in lines)
    other = sum(any(name not in DELAYS for name in x["judged"]["named"]) for x in lines)
    return f"- half a sample of delay found as delay, lag or filter: {rate(found, n)}\n- anything else named: {rate(other, n)}"


def loop_table(lines: list[Line]) -> str:
    """One row per kind of loop and clock of the log, and the totals."""
    rows = []
    names = list(dict.fromkeys(x["cell"]["loop"] for x in lines))
    for loop in (*names, "all"):
        of_loop = [x for x in lines if loop in (x["cell"]["loop"], "all")]
        for every in sorted({x["cell"]["every"] for x in of_loop}):
            some = [x for x in of_loop if x["cell"]["every"] == every]
            clean = [x for x in some if not x["cell"]["effects"]]
            hidden = [x for x in some if x["cell"]["effects"]]
            found = Counter(each[0] for x in clean for each in x["judged"]["sets"])
            false = Counter(name for x in hidden for name in x["judged"]["wrong"])
            rows.append([loop, every, len(clean), share(right(x, "sets") for x in clean),
                         share(x["judged"]["verdict"] == "adequate" for x in clean), len(hidden),
                         *(share(right(x, key) for x in hidden) for key in ("exact", "in_set", "wrong")),
                         share(x["judged"]["verdict"] == "explained" for x in hidden),
                         median(x["seconds"] for x in some), f"clean: {listing(found)}; hidden: {listing(false)}"])  # fmt: skip
    clean = [x for x in lines if not x["cell"]["effects"]]
    hidden = [x for x in lines if x["cell"]["effects"]]
    drive = [x for x in hidden if x["cell"]["effects"][0] not in NOISE_EFFECTS]
    apart = [x for x in drive if x["cell"]["effects"][0] not in CLASSES]
    total = [
        f"clean, anything reported: {rate(sum(right(x, 'sets') for x in clean), len(clean))}",
        f"exact name outside structural classes: {rate(sum(right(x, 'exact') for x in apart), len(apart))}",
        f"truth in the reported set: {rate(sum(right(x, 'in_set') for x in drive), len(drive))}",
        f"a wrong name: {rate(sum(right(x, 'wrong') for x in hidden), len(hidden))}",
        f'verdict "explained": {rate(sum(x["judged"]["verdict"] == "explained" for x in drive), len(drive))}',
    ]
    head = ["loop", "log every", "clean", "reported", "adequate", "hidden", "exact", "in set", "wrong", "explained",
            "median [s]", "false names"]  # fmt: skip
    return table(head, rows) + "\n\n" + "\n".join(f"- {each}" for each in total)


def seconds_table(lines: list[Line]) -> str:
    rows = []
    for kind in (*KINDS, *ANYWHERE):
        times = [x["seconds"] for x in lines if x["cell"]["kind"] == kind]
        if times:
            rows.append([kind, len(times), *(f"{np.percentile(times, q):.2f}" for q in (50, 95, 100))])
    return table(["record", "n", "median [s]", "95 %", "longest"], rows)


def sides_table(lines: list[Line]) -> str:
    """At which end of the shaft an effect is said to be: its own alone, both, only the other one."""
    rows = []
    for hidden in [*dict.fromkeys(key.removesuffix(AT_LOAD) for x in lines for key in x["cell"]["effects"]), "", "all"]:
        for end in ("motor", "load"):
            some = [x for x in lines if any(_matches(key, hidden, end) for key in x["cell"]["effects"] or [""])]
            if not some or (not hidden and end == "load"):
                continue
            there = [x for x in some if right(x, "in_set") and x["ends"]]
            wrong = Counter(name for x in some for name in x["judged"]["wrong"])
            ends = [sum(x["ends"] == [end] for x in there), sum(len(x["ends"]) > 1 for x in there)]
            rows.append([hidden or "clean", end if hidden else "-", len(some), share(right(x, "exact") for x in some),
                         share(right(x, "in_set") for x in some), f"{100 * sum(ends) / len(some):.0f} %" if hidden else "-",
                         *ends, len(there) - sum(ends), listing(wrong)])  # fmt: skip
    return table(["effect", "end", "n", "exact", "in set", "in set with its end", "its end alone", "both ends", "wrong end",
                  "named wrong"], rows)  # fmt: skip


def ends_table(lines: list[Line]) -> str:
    """Dry friction at both ends: both named with their end, both in the sets, one of them, a wrong name; error of the levels."""
    rows = []
    for kind in [*dict.fromkeys(x["cell"]["effects"][0] for x in lines), ""]:
        some = [x for x in lines if x["cell"]["effects"][0] == kind or not kind]
        missed = [x["judged"] for x in some if not right(x, "in_set")]
        one = sum(any({*judged["truth"]} & {*each} for each in judged["sets"]) for judged in missed)
        wrong = Counter(name for x in some for name in x["judged"]["wrong"])
        off = [e for x in some for name, e in x["judged"]["parameter_errors"].items() if ".torque" in name and right(x, "in_set")]
        levels = f"{100 * np.median(off):.2g} %" if off else "-"
        rows.append([kind or "all", len(some), share(right(x, "exact") for x in some), share(right(x, "in_set") for x in some),
                     one, levels, listing(wrong)])  # fmt: skip
    return table(["effect", "n", "both named", "both in set", "one of them", "levels, median error", "named wrong"], rows)


def _matches(key: str, hidden: str, end: str) -> bool:
    name = key.removesuffix(AT_LOAD)
    return (hidden == name or (hidden == "all" and name != "")) and (not name or (end == "load") == (key != name))


def measured_table(lines: list[Line]) -> str:
    """A torque that was measured: names, and how far the inertia is off."""
    rows = []
    for share in sorted({x["cell"]["torque_noise"] for x in lines}):
        some = [x for x in lines if x["cell"]["torque_noise"] == share]
        clean, hidden = ([x for x in some if bool(x["cell"]["effects"]) is there] for there in (False, True))
        off, far = (np.abs([x[f"inertia_{name}"] for x in some]) for name in ("error", "deviations"))
        numbers = [f"{100 * np.median(off):.2g} %", f"{100 * np.max(off):.2g} %", f"{np.median(far):.2g}", f"{np.max(far):.2g}"]
        reported = rate(sum(bool(x["judged"]["sets"]) for x in clean), len(clean))
        found, wrong = (rate(sum(bool(x["judged"][key]) for x in hidden), len(hidden)) for key in ("in_set", "wrong"))
        rows.append([f"{100 * share:g} %", reported, found, wrong, *numbers])
    head = ("noise of the torque", "clean: anything reported", "hidden: in set", "hidden: a wrong name", "inertia, median error",
            "largest", "in deviations, median", "largest")  # fmt: skip
    return table(head, rows)


def coverage_table(lines: list[Line]) -> str:
    """Of each number, how often the truth is within 1.96 of its stated deviations, by verdict, and how far off it is at most."""
    verdicts = "adequate", "explained", "partly explained", "unexplained"
    names = dict.fromkeys(name for x in lines for name in x["deviations"])
    rows = []
    for name in [*sorted(names, key=lambda n: ("." in n, n)), "all"]:
        cells: list[object] = [name]
        largest = 0.0
        for verdict in verdicts:
            some = [x["deviations"] for x in lines if x["judged"]["verdict"] == verdict]
            off = np.abs([z for each in some for n, z in each.items() if name in (n, "all")])
            cells.append(rate(int(np.sum(off < 1.96)), len(off)))
            largest = max(largest, float(np.max(off, initial=0.0)))
        rows.append([*cells, f"{largest:.2g}"])
    return table(["within 1.96 deviations", *verdicts, "furthest off, deviations"], rows)


def report(lines: list[Line]) -> str:
    """All tables for which there are lines."""
    done = [x for x in lines if "judged" in x]
    limits = [x for x in lines if x["key"].startswith("limit/")]
    parts = []

    def add(title: str, some: list[Line], make: Callable[[list[Line]], str]) -> None:
        if some:
            parts.append(f"### {title}\n\n{make(some)}")

    groups = {g: [x for x in done if x["cell"]["group"] == g] for g in {x["cell"]["group"] for x in done}}
    add("Nothing hidden", groups.get("clean", []), clean_table)
    for kind in KINDS:
        some = [x for x in groups.get("effects", []) if x["cell"]["kind"] == kind]
        add(f"One effect, 0.5..2 times its typical size, record: {kind}", some, effect_table)
    shown = [x for g in ("clean", "effects", "outside") for x in groups.get(g, []) if x["cell"]["kind"] == "multi"]
    add("Confusion matrix, multi-level records", shown, confusion)
    add("Separability limits", limits, limit_table)
    add("Detection against size", groups.get("sizes", []), lambda some: curve_table(some, limits))
    add("Two effects", groups.get("pairs", []), pair_table)
    add("Effects outside the library", groups.get("outside", []), outside_table)
    add("An encoder that is really differenced", groups.get("encoder", []), encoder_table)
    add("A load settled before the record", groups.get("settled", []), effect_table)
    add("Loops of servo drives, wholly known", groups.get("loops", []), loop_table)
    add("Loops of servo drives under ramps that begin between the lines", groups.get("ramps", []), loop_table)
    add("Loops of servo drives under jumps between the lines", groups.get("jumps", []), loop_table)
    add("Ends of an elastic shaft", groups.get("sides", []), sides_table)
    add("Dry friction at both ends of an elastic shaft", groups.get("ends", []), ends_table)
    add("Cogging or ripple of several orders at once", groups.get("orders", []), effect_table)
    add("A measured torque that drives the axis", groups.get("measured", []), measured_table)
    add("Deviations of what was rightly found", [x for x in done if "deviations" in x], coverage_table)
    add("Time of a diagnosis", done, seconds_table)
    crashed = [x for x in lines if "crash" in x]
    add("Crashes", crashed, lambda some: "\n".join(f"- {x['key']}: {x['crash']}" for x in some))
    return "\n\n".join(parts) or "no results"
