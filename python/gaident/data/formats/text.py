"""Bytes of a text log to numbered lines: encodings, byte-order marks, line ends; refuses what is no text."""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence

from gaident.arguments import arg
from gaident.errors import ReadError
from gaident.policy.table import POLICY

__all__ = ["Line", "check_text", "encoding_of", "lines_of"]

Line = tuple[int, str]
"""(line number counted from 1, text without its line end)."""

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
# What never stands in a text log; tab, line ends and form feed do.
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f\ufffe\uffff]")


def lines_of(path: str, raw: bytes, encoding: str | None = None) -> list[str]:
    """Lines of a text file, in order, without line ends. Raises ReadError for binary content."""
    text = _decode(path, raw, encoding)
    # DOS programs close a text with one Ctrl-Z.
    text = text.rstrip("\x1a")
    check_text(path, [text])
    if not text.strip():
        raise ReadError(f"{path}: the file is empty; give a log with at least 20 samples")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.split("\n")


def check_text(path: str, parts: Sequence[str], first: int = 1) -> None:
    """Raises ReadError for what never stands in a text; `first`: number of the first part's first line."""
    for above, text in enumerate(parts):
        control = _CONTROL.search(text)
        if control is not None:
            line = first + above + text.count("\n", 0, control.start())
            raise ReadError(
                f"{path}, line {line}: this is no text file (it contains the byte {ord(control[0]):#04x}), nor any other log "
                "that read knows by its content; export the log as CSV, "
                f"or give {arg('encoding')} if it is text of another encoding"
            )


def encoding_of(head: bytes, given: str | None) -> str:
    """The encoding of a text that begins so. Raises ReadError for a name that is none."""
    if given is not None:
        try:
            return codecs.lookup(given).name
        except (LookupError, ValueError):  # the latter: a NUL in the name
            raise ReadError(
                f"{arg('encoding', repr(given))} is not known to Python; give for example 'utf-8' or 'latin-1'"
            ) from None
    guessed = _guess(head)
    if guessed is None:
        try:
            head.decode("utf-8")
        except UnicodeDecodeError:
            return "latin-1" if any(byte in head for byte in b"\x81\x8d\x8f\x90\x9d") else "cp1252"
    return guessed or "utf-8"


def _decode(path: str, raw: bytes, encoding: str | None) -> str:
    guessed = encoding or _guess(raw)
    if guessed is None:
        # Windows' own code page first; it leaves five bytes undefined, Latin-1 none.
        for candidate in ("utf-8", "cp1252", "latin-1"):
            try:
                return raw.decode(candidate)
            except UnicodeDecodeError:
                continue
    try:
        return raw.decode(guessed or "latin-1")
    except (UnicodeDecodeError, UnicodeError) as error:
        raise ReadError(
            f"{path}: the text is damaged or no {guessed} ({error.__class__.__name__} at byte "
            f"{getattr(error, 'start', 0)}); export the log again, or give its {arg('encoding')}, for example "
            "'latin-1'"
        ) from None
    except (LookupError, ValueError):
        raise ReadError(
            f"{arg('encoding', repr(encoding))} is not known to Python; give for example 'utf-8' or 'latin-1'"
        ) from None


def _guess(raw: bytes) -> str | None:
    for mark, name in _MARKS:
        if raw.startswith(mark):
            return name
    # UTF-16 without a mark: digits and separators leave every second byte zero.
    head = raw[: POLICY.sampled_bytes]
    even, odd = head[0::2].count(0), head[1::2].count(0)
    if odd > POLICY.wide_letters * len(head[1::2]) and even == 0:
        return "utf-16-le"
    if even > POLICY.wide_letters * len(head[0::2]) and odd == 0:
        return "utf-16-be"
    return None
