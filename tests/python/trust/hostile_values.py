"""Strategies that draw values of every kind, and given values with one place of them changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import date
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

import gaident as ga

Values = st.SearchStrategy[Any]


class OwnError(Exception):
    """What methods of an object of a user's own raise: it may go through to the user."""


class Unshown:
    """Its repr() raises."""

    def __repr__(self) -> str:
        raise OwnError("no repr")


class Lines:
    """Its repr() has many long lines."""

    def __repr__(self) -> str:
        return "first\n\n" + "second\r\n" + 3000 * "x"


class Refuses:
    """All that one can ask of a value raises."""

    def __getattr__(self, name: str) -> Any:
        raise OwnError(f"no {name}")

    def _refused(self, *_: object) -> Any:
        raise OwnError("refused")

    __len__ = __iter__ = __getitem__ = __float__ = __int__ = __index__ = __bool__ = __array__ = __call__ = _refused
    __eq__ = __hash__ = __lt__ = __add__ = __mul__ = __str__ = _refused  # type: ignore[assignment]


class Answers:
    """It has every attribute, and each is like itself."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self

    def __call__(self, *_: object, **__: object) -> Answers:
        return self


class OwnNumber(float):
    """A number that is equal to none."""

    def __eq__(self, other: object) -> bool:
        return False

    __hash__ = float.__hash__


class OwnText(str):
    """A text of a class of one's own."""


class Pairs(Mapping[Any, Any]):
    """A mapping whose keys are of several kinds."""

    def __getitem__(self, key: object) -> float:
        return 1.0

    def __iter__(self) -> Iterator[object]:
        return iter((1, None, "a"))

    def __len__(self) -> int:
        return 3


@dataclass
class Holder:
    """An object of a user's own."""

    gain: object = 1.0
    poles: object = (-1.0,)


NUMBERS: Values = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 5),
    st.integers(2**31 - 1, 2**70) | st.integers(-(2**70), -(2**31)),
    st.sampled_from([10**400, -(10**400), 2**1024]),  # of more than 4300 digits Python itself writes no number
    st.floats(),
    st.sampled_from([1e-320, 1e-200, 1e-30, 1e30, 1e154, -1e154, 1.7e308, -0.0]),
    st.complex_numbers(),
    st.sampled_from([np.float32("inf"), np.float16(3.0), np.int8(-1), np.uint64(2**64 - 1), np.bool_(True)]),
    st.sampled_from([np.longdouble("1e4000"), np.complex64(1j), np.datetime64("NaT"), np.timedelta64(1, "s")]),
    st.sampled_from([np.str_("x"), np.bytes_(b"x"), np.void(b"x"), date(2020, 1, 1)]),
    st.sampled_from([Fraction(1, 3), Fraction(10**400), Decimal("NaN"), Decimal("sNaN"), Decimal("1e999999"), OwnNumber(1.0)]),
)
# No slash: a text may name a file, which is then written.
TEXTS: Values = st.one_of(
    st.text(st.characters(exclude_characters="/~"), max_size=8),
    st.binary(max_size=4),
    st.sampled_from(["", " ", "a\nb", "\r", "\x02dt\x03", "\x1b[31m", "\ud800", "{torque}", "{", "%s", "\u202e", 300 * "x"]),
    st.sampled_from(["1e3", "nan", "velocity", "motor", "load", "torque", "rotary", "linear", "auto", "motor load", "None", "."]),
    st.sampled_from([OwnText("x"), bytearray(b"x"), memoryview(b"xyz"), Path("none.json"), Path()]),
)
OBJECTS: Values = st.one_of(
    st.sampled_from([Unshown, Lines, Refuses, Answers, Pairs, Holder, object]).map(lambda made: made()),
    st.sampled_from([int, Ellipsis, NotImplemented, print, len, lambda: None, lambda *_: None, np.sin, np, np.float64]),
    st.sampled_from([range(3), slice(None), iter(()), {1, 2}, frozenset(), ValueError("x"), Exception]),
    st.sampled_from([ga, ga.PI, ga.PI(0.02, 0.5), ga.Cascade(ga.PI(0.02, 0.5)), ga.P(1.0), ga.Model(1.0, [-1.0])]),
    st.sampled_from([ga.Settings(), ga.SearchSpace(), ga.Limits(80.0, 2.4), ga.GaidentError("x"), np.random.default_rng(0)]),
)
SHAPES = [(), (0,), (1,), (2,), (7,), (200,), (201,), (2, 2), (0, 3), (200, 1), (1, 200), (2, 3, 4)]
KINDS = ["f8", "f4", "f2", ">f8", "g", "i1", "u8", "?", "c16", "O", "U3", "S3", "M8[s]", "m8[ms]", [("a", "f8")], "V4"]
FILLINGS = [0.0, 1.0, -1.0, np.nan, np.inf, 1e300, 1e-300, 1e30, 1e17]


@st.composite
def arrays(draw: st.DrawFn) -> Any:
    """Arrays of odd shapes and types, views of others among them."""
    shape, kind = draw(st.sampled_from(SHAPES)), np.dtype(draw(st.sampled_from(KINDS)))
    flat = (
        np.arange(float(np.prod(shape))) if draw(st.booleans()) else np.full(int(np.prod(shape)), draw(st.sampled_from(FILLINGS)))
    )
    if kind.kind in "fc":
        with np.errstate(all="ignore"):
            values = flat.astype(kind)
    else:
        values = np.zeros(flat.size, kind)
        if kind.kind in "iuOU":
            values[:] = [int(abs(v)) if abs(v) < 100 else 100 for v in flat]
    if values.size and kind.kind in "fO" and draw(st.booleans()):
        values[draw(st.integers(0, values.size - 1))] = draw(st.sampled_from([np.nan, -np.inf, 0.0]))
    made = values.reshape(shape)
    how = draw(st.sampled_from(["plain", "plain", "reversed", "masked", "read-only", "broadcast", "list"]))
    if how == "list":
        return made.tolist()
    if how == "masked":
        return np.ma.masked_array(made, mask=np.arange(made.size).reshape(shape) % 2 == 0)
    if how == "broadcast" and made.ndim == 0:
        return np.broadcast_to(made, (200,))
    if how == "read-only":
        made.flags.writeable = False
    return made[::-1] if how == "reversed" and made.ndim else made


LEAVES: Values = NUMBERS | TEXTS | OBJECTS | arrays()
HOSTILE: Values = LEAVES | st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.tuples(inner, inner),
        st.dictionaries(st.sampled_from(["a", "velocity", "time", "gain", 1, None, ("a",)]), inner, max_size=3),
        st.lists(inner, max_size=3).map(iter),
    ),
    max_leaves=5,
)


@st.composite
def near(draw: st.DrawFn, given: Any) -> Any:
    """`given`, with one place of it changed: a number scaled, an item of a container replaced, left out or added."""
    if isinstance(given, bool) or given is None:
        return draw(HOSTILE)
    if isinstance(given, int | float):
        return given * draw(st.sampled_from([-1, 0, 1e-12, 1e-6, 1e-3, 0.1, 10, 1e3, 1e6, 1e12, 1e300, 2**63, 1j]))
    if isinstance(given, str):
        return draw(
            st.sampled_from([given.upper(), given + " ", " " + given, given[:-1], given + "\n", given.encode(), OwnText(given)])
        )
    if isinstance(given, np.ndarray) and given.ndim:
        at, changed = draw(st.integers(0, len(given) - 1)), given.copy()
        how = draw(st.sampled_from(["one", "short", "scaled", "column", "object", "list", "same", "reversed"]))
        if how == "one":
            changed[at] = draw(st.sampled_from([np.nan, np.inf, 1e29, 1e300, -1e-300]))
        with np.errstate(all="ignore"):
            scaled = changed * draw(st.sampled_from([0.0, -1.0, 1e-30, 1e-9, 1e9, 1e28]))
        return {
            "short": changed[: at + 1],
            "scaled": scaled,
            "column": changed[:, None],
            "object": changed.astype(object),
            "list": changed.tolist(),
            "same": np.full_like(changed, changed[at]),
            "reversed": changed[::-1],
        }.get(how, changed)
    if isinstance(given, dict) and given:
        key, how = draw(st.sampled_from(list(given))), draw(st.sampled_from(["near", "near", "near", "hostile", "out", "more"]))
        if how == "more":
            return {**given, draw(TEXTS.filter(lambda t: isinstance(t, str)) | st.sampled_from([1, None])): draw(HOSTILE)}
        if how == "out":
            return {k: v for k, v in given.items() if k != key}
        return {**given, key: draw(near(given[key]) if how == "near" else HOSTILE)}
    if isinstance(given, list | tuple) and given:
        at, how = draw(st.integers(0, len(given) - 1)), draw(st.sampled_from(["near", "near", "hostile", "out", "twice"]))
        items = {"out": [], "twice": [given[at]] * 2}.get(how) if how in ("out", "twice") else None
        if items is None:
            items = [draw(near(given[at]) if how == "near" else HOSTILE)]
        return (tuple if isinstance(given, tuple) else list)([*given[:at], *items, *given[at + 1 :]])
    return draw(HOSTILE)
