"""The linear mechanism that effects are added to: one mass or two, starts for both, and how one becomes the other.

Lags, delays and filters are linear too, and an identification absorbs them in poles and zeros of no mechanical meaning.
A diagnosis starts from the mechanism, so that they can be told by name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.terms import LIBRARY
from gaident.estimation.dataset import DataSet
from gaident.estimation.objective import LOST, Fit, Hypothesis, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.projection import project_out
from gaident.estimation.term import Term
from gaident.models.held_torque import held_torque
from gaident.models.model import Model
from gaident.models.roots import quadratic_roots
from gaident.policy.table import POLICY

__all__ = [
    "as_one_mass",
    "as_two_masses",
    "balanced",
    "balanced_on_a_spring",
    "drives_itself",
    "evenly_damped",
    "is_mechanism",
    "on_a_shaft",
    "on_no_shaft",
    "one_mass",
    "put_on_a_spring",
    "reduced",
    "released",
    "resonant",
    "rigid",
    "shafts",
    "swings",
    "swings_at",
]

Vector = NDArray[np.float64]
SHAFT_RATIOS, SHAFT_DAMPING = (0.6, 0.75, 0.87), 0.05  # no decision: a start; zeros below the poles, as on a shaft
SLOWEST_SHAFT, SHAFT_SPAN, HIGHEST_SHAFT = 8.0, 0.02, 0.9  # no decision: its ends, in half periods, of the highest, of Nyquist's
Matrix = NDArray[np.float64]


def one_mass(data: DataSet, identified: Model) -> Model:
    """The identified inertia and damping, or those of the balance of momentum."""
    return identified if (identified.p, identified.q) == (1, 0) and identified.gain > 0.0 else balanced(data)


def balanced(data: DataSet) -> Model:
    """Inertia and damping from the balance of momentum, w = K int u dt - A int w dt + w(0), which needs no start.

    The gain is positive: below the resonance of a pendulum the balance alone would have a negative inertia.
    """
    gram, right = np.zeros((2, 2)), np.zeros(2)
    for r in data.driven:
        columns = np.vstack([np.cumsum(held_torque(r)), -np.cumsum(r.velocity)]) * r.dt
        columns = columns - columns.mean(axis=1, keepdims=True)
        gram += columns @ columns.T
        right += columns @ (r.velocity - r.velocity.mean())
    K, a = np.linalg.lstsq(gram, right, rcond=1e-12)[0]
    slow = 1.0 / data.duration
    return Model(abs(float(K)) or 1.0, [-max(float(a), slow)])


def balanced_on_a_spring(data: DataSet) -> Model | None:
    """One mass on a spring, from the same balance with the spring's momentum; None where its stiffness is not positive.

        w = K int u dt - a int w dt - c int theta dt + w(0) + (K T0) t,   T0 the torque at the angle where the record starts

    The balance needs no start. Without the spring an axis below its resonance would have a negative inertia.
    """
    gram, right = np.zeros((3, 3)), np.zeros(3)
    for r in data.driven:
        assert r.position is not None
        columns = np.vstack([np.cumsum(held_torque(r)), -np.cumsum(r.velocity), -np.cumsum(r.position - r.position[0])]) * r.dt
        line = np.vstack([np.ones(len(r)), np.linspace(-1.0, 1.0, len(r))])
        beyond = np.linalg.qr(line.T)[0]
        columns, w = (rows - (rows @ beyond) @ beyond.T for rows in (columns, r.velocity))
        gram += columns @ columns.T
        right += columns @ w
    sizes = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    K, a, c = np.linalg.lstsq(gram / np.outer(sizes, sizes), right / sizes, rcond=1e-12)[0] / sizes
    if not (K > 0.0 and c > 0.0):
        return None
    return _on_a_spring(float(K), float(a), float(c), data)


def _on_a_spring(K: float, a: float, c: float, data: DataSet) -> Model:
    slow = 1.0 / data.duration
    return Model(K, quadratic_roots(max(a, slow), c), [0.0])


def put_on_a_spring(fit: Fit, stiffness: float, data: DataSet) -> tuple[Hypothesis, Vector]:
    """A fit of one mass, with its effects, on a spring of this stiffness [N m/rad]."""
    K, a = fit.parameters.base_values(fit.x[None, :])[0]
    return moved_to(_on_a_spring(float(K), float(a), stiffness * float(K), data), fit)


def released(fit: Fit) -> tuple[Hypothesis, Vector]:
    """A fit of one mass on a spring, with its effects, without the spring."""
    K, a, _ = fit.parameters.base_values(fit.x[None, :])[0]
    return moved_to(Model(float(K), [-float(a)]), fit)


def rigid(identified: Model) -> list[Model]:
    """One-mass starts: the slowest real pole of the identified model, with its gain at standstill, where that is not negative.

    A slower pole whose zero is slower than the next real pole, too, may be a pair that nearly cancels: that next pole is another
    start, without the pair.
    """
    poles, zeros = (sorted((r for r in roots if r.imag == 0.0), key=abs) for roots in (identified.poles, identified.zeros))
    found = []
    for k, slow in enumerate(poles):
        if k > len(zeros) or (k > 0 and abs(zeros[k - 1]) > abs(slow)):
            break
        gain = identified.gain * np.prod(np.abs(_without(identified.zeros, zeros[:k])))
        gain /= np.prod(np.abs(_without(identified.poles, poles[: k + 1])))
        if gain > 0.0:
            found.append(Model(float(gain), [slow]))
    return found


def _without(roots: Sequence[complex], left_out: Sequence[complex]) -> list[complex]:
    kept = list(roots)
    for r in left_out:
        kept.remove(r)
    return kept


def reduced(identified: Model) -> list[Model]:
    """Two-mass starts: each resonance of the identified model with each of its antiresonances.

    A lag or a delay adds roots of its own to those of the mechanism, which stand between them.
    With p, z one pair each and a the slowest real pole, K |z|^2/(a |p|^2) is the identified model's gain at standstill.
    """
    slow = rigid(identified)
    poles, zeros = ([r for r in roots if r.imag > 0.0] for roots in (identified.poles, identified.zeros))
    return [
        Model(one.gain * abs(p) ** 2 / abs(z) ** 2, [one.poles[0], p, p.conjugate()], [z, z.conjugate()])
        for one in slow for p in poles for z in zeros
    ]  # fmt: skip


def resonant(objective: Objective, one: Fit) -> list[Model]:
    """Two-mass starts: the resonances that help the one mass most, linearised."""
    term = _resonance()
    longer, X = _helpful(objective, one, np.array(term.starts(one.parameters.scales)))
    return [_two_masses(longer.parameters, x) for x in X]


def on_a_shaft(objective: Objective, one: Fit, known: float = 0.0) -> list[tuple[Hypothesis, Vector]]:
    """A fit of one mass with its effects, as two masses: the resonances that help it most, on a fine grid.

    An effect that delays the torque moves the resonance that fits best, and the cost has a local minimum at each resonance.
    So the resonance is searched again beside the effect.
    Resonances within a step of the grid from a known one [rad/s] are left out: they lead to the same minimum.
    """
    poles, z = _shaft_frequencies(one), SHAFT_DAMPING
    rows = np.array([(np.log(w), z, np.log(w * r), z) for w in poles for r in SHAFT_RATIOS])
    longer, X = _helpful(objective, one, rows)
    starts = [as_two_masses(replace(one, hypothesis=longer, x=x)) for x in X]
    step = float(np.log(poles[1] / poles[0]))
    return [(h, x) for h, x in starts if not known > 0.0 or abs(np.log(_resonance_at(h.parameters, x) / known)) > step]


def shafts(one: Fit) -> list[Model]:
    """Two masses of the inertia and damping of one, with the shafts of that grid."""
    K, a = one.parameters.base_values(one.x[None, :])[0]
    z = 2.0 * SHAFT_DAMPING  # no decision: a formula: 2 zeta w
    return [
        Model(float(K) / r**2, [-float(a), *quadratic_roots(z * w, w**2)], quadratic_roots(z * w * r, (w * r) ** 2))
        for w in _shaft_frequencies(one) for r in SHAFT_RATIOS
    ]  # fmt: skip


def _shaft_frequencies(one: Fit) -> Vector:
    """Resonances of the grid [rad/s]."""
    s = one.parameters.scales
    highest = HIGHEST_SHAFT * np.pi / s.dt
    return np.geomspace(max(SLOWEST_SHAFT * np.pi / s.duration, SHAFT_SPAN * highest), highest, POLICY.resonances)


def _helpful(objective: Objective, one: Fit, rows: Matrix) -> tuple[Hypothesis, Matrix]:
    """(the fit with an extra resonance, x of those rows of its coordinates that leave least once the rest is refitted)."""
    longer = one.hypothesis.extended(_resonance())
    X = np.vstack([one.parameters.inserted(one.x, z) for z in rows])
    J, _ = objective.sensitivities(one.hypothesis, one.x)
    E = objective.errors(longer, X)
    finite = np.all(np.abs(E) < LOST, axis=1)
    rest = project_out(J, np.where(finite[:, None], E, 0.0))
    costs = np.where(finite, np.einsum("ij,ij->i", rest, rest), np.inf)
    return longer, X[np.argsort(costs)[: POLICY.starts]]


def _resonance() -> Term:
    return next(t for t in LIBRARY.values() if t.resonates)


def _resonance_of(parameters: Parameterisation) -> Term:
    return next(t for t in parameters.terms if t.resonates)


def _two_masses(parameters: Parameterisation, x: Vector) -> Model:
    """The drive of two masses whose resonance is the extra one of x: K (wp/wz)^2 (s^2 + ...)/((s + a)(s^2 + ...)).

    On one mass the extra resonance is the second mass; on two it takes the place of theirs, K f0/e0 the gain of the whole.
    """
    K, a, *pairs = parameters.base_values(x[None, :])[0]
    if pairs:
        K *= pairs[3] / pairs[1]
    wp, zp, wz, zz = parameters.effect_values(x[None, :], _resonance_of(parameters).name)[0]
    poles = [complex(-a), *quadratic_roots(2.0 * zp * wp, wp**2)]  # no decision: a formula
    return Model(K * (wp / wz) ** 2, poles, quadratic_roots(2.0 * zz * wz, wz**2))  # no decision: a formula


def moved_to(model: Model, fit: Fit, left_out: str = "") -> tuple[Hypothesis, Vector]:
    """The effects of a fit, but one, on another linear mechanism; start states at 0."""
    old = fit.parameters
    new = Parameterisation.of(model, old.scales, [n > 0 for n in old.starts], old.begun)
    x = new.base_vector(model)
    for t in old.terms:
        if t.name != left_out:
            new = new.extended(t)
            x = np.concatenate([x, fit.x[old.slot(t.name)]])
    return Hypothesis(new, fit.predictor), np.concatenate([x, np.zeros(sum(new.starts))])


def as_two_masses(fit: Fit) -> tuple[Hypothesis, Vector]:
    """The drive of two masses whose resonance is the extra one of a fit, with its other effects."""
    return moved_to(_two_masses(fit.parameters, fit.x), fit, _resonance_of(fit.parameters).name)


def as_one_mass(fit: Fit) -> tuple[Hypothesis, Vector]:
    """The effects of a fit of two masses on one: K f0/e0 is the gain of the whole."""
    K, a, _, e0, _, f0 = fit.parameters.base_values(fit.x[None, :])[0]
    return moved_to(Model(abs(float(K * f0 / e0)) if e0 * f0 else float(K), [-float(a)]), fit)


def evenly_damped(parameters: Parameterisation, x: Vector) -> Vector:
    """Two masses with the damping of the zeros that the rest implies: f1 = a + (e1 - a) f0/e0.

    With bearings in proportion to the inertias, D_M/J_M = D_L/J_L = a, the shaft's damping D_G makes

        e1 = a + D_G (1/J_M + 1/J_L),   f1 = a + D_G/J_L,   f0/e0 = J_M/(J_M + J_L)

    A linear fit of a shaft with a gap damps the zeros instead, as if bearings of the load braked and those of the motor drove it.
    A gap added to such a mechanism does not lower the cost; in a passive mechanism the cost has one wide minimum.
    """
    _, a, e1, e0, _, f0 = parameters.base_values(x[None, :])[0]
    if not 0.0 < f0 < e0:
        return x
    even = x.copy()
    even[4] = (a + (e1 - a) * f0 / e0) / parameters.units[3]
    return even


def is_mechanism(parameters: Parameterisation, x: Vector) -> bool:
    """Whether two masses are two masses on a shaft: sum of pairwise A = K_G (1/J_M + 1/J_L) is above prod B = K_G/J_L.

    A spring to the ground has a positive stiffness.
    A resonance whose damping is at its bound is no shaft: a lag or another filter looks like two poles and two zeros.
    """
    for t in parameters.terms:
        if t.resonates:
            _, zp, _, zz = parameters.effect_values(x[None, :], t.name)[0]
            if max(zp, zz) > POLICY.at_bound * POLICY.swing_damping:
                return False
    if parameters.masses == 1:
        return not parameters.on_a_spring or bool(parameters.base_values(x[None, :])[0, 2] > 0.0)
    _, a, e1, e0, _, f0 = parameters.base_values(x[None, :])[0]
    return bool(e0 + a * e1 > f0)


def drives_itself(fit: Fit) -> bool:
    """Whether the viscous friction of a mechanism is negative, s + a with a < 0: what drives is no friction."""
    return bool(fit.parameters.base_values(fit.x[None, :])[0, 1] < 0.0)


def swings(fit: Fit) -> bool:
    """Whether two masses are damped as those on a shaft; True for one."""
    return swings_at(fit.parameters, fit.x)


def swings_at(parameters: Parameterisation, x: Vector) -> bool:
    """Whether two masses are damped as those on a shaft: e1 < 2 zeta sqrt(e0), f1 < 2 zeta sqrt(f0); True for one."""
    if parameters.masses == 1:
        return True
    _, _, e1, e0, f1, f0 = parameters.base_values(x[None, :])[0]
    twice = 2.0 * POLICY.swing_damping  # no decision: a formula: 2 zeta w
    return bool(e0 > 0.0 and f0 > 0.0 and abs(e1) < twice * np.sqrt(e0) and abs(f1) < twice * np.sqrt(f0))


def on_no_shaft(fit: Fit) -> bool:
    """Whether two masses do not swing, or are driven at the motor's end: f1 - e1 - a > 2 zeta0 sqrt(f0); False for one.

    (D_M + D_G)/J_M = a + e1 - f1 is positive on every shaft; zeta0 is `driven_damping`.
    A linear fit of a shaft with a gap may come out so, but no model that explains a record.
    """
    if fit.parameters.masses == 1:
        return False
    if not swings(fit):
        return True
    _, a, e1, _, f1, f0 = fit.parameters.base_values(fit.x[None, :])[0]
    return bool(f1 - e1 - a > 2.0 * POLICY.driven_damping * np.sqrt(f0))  # no decision: a formula: 2 zeta w


def resonance(fit: Fit) -> float:
    """Of a fit of two masses [rad/s]; 0 for one."""
    return _resonance_at(fit.parameters, fit.x) if fit.parameters.masses == 2 else 0.0


def _resonance_at(parameters: Parameterisation, x: Vector) -> float:
    return float(np.sqrt(abs(parameters.base_values(x[None, :])[0][3])))
