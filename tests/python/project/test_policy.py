"""The policy: every number that decides has its unit, its source and the command that measures it, and none stands elsewhere."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import re
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, fields

import pytest

from gaident.policy.declared import EFFORT, SHOWN_BY
from gaident.policy.table import POLICY, Policy, rows
from places import PACKAGE, ROOT

# Every room is walked.
# A number that decides is a row of the policy; another says on its line (or on a line of its own above) why it decides nothing:
# `# no decision: a start of a fit`.
MARK = "# no decision: "
# Numbers with a name in capitals are found wherever a module or class has them.
# Others stand in no comparison and bound nothing, count no iterations, cut no list, are no default,
# no factor of a standard deviation or of what a call is given, and no value of a dictionary; nor does a local name stand there
# for them.
# Free are these, what only guards a division or stands for no limit, and 2 pi; a 2 is a count, a 2.0 is a factor.
FREE = (-1, 0, 1, 2)
# A remark gives one of the reasons that policy/table.py lists, or a sentence: a few words that only say what it is are no reason.
REASON = re.compile(
    r"\b(rounding|memory|what an argument may be|of a solver|the step of a difference|a start|a grid|a unit|exact to|by 0"
    r"|how many|a formula|a format|printed|drawn)\b"
)
SENTENCE = 10  # words
BOUNDS = {"max", "min", "maximum", "minimum", "clip"}
STEPS = {"max_nfev", "maxiter", "popsize"}
FITS = {"fit", "fitted", "refitted", "continued", "reestimated", "evolved", "start"}
TABLES = {
    **dict.fromkeys(
        (f"diagnosis/library/{place}" for place in ("plant", "friction", "load", "harmonic", "coupling", "actuator", "sensor")),
        "bounds, steps and starts of the parameters of each effect",
    ),
    "diagnosis/library/controller": "the same",
    "diagnosis/library/kinds": "the same",
    "diagnosis/experiments/menu": "shapes of the commands that are proposed",
    "diagnosis/experiments/commands": "the same",
}
# Whole modules in which no number decides.
DRAWN = {
    "data/formats/mat": "numbers of a file format",
    "show/report/packing": "the same",
    **dict.fromkeys(("data/formats/units", "drive/quantities"), "units"),
    "identification/m_sequence": "feedback of shift registers",
    **dict.fromkeys(("paper/page", "paper/plots"), "how it is printed and drawn"),
    "cli/demonstration": "the drive of the demonstration",
    **dict.fromkeys(("paper/facts", "paper/experiment", "paper/conventional", "paper/friction"), "the published experiment"),
    **dict.fromkeys(("paper/reproduction", "paper/rig", "paper/tables"), "the same"),
    **dict.fromkeys(("show/chart", "show/draw", "show/plots", "show/response_plots", "show/search_charts"), "how it is drawn"),
    **dict.fromkeys(("show/diagnosis_charts", "show/diagnosis_numbers", "show/report/charts", "show/report/live"), "the same"),
    **dict.fromkeys(("show/record_html", "show/progress_bar"), "the same"),
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
            if numeric(value) and not any(map(is_reason, reasons)):
                found += [n for n in names if re.fullmatch(r"_?[A-Z][A-Z0-9_]*", n)]
    return found


def numbers_compared(text: str) -> list[str]:
    """Names in capitals of a module's numbers that are compared or bound, where their line does not say why they decide nothing.

    A reason is one of those that policy/table.py lists, or a sentence.
    """
    found, lines, tree = [], text.splitlines(), ast.parse(text)
    parts = [part for node in ast.walk(tree) for part in ([node] if isinstance(node, ast.Compare) else bounded(node))]
    used = {n.id for part in parts for n in ast.walk(part) if isinstance(n, ast.Name)}
    for node in tree.body:
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value is not None and numeric(node.value):
            reason = lines[node.lineno - 1].partition(MARK)[2]
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = {n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name) and n.id.isupper()}
            if not is_reason(reason):
                found += sorted(names & used)
    return found


def numbers_inside(text: str) -> list[str]:
    """Numbers without a name in capitals that may decide: "line: number", but for lines that say that they decide nothing.

    They stand in comparisons, bounds, iterations, defaults and ends of lists, or have a local name that stands there.
    """
    found: list[ast.Constant] = []
    for node in ast.walk(ast.parse(text)):
        parts: list[ast.expr] = []
        if isinstance(node, ast.Compare):
            parts = [node]
        elif isinstance(node, ast.Slice) and isinstance(node.upper, ast.Constant) and node.lower is None:
            parts = [node.upper]
        elif isinstance(node, ast.BinOp):
            parts = of_a_deviation(node)
        elif isinstance(node, ast.Call):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            parts = bounded(node) or [a for a in node.args if isinstance(a, ast.Constant) and name in FITS]
            parts += [k.value for k in node.keywords if k.arg in STEPS]
            parts += [f for a in (*node.args, *(k.value for k in node.keywords)) for f in factors(a)]
        elif isinstance(node, ast.Dict):
            parts = [n for value in node.values for n in of_a_table(value)]
        elif isinstance(node, ast.For) and isinstance(node.target, ast.Name) and node.target.id == "_":
            parts = [node.iter]  # so many times the same, as the iterations of a fit
        elif isinstance(node, (ast.FunctionDef, ast.Lambda)):
            parts = [*node.args.defaults, *(d for d in node.args.kw_defaults if d is not None)]
            found += local_numbers(node) if isinstance(node, ast.FunctionDef) else []
        found += [n for part in parts for n in literals(part)]
    kept = {n for n in found if not excused(text.splitlines(), n.lineno)}
    return [f"{line}: {value}" for line, value in sorted({(n.lineno, n.value) for n in kept})]


def excused(lines: list[str], number: int) -> bool:
    """Whether a line, or a comment that stands alone above it, says why it decides nothing."""
    above = lines[number - 2].strip() if number > 1 else ""
    return is_reason(lines[number - 1].partition(MARK)[2]) or (above.startswith(MARK) and is_reason(above[len(MARK) :]))


def is_reason(remark: str) -> bool:
    """Whether a remark gives a reason of the list, or says why in a sentence."""
    return bool(REASON.search(remark)) or len(remark.split()) >= SENTENCE


def local_numbers(function: ast.FunctionDef) -> list[ast.Constant]:
    """Numbers of a function that have a local name, or are a factor of what has one, where that name is compared or bounds."""
    decides = {
        name.id
        for node in ast.walk(function)
        for part in ([node.left, *node.comparators] if isinstance(node, ast.Compare) else bounded(node))
        for name in made_of(part, (ast.Add, ast.Sub, ast.Mult, ast.Div))
        if isinstance(name, ast.Name)
    }
    found: list[ast.expr] = []
    for node in ast.walk(function):
        pairs: list[tuple[ast.expr, ast.expr]] = []
        if isinstance(node, ast.Assign):
            for target in node.targets:
                both = isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
                pairs += zip(target.elts, node.value.elts, strict=False) if both else [(target, node.value)]  # type: ignore[attr-defined]
        elif isinstance(node, (ast.AnnAssign, ast.NamedExpr)) and node.value is not None:
            pairs = [(node.target, node.value)]
        for target, value in pairs:
            if isinstance(target, ast.Name) and target.id in decides:
                found += made_of(value, (ast.Mult, ast.Div))  # a sum of several terms is a formula
    return [n for part in found for n in literals(part) if n is part]


def bounded(node: ast.AST) -> list[ast.expr]:
    """Arguments of a call that bounds."""
    if not isinstance(node, ast.Call):
        return []
    return node.args if getattr(node.func, "attr", getattr(node.func, "id", "")) in BOUNDS else []


def made_of(node: ast.expr, operators: tuple[type[ast.operator], ...]) -> Iterator[ast.expr]:
    """Names and numbers that a value is made of by some operators, but nothing inside of calls and indices."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, operators) and not of_a_turn(node):
        yield from made_of(node.left, operators)
        yield from made_of(node.right, operators)
    elif isinstance(node, ast.UnaryOp):
        yield from made_of(node.operand, operators)
    elif isinstance(node, ast.IfExp):
        yield from made_of(node.body, operators)
        yield from made_of(node.orelse, operators)
    else:
        yield node


def of_a_turn(node: ast.expr) -> bool:
    """Whether an expression is a number of turns: 2 pi."""
    return numeric(node) and any(isinstance(n, ast.Attribute) and n.attr == "pi" for n in ast.walk(node))


def of_a_deviation(node: ast.AST) -> list[ast.expr]:
    """The factors of so many standard deviations, 2.0 * inertia.std; 100 * std is a percentage."""
    if not (isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult)):
        return []
    names = [getattr(side, "attr", getattr(side, "id", "")) for side in (node.left, node.right)]
    factors = [n for n in (node.left, node.right) if isinstance(n, ast.Constant) and isinstance(n.value, float)]
    return list(factors) if any(re.fullmatch(r"std|sigma|.*_std|deviation", name) for name in names) else []


def factors(argument: ast.expr) -> list[ast.expr]:
    """The factors of what a call is given, 0.01 * largest; a half is a mean, and a power of ten from ten on another unit."""
    if not isinstance(argument, ast.BinOp) or numeric(argument):
        return []
    found = [n for n in made_of(argument, (ast.Mult,)) if isinstance(n, ast.Constant) and isinstance(n.value, float)]
    return [n for n in found if n.value not in (0.5, 1e1, 1e2, 1e3, 1e6)]  # type: ignore[attr-defined]


def of_a_table(value: ast.expr) -> Iterator[ast.expr]:
    """The numbers of a dictionary's value, and of calls in it; a half is a mean, and a text contains none that decide."""
    if isinstance(value, ast.JoinedStr):
        return
    if isinstance(value, ast.Constant) and value.value != 0.5:
        yield value
    power = value.right if isinstance(value, ast.BinOp) and isinstance(value.op, ast.Pow) else None
    for inner in ast.iter_child_nodes(value):
        if (
            inner is not power
            and isinstance(inner, (ast.expr, ast.keyword))
            and not isinstance(value, (ast.Subscript, ast.Dict, ast.Lambda))
        ):
            yield from of_a_table(inner.value if isinstance(inner, ast.keyword) else inner)


def literals(node: ast.expr) -> Iterator[ast.Constant]:
    """Numbers in an expression that may decide; indices and powers are none, nor what is next to nothing or to infinity.

    A 2 is a count, a 2.0 is a factor, but for that of 2 pi.
    """
    number = isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
    if number:
        free = FREE if isinstance(node.value, int) else FREE[:-1]
        if abs(node.value) not in free and 1e-8 < abs(node.value) < 1e100:
            yield node
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
        yield from literals(node.left)
        return
    if (
        isinstance(node, ast.BinOp)
        and numeric(node)
        and any(isinstance(n, ast.Attribute) and n.attr == "pi" for n in ast.walk(node))
    ):
        return
    for inner in ast.iter_child_nodes(node):
        if isinstance(inner, ast.expr) and not (isinstance(node, ast.Subscript) and inner is node.slice):
            yield from literals(inner)


def modules() -> dict[str, str]:
    """Name -> text of every module but those of the policy itself."""
    names = {f.relative_to(PACKAGE).with_suffix("").as_posix(): f for f in sorted(PACKAGE.rglob("*.py"))}
    return {name: f.read_text() for name, f in names.items() if not name.startswith("policy/")}


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


def test_the_commands_can_be_called(monkeypatch: pytest.MonkeyPatch) -> None:
    """The script is there, and takes what a command names; that of a row measures this row."""
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    for row in rows():
        if not row.command:
            continue
        program, script, *arguments = row.command.split()
        assert program == "python" and (ROOT / script).is_file(), row
        if script == "bench/policy.py":
            assert arguments == [row.name], row
        else:
            assert all(a.isdigit() or f'"{a}"' in (ROOT / script).read_text() for a in arguments), row
        assert [r.name for r in importlib.import_module("policy").options_of([row.name]).rows] == [row.name]


def test_a_row_that_decides_says_which_cases_show_it() -> None:
    assert {r.cases for r in rows() if r.command} == set(SHOWN_BY)
    assert not [r.name for r in rows() if bool(r.cases) != bool(r.command)]


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
    texts = modules()
    found = [f"{module}.{name}" for module, text in texts.items() if module not in DRAWN for name in numbers_named(text)]
    assert not found, f"a number that decides is a row of policy/table.py, others say '{MARK}why': {', '.join(found)}"


def test_a_named_number_that_is_compared_says_why_it_decides_nothing() -> None:
    texts = modules()
    found = [f"{module}.{name}" for module, text in texts.items() if module not in DRAWN for name in numbers_compared(text)]
    assert not found, f"a number that is compared is a row of the policy, or '{MARK}' and a whole sentence: {', '.join(found)}"


def test_what_counts_as_a_reason() -> None:
    text = "A = 0.9  # no decision: of the torque\nB = 1e-9  # no decision: rounding\nC = 3  # no decision: of a message\n"
    sentence = "each pass shows outliers that others hid, and ends where none is new"
    text += f"D = 4  # no decision: {sentence}\nE, F = 16, 4  # no decision: samples\n"
    assert numbers_compared(f"{text}x < A * y\nx < B\nprint(C)\nx > D\nmax(n // E, F)\n") == ["A", "E", "F"]


@pytest.mark.long
def test_no_number_without_a_name_decides() -> None:
    texts = modules()
    assert set(TABLES) | set(DRAWN) <= set(texts)
    found = [
        f"{module}:{number}"
        for module, text in texts.items()
        if module not in TABLES and module not in DRAWN
        for number in numbers_inside(text)
    ]
    assert not found, f"a number that decides is a row of policy/table.py, others have a name and '{MARK}why': {', '.join(found)}"


def test_what_bounds_the_work_of_a_search_is_a_row_of_effort() -> None:
    """No remark excuses a number as effort: what may stand outside, policy/table.py says."""
    said = re.compile(re.escape(MARK) + r".*\b(effort|work|starts of|iterations|rounds)\b")
    assert said.search(f"ROUNDS = 3{'  '}{MARK}effort; fits") and not said.search(f"X = 3{'  '}{MARK}a start")
    found = [f"{module}: {line.strip()}" for module, text in modules().items() for line in text.splitlines() if said.search(line)]
    assert not found, f"what bounds the work of a search or a fit is a row of policy/effort.py: {', '.join(found)}"


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
        ("least_squares(f, x, max_nfev=40)", ["40"]),
        ("for _ in range(50): ...", ["50"]),
        ("for k in range(50): ...", []),
        ("lambda x, most=7: x", ["7"]),
        ("def f(x, *, most=7): ...", ["7"]),
        ("x < 2.0 * floor", ["2.0"]),
        ("x > y + 2.0", ["2.0"]),
        ("bound = x.value + 2.5 * x.std", ["2.5"]),
        ("bound = 2.0 * noise_std", ["2.0"]),
        ("def f(x):\n limit = 3.0\n return x < limit", ["3.0"]),
        ("def f(x):\n limit: float = 3.0\n return max(x, limit)", ["3.0"]),
        ("def f(x, y):\n near, far = 3.0 * y, 5.0\n return near < x", ["3.0"]),
        ("def f(x, y):\n limit = 3.0 if y else 4.0\n return 1.0 - limit < x", ["3.0", "4.0"]),
        ("def f(x):\n if x < (limit := 3.0):\n  return limit", ["3.0"]),
        ("def f(x, limit=3.0): ...", ["3.0"]),
        ("x < 0.3  # no decision: a start", []),
        ("# no decision: a start\nx < 0.3", []),
        ("x < 0.3  # no decision: ", ["0.3"]),
        ("def f(x):\n scale = 3.0\n return scale * x", []),
        ("def f(a, b):\n root = b * b - 4.0 * a\n return root < 0", []),
        ("f'{100 * std:.2g} %'", []),
        ("x < 2.0 * np.pi and y < z**3", []),
        ("0.0 < x <= 1 and abs(y) < 2 * z and len(u) > 1", []),
        ("x[:, 3] > x[:, 4]", []),
        ("max(x, 1e-300)", []),
        ("0.25 * x + 3.0", []),
        ("ls.fit(objective, POLICY.usual)", []),
        ("sums(x, 0.01 * largest)", ["0.01"]),
        ("sums(x, most=y * 0.02)", ["0.02"]),
        ("sums(x, 1e3 * dt, 0.5 * (x + y), 2.0 * np.pi * f)", []),
        ("sums(x, 0.01 * largest)  # no decision: of the largest", ["0.01"]),
        ("sums(x, 0.01 * largest)  # no decision: the step of a difference", []),
        ("{'a': (np.log(0.05 * x), f(1e5)), 'b': y}['a']", ["0.05", "100000.0"]),
        ("{'a': f'{1e3 * x:.3g}', 'b': (0.0, 1.0), 'c': x[3]}", []),
    ],
)
def test_what_counts_as_a_number_that_decides(line: str, numbers: list[str]) -> None:
    assert [found.split(": ")[1] for found in numbers_inside(line)] == numbers
