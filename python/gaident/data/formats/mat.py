"""MAT files of version 5 and 4, read byte by byte.

Written here because scipy.io.loadmat ends the whole process (segmentation fault) on some damaged files, and
a damaged log must end in a message.
Source: MathWorks, "MAT-File Format", version 5 and, in its appendix, version 4.
"""

from __future__ import annotations

import math
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.stored import MOST_TIMES, MOST_UNPACKED

__all__ = ["DamagedError", "Variable", "variables"]

Variable = tuple[str, "NDArray[Any] | str"]
"""(name, array of numbers), or (name, what it is instead)."""

_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT, _TEXT, _SPARSE, _FIRST_NUMERIC, _LAST_NUMERIC, _OPAQUE = 1, 2, 3, 4, 5, 6, 15, 17
_WORDS = {_CELL: "cell", _STRUCT: "struct array", _OBJECT: "object", _TEXT: "text", _SPARSE: "sparse"}
_COMPLEX = 0x0800
_DEEPEST = 8
_STORED_4 = ("f8", "f4", "i4", "i2", "u2", "u1")


class DamagedError(Exception):
    """The bytes are not what the format says, and why."""


def variables(raw: bytes) -> list[Variable]:
    """The variables of a MAT file in its order; the fields of a 1 x 1 struct are named `log.speed`.

    Arrays have the file's own number type and shape, column by column in memory. Raises DamagedError.
    """
    if len(raw) >= 4 and 0 in raw[:4]:
        return _version_4(raw)
    if len(raw) < 128 or raw[126:128] not in (b"IM", b"MI"):
        raise DamagedError("the header of a MAT file is missing")
    order = "<" if raw[126:128] == b"IM" else ">"
    found: list[Variable] = []
    room = max(MOST_UNPACKED, MOST_TIMES * len(raw))
    whole = _Elements(memoryview(raw), 128, order)
    while whole.more():
        kind, data = whole.next()
        if kind == _COMPRESSED:
            plain = _inflate(data, room)
            room -= len(plain)
            kind, data = _Elements(memoryview(plain), 0, order).next()
        if kind != _MATRIX:
            raise DamagedError(f"an element of type {kind} where a variable should be")
        found += _matrix(data, order, "", _DEEPEST)
    return found


class _Elements:
    """The elements that stand one after another in `data`, each a tag (type, size) and its bytes."""

    def __init__(self, data: memoryview, at: int, order: str) -> None:
        self.data, self.at, self.order = data, at, order

    def more(self) -> bool:
        return self.at < len(self.data)

    def next(self) -> tuple[int, memoryview]:
        """(type, bytes) of the next element."""
        if self.at + 8 > len(self.data):
            raise DamagedError("it ends within a tag")
        kind, size = struct.unpack_from(self.order + "II", self.data, self.at)
        if kind >> 16:
            # Small format: size and type share one word, up to four bytes of data follow in the other.
            kind, size = kind & 0xFFFF, kind >> 16
            start, end = self.at + 4, self.at + 8
            if size > 4:
                raise DamagedError("a short element is longer than four bytes")
        else:
            start = self.at + 8
            end = start + size + (-size % 8 if kind != _COMPRESSED else 0)
        if start + size > len(self.data):
            raise DamagedError(f"it ends {start + size - len(self.data)} bytes too early")
        self.at = end
        return kind, self.data[start : start + size]

    def numbers(self) -> NDArray[Any]:
        """The next element as an array of the numbers it stores."""
        kind, data = self.next()
        if kind not in _STORED:
            raise DamagedError(f"an element of type {kind} where numbers should be")
        dtype = np.dtype(self.order + _STORED[kind])
        if len(data) % dtype.itemsize:
            raise DamagedError("a number is cut")
        return np.frombuffer(data, dtype)

    def text(self) -> str:
        """The next element as ASCII text."""
        return bytes(self.next()[1]).decode("latin-1")


def _inflate(data: memoryview, room: int) -> bytes:
    inflater = zlib.decompressobj()
    try:
        plain = inflater.decompress(data, max(room, 1))
    except zlib.error as error:
        raise DamagedError(str(error)) from None
    if inflater.unconsumed_tail:
        raise DamagedError(f"it unpacks to more than {MOST_TIMES} times the file and {MOST_UNPACKED >> 20} MiB")
    if not inflater.eof:
        raise DamagedError("a compressed variable is cut")
    return plain


def _matrix(data: memoryview, order: str, prefix: str, depth: int) -> list[Variable]:
    """The variable, or the fields of the struct, in the body of one matrix element."""
    parts = _Elements(data, 0, order)
    if not parts.more():
        return [(prefix, "empty")]
    flags = parts.numbers()
    if flags.size < 1:
        raise DamagedError("a variable without its flags")
    kind = int(flags[0]) & 0xFF
    if kind == _OPAQUE:
        return [(prefix or parts.text(), "object")]
    shape = tuple(int(size) for size in parts.numbers())
    if len(shape) < 2 or min(shape) < 0:
        raise DamagedError(f"a variable of the shape {shape}")
    name = prefix or parts.text()
    if prefix:
        parts.text()
    if kind == _STRUCT and shape == (1, 1) and depth:
        return _fields(parts, order, name, depth)
    if not _FIRST_NUMERIC <= kind <= _LAST_NUMERIC:
        return [(name, _WORDS.get(kind, "object"))]
    values = parts.numbers()
    if int(flags[0]) & _COMPLEX:
        imaginary = parts.numbers()
        if imaginary.size != values.size:
            raise DamagedError(f"{name!r} has real and imaginary parts of unequal size")
        values = values + 1j * imaginary
    return [(name, _shaped(name, values, shape))]


def _fields(parts: _Elements, order: str, name: str, depth: int) -> list[Variable]:
    lengths, names = parts.numbers(), parts.text()
    length = int(lengths[0]) if lengths.size else 0
    if length <= 0 or len(names) % length:
        raise DamagedError(f"the field names of {name!r}")
    found: list[Variable] = []
    for start in range(0, len(names), length):
        field = names[start : start + length].split("\0")[0]
        kind, data = parts.next()
        if kind != _MATRIX:
            raise DamagedError(f"an element of type {kind} where the field {name}.{field} should be")
        found += _matrix(data, order, f"{name}.{field}", depth - 1)
    return found


def _shaped(name: str, values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    if values.size != math.prod(shape):
        raise DamagedError(f"{name!r} contains {values.size} numbers, but its shape is {shape}")
    return values.reshape(shape, order="F")


def _version_4(raw: bytes) -> list[Variable]:
    """A header of five whole numbers, the name, the values; M of the type MOPT is the byte order."""
    found: list[Variable] = []
    at = 0
    while at < len(raw):
        if at + 20 > len(raw):
            raise DamagedError("it ends within a header")
        order = "<" if struct.unpack_from("<i", raw, at)[0] in range(100) else ">"
        kind, rows, cols, imaginary, length = struct.unpack_from(order + "5i", raw, at)
        stored, content = divmod(kind % 1000, 10)
        if kind // 1000 != (order == ">") or stored >= len(_STORED_4) or content > 2 or imaginary not in (0, 1):
            raise DamagedError(f"a variable of type {kind}")
        dtype = np.dtype(order + _STORED_4[stored])
        size = rows * cols * dtype.itemsize
        start = at + 20 + length
        at = start + size * (1 + imaginary)
        if min(rows, cols, length - 1) < 0 or at > len(raw):
            raise DamagedError("it ends within a variable")
        name = raw[start - length : start].split(b"\0")[0].decode("latin-1")
        if content:
            found.append((name, ("text", "sparse")[content - 1]))
            continue
        values = np.frombuffer(raw, dtype, rows * cols, start)
        if imaginary:
            values = values + 1j * np.frombuffer(raw, dtype, rows * cols, start + size)
        found.append((name, _shaped(name, values, (rows, cols))))
    return found
