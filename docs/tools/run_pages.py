"""Runs the Python of the pages that promise to run as they stand, in a folder of its own.

Blocks that read a file are left out.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import sys
import tempfile
from pathlib import Path

PAGES = ("tutorial.md",)
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def main(docs: Path) -> None:
    for page in PAGES:
        text = (docs / page).read_text(encoding="utf-8")
        blocks = [block for block in BLOCK.findall(text) if "ga.read(" not in block]
        if not blocks:
            sys.exit(f"{page} holds no Python")
        names: dict[str, object] = {}
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()) as out:
            os.chdir(folder)
            for block in blocks:
                exec(compile(block, page, "exec"), names)
            os.chdir(docs)
        if "--show" in sys.argv:
            print(out.getvalue())


if __name__ == "__main__":
    main(Path(os.path.dirname(__file__)).parent.resolve())
