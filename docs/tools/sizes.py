"""Prints how large an installation is, without an extra and with each: `docs/tools/sizes.py gaident-0.2.0-....whl`.

Each is installed into an empty folder by pip. MB are 10^6 bytes of the files, not of the blocks that a disk gives them.
The size of an extra is that of the distributions that it brings.

`docs/tools/sizes.py ENVIRONMENT` prints the row of what is installed there, without extras; it fails where that is LIMIT or more.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterable
from importlib.metadata import Distribution, distributions
from pathlib import Path

FOR_DEVELOPERS = {"test", "peers", "compare", "naming", "tidy", "docs", "release"}
LISTED = 5  # of the largest distributions
LIMIT = 200.0  # MB, of the files without bytecode
INSTALLERS = {"pip", "setuptools", "wheel"}  # what a new environment has before anything is installed


def sizes(folder: Path) -> dict[str, tuple[float, float]]:
    """Each distribution's files and the bytecode that pip makes of them [MB]."""
    return {found.name: (total(found, False), total(found, True)) for found in distributions(path=[str(folder)])}


def packages_of(environment: Path) -> Path:
    """Its site-packages."""
    folders = [*environment.glob("lib/python*/site-packages"), *environment.glob("Lib/site-packages")]
    return folders[0] if folders else environment


def total(found: Distribution, bytecode: bool) -> float:
    """Of a distribution's bytecode, or of its other files [MB]."""
    paths = (Path(str(found.locate_file(file))) for file in found.files or ())
    return sum(path.stat().st_size for path in paths if (path.suffix == ".pyc") == bytecode and path.is_file()) / 1e6


def installed(*what: str) -> dict[str, tuple[float, float]]:
    """The distributions that pip installs for these requirements, or with these options."""
    with tempfile.TemporaryDirectory() as folder:
        call = [
            sys.executable,
            "-m",
            "pip",
            "install",
            "--quiet",
            "--only-binary=:all:",
            "--ignore-installed",
            "--prefix",
            folder,
        ]
        subprocess.run([*call, *what], check=True)  # into a prefix: what a package has beside its modules counts, too
        return sizes(packages_of(Path(folder)))


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


def check(environment: Path) -> None:
    """Fail where an environment's files are too large."""
    folder = packages_of(environment)
    found = {name: size for name, size in sizes(folder).items() if name not in INSTALLERS}
    print(row("installed", found, found))
    files = sum(size for size, _ in found.values())
    if not 0.0 < files < LIMIT:
        sys.exit(f"{folder} has {files:.0f} MB of files, not below {LIMIT:.0f} MB")


if __name__ == "__main__":
    if len(sys.argv) != 2 or not Path(sys.argv[1]).exists():
        sys.exit(__doc__)
    if Path(sys.argv[1]).is_dir():
        check(Path(sys.argv[1]))
    else:
        main(sys.argv[1])
