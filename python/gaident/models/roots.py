"""Roots of real polynomials: their one order, their conjugate symmetry, finding them, and their frequency and damping."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.checks import real_number
from gaident.errors import ModelError

# Rounding in text files and root finders stays far below this; a wrong digit in a table stays far above.
ASYMMETRY = 1e-9  # no decision: rounding
# An imaginary part this small cannot be told from rounding of the root itself.
NO_IMAGINARY_PART = 1e-13  # no decision: rounding
# Far beyond any drive, and beyond where a search may stray; what is larger, or smaller, is a wrong unit or no number at all.
LARGEST_ROOT = 1e50  # no decision: what an argument may be [rad/s]
LARGEST_GAIN = 1e250  # no decision: what an argument may be [(rad/s)^(p+1)/(N m)]
SMALLEST_GAIN = 1e-300  # no decision: what an argument may be [(rad/s)^(p+1)/(N m)]


class Mode(NamedTuple):
    """One real root or one conjugate pair of a model.

    Attributes
    ----------
    kind : {"pole", "zero"}
        What the root is.
    root : complex
        The root [rad/s]; of a pair the member with positive imaginary part.
    natural_frequency : float
        abs(root) [rad/s].
    damping : float
        -Re(root)/abs(root) [1]; 1 for a stable real root, nan for a root at 0.

    Examples
    --------
    >>> import gaident as ga
    >>> pole = ga.Model(100.0, [-10.0 + 99.5j, -10.0 - 99.5j]).modes[0]
    >>> round(pole.natural_frequency), round(pole.damping, 2)
    (100, 0.1)
    """

    kind: str  # "pole" or "zero"
    root: complex  # rad/s; of a pair the member with positive imaginary part
    natural_frequency: float  # abs(root), rad/s
    damping: float  # -Re(root)/abs(root); 1 for a stable real root, nan for a root at 0

    @property
    def frequency_hz(self) -> float:
        """Natural frequency [Hz]."""
        return self.natural_frequency / (2.0 * math.pi)


def checked_gain(gain: object) -> float:
    """The gain as a finite float that a drive can have; raises ModelError."""
    number = real_number(gain, "gain", ModelError, "give one finite real number, not 0")
    if number == 0.0:
        raise ModelError("gain is 0: such a model never moves; give one finite real number, not 0")
    if not SMALLEST_GAIN <= abs(number) <= LARGEST_GAIN:
        raise ModelError(
            f"gain is {number:g}, whose size no drive has ({SMALLEST_GAIN:g} to {LARGEST_GAIN:g}): correct its unit, or "
            "take out a pole or a zero that is far beyond the others"
        )
    return number


def check_sizes(roots: Iterable[complex], name: str) -> None:
    """Raises ModelError for a root that is larger than any drive has."""
    for i, root in enumerate(roots):
        if max(abs(root.real), abs(root.imag)) > LARGEST_ROOT:
            raise ModelError(
                f"{name}[{i}] is {root:g}, which no drive has ({LARGEST_ROOT:g} rad/s at most): give it in rad/s, or leave it out"
            )


def canonical_roots(roots: object, name: str) -> tuple[complex, ...]:
    """Reals by ascending magnitude, then conjugate pairs likewise, positive imaginary part first.

    Raises ModelError, naming the argument and the root, where a root is not finite, beyond all drives, or has no partner.
    """
    if isinstance(roots, (str, bytes)):
        raise ModelError(f"{name} is {roots!r}: give a list of numbers in rad/s")
    try:
        with np.errstate(over="ignore"):
            values = np.atleast_1d(np.asarray(roots, dtype=np.complex128))
    except (TypeError, ValueError, OverflowError):
        raise ModelError(f"{name} is {roots!r}: give a list of numbers in rad/s") from None
    if values.ndim != 1:
        raise ModelError(f"{name} has the shape {values.shape}: give a list of numbers in rad/s")
    for i, root in enumerate(values):
        if not np.isfinite(root):
            raise ModelError(f"{name}[{i}] is {root}: every root must be finite")
    check_sizes(values.tolist(), name)

    flat = np.abs(values.imag) <= NO_IMAGINARY_PART * np.abs(values)
    reals = [float(r.real) for r in values[flat]]
    upper = sorted((complex(r) for r in values[~flat] if r.imag > 0), key=_rank)
    lower = [complex(r) for r in values[~flat] if r.imag < 0]
    pairs, alone = [], []
    for root in upper:
        distance = [abs(root.conjugate() - other) for other in lower]
        nearest = int(np.argmin(distance)) if distance else -1
        if nearest < 0 or distance[nearest] > ASYMMETRY * abs(root):
            alone.append(root)
            continue
        other = lower.pop(nearest)
        pairs.append(complex(0.5 * root.real + 0.5 * other.real + 0.0, 0.5 * root.imag - 0.5 * other.imag))
    for root in alone + lower:
        if abs(root.imag) > ASYMMETRY * abs(root):
            raise ModelError(
                f"{name} has {root:g} without its conjugate {root.conjugate():g}: "
                "complex roots of a real system come in pairs, so add it"
            )
        reals.append(root.real)
    ordered = [complex(r + 0.0, 0.0) for r in sorted(reals, key=lambda r: (abs(r), r))]
    for root in sorted(pairs, key=_rank):
        ordered += [root, root.conjugate()]
    return tuple(ordered)


def polynomial_roots(coefficients: Sequence[float] | NDArray[np.float64]) -> NDArray[np.complex128]:
    """Roots of s^n + c[0] s^(n-1) + ... + c[n-1], in conjugate pairs.

    Companion matrix of the polynomial in s/scale; each root is then polished by Newton steps as long as they help.
    Of a cubic only the best separated real root is found so; the other two are those of the quadratic that is left, so that
    together they give back the coefficients even where two nearly coincide.
    """
    c = np.asarray(coefficients, dtype=np.float64)
    n = len(c)
    scale = max((abs(c[k]) ** (1.0 / (k + 1)) for k in range(n)), default=0.0)
    if scale == 0.0:
        return np.zeros(n, dtype=np.complex128)
    if n == 2:
        return np.array(quadratic_roots(float(c[0]), float(c[1])))
    scaled = np.concatenate([[1.0], c / scale ** np.arange(1, n + 1)])
    slope = np.polyder(scaled)
    roots = np.roots(scaled).astype(np.complex128)
    if n == 3:  # no decision: a formula: a degree
        real = roots[np.abs(roots.imag) == np.min(np.abs(roots.imag))].real
        best = real[np.argmax(np.abs(np.polyval(slope, real)))]
        roots = np.array([best], dtype=np.complex128)
    found: list[complex] = []
    for root in roots[roots.imag >= 0.0]:
        value = np.polyval(scaled, root)
        for _ in range(3):  # no decision: of a solver, whose steps are quadratic
            gradient = np.polyval(slope, root)
            if value == 0.0 or gradient == 0.0:
                break
            better = root - value / gradient
            residual = np.polyval(scaled, better)
            if abs(residual) >= abs(value):
                break
            root, value = better, residual
        found.append(complex(root))
        if root.imag != 0.0:
            found.append(complex(root).conjugate())
    if n == 3:  # no decision: a formula: a degree
        r = found[0].real
        # s^3 + c0 s^2 + c1 s + c2 = (s - r)(s^2 + q1 s + q0), each of q1, q0 by the equation that does not cancel
        _, c0, c1, c2 = (float(v) for v in scaled)
        q0 = -c2 / r if r != 0.0 else c1
        q1 = (q0 - c1) / r if abs(r) ** 3 > abs(c2) else c0 + r
        found += quadratic_roots(q1, q0)
    return scale * np.array(found, dtype=np.complex128)


def quadratic_roots(e1: float, e0: float) -> list[complex]:
    """Both roots of s^2 + e1 s + e0, without cancellation."""
    half = 0.5 * e1
    discriminant = half * half - e0
    if discriminant < 0.0:
        root = complex(-half, math.sqrt(-discriminant))
        return [root, root.conjugate()]
    larger = -half - math.copysign(math.sqrt(discriminant), half)
    smaller = e0 / larger if larger != 0.0 else 0.0
    return [complex(smaller, 0.0), complex(larger, 0.0)]


def _rank(root: complex) -> tuple[float, float]:
    return math.hypot(root.real, root.imag), root.real


def modes_of(kind: str, roots: Iterable[complex]) -> Iterator[Mode]:
    """A row for each real root and for each pair."""
    for root in roots:
        if root.imag >= 0.0:
            magnitude = abs(root)
            damping = -root.real / magnitude if magnitude else math.nan
            yield Mode(kind, root, magnitude, damping)


def ratio_of_products(zeros: Sequence[complex], poles: Sequence[complex]) -> float:
    """prod(-zeros)/prod(-poles) of the roots that are not 0; infinite where the poles are so near 0 that their product is 0."""
    numerator = math.prod((-zero for zero in zeros if zero != 0.0), start=1.0 + 0.0j)
    denominator = math.prod((-pole for pole in poles if pole != 0.0), start=1.0 + 0.0j)
    if denominator != 0.0:
        return (numerator / denominator).real
    # Pairs have a positive product.
    right = sum(root.imag == 0.0 and root.real > 0.0 for root in (*zeros, *poles))
    return -math.inf if right % 2 else math.inf


def text_of(roots: tuple[complex, ...]) -> str:
    """The roots as Python writes a list, real ones without an imaginary part."""
    return "[" + ", ".join(repr(r.real) if r.imag == 0.0 else repr(r).strip("()") for r in roots) + "]"


def roots_of(values: Mapping[str, Any], name: str) -> list[complex]:
    """The roots [rad/s] of saved data, each a number or a pair [real, imaginary]; raises ModelError."""
    entries = values.get(name, ())
    try:
        return [complex(*e) if isinstance(e, (list, tuple)) else complex(e) for e in entries]
    except (TypeError, ValueError):
        raise ModelError(f"{name} is {entries!r}: give a list of [real, imaginary] pairs in rad/s") from None
