"""A report as a browser would see it, without one."""

from __future__ import annotations

import base64
import gzip
import json
import re
from html.parser import HTMLParser
from typing import Any

__all__ = ["Reader", "charts_of"]


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
        return f"{found[1]}{gzip.decompress(base64.b64decode(found[2])).decode()}</script>"

    return re.sub(r'(<script type="application/gzip"[^>]*>)([A-Za-z0-9+/=]*)</script>', text, page)


def charts_of(page: str) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(re.search(r'id="figures">(.*?)</script>', unpacked(page), re.DOTALL)[1])  # type: ignore[index]
    return data
