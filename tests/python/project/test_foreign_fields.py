"""Nobody sets another object's fields: a method sets those of its own object, and what makes an object sets those of the new one.

A field that a function sets on what it was given changes an object of which others have a name.
It is found here as an assignment, also one in place, to a field or to an item of a field,
as `object.__setattr__` and as a method of a list, a set or a dictionary that changes it.
What is inside of a field of `self` belongs to `self`.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

import pytest

from places import PACKAGE

OWN = {"self", "cls"}
CHANGES = {
    *("append", "extend", "insert", "remove", "pop", "clear", "update", "setdefault"),
    *("add", "discard", "appendleft", "popleft"),
}
# Module -> what is set there, and why it may be: each is an object of a library, which has no other door.
ALLOWED = {
    "cli/commands/completion": (
        {"action.complete", "action.choices[short.dest].description"},
        "shtab reads how an option is completed from a field of the parser's option",
    ),
    "data/formats/foreign/child": (
        {"os.cpu_count", "sys.modules['pandas']"},
        "a process of our own, whose libraries start a thread for each processor else, and import what they do not need",
    ),
    "data/formats/foreign/mdf": ({"channel.conversion"}, "asammdf applies what stands there, whatever it is asked"),
    "data/signals/arrays": ({"copy.flags.writeable"}, "NumPy: how an array is made read-only"),
    "data/frequency/response": ({"copy.flags.writeable"}, "the same"),
    "data/signals/decimation": ({"taps.flags.writeable"}, "the same"),
    "estimation/parameterisation": ({"values.flags.writeable"}, "the same"),
    "identification/replay/replay": ({"shared.flags.writeable"}, "the same"),
    "policy/trial": ({"table.POLICY"}, "the bench puts another policy in place before anything is imported"),
    "show/draw": ({"fig.dpi"}, "matplotlib: the resolution of a figure that is drawn here"),
}


def foreign(text: str) -> list[str]:
    """What a module's functions set of objects that are neither their own nor made by them: "line: target"."""
    tree = ast.parse(text)
    found: set[tuple[int, str]] = set()
    for function in ast.walk(tree):
        if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            found |= {(n.lineno, ast.unparse(n)) for n in changed(function) if base_of(n) not in OWN | made_by(function)}
    return [f"{line}: {target}" for line, target in sorted(found)]


def changed(function: ast.AST) -> Iterator[ast.expr]:
    """Fields, and objects behind fields, that a function sets, deletes or changes in place."""
    for node in ast.walk(function):
        if isinstance(node, (ast.Attribute, ast.Subscript)) and isinstance(node.ctx, (ast.Store, ast.Del)):
            if isinstance(node, ast.Attribute) or behind_a_field(node):
                yield node
        elif isinstance(node, ast.Call):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if name in {"__setattr__", "setattr"} and node.args:
                yield node.args[0] if isinstance(node.args[0], (ast.Name, ast.Attribute)) else node
            elif name in CHANGES and isinstance(node.func, ast.Attribute) and behind_a_field(node.func.value):
                yield node.func.value


def behind_a_field(node: ast.expr) -> bool:
    """Whether an expression is, or is an item of, a field of an object."""
    while isinstance(node, ast.Subscript):
        node = node.value
    return isinstance(node, ast.Attribute)


def base_of(node: ast.expr) -> str:
    """The name that an expression of fields and items begins with; "" where it begins otherwise."""
    while isinstance(node, (ast.Attribute, ast.Subscript)):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def made_by(function: ast.AST) -> set[str]:
    """Local names of objects whose making a function takes part in: `cls(...)`, or what `__new__` gives."""
    names = set()
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
            called = node.value.func
            if getattr(called, "id", getattr(called, "attr", "")) in {"cls", "__new__"}:
                names |= {t.id for t in node.targets if isinstance(t, ast.Name)}
    return names


@pytest.mark.long
def test_nobody_sets_fields_of_another_object() -> None:
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        name = file.relative_to(PACKAGE).with_suffix("").as_posix()
        targets = foreign(file.read_text())
        allowed = ALLOWED.get(name, (set(), ""))[0]
        assert allowed <= {t.partition(": ")[2] for t in targets}, f"{name}: what is not set any more is not on the list"
        if others := [t for t in targets if t.partition(": ")[2] not in allowed]:
            found[name] = others
    assert not found, f"return the value, or let the object have a method that notes it: {found}"


@pytest.mark.parametrize(
    ("body", "targets"),
    [
        ("other.x = 1", ["other.x"]),
        ("other.x += 1", ["other.x"]),
        ("other.x: int = 1", ["other.x"]),
        ("other.x, y = 1, 2", ["other.x"]),
        ("other.part.x = 1", ["other.part.x"]),
        ("other.rows[0] = 1", ["other.rows[0]"]),
        ("del other.x", ["other.x"]),
        ("for other.x in range(3): ...", ["other.x"]),
        ("made = Made()\n made.x *= 2", ["made.x"]),
        ("object.__setattr__(other, 'x', 1)", ["other"]),
        ("setattr(other, 'x', 1)", ["other"]),
        ("other.found.append(1)", ["other.found"]),
        ("other.table['a'].append(1)", ["other.table['a']"]),
        ("self.x = self.part.y = 1", []),
        ("self.rows[0] = 1; self.found.append(1); self.table['a'].x += 1", []),
        ("object.__setattr__(self, 'x', 1)", []),
        ("new = cls(1)\n new.x = 1", []),
        ("new = object.__new__(cls)\n object.__setattr__(new, 'x', 1)", []),
        ("rows[0] = 1; found.append(1); x = other.x", []),
    ],
)
def test_what_counts_as_another_objects_field(body: str, targets: list[str]) -> None:
    found = foreign(f"def f(self, cls, other, rows, found):\n {body}\n")
    assert [f.partition(": ")[2] for f in found] == targets
