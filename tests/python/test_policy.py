"""The policy: every number that decides has its unit, its source and the command that measures it, and none stands elsewhere."""

from __future__ import annotations

import ast
import importlib.util
import re
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, fields

import pytest

from drive_cases import EFFECTS
from gaident.policy.table import EFFORT, POLICY, Policy, rows
from test_codebase import PACKAGE, ROOT

# Rooms in which a number that a module names in capitals, NAME = 0.3, is a row of the policy, or says on its line why it decides
# nothing: `# no decision: a start of a fit`.
NAMED = ("diagnosis", "estimation", "identification")
MARK = "# no decision: "
# In the diagnosis a number without a name stands in no comparison and bounds nothing, counts no iterations and cuts no list, but
# for these, and what only guards a division or stands for no limit.
FREE = (-1, 0, 1, 2)
BOUNDS = {"max", "min", "maximum", "minimum", "clip"}
FITS = {"fit", "fitted", "refitted", "continued", "reestimated", "evolved", "start"}
TABLES = {
    "diagnosis/library/terms": "bounds, steps and starts of the parameters of each effect",
    "diagnosis/library/coordinates": "the same",
    "diagnosis/experiments/menu": "shapes of the commands that are proposed",
    "diagnosis/experiments/commands": "the same",
    "diagnosis/experiments/first_experiment": "the same",
}


def deciding() -> list[str]:
    """Names of the policy's numbers that decide: all but those of effort."""
    return [r.name for r in rows() if r.group != EFFORT]


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


def numbers_named(text: str) -> list[str]:
    """Names in capitals that a module or a class gives to numbers, where nothing on their lines says that they decide nothing."""
    found, lines = [], text.splitlines()
    for node in ast.walk(ast.parse(text)):
        for inner in node.body if isinstance(node, (ast.Module, ast.ClassDef)) else []:
            if isinstance(inner, ast.Assign):
                targets, value = inner.targets, inner.value
            elif isinstance(inner, ast.AnnAssign) and inner.value is not None:
                targets, value = [inner.target], inner.value
            else:
                continue
            names = [n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)]
            reasons = [line.partition(MARK)[2] for line in lines[inner.lineno - 1 : inner.end_lineno]]
            if numeric(value) and not any(r.strip() for r in reasons):
                found += [n for n in names if re.fullmatch(r"_?[A-Z][A-Z0-9_]*", n)]
    return found


def numbers_inside(text: str) -> list[str]:
    """Numbers without a name in comparisons, bounds, iterations, defaults and ends of lists: "line: number"."""
    found = []
    for node in ast.walk(ast.parse(text)):
        parts: list[ast.expr] = []
        if isinstance(node, ast.Compare):
            parts = [node]
        elif isinstance(node, ast.Slice) and isinstance(node.upper, ast.Constant):
            parts = [node.upper]
        elif isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            parts = node.args if name in BOUNDS else [a for a in node.args if isinstance(a, ast.Constant) and name in FITS]
        elif isinstance(node, (ast.FunctionDef, ast.Lambda)):
            parts = [*node.args.defaults, *(d for d in node.args.kw_defaults if d is not None)]
        found += [f"{n.lineno}: {n.value}" for part in parts for n in literals(part)]
    return sorted(set(found))


def literals(node: ast.expr) -> Iterator[ast.Constant]:
    """Numbers in an expression that may decide; indices are none, nor what is next to nothing or to infinity."""
    number = isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
    if number and abs(node.value) not in FREE and 1e-8 < abs(node.value) < 1e100:
        yield node
    for inner in ast.iter_child_nodes(node):
        if isinstance(inner, ast.expr) and not (isinstance(node, ast.Subscript) and inner is node.slice):
            yield from literals(inner)


def modules(*rooms: str) -> dict[str, str]:
    """Name -> text of the modules in some rooms."""
    files = sorted(f for room in rooms for f in (PACKAGE / room).rglob("*.py"))
    return {f.relative_to(PACKAGE).with_suffix("").as_posix(): f.read_text() for f in files}


def test_every_row_has_a_unit_and_a_source() -> None:
    assert {r.name for r in rows()} == {f.name for f in fields(Policy)}
    for row in rows():
        assert row.value == getattr(POLICY, row.name) and row.value > 0, row.name
        assert row.unit.strip() and row.group and len(row.source) > 10, row.name


def test_every_number_that_decides_has_the_command_that_measures_it() -> None:
    without = [r.name for r in rows() if r.name in deciding() and not r.command]
    assert not without
    assert len(deciding()) > 15 and len(rows()) - len(deciding()) > 5
    beside = [r.name for r in rows() if r.name not in deciding() and r.command]
    assert not beside, "a number with a command decides: it is no effort"


def test_the_commands_can_be_called() -> None:
    """The script is there, and knows the options, groups and effects that a command names."""
    for command in {r.command for r in rows() if r.command}:
        program, script, *arguments = command.split()
        assert program == "python" and (ROOT / script).is_file(), command
        text, option = (ROOT / script).read_text(), ""
        groups = re.search(r"^GROUPS = \((.*)\)$", text, re.MULTILINE)
        for argument in arguments:
            if argument.startswith("--"):
                option = argument
                assert f'"{option}"' in text, command
            elif option == "--effects":
                assert argument in EFFECTS, command
            elif option == "--only":
                assert groups is not None and f'"{argument}"' in groups[1], command
            else:
                assert argument.isdigit(), command


def test_the_page_of_the_policy_is_what_the_policy_says() -> None:
    spec = importlib.util.spec_from_file_location("policy_page", ROOT / "docs" / "tools" / "policy.py")
    assert spec is not None and spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert tool.PAGE.read_text(encoding="utf-8") == tool.page(), "write it again: python docs/tools/policy.py"
    text = tool.page()
    assert all(f"| `{row.name}` | {row.value:g} |" in text for row in rows())


def test_the_policy_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        POLICY.effect_penalty = 0.0  # type: ignore[misc]
    with pytest.raises((FrozenInstanceError, AttributeError, TypeError)):
        POLICY.another = 1.0  # type: ignore[attr-defined]
    assert Policy() == POLICY


def test_every_number_of_the_policy_is_used() -> None:
    text = "".join(f.read_text() for f in PACKAGE.rglob("*.py") if f.parent.name != "policy")
    used = set(re.findall(r"\b(?:policy|POLICY)\.(\w+)", text)) - {"table"}
    assert used == {r.name for r in rows()}


def test_a_number_with_a_name_is_in_the_policy_or_says_why_not() -> None:
    found = [f"{module}.{name}" for module, text in modules(*NAMED).items() for name in numbers_named(text)]
    assert not found, f"a number that decides is a row of policy/table.py, others say '{MARK}why': {', '.join(found)}"


def test_no_number_without_a_name_decides() -> None:
    texts = modules("diagnosis")
    assert set(TABLES) <= set(texts)
    found = [f"{module}:{number}" for module, text in texts.items() if module not in TABLES for number in numbers_inside(text)]
    assert not found, f"a number that decides is a row of policy/table.py, others have a name and '{MARK}why': {', '.join(found)}"


def test_what_counts_as_a_number_of_its_own() -> None:
    text = (
        "import numpy as np\nLIMIT = 0.3\nA, B = -1, 2.0 * np.pi\n_GRID = 2.0 ** np.arange(3)\nLEVEL: float = 1e-3\n"
        "LEVELS = (1.0, 2.0)\nNAME = 'x'\nFLAG = True\nlimit = 0.3\nTABLE = {'a': 1.0}\ndef f():\n    LOCAL = 1.0\n"
        "class C:\n    INNER = 3\nSTART = 0.3  # no decision: a start\nBARE = 0.3  # no decision: \n"
    )
    assert numbers_named(text) == ["LIMIT", "A", "B", "_GRID", "LEVEL", "LEVELS", "BARE", "INNER"]


@pytest.mark.parametrize(
    ("line", "numbers"),
    [
        ("x < 0.3", ["0.3"]),
        ("x < 3.0 * floor", ["3.0"]),
        ("max(6.0 * noise, 1e-300)", ["6.0"]),
        ("np.clip(x, -0.5, 0.7)", ["0.5", "0.7"]),
        ("costs[:3]", ["3"]),
        ("ls.fit(objective, x, 8)", ["8"]),
        ("lambda x, most=7: x", ["7"]),
        ("def f(x, *, most=7): ...", ["7"]),
        ("0.0 < x <= 1 and abs(y) < 2.0 * z and len(u) > 1", []),
        ("x[:, 3] > x[:, 4]", []),
        ("max(x, 1e-300)", []),
        ("0.25 * x + 3.0", []),
        ("ls.fit(objective, POLICY.usual)", []),
    ],
)
def test_what_counts_as_a_number_that_decides(line: str, numbers: list[str]) -> None:
    assert numbers_inside(line) == [f"1: {n}" for n in numbers]
