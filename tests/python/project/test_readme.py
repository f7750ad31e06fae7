"""What the README and the list of changes name exists; `make docs` runs the README's code."""

from __future__ import annotations

import datetime
import re
import shlex

import pytest

import gaident
from gaident.cli import COMMANDS
from gaident.cli.examination import _FOR_DEVELOPERS
from gaident.cli.options import parser_of
from places import ROOT

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
CHANGES = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
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


@pytest.mark.parametrize("text", [TEXT, CHANGES], ids=["README", "CHANGELOG"])
def test_every_link_leads_somewhere(text: str) -> None:
    links = re.findall(r"\]\((?!https:)([^)#]+)(?:#([^)]*))?\)", text)
    assert links
    for target, anchor in links:
        path = ROOT / target
        assert path.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in {heading.lower().replace(" ", "-") for heading in headings}, (target, anchor)


def test_the_version_has_its_changes_and_a_date() -> None:
    """The newest chapter of CHANGELOG.md that has a number, CITATION.cff and pyproject.toml state one version, and one date.

    The two patterns are those that .github/workflows/release.yml looks for.
    """
    version, date = re.findall(r"^## (\d\S*) \((.*)\)$", CHANGES, re.MULTILINE)[0]
    assert re.search(rf'^version = "{re.escape(version)}"$', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.*)$", citation, re.MULTILINE) == [version]
    assert re.findall(r"^date-released: (.*)$", citation, re.MULTILINE) == [datetime.date.fromisoformat(date).isoformat()]


def test_every_call_in_the_changes_is_there() -> None:
    calls = [*re.findall(r"`ga\.(\w+)", CHANGES), *re.findall(r"`gaident (\w+)", CHANGES)]
    assert len(calls) > 10
    assert not [name for name in calls if name not in gaident.__all__ and name not in COMMANDS]


def test_every_extra_says_its_size() -> None:
    """Those that only developers need are left out, as `gaident doctor` leaves them out."""
    table = (ROOT / "pyproject.toml").read_text(encoding="utf-8").split("[project.optional-dependencies]")[1].split("\n[")[0]
    extras = {*re.findall(r"^(\w+) = \[", table, re.MULTILINE)} - _FOR_DEVELOPERS
    assert {"pictures", "pandas", "formats"} <= extras
    page = (ROOT / "docs/install.md").read_text(encoding="utf-8")
    assert {*re.findall(r"^\| `(\w+)` \| [^|]+ \| \d+ \| \d+ \|", page, re.MULTILINE)} == extras


def test_make_knows_its_targets() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = {code.split()[1] for code in CODE if code.startswith("make ")}
    assert {"demo", "test"} <= targets
    for target in targets:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
