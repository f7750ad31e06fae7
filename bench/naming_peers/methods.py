"""The methods by name: how each is called, what it needs, which lines a user writes for it."""

from __future__ import annotations

import importlib.util
import inspect
import io
import tokenize
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType

import boosted
import gaussian
import in_the_loop
import library
import localised
import names
import ours
import prediction
import recurrent
import sparse
from case import Answer, Case


@dataclass(frozen=True)
class Method:
    """answers: case -> threshold -> answer, from the laxest threshold on or from the strictest; needs: module -> pip package.

    written: the modules that a user would have to write, a function whose body that is, or a file that is not imported here.
    refits: whether its free run is that of its names, fitted in the loop by the library; named: whether it names at all.
    python: of an environment of its own that it needs beside them.
    """

    answers: Callable[[Case], dict[float, Answer]]
    written: tuple[object, ...]
    needs: dict[str, str]
    refits: bool = False
    named: bool = True
    python: Path | None = None

    @property
    def missing(self) -> list[str]:
        """Packages to install for it, and the environment to make."""
        packages = [package for module, package in self.needs.items() if importlib.util.find_spec(module) is None]
        if self.python is None or self.python.exists():
            return packages
        return [*packages, f"an environment {self.python.parents[1].name} (bench/README.md, Naming)"]

    @property
    def lines(self) -> int:
        return sum(map(code_lines, self.written))


def methods(training: Path) -> dict[str, Method]:
    """All of them; training: the file with the records that the classifier learns from."""
    regression = (library, names)
    pysindy, sklearn = {"pysindy": "pysindy"}, {"sklearn": "scikit-learn"}

    def sindy(kind: str, make: object, bagged: bool = False) -> Method:
        return Method(partial(sparse.sparse, kind=kind, make=make, bagged=bagged), (*regression, sparse), pysindy, True)

    def split(kind: str) -> Method:
        return Method(partial(localised.localised, kind=kind), (*regression, localised), {}, True)

    alone = (prediction.in_the_loop, prediction.followed)
    tree = partial(boosted.boosted, path=training)
    return {
        "gaident.diagnose": Method(ours.gaident, (ours.asked,), {}),
        "STLSQ, filter": sindy("filter", sparse.stlsq),
        "STLSQ, differences": sindy("differences", sparse.stlsq),
        "STLSQ ensemble, filter": sindy("filter", sparse.stlsq, True),
        "STLSQ ensemble, differences": sindy("differences", sparse.stlsq, True),
        "SR3, filter": sindy("filter", sparse.sr3),
        "SR3, differences": sindy("differences", sparse.sr3),
        "SR3 ensemble, filter": sindy("filter", sparse.sr3, True),
        "SR3 ensemble, differences": sindy("differences", sparse.sr3, True),
        "F test, filter": split("filter"),
        "F test, differences": split("differences"),
        "hold-out ladder": Method(in_the_loop.ladder, (in_the_loop,), {}),
        "greedy BIC": Method(in_the_loop.bic, (in_the_loop,), {}),
        "boosted trees": Method(tree, (*regression, boosted), sklearn, True),
        "ARX": Method(prediction.arx, (*alone, prediction.arx), {}, named=False),
        "output error": Method(prediction.output_error, (prediction.output_error, prediction.real_fits), {}, named=False),
        "NARX": Method(prediction.narx, (*alone, prediction.narx), {"sysidentpy": "sysidentpy"}, named=False),
        "Gaussian process": Method(gaussian.gaussian, (*alone, prediction.closest, gaussian), sklearn, named=False),
        "recurrent network": Method(
            recurrent.recurrent, (*alone, prediction.closest, recurrent, recurrent.FIT), {}, named=False, python=recurrent.PYTHON
        ),
    }


def code_lines(written: object) -> int:
    """Lines of code without comments, blank lines and docstrings; of a function, those of its body."""
    source = written.read_text() if isinstance(written, Path) else inspect.getsource(written)  # type: ignore[arg-type]
    used: set[int] = set()
    quiet = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    before = tokenize.NEWLINE
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        alone = token.type == tokenize.STRING and before in (tokenize.NEWLINE, tokenize.INDENT, tokenize.NL)
        if token.type not in quiet and not alone:
            used.update(range(token.start[0], token.end[0] + 1))
        if token.type != tokenize.COMMENT:
            before = token.type
    return len(used) - (0 if isinstance(written, (ModuleType, Path)) else 1)
