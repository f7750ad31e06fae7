"""Docstrings of what users call: numpydoc sections that agree with the code, and examples that run."""

from __future__ import annotations

import dataclasses
import doctest
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from numpydoc.docscrape import ClassDoc
from numpydoc.validate import validate

import gaident
from places import ROOT

REFERENCE = ROOT / "docs" / "reference"
PUBLIC = [path for page in sorted(REFERENCE.glob("*.md")) for path in re.findall(r"^::: (\S+)$", page.read_text(), re.MULTILINE)]
# See the list of numpydoc.validate: form of the text, summary, parameters with types and descriptions, returned values, examples.
LAYOUT = {"GL03", "GL05", "GL06", "GL07", "GL08", "GL09", "GL10", "SS01", "SS02", "SS03", "SS04", "SS05", "SS06"}
SECTIONS = {"PR01", "PR02", "PR03", "PR04", "PR05", "PR07", "PR10", "RT01", "RT03", "EX01"}
# What a method with at most one argument says in its summary.
SHORT = {"PR01", "RT01", "EX01"}


def named(path: str) -> Any:
    """What a line of the reference shows: a name with its module."""
    module, name = path.rsplit(".", 1)
    return getattr(importlib.import_module(module), name)


def members(kind: type) -> Iterator[tuple[str, bool]]:
    """The public methods and properties that a class defines, each with whether a summary will do."""
    for name, member in vars(kind).items():
        function = getattr(member, "__func__", member)
        elsewhere = (member.__doc__ or "").startswith("See `")  # it is what the class named there says of it
        if not name.startswith("_") and not elsewhere and (inspect.isfunction(function) or isinstance(member, property)):
            yield name, not inspect.isfunction(function) or len(inspect.signature(function).parameters) <= 2


def faults(path: str, checks: set[str]) -> list[str]:
    return [f"{path}: {code} {text}" for code, text in validate(path)["errors"] if code in checks]


@pytest.mark.parametrize("path", PUBLIC)
def test_docstrings_have_their_sections(path: str) -> None:
    thing = named(path)
    if not inspect.isclass(thing):
        assert not faults(path, LAYOUT | SECTIONS)
        return
    sections = ClassDoc(thing, config={"show_class_members": False})
    # The constructor's parameters are attributes too; of a result the attributes count.
    listed = [name for row in (*sections["Parameters"], *sections["Attributes"]) for name in row.name.split(", ")]
    fields = [f.name for f in dataclasses.fields(thing)] if dataclasses.is_dataclass(thing) else getattr(thing, "_fields", ())
    assert set(fields) <= set(listed), f"{path}: {sorted(set(fields) - set(listed))} stand in no section"
    assert all(row.type and row.desc for row in (*sections["Parameters"], *sections["Attributes"])), path
    is_shown = bool(sections["Examples"] or sections["See Also"]) or not listed
    assert is_shown, f"{path}: give an example, or say under See Also what makes such an object"
    found = faults(path, LAYOUT)
    for name, short in members(thing):
        found += faults(f"{path}.{name}", LAYOUT | SECTIONS - ({"EX01"} | (SHORT if short else set())))
    assert not found, "\n".join(found)


@pytest.mark.long
@pytest.mark.parametrize("path", PUBLIC)
def test_examples_run(path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # some write a file
    report: list[str] = []
    for test in doctest.DocTestFinder().find(named(path), path, module=False, globs={}):
        doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=report.append)
    assert not report, "".join(report)


def test_every_public_name_has_a_place_in_the_reference() -> None:
    shown = [named(path) for path in PUBLIC]
    for module in (gaident, gaident.effects, gaident.errors):
        for name in module.__all__:
            thing = getattr(module, name)
            if not inspect.ismodule(thing) and name != "check_schema":
                assert any(thing is other for other in shown), f"{name}: give it a line `::: module.{name}` in docs/reference"
