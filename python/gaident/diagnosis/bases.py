"""The linear mechanism that effects are added to: one mass or two.

Lags, delays and filters are linear too, and an identification absorbs them in poles and zeros of no mechanical meaning. A
diagnosis starts from the mechanism, so that they can be told by name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.candidates import CANDIDATES, FRICTION, Scales
from gaident.diagnosis.driven import Driven
from gaident.diagnosis.layout import Layout, described, is_mechanism, swings, two_masses
from gaident.diagnosis.noise_filter import WHITE, ShaftNoise
from gaident.diagnosis.problem import WORST, Fit, Problem, project_out
from gaident.diagnosis.screening import Screening
from gaident.diagnosis.stepwise import Search, with_second_mass
from gaident.models.model import Model

__all__ = ["base_fit", "linear_bases", "loop_starts", "one_mass", "two_mass_fits", "without_second_mass"]

Vector = NDArray[np.float64]

NEAR = 0.05  # BIC units per sample by which one mass with an effect may be behind two masses after a short fit


def linear_bases(search: Search, scales: Scales, identified: Model) -> list[Fit]:
    """One mass, two masses, or both where only the effects can decide.

    Two alone where they resonate as on a shaft and nothing on one mass comes near, else one mass first: a delay or a lag looks
    like a resonance as long as nothing else is tried, and a load or a saturation hides one.
    """
    problem, driven = search.problem, search.driven
    one = base_fit(problem, driven, scales, one_mass(driven, identified))
    known = _fits(problem, driven, scales, reduced(identified))
    fits = known + _fits(problem, driven, scales, resonant(problem, one))
    one = problem.settled(one)
    if not fits:
        return [one]
    chosen = sorted(fits, key=lambda f: f.cost)[:1] + sorted(known, key=lambda f: f.cost)[:1]
    two = min((problem.settled(problem.fit(f.layout, f.x, WHITE, 20)) for f in chosen), key=lambda f: f.bic)
    best = min((one, two), key=lambda f: f.bic)
    problem.shaft = ShaftNoise(best.layout.model(best.x), scales.dt, driven.controller)
    one, two = problem.settled(one), problem.settled(two)
    if one.bic < two.bic or not swings(two.layout, two.x):
        return [one, two]
    screening = Screening(problem, driven)
    screening.add(one.layout, one.x, [e for e in search.candidates(one.layout) if e not in (*FRICTION[1:], "extra_resonance")])
    tried: set[str] = set()
    for noise in (WHITE, two.noise):
        for s in screening.ranked(noise)[:3]:
            if s.effect not in tried:
                short = problem.judged(problem.fit(s.layout, s.starts[0], noise, 5))
                if short.bic - two.bic < NEAR * problem.count:
                    return [one, two]
            tried.add(s.effect)
    return [two]


def loop_starts(search: Search, scales: Scales, identified: Model, bases: Sequence[Fit]) -> list[Fit]:
    """The best linear fit of one mass and of two in the loop: from the bases, and from the mechanism in the identified model.

    A replayed torque that a limit of the controller spoils leads the bases astray; the model was identified in the loop.
    """
    problem, driven = search.problem, search.driven
    starts = [(f.layout, f.x) for f in bases]
    for model in rigid(identified) + reduced(identified):
        layout = Layout.of(model, described(scales, model), driven.moving)
        starts.append((layout, np.concatenate([layout.base_vector(model), np.zeros(sum(layout.starts))])))
    fits = [problem.fit(replace(layout, looped=True), x, WHITE, 12) for layout, x in starts]
    fits.sort(key=lambda f: (not swings(f.layout, f.x), f.cost))
    return [next(f for f in fits if f.layout.masses == m) for m in sorted({f.layout.masses for f in fits})]


def base_fit(problem: Problem, driven: Driven, scales: Scales, model: Model, iterations: int = 20) -> Fit:
    """A mechanism fitted to the records' plain errors."""
    layout = Layout.of(model, described(scales, model), driven.moving, driven.loop_only)
    x = np.concatenate([layout.base_vector(model), np.zeros(sum(layout.starts))])
    return problem.fit(layout, x, WHITE, iterations)


def _fits(problem: Problem, driven: Driven, scales: Scales, starts: list[Model]) -> list[Fit]:
    """Short fits of two masses."""
    return [
        f for f in (base_fit(problem, driven, scales, m, 6) for m in starts) if f.cost < WORST and is_mechanism(f.layout, f.x)
    ]


def two_mass_fits(problem: Problem, driven: Driven, scales: Scales, identified: Model, one: Fit) -> list[Fit]:
    """Short fits of two masses that resonate as on a shaft."""
    starts = reduced(identified) + resonant(problem, one)
    return [f for f in _fits(problem, driven, scales, starts) if swings(f.layout, f.x)]


def reduced(identified: Model) -> list[Model]:
    """Two-mass starts: each resonance of the identified model with each of its antiresonances.

    A lag or a delay adds roots of its own to those of the mechanism, which stand between them. With p, z one pair each and a the
    slowest real pole, K |z|^2/(a |p|^2) is the identified model's gain at standstill.
    """
    slow = rigid(identified)
    poles, zeros = ([r for r in roots if r.imag > 0.0] for roots in (identified.poles, identified.zeros))
    return [
        Model(one.gain * abs(p) ** 2 / abs(z) ** 2, [one.poles[0], p, p.conjugate()], [z, z.conjugate()])
        for one in slow for p in poles for z in zeros
    ]  # fmt: skip


def rigid(identified: Model) -> list[Model]:
    """The identified model's slowest real pole alone, with its gain at standstill; none without a real pole."""
    real = [r for r in identified.poles if r.imag == 0.0]
    if not real:
        return []
    slow = min(real, key=abs)
    others = [r for r in identified.poles if r != slow]
    return [Model(float(identified.gain * np.prod(np.abs(identified.zeros)) / np.prod(np.abs(others))), [slow])]


def one_mass(driven: Driven, identified: Model) -> Model:
    """Inertia and damping from the balance of momentum, w = K int u dt - A int w dt + w(0); or the identified ones."""
    if (identified.p, identified.q) == (1, 0):
        return identified
    gram, right = np.zeros((2, 2)), np.zeros(2)
    for r in driven.driven:
        assert r.torque is not None
        columns = np.vstack([np.cumsum(r.torque), -np.cumsum(r.velocity)]) * r.dt
        columns = columns - columns.mean(axis=1, keepdims=True)
        gram += columns @ columns.T
        right += columns @ (r.velocity - r.velocity.mean())
    K, a = np.linalg.lstsq(gram, right, rcond=1e-12)[0]
    slow = 1.0 / max(r.duration for r in driven.records)
    return Model(float(K) if K != 0.0 else 1.0, [-max(float(a), slow)])


def resonant(problem: Problem, one: Fit) -> list[Model]:
    """Two-mass starts: the resonances that help the one mass most, linearised."""
    candidate = CANDIDATES["extra_resonance"]
    layout = one.layout.extended("extra_resonance")
    rows = np.array(candidate.starts(one.layout.scales))
    X = np.vstack([one.layout.inserted(one.x, z) for z in rows])
    _, J, _ = problem.linearised(one.layout, one.x, WHITE)
    E = problem.errors(layout, X)
    finite = np.all(np.isfinite(E), axis=1)
    rest = project_out(J, np.where(finite[:, None], E, 0.0))
    costs = np.where(finite, np.einsum("ij,ij->i", rest, rest), np.inf)
    return [two_masses(layout, X[i]) for i in np.argsort(costs)[:3]]


def without_second_mass(search: Search, final: Fit) -> Fit:
    """Back to one mass where, with the effects in the model, the second is not worth the threshold."""
    problem = search.problem
    if final.layout.masses == 1 or not final.effects or any(CANDIDATES[e].place == "coupling" for e in final.effects):
        return final
    K, a, _, e0, _, f0 = final.layout.base_values(final.x[None, :])[0]
    one = Model(float(K * f0 / e0) if e0 else float(K), [-float(a)])
    layout = Layout.of(
        one, replace(final.layout.scales, two_masses=False), [n > 0 for n in final.layout.starts], final.layout.looped
    )
    x = layout.base_vector(one)
    for e in final.effects:
        layout = layout.extended(e)
        x = np.concatenate([x, final.x[final.layout.slot(e)]])
    x = np.concatenate([x, np.zeros(sum(layout.starts))])
    less = problem.settled(problem.fit(layout, x, final.noise, 20))
    return with_second_mass(problem, less) if less.bic - final.bic < search.threshold else final
