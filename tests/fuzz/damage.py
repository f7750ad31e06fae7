"""Damage to a file: bytes, numbers of a header, parts of text, lines, the end; drawn by a generator with a seed."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

__all__ = ["damaged", "odd_json"]

_EDGES = [0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 40, (1 << 63) - 1, (1 << 64) - 1]
_WORDS = [
    *(
        "nan",
        "inf",
        "-inf",
        "1e999",
        "-1e-999",
        "1e400",
        "0x10",
        "1_000",
        "1,000",
        "1.000",
        "1.000,5",
        "--5",
        "+-1",
        "1e",
        ".",
        ",",
        ";",
        "|",
    ),
    *(
        "\t",
        " ",
        "\r",
        "\n",
        "\r\n",
        '"',
        '""',
        "'",
        "[",
        "]",
        "(",
        "{",
        "<",
        ">",
        "#",
        "%",
        "//",
        "\\",
        "\x00",
        "\x1a",
        "\x0c",
        "\ufeff",
    ),
    *(
        "é",
        "µ",
        "°",
        "²",
        "\u2028",
        "\u2212" + "1",
        "١٢٣",
        "true",
        "null",
        "None",
        "[rpm]",
        "time",
        "velocity",
        "t",
        "EOF",
        "&",
        "<!--",
    ),
    *("1" * 400, "9" * 5000, '"' * 999, "[" * 3000, "," * 5000, "a" * 20_000, " " * 5000, "-" * 400, "{" * 2000, "[[" * 1000),
]

_VALUES = [
    *("null", "true", "0", "-1", "1", "2", "1e308", "-1e308", "1e-320", "NaN", "Infinity", "9223372036854775808", "1e999"),
    *('""', '"a"', '"nan"', '"1.0"', "[]", "[1]", "[[1, 2], [3]]", "[null]", "{}", '{"a": 1}', '"\\ud800"', '"\\u0000\\n<b>"'),
]

_Draw = np.random.Generator


def _bytes(raw: bytearray, draw: _Draw, _: Sequence[bytes]) -> None:
    for _k in range(int(draw.integers(1, 9))):
        raw[int(draw.integers(len(raw)))] = int(draw.integers(256))


def _bits(raw: bytearray, draw: _Draw, _: Sequence[bytes]) -> None:
    for _k in range(int(draw.integers(1, 5))):
        raw[int(draw.integers(len(raw)))] ^= 1 << int(draw.integers(8))


def _head(raw: bytearray, draw: _Draw, _: Sequence[bytes]) -> None:
    for _k in range(int(draw.integers(1, 4))):
        raw[int(draw.integers(min(len(raw), 256)))] = int(draw.integers(256))


def _number(raw: bytearray, draw: _Draw, _: Sequence[bytes]) -> None:
    """An integer of 1 to 8 bytes with a value at an edge, little or big."""
    size = int(draw.choice([1, 2, 4, 8]))
    at = int(draw.integers(max(1, len(raw) - size)))
    value = _EDGES[int(draw.integers(len(_EDGES)))] & ((1 << (8 * size)) - 1)
    raw[at : at + size] = value.to_bytes(size, "little" if draw.random() < 0.5 else "big")


def _part(raw: bytearray, draw: _Draw) -> tuple[int, int]:
    a = int(draw.integers(len(raw)))
    return a, min(len(raw), a + int(draw.integers(1, 200)))


def _cut_out(raw: bytearray, draw: _Draw, _: Sequence[bytes]) -> None:
    a, b = _part(raw, draw)
    del raw[a:b]


def _double(raw: bytearray, draw: _Draw, _: Sequence[bytes]) -> None:
    a, b = _part(raw, draw)
    raw[a:a] = raw[a:b] * int(draw.choice([1, 1, 2, 50]))


def _end(raw: bytearray, draw: _Draw, _: Sequence[bytes]) -> None:
    del raw[int(draw.integers(len(raw))) :]


def _from_another(raw: bytearray, draw: _Draw, others: Sequence[bytes]) -> None:
    other = others[int(draw.integers(len(others)))]
    a, b = _part(bytearray(other), draw)
    at, end = _part(raw, draw)
    raw[at : end if draw.random() < 0.5 else at] = other[a:b]


def _word(raw: bytearray, draw: _Draw, _: Sequence[bytes]) -> None:
    word = _WORDS[int(draw.integers(len(_WORDS)))].encode("utf-8" if draw.random() < 0.9 else "utf-16-le")
    a, b = _part(raw, draw)
    raw[a : min(b, a + int(draw.integers(8)))] = word


def _cell(raw: bytearray, draw: _Draw, _: Sequence[bytes]) -> None:
    """A word in the place of a whole cell."""
    marks = [k for k, byte in enumerate(raw) if byte in b",;\t|\n"]
    if len(marks) > 1:
        k = int(draw.integers(len(marks) - 1))
        raw[marks[k] + 1 : marks[k + 1]] = _WORDS[int(draw.integers(len(_WORDS)))].encode()


def _lines(raw: bytearray, draw: _Draw, _: Sequence[bytes]) -> None:
    lines = bytes(raw).split(b"\n")
    k, other = int(draw.integers(len(lines))), int(draw.integers(len(lines)))
    action = int(draw.integers(4))
    if action == 0:
        del lines[k]
    elif action == 1:
        lines[k:k] = [lines[other]] * int(draw.choice([1, 1, 3, 100]))
    elif action == 2:
        lines[k], lines[other] = lines[other], lines[k]
    else:
        lines[k] = lines[k][: int(draw.integers(len(lines[k]) + 1))]
    raw[:] = b"\n".join(lines)


def odd_json(content: bytes, draw: _Draw) -> bytes:
    """A JSON text with another value at one to three places, or without what stands there."""
    data = json.loads(content)
    for _ in range(int(draw.integers(1, 4))):
        places: list[tuple[Any, Any]] = []
        _walk(data, places)
        if not places:
            break
        container, key = places[int(draw.integers(len(places)))]
        if draw.random() < 0.2:
            del container[key]
        else:
            container[key] = json.loads(_VALUES[int(draw.integers(len(_VALUES)))])
    return json.dumps(data).encode()


def _walk(node: Any, places: list[tuple[Any, Any]]) -> None:
    """All places of values in JSON data, as (container, key)."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        places.append((node, key))
        _walk(value, places)


_ANY: list[Callable[[bytearray, _Draw, Sequence[bytes]], None]] = [
    *(_bytes, _bits, _head, _number, _number, _cut_out, _double, _end, _from_another),
]
_TEXT = [*_ANY, _word, _word, _cell, _cell, _lines, _lines]


def damaged(content: bytes, draw: _Draw, others: Sequence[bytes], text: bool) -> bytes:
    """The content with one to four damages.

    others  whole files of the same format
    text    whether it is a text, whose words and lines are damaged too
    """
    raw = bytearray(content)
    ways = _TEXT if text else _ANY
    for _ in range(int(draw.choice([1, 1, 2, 4]))):
        if raw:
            ways[int(draw.integers(len(ways)))](raw, draw, others)
    return bytes(raw)
