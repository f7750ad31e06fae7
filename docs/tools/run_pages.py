"""Runs what the pages promise to run as it stands, in a folder of its own.

Of a docs page the Python, but for blocks that read a file. Of a page of worked examples all of it, in its order, and what it
shows is compared with what comes out. Of the README all Python, and all commands of gaident but the paper's reproduction, which
has tests of its own. The logs beside them are those of `gaident demo`, and two of the drive found in them, with the names and
units of the README's drive.toml.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import gaident as ga
from gaident.cli import main as gaident

PAGES = ("tutorial.md",)
WORKED = (
    *("how-to/servo-trace.md", "how-to/new-gains.md", "how-to/feedforward.md", "how-to/frequency-responses.md"),
    "how-to/friction-map.md",
)
FENCED = re.compile(r'^```(python|toml title="([^"]+)"|console|text)\n(.*?)^```$', re.DOTALL | re.MULTILINE)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
LEFT_OUT = "..."  # a line that stands for any number of lines
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
        sys.exit(f"{name} contains no Python")
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, name, "exec"), names)


def worked(text: str, name: str) -> None:
    """Runs a page in the current folder as a reader would, in its order; ends where it shows another output."""
    names: dict[str, object] = {}
    printed = ""
    for kind, file, body in FENCED.findall(text):
        if file:
            Path(file).write_text(body, encoding="utf-8")
        elif kind == "python":
            printed = output_of(lambda code=body: exec(compile(code, name, "exec"), names))
        elif kind == "text":
            compared(body.splitlines(), printed, name)
        else:
            for call, shown in dialogue(body):
                compared(shown, output_of(lambda call=call: called(shlex.split(call)[1:])), f"{name}: {call}")


def dialogue(body: str) -> list[tuple[str, list[str]]]:
    """(command, the lines shown below it) of a block of `$ command` lines and what they print."""
    found: list[tuple[str, list[str]]] = []
    for line in body.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        else:
            found[-1][1].append(line)
    return found


def output_of(work: Callable[[], object]) -> str:
    with contextlib.redirect_stdout(io.StringIO()) as out:
        work()
    return out.getvalue()


def compared(shown: list[str], printed: str, where: str) -> None:
    """Ends the program where a line that is shown does not come out, in this order, and next to its neighbours but for `...`.

    Numbers agree within 5 %, blanks do not count: the last digits move with every change of a search.
    """
    lines, at, free = printed.splitlines(), 0, True
    for line in shown:
        if line.strip() == LEFT_OUT:
            free = True
            continue
        reach = lines[at:] if free else lines[at : at + 1]
        same = next((k for k, other in enumerate(reach) if alike(line, other)), None)
        if same is None:
            rest = "\n".join(lines[at : at + 40])
            sys.exit(f"{where}: this line is shown and does not come out here:\n{line}\nbut\n{rest}")
        at, free = at + same + 1, False


def alike(one: str, other: str) -> bool:
    """Whether two lines have the same words, and numbers within 5 %."""
    if NUMBER.sub("0", one).split() != NUMBER.sub("0", other).split():
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(abs(float(a) - float(b)) <= 0.05 * abs(float(b)) for a, b in pairs)


def main(docs: Path) -> None:
    for path in (docs.parent / "README.md", *(docs / name for name in (*PAGES, *WORKED))):
        text = path.read_text(encoding="utf-8")
        run = worked if path.name in {Path(name).name for name in WORKED} else page
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()) as out:
            os.chdir(folder)
            try:
                readme(text) if path.name == "README.md" else run(text, path.name)
            finally:
                os.chdir(docs)
        if "--show" in sys.argv:
            print(out.getvalue())


if __name__ == "__main__":
    main(Path(os.path.dirname(__file__)).parent.resolve())
