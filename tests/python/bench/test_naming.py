"""The adaptors of bench/naming.py on two records, its judgement of thresholds, and its counts."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drive_rig import skip_without_library
from places import BENCH

skip_without_library()

SEED = 7_000_000
DRY = {"coulomb_friction", "stribeck_friction", "presliding_friction", "lugre_friction", "asymmetric_friction"}
METHODS = (
    *("gaident.diagnose", "STLSQ, filter", "STLSQ, differences", "STLSQ ensemble, filter", "SR3, filter", "SR3, differences"),
    *("F test, filter", "F test, differences", "hold-out ladder", "greedy BIC", "boosted trees", "ARX", "output error", "NARX"),
)


@pytest.fixture(scope="module")
def naming() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        for folder in ("measured", "naming_peers", "."):
            patch.syspath_prepend(str(BENCH / folder))
        yield importlib.import_module("naming")


@pytest.fixture(scope="module")
def training(naming: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records of training that were never measured: a dry friction is where its own column explains nearly all."""
    boosted = importlib.import_module("boosted")
    rng = np.random.default_rng(1)
    share = boosted.LABELS.index("coulomb_friction")
    X = rng.normal(size=(60, len(boosted.features(naming.drawn(cell(naming)))))) - 0.1
    X[:, share] = rng.uniform(-2.5, 0.0, 60)
    Y = np.zeros((60, len(boosted.LABELS)))
    Y[:, share] = X[:, share] < -0.7
    path = tmp_path_factory.mktemp("naming") / "training.npz"
    np.savez(path, X=X, Y=Y, next=60)
    return path


def cell(naming: Any, *effects: str) -> Any:
    return naming.Cell("effects" if effects else "clean", effects, "multi", "white", True, SEED)


def test_the_methods_are_those_of_this_file(naming: Any) -> None:
    found = naming.methods(Path())
    assert tuple(found) == METHODS
    assert found["gaident.diagnose"].lines == 1 and min(m.lines for n, m in found.items() if n != "gaident.diagnose") > 10


@pytest.mark.parametrize("name", METHODS)
def test_a_method_names_a_dry_friction_and_predicts(naming: Any, training: Path, name: str) -> None:
    method = naming.methods(training)[name]
    if method.missing:
        pytest.skip(f"needs {', '.join(method.missing)}")
    line = naming.answered(cell(naming, "coulomb_friction"), "closed", name, training, None)
    assert "answers" in line, line.get("crash")
    answer = line["answers"][naming.middle([line])]
    named = set(answer["judged"]["named"])
    assert (named <= DRY and named) if method.named else not named
    assert line["before"] > answer["rmse"] > 0.9 * line["oracle"] or name in ("ARX", "NARX")
    assert line["seconds"] > 0.0


@pytest.mark.parametrize("name", [n for n in METHODS[1:-3] if n != "STLSQ ensemble, filter"])
def test_a_method_names_nothing_where_nothing_is_hidden(naming: Any, training: Path, name: str) -> None:
    """At its strictest threshold, that is: how often it does so at another one is what the benchmark measures."""
    method = naming.methods(training)[name]
    if method.missing:
        pytest.skip(f"needs {', '.join(method.missing)}")
    line = naming.answered(cell(naming), "closed", name, training, None)
    assert "answers" in line, line.get("crash")
    assert not list(line["answers"].values())[-1]["judged"]["named"]
    assert line["oracle"] is None


def test_the_cells_have_a_logged_torque_and_each_is_there_once(naming: Any) -> None:
    for group in naming.GROUPS:
        found = list(naming.cells_of(group, 1, 5))
        assert found and len({c.key for c in found}) == len(found) and all(c.torque for c in found)
    hidden = [bool(c.effects) for c in naming.cells_of("loops", 1, 5)]
    assert any(hidden) and not all(hidden)


def test_a_threshold_is_chosen_by_right_records_less_wrong_names() -> None:
    tables = importlib.import_module("naming_tables")

    def line(effects: list[str], **named: list[str]) -> dict[str, Any]:
        judged = {
            t: {"named": n, "wrong": [x for x in n if x not in effects], "in_set": {*effects} <= {*n}} for t, n in named.items()
        }
        return {"cell": {"effects": effects}, "answers": {t: {"judged": j} for t, j in judged.items()}}

    lines = [line([], lax=["cogging"], mid=[], strict=[]), line(["cogging"], lax=["cogging"], mid=["cogging"], strict=[])]
    assert tables.chosen_threshold(lines) == "mid"
    assert tables.chosen_threshold([]) is None


def test_wilsons_interval_has_its_closed_forms() -> None:
    tables = importlib.import_module("naming_tables")
    z2 = 1.959963984540054**2
    low, high = tables.wilson(0, 10)
    assert low == 0.0 and high == pytest.approx(z2 / (10 + z2))
    low, high = tables.wilson(5, 10)
    assert low + high == pytest.approx(1.0)
