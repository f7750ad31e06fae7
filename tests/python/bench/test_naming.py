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
    *("gaident.diagnose", "STLSQ, filter", "STLSQ, differences", "STLSQ ensemble, filter", "STLSQ ensemble, differences"),
    *("SR3, filter", "SR3, differences", "SR3 ensemble, filter", "SR3 ensemble, differences"),
    *("F test, filter", "F test, differences", "hold-out ladder", "greedy BIC", "boosted trees", "ARX", "output error", "NARX"),
    *("Gaussian process", "recurrent network"),
)
ENSEMBLES = tuple(name for name in METHODS if "ensemble" in name)
PREDICT = METHODS[-5:]


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
    assert method.named == (name not in PREDICT)
    line = naming.answered(cell(naming, "coulomb_friction"), "closed", name, training, None)
    assert "answers" in line, line.get("crash")
    answer = line["answers"][naming.middle([line])]
    named = set(answer["judged"]["named"])
    assert (named <= DRY and named) if method.named else not named
    assert line["before"] > answer["rmse"] > 0.9 * line["oracle"] or name in ("ARX", "NARX")
    assert line["seconds"] > 0.0


@pytest.mark.parametrize("name", [n for n in METHODS[1:] if n not in (*PREDICT, *ENSEMBLES)])
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


def test_a_threshold_is_chosen_by_right_records_less_wrong_names(naming: Any) -> None:
    tables = importlib.import_module("naming_tables")

    def line(effects: list[str], **named: list[str]) -> dict[str, Any]:
        judged = {
            t: {"named": n, "wrong": [x for x in n if x not in effects], "in_set": {*effects} <= {*n}} for t, n in named.items()
        }
        return {"cell": {"effects": effects}, "answers": {t: {"judged": j} for t, j in judged.items()}}

    lines = [line([], lax=["cogging"], mid=[], strict=[]), line(["cogging"], lax=["cogging"], mid=["cogging"], strict=[])]
    assert tables.chosen_threshold(lines) == "mid"
    assert tables.chosen_threshold([]) is None


def test_wilsons_interval_has_its_closed_forms(naming: Any) -> None:
    tables = importlib.import_module("naming_tables")
    z2 = 1.959963984540054**2
    low, high = tables.wilson(0, 10)
    assert low == 0.0 and high == pytest.approx(z2 / (10 + z2))
    low, high = tables.wilson(5, 10)
    assert low + high == pytest.approx(1.0)


def test_the_interval_of_a_median_has_its_coverage(naming: Any) -> None:
    tables = importlib.import_module("naming_tables")
    assert tables.median_interval([3.0, 1.0, 2.0, 5.0, 4.0]) == (-np.inf, np.inf)  # 1 - 2/2^5 is below 95 %
    assert tables.median_interval([3.0, 1.0, 2.0, 5.0, 4.0, 6.0]) == (1.0, 6.0)
    rng = np.random.default_rng(0)
    inside = [low < 0.0 < high for low, high in (tables.median_interval(list(rng.standard_normal(25))) for _ in range(2000))]
    assert 0.95 - 0.01 < np.mean(inside) < 0.98  # exactly 0.957
    assert tables.middle_of([0.5, None, 0.5, 0.5, 0.5, 0.5, 0.5]) == "0.5 [0.5, 0.5] (n = 6)"


def test_a_state_that_fades_is_that_of_its_recursion(naming: Any) -> None:
    library = importlib.import_module("library")
    rng = np.random.default_rng(3)
    for least in (0.0, 0.99):  # forgotten at once, and kept over the whole record
        keep, more = rng.uniform(least, 1.0, (3, 500)), rng.normal(size=(3, 500))
        z, expected = np.zeros(3), np.empty((3, 500))
        for k in range(500):
            z = keep[:, k] * z + more[:, k]
            expected[:, k] = z
        assert library.summed(keep, more) == pytest.approx(expected, abs=1e-12)


def test_a_followed_command_keeps_its_slope(naming: Any) -> None:
    prediction = importlib.import_module("prediction")
    command = np.array([1.0, 4.0, 4.0, 4.0, 2.5])
    assert prediction.followed(command, 2.0).tolist() == [1.0, 3.0, 4.0, 4.0, 2.5]
    assert prediction.followed(command, np.inf).tolist() == command.tolist()


def test_the_missing_torque_is_that_of_a_hidden_friction(naming: Any) -> None:
    """Of a drive known exactly, away from where the low pass rounds the sign."""
    gaussian, library = importlib.import_module("gaussian"), importlib.import_module("library")
    case = naming.drawn(cell(naming, "coulomb_friction"))
    plant = case.truth.plant
    m = library.filtered(case.record)
    ga = importlib.import_module("gaident")
    drive = ga.TwoMass(plant.J, plant.D, plant.JL, plant.DL, plant.KG, plant.DG) if plant.JL else ga.OneMass(plant.J, plant.D)
    left = gaussian.missing_torque(drive.model(), case.record, m)
    sliding = m.use & (np.abs(m.w) > 5.0)
    share = np.median((left * np.sign(m.w))[sliding]) / -case.truth.effects["coulomb_friction"]["torque"]
    assert share == pytest.approx(1.0, abs=0.1)


def test_a_process_learns_a_function_of_the_motion(naming: Any) -> None:
    pytest.importorskip("sklearn")
    gaussian = importlib.import_module("gaussian")
    rng = np.random.default_rng(0)
    w, u, theta = rng.uniform(-50, 50, 300), rng.normal(size=300), rng.uniform(0, 40, 300)

    def missing(w: Any, theta: Any) -> Any:
        return -0.02 * np.tanh(w / 0.02) - 1e-5 * w * np.abs(w) + 0.01 * np.sin(theta)

    _, mean = gaussian.fitted(gaussian.features(w, u, theta), missing(w, theta) + 1e-3 * rng.normal(size=300))
    at = gaussian.features(w[:50] * 0.9, u[:50], theta[:50] + 1.0)
    wrong = np.array([mean(x) for x in at]) - missing(w[:50] * 0.9, theta[:50] + 1.0)
    assert np.sqrt(np.mean(wrong**2)) < 2e-3


def test_a_network_begins_as_the_linear_model(naming: Any) -> None:
    recurrent, prediction = importlib.import_module("recurrent"), importlib.import_module("prediction")
    case = naming.drawn(cell(naming))
    start, speed, torque = recurrent.began(case)
    start["V"] = 0.0 * start["V"]
    rmse = prediction.in_the_loop(case, recurrent.moved(start, case.record.dt, speed, torque), 1)
    assert rmse == pytest.approx(case.free_run(importlib.import_module("in_the_loop").mechanism(case)), rel=0.02)


def test_a_method_says_which_environment_it_needs(naming: Any) -> None:
    method = naming.Method(lambda case: {}, (), {"no_such_module": "no-such-package"}, python=Path("build/absent/bin/python"))
    assert method.missing[0] == "no-such-package" and "build" not in method.missing[0] and "absent" in method.missing[1]


def test_what_is_left_outside_the_library_is_a_share_of_the_linear_models_error(naming: Any) -> None:
    tables = importlib.import_module("naming_tables")
    assert tables.left_over({"before": 0.5}, {"rmse": 0.1}) == pytest.approx(20.0)
    assert tables.left_over({"before": 0.5}, {"rmse": float("inf")}) == np.inf
    assert tables.left_over({"before": 0.5}, {"rmse": None}) is None and tables.left_over({}, {"rmse": 0.1}) is None
