"""What an MDF file stores becomes values by conversions that are applied here; formulas are never evaluated."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.data.formats.foreign.conversions import conversion_of
from gaident.errors import ReadError

STORED = np.array([-3, 0, 1, 2, 4, 5, 9, 30])


def table(keys: list[float], values: list[float], version: int) -> SimpleNamespace:
    pairs = {f"raw_{k}": key for k, key in enumerate(keys)} | {f"phys_{k}": value for k, value in enumerate(values)}
    if version == 3:
        return SimpleNamespace(ref_param_nr=len(keys), **pairs)
    return SimpleNamespace(val_param_nr=2 * len(keys), **pairs)


def ranges(*rows: tuple[float, float, float], default: float) -> SimpleNamespace:
    names = ("lower", "upper", "phys")
    values = {f"{name}_{k}": x for k, row in enumerate(rows) for name, x in zip(names, row, strict=True)}
    return SimpleNamespace(val_param_nr=3 * len(rows) + 1, default=default, **values)


def kind(block: SimpleNamespace, number: int) -> Any:
    return SimpleNamespace(conversion_type=number, **vars(block))


SIX = SimpleNamespace(P1=1.0, P2=2.0, P3=3.0, P4=0.0, P5=1.0, P6=10.0)
CASES: list[tuple[int, Any, list[float]]] = [
    (4, kind(SimpleNamespace(a=0.5, b=-1.0), 1), [-2.5, -1, -0.5, 0, 1, 1.5, 3.5, 14]),
    (3, kind(SimpleNamespace(a=0.5, b=-1.0), 0), [-2.5, -1, -0.5, 0, 1, 1.5, 3.5, 14]),
    (4, kind(SIX, 2), [(x * x + 2 * x + 3) / (x + 10) for x in STORED]),
    (3, kind(SIX, 9), [(x * x + 2 * x + 3) / (x + 10) for x in STORED]),
    (3, kind(SIX, 6), [2 / (3 * (x - 11) - 1) for x in STORED]),
    (4, kind(table([0, 4, 10], [0, 40, -20], 4), 4), [0, 0, 10, 20, 40, 30, -10, -20]),
    (3, kind(table([0, 4, 10], [0, 40, -20], 3), 1), [0, 0, 10, 20, 40, 30, -10, -20]),
    (4, kind(table([0, 4, 10], [0, 40, -20], 4), 5), [0, 0, 0, 0, 40, 40, -20, -20]),  # the nearest, of two the lower
    (3, kind(table([0, 4, 10], [0, 40, -20], 3), 2), [0, 0, 0, 0, 40, 40, -20, -20]),
    (4, kind(ranges((0, 1, 7), (2, 4, 8), (4, 9, 9), default=-1), 6), [-1, 7, 7, 8, 9, 9, 9, -1]),
]


@pytest.mark.parametrize(("version", "block", "expected"), CASES)
def test_what_is_stored_becomes_values(version: int, block: Any, expected: list[float]) -> None:
    conversion = conversion_of(block, version)
    assert conversion.apply is not None and not conversion.flaw
    for stored in (STORED.astype(np.int16), STORED.astype(np.int64)):
        np.testing.assert_allclose(conversion.apply(stored), expected, rtol=1e-15)


def test_small_whole_numbers_do_not_wrap() -> None:
    conversion = conversion_of(kind(SIX, 2), 4)
    assert conversion.apply is not None
    np.testing.assert_array_equal(conversion.apply(np.array([120], np.int8)), [(120.0**2 + 243) / 130])


def test_a_range_of_decimals_does_not_contain_its_end() -> None:
    conversion = conversion_of(kind(ranges((0, 1, 7), (2, 4, 8), default=-1), 6), 4)
    assert conversion.apply is not None
    np.testing.assert_array_equal(conversion.apply(np.array([0.0, 0.5, 1.0, 2.0, 4.0, np.nan])), [7, 7, -1, 8, -1, -1])


@pytest.mark.parametrize(
    ("version", "number", "said"),
    [
        (4, 3, "a formula as conversion, which is not evaluated"),
        (3, 10, "a formula as conversion, which is not evaluated"),
        (3, 7, "exponential as conversion"),
        (3, 8, "logarithmic as conversion"),
        (4, 77, "kind 77 as conversion"),
        (4, 7, "text"),
        (3, 11, "text"),
    ],
)
def test_other_conversions_make_no_numbers(version: int, number: int, said: str) -> None:
    conversion = conversion_of(SimpleNamespace(conversion_type=number, formula="1/0"), version)
    assert conversion.apply is None and said in conversion.flaw


def test_tables_that_do_not_rise_make_no_numbers() -> None:
    for block in (kind(table([0, 0], [1, 2], 4), 5), kind(table([], [], 4), 4), kind(ranges((2, 1, 0), default=0), 6)):
        assert "do not rise" in conversion_of(block, 4).flaw
    assert conversion_of(None, 4).apply is None and not conversion_of(None, 3).flaw


# ---- whole files


def written(folder: Path, version: str, **signals: Any) -> Path:
    asammdf = pytest.importorskip("asammdf", reason="asammdf is not installed: pip install 'gaident[mdf]'")
    file = asammdf.MDF(version=version)
    time = np.arange(40) * 1e-3
    stored = np.arange(40).astype("<i2")
    file.append([asammdf.Signal(stored, time, name=name, **more) for name, more in signals.items()])
    path = Path(file.save(folder / "log.mf4", overwrite=True))  # one of version 3 is called log.mdf
    file.close()
    return path


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("version", ["3.30", "4.10"])
def test_a_file_s_conversions_are_those_of_its_library(version: str, tmp_path: Path) -> None:
    conversions = {
        "linear": {"a": 0.25, "b": 3.0},
        "rational": {f"P{k}": float(k) for k in range(1, 7)},
        "interpolated": {"raw_0": 0.0, "phys_0": 1.0, "raw_1": 30.0, "phys_1": 7.0, "interpolation": True},
        "table": {"raw_0": 0.0, "phys_0": 1.0, "raw_1": 30.0, "phys_1": 7.0},
    }
    path = written(tmp_path, version, **{name: {"conversion": c} for name, c in conversions.items()}, plain={})
    read = ga.read_columns(path)
    import asammdf

    with asammdf.MDF(path) as mdf:
        for name in (*conversions, "plain"):
            np.testing.assert_allclose(read[name], mdf.get(name).samples, rtol=1e-15, err_msg=name)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("version", ["3.30", "4.10"])
def test_a_formula_runs_no_code_and_is_named(version: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where SymPy is installed, asammdf hands the formula to its lambdify, which evaluates it as Python."""
    (tmp_path / "sympy.py").write_text(
        "def symbols(*_): pass\ndef lambdify(_, formula, **__): return lambda x: (eval(formula), x)[1]\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    harm = tmp_path / "harm"
    formula = {"formula": f"open({str(harm)!r}, 'w')"}
    path = written(tmp_path, version, velocity={}, torque={"conversion": formula}, other={})
    listed = ga.columns(path)
    assert [c.name for c in listed.columns if c.name in ("velocity", "torque", "other")] == ["velocity", "other"]
    with pytest.raises(ReadError, match=r"'torque' \(a formula as conversion, which is not evaluated: export its values with"):
        ga.read(path, columns={"velocity": "velocity", "torque": "torque"})
    assert len(ga.read(path, columns={"velocity": "velocity", "torque": "other"})) == 40
    assert not harm.exists()
    sys.modules.pop("sympy", None)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_values_that_a_file_marks_as_invalid_are_not_taken(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf", reason="asammdf is not installed: pip install 'gaident[mdf]'")
    invalid = np.arange(40) == 7
    path = written(tmp_path, "4.10", velocity={"invalidation_bits": invalid}, torque={})
    with asammdf.MDF(path) as mdf:
        assert len(mdf.get("velocity").samples) == 39  # the library leaves it out, and the others move up
    with pytest.raises(ReadError, match=r"index 7: velocity column 'velocity' contains nan"):
        ga.read(path)
    assert np.isnan(ga.read_columns(path)["velocity"]).tolist() == invalid.tolist()
