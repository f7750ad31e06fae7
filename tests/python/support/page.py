"""A report as a browser would see it, without one."""

from __future__ import annotations

import json
import lzma
import re
from html.parser import HTMLParser
from typing import Any

from gaident.show.report.packing import FILTER

__all__ = ["Reader", "charts_of", "text_of", "unpacked"]


class Reader(HTMLParser):
    """Elements and texts of a page, as a browser would see them."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.inside = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.inside = tag

    def handle_endtag(self, tag: str) -> None:
        self.inside = ""

    def handle_data(self, data: str) -> None:
        if self.inside not in ("script", "style"):
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).split())

    def found(self, name: str) -> list[dict[str, str | None]]:
        return [attributes for tag, attributes in self.tags if tag == name]


def unpacked(page: str) -> str:
    """The page with what its script unpacks, figures and the library that draws them, as text."""

    def text(found: re.Match[str]) -> str:
        return f"{found[1].replace('x-packed', 'x-unpacked')}{text_of(found[2])}</script>"

    return re.sub(r'(<script type="application/x-packed"[^>]*>)([^<]*)</script>', text, page)


def text_of(letters: str) -> str:
    """What packing.py packed, by Python's own LZMA."""
    values = [ord(c) - 35 - (c > "<") for c in letters]
    bits = "".join(f"{a + 91 * b:013b}" for a, b in zip(values[::2], values[1::2], strict=True))
    whole = len(bits) // 8  # bytes; what is left over was filled up
    data = int(bits[: 8 * whole], 2).to_bytes(whole, "big")
    decoder = lzma.LZMADecompressor(format=lzma.FORMAT_RAW, filters=[FILTER])
    text = decoder.decompress(data[:-1])  # the last byte may be of what was filled up
    return (text if decoder.eof else text + decoder.decompress(data[-1:])).decode()


def charts_of(page: str) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(re.search(r'id="figures">(.*?)</script>', unpacked(page), re.DOTALL)[1])  # type: ignore[index]
    return data
