"""Writes docs/images/diagnosis.png, the picture of the README's first screen: `python docs/tools/readme_picture.py`.

It is the diagnosis of the demonstration (`make demo`), with a palette and fewer dots, so that it stays small in the repository.
"""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image

from gaident.cli import demonstration
from gaident.show.progress_bar import Progress

PICTURE = Path(__file__).resolve().parents[1] / "images" / "diagnosis.png"
DPI = 80
COLOURS = 48


def drawn() -> bytes:
    """The picture as PNG."""
    with Progress(None) as progress:
        _, dia = demonstration.diagnose_friction(0, progress)
    whole, small = io.BytesIO(), io.BytesIO()
    dia.plot().savefig(whole, format="png", dpi=DPI)
    picture = Image.open(whole).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    picture.save(small, "png", optimize=True)
    return small.getvalue()


if __name__ == "__main__":
    PICTURE.parent.mkdir(exist_ok=True)
    PICTURE.write_bytes(drawn())
    print(f"written: {PICTURE}")
