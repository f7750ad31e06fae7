"""Writes docs/theory/policy.md, the numbers by which a diagnosis decides: `python docs/tools/policy.py`."""

from __future__ import annotations

from pathlib import Path

from gaident.diagnosis.policy import Row, rows

PAGE = Path(__file__).resolve().parents[1] / "theory" / "policy.md"

HEAD = """\
# The policy: every number that decides

This page is written by `python docs/tools/policy.py` from `gaident.diagnosis.policy.rows()`, and a test compares the two.
A number that decides about a model stands in the policy and nowhere else; what each one is for, the pages
[estimation](estimation.md), [search](search.md) and [diagnosis](../diagnosis.md) say.

"""

DECIDING = """\
## What decides

| number | value | unit | where it comes from | measured by |
|---|---|---|---|---|
"""

EFFORT = """
## Effort

More of these may find more, and changes no decision about what was found.

| number | value | unit | what it is |
|---|---|---|---|
"""


def page() -> str:
    """The page's text."""
    deciding = [r for r in rows() if r.command]
    effort = [r for r in rows() if not r.command]
    return HEAD + DECIDING + "".join(_line(r, f"`{r.command}`") for r in deciding) + EFFORT + "".join(map(_line, effort))


def _line(row: Row, *more: str) -> str:
    cells = (f"`{row.name}`", f"{row.value:g}", row.unit, row.source, *more)
    return "| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
