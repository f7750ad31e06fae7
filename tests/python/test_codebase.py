"""The rules of the house, checked over the real sources: who includes and imports whom, sizes, names."""

from __future__ import annotations

import ast
import importlib
import re
import shutil
import subprocess
import sys
import types
from collections.abc import Iterator
from pathlib import Path

import pytest

import gaident
from clock import fastest
from gaident import cli

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / "csrc" / "gaident"
PACKAGE = ROOT / "python" / "gaident"

# The core, lowest first: a file includes only what stands above it. Files of one folder share its place.
CORE_ORDER = [
    *(
        "wrong_use",
        "rng",
        "arithmetic",
        "float_pair",
        "lanes",
        "c30",
        "fixed",
        "counting",
        "denormals",
        "chromosome",
        "population",
    ),
    *("genome", "factors", "roots", "decode", "encode", "decoder", "parameters", "neighbours", "delta", "bilinear", "held"),
    *("controller", "closed_loop", "loop", "record", "fitness", "candidate", "fixed_scaling", "operators", "static_search"),
    *("kernels/", "elementary", "effects/", "filter", "replay", "friction", "two_mass", "effect_constants", "effect_plant"),
    *(
        "own_effects",
        "effect_loop",
        "effect_kernels/",
        "advance",
        "parallel",
        "batch",
        "simulate",
        "mirror",
        "linear",
        "sweep",
        "refine",
        "statistics",
    ),
    *("settings", "breeder", "island", "species", "engine", "reference/", "effect_prepare", "effect_batch"),
]

# Python: what each room may import of gaident, beside itself, and what inside a function only. A room is a
# module or a folder of the package. Nothing but python -m gaident imports cli.
DESK = {"errors", "data", "models", "identification"}
ROOMS: dict[str, tuple[set[str], set[str]]] = {
    "errors": (set(), set()),
    "version": (set(), set()),
    "files": (set(), set()),
    "data": ({"errors", "files"}, {"version"}),
    "models": ({"errors", "data", "_core"}, {"export"}),
    "export": ({"errors", "files", "models", "_core"}, {"version"}),  # called by methods of models and results
    "identification": ({"errors", "version", "files", "data", "models", "_core"}, {"show", "export"}),
    "estimation": ({"errors", "data", "identification"}, {"show"}),
    "diagnosis": ({"errors", "version", "files", "data", "models", "identification"}, {"show", "export"}),
    "store": ({"errors", "data", "identification", "diagnosis"}, set()),
    "show": ({"errors"}, set()),
    "drive_file": (DESK | {"diagnosis", "show"}, set()),
    "drive_init": ({"errors", "data"}, set()),
    "doctor": ({"version"}, {"_core", "demo", "identification"}),
    "progress_bar": (set(), set()),
    "paper": (DESK | {"diagnosis", "version", "show"}, set()),
    "reporting": (DESK | {"diagnosis", "files", "version", "show"}, set()),
    "demo": (DESK | {"diagnosis"}, {"show"}),
    "cli": (
        DESK
        | {
            "diagnosis",
            "store",
            "show",
            "drive_file",
            "drive_init",
            "doctor",
            "demo",
            "files",
            "paper",
            "progress_bar",
            "reporting",
        },
        {"version"},
    ),
    "__main__": ({"cli"}, set()),
    "__init__": (set(), {"version"}),  # the rest is imported by name when it is used
}


def repository_files() -> list[Path]:
    """Return every file of the repository that is not ignored (every file, where there is no git)."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True) if shutil.which("git") else None
    if listed is not None and listed.returncode == 0:
        return [f for f in (ROOT / name for name in listed.stdout.split("\0") if name) if f.is_file()]
    folders = ("csrc", "python", "tests", "bench", ".ci", "docs", "examples")
    deep = [f for folder in folders for f in (ROOT / folder).rglob("*")]
    return [f for f in [*ROOT.iterdir(), *deep] if f.is_file() and "__pycache__" not in f.parts]


def sources(folder: Path, *suffixes: str) -> list[Path]:
    return sorted(f for f in folder.rglob("*") if f.suffix in suffixes)


def place(file: Path) -> int:
    """Return the place of a core file in CORE_ORDER."""
    relative = file.relative_to(CORE)
    name = f"{relative.parts[0]}/" if len(relative.parts) > 1 else relative.stem
    assert name in CORE_ORDER, f"{file.relative_to(ROOT)}: give it a place in CORE_ORDER ({Path(__file__).name})"
    return CORE_ORDER.index(name)


def includes(file: Path) -> list[tuple[str, bool]]:
    """Return what a C++ file includes, each with whether it stands in angle brackets."""
    lines = re.findall(r'^[ \t]*#[ \t]*include[ \t]*([<"])([^>"]+)[>"]', file.read_text(), re.MULTILINE)
    return [(name, bracket == "<") for bracket, name in lines]


def resolved(file: Path, name: str) -> Path:
    """Return the file that an #include in quotes means."""
    for folder in (file.parent, ROOT / "csrc"):
        if (folder / name).is_file():
            return (folder / name).resolve()
    raise AssertionError(f'{file.relative_to(ROOT)}: #include "{name}" names no file of the core')


def test_core_includes_only_what_stands_above() -> None:
    wrong = []
    for file in sources(CORE, ".hpp", ".cpp"):
        own_place = place(file)
        for name, in_brackets in includes(file):
            if in_brackets:
                # Headers of the standard library have no suffix; intrinsics are the compiler's own.
                if "." in name and name not in {"immintrin.h", "xmmintrin.h", "emmintrin.h"}:
                    wrong.append(f"{file.relative_to(ROOT)}: <{name}> is not the standard library")
                continue
            target = resolved(file, name)
            own_header = target.with_suffix("") == file.with_suffix("")
            same_folder = target.parent == file.parent != CORE
            if not (own_header or same_folder or place(target) < own_place):
                wrong.append(f"{file.relative_to(ROOT)}: {name} does not stand above it")
    assert not wrong, "\n".join(wrong)


def test_only_the_bindings_name_pybind11_and_python() -> None:
    files = [f for f in sources(ROOT / "csrc", ".hpp", ".cpp") if "bindings" not in f.relative_to(ROOT).parts]
    files += sources(ROOT / "tests" / "cpp", ".hpp", ".cpp") + sources(ROOT / "bench", ".hpp", ".cpp")
    named = [f for f in files if re.search(r"pybind11|\bPy_\w|Python\.h", f.read_text())]
    assert not named, named


def test_headers_may_be_included_twice() -> None:
    """That each compiles alone, `make test-sanitized` tests."""
    files = [*sources(ROOT / "csrc", ".hpp"), *sources(ROOT / "bench", ".hpp"), *sources(ROOT / "tests" / "cpp", ".hpp")]
    assert files
    assert not [str(f.relative_to(ROOT)) for f in files if "#pragma once" not in f.read_text().splitlines()]


def test_check_hpp_fails_when_a_check_fails(tmp_path: Path) -> None:
    compiler = shutil.which("g++") or shutil.which("c++")
    if compiler is None:
        pytest.skip("no C++ compiler on the path")
    bad = [
        "CHECK(false)",
        "CHECK_NEAR(1, 2, 0.5)",
        'CHECK_NEAR(std::nan(""), 0, 1)',
        "CHECK_THROWS(0, std::range_error)",
        "refuse()",
    ]
    lines = [
        '#include "check.hpp"',
        "#include <stdexcept>",
        'static int refuse() { throw std::range_error("no"); }',
        'TEST_CASE("good") { CHECK_NEAR(1, 1.5, 0.5); CHECK_THROWS(refuse(), std::range_error); }',
        *(f'TEST_CASE("bad {i}") {{ {body}; }}' for i, body in enumerate(bad, 1)),
    ]
    (tmp_path / "case.cpp").write_text("\n".join(lines) + "\n")
    main = ROOT / "tests" / "cpp" / "main.cpp"
    built = [
        "-std=c++20",
        "-I",
        str(main.parent),
        str(main),
        str(tmp_path / "case.cpp"),
        "-o",
        str(tmp_path / "case"),
    ]
    subprocess.run([compiler, *built], check=True)

    def exit_code(*names: str) -> int:
        return subprocess.run([str(tmp_path / "case"), *names], capture_output=True).returncode

    assert exit_code("good") == 0
    assert [exit_code(f"bad {i}") for i in range(1, len(bad) + 1)] == [1] * len(bad)
    assert exit_code() == 1
    assert exit_code("no such case") == 2
    assert exit_code("--list") == 0


def statements(node: ast.AST, inside: bool = False) -> Iterator[tuple[ast.AST, bool]]:
    """Yield every statement below, with whether it stands in a function."""
    inside = inside or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
    for child in ast.iter_child_nodes(node):
        if isinstance(child, (ast.stmt, ast.excepthandler, ast.match_case)):
            yield child, inside
            yield from statements(child, inside)


def imports(tree: ast.Module, package: str) -> list[tuple[str, bool, int]]:
    """Return (absolute module, whether inside a function, line) of every import of a module of `package`."""
    found = []
    for node, inside in statements(tree):
        if isinstance(node, ast.Import):
            found += [(alias.name, inside, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            up = package.split(".")[: len(package.split(".")) - node.level + 1]
            base = ".".join([*up, *([node.module] if node.module else [])]) if node.level else str(node.module)
            # `from gaident import x` reaches the module x
            names = [f"{base}.{a.name}" for a in node.names] if base == "gaident" else [base]
            found += [(name, inside, node.lineno) for name in names]
    return found


def test_python_imports_follow_the_rooms() -> None:
    wrong = []
    for file in sources(PACKAGE, ".py"):
        relative = file.relative_to(PACKAGE)
        room = relative.parts[0].removesuffix(".py")
        assert room in ROOMS, f"{file.relative_to(ROOT)}: give the room {room!r} its line in ROOMS ({Path(__file__).name})"
        always, later = ROOMS[room]
        package = ".".join(["gaident", *relative.parts[:-1]])
        for module, in_function, line in imports(ast.parse(file.read_text()), package):
            parts = module.split(".")
            if parts[0] != "gaident" or (in_function and module == "gaident.__version__"):
                continue
            target = parts[1] if len(parts) > 1 else "__init__"
            if target != room and target not in always and not (in_function and target in later):
                wrong.append(f"{file.relative_to(ROOT)}:{line}: {room} may not import {module} here")
    assert not wrong, "\n".join(wrong)


def test_importing_gaident_is_light() -> None:
    code = "import time, numpy, sys; t = time.process_time(); import gaident; print(time.process_time() - t); "
    code += "print([m for m in ('scipy', 'matplotlib', 'control', 'argparse') if m in sys.modules])"

    def seconds() -> float:
        out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        spent, loaded = out.splitlines()
        assert loaded == "[]", f"import gaident also imports {loaded}"
        return float(spent)

    assert fastest(seconds, below=0.25) < 0.25  # of processor time


def test_files_stay_readable() -> None:
    files = sources(ROOT / "csrc", ".hpp", ".cpp") + sources(PACKAGE, ".py", ".pyi")
    files += sources(ROOT / "bench", ".hpp", ".cpp", ".py")
    long = {str(f.relative_to(ROOT)): n for f in files if (n := len(f.read_text().splitlines())) > 400}
    assert not long, f"over 400 lines: {long}"


def test_library_code_prints_nothing() -> None:
    printing = []
    for file in sources(PACKAGE, ".py"):
        text = file.read_text()
        if file.parent == PACKAGE / "cli" or "print" not in text:
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print":
                printing.append(f"{file.relative_to(ROOT)}:{node.lineno}")
    for file in sources(ROOT / "csrc", ".hpp", ".cpp"):
        if re.search(r"\b(printf|puts|fputs|std::cout|std::cerr|std::clog)\b", file.read_text()):
            printing.append(str(file.relative_to(ROOT)))
    assert not printing, printing


def test_no_file_needs_this_machine() -> None:
    # Written in two parts, so that this file does not find itself.
    forbidden = re.compile("/wo" + r"rk/|\.\./sha" + "red|/ro" + r"ot/|/ho" + r"me/\w")
    # The place of the recorded data when nothing else is said; both go without it.
    allowed = {ROOT / "Makefile", ROOT / "tests" / "python" / "conftest.py"}
    found = []
    for file in repository_files():
        if file in allowed:
            continue
        try:
            lines = file.read_text().splitlines()
        except UnicodeDecodeError:
            continue  # a picture or a recording
        found += [f"{file.relative_to(ROOT)}:{i}: {s}" for i, s in enumerate(lines, 1) if forbidden.search(s)]
    assert not found, "\n".join(found)


def test_public_names_exist_and_explain_themselves() -> None:
    assert gaident.__all__
    assert len(set(gaident.__all__)) == len(gaident.__all__)
    for name in gaident.__all__:
        thing = getattr(gaident, name)
        if isinstance(thing, (type, types.FunctionType, types.ModuleType)):
            assert (thing.__doc__ or "").strip(), f"gaident.{name} has no docstring"
            # A dataclass writes its own signature where there is no docstring.
            assert not (thing.__doc__ or "").startswith(f"{name}("), f"gaident.{name} has no docstring"


def test_names_of_the_rooms_are_there() -> None:
    """Those of a module's name, too: gaident.identification.identify is the function, although its module is imported."""
    for stub in sources(PACKAGE, ".pyi"):
        if stub.stem == "__init__":
            room = importlib.import_module(".".join(["gaident", *stub.parent.relative_to(PACKAGE).parts]))
            assert room.__all__
            modules = {name for name in room.__all__ if isinstance(getattr(room, name), types.ModuleType)}
            assert modules <= {"effects", "errors"}


def test_every_command_has_a_function() -> None:
    for where in cli.COMMANDS.values():
        assert callable(cli._command(where)), where
