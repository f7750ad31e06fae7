"""Lines of prose in the sources and on the pages end where sentences end."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from places import PACKAGE, ROOT

Line = tuple[int, str]  # number in the file, text

# A sentence ends and the next begins behind it. Initials ("G. Box"), abbreviations and the number of a list item end none.
ABBREVIATIONS = ("et al", "vol", "No", "pp", "Int", "Trans", "Proc", "Conf")
NO_END = "".join(rf"(?<!\b{word})" for word in (*ABBREVIATIONS, "[A-Z]")) + r"(?<!\A\d)"
NEXT_SENTENCE = re.compile(NO_END + r"[.!?][)\]\"'`*]* +(?=[\"'`*(]*[A-Z])")
SENTENCE_END = re.compile(r"[.!?][)\]\"'`*]*$")
# A list item, a table's row, a code example.
LIST_ITEM = re.compile(r"(\d+\.|[-*|]|>>>|\.\.\.) ")
COMMENT = re.compile(r"(.*?)//+(.*)")
TITLE = re.compile(r"\A( *(?:(?:\d+\.|-) )?)\*\*[^*]+\*\* +")


def docstrings(text: str) -> Iterator[list[Line]]:
    """Return the docstrings of a Python text, each as the lines that it has in the file."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)) and ast.get_docstring(node):
            string = node.body[0]
            lines = text.splitlines()[string.lineno - 1 : string.end_lineno]
            yield [(string.lineno + i, re.sub('r?"""', "", line)) for i, line in enumerate(lines)]


def python_comments(text: str) -> Iterator[list[Line]]:
    """Return the comments of a Python text: lines that follow each other in one column are one comment."""
    block: list[Line] = []
    column = 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            if block and (block[-1][0] + 1, column) != (token.start[0], token.start[1]):
                yield block
                block = []
            block.append((token.start[0], token.string.lstrip("#:")))
            column = token.start[1]
    yield block


def core_comments(text: str) -> Iterator[list[Line]]:
    """Return the comments of a C or C++ text, those of // and those between /* and */."""
    block: list[Line] = []
    column = 0
    for number, line in enumerate(text.splitlines(), 1):
        if found := COMMENT.fullmatch(line):
            if block and (block[-1][0] + 1, column) != (number, len(found[1])):
                yield block
                block = []
            block.append((number, found[2]))
            column = len(found[1])
    yield block
    for found in re.finditer(r"/\*(.*?)\*/", text, re.DOTALL):
        yield list(enumerate(found[1].splitlines(), text.count("\n", 0, found.start()) + 1))


def pages() -> list[Path]:
    """The Markdown of the project."""
    return [
        *sorted((ROOT / "docs").rglob("*.md")),
        *(ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "bench/README.md")),
    ]


def markdown(text: str) -> list[Line]:
    """Return the prose of a page: no code (between fences, or indented behind a blank line), no headings, tables and pictures.

    A title in bold at the beginning of a paragraph or of a list item is none of its sentences.
    """
    lines: list[Line] = []
    fenced = code = False
    before = ""
    for number, line in enumerate(text.splitlines(), 1):
        mark = line.lstrip().startswith("```")
        fenced ^= mark
        code = line.startswith("    ") and (code or not before.strip())
        prose = not (fenced or mark or code or line.lstrip().startswith(("|", "#", "<", "![", "$$")))
        lines.append((number, TITLE.sub(r"\1", line) if prose else ""))
        before = line
    return lines


def paragraphs(block: list[Line]) -> Iterator[list[Line]]:
    """Cut a comment at blank lines, at list items and where the indent becomes less."""
    paragraph: list[Line] = []
    before = 0
    for number, text in block:
        indent = len(text) - len(text.lstrip())
        if not text.strip() or LIST_ITEM.match(text.strip()) or indent < before:
            yield paragraph
            paragraph = []
        if text.strip():
            paragraph.append((number, text))
        before = indent
    yield paragraph


def run_on(block: list[Line]) -> Iterator[Line]:
    """Find the lines in which a sentence begins behind another one and goes on in the next line."""
    for paragraph in paragraphs(block):
        for (number, text), _ in pairwise(paragraph):
            stripped = text.strip()
            if not SENTENCE_END.search(stripped) and NEXT_SENTENCE.search(stripped):
                yield number, stripped


def faults(file: Path) -> list[str]:
    text = file.read_text()
    if file.suffix == ".md":
        blocks = [markdown(text)]
    else:
        blocks = [*docstrings(text), *python_comments(text)] if file.suffix in {".py", ".pyi"} else list(core_comments(text))
    return [f"{file.relative_to(ROOT)}:{number}: {line}" for block in blocks for number, line in run_on(block)]


@pytest.mark.long
@pytest.mark.parametrize("folder", [PACKAGE, *(ROOT / name for name in ("csrc", "bench", "tests", "examples"))])
def test_lines_of_prose_end_where_sentences_end(folder: Path) -> None:
    files = [f for f in sorted(folder.rglob("*")) if f.suffix in {".py", ".pyi", ".hpp", ".cpp", ".h", ".c"}]
    assert files
    found = [fault for file in files for fault in faults(file)]
    assert not found, "end the line where the sentence ends:\n" + "\n".join(found)


def test_lines_of_prose_end_where_sentences_end_on_the_pages() -> None:
    assert len(pages()) > 20
    found = [fault for page in pages() for fault in faults(page)]
    assert not found, "end the line where the sentence ends:\n" + "\n".join(found)


def test_a_sentence_that_begins_behind_another_and_runs_on_is_found() -> None:
    def found(*lines: str) -> list[str]:
        return [line for _, line in run_on(list(enumerate(lines, 1)))]

    assert found("A mass. It turns", "with the motor.") == ["A mass. It turns"]
    assert found("A mass (J). It turns", "with the motor.") == ["A mass (J). It turns"]
    assert found("1. A mass. It turns", "   with the motor.") == ["1. A mass. It turns"]
    assert not found("A mass. It turns.", "With it turns the motor.")
    assert not found("A mass, which", "turns. It is one.", "Another.")
    assert not found("A mass. It is", "", "    J w' = u")
    assert not found("1. A mass that", "   turns with the motor.", "- J. Watt and", "  K. Weierstrass.")
    texts = ('"""A mass. It turns\nwith the motor."""\n', "# A mass. It turns\n# with the motor.\n")
    assert [len(list(run_on(block))) for text in texts for block in (*docstrings(text), *python_comments(text)) if block] == [
        1,
        1,
    ]
    texts = ("int a;  // A mass. It turns\n        // with the motor.\n", "/* A mass. It turns\n   with the motor. */\n")
    assert [len(list(run_on(block))) for text in texts for block in core_comments(text) if block] == [1, 1]
    page = "# A mass. It turns\n\nA mass. It turns\nwith the motor.\n\n    A mass. It turns\n    with the motor.\n\n"
    page += (
        "- **A mass.** It is\n  one. It turns\n  with the motor.\n\n```\nA mass. It turns\nwith the motor.\n```\n| A. B | c |\n"
    )
    assert [number for number, _ in run_on(markdown(page))] == [3, 10]
