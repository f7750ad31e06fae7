"""Prints how large an installation is, without what draws and with each extra: `docs/tools/sizes.py gaident-0.2.0-....whl`.

Each is installed into an empty folder by pip. MB are 10^6 bytes of the files, not of the blocks that a disk gives them.
The size of `pictures` is that of the distributions that what draws brings, that of another extra of those that it brings beside.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from importlib.metadata import Distribution, distributions
from pathlib import Path

FOR_DEVELOPERS = {"test", "peers", "compare", "naming", "tidy", "docs", "release"}
DRAWS = "pictures"  # the extra of what draws, which is required, too
LISTED = 5  # of the largest distributions


def sizes(folder: Path) -> dict[str, tuple[float, float]]:
    """Each distribution's files and the bytecode that pip makes of them [MB]."""
    return {found.name: (total(found, False), total(found, True)) for found in distributions(path=[str(folder)])}


def total(found: Distribution, bytecode: bool) -> float:
    """Of a distribution's bytecode, or of its other files [MB]."""
    paths = (Path(str(found.locate_file(file))) for file in found.files or ())
    return sum(path.stat().st_size for path in paths if (path.suffix == ".pyc") == bytecode and path.is_file()) / 1e6


def installed(*what: str) -> dict[str, tuple[float, float]]:
    """The distributions that pip installs for these requirements, or with these options."""
    with tempfile.TemporaryDirectory() as folder:
        call = [sys.executable, "-m", "pip", "install", "--quiet", "--only-binary=:all:", "--target", folder, *what]
        subprocess.run(call, check=True)
        return sizes(Path(folder))


def name_of(requirement: str) -> str:
    found = re.match(r"[\w.-]+", requirement)
    return found[0] if found else ""


def row(name: str, found: dict[str, tuple[float, float]], kept: Iterable[str]) -> str:
    shown = {key: found[key] for key in kept}
    largest = sorted(shown, key=lambda key: -sum(shown[key]))[:LISTED]
    files, bytecode = (sum(pair[i] for pair in shown.values()) for i in (0, 1))
    parts = ", ".join(f"{key} {sum(shown[key]):.0f}" for key in largest)
    return f"| {name} | {files:.0f} | {files + bytecode:.0f} | {parts} |"


def main(wheel: str) -> None:
    """Print the table."""
    package = next(iter(distributions(path=[wheel])))
    extras, asked = package.metadata.get_all("Provides-Extra") or [], package.requires or []
    draws = {name_of(r) for r in asked if f'"{DRAWS}"' in r or f"'{DRAWS}'" in r}
    required = [r for r in asked if "extra ==" not in r and "python_version" not in r]
    base = {**installed("--no-deps", wheel), **installed(*(r for r in required if name_of(r) not in draws))}
    usual = installed(wheel)
    print("| extra | files [MB] | with bytecode [MB] | the largest, with bytecode [MB] |\n|---|---|---|---|")
    print(row("none, without what draws", base, base))
    print(row(f"`{DRAWS}`", usual, sorted({*usual} - {*base})), flush=True)
    for extra in sorted({*extras} - FOR_DEVELOPERS - {DRAWS}):
        found = installed(f"{wheel}[{extra}]")
        print(row(f"`{extra}`", found, sorted({*found} - {*usual})), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
