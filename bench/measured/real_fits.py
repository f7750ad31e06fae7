"""What a careful engineer fits to a measured record: a rigid axis by output error, and black boxes. No code of the library.

    J dw/dt = u - B w - C sign(w) - T - As sin(theta) - Ac cos(theta)

is simulated exactly piece by piece (rigid_axis.cpp), driven by the logged torque, from the velocity and angle that the record
starts with. The parameters minimise the plain velocity error of that free run (scipy.optimize.least_squares, several starts).
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import compiled
import gaident as ga

Vector = NDArray[np.float64]

SOURCE = Path(__file__).with_name("rigid_axis.cpp")
SUBSTEPS = 4
START = 10
SIXTH_OF_A_TURN = np.pi / 3.0
TEN_TURNS = 20.0 * np.pi
BLOCKS = 20  # each a few oscillations of the slowest error that these records show
BAND = 0.1  # of the sample rate: the band in which torques are compared


@dataclass(frozen=True)
class RigidAxis:
    """Which of J, B+, B-, C+, C-, T, As, Ac a variant has, as columns of a matrix that spreads its parameters."""

    names: tuple[str, ...]
    spread: tuple[tuple[int, ...], ...]  # of each parameter, the places in the eight numbers

    def eight(self, x: Vector) -> Vector:
        values = np.zeros(8)
        for value, places in zip(x, self.spread, strict=True):
            values[list(places)] = value
        return values


J, BP, BN, CP, CN, T, AS, AC = range(8)
PLAIN = RigidAxis(("J", "B", "C", "T"), ((J,), (BP, BN), (CP, CN), (T,)))
DIRECTED = RigidAxis(("J", "B+", "B-", "C+", "C-"), ((J,), (BP,), (BN,), (CP,), (CN,)))


def with_gravity(axis: RigidAxis) -> RigidAxis:
    return RigidAxis((*axis.names, "As", "Ac"), (*axis.spread, (AS,), (AC,)))


def variants(records: Sequence[ga.Record], axis: str) -> dict[str, RigidAxis]:
    """The models that are fitted; gravity where a rotary axis travels a sixth of a turn to ten turns."""
    found = {"rigid": PLAIN, "rigid by direction": DIRECTED}
    travel = max(float(np.ptp(angle_of(r))) for r in records)
    if axis == "rotary" and SIXTH_OF_A_TURN <= travel <= TEN_TURNS:
        found |= {"rigid, gravity": with_gravity(PLAIN), "rigid by direction, gravity": with_gravity(DIRECTED)}
    return found


@lru_cache(maxsize=1)
def _function() -> Callable[..., None]:
    function = compiled.library(SOURCE).rigid_axis_run
    pointer = np.ctypeslib.ndpointer(dtype=np.float64, flags="C")
    function.argtypes = [pointer, pointer, pointer, ctypes.c_void_p, ctypes.c_int64, ctypes.c_double, ctypes.c_int, pointer]
    function.restype = None
    return function  # type: ignore[return-value]


def simulated(eight: Vector, rec: ga.Record) -> Vector:
    """The velocity of a rigid axis with the eight numbers J, B+, B-, C+, C-, T, As, Ac under the record's torque.

    Gravity acts at the logged angle where there is one, as in the library's models.
    """
    velocity = np.empty(len(rec))
    start = np.array([start_velocity(rec), angle_of(rec)[0]])
    logged = None if rec.position is None else rec.position.ctypes.data
    _function()(np.ascontiguousarray(eight), start, rec.torque, logged, len(rec), rec.dt, SUBSTEPS, velocity)
    return velocity


def start_velocity(rec: ga.Record) -> float:
    """Of a straight line through the first ten samples, at the first."""
    return float(np.polyfit(np.arange(START), rec.velocity[:START], 1)[1])


def angle_of(rec: ga.Record) -> Vector:
    """The logged angle, else the integrated velocity."""
    if rec.position is not None:
        return rec.position
    return np.concatenate([[0.0], np.cumsum(0.5 * rec.dt * (rec.velocity[1:] + rec.velocity[:-1]))])


def rmse(records: Sequence[ga.Record], model: Callable[[ga.Record], Vector]) -> float:
    """Of the velocity over all records; inf where a run diverges."""
    squares = sum(float(np.sum((r.velocity - model(r)) ** 2)) for r in records)
    return float(np.sqrt(squares / sum(map(len, records)))) if np.isfinite(squares) else float("inf")


def blocks(records: Sequence[ga.Record], model: Callable[[ga.Record], Vector]) -> list[float]:
    """Mean squared velocity error of each of `BLOCKS` equal parts of all records in a row; [] where a run diverges."""
    squares = np.concatenate([(r.velocity - model(r)) ** 2 for r in records])
    return [float(np.mean(part)) for part in np.array_split(squares, BLOCKS)] if np.all(np.isfinite(squares)) else []


def output_error(records: Sequence[ga.Record], axis: RigidAxis) -> Vector:
    """The eight numbers with the least velocity error of the free run, the best of several starts."""
    base = _first_guess(records, axis)
    starts = [base, base.copy(), base.copy(), base.copy()]
    starts[1][0] *= 0.5
    starts[2][0] *= 2.0
    starts[3][1:] *= 0.3
    kinds = [places[0] for places in axis.spread]
    positive = np.array([place <= CN for place in kinds])
    scale = np.array([_scales(records)[place] for place in kinds])
    lower = np.where(positive, 0.0, -np.inf)
    lower[0] = 1e-3 * scale[0]

    def errors(x: Vector) -> Vector:
        eight = axis.eight(x * scale)
        left = np.concatenate([r.velocity - simulated(eight, r) for r in records])
        return np.asarray(np.nan_to_num(left, nan=1e6, posinf=1e6, neginf=-1e6))

    best = None
    for start in starts:
        x0 = np.clip(start / scale, lower / scale + 1e-9, np.inf)
        fit = least_squares(errors, x0, bounds=(lower / scale, np.inf), x_scale="jac", diff_step=1e-6, max_nfev=60)
        if best is None or fit.cost < best.cost:
            best = fit
    assert best is not None
    return axis.eight(best.x * scale)


def _scales(records: Sequence[ga.Record]) -> Vector:
    """Typical sizes of the eight numbers."""
    torque = float(np.sqrt(np.mean(np.concatenate([r.torque for r in records]) ** 2)))
    speed = float(np.sqrt(np.mean(np.concatenate([r.velocity for r in records]) ** 2)))
    change = float(np.sqrt(np.mean(np.concatenate([smooth(r, np.gradient(r.velocity, r.dt)) for r in records]) ** 2)))
    return np.array([torque / change, *[torque / speed] * 2, *[torque] * 5])


def _first_guess(records: Sequence[ga.Record], axis: RigidAxis) -> Vector:
    """Least squares of the torque on the motion, both smoothed, with what may not be negative set to a small value."""
    columns = np.vstack([_columns(r, axis) for r in records])
    torque = np.concatenate([smooth(r, r.torque) for r in records])
    x = np.linalg.lstsq(columns, torque, rcond=None)[0]
    scale = np.array([_scales(records)[places[0]] for places in axis.spread])
    positive = np.array([places[0] <= CN for places in axis.spread])
    return np.where(positive, np.maximum(x, 1e-2 * scale), x)


def _columns(rec: ga.Record, axis: RigidAxis) -> Vector:
    w, theta = smooth(rec, rec.velocity), angle_of(rec)
    one, forward, backward = np.ones_like(w), 1.0 * (w > 0.0), 1.0 * (w < 0.0)
    friction = [w * forward, w * backward, forward, -backward]
    eight = np.column_stack([np.gradient(w, rec.dt), *friction, one, np.sin(theta), np.cos(theta)])
    return np.column_stack([eight[:, list(places)].sum(axis=1) for places in axis.spread])


def smooth(rec: ga.Record, x: Vector) -> Vector:
    """x in the band in which torques are compared: order 4, forward and backward."""
    from scipy.signal import butter, sosfiltfilt

    return np.asarray(sosfiltfilt(butter(4, 2.0 * BAND, output="sos"), x))


def force_error(records: Sequence[ga.Record], model: ga.Model | Callable[[ga.Record], Vector]) -> float:
    """|u - u_model|/|u| in the band, over the samples that move; nan where the model cannot be led along a motion."""
    try:
        return ga.force_error(model, records, cutoff_hz=BAND / records[0].dt).percent / 100.0
    except ga.GaidentError:
        return float("nan")


def rigid_torque(eight: Vector, rec: ga.Record) -> Vector:
    """The torque that a rigid axis needs for the record's motion."""
    axis = RigidAxis(tuple("abcdefgh"), tuple((i,) for i in range(8)))
    return np.asarray(_columns(rec, axis) @ eight)


def arx(records: Sequence[ga.Record]) -> tuple[Vector, int]:
    """(theta, order): w(k) = sum a_i w(k-i) + sum b_i u(k-i) + c, order 1 to 4 by BIC of the one-step error."""
    best: tuple[float, Vector, int] | None = None
    for order in range(1, 5):
        X, y = zip(*(_lagged(r, order) for r in records), strict=True)
        A, b = np.vstack(X), np.concatenate(y)
        theta = np.linalg.lstsq(A, b, rcond=None)[0]
        score = len(b) * np.log(max(float(np.mean((b - A @ theta) ** 2)), 1e-300)) + len(theta) * np.log(len(b))
        if best is None or score < best[0]:
            best = (score, theta, order)
    assert best is not None
    return best[1], best[2]


def _lagged(rec: ga.Record, order: int) -> tuple[Vector, Vector]:
    n = len(rec)
    past = [values[order - i : n - i] for values in (rec.velocity, rec.torque) for i in range(1, order + 1)]
    return np.column_stack([*past, np.ones(n - order)]), rec.velocity[order:]


def arx_simulated(theta: Vector, order: int, rec: ga.Record) -> Vector:
    """The free run of an ARX model from the record's first samples."""
    from scipy.signal import lfilter, lfiltic

    a = np.concatenate([[1.0], -theta[:order]])
    b = np.concatenate([[0.0], theta[order : 2 * order]])
    forced = lfilter(b, [1.0], rec.torque) + theta[-1]
    past = lfiltic([1.0], a, rec.velocity[order - 1 :: -1] if order > 1 else rec.velocity[:1])
    with np.errstate(over="ignore", invalid="ignore"):
        rest = lfilter([1.0], a, forced[order:], zi=past)[0]
    return np.concatenate([rec.velocity[:order], rest])
