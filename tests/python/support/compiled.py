"""C++ of the tests that is called from Python: compiled when it is first needed, its fields read from its source."""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import os
import re
import shlex
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path

from places import ROOT

MATH = ("-std=c++20", "-O2", "-ffp-contract=off", "-shared", "-fPIC")


@lru_cache
def fields(source: Path, of: str = "") -> dict[str, float]:
    """Name -> neutral value of the fields of the C++ source's parameters, in their order; of: "shaft " for another list."""
    block = source.read_text().split(f"// {of}fields")[1].split(f"// end of {of}fields")[0]
    found = re.findall(r"^\s*double (\w+) = ([^;]+);", block, re.MULTILINE)
    return {name: float(value) for name, value in found}


@lru_cache
def library(source: Path) -> ctypes.CDLL:
    """Compile it, once for each text of source and headers, into build/rig; else, where that is not writable, for this run."""
    command = shlex.split(os.environ.get("CXX", "")) or ["g++"]
    if shutil.which(command[0]) is None:
        command = ["c++"]
    if shutil.which(command[0]) is None:
        raise RuntimeError("the simulated drive needs a C++ compiler: install g++ or name one in CXX")
    text = b"".join(file.read_bytes() for file in [source, *_included(source)])
    key = hashlib.sha256(text + " ".join(MATH).encode()).hexdigest()[:16]
    folder = ROOT / "build" / "rig"
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK):
        folder = Path(tempfile.mkdtemp(prefix=source.stem))
    target = folder / f"{source.stem}_{key}.so"
    if not target.exists():
        # Under a name of its own first: several processes may be here at once.
        with tempfile.TemporaryDirectory(dir=folder) as own:
            made = Path(own) / target.name
            done = subprocess.run([*command, *MATH, str(source), "-o", str(made)], capture_output=True, text=True)
            if done.returncode != 0:
                raise RuntimeError(f"{source.name} does not compile: {done.stderr}")
            os.replace(made, target)
    return ctypes.CDLL(str(target))


def _included(source: Path) -> list[Path]:
    """The headers beside the source that it names."""
    return [source.with_name(name) for name in re.findall(r'^#include "([^"]+)"', source.read_text(), re.MULTILINE)]
