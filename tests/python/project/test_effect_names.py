"""Which sources name an effect: its header, the core's list, its row in the library, and what runs it in C."""

from __future__ import annotations

import ast
import importlib
import pkgutil
import re

import pytest
from test_codebase import imports, modules, sources

import gaident
from gaident.diagnosis import library
from gaident.diagnosis.experiments.menu import MENU
from gaident.diagnosis.library import terms
from gaident.diagnosis.library.cause import Cause
from gaident.diagnosis.library.equivalences import EQUIVALENT
from gaident.diagnosis.library.settings import OF_SETTING
from gaident.models.effects_linear import LINEAR
from places import CORE, PACKAGE, ROOT

EFFECTS = {row.name for row in gaident.effects.table() if not row.own}
CATALOGUE = ROOT / "docs/catalogue.md"
IN_CORE = CORE / "effects"
OF_THE_RECORD = {"outliers", "velocity_quantisation"}  # no fit moves them
# Python that may name an effect: the library of the diagnosis, and the transfer functions of those that are linear; and the
# demonstration, which hides one in a drive as a user would.
NAME_EFFECTS = ("diagnosis/library/", "models/effects_linear.py", "cli/demonstration.py")


def effects_named(text: str, effects: set[str]) -> list[tuple[int, str]]:
    """(line, effect) of each string or identifier of a module that is an effect's name, an identifier in capitals.

    Docstrings and __all__ do not count. Identifiers in small letters are words of the field: the lag of a torque is measured too.
    """
    tree = ast.parse(text)
    skipped: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            skipped.add(node.value)
        elif isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == "__all__" for t in node.targets):
            skipped.update(ast.walk(node))
    found = []
    capitals = {name.upper(): name for name in effects}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in skipped and node.value in effects:
            found.append((node.lineno, node.value))
        word = {ast.Name: "id", ast.Attribute: "attr"}.get(type(node))
        if word is not None and (name := capitals.get(getattr(node, word))) is not None:
            found.append((node.lineno, name))  # type: ignore[attr-defined]
    return sorted(found)


def types_of_the_core() -> dict[str, str]:
    """C++ type of each effect -> its name."""
    types = re.search(r"using Effects = EffectList<([^>]*)>", (IN_CORE / "list.hpp").read_text())
    assert types is not None
    listed = re.findall(r"\b[A-Z]\w+", types[1])
    return {t: re.sub(r"(?<!^)([A-Z])", r"_\1", t).lower() for t in listed}


def named_in_c(text: str, effects: set[str]) -> set[str]:
    """Effects whose name, in small letters, or whose type stands in C or C++ outside comments."""
    code = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)
    types = types_of_the_core()
    return {types.get(word, word) for word in re.findall(r"\w+", code)} & effects


def test_the_list_of_the_core_has_every_effect() -> None:
    several = {f"{row.name}_waves" for row in gaident.effects.table() if row.waves > 1}
    assert set(types_of_the_core().values()) == EFFECTS | several


def test_only_the_library_names_effects() -> None:
    """What another room has to know of an effect is data of its row, and is asked for by property."""
    assert effects_named('"""cogging"""\n__all__ = ["cogging"]\nx = "cogging" + f"{x}backlash"\nt.COGGING', EFFECTS) == [
        (3, "backlash"),
        (3, "cogging"),
        (4, "cogging"),
    ]
    found = []
    for file in sources(PACKAGE, ".py"):
        name = file.relative_to(PACKAGE).as_posix()
        if not name.startswith(NAME_EFFECTS):
            found += [f"{name}:{line}: {effect}" for line, effect in effects_named(file.read_text(), EFFECTS)]
    assert not found, "\n".join(found)


def test_the_library_offers_no_single_effect() -> None:
    """No module of it has a name for one; rows are in tuples, and other rooms import no module that contains rows."""
    rows = {place.__name__ for place in terms.PLACES}
    for found in pkgutil.iter_modules(library.__path__, library.__name__ + "."):
        module = importlib.import_module(found.name)
        single = [k for k, v in vars(module).items() if isinstance(v, Cause) or (isinstance(v, str) and v in EFFECTS)]
        assert not single, (found.name, single)
    known = modules()
    for name in known:
        if not name.startswith(library.__name__):
            assert not [target for target, _ in imports(name, known) if target in rows], name


def test_outside_its_effects_the_core_names_none() -> None:
    assert named_in_c('has<TransportDelay>(); // Cogging\n"backlash" /* Outliers */', EFFECTS) == {"transport_delay", "backlash"}
    found = {}
    for file in sources(ROOT / "csrc", ".hpp", ".cpp", ".h", ".c"):
        if IN_CORE not in file.parents and (names := named_in_c(file.read_text(), EFFECTS)):
            found[str(file.relative_to(ROOT))] = sorted(names)
    assert not found, found


@pytest.mark.parametrize("effect", sorted(EFFECTS))
def test_an_effect_is_its_header_one_entry_and_one_row(effect: str) -> None:
    """And its part of the C runtime, and of the catalogue; a linear one has its transfer function beside them."""
    headers = [f for f in IN_CORE.rglob("*.hpp") if f.stem == effect]
    assert len(headers) == 1, "one header"
    assert list(types_of_the_core().values()).count(effect) == 1, "one entry"
    row = [place.__name__ for place in terms.PLACES for cause in place.CAUSES if cause.name == effect]
    assert len(row) == (0 if effect in OF_THE_RECORD else 1), "one row"
    assert f"<!-- effect: {effect} -->" in CATALOGUE.read_text()
    naming = {f for f in IN_CORE.rglob("*.hpp") if effect in named_in_c(f.read_text(), EFFECTS)}
    assert naming == {*headers, IN_CORE / "list.hpp"}, "effects do not know one another"


@pytest.mark.long
def test_an_effect_that_nothing_else_contains_is_in_these_files_only() -> None:
    """All code that a new effect touches, shown by one that could be taken out again."""
    effect = "lugre_friction"
    found = {f for f in sources(PACKAGE, ".py") if any(e == effect for _, e in effects_named(f.read_text(), {effect}))}
    found |= {f for f in sources(ROOT / "csrc", ".hpp", ".cpp", ".h", ".c") if effect in named_in_c(f.read_text(), EFFECTS)}
    found |= {f for f in sources(PACKAGE, ".c", ".h") if effect in named_in_c(f.read_text(), EFFECTS)}
    named = [
        IN_CORE / "friction" / "lugre_friction.hpp",
        IN_CORE / "list.hpp",
        PACKAGE / "diagnosis" / "library" / "friction.py",
        PACKAGE / "export" / "runtime.c",
        PACKAGE / "export" / "runtime.h",
    ]
    assert {str(f.relative_to(ROOT)) for f in found} == {str(f.relative_to(ROOT)) for f in named}


def test_rows_name_what_there_is() -> None:
    """A misspelt effect, command or signal would be one that nothing has."""
    assert set(terms.LIBRARY) == EFFECTS - OF_THE_RECORD
    commands = {name for name, *_ in MENU}
    for name, row in terms.LIBRARY.items():
        assert {*row.nested, *row.excludes, *row.shared} <= set(terms.LIBRARY), name
        assert set(row.excited_by) <= commands, name
        assert row.domains <= {"velocity", "position", "past", "time", "torque"}, name
        assert row.place == next(r.place for r in gaident.effects.table() if r.name == name)
    assert all(effects for _, _, effects, _ in MENU), "each command is good at something"
    assert set().union(*(e.effects for e in EQUIVALENT)) <= set(terms.LIBRARY)
    assert {*OF_SETTING.values(), *LINEAR} <= set(terms.LIBRARY)
    in_series = {row.name for row in gaident.effects.table() if row.place == "plant"}
    assert in_series <= set(LINEAR), "what changes the mechanism is linear"


def test_the_estimation_knows_no_effect_and_no_diagnosis() -> None:
    known = modules()
    for name, file in known.items():
        if name.startswith("gaident.estimation"):
            assert not effects_named(file.read_text(), EFFECTS), name
            assert not [t for t, _ in imports(name, known) if t.startswith("gaident.diagnosis")], name
