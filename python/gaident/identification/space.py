"""The search space that records suggest."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.errors import SpaceError
from gaident.models.drive_torque import torque_blocks
from gaident.models.search_space import SearchSpace
from gaident.policy.table import POLICY

Vector = NDArray[np.float64]

__all__ = ["derive_space"]


def derive_space(records: Sequence[Record], controller: PI | None) -> SearchSpace:
    """Search ranges from the data.

    Two estimates of K, the acceleration per torque, span its range: of the rigid drive, dw/dt = K u - A w, integrated from the
    record's start so that no derivative of a noisy signal is needed,

        w(t) = K int u dt - A int w dt + w(0),

    and of the motor alone, from the steps of the velocity, w(n+1) - w(n) = K u(n) Ts, which weighs the moments of high torque.
    u is the record's torque or, without one, what the controller makes of command and velocity.
    Searched is from thirty times less to a thousand times more: behind resonances the motor alone may be far lighter than the
    whole drive.
    Roots go up to where the sampling still shows them: real parts to 1/dt, imaginary parts to 0.8 of the Nyquist frequency.
    Raises SpaceError where nothing moves, and where command and velocity are in different units or of opposite sign.
    """
    _check_scales(records, controller, only_certain=True)
    gram, right = np.zeros((2, 2)), np.zeros(2)
    steps = energy = 0.0
    for rec in records:
        # Sums of products of x = (int u dt, -int w dt, w) about their means, a block at a time.
        products, sums = np.zeros((3, 3)), np.zeros(3)
        integrals, before = np.zeros(2), np.zeros(2)
        for first, u, w in torque_blocks(rec, controller):
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
                f"the {what} of the record is constant: nothing can be identified from it; use a record in which the drive moves"
            )
    # no decision: rounding: what a double can invert
    rigid = float(np.linalg.solve(gram, right)[0]) if np.linalg.cond(gram) < 1e14 else 0.0
    found = [k for k in (rigid, steps / energy) if np.isfinite(k) and k > 0.0]
    if not found:
        _check_scales(records, controller, only_certain=False)
        if controller is not None and not any(rec.torque is not None for rec in records):
            # The torque is a replay, which a limit inside the controller spoils; its sign is the one at which the loop stands.
            found = [abs(k) for k in (rigid, steps / energy) if np.isfinite(k) and k != 0.0]
    if not found:
        found = _gain_with_angle(records, controller)
    if not found:
        raise SpaceError(
            "the velocity falls when the torque rises: reverse the sign of one of them (for example by a unit of -1)"
        )
    dt = min(rec.dt for rec in records)
    longest = max(rec.duration for rec in records)
    shown = " and ".join(f"{k:.4g}" for k in found)
    return SearchSpace(
        gain=(min(found) / 30.0, max(found) * 1000.0),
        real=(-10.0 / longest, 1.0 / dt),
        imaginary=(min(0.5 / longest, 0.1 / dt), 0.8 * math.pi / dt),  # no decision: a start: a range to search
        p=(0, 3) if controller is not None and controller.loop == "continuous" else (1, 3),
        source=f"derived from the data: K about {shown}, sample time {1e3 * dt:.4g} ms",
    )


def _gain_with_angle(records: Sequence[Record], controller: PI | None) -> list[float]:
    """[K] of an axis on a spring or under gravity, [] where the records show no such thing.

        w = K int u dt - a int w dt - c int theta dt + b_0 + b_1 t,                        K > 0 and c > 0
        w = K int u dt - a int w dt - c int sin(theta) dt - d int cos(theta) dt + b_0 + b_1 t,   K > 0
        the last one with - e int sign(w) dt,                                                     K > 0 and e > 0

    Below its resonance such an axis is further out where the torque is larger, and its velocity falls when the torque rises.
    A pendulum that swings far is on no spring: its gravity turns with the angle.
    Of one that is moved slowly dry friction takes more of the torque than inertia does.
    """
    of_spring = _regressed_with(records, controller, lambda angle, _: [angle])
    if of_spring[0] > 0.0 and of_spring[2] > 0.0:  # no decision: a formula: the places of K and c
        return [float(of_spring[0])]
    of_gravity = _regressed_with(records, controller, lambda angle, _: [np.sin(angle), np.cos(angle)])
    if of_gravity[0] > 0.0:
        return [float(of_gravity[0])]
    with_friction = _regressed_with(records, controller, lambda angle, w: [np.sin(angle), np.cos(angle), np.sign(w)])
    found = with_friction[0] > 0.0 and with_friction[4] > 0.0  # no decision: a formula: the places of K and e
    return [float(with_friction[0])] if found else []


def _regressed_with(
    records: Sequence[Record], controller: PI | None, columns: Callable[[Vector, Vector], Sequence[Vector]]
) -> NDArray[np.float64]:
    """(K, a, then the factors of what the torque depends on) of all records, each with b_0 and b_1 of its own."""
    gram: NDArray[np.float64] | float = 0.0
    right: NDArray[np.float64] | float = 0.0
    for rec in records:
        u = np.concatenate([part for _, part, _ in torque_blocks(rec, controller)])
        angle = np.cumsum(rec.velocity) * rec.dt if rec.position is None else rec.position
        moved = angle - angle[0]
        x = np.vstack(
            [np.cumsum(u) * rec.dt, -moved, *(-np.cumsum(c) * rec.dt for c in columns(angle, rec.velocity)), rec.velocity]
        )
        line = np.vstack([np.ones(len(u)), np.linspace(-1.0, 1.0, len(u))])
        line[0] /= math.sqrt(_dot(line[0], line[0]))
        line[1] /= math.sqrt(_dot(line[1], line[1]))
        for row in line:
            x -= np.array([_dot(one, row) for one in x])[:, None] * row
        products = np.array([[_dot(one, other) for other in x] for one in x])
        gram, right = gram + products[:-1, :-1], right + products[:-1, -1]
    sizes = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    return np.asarray(np.linalg.lstsq(gram / np.outer(sizes, sizes), right / sizes, rcond=1e-12)[0] / sizes)


def _check_scales(records: Sequence[Record], controller: PI | None, only_certain: bool) -> None:
    """Raises SpaceError where command and velocity of a loop go together, but in another unit or against one another.

    r = factor w by least squares.
    A loop may lag far behind its command (a short record, no integral part), so that a factor above 3 is certain only where it is
    that of rpm; a velocity far above the command is no loop's.
    """
    if controller is None:
        return
    pairs = [(rec.command, rec.velocity) for rec in records if rec.command is not None]
    together = sum(_dot(r, w) for r, w in pairs)
    commands, velocities = sum(_dot(r, r) for r, _ in pairs), sum(_dot(w, w) for _, w in pairs)
    size = math.sqrt(commands * velocities)
    if together < -POLICY.one_course * size < 0.0:
        raise SpaceError(
            "the velocity runs against its command all along: reverse the sign of one of them (for example by a unit of -1)"
        )
    if not 0.0 < POLICY.one_course * size < together:
        return
    factor = together / velocities
    near, most = POLICY.near_rpm, POLICY.same_unit
    rpm = next((name for name, rate in (("command", 9.549), ("velocity", 1 / 9.549)) if 1 / near < factor / rate < near), None)
    if 1.0 / most <= factor <= most or (only_certain and rpm is None and factor > most):
        return
    hint = f"they are in different units: give {arg('units', '...', 'command')} or {arg('units', '...', 'velocity')}"
    if rpm:
        hint = f"the {rpm} seems to be in rpm, the other in rad/s: give {arg('units', repr('rpm'), rpm)}"
    raise SpaceError(f"the command is {factor:.3g} times the velocity all along: {hint}")


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Sum of products, in one thread: a BLAS starts others for a long one, and their number shows in the last digits."""
    return float(np.einsum("i,i", a, b))
