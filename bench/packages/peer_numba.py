"""The same problem compiled by numba: error sums for the peers, and a whole genetic algorithm.

Everything is in delta form (delta = z - 1), as in the core; `fastmath` and the machine's own vector width, which the core
does without or chooses at run time.
The genetic algorithm keeps its 194 bits as 21 integer fields, draws random bits by the word and mutations by their gaps,
and simulates candidates of one order side by side.
"""

from __future__ import annotations

import os

os.environ["NUMBA_SLP_VECTORIZE"] = "1"  # off by default; without it the unrolled lanes stay scalar, four times slower

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
LANES = 16
WORST = np.finfo(np.float64).max
WIDTHS = np.array([2, 2] + [10] * 19, dtype=np.int64)
FIRST = np.concatenate([[0], np.cumsum(WIDTHS)[:-1]])
FIELD_OF_BIT = np.repeat(np.arange(21), WIDTHS)
# For every bit its place in its field, most significant first.
SHIFT_OF_BIT = np.concatenate([np.arange(w - 1, -1, -1) for w in WIDTHS])


def unrolled(N, lanes):
    """errors(a, b, command, output, sums): error sums of `lanes` candidates of order N, a and b coefficient x lane.

    Written out, every state a variable of its own: so the compiler keeps them in registers and packs the lanes into vectors.
    """
    each = [(i, l) for i in range(N) for l in range(lanes)]
    lines = [f"x{i}_{l} = 0.0; a{i}_{l} = a[{i}, {l}]; b{i + 1}_{l} = b[{i + 1}, {l}]" for i, l in each]
    lines += [f"s{l} = 0.0; b0_{l} = b[0, {l}]" for l in range(lanes)]
    body = [f"y{l} = x0_{l} + b0_{l} * r" for l in range(lanes)]
    body += [f"e{l} = w - y{l}" for l in range(lanes)]
    body += [f"s{l} += e{l} * e{l}" for l in range(lanes)]
    body += [f"x{i}_{l} += {f'x{i + 1}_{l} + ' if i + 1 < N else ''}b{i + 1}_{l} * r - a{i}_{l} * y{l}" for i, l in each]
    lines += ["for k in range(len(command)):", "    r, w = command[k], output[k]", *("    " + line for line in body)]
    lines += [f"sums[{l}] = s{l}" for l in range(lanes)]
    scope: dict = {}
    exec("def errors(a, b, command, output, sums):\n" + "\n".join("    " + line for line in lines), scope)
    return njit(fastmath=True, error_model="numpy")(scope["errors"])


errors1, errors2, errors3, errors4, errors5, errors6, errors7 = (unrolled(N, LANES) for N in range(1, 8))
errors_alone = unrolled(4, 1)


@njit
def lanes_errors(N, a, b, command, output, sums):
    """By order, 1 to 7."""
    if N == 1:
        errors1(a, b, command, output, sums)
    elif N == 2:
        errors2(a, b, command, output, sums)
    elif N == 3:
        errors3(a, b, command, output, sums)
    elif N == 4:
        errors4(a, b, command, output, sums)
    elif N == 5:
        errors5(a, b, command, output, sums)
    elif N == 6:
        errors6(a, b, command, output, sums)
    else:
        errors7(a, b, command, output, sums)


@njit(fastmath=True, error_model="numpy")
def times(c, degree, k2, k1, k0):
    """c[0] x^n + ... times (k2 x^2 + k1 x + k0); k2 = 0 raises the degree by one only. Returns the new degree."""
    if k2 == 0.0:
        c[degree + 1] = 0.0
        for i in range(degree + 1, 0, -1):
            c[i] = k1 * c[i] + k0 * c[i - 1]
        c[0] *= k1
        return degree + 1
    c[degree + 1] = c[degree + 2] = 0.0
    for i in range(degree + 2, 1, -1):
        c[i] = k2 * c[i] + k1 * c[i - 1] + k0 * c[i - 2]
    c[1] = k2 * c[1] + k1 * c[0]
    c[0] *= k2
    return degree + 2


@njit(fastmath=True, error_model="numpy")
def close(p, K, poles, pole_pairs, single_pole, zeros, zero_pairs, single_zero, loop, a, b, A, B):
    """Coefficients of the closed loop into a and b; returns its order. A and B are scratch.

    poles, zeros: rows (e1, e0) of s^2 + e1 s + e0, behind them a row for the single root.
    """
    Ts, kp, ki = loop
    h = 0.5 * Ts
    A[0] = 1.0
    B[0] = K * h**p
    n = m = 0
    for i in range(pole_pairs):
        e1, e0 = poles[i, 0] * h, poles[i, 1] * h * h
        n = times(A, n, 1.0 + e1 + e0, 2.0 * e1 + 4.0 * e0, 4.0 * e0)
    if single_pole:
        n = times(A, n, 0.0, 1.0 + poles[pole_pairs, 0] * h, 2.0 * poles[pole_pairs, 0] * h)
    for i in range(zero_pairs):
        e1, e0 = zeros[i, 0] * h, zeros[i, 1] * h * h
        m = times(B, m, 1.0 + e1 + e0, 2.0 * e1 + 4.0 * e0, 4.0 * e0)
    if single_zero:
        m = times(B, m, 0.0, 1.0 + zeros[zero_pairs, 0] * h, 2.0 * zeros[zero_pairs, 0] * h)
    for _ in range(p):
        m = times(B, m, 0.0, 1.0, 2.0)
    times(B, n, 0.0, kp + 0.5 * ki * Ts, ki * Ts)
    A[n + 1] = 0.0
    lead = 1.0 / (A[0] + B[0])
    for i in range(n + 2):
        b[i] = B[i] * lead
        if i > 0:
            a[i - 1] = (A[i] + B[i]) * lead
    return n + 1


@njit(fastmath=True, error_model="numpy")
def respond(N, a, b, command, y):
    """The recurrence: y = x0 + b0 r, x_i += x_(i+1) + b_(i+1) r - a_i y."""
    x = np.zeros(10)
    for k in range(len(command)):
        r = command[k]
        y[k] = x[0] + b[0] * r
        for i in range(N):
            x[i] += x[i + 1] + b[i + 1] * r - a[i] * y[k]


@njit(error_model="numpy")
def value(t, row, ranges, logarithmic):
    """A number in 0..1 on the scale of its range."""
    lo, hi = ranges[row, 0], ranges[row, 1]
    if row == 0 or logarithmic:
        return lo * np.exp(t * np.log(hi / lo))
    return lo + (hi - lo) * t


@njit(error_model="numpy")
def decode_numbers(x, ranges, logarithmic, loop, a, b, work):
    """From six numbers in 0..1, structure (1, 2), to the closed loop of order 4."""
    poles, zeros = work[:4, :2], work[4:8, :2]
    re, im = value(x[2], 1, ranges, logarithmic), value(x[3], 2, ranges, logarithmic)
    poles[0, 0], poles[0, 1] = 2.0 * re, re * re + im * im
    poles[1, 0] = value(x[1], 1, ranges, logarithmic)
    re, im = value(x[4], 1, ranges, logarithmic), value(x[5], 2, ranges, logarithmic)
    zeros[0, 0], zeros[0, 1] = 2.0 * re, re * re + im * im
    close(1, value(x[0], 0, ranges, logarithmic), poles, 1, True, zeros, 1, False, loop, a, b, work[8], work[9])


@njit(error_model="numpy")
def response_of_numbers(x, ranges, logarithmic, loop, command):
    """Velocity of one candidate."""
    a, b, y = np.empty(10), np.empty(10), np.empty(len(command))
    decode_numbers(x, ranges, logarithmic, loop, a, b, np.empty((10, 10)))
    respond(4, a, b, command, y)
    return y


@njit(error_model="numpy")
def error_of_numbers(x, ranges, logarithmic, loop, command, output):
    """Error sum of one candidate."""
    a, b, sums = np.empty((10, 1)), np.empty((10, 1)), np.empty(1)
    decode_numbers(x, ranges, logarithmic, loop, a[:, 0], b[:, 0], np.empty((10, 10)))
    errors_alone(a, b, command, output, sums)
    return sums[0] if sums[0] < WORST else WORST


@njit(error_model="numpy")
def errors_of_numbers(X, ranges, logarithmic, loop, command, output):
    """Error sums of the rows of X, side by side."""
    costs = np.empty(len(X))
    a, b, sums, work = np.empty((10, LANES)), np.empty((10, LANES)), np.empty(LANES), np.empty((10, 10))
    for first in range(0, len(X), LANES):
        width = min(LANES, len(X) - first)
        for l in range(LANES):
            decode_numbers(X[first + min(l, width - 1)], ranges, logarithmic, loop, a[:, l], b[:, l], work)
        errors4(a, b, command, output, sums)
        for l in range(width):
            costs[first + l] = sums[l] if sums[l] < WORST else WORST
    return costs


@njit(error_model="numpy")
def pair(fields, first, second, ranges, logarithmic, row):
    """The pair of two genes, real parts at `first` and `second`, as (e1, e0)."""
    re = value(fields[first] / 1023.0, 1, ranges, logarithmic)
    if fields[second + 1] >= 512:
        im = value(fields[first + 1] / 1023.0, 2, ranges, logarithmic)
        row[0], row[1] = 2.0 * re, re * re + im * im
    else:
        other = value(fields[second] / 1023.0, 1, ranges, logarithmic)
        row[0], row[1] = re + other, re * other


@njit(error_model="numpy")
def decode(fields, ranges, logarithmic, loop, a, b, work):
    """From 21 fields (p, q, K, A11.., A21 B21 ..) to the closed loop. Returns its order."""
    p, q = fields[0], fields[1]
    poles, zeros = work[:4, :2], work[4:8, :2]
    n = 0
    for i in range(p // 2):
        pair(fields, 3 + 4 * i, 5 + 4 * i, ranges, logarithmic, poles[n])
        n += 1
    for j in range(q // 2):
        pair(fields, 9 + 8 * j, 13 + 8 * j, ranges, logarithmic, poles[n])
        pair(fields, 11 + 8 * j, 15 + 8 * j, ranges, logarithmic, zeros[j])
        n += 1
    last1, last2 = 1 + 2 * p, 5 + 4 * q  # real parts of the last members of the pole groups
    if p % 2 == 1 and q % 2 == 1:
        pair(fields, last1, last2, ranges, logarithmic, poles[n])
        n += 1
    elif (p + q) % 2 == 1:
        poles[n, 0] = value(fields[last1 if p % 2 == 1 else last2] / 1023.0, 1, ranges, logarithmic)
    if q % 2 == 1:
        zeros[q // 2, 0] = value(fields[last2 + 2] / 1023.0, 1, ranges, logarithmic)
    K = value(fields[2] / 1023.0, 0, ranges, logarithmic)
    return close(p, K, poles, n, (p + q) % 2 == 1, zeros, q // 2, q % 2 == 1, loop, a, b, work[8], work[9])


@njit(error_model="numpy")
def costs_of_fields(population, ranges, logarithmic, loop, command, output, costs):
    """Fitness (6) of every row of fields: error sum + 2 (p + q)."""
    count = len(population)
    A, B, order = np.empty((count, 10)), np.empty((count, 10)), np.empty(count, np.int64)
    work = np.empty((10, 10))
    for k in range(count):
        order[k] = decode(population[k], ranges, logarithmic, loop, A[k], B[k], work)
    ranked = np.empty(count, np.int64)
    filled = 0
    for N in range(8):
        for k in range(count):
            if order[k] == N:
                ranked[filled] = k
                filled += 1
    a, b = np.empty((10, LANES)), np.empty((10, LANES))
    sums = np.empty(LANES)
    for first in range(0, count, LANES):
        width = min(LANES, count - first)
        N = order[ranked[first + width - 1]]
        for l in range(LANES):
            k = ranked[first + min(l, width - 1)]
            for i in range(N + 1):
                a[i, l] = A[k, i] if i < order[k] else 0.0
                b[i, l] = B[k, i] if i <= order[k] else 0.0
        lanes_errors(N, a, b, command, output, sums)
        for l in range(width):
            k = ranked[first + l]
            total = sums[l] + 2.0 * (population[k, 0] + population[k, 1])
            costs[k] = total if total < WORST else WORST


@njit
def fields_of_bits(bits):
    """Rows of 194 bits as rows of 21 fields."""
    fields = np.zeros((len(bits), 21), np.int64)
    for k in range(len(bits)):
        for i in range(194):
            fields[k, FIELD_OF_BIT[i]] |= np.int64(bits[k, i]) << SHIFT_OF_BIT[i]
    return fields


@njit(error_model="numpy")
def costs_of_bits(bits, ranges, logarithmic, loop, command, output):
    """Fitness (6) of rows of 194 bits."""
    costs = np.empty(len(bits))
    costs_of_fields(fields_of_bits(bits), ranges, logarithmic, loop, command, output, costs)
    return costs


@njit
def word(state):
    """xorshift64*: one random word."""
    s = state[0]
    s ^= s >> np.uint64(12)
    s ^= s << np.uint64(25)
    s ^= s >> np.uint64(27)
    state[0] = s
    return s * np.uint64(2685821657736338717)


@njit
def contest(state, costs):
    """Tournament of two."""
    n, r = np.uint64(len(costs)), word(state)
    i, j = ((r >> np.uint64(32)) * n) >> np.uint64(32), ((r & np.uint64(0xFFFFFFFF)) * n) >> np.uint64(32)
    return i if costs[i] <= costs[j] else j


@njit(error_model="numpy")
def genetic(seed, population, generations, structure, ranges, logarithmic, loop, command, output, best_fields):
    """The paper's run: tournament of 2, multi-point crossover 0.9, bit mutation 0.01, no elite.

    population: rows of fields, replaced by the last generation. structure: (p, q) to keep, or (-1, -1).
    Writes the best fields seen and returns their cost.
    """
    count = len(population)
    state = np.array([np.uint64(seed) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(1)])
    costs = np.empty(count)
    costs_of_fields(population, ranges, logarithmic, loop, command, output, costs)
    children = np.empty_like(population)
    best = WORST
    per_gap = 1.0 / np.log(1.0 - 0.01)
    gap = np.int64(np.log((word(state) >> np.uint64(11)) * 2.0**-53 + 1e-300) * per_gap)
    for _ in range(generations):
        for k in range(0, count, 2):
            mother, father = contest(state, costs), contest(state, costs)
            crossed = (word(state) >> np.uint64(11)) * 2.0**-53 < 0.9
            r = np.uint64(0)
            for f in range(21):
                if f % 3 == 0:
                    r = word(state) & (word(state) | np.uint64(1 << 9 | 1 << 29 | 1 << 49))
                cut = (r >> np.uint64(20 * (f % 3))) & np.uint64(0x3FF)
                for s in (1, 2, 4, 8):
                    cut ^= cut >> np.uint64(s)
                a, b = population[mother, f], population[father, f]
                swap = (a ^ b) & np.int64(cut) if crossed else 0
                children[k, f] = a ^ swap
                children[min(k + 1, count - 1), f] = b ^ swap
        while gap < 194 * count:
            k, i = gap // 194, gap % 194
            children[k, FIELD_OF_BIT[i]] ^= 1 << SHIFT_OF_BIT[i]
            gap += 1 + np.int64(np.log((word(state) >> np.uint64(11)) * 2.0**-53 + 1e-300) * per_gap)
        gap -= 194 * count
        if structure[0] >= 0:
            children[:, 0] = structure[0]
            children[:, 1] = structure[1]
        population[:] = children
        costs_of_fields(population, ranges, logarithmic, loop, command, output, costs)
        k = np.argmin(costs)
        if costs[k] < best:
            best = costs[k]
            best_fields[:] = population[k]
    return best
