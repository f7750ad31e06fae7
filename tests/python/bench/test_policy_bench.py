"""What a row of the policy decides is measured by running cases with another value, and by watching numbers on their way."""

from __future__ import annotations

import importlib
import json
import math
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from gaident.policy.declared import SHOWN_BY
from gaident.policy.table import POLICY, Policy, rows
from places import ROOT

BY_NAME = {r.name: r for r in rows()}


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    return importlib.import_module("rows.watch")


@pytest.fixture
def tables(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    return importlib.import_module("rows.tables")


def python(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def test_another_policy_decides_in_a_fresh_process_only() -> None:
    head = (
        "from dataclasses import replace; from gaident.policy.table import Policy; from gaident.policy.trial import decide_by\n"
    )
    other = "decide_by(replace(Policy(), least_samples=5))\n"
    seen = "from gaident.diagnosis.records.arguments import POLICY as seen\nprint(seen.least_samples)\n"
    assert python(head + other + seen).stdout.split() == ["5"]
    late = python(head + seen + other)
    assert late.returncode != 0 and "gaident.diagnosis.records.arguments" in late.stderr and "fresh process" in late.stderr


def test_every_row_has_two_neighbours_that_it_can_have(watch: ModuleType) -> None:
    for row in rows():
        if not row.command:
            continue
        below, above = watch.neighbours(row)
        assert 0.0 < below < row.value < above, row.name
        assert row.unit != "1" or not 0.5 < row.value < 1.0 or above < 1.0, row.name
        assert not isinstance(row.value, int) or (isinstance(below, int) and isinstance(above, int)), row.name


def test_a_watched_number_is_the_number_and_notes_what_would_come_out_otherwise(watch: ModuleType) -> None:
    seen = watch.Watch()
    policy = watch.watched(Policy(), seen)
    assert policy.usual == POLICY.usual and repr(policy.swap) == "Watched(2.0)"  # effort is not watched

    def turned(name: str) -> list[float]:
        assert seen.used == {name}
        found = sorted(step for _, step in seen.turned)
        seen.clear()
        return found

    x = np.array([1.0, 3.0])
    assert 3.0 * policy.swap - 1.0 > 4.0  # 6 - 1; wrong from a swap of 5/3 on down
    assert turned("swap") == [-2.0, -1.75, -1.5, -1.25, -1.0, -0.75, -0.5]
    assert policy.swap < 100.0 and policy.swap > 0.0 and policy.swap != 7.0
    assert turned("swap") == []
    assert list(x * policy.swap > 5.0) == [False, True]  # 3 swap falls below 5, 1 swap rises above it
    assert turned("swap") == [-2.0, -1.75, -1.5, -1.25, -1.0, -0.75, -0.5, 1.5, 1.75, 2.0]
    assert bool(np.all(np.maximum(x, policy.swap) == [2.0, 3.0])) and max(policy.swap, 0.1) is policy.swap
    assert turned("swap") == list(watch.STEPS)
    assert int(100 * policy.fitted_share) == 70 and len(turned("fitted_share")) == len(watch.STEPS) - 2  # to below 0: none
    assert math.ceil(policy.seen_turn) == 1 and f"{policy.swap:.1f}" == "2.0"
    assert turned("seen_turn") == []
    errors = x * policy.swap
    worked_on = np.multiply(errors, x, out=errors)
    assert type(worked_on) is np.ndarray and list(worked_on) == [2.0, 18.0]  # in place: every other value is another
    assert turned("swap") == list(watch.STEPS)
    assert math.sqrt(policy.swap) == math.sqrt(2.0)  # no arithmetic that it can follow: every other value is another
    assert turned("swap") == list(watch.STEPS)


def test_numbers_of_two_rows_are_watched_together(watch: ModuleType) -> None:
    seen = watch.Watch()
    policy = watch.watched(Policy(), seen)
    penalty = policy.effect_penalty * (1.0 + policy.short_record / 400)
    assert 60.0 > penalty > 30.0  # 23 (1 + 200/400) = 34.5
    assert seen.used == {"effect_penalty", "short_record"}
    assert sorted(seen.turned) == [
        *(("effect_penalty", step) for step in (-2.0, -1.75, -1.5, -1.25, -1.0, -0.75, -0.5, -0.25, 1.0, 1.25, 1.5, 1.75, 2.0)),
        *(("short_record", step) for step in (-2.0, -1.75, -1.5, -1.25, -1.0, -0.75, 1.75, 2.0)),
    ]


def test_a_summary_says_what_changed_and_what_is_open(tables: ModuleType) -> None:
    def line(outcome: str, said: str, detail: str = "", turned: tuple[float, ...] = ()) -> dict[str, object]:
        return {
            "outcome": outcome,
            "said": said,
            "detail": detail,
            "seconds": 1.0,
            "used": ["swap"],
            "turned": {"swap": list(turned)},
        }

    base = {
        "a": line("right", "x", turned=(-1.0, -1.25)),
        "b": line("right", "y", turned=(-1.0, 1.0, 2.0)),
        "c": line("missed", "z"),
    }
    below = {"a": line("wrong", "w"), "b": line("right", "y", "other"), "c": base["c"]}
    found = tables.summary(BY_NAME["swap"], base, {1.0: below, 4.0: {"a": base["a"], "b": None, "c": base["c"]}})
    assert found["cases"] == found["used"] == 3 and found["outcomes"] == {"right": 2, "missed": 1}
    assert found["unchanged"] == pytest.approx([2.0 * 2**-0.75, 2.0 * 2**0.75])
    first, second = found["at"]
    assert first["again"] == 2 and first["missing"] == 0 and first["said"] == 1 and first["other"] == 1
    assert first["changed"] == {"a": "right -> wrong"} and first["outcomes"] == {"wrong": 1, "right": 1, "missed": 1}
    assert second["missing"] == 1 and not tables.decides_nothing(found)
    text = tables.report([{"name": "swap"} | found])
    assert "1 right, 1 missed, 1 wrong" in text and "a: right -> wrong" in text and "1 not run" in text


def test_the_file_of_what_was_measured_is_about_rows_of_the_policy(tables: ModuleType) -> None:
    measured = tables.merged([])
    assert measured and len({(m["name"], m["kind"]) for m in measured}) == len(measured)
    for m in measured:
        row = BY_NAME[m["name"]]
        assert row.command and m["kind"] in SHOWN_BY, m["name"]
        assert [at["value"] for at in m["at"]] == sorted(at["value"] for at in m["at"]), m["name"]
        assert m["unchanged"][0] <= m["value"] <= m["unchanged"][1] and 0 < m["used"] <= m["cases"], m["name"]


@pytest.mark.long
def test_a_row_is_measured_and_what_is_there_is_not_run_again(tmp_path: Path) -> None:
    """Windings are fast; and where the watched run says that no decision changes, running with the other value agrees."""
    out = tmp_path / "rows.jsonl"
    command = [
        sys.executable,
        str(ROOT / "bench" / "policy.py"),
        "winding_sure",
        "--cases",
        "1",
        "--seed",
        "3",
        "--out",
        str(out),
    ]
    first = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = [json.loads(text) for text in out.read_text().splitlines()]
    watched = {line["case"]: line for line in lines if "/watched/" in line["key"]}
    assert len(watched) == 5 and all(line["used"] for line in watched.values())
    # A winding that follows within an eighth of a sample leaves no trace of its inductance: e^-8 of a current's step.
    right = {name.split("/")[-1]: line["outcome"] for name, line in watched.items()}
    assert right == {"0 H": "right", "3e-05 H": "missed", "0.0001 H": "missed", "0.0003 H": "right", "0.001 H": "right"}
    assert "`winding_sure` = 5" in first.stdout
    size = out.stat().st_size
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == first.stdout
    assert out.stat().st_size == size
    code = (
        f"import sys; sys.path[:0] = [{str(ROOT / 'bench')!r}, {str(ROOT / 'tests' / 'python' / 'support')!r}]\n"
        "import policy, json\n"
        "policy.prepare('winding_sure', 10.0)\n"
        "from rows.cases import cases\n"
        "print(json.dumps([policy.measure('', c) for c in cases('winding', 1, 3)]))\n"
    )
    again = json.loads(
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ).stdout
    )
    same = [line for line in again if 1.0 not in watched[line["case"]]["turned"].get("winding_sure", [])]
    assert len(same) >= 3
    for line in same:
        assert all(line[name] == watched[line["case"]][name] for name in ("outcome", "said", "detail")), line["case"]


def test_every_kind_has_cases_with_keys_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("bench/measured", "bench"):
        monkeypatch.syspath_prepend(str(ROOT / folder))
    kinds = importlib.import_module("rows.cases")
    assert set(kinds.KINDS) == set(SHOWN_BY)
    keys = [c.key for kind in SHOWN_BY for c in kinds.cases(kind, 1, 5)]
    assert len(set(keys)) == len(keys) and all(sum(k.startswith(f"{kind}/") for k in keys) >= 5 for kind in SHOWN_BY)


def test_a_slower_log_shows_the_form_that_made_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("bench/measured", "bench"):
        monkeypatch.syspath_prepend(str(ROOT / folder))
    kinds = importlib.import_module("rows.cases")
    found = {c.what: kinds.run(c) for c in kinds.cases("slower", 1, 5) if c.what in (("bare", "steps"), ("gains", "ramps"))}
    assert {what: result.said for what, result in found.items()} == {("bare", "steps"): "", ("gains", "ramps"): "other_gains"}
    assert all(result.outcome == "right" for result in found.values())
