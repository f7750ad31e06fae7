"""Logs as they come: two clocks, counters that wrap, units that nobody wrote, stamps of every quality; read, and judged.

A log that is sound has to be read, one that is not has to be refused; a unit, a wrap, an offset of clocks has to be the true one.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rows.case import Case, Result, digest

import gaident as ga
from gaident.data import align
from gaident.data.guess import guess_channels, position_and_velocity, unit_from_position, unit_from_velocity
from gaident.data.listing import columns as listed
from gaident.data.signals.wraps import Unwrapper, overflow
from gaident.drive.log_content import with_content

__all__ = ["logs", "read_log"]

Vector = NDArray[np.float64]
UNITS = {"rad/s": 1.0, "rpm": np.pi / 30.0, "deg/s": np.pi / 180.0}


def motion(t: Vector, rng: np.random.Generator) -> Vector:
    """A speed of four edges and a swing [rad/s]."""
    at, heights = np.sort(rng.uniform(0.4, 5.0, 4)), rng.uniform(30.0, 120.0, 4) * np.array([1, -1, 1, -1])
    steps = sum(h * np.clip((t - a) / 0.3, 0.0, 1.0) for a, h in zip(at, heights, strict=True))
    return np.asarray(steps + 3.0 * np.sin(2.0 * np.pi * 2.3 * t))


def clocks(rng: np.random.Generator, offset: float, rate: float, noise: float) -> Result:
    """A second log of the same motion: its clock's offset [s] and rate. noise: rad/s."""
    seed = int(rng.integers(1 << 31))
    t, own = 1e-3 * np.arange(6000), 2e-3 * np.arange(2500)
    first = motion(t, np.random.default_rng(seed)) + noise * rng.standard_normal(len(t))
    theirs = motion(offset + (1.0 + rate) * own, np.random.default_rng(seed)) + noise * rng.standard_normal(len(own))
    found = align(ga.Record(1e-3, command=first, velocity=first), {"velocity": theirs, "torque": theirs}, dt=2e-3)
    off = abs(found.offset - offset) < 4.0 * found.offset_std + 1e-4 and found.rate_seen == (rate != 0.0)
    return Result("right" if off else "wrong", f"rate seen: {found.rate_seen}", digest([f"{found.offset:.4f}"]))


def strangers(rng: np.random.Generator) -> Result:
    """Two logs of two motions: no offset is theirs."""
    first, second = (motion(1e-3 * np.arange(6000), np.random.default_rng(int(rng.integers(1 << 31)))) for _ in range(2))
    try:
        align(ga.Record(1e-3, command=first, velocity=first), {"velocity": second, "torque": second}, dt=1e-3)
    except ga.GaidentError:
        return Result("right", "refused", "")
    return Result("false alarm", "aligned", "")


def counter(rng: np.random.Generator, span: float, speed: float, noise: float) -> Result:
    """A position that wraps at `span`, which few know, or jumps back to its start once; speed: spans in a second."""
    w = np.repeat(rng.uniform(0.2, 1.0, 8) * speed * span, 250)
    x = 0.3 * span + np.cumsum(w) * 1e-3 + noise * span * rng.standard_normal(2000)
    found = Unwrapper()
    off = float(np.abs(found.push(np.mod(x, span)) - x).max())
    wraps = len(np.unique(np.floor(x / span))) > 1
    right = (found.wraps > 0) == wraps and (not wraps or off < 0.01 * span)
    return Result("right" if right else "missed" if wraps and not found.wraps else "wrong", f"{found.wraps} wraps", "")


def jumps(rng: np.random.Generator, integer: bool) -> Result:
    """A torque that overflowed its 16 bits, or one that is reversed: a jump, too."""
    x = np.cumsum(rng.integers(-40, 60, 2000)).astype(np.float64) + 20000.0
    x = (x + 32768.0) % 65536.0 - 32768.0 if integer else np.where(np.arange(2000) % 500 < 250, 30000.0, -30000.0) + x % 7.0
    found = overflow(x)
    truth = integer and bool(np.any(np.abs(np.diff(x)) > 40000.0))
    called = "right" if (found is not None) == truth else "missed" if truth else "false alarm"
    return Result(called, "overflow" if found else "none", "")


def unit(rng: np.random.Generator, name: str, noise: float) -> Result:
    """The unit of a velocity beside its position, and of a command beside a velocity in SI; which columns are a pair."""
    t = 1e-3 * np.arange(4000)
    w = motion(t, rng)
    position, seen = np.cumsum(w) * 1e-3, w / UNITS[name] * (1.0 + noise) + noise * np.std(w) * rng.standard_normal(len(w))
    follows = np.convolve(w, np.ones(60) / 60.0)[: len(w)]
    found = (unit_from_position(seen, position, 1e-3, False), unit_from_velocity(w / UNITS[name], follows, False))
    columns = position_and_velocity({"a": position, "b": seen, "c": rng.standard_normal(len(w))}, 1e-3)
    said = f"{found[0]}, {found[1]}, {columns}"
    wrong = any(u not in (name, None) for u in found) or columns not in (("a", "b"), None)
    return Result("wrong" if wrong else "missed" if None in (*found, columns) else "right", said, "")


def stamps(rng: np.random.Generator, jitter: float, digits: int, lost: bool, given: float | None = None) -> Result:
    """A log's stamps with a clock's jitter (share of a step), so many decimals, a lost sample, another dt given."""
    t = 1e-3 * (np.arange(1500) + jitter * rng.standard_normal(1500))
    t = np.delete(t, 700) if lost else t
    w = np.round(motion(t, rng), 4)
    rows = "\n".join(f"{a:.{digits}f},{b:g},{0.1 * b:g}" for a, b in zip(t, w, strict=True))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_text(f"t [s],w,M\n{rows}\n")
        even = [c.rises_evenly for c in listed(path).columns]
        columns = {"time": "t [s]", "velocity": "w", "torque": "M"}
        try:
            ga.read(path, columns=columns, dt=given)
        except ga.GaidentError as refusal:
            told = f"refused, {even}"
            expected = lost or digits < 4 or jitter > 0.002 or (given is not None and abs(given - 1e-3) > 1e-5)
            return Result("right" if expected else "false alarm", told, digest(type(refusal).__name__))
    wrong = lost or (given is not None and abs(given - 1e-3) > 1e-5)
    return Result("missed" if wrong else "right", f"read, {even}", "")


def grid(rng: np.random.Generator, step: float, pause: float) -> Result:
    """Uneven stamps of 1 ms on average, brought to another step; pause: of the logger [s]."""
    t = np.cumsum(rng.uniform(0.5e-3, 1.5e-3, 2000))
    t[1000:] += pause
    rows = "\n".join(f"{a:.7f},{b:.5f},{0.1 * b:.5f}" for a, b in zip(t, motion(t, rng), strict=True))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_text(f"t [s],w,M\n{rows}\n")
        try:
            ga.read(path, columns={"time": "t [s]", "velocity": "w", "torque": "M"}, resample=step)
        except ga.GaidentError:
            return Result("right" if pause > 5e-3 or not 1e-5 < step < 1.6e-3 else "false alarm", "refused", "")
    return Result("missed" if pause > 5e-3 or not 1e-5 < step < 1.6e-3 else "right", "read", "")


def pair(rng: np.random.Generator, samples: int, related: bool) -> Result:
    """Three columns whose names say nothing, one of them the derivative of another, or none; so many lines."""
    t = np.linspace(0.0, 1.0, samples)
    w = sum(rng.normal() * np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 6.0)) for f in rng.uniform(0.3, 2.0, 3))
    other = sum(rng.normal() * np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 6.0)) for f in rng.uniform(0.3, 2.0, 3))
    first = np.concatenate([[0.0], np.cumsum(0.5 * (w[1:] + w[:-1]))]) if related else np.cumsum(rng.standard_normal(samples))
    columns = {"col1": first, "col2": w, "col3": other}
    rows = "\n".join(",".join(f"{x:.6f}" for x in row) for row in np.column_stack([t, *columns.values()]))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_text(f"t [s],{','.join(columns)}\n{rows}\n")
        listing = listed(path)
    found = with_content(listing, guess_channels(listing), columns).channels
    taken = {channel: found[channel].name for channel in ("position", "velocity") if channel in found}
    truth = {"position": "col1", "velocity": "col2"} if related else {}
    return Result("right" if taken == truth else "missed" if not taken else "wrong" if related else "false alarm", str(taken), "")


MAKERS: dict[str, Callable[[np.random.Generator], Result]] = {
    **{f"clocks/{o:g} s/{r:g}/{n:g}": lambda g, o=o, r=r, n=n: clocks(g, o, r, n)
       for o, r, n in ((0.3, 0.0, 0.3), (-0.4, 2e-4, 0.3), (0.05, -3e-5, 1.0), (3.5, 0.0, 0.3), (0.2, 8e-4, 5.0))},
    "strangers": strangers,
    **{f"counter/{s:g}/{v:g}/{n:g}": lambda g, s=s, v=v, n=n: counter(g, s, v, n)
       for s in (360.0, 5000.0) for v, n in ((0.3, 0.0), (3.0, 0.0), (3.0, 1e-3), (60.0, 0.0), (200.0, 1e-3), (0.05, 0.0))},
    "overflow": lambda g: jumps(g, True),
    "reversed": lambda g: jumps(g, False),
    **{f"unit/{u}/{n:g}": lambda g, u=u, n=n: unit(g, u, n) for u in UNITS for n in (0.0, 0.01, 0.03)},
    **{f"stamps/{j:g}/{d}/{x:d}": lambda g, j=j, d=d, x=x: stamps(g, j, d, x)
       for j, d, x in ((0.0, 6, False), (0.001, 7, False), (0.003, 7, False), (0.01, 7, False), (0.0, 6, True), (0.0, 4, False),
                       (0.0, 3, False), (0.2, 3, False), (0.0, 3, True), (0.002, 6, True))},
    **{f"given/{dt:g}": lambda g, dt=dt: stamps(g, 0.0, 6, False, dt) for dt in (1.005e-3, 1.015e-3, 2e-3, 1.0)},
    **{f"grid/{s:g}/{p:g}": lambda g, s=s, p=p: grid(g, s, p)
       for s, p in ((1e-3, 0.0), (1.4e-3, 0.0), (2e-3, 0.0), (4e-3, 0.0), (2e-5, 0.0), (7e-6, 0.0), (1e-6, 0.0),
                    (1e-3, 3e-3), (1e-3, 7e-3), (1e-3, 0.05))},
    **{f"pair/{n}/{kind}": lambda g, n=n, kind=kind: pair(g, n, kind == "related")
       for n in (6, 8, 12, 15, 18, 25, 35, 60) for kind in ("related", "strangers")},
}  # fmt: skip
"""Name -> what draws such a log and says what came of it."""


def logs(count: int, seed: int) -> list[Case]:
    return [Case("logs", f"{name}/{seed}/{n}", name, n + 1000 * seed) for n in range(count) for name in MAKERS]


def read_log(case: Case) -> Result:
    return MAKERS[case.what](np.random.default_rng([case.number, len(case.what)]))
