"""C++ of the tests that is called from Python: compiled when it is first needed, its fields read from its source."""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MATH = ("-std=c++20", "-O2", "-ffp-contract=off", "-shared", "-fPIC")


@lru_cache
def fields(source: Path) -> dict[str, float]:
    """Name -> neutral value of the fields of the C++ source's parameters, in their order."""
    block = source.read_text().split("// fields")[1].split("// end of fields")[0]
    found = re.findall(r"^\s*double (\w+) = ([^;]+);", block, re.MULTILINE)
    return {name: float(value) for name, value in found}


@lru_cache
def library(source: Path) -> ctypes.CDLL:
    """Compile it, once for each text of the source, into build/rig; else, where that is not writable, for this run."""
    compiler = shutil.which(os.environ.get("CXX", "g++").split()[0]) or shutil.which("c++")
    if compiler is None:
        raise RuntimeError("the simulated drive needs a C++ compiler: install g++ or name one in CXX")
    key = hashlib.sha256(source.read_bytes() + " ".join(MATH).encode()).hexdigest()[:16]
    folder = ROOT / "build" / "rig"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix=source.stem))
    target = folder / f"{source.stem}_{key}.so"
    if not target.exists():
        # Under a name of its own first: several processes may be here at once.
        with tempfile.TemporaryDirectory(dir=folder) as own:
            made = Path(own) / target.name
            subprocess.run([compiler, *MATH, str(source), "-o", str(made)], check=True, capture_output=True)
            os.replace(made, target)
    return ctypes.CDLL(str(target))
