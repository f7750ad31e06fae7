"""Prints how large an installation is, without extras and with each: `python docs/tools/sizes.py gaident-0.2.0-....whl`.

Each is installed into an empty folder by pip. MB are 10^6 bytes of the files, not of the blocks that a disk gives them.
An extra's size is that of the distributions that an installation without extras has not.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterable
from importlib.metadata import Distribution, distributions
from pathlib import Path

FOR_DEVELOPERS = {"test", "peers", "compare", "tidy", "docs", "release"}
LISTED = 5  # of the largest distributions


def sizes(folder: Path) -> dict[str, tuple[float, float]]:
    """Each distribution's files and the bytecode that pip makes of them [MB]."""
    return {found.name: (total(found, False), total(found, True)) for found in distributions(path=[str(folder)])}


def total(found: Distribution, bytecode: bool) -> float:
    """Of a distribution's bytecode, or of its other files [MB]."""
    paths = (Path(str(found.locate_file(file))) for file in found.files or ())
    return sum(path.stat().st_size for path in paths if (path.suffix == ".pyc") == bytecode and path.is_file()) / 1e6


def installed(what: str) -> dict[str, tuple[float, float]]:
    """The distributions that pip installs for a requirement."""
    with tempfile.TemporaryDirectory() as folder:
        call = [sys.executable, "-m", "pip", "install", "--quiet", "--only-binary=:all:", "--target", folder, what]
        subprocess.run(call, check=True)
        return sizes(Path(folder))


def row(name: str, found: dict[str, tuple[float, float]], kept: Iterable[str]) -> str:
    shown = {key: found[key] for key in kept}
    largest = sorted(shown, key=lambda key: -sum(shown[key]))[:LISTED]
    files, bytecode = (sum(pair[i] for pair in shown.values()) for i in (0, 1))
    parts = ", ".join(f"{key} {sum(shown[key]):.0f}" for key in largest)
    return f"| {name} | {files:.0f} | {files + bytecode:.0f} | {parts} |"


def main(wheel: str) -> None:
    """Print the table."""
    extras = next(iter(distributions(path=[wheel]))).metadata.get_all("Provides-Extra") or []
    base = installed(wheel)
    print("| extra | files [MB] | with bytecode [MB] | the largest, with bytecode [MB] |\n|---|---|---|---|")
    print(row("none", base, base))
    for extra in sorted({*extras} - FOR_DEVELOPERS):
        found = installed(f"{wheel}[{extra}]")
        print(row(f"`{extra}`", found, sorted({*found} - {*base})), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
