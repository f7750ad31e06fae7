"""The rules of the house, checked over the real sources: who includes and imports whom, sizes, names."""

from __future__ import annotations

import ast
import graphlib
import importlib
import re
import shutil
import subprocess
import sys
import types
from collections import Counter
from pathlib import Path

import pytest

import gaident
from clock import fastest
from gaident import providers
from gaident.cli.main import COMMANDS, _command
from places import CORE, PACKAGE, ROOT

# The rooms of the core, lowest first: a file includes its own room and rooms before it. Folders inside a room belong to it.
CORE_ROOMS = [
    *("numeric", "runtime", "plant", "genetic", "search"),  # the genetic search knows no simulator
    *("control", "simulation", "effects", "nonlinear", "estimation", "target", "identification", "reference"),
]
MOST_FILES = 20  # of code in one folder

# Python: the rooms of gaident, lowest first.
# A module imports its own room and rooms that stand above its line here, inside functions and for type checks too.
# A room is a folder, without the folders in it that have a line of their own, or one module.
ROOMS = [
    *("arguments", "messages", "errors", "axis", "version", "checks", "files", "processors", "providers", "policy", "_core"),
    "estimation/criterion",  # formulas that every room decides by
    *("data/signals", "data/formats", "control", "data", "models", "results"),
    *("show", "show/report", "export", "identification"),
    *("estimation/regression", "estimation"),
    *(
        "diagnosis/records",
        "diagnosis/library",
        "diagnosis/selection",
        "diagnosis/unlogged",
        "diagnosis",
        "diagnosis/controller",
        "diagnosis/experiments",
        "diagnosis/explain",
        "diagnosis/work",
        "diagnosis/diagnose",
        "diagnosis/stability",
    ),
    "remedies",  # gains, and tables of feedforward, of what was found
    "simulators",  # the same under the names of other simulators
    *("reporting", "paper", "drive", "fleets", "cli", "cli/commands", "__init__", "__main__"),
]
# What is still to be cut: modules that import each other.
CIRCLES: list[set[str]] = []


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


def core_room(file: Path) -> int:
    """Return the place of a core file's room in CORE_ROOMS."""
    room = file.relative_to(CORE).parts[0]
    assert room in CORE_ROOMS, f"{file.relative_to(ROOT)}: a file stands in one of the rooms {', '.join(CORE_ROOMS)}"
    return CORE_ROOMS.index(room)


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


def test_core_rooms_include_only_lower_rooms() -> None:
    wrong = []
    for file in sources(CORE, ".hpp", ".cpp"):
        for name, in_brackets in includes(file):
            if in_brackets:
                # Headers of the standard library have no suffix; intrinsics are the compiler's own.
                if "." in name and name not in {"immintrin.h", "xmmintrin.h", "emmintrin.h", "arm_neon.h"}:
                    wrong.append(f"{file.relative_to(ROOT)}: <{name}> is not the standard library")
            elif core_room(resolved(file, name)) > core_room(file):
                wrong.append(f"{file.relative_to(ROOT)}: {name} stands in a higher room")
    assert not wrong, "\n".join(wrong)


def test_core_includes_in_no_circle() -> None:
    above: dict[Path, list[Path]] = {
        file: [resolved(file, name) for name, in_brackets in includes(file) if not in_brackets]
        for file in sources(CORE, ".hpp", ".cpp")
    }
    done: set[Path] = set()

    def visit(file: Path, way: list[Path]) -> None:
        circle = [f.relative_to(CORE) for f in way[way.index(file) :]] if file in way else []
        assert not circle, " includes ".join(map(str, [*circle, file.relative_to(CORE)]))
        if file not in done:
            for included in above[file]:
                visit(included, [*way, file])
            done.add(file)

    for file in above:
        visit(file, [])


@pytest.mark.parametrize("top", ["csrc", "python", "tests", "bench", "examples"])
def test_folders_stay_small(top: str) -> None:
    counts = Counter(f.parent for f in sources(ROOT / top, ".hpp", ".cpp", ".h", ".c", ".py"))
    assert counts
    many = {str(folder.relative_to(ROOT)): n for folder, n in counts.items() if n > MOST_FILES}
    assert not many, f"more than {MOST_FILES} files of code, cut them into rooms: {many}"


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


def modules() -> dict[str, Path]:
    """Return the modules of the package: name -> file; a folder's __init__ has the folder's name."""
    files = {".".join(["gaident", *f.relative_to(PACKAGE).with_suffix("").parts]): f for f in sources(PACKAGE, ".py")}
    files["gaident._core"] = PACKAGE / "_core.pyi"
    return {name.removesuffix(".__init__"): file for name, file in files.items()}


def lazy_names(file: Path) -> dict[str, str]:
    """Return the names that a folder gives out when they are used, as its stub says: name -> module that has it."""
    stub = file.with_suffix(".pyi")
    if file.stem != "__init__" or not stub.is_file():
        return {}
    folder = ".".join(["gaident", *file.parent.relative_to(PACKAGE).parts])
    found = [node for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ImportFrom)]
    return {
        a.asname or a.name: ".".join(p for p in (folder, n.module, None if n.module else a.name) if p)
        for n in found
        for a in n.names
    }


def imports(name: str, known: dict[str, Path]) -> set[tuple[str, int]]:
    """Return (module, line) of every import of gaident in a module, wherever it stands; names that a folder gives out lazily
    count as the module that has them."""
    found = set()

    def add(base: str, attribute: str | None, line: int) -> None:
        if attribute is not None and f"{base}.{attribute}" in known:
            found.add((f"{base}.{attribute}", line))
        elif attribute is not None and attribute in (lazy := lazy_names(known[base])):
            target = lazy[attribute]
            # A stub may name a folder's name again.
            add(target, attribute if known[target].stem == "__init__" else None, line)
        elif base != "gaident" or attribute != "__version__":
            found.add((base, line))

    for node in ast.walk(ast.parse(known[name].read_text())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] == "gaident":
                    add(alias.name, None, node.lineno)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{known[name].relative_to(ROOT)}:{node.lineno}: give the module's full name"
            if (node.module or "").split(".")[0] == "gaident":
                for alias in node.names:
                    add(str(node.module), alias.name, node.lineno)
    return found - {(name, line) for _, line in found}


def room_of(file: Path) -> str:
    """Return the room of a file: the line of ROOMS that fits it most closely."""
    path = file.relative_to(PACKAGE).with_suffix("").as_posix()
    fitting = [room for room in ROOMS if path == room or path.startswith(f"{room}/")]
    assert fitting, f"{file.relative_to(ROOT)}: give its room a place in ROOMS ({Path(__file__).name})"
    return max(fitting, key=len)


def test_python_imports_follow_the_rooms() -> None:
    known = modules()
    wrong = []
    for name, file in known.items():
        if file.suffix == ".pyi":
            continue
        room = room_of(file)
        for target, line in sorted(imports(name, known)):
            above = room_of(known[target])
            if ROOMS.index(above) > ROOMS.index(room):
                wrong.append(f"{file.relative_to(ROOT)}:{line}: {room} may not import {target}, which stands in {above}")
    assert not wrong, "\n".join(wrong)


def test_python_modules_import_in_no_circle() -> None:
    """Imports inside functions and for type checks included."""
    known = modules()
    for circle in CIRCLES:
        first, second = sorted(circle)
        assert first in {t for t, _ in imports(second, known)}, f"{circle} is no circle any more: take it out of CIRCLES"
    graph = {name: {t for t, _ in imports(name, known) if {name, t} not in CIRCLES} for name in known}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_folders_give_out_names_lazily() -> None:
    """Who imports a module runs the __init__ of its folders: these import nothing of the package."""
    known = modules()
    eager = {n: i for n, f in known.items() if f.stem == "__init__" and (i := imports(n, known)) and n != "gaident"}
    assert not eager
    assert {t for t, _ in imports("gaident", known)} == {"gaident.providers", "gaident.version"}


def test_names_that_are_provided_are_there() -> None:
    for name in providers._PLACES:
        assert callable(providers.provided(name)), name
    asked = re.compile(r'\b(?:provided|picture)\("(\w+)"')
    used = asked.findall("".join(f.read_text() for f in sources(PACKAGE, ".py") if f.stem != "providers"))
    assert set(used) == set(providers._PLACES)
    with pytest.raises(LookupError, match="no such name"):
        providers.provided("no such name")


def test_only_methods_ask_a_higher_room() -> None:
    """Methods of what a user has, and the reader of a log, whose winding is estimated: what else is above is not asked for."""
    free = set()
    for file in sources(PACKAGE, ".py"):
        tree = ast.parse(file.read_text())
        inside = {n for c in ast.walk(tree) if isinstance(c, ast.ClassDef) for n in ast.walk(c)}
        calls = (n for n in ast.walk(tree) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name))
        if file.stem != "providers" and any(n.func.id in ("provided", "picture") and n not in inside for n in calls):
            free.add(file.stem)
    assert free == {"winding_torque"}


def test_what_shows_results_is_typed() -> None:
    """Text, pictures and the page take results, models and records, whose types stand below them."""
    assert not [str(f.relative_to(ROOT)) for f in sources(PACKAGE / "show", ".py") if re.search(r"\bAny\b", f.read_text())]
    higher = {"gaident.identification", "gaident.diagnosis", "gaident.reporting", "gaident.paper", "gaident.cli"}
    known = modules()
    wrong = {
        (n, t) for n in known if n.startswith("gaident.show") for t, _ in imports(n, known) for h in higher if t.startswith(h)
    }
    assert not wrong


def test_the_controller_is_an_object() -> None:
    """Its gains are written as numbers in one file, where the core's signatures need them; no function takes both by position."""
    bound = re.compile(r"_core\.(Experiment|EffectRecord|simulate|mirrored|discrete|recurrence|held_torque)\(")
    for file in sources(PACKAGE, ".py"):
        text = file.read_text()
        assert file == PACKAGE / "control" / "core.py" or not bound.search(text), file
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                names = {a.arg for a in (*node.args.posonlyargs, *node.args.args)}
                own = file == PACKAGE / "control" / "pi.py" and node.name == "__init__"
                assert own or not {"kp", "ki"} <= names, f"{file.relative_to(ROOT)}:{node.lineno}: give {node.name} a PI"


def test_importing_gaident_is_light() -> None:
    """What is heavy is imported when it is used; that of the command line: tests/python/cli/test_cli_streams.py."""
    heavy = ("numpy", "scipy", "matplotlib", "PIL", "plotly", "pandas", "pyarrow", "h5py", "control", "rich", "argparse")
    code = "import time, sys; t = time.process_time(); import gaident; print(time.process_time() - t); "
    code += f"print([m for m in {heavy} if m in sys.modules])"

    def seconds() -> float:
        out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        spent, loaded = out.splitlines()
        assert loaded == "[]", f"import gaident also imports {loaded}"
        return float(spent)

    assert fastest(seconds, below=0.1) < 0.1  # of processor time


def test_files_stay_readable() -> None:
    files = sources(ROOT / "csrc", ".hpp", ".cpp") + sources(PACKAGE, ".py", ".pyi")
    files += sources(ROOT / "bench", ".hpp", ".cpp", ".py")
    long = {str(f.relative_to(ROOT)): n for f in files if (n := len(f.read_text().splitlines())) > 400}
    assert not long, f"over 400 lines: {long}"


@pytest.mark.long
def test_one_class_has_one_name() -> None:
    trees = [ast.parse(f.read_text()) for f in sources(PACKAGE, ".py")]
    named = Counter(node.name for tree in trees for node in tree.body if isinstance(node, ast.ClassDef))
    assert not {name for name, count in named.items() if count > 1}


def test_pages_that_are_cited_are_there() -> None:
    """A page's name with its folder, or that of a page at the top or beside the file; no page that only its author has."""
    page = re.compile(r"(?<![\w/.*-])((?:[\w.-]+/)*[\w-]+\.md)\b")
    # Written in two parts, so that this file does not find itself.
    private = re.compile(r"\b(?:METH" + r"OD|DIAGN" + r"OSIS table|ARCHI" + r"TECTURE|see AP" + r"I)\b")
    suffixes = {".py", ".pyi", ".hpp", ".cpp", ".h", ".c", ".md", ".txt", ".toml", ".mk", ".sh", ".yml", ".m"}
    wrong = []
    for file in repository_files():
        if file.suffix not in suffixes and file.name not in {"Makefile", "run"}:
            continue
        if "samples" in file.parts:
            continue  # logs, in every encoding
        written = (
            ROOT / "docs" in file.parents or file == ROOT / "mkdocs.yml"
        )  # docs/tools writes pages, and names them as these do
        docs = [ROOT / "docs", ROOT / "docs" / "theory"] if written else []
        for i, line in enumerate(file.read_text().splitlines(), 1):
            if private.search(line):
                wrong.append(f"{file.relative_to(ROOT)}:{i}: {line.strip()}")
            for name in page.findall(line):
                if not any((folder / name).is_file() for folder in (ROOT, file.parent, *docs)):
                    wrong.append(f"{file.relative_to(ROOT)}:{i}: no page {name}")
    assert not wrong, "\n".join(wrong)


def test_library_code_prints_nothing() -> None:
    printing = []
    for file in sources(PACKAGE, ".py"):
        text = file.read_text()
        if PACKAGE / "cli" in file.parents or "print" not in text:
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
    for where in COMMANDS.values():
        assert callable(_command(where)), where
