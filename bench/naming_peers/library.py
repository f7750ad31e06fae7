"""The torques of the library's effects over a measured motion, for methods that regress the logged torque and simulate nothing.

    one mass     u = J a + B w + sum of c_i f_i(motion)
    two masses   u = H (b0 + b1 s + b2 s^2 + b3 s^3) w + H (a0 + a1 s) u + sum of c_i f_i(motion)

H = 1/(s^2 + 2 z wa s + wa^2) is the antiresonance of the linear model; the part with u is what H may be wrong by, to first order.
Every column stands behind the same low pass as the torque.
Of an effect with a number inside (an order, a speed, a limit) the column of a grid that explains the most is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from case import Case
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import bilinear, lfilter

import gaident as ga
from gaident.estimation.regression.motion import ORDER, cutoff_of, low_passed, motion_of
from gaident.models.held_torque import torque_at_lines

Vector = NDArray[np.float64]
Atoms = dict[str, Vector]
Own = Callable[[dict[str, float]], dict[str, float]]

AVERAGED = 9
"""Samples of the moving average of the plain derivatives."""
SPEEDS = (1.0, 1.5, 2.0, 3.0, 4.0)  # rad/s, of the Stribeck curve
BRISTLES = (15.0, 30.0, 60.0, 120.0, 240.0)  # 1/rad, stiffness over level
RISEN = 1.75  # static over kinetic friction of the LuGre column
TIMES = (0.1e-3, 0.25e-3, 0.5e-3, 1e-3, 1.5e-3, 2e-3, 3e-3)  # s, of delays and lags
SHARES = np.linspace(0.3, 0.98, 18)  # of the largest torque, where a limit may be
WIDTHS = np.geomspace(0.008, 0.08, 12)  # N m, of a dead band
SLOW_TURN = 0.3  # of the sampling frequency: a wave of the angle is seen below it
HUMS = np.arange(5.0, 60.0, 0.5)  # Hz
SAME = 0.02  # rad/s, where a sign is a straight line
NOTHING = 1e-18  # of a state is left: earlier samples no longer count


@dataclass(frozen=True)
class Motion:
    """Arrays (n,) behind one low pass: velocity [rad/s], its derivatives, angle [rad], torque [N m]; `use`: rows that count."""

    dt: float
    w: Vector
    a: Vector
    theta: Vector
    u: Vector
    use: NDArray[np.bool_]
    low: Callable[[Vector], Vector]
    cutoff: float  # Hz
    lines: Vector  # the torque at the lines of the log, before the low pass

    def slope(self, x: Vector) -> Vector:
        return np.gradient(x, self.dt)


@dataclass(frozen=True)
class Candidate:
    """One effect: its columns by name, which other effects may share, and its parameters from their coefficients."""

    effect: str
    atoms: Atoms
    own: Own


def filtered(rec: ga.Record) -> Motion:
    """Behind gaident's zero-phase low pass, at the cutoff that the noise allows."""
    cutoff = cutoff_of(rec, ORDER)
    m = motion_of(rec, cutoff, ORDER)
    assert m.torque is not None
    use = ~m.still & _inside(len(rec), round(1.0 / (cutoff * rec.dt)))
    return Motion(rec.dt, m.velocity, m.acceleration, m.position, m.torque, use,
                  lambda x: low_passed(x, rec.dt, cutoff, ORDER), cutoff, torque_at_lines(rec))  # fmt: skip


def differences(rec: ga.Record) -> Motion:
    """Behind a moving average of nine samples, with central differences."""

    def low(x: Vector) -> Vector:
        return np.asarray(uniform_filter1d(x, AVERAGED, mode="nearest"))

    w = low(rec.velocity)
    theta = np.concatenate([[0.0], np.cumsum(0.5 * rec.dt * (w[1:] + w[:-1]))])
    use = (np.abs(w) > 0.005 * np.abs(w).max()) & _inside(len(rec), 2 * AVERAGED)
    u = 0.5 * (rec.torque + np.concatenate([rec.torque[:1], rec.torque[:-1]]))  # held between the lines
    return Motion(rec.dt, w, np.gradient(w, rec.dt), theta, low(u), use, low, 0.44 / (AVERAGED * rec.dt), u)


def _inside(n: int, edge: int) -> NDArray[np.bool_]:
    edge = min(edge, n // 4)
    return (np.arange(n) >= edge) & (np.arange(n) < n - edge)


def two_masses(case: Case) -> ga.TwoMass | None:
    """The mechanics of the linear model, where they are two masses."""
    found = case.identified.mechanics
    return found if isinstance(found, ga.TwoMass) else None


def base(case: Case, m: Motion) -> Vector:
    """Columns of the linear model, (n, 2) or (n, 6)."""
    zero = next((z for z in case.identified.model.zeros if z.imag > 0.0), None)
    if zero is None:
        return np.column_stack([m.a, m.w])
    by_antiresonance = bilinear([abs(zero) ** 2], [1.0, -2.0 * zero.real, abs(zero) ** 2], 1.0 / m.dt)
    w, u = (m.low(lfilter(*by_antiresonance, x)) for x in (case.record.velocity, m.lines))
    columns = [w]
    for _ in range(3):
        columns.append(m.slope(columns[-1]))
    return np.column_stack([*columns, u, m.slope(u)])


class Library:
    """The candidates over one motion; rows that do not count are left out."""

    def __init__(self, case: Case, m: Motion) -> None:
        self.case, self.m = case, m
        self.rows = np.flatnonzero(m.use)
        B = base(case, m)[self.rows]
        self.base = B / np.sqrt(np.mean(B**2, axis=0))
        self.inertia = _inertia(case)
        self.basis = np.linalg.qr(self.base)[0]
        self.u = m.u[self.rows]
        self.rest = self.beyond(self.u)
        self.candidates = [self._best(variants) for variants in self._effects() if variants]

    def beyond(self, X: Vector) -> Vector:
        """What the linear model cannot explain of columns over the rows that count."""
        return X - self.basis @ (self.basis.T @ X)

    def matrix(self, atoms: Atoms) -> Vector:
        return np.column_stack(list(atoms.values()))

    def left(self, X: Vector, rows: Any = slice(None)) -> float:
        """Sum of squares that columns beside the linear model leave of the torque."""
        whole = np.column_stack([self.base, X])[rows]
        solved = np.linalg.lstsq(whole, self.u[rows], rcond=None)[0]
        return float(np.sum((self.u[rows] - whole @ solved) ** 2))

    def _best(self, variants: list[Candidate]) -> Candidate:
        if len(variants) == 1:
            return variants[0]
        gains = []
        for v in variants:
            Q = np.linalg.qr(self.beyond(self.matrix(v.atoms)))[0]
            gains.append(float(np.sum((Q.T @ self.rest) ** 2)))
        return variants[int(np.argmax(gains))]

    def _made(self, effect: str, atoms: Atoms, own: Own) -> Candidate:
        return Candidate(effect, {name: self.m.low(x)[self.rows] for name, x in atoms.items()}, own)

    def _effects(self) -> Iterator[list[Candidate]]:
        """The variants of each effect."""
        yield from self._friction()
        yield from self._waves()
        yield from self._actuator()
        yield from self._coupling()

    def _friction(self) -> Iterator[list[Candidate]]:
        m, made = self.m, self._made
        w, t = m.w, np.arange(len(m.w)) * m.dt
        s, one = np.tanh(w / SAME), np.ones_like(w)
        yield [made("coulomb_friction", {"sgn": s}, lambda c: {"torque": c["sgn"]})]
        yield [made("stribeck_friction", {"sgn": s, "falling": s * np.exp(-((w / v) ** 2))}, lambda c, v=v: {
            "torque": c["sgn"], "static_torque": c["sgn"] + c["falling"], "stribeck_velocity": v}) for v in SPEEDS]  # fmt: skip
        yield [made("asymmetric_friction", {"sgn": s, "one": one, "abs": np.abs(w)}, lambda c: {
            "torque_positive": c["sgn"] + c["one"], "torque_negative": c["sgn"] - c["one"],
            "viscous_positive": max(2.0 * c["abs"], 0.0), "viscous_negative": max(-2.0 * c["abs"], 0.0)})]  # fmt: skip
        z = bristle(w, m.dt, BRISTLES, 1.0, 1.0)
        yield [made("presliding_friction", {"dahl": x}, lambda c, r=r: {"torque": c["dahl"], "stiffness": r * c["dahl"]})
               for r, x in zip(BRISTLES, z, strict=True)]  # fmt: skip
        for_lugre = [(v, r, x) for v in SPEEDS[::2] for r, x in zip(BRISTLES, bristle(w, m.dt, BRISTLES, RISEN, v), strict=True)]
        yield [made("lugre_friction", {"lugre": x}, lambda c, v=v, r=r: {
            "torque": c["lugre"], "static_torque": RISEN * c["lugre"], "stribeck_velocity": v, "stiffness": r * c["lugre"]})
               for v, r, x in for_lugre]  # fmt: skip
        yield [made("quadratic_drag", {"square": w * np.abs(w)}, lambda c: {"coefficient": c["square"]})]
        yield [made("square_root_drag", {"root": np.sign(w) * np.sqrt(np.abs(w))}, lambda c: {"coefficient": c["root"]})]
        yield [made("load_torque", {"one": one}, lambda c: {"torque": c["one"]})]
        yield [made("friction_drift", {"sgn": s, "later": s * t}, lambda c: {
            "torque": c["sgn"], "rate": c["later"] / (c["sgn"] or 1.0)})]  # fmt: skip
        yield [made("position_friction", {"sgn": s, **pair("uneven", n * m.theta, s)}, lambda c, n=n: {
            "torque": c["sgn"], "amplitude": size(c, "uneven") / (c["sgn"] or 1.0), "order": n})
               for n in (1.0, 2.0, 3.0)]  # fmt: skip

    def _waves(self) -> Iterator[list[Candidate]]:
        m, made = self.m, self._made
        orders = [n for n in range(1, 25) if n * np.median(np.abs(m.w)) * m.dt < 2.0 * np.pi * SLOW_TURN]
        yield [made("unbalance", pair("turn", m.theta), lambda c: {"amplitude": size(c, "turn")})]
        yield [made("cogging", pair("cog", n * m.theta), lambda c, n=n: {"amplitude": size(c, "cog"), "order": float(n)})
               for n in orders if n > 1]  # fmt: skip
        t = np.arange(len(m.w)) * m.dt
        yield [made("torque_hum", pair("hum", 2.0 * np.pi * f * t), lambda c, f=f: {"amplitude": size(c, "hum"), "frequency": f})
               for f in HUMS]  # fmt: skip
        yield [made("velocity_ripple", {k: m.slope(x) for k, x in pair("ripple", n * m.theta, m.w).items()}, lambda c, n=n: {
            "amplitude": size(c, "ripple") / self.inertia, "order": float(n)}) for n in orders[:6]]  # fmt: skip
        yield [made("position_inertia", turning(n, m), lambda c, n=n: {
            "amplitude": size(c, "turning") / self.inertia, "order": float(n)}) for n in (1, 2, 3)]  # fmt: skip

    def _actuator(self) -> Iterator[list[Candidate]]:
        u, dt, made = self.m.lines, self.m.dt, self._made
        top, n = float(np.abs(u).max()), np.arange(len(u))
        yield [made("torque_saturation", {"beyond": u - np.clip(u, -x, x)}, lambda c, x=x: {"limit": float(x)})
               for x in SHARES * top]  # fmt: skip
        yield [made("torque_dead_band", {"lost": np.clip(u, -x, x)}, lambda c, x=x: {"width": float(x)}) for x in WIDTHS]
        yield [made("transport_delay", {"late": u - np.interp(n - d / dt, n, u)}, lambda c, d=d: {"delay": d * c["late"]})
               for d in TIMES]  # fmt: skip
        yield [made("torque_lag", {"lag": u - lagged(u, dt, d)}, lambda c, d=d: {"time_constant": d * c["lag"]}) for d in TIMES]

    def _coupling(self) -> Iterator[list[Candidate]]:
        """What the twist of the shaft adds to the motion: its second derivative, by the shaft's torque."""
        two, m = two_masses(self.case), self.m
        if two is None:
            return
        T = m.u - two.JM * m.a - two.DM * m.w
        T = T / np.sqrt(np.mean(T**2))

        def swung(name: str, x: Vector) -> Atoms:
            return {name: m.slope(m.slope(m.low(x)))}

        yield [self._made("backlash", swung("gap", np.tanh(T / 0.05)), lambda c: {})]
        yield [self._made("hardening_stiffness", swung("cube", T**3), lambda c: {})]
        states = bristle(np.gradient(T, m.dt), m.dt, (1.0, 4.0), 1.0, 1.0)
        yield [self._made("hysteretic_coupling", swung("loop", z), lambda c: {}) for z in states]


def _inertia(case: Case) -> float:
    found = case.identified.mechanics
    if isinstance(found, ga.TwoMass):
        return found.JM + found.JL
    return 1.0 / abs(case.identified.model.gain)


def pair(name: str, angle: Vector, by: Vector | float = 1.0) -> Atoms:
    """The two components of a wave."""
    return {f"{name} sin": by * np.sin(angle), f"{name} cos": by * np.cos(angle)}


def size(c: dict[str, float], name: str) -> float:
    """The amplitude of a wave from its two components."""
    return float(np.hypot(c[f"{name} sin"], c[f"{name} cos"]))


def turning(n: int, m: Motion) -> Atoms:
    """An inertia that changes with the angle: J'(theta) enters with half the squared velocity."""
    s, c = np.sin(n * m.theta), np.cos(n * m.theta)
    half = 0.5 * n * m.w**2
    return {"turning sin": s * m.a + half * c, "turning cos": c * m.a - half * s}


def lagged(u: Vector, dt: float, time: float) -> Vector:
    """u behind a first-order lag, held within a sample."""
    a = float(np.exp(-dt / time))
    return np.asarray(lfilter([0.0, 1.0 - a], [1.0, -a], u))


def bristle(w: Vector, dt: float, rates: tuple[float, ...], risen: float, speed: float) -> Vector:
    """Torque of a bristle over the level of sliding friction, a row for each stiffness over level [1/rad], (len(rates), n).

    dz/dt = r (w - |w| z/g), g = 1 + (risen - 1) exp(-(w/speed)^2), exact for a velocity that is held within a sample.
    """
    g = 1.0 + (risen - 1.0) * np.exp(-((w / speed) ** 2))
    keep = np.exp(-np.outer(rates, np.abs(w) / g) * dt)
    return summed(keep, (1.0 - keep) * np.sign(w) * g)


def summed(keep: Vector, more: Vector) -> Vector:
    """z(k) = keep(k) z(k-1) + more(k) from rest along the last axis, keep in 0..1, arrays (..., n): by doubled strides."""
    keep, z, stride = keep.copy(), more.copy(), 1
    while stride < z.shape[-1] and keep[..., stride:].max() > NOTHING:
        z[..., stride:] += keep[..., stride:] * z[..., :-stride]
        keep[..., stride:] *= keep[..., :-stride]
        stride *= 2
    return z
