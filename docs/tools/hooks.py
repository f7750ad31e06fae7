"""What mkdocs does with a page beyond Markdown (named in mkdocs.yml).

$$ ... $$ and $ ... $ are LaTeX, turned into MathML, which browsers draw by themselves, offline too. A line
`<!-- effect: NAME -->` becomes the effect's picture and its parameters from the registry. Links to files outside docs/ become
their names, and pages that the navigation does not list stand at its end. The page of docs/try is copied to the site.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert

import gaident as ga

Page = Any
Config = Any

EFFECT = re.compile(r"^<!-- effect: (\w+) -->$", re.MULTILINE)
OUTSIDE = re.compile(r"\[([^\]]*)\]\((?:\.\./)+(?!.*\.svg)([^)#]*)\)")
CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)
FURTHER = "Further"
NOT_BUILT = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>Not built</title>
<p>The page that identifies in a browser is not part of this copy of the documentation:
it is built with Debian's emscripten (<code>apt install emscripten</code>, then <code>make wasm</code>).</p></html>
"""


def on_config(config: Config) -> Config:
    """Pages of docs/ that the navigation does not list stand at its end: a new page needs no entry."""
    folder = Path(config["docs_dir"])
    listed = set(re.findall(r"[\w/-]+\.md", str(config["nav"])))
    new = sorted(p.name for p in folder.glob("*.md") if p.name not in listed)
    if new:
        config["nav"].append({FURTHER: new})
    return config


def on_page_markdown(markdown: str, page: Page, config: Config, files: Any) -> str:
    """The page's text before it is rendered."""
    docs = Path(config["docs_dir"])
    here = (docs / page.file.src_path).parent

    def outside(link: re.Match[str]) -> str:
        target = (here / link[0].rsplit("(", 1)[1].rstrip(")").split("#")[0]).resolve()
        if docs.resolve() in target.parents:
            return link[0]
        if not target.exists():
            raise ValueError(f"docs/{page.file.src_path}: {link[0]} names no file of the repository")
        return f"`{link[2]}`"

    markdown = OUTSIDE.sub(outside, markdown)
    markdown = "".join(part if part.startswith("`") else _formulas(part) for part in CODE.split(markdown))
    if page.file.src_path == "catalogue.md":
        missing = {row.name for row in ga.effects.table()} ^ set(EFFECT.findall(markdown))
        if missing:
            raise ValueError(f"docs/catalogue.md: {', '.join(sorted(missing))} is in the registry or on the page only")
    return EFFECT.sub(lambda m: _effect(m[1]), markdown)


def on_post_build(config: Config) -> None:
    """The page of docs/try in the site; where it was not built, a page that says how."""
    built, shown = (
        Path(config["docs_dir"]).parent / "build" / "try" / "index.html",
        Path(config["site_dir"]) / "try" / "index.html",
    )
    shown.parent.mkdir(parents=True, exist_ok=True)
    shown.write_text(built.read_text(encoding="utf-8") if built.exists() else NOT_BUILT, encoding="utf-8")


def _formulas(text: str) -> str:
    text = re.sub(r"\$\$(.+?)\$\$", lambda m: f"<div>{convert(m[1], display='block')}</div>", text, flags=re.DOTALL)
    return re.sub(r"\$([^$\n]+)\$", lambda m: convert(m[1]), text)


def _effect(name: str) -> str:
    row = next(row for row in ga.effects.table() if row.name == name)
    lines = [
        f"![{row.name}: {row.meaning}](pictures/{name}.svg)",
        "",
        f"*Place: {row.place}. {row.meaning[0].upper()}{row.meaning[1:]}.*",
    ]
    lines += ["", "| parameter | unit | bounds | nothing happens at |", "|---|---|---|---|"]
    for p in row.parameters:
        neutral = "" if p.neutral != p.neutral else f"{p.neutral:g}"
        lines.append(f"| `{p.name}` | {p.unit} | {p.bounds or 'any'} | {neutral} |")
    return "\n".join(lines)
