"""Runs what the pages promise to run as it stands, in a folder of its own.

Of a docs page the Python, but for blocks that read a file. Of the README all Python, and all commands of gaident but the
paper's reproduction, which has tests of its own. The logs beside them are those of `gaident demo`, and two of the drive found in
them, with the names and units of the README's drive.toml.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import gaident as ga
from gaident.cli import main as gaident

PAGES = ("tutorial.md",)
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
TABLE = re.compile(r"^```toml\n(.*?)^```$", re.DOTALL | re.MULTILINE)
LINE = re.compile(r"^    (\S(?:.*\\\n)*.*)$", re.MULTILINE)  # an indented line with those that continue it
WITHIN = re.compile(r"`([^`\n]+)`")
COMMAND = re.compile(r"(?:\.venv/bin/)?gaident (.*)", re.DOTALL)
RPM = 60.0 / (2.0 * np.pi)


def commands(code: list[str]) -> list[list[str]]:
    """The arguments of those pieces of code that call gaident."""
    return [shlex.split(found[1].replace("\\\n", " ")) for piece in code if (found := COMMAND.fullmatch(piece))]


def readme(text: str) -> None:
    """Runs the README's Python and commands in the current folder."""
    called(["demo", "--out", "build/demo"])
    first, *others = BLOCK.findall(text)
    names: dict[str, Any] = {}
    exec(compile(first, "README.md", "exec"), names)
    for seed in (1, 2):
        write_run(Path(f"run{seed}.csv"), names["dia"].model, names["controller"], seed)
    for block in others:
        exec(compile(block, "README.md", "exec"), names)
    for arguments in commands(WITHIN.findall(text)):
        if arguments[0] != "reproduce":
            called(arguments)
    Path("drive.toml").write_text("".join(TABLE.findall(text)), encoding="utf-8")
    for arguments in commands(LINE.findall(text)):
        called(arguments)


def write_run(path: Path, model: ga.Model, controller: ga.PI, seed: int) -> None:
    """Writes the log of a run of the model with reversals, noise of 0.1 rad/s in its loop."""
    random = np.random.default_rng(seed)
    command = np.repeat(random.permutation([20.0, -30.0, 8.0, -4.0, 12.0]), 150)
    noise = 0.1 * random.standard_normal(command.size)
    still = ga.Record(1e-3, command=command - noise, velocity=noise)
    run = ga.run(model, still, controller)
    table = np.column_stack([still.time, command * RPM, (run.velocity + noise) * RPM, run.torque])
    np.savetxt(path, table, delimiter=",", header="t,w_ref,w,M", comments="")


def called(arguments: list[str]) -> None:
    """`gaident ARGUMENTS`; ends the program where it fails."""
    if gaident(arguments) != 0:
        sys.exit(f"gaident {shlex.join(arguments)} failed")


def page(text: str, name: str) -> None:
    """Runs the Python of a page of docs/ in the current folder."""
    blocks = [block for block in BLOCK.findall(text) if "ga.read(" not in block]
    if not blocks:
        sys.exit(f"{name} holds no Python")
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, name, "exec"), names)


def main(docs: Path) -> None:
    for path in (docs.parent / "README.md", *(docs / name for name in PAGES)):
        text = path.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()) as out:
            os.chdir(folder)
            try:
                readme(text) if path.parent != docs else page(text, path.name)
            finally:
                os.chdir(docs)
        if "--show" in sys.argv:
            print(out.getvalue())


if __name__ == "__main__":
    main(Path(os.path.dirname(__file__)).parent.resolve())
