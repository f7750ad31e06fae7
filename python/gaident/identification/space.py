"""Search space: where gain, poles and zeros are looked for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, fields
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.errors import SpaceError
from gaident.models.controller import PI
from gaident.models.pi_torque import pi_block

if TYPE_CHECKING:
    from gaident import _core

__all__ = ["SearchSpace", "derive_space"]

Range = tuple[float, float]


@dataclass(frozen=True)
class SearchSpace:
    """Search ranges; a pole or zero is -(real part) +- i (imaginary part).

    gain: range of K at p = 1, 1/J [rad/s^2 per N m], both ends positive.
    real: negated real parts, rad/s (negative lower end: unstable roots are allowed). imaginary: rad/s.
    p, q: ranges of the structural numbers, 0..7. bits: per number, 2..16.
    gain_scale: K counts in units of gain_scale^(p-1) at other p, rad/s; None: sqrt(real[1]*imaginary[1])/10, and 1 (the same
    range
    for every p, as in the paper) with Settings.paper().
    source: where the ranges come from, shown in the summary.

    Raises SpaceError naming the range and the remedy.
    """

    gain: Range = (1e3, 2e4)
    real: Range = (0.0, 60.0)
    imaginary: Range = (0.0, 250.0)
    p: tuple[int, int] = (0, 3)
    q: tuple[int, int] = (0, 3)
    bits: int = 10
    gain_scale: float | None = None
    source: str = field(default="given", compare=False)

    def __post_init__(self) -> None:
        for name in ("gain", "real", "imaginary", "p", "q"):
            value = getattr(self, name)
            if isinstance(value, str) or not isinstance(value, (Sequence, np.ndarray)) or len(value) != 2:
                raise SpaceError(f"{name} is {value!r}: give a pair (lowest, highest)")
            try:
                lo, hi = (float(v) for v in value)
            except (TypeError, ValueError):
                raise SpaceError(f"{name} is {value!r}: both ends must be numbers") from None
            if not (math.isfinite(lo) and math.isfinite(hi)):
                raise SpaceError(f"{name} is {value!r}: both ends must be finite")
            if name in ("p", "q"):
                if lo != int(lo) or hi != int(hi) or not 0 <= lo <= hi <= 7:
                    raise SpaceError(f"{name} is {value!r}: give whole numbers with 0 <= lowest <= highest <= 7")
                object.__setattr__(self, name, (int(lo), int(hi)))
                continue
            if not lo < hi:
                raise SpaceError(f"{name} is {value!r}: the lowest must be below the highest")
            object.__setattr__(self, name, (lo, hi))
        if self.gain[0] <= 0.0:
            raise SpaceError(
                f"gain is {self.gain!r}: both ends must be positive, the gain is searched on a logarithmic scale; "
                "if velocity falls when torque rises, reverse the sign of one of them"
            )
        if self.imaginary[0] < 0.0:
            raise SpaceError(f"imaginary is {self.imaginary!r}: give the positive half, pairs are conjugate by themselves")
        if isinstance(self.bits, bool) or not isinstance(self.bits, int) or not 2 <= self.bits <= 16:
            raise SpaceError(f"bits is {self.bits!r}: it must be a whole number from 2 to 16")
        if self.gain_scale is not None and not (isinstance(self.gain_scale, Real) and 0.0 < self.gain_scale < math.inf):
            raise SpaceError(f"gain_scale is {self.gain_scale!r}: give a frequency in rad/s, above 0, or None")

    @classmethod
    def from_mechanics(
        cls,
        inertia: Range,
        resonance_hz: Range,
        damping: Range | None = None,
        *,
        p: tuple[int, int] = (0, 3),
        q: tuple[int, int] = (0, 3),
        bits: int = 10,
    ) -> SearchSpace:
        """Ranges as an engineer knows them.

        inertia: total inertia at the motor shaft [kg m^2] (or mass [kg]); the motor's own may be down to a tenth of it.
        resonance_hz: lowest and highest frequency at which the mechanism may resonate, Hz; antiresonances are looked for
            from half the lowest on.
        damping: total viscous damping [N m s/rad]; None: up to where a pole is as fast as the highest resonance.
        """
        inertia = _pair("inertia", inertia, above_zero=True)
        resonance_hz = _pair("resonance_hz", resonance_hz, above_zero=True)
        damping = None if damping is None else _pair("damping", damping, above_zero=False)
        top = 2.0 * math.pi * resonance_hz[1]
        real = top if damping is None else max(damping[1] / inertia[0], 0.3 * top)
        return cls(
            gain=(1.0 / inertia[1], 10.0 / inertia[0]),
            real=(0.0, real),
            imaginary=(math.pi * resonance_hz[0], top),
            p=p,
            q=q,
            bits=bits,
            source="from mechanics",
        )

    def ranges(self, paper: bool = False) -> _core.SearchRanges:
        """The same for the core."""
        from gaident import _core

        scale = self.gain_scale
        if scale is None:
            scale = 1.0 if paper else 0.1 * math.sqrt(max(self.real[1], 1e-9) * self.imaginary[1])
        return _core.SearchRanges(
            gain=self.gain, real=self.real, imaginary=self.imaginary, p=self.p, q=self.q, bits=self.bits, gain_scale=scale
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> SearchSpace:
        """The inverse of to_dict. Raises SpaceError for unknown keys."""
        unknown = set(data) - {f.name for f in fields(cls)}
        if unknown:
            raise SpaceError(f"space holds unknown keys: {', '.join(sorted(unknown))}")
        return cls(**data)


def _pair(name: str, value: object, above_zero: bool) -> Range:
    """(lowest, highest) as floats, or SpaceError."""
    try:
        lo, hi = (float(v) for v in value)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        raise SpaceError(f"{name} is {value!r}: give a pair of numbers (lowest, highest)") from None
    if not ((lo > 0.0 or (lo == 0.0 and not above_zero)) and lo < hi < math.inf):
        least = "0 <" if above_zero else "0 <="
        raise SpaceError(f"{name} is {value!r}: give (lowest, highest) with {least} lowest < highest")
    return lo, hi


def derive_space(records: Sequence[Record], controller: PI | None) -> SearchSpace:
    """Search ranges from the data.

    Two estimates of K, the acceleration per torque, span its range: of the rigid drive, dw/dt = K u - A w, integrated from the
    record's start so that no derivative of a noisy signal is needed,

        w(t) = K int u dt - A int w dt + w(0),

    and of the motor alone, from the steps of the velocity, w(n+1) - w(n) = K u(n) Ts, which weighs the moments of high torque.
    u is the record's
    torque or, without one, what the controller makes of command and velocity. Searched is from thirty times less to a thousand
    times more: behind resonances the motor alone may be far lighter than the whole drive. Roots go up to where the sampling
    still shows them: real parts to 1/dt, imaginary parts to 0.8 of the Nyquist frequency. Raises SpaceError
    where nothing moves, and where command and velocity are in different units or of opposite sign.
    """
    _check_scales(records, controller, only_certain=True)
    gram, right = np.zeros((2, 2)), np.zeros(2)
    steps = energy = 0.0
    for rec in records:
        # Sums of products of x = (int u dt, -int w dt, w) about their means, a block at a time.
        products, sums = np.zeros((3, 3)), np.zeros(3)
        integrals, before = np.zeros(2), np.zeros(2)
        for first, u, w in _torque_blocks(rec, controller):
            x = np.empty((3, len(u)))
            for i, (signal, sign) in enumerate(((u, 1.0), (w, -1.0))):
                trapezia = 0.5 * rec.dt * sign * (signal + np.concatenate([before[i : i + 1], signal[:-1]]))
                if first == 0:
                    trapezia[0] = 0.0
                x[i] = integrals[i] + np.cumsum(trapezia)
            x[2] = w
            if first > 0:
                steps += float(w[0] - before[1]) * float(before[0]) * rec.dt
            steps += _dot(np.diff(w), u[:-1]) * rec.dt
            energy += _dot(u, u) * rec.dt**2
            products += [[_dot(a, b) for b in x] for a in x]
            sums += x.sum(axis=1)
            integrals, before = x[:2, -1].copy(), np.array([u[-1], w[-1]])
        centred = products - np.outer(sums, sums) / len(rec)
        gram += centred[:2, :2]
        right += centred[:2, 2]
    for what, still in (("torque", not energy > 0.0), ("velocity", all(np.ptp(r.velocity) == 0.0 for r in records))):
        if still:
            raise SpaceError(
                f"the {what} of the record is constant: nothing can be identified from it; use a record in which the "
                "drive moves, or give space=SearchSpace(...)"
            )
    rigid = float(np.linalg.solve(gram, right)[0]) if np.linalg.cond(gram) < 1e14 else 0.0
    found = [k for k in (rigid, steps / energy) if np.isfinite(k) and k > 0.0]
    if not found:
        _check_scales(records, controller, only_certain=False)
        if controller is not None and not any(rec.torque is not None for rec in records):
            # The torque is a replay, which a limit inside the controller spoils; its sign is the one at which the loop stands.
            found = [abs(k) for k in (rigid, steps / energy) if np.isfinite(k) and k != 0.0]
    if not found:
        raise SpaceError(
            "the velocity falls when the torque rises: reverse the sign of one of them (for example by a unit of -1), "
            "or give space=SearchSpace(gain=...)"
        )
    dt = min(rec.dt for rec in records)
    longest = max(rec.duration for rec in records)
    shown = " and ".join(f"{k:.4g}" for k in found)
    return SearchSpace(
        gain=(min(found) / 30.0, max(found) * 1000.0),
        real=(-10.0 / longest, 1.0 / dt),
        imaginary=(min(0.5 / longest, 0.1 / dt), 0.8 * math.pi / dt),
        p=(0, 3) if controller is not None and controller.loop == "continuous" else (1, 3),
        source=f"derived from the data: K about {shown}, sample time {1e3 * dt:.4g} ms",
    )


def _check_scales(records: Sequence[Record], controller: PI | None, only_certain: bool) -> None:
    """Raises SpaceError where command and velocity of a loop go together, but in another unit or against one another.

    r = factor w by least squares. A loop may lag far behind its command (a short record, no integral part), so that a factor
    above 3 is certain only where it is that of rpm; a velocity far above the command is no loop's.
    """
    if controller is None:
        return
    pairs = [(rec.command, rec.velocity) for rec in records if rec.command is not None]
    together = sum(_dot(r, w) for r, w in pairs)
    commands, velocities = sum(_dot(r, r) for r, _ in pairs), sum(_dot(w, w) for _, w in pairs)
    size = math.sqrt(commands * velocities)
    if together < -0.9 * size < 0.0:
        raise SpaceError(
            "the velocity runs against its command all along: reverse the sign of one of them (for example by a unit of -1)"
        )
    if not 0.0 < 0.9 * size < together:
        return
    factor = together / velocities
    rpm = next((name for name, rate in (("command", 9.549), ("velocity", 1 / 9.549)) if 0.8 < factor / rate < 1.25), None)
    if 1.0 / 3.0 <= factor <= 3.0 or (only_certain and rpm is None and factor > 3.0):
        return
    hint = "they are in different units: give units={'command': ...} or units={'velocity': ...}"
    if rpm:
        hint = f"the {rpm} seems to be in rpm, the other in rad/s: give units={{'{rpm}': 'rpm'}}"
    raise SpaceError(f"the command is {factor:.3g} times the velocity all along: {hint}")


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Sum of products, in one thread: a BLAS starts others for a long one, and their number shows in the last digits."""
    return float(np.einsum("i,i", a, b))


def torque_of(rec: Record, controller: PI | None) -> NDArray[np.float64]:
    """The record's torque or, where none was recorded, the controller's answer to command and velocity (limits included)."""
    if rec.torque is not None:
        return rec.torque
    return np.concatenate([u for _, u, _ in _torque_blocks(rec, controller)])


def _torque_blocks(
    rec: Record, controller: PI | None, length: int = 1 << 18
) -> Iterator[tuple[int, NDArray[np.float64], NDArray[np.float64]]]:
    """(first sample, torque, velocity) a block at a time: of a long record no copy is made."""
    integral = last = 0.0
    for first in range(0, len(rec), length):
        w = rec.velocity[first : first + length]
        if rec.torque is not None:
            yield first, rec.torque[first : first + length], w
            continue
        assert controller is not None and rec.command is not None  # checked on entry to identify()
        e = rec.command[first : first + length] - w
        torque, integral = pi_block(e, rec.dt, controller, last, integral)
        last = float(e[-1])
        yield first, torque, w
