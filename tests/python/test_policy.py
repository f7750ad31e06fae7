"""The policy: every number that decides has its unit, its source and the command that measures it, and none stands elsewhere."""

from __future__ import annotations

import ast
import importlib.util
import re
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import pytest

from gaident.diagnosis.policy import POLICY, Policy, rows
from test_codebase import PACKAGE, ROOT

EFFORT = "effort_ratio"  # the first of the last group, which spends more or less work and decides nothing about what was found

# A decision constant is a number that a module gives a name in capitals: NAME = 0.3, also in a tuple, signed, or computed from
# numbers alone. In the rooms below each such number decides through the policy, but for these: accuracies of a computation, which
# change a result by less than it is known, and physical or mathematical facts.
ROOMS = ("diagnosis/selection", "diagnosis", "estimation")
ACCURACIES = {
    "diagnosis/gains": {
        "SHARE": "split of a record into one for fits and one held out: a protocol of measurement, the same for every model",
        "LEAST": "samples of a record that is split: the same protocol",
        "BLOCKS": "draws of a bootstrap: how finely an interval is known",
    },
    "diagnosis/mechanics": {"WHOLE": "how many of the names every axis has: an index"},
    "diagnosis/selection/moves": {"MISSED": "a start of a fit"},
    "diagnosis/selection/score_test": {
        "TURN": "2 pi",
        "SIXTH": "pi/3: the angle from which once per turn is no constant and spring, a matter of geometry",
        "FURTHEST": "reach of a linearised step: which start a fit begins from",
    },
    "estimation/dataset": {"FINEST": "substep of a simulation: its discretisation error"},
    "estimation/criterion": {"DEAD": "where a correlogram is cut off: its own error is larger from there on"},
    "estimation/least_squares": {"SETTLED": "where iterations end: a fall by less changes no decision"},
    "estimation/projection": {"WORST": "the cost of a model that diverges: any number that none reaches"},
    "estimation/prediction": {"MOST_SUBSTEPS": "powers of two of a sample: work of a simulation"},
    "estimation/uncertainty": {"BLOCKS": "blocks of a jackknife: how finely a deviation is known"},
    "estimation/objective": {"LOST": "the error of a model that diverges: any number that none reaches"},
    "estimation/noise_model": {
        "HIGHEST": "order up to which an autoregression is tried; BIC takes the order",
        "ON_TOP": "the same behind a noise at the shaft",
        "TAUS": "grid of time constants; the cost takes one",
        "SIZES": "grid of sizes; the cost takes one",
        "MIDDLE": "place in the grid of both where the search for the least cost begins",
    },
}


def deciding() -> list[str]:
    """Names of the policy's numbers that decide: all before the group of effort."""
    names = [f.name for f in fields(Policy)]
    return names[: names.index(EFFORT)]


def numeric(node: ast.expr) -> bool:
    """Whether an expression is made of numbers: literals, pi, arithmetic, tuples and NumPy's grids of them."""
    match node:
        case ast.Constant(value=value):
            return isinstance(value, (int, float)) and not isinstance(value, bool)
        case ast.UnaryOp(operand=inner):
            return numeric(inner)
        case ast.BinOp(left=left, right=right):
            return numeric(left) and numeric(right)
        case ast.Tuple(elts=parts) | ast.List(elts=parts):
            return bool(parts) and all(map(numeric, parts))
        case ast.Attribute(value=ast.Name(id=module), attr=attribute):
            return module in {"np", "math"} and attribute in {"pi", "e", "tau"}
        case ast.Call(func=ast.Attribute(value=ast.Name(id=module)), args=arguments):
            return module in {"np", "math"} and all(map(numeric, arguments))
    return False


def numbers_named(file: Path) -> list[str]:
    """Names in capitals that a module gives to numbers."""
    found = []
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.Assign):
            targets, value = node.targets, node.value
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            targets, value = [node.target], node.value
        else:
            continue
        names = [n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)]
        found += [n for n in names if re.fullmatch(r"_?[A-Z][A-Z0-9_]*", n) and numeric(value)]
    return found


def modules_that_decide() -> list[Path]:
    """The files of the rooms, without the policy itself."""
    files = [f for room in ROOMS for f in (PACKAGE / room).glob("*.py")]
    return sorted(f for f in files if f.stem != "policy")


def test_every_row_has_a_unit_and_a_source() -> None:
    assert {r.name for r in rows()} == {f.name for f in fields(Policy)}
    for row in rows():
        assert row.value == getattr(POLICY, row.name) and row.value > 0, row.name
        assert row.unit.strip() and len(row.source) > 10, row.name


def test_every_number_that_decides_has_the_command_that_measures_it() -> None:
    without = [r.name for r in rows() if r.name in deciding() and not r.command]
    assert not without
    assert len(deciding()) > 15
    beside = [r.name for r in rows() if r.name not in deciding() and r.command]
    assert not beside, "a number with a command decides: it stands before the group of effort"


def test_the_commands_can_be_called() -> None:
    """The script is there, and knows the groups that a command names."""
    for command in {r.command for r in rows() if r.command}:
        program, script, *arguments = command.split()
        assert program == "python" and (ROOT / script).is_file(), command
        groups = re.search(r"^GROUPS = \((.*)\)$", (ROOT / script).read_text(), re.MULTILINE)
        options = [a for a in arguments if a.startswith("--")]
        assert not options or groups is not None
        named = [a for a in arguments if not a.startswith("--") and not a.isdigit()]
        assert all(f'"{name}"' in groups[1] for name in named if groups), command


def test_the_page_of_the_policy_is_what_the_policy_says() -> None:
    spec = importlib.util.spec_from_file_location("policy_page", ROOT / "docs" / "tools" / "policy.py")
    assert spec is not None and spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert tool.PAGE.read_text(encoding="utf-8") == tool.page(), "write it again: python docs/tools/policy.py"
    assert all(f"| `{row.name}` | {row.value:g} |" in tool.page() for row in rows())


def test_the_policy_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        POLICY.effect_penalty = 0.0  # type: ignore[misc]
    with pytest.raises((FrozenInstanceError, AttributeError, TypeError)):
        POLICY.another = 1.0  # type: ignore[attr-defined]
    assert Policy() == POLICY


def test_every_number_of_the_policy_is_used() -> None:
    text = "".join(f.read_text() for f in (PACKAGE / "diagnosis").rglob("*.py") if f.stem != "policy")
    used = set(re.findall(r"\b(?:policy|POLICY)\.(\w+)", text))
    assert {r.name for r in rows()} - used == set()
    assert used - {r.name for r in rows()} - {"POLICY", "Policy"} <= {"import"}


def test_no_module_that_decides_has_a_number_of_its_own() -> None:
    found = {}
    for file in modules_that_decide():
        name = file.relative_to(PACKAGE).with_suffix("").as_posix()
        named = numbers_named(file)
        assert set(ACCURACIES.get(name, {})) <= set(named), f"{name}: take what is gone out of ACCURACIES"
        found |= {f"{name}.{n}": file for n in named if n not in ACCURACIES.get(name, {})}
    assert not found, f"a number that decides belongs into diagnosis/policy.py: {', '.join(found)}"
    assert all(len(reason) > 3 for names in ACCURACIES.values() for reason in names.values())


def test_what_counts_as_a_number_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(
        "import numpy as np\nLIMIT = 0.3\nA, B = -1, 2.0 * np.pi\n_GRID = 2.0 ** np.arange(3)\nLEVEL: float = 1e-3\n"
        "LEVELS = (1.0, 2.0)\nNAME = 'x'\nFLAG = True\nlimit = 0.3\nTABLE = {'a': 1.0}\ndef f():\n    LOCAL = 1.0\n"
    )
    assert numbers_named(tmp_path / "module.py") == ["LIMIT", "A", "B", "_GRID", "LEVEL", "LEVELS"]
