"""The answers that bench/real.py --check asserts: the outcome of each case at least, and no wrong name anywhere.

Measured 2026-11-22. A better answer passes, and its row is then to be raised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from real_records import Case
from real_tables import Lines, ratios

RANK = {"missed": 0, "in set": 1, "right": 2}

# Drive, or one of its cases -> least outcome; a drive that is not here may be missed, but not be given a wrong name.
LEAST: Mapping[str, str] = {
    **dict.fromkeys(("emps", "emps window", "emps pulses", "joint 1", "joint 2", "joint 6"), "right"),
    **dict.fromkeys(("hsm150 measured", "actuator 2", "actuator 3", "actuator 4"), "right"),
    **dict.fromkeys(("epos 1", "epos 2", "epos 3"), "right"),
    **dict.fromkeys(("hsm150 commanded", "actuator 1"), "in set"),
    **dict.fromkeys(("ced 11", "ced 12", "rack and pinion"), "right"),  # no single name where the record decides nothing
}
MOST_MEDIAN = 1.05
"""Of the extended model's free-run error over that of the best plain fit on the held-out data; measured 1.01."""


def least(case: Case) -> str:
    return LEAST.get(case.key, LEAST.get(case.drive, "missed"))


def worse(lines: Lines, chosen: Sequence[Case], whole: bool) -> list[str]:
    """What is worse than the table, a sentence each; whole: whether every case was run, so that the median counts."""
    found = []
    for case in chosen:
        line: Mapping[str, Any] = lines.get(f"{case.key}/diagnosis", {})
        if "judged" not in line:
            found.append(f"{case.key}: {line.get('crash', 'no diagnosis')}")
            continue
        judged = line["judged"]
        if judged["outcome"] == "wrong":
            found.append(f"{case.key}: named {judged['false']}, which is false")
        elif RANK[judged["outcome"]] < RANK[least(case)]:
            found.append(f"{case.key}: {judged['outcome']} ({judged['name']}), was {least(case)}")
    sizes = ratios(lines, "velocity") if whole else []
    if sizes and not (median := sizes[len(sizes) // 2]) <= MOST_MEDIAN:
        found.append(f"the free-run error is {median:.3g} times that of the best plain fit in the median, was 1.01")
    return found
