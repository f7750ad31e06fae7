"""What the README names exists; `make docs` runs its code."""

from __future__ import annotations

import re
import shlex

import pytest

from gaident.cli import COMMANDS
from gaident.cli.options import parser_of
from places import ROOT

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
CODE = [*re.findall(r"^    (\S(?:.*\\\n)*.*)$", TEXT, re.MULTILINE), *re.findall(r"`([^`\n]+)`", TEXT)]
CALLS = [
    found[1].replace("\\\n", " ") for code in CODE if (found := re.fullmatch(r"(?:\.venv/bin/)?gaident (.*)", code, re.DOTALL))
]


@pytest.mark.parametrize("call", CALLS)
def test_every_command_is_one(call: str) -> None:
    command, *options = shlex.split(call)
    arguments = parser_of({name: name for name in COMMANDS}).parse_args([command, *options])
    assert arguments.run == command


def test_the_commands_are_seen() -> None:
    assert {call.split()[0] for call in CALLS} >= {"diagnose", "identify", "columns", "init", "experiment", "effects"}


def test_every_link_leads_somewhere() -> None:
    links = re.findall(r"\]\(([^)#]+)(?:#([^)]*))?\)", TEXT)
    assert links
    for target, anchor in links:
        path = ROOT / target
        assert path.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in {heading.lower().replace(" ", "-") for heading in headings}, (target, anchor)


def test_make_knows_its_targets() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = {code.split()[1] for code in CODE if code.startswith("make ")}
    assert {"demo", "test"} <= targets
    for target in targets:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
