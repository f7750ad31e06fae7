"""What is shipped: the version, the stub of the extension, the source distribution and the wheel from it."""

from __future__ import annotations

import ast
import importlib.metadata
import importlib.util
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import gaident
from gaident import _core
from places import ROOT


def pyproject_version() -> str:
    """Return the version that pyproject.toml states."""
    found = re.search(r'^version = "([^"]+)"', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    assert found is not None
    return found[1]


def call_backend(hook: str, source: Path, out: Path, settings: dict[str, str]) -> Path:
    """Call a PEP 517 hook of the build backend in a fresh interpreter; return the file it made."""
    code = f"import scikit_build_core.build as b, sys; b.{hook}(sys.argv[1], {settings!r})"
    done = subprocess.run([sys.executable, "-c", code, str(out)], cwd=source, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    (made,) = out.iterdir()
    return made


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the source distribution and unpack it; return the unpacked folder."""
    for needed in ("scikit_build_core", "pybind11", "cmake", "ninja"):
        if importlib.util.find_spec(needed) is None:
            pytest.skip(f"{needed} is not installed: pip install '.[test]'")
    archive = call_backend("build_sdist", ROOT, tmp_path_factory.mktemp("sdist"), {})
    unpacked = tmp_path_factory.mktemp("unpacked")
    with tarfile.open(archive) as tar:
        for member in tar.getmembers():
            tar.extract(member, unpacked, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
    (top,) = unpacked.iterdir()
    return top


@pytest.fixture(scope="module")
def wheel(sdist: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel, with the objects that `make` has already compiled or else from the unpacked sdist."""
    compiled = ROOT / "build" / "checked"
    if (compiled / "CMakeCache.txt").is_file():
        settings = {"build-dir": str(compiled), "build.targets": "_core"}
        return call_backend("build_wheel", ROOT, tmp_path_factory.mktemp("wheel"), settings)
    # Only the contents are looked at: unoptimised is quicker.
    quick = {"cmake.build-type": "Debug", "cmake.define.CMAKE_CXX_FLAGS_DEBUG": "-O0 -g0"}
    return call_backend("build_wheel", sdist, tmp_path_factory.mktemp("wheel"), quick)


def test_version_is_stated_once() -> None:
    version = pyproject_version()
    assert importlib.metadata.version("gaident") == version
    assert gaident.__version__ == version
    assert getattr(_core, "__version__", version) == version


@pytest.mark.long
def test_sdist_holds_the_sources(sdist: Path) -> None:
    def files(root: Path) -> set[str]:
        parts = ("csrc", "python", "tests", "bench")
        found = (f for part in parts for f in (root / part).rglob("*"))
        kinds = {".hpp", ".cpp", ".py", ".pyi", ".typed", ".txt", ".css", ".js", ".c", ".h"}
        return {str(f.relative_to(root)) for f in found if f.suffix in kinds or f.name == "py.typed"}

    assert files(sdist) == files(ROOT)
    for name in ("pyproject.toml", "CMakeLists.txt", "README.md", "LICENSE", "Makefile"):
        assert (sdist / name).is_file(), name
    top = {entry.name for entry in sdist.iterdir()}
    assert not top & {".git", ".venv", "build", ".mypy_cache", ".ruff_cache", ".pytest_cache", ".hypothesis"}


@pytest.mark.alone  # it builds in build/checked, as the same fixture of another worker would
def test_wheel_holds_the_package_and_nothing_else(wheel: Path) -> None:
    python = ROOT / "python"
    sources = [f for f in (python / "gaident").rglob("*") if f.suffix in (".py", ".pyi", ".css", ".js", ".c", ".h")]
    expected = {f.relative_to(python).as_posix() for f in sources}
    expected |= {f"gaident/{n}" for n in ("py.typed", "results/results.schema.json", "policy/calibrated.json")}
    info = f"gaident-{pyproject_version()}.dist-info"
    expected |= {f"{info}/{n}" for n in ("METADATA", "WHEEL", "RECORD", "entry_points.txt", "licenses/LICENSE")}

    names = {n for n in zipfile.ZipFile(wheel).namelist() if not n.endswith("/")}
    extensions = {n for n in names if re.fullmatch(r"gaident/_core\.[\w.-]+\.(so|pyd)", n)}
    assert len(extensions) == 1
    assert names - extensions == expected


@pytest.mark.alone  # it builds in build/checked, as the same fixture of another worker would
def test_wheel_states_licence_and_command(wheel: Path) -> None:
    info = f"gaident-{pyproject_version()}.dist-info"
    with zipfile.ZipFile(wheel) as archive:
        metadata = archive.read(f"{info}/METADATA").decode()
        commands = archive.read(f"{info}/entry_points.txt").decode()
    assert re.search(r"^License-Expression: BSD-3-Clause$", metadata, re.MULTILINE)
    assert re.search(r"^Requires-Python: >=3\.10$", metadata, re.MULTILINE)
    assert re.search(r"^gaident\s*=\s*gaident\.cli:main$", commands, re.MULTILINE)


# The stub: what _core.pyi declares is what the extension exports, name by name and argument by argument.
# pybind11 states its signatures in the first lines of the docstrings.

Signature = list[str]


def signature(function: ast.FunctionDef) -> Signature:
    """Return the arguments in order, each as `name`, `name=literal` or `name=...`, with `/` and `*`."""

    def shown(argument: ast.arg, default: ast.expr | None) -> str:
        if default is None:
            return argument.arg
        try:
            value = ast.literal_eval(default)
        except ValueError:
            value = ...
        return f"{argument.arg}={'...' if value is ... else repr(value)}"

    a = function.args
    positional = [*a.posonlyargs, *a.args]
    defaults = [None] * (len(positional) - len(a.defaults)) + list(a.defaults)
    listed = [shown(argument, default) for argument, default in zip(positional, defaults, strict=True)]
    if a.posonlyargs:
        listed.insert(len(a.posonlyargs), "/")
    if a.vararg or a.kwonlyargs:
        listed.append(f"*{a.vararg.arg}" if a.vararg else "*")
    listed += [shown(argument, default) for argument, default in zip(a.kwonlyargs, a.kw_defaults, strict=True)]
    return [*listed, f"**{a.kwarg.arg}"] if a.kwarg else listed


def exported_signatures(function: object, name: str) -> list[Signature]:
    """Read the signatures (several, where overloaded) from a pybind11 docstring."""
    text = getattr(function, "__doc__", None) or ""
    found = re.findall(rf"^(?:\d+\. )?({name}\(.*\)(?: -> .*)?)$", text, re.MULTILINE)
    found = [line for line in found if "*args, **kwargs)" not in line or len(found) == 1]
    plain = [re.sub(r"<[^<>]*>", "...", line) for line in found]  # a default that has no literal
    trees = [ast.parse(f"def {line}: ...").body[0] for line in plain]
    return [signature(tree) for tree in trees if isinstance(tree, ast.FunctionDef)]


def declared(body: list[ast.stmt]) -> dict[str, list[Signature] | None]:
    """Return what a stub declares: name -> signatures of a function, or None for anything else."""
    names: dict[str, list[Signature] | None] = {}
    for node in body:
        if isinstance(node, ast.FunctionDef):
            if any(isinstance(d, ast.Name) and d.id == "property" for d in node.decorator_list):
                names[node.name] = None
            elif not any(isinstance(d, ast.Attribute) and d.attr == "setter" for d in node.decorator_list):
                names[node.name] = [*(names.get(node.name) or []), signature(node)]
        elif isinstance(node, ast.ClassDef):
            names[node.name] = None
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names[node.target.id] = None
    return names


def exported(scope: object) -> dict[str, list[Signature] | None]:
    """Return what a module or class of the extension exports, in the form of `declared`."""
    shown = {"__init__", "__version__", "__len__", "__getitem__", "__call__", "__enter__", "__exit__"}
    names: dict[str, list[Signature] | None] = {}
    for name, thing in vars(scope).items():
        if name in shown or not name.startswith("_"):
            is_function = callable(thing) and not isinstance(thing, type)
            names[name] = exported_signatures(thing, name) if is_function else None
    if names.get("__init__") == []:
        del names["__init__"]  # a class that Python cannot construct
    return names


def test_stub_equals_module() -> None:
    tree = ast.parse((ROOT / "python" / "gaident" / "_core.pyi").read_text())
    private = [n.name for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef) and n.name[0] == "_"]
    assert not private, f"the stub declares private names: {private}"
    assert declared(tree.body) == exported(_core)
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            assert declared(node.body) == exported(getattr(_core, node.name)), node.name
