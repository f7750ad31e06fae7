"""Text packed for a page: what makes a page large is the library that draws its figures, and the numbers of the figures.

Browsers unpack gzip by themselves, which leaves 1.5 MB of plotly.js.
LZMA leaves 1.1 MB; unpack.js unpacks it, in a browser of any age, within half a second.
Its bits go into letters, 13 of them into two of 91 letters,

    v = a + 91 b,   0 <= v < 2^13 <= 91^2

which is 1.23 letters a byte, where base64 needs 1.33.
"""

from __future__ import annotations

import lzma

import numpy as np

from gaident.show.html import Html

__all__ = ["FILTER", "packed"]

FILTER = {
    "id": lzma.FILTER_LZMA1,
    "preset": 6,
    "dict_size": 1 << 23,
    **{"lc": 3, "lp": 0, "pb": 0},  # unpack.js knows these alone
}
"""How Python's lzma packs: contexts of three bits of the byte before, none of the place."""
BITS, LETTERS = 13, 91  # no decision: a format: a pair of letters
FIRST, LEFT_OUT = ord("#"), ord("<")  # the letters are # to ~ without <, which may end a script


def packed(text: str) -> tuple[Html, int]:
    """(letters for a script element that unpack.js unpacks, bytes of the text); the same for the same text."""
    data = text.encode()
    bits = np.unpackbits(np.frombuffer(lzma.compress(data, format=lzma.FORMAT_RAW, filters=[FILTER]), np.uint8))
    rows = np.pad(bits, (0, -len(bits) % BITS)).reshape(-1, BITS)
    values = rows @ (1 << np.arange(BITS - 1, -1, -1))
    letters = FIRST + np.column_stack([values % LETTERS, values // LETTERS]).ravel()
    letters += letters >= LEFT_OUT
    return Html(letters.astype(np.uint8).tobytes().decode("ascii")), len(data)
