"""What a small effect makes of the error, as columns that a linear fit can weigh: a pair for each order or frequency.

A torque a cos(psi) + b sin(psi), psi = n theta or omega t, enters the error linearly: two columns for each n or omega, without a
grid of sizes and phases. So does a resonance in series that changes little, with its two coefficients.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.axis import TURN
from gaident.control.filtering import filtered
from gaident.diagnosis.selection.mechanisms import swings_at
from gaident.diagnosis.selection.screening.spectrum import in_phase, lines
from gaident.estimation.dataset import DataSet
from gaident.estimation.load_end import LoadEnd
from gaident.estimation.objective import Hypothesis, Objective
from gaident.estimation.term import Term
from gaident.policy.table import POLICY

__all__ = ["DAMPING", "harmonic_columns", "resonance_columns", "tone_columns"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

DAMPING = 0.05  # no decision: a start


def harmonic_columns(
    objective: Objective, hypothesis: Hypothesis, x: Vector, term: Term, error: Vector, taken: Vector | tuple[float, ...] = ()
) -> tuple[Vector, Matrix]:
    """(orders, columns): decrease of the raw error per unit of the two components, a pair of rows per order.

    taken: orders that the effect has already, of which it has no second wave.
    """
    end = None
    if term.at_load or (term.harmonic == "inertia" and hypothesis.parameters.masses == 2):  # no decision: of two masses
        if not swings_at(hypothesis.parameters, x):
            return np.zeros(0), np.zeros((0, len(error)))
        end = LoadEnd.of(hypothesis.parameters, x, objective.data)
    angle = objective.data.angle if end is None else end.angle(objective.data.angle)
    first, last = term.orders
    per_period = TURN / (objective.data.period or TURN)  # 1 but on a linear axis, whose orders count in its pitch
    orders = np.arange(float(first if per_period == 1.0 else 1), last + 1.0) * per_period
    # An order is seen where its period passes a few times, slowly enough for the sampling at the usual speed.
    # Motion there and back counts twice.
    # Of the first order most of a period must be covered.
    # Of a higher one two periods must be: over part of a turn a curve of any kind is a wave of one order or another.
    # A single order once per turn is gravity, which a sixth of a turn shows.
    turned, path = float(np.ptp(angle)), float(np.abs(np.diff(angle)).sum())
    per_sample = float(np.median(np.abs(objective.measured)) + 1e-12) * objective.data.dt
    travelled = np.where(orders > per_period, POLICY.seen_periods, POLICY.seen_turn) * TURN
    seen = (orders * turned > travelled) & (orders * path > POLICY.seen_path * TURN)
    if last == 1:
        seen |= turned > POLICY.gravity_turn * TURN
    orders = orders[seen & (orders * per_sample < POLICY.seen_band * np.pi)]
    # A change of the inertia beside another wave of its order is what the simulation of that one misses.
    beside = [t for t in hypothesis.parameters.terms if t.chooses_order and "inertia" in (t.harmonic, term.harmonic)]
    gone = [t.orders_in(x[hypothesis.parameters.slot(t.name)]) for t in beside]
    orders = orders[~np.isin(orders, np.concatenate([taken, *gone]))]
    if len(orders) == 0:
        return orders, np.zeros((0, len(error)))
    waves = _harmonics(per_period * angle, np.rint(orders / per_period))
    w = objective.measured - error
    if term.turns_with_the_shaft:
        parts = [-waves.imag, -waves.real]
        there = w if end is None else end.carried(w[None, :])[0]
        if term.harmonic == "friction":
            way = np.sign(there)
            parts = [-way * waves.real, way * waves.imag]
        if term.harmonic == "inertia":
            # Of J (1 + a cos(psi)): -J a (cos(psi) dw/dt - n/2 sin(psi) w^2), psi = n theta + phase
            inertia = 1.0 / hypothesis.parameters.base_values(x[None, :])[0][0] if end is None else end.inertia
            slope, bend = _slope(there, objective.data), 0.5 * orders[:, None] * there**2
            parts = [
                -inertia * (waves.real * slope - bend * waves.imag),
                inertia * (waves.imag * slope + bend * waves.real),
            ]
        pairs = np.stack(parts, axis=1).reshape(-1, len(angle))
        pairs = pairs if end is None else end.carried(pairs)
        return orders, hypothesis.predictor.torque_response(hypothesis.parameters, x, pairs)
    w = w * orders[:, None]
    return orders, np.stack([w * waves.real, -w * waves.imag], axis=1).reshape(-1, len(angle))


def tone_columns(objective: Objective, hypothesis: Hypothesis, x: Vector, term: Term, error: Vector) -> tuple[Vector, Matrix]:
    """(frequencies [Hz], columns) of the highest peaks of the error's spectrum, as `harmonic_columns` has them for orders."""
    end = LoadEnd.of(hypothesis.parameters, x, objective.data) if term.at_load else None
    found, pairs = [], []
    data, at = objective.data, objective.data.time / objective.data.dt
    for radians, rows in lines(error, data.lengths):
        if radians < POLICY.seen_band * np.pi:
            if data.places:  # windows of a record have one phase
                radians = in_phase(error, data.lengths, at, radians)
                rows = np.array([np.cos(radians * at), np.sin(radians * at)])
            found.append(radians / (2.0 * np.pi * data.dt))
            pairs += [rows[1::2].sum(axis=0), rows[0::2].sum(axis=0)]
    if not found:
        return np.zeros(0), np.zeros((0, len(error)))
    torques = np.array(pairs) if end is None else end.carried(np.array(pairs))
    return np.array(found), hypothesis.predictor.torque_response(hypothesis.parameters, x, torques)


def resonance_columns(data: DataSet, poles: Vector, velocity: Vector) -> Matrix:
    """Decrease of the raw error per unit of c1 and c0 of a resonance at each frequency [rad/s]; pairs of rows.

    Bilinear transformation, exact at wp: s = k (1 - z^-1)/(1 + z^-1), k = wp/tan(wp dt/2).
    """
    lengths, starts = data.lengths, np.cumsum((0, *data.lengths[:-1]))
    w = (velocity - np.repeat(velocity[starts], lengths))[None, :]
    columns = []
    for wp in poles:
        k = wp / np.tan(0.5 * wp * data.dt)
        e1, e0 = 2.0 * DAMPING * wp * k, wp * wp
        a = np.array([k * k + e1 + e0, 2.0 * (e0 - k * k), k * k - e1 + e0])
        for b in ([wp * k, 0.0, -wp * k], [e0, 2.0 * e0, e0]):
            columns.append(filtered(np.array(b) / a[0], a / a[0], w, lengths)[0])
    return np.array(columns)


def _slope(w: Vector, data: DataSet) -> Vector:
    """dw/dt [rad/s^2] of each record."""
    return np.concatenate([np.gradient(part, data.dt) for part in np.split(w, np.cumsum(data.lengths)[:-1])])


def _harmonics(angle: Vector, orders: Vector) -> NDArray[np.complex128]:
    """exp(i n angle), a row for each order n, these rising by whole numbers: each from the one before."""
    rows = np.empty((len(orders), len(angle)), dtype=np.complex128)
    turn = np.exp(1j * angle)
    wave, before = np.ones_like(turn), 0
    for row, order in zip(rows, orders, strict=True):
        for _ in range(int(order) - before):
            wave = wave * turn
        row[:], before = wave, int(order)
    return rows
