"""Every move of the search by itself, over a toy objective: its models are sums of given signals, and nothing is simulated.

The toy has a predictor of its own.
The velocity of a model is the sum of a signal for each base parameter and of a shape for each effect,
so that the truth is known, and what a fit may find too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import chi2

import gaident as ga
from gaident.control.controller import Limiting
from gaident.diagnosis.library.cause import Cause
from gaident.diagnosis.library.kinds import of_waves
from gaident.diagnosis.library.terms import LIBRARY as REAL
from gaident.diagnosis.selection import mechanisms, model_space, moves, noise_level, rivals, select, side_moves, wave_moves
from gaident.diagnosis.selection.bases import Task
from gaident.diagnosis.selection.bootstrap import largest_gains
from gaident.diagnosis.selection.rivals import Replacement, rivals_of
from gaident.diagnosis.selection.screening import score_test
from gaident.diagnosis.selection.select import specification
from gaident.diagnosis.selection.wave_moves import causes
from gaident.estimation import least_squares as ls
from gaident.estimation import prediction
from gaident.estimation.criterion import effective_samples
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Innovations, Objective, OutputErrors
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prefilter import Prefilter
from gaident.estimation.term import Scales, Term
from gaident.models.simulate_many import LoadedRecord
from gaident.policy.table import POLICY, rows

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

N, DT, NOISE = 800, 1e-3, 0.05
SCALES = Scales(DT, N * DT, 1.0, 1.0, 1.0, 1.0, 0.02, float("nan"), float("nan"), False, 1.0)
S = np.linspace(0.0, 1.0, N)  # time as a share of the record
ONE = ga.OneMass(J=0.01, D=0.01).model()
SPRUNG = ga.Model(100.0, [-2.0 + 30.0j, -2.0 - 30.0j], [0.0])
TWO = ga.TwoMass(JM=0.01, DM=0.01, JL=0.02, DL=0.02, KG=50.0, DG=0.01).model()
BASE = [np.sin((2.0 + 1.7 * i) * np.pi * S + 0.4 * i) for i in range(6)]  # what each base parameter adds
DRIFT = 0.6 * np.sin(9.3 * np.pi * S) * S  # what nobody commanded, which only a closed loop follows


def wave(k: float) -> Vector:
    return np.asarray(np.cos(k * np.pi * S + 0.1 * k))


def pulse(at: float) -> Vector:
    return np.asarray(np.exp(-(((S - at) / 0.03) ** 2)))


def toy(name: str, starts: Sequence[tuple[float, ...]], **more: object) -> Cause:
    """A term whose coordinates are its parameters, between -10 and 10."""
    size = max((len(row) for row in starts), default=1)
    term = Cause(
        name,
        str(more.pop("place", "shaft")),
        natural=lambda z: z.copy(),
        coordinates=lambda p: np.array(list(p.values())),
        limits=lambda s: [(-10.0, 10.0)] * size,
        starts=lambda s: list(starts),
        steps=lambda s: (0.5,) * size,
    )
    return replace(term, **more)  # type: ignore[arg-type]


A = toy("a", [(0.5,)])
B = toy("b", [(0.5,)])
C = toy("c", [(0.5,)])
LEVEL = toy("level", [(0.5,)], family="friction", levels=True)
GENERAL = toy("general", [(0.5, 0.3)], family="friction", levels=True, nested=("level",), neutral=lambda level, s: (level, 0.0))
DEEP = toy("deep", [(0.5, 0.3, 0.1)], family="friction", levels=True, nested=("level", "general"))
GAP = toy("gap", [(0.5,)], place="coupling", excludes=frozenset({"resonance"}))
IMPACTS = replace(GAP, multimodal=True)
RESONANCE = toy("resonance", [(60.0, 0.1, 50.0, 0.1)], place="plant", resonates=True, excludes=frozenset({"gap"}))
RESONANCE = replace(RESONANCE, limits=lambda s: [(1.0, 500.0), (0.0, 2.0)] * 2, steps=lambda s: (5.0, 0.1) * 2)
LIMIT = toy("limit", [(0.5,)], place="controller", limiting=lambda p: Limiting())
PLACED = toy("placed", [(0.1,), (0.5,), (0.9,)])
VALLEY = toy("valley", [(0.25,)], multimodal=True)
VALLEY = replace(VALLEY, limits=lambda s: [(0.0, 1.0)], steps=lambda s: (0.6,))
RIPPLE = toy("ripple", [(0.5, 0.0)], harmonic="velocity", orders=(1, 8))
LAG = toy("lag", [(0.5,)])
SEEN = toy("seen", [(0.5,)], seen_angle=lambda angle, w, v: angle)
TERMS = (A, B, C, LEVEL, GENERAL, DEEP, GAP, RESONANCE, LIMIT, PLACED, VALLEY, RIPPLE, LAG, SEEN)
NEAR = toy("near", [(0.5,)], family="near end", levels=True, other_side="far")
FAR = toy("far", [(0.5,)], family="far end", levels=True, other_side="near", at_load=True)
LIBRARY = {t.name: t for t in (*TERMS, NEAR, FAR)}

SHAPES: dict[str, Callable[[Vector], Vector]] = {
    "a": lambda z: z[0] * wave(12.0),
    "b": lambda z: z[0] * wave(15.5),
    "c": lambda z: z[0] * wave(19.0),
    "level": lambda z: z[0] * wave(10.5),
    "general": lambda z: z[0] * wave(10.5) + z[1] * wave(13.7),
    "deep": lambda z: z[0] * wave(10.5) + z[1] * wave(13.7) + z[2] * wave(16.7),
    "gap": lambda z: z[0] * wave(17.3),
    "resonance": lambda z: 0.01 * (z[0] - z[2]) * wave(14.5) + (z[1] - z[3]) * wave(16.1),
    "limit": lambda z: z[0] * wave(11.1),
    "placed": lambda z: pulse(z[0]),
    "valley": lambda z: pulse(z[0]),
    "ripple": lambda z: z[0] * wave(21.0) + z[1] * wave(23.0),
    "lag": lambda z: z[0] * wave(18.1),
    "seen": lambda z: z[0] * wave(20.3),
    "near": lambda z: z[0] * wave(22.1),
    "far": lambda z: z[0] * (0.9 * wave(22.1) + 0.4 * wave(25.3)),
}


@dataclass(frozen=True)
class Toy:
    """The predictor: signals of the base parameters around their start, shapes of the effects, the drift in a closed loop."""

    data: DataSet
    own_angle: bool = False
    closed: bool = False

    def velocities(self, parameters: Parameterisation, X: Matrix) -> Matrix:
        rows = X[:, : parameters.base] @ np.array(BASE[: parameters.base])
        for t in parameters.terms:
            rows = rows + np.array([SHAPES[t.name](z) for z in X[:, parameters.slot(t.name)]])
        return np.asarray(rows + (DRIFT if self.closed else 0.0))

    def torque_response(self, parameters: Parameterisation, x: Vector, torques: Matrix) -> Matrix:
        return np.zeros_like(torques)


@dataclass(frozen=True)
class HalfFollowed(Toy):
    """A loop that follows half of the drift, where `ObserverLoop` may be used."""

    closed: bool = True
    possible = staticmethod(prediction.ObserverLoop.possible)

    def velocities(self, parameters: Parameterisation, X: Matrix) -> Matrix:
        return super().velocities(parameters, X) - 0.5 * DRIFT


@pytest.fixture(autouse=True)
def _no_simulator(monkeypatch: pytest.MonkeyPatch) -> None:
    """The toy's library, and its predictor in the place of both loops; a simulation would be an error."""

    def simulated(*args: object, **more: object) -> None:
        raise AssertionError("a move on the toy has asked the simulator")

    monkeypatch.setattr(LoadedRecord, "velocities", simulated)
    monkeypatch.setattr(side_moves, "LIBRARY", LIBRARY)
    monkeypatch.setattr(noise_level, "LIBRARY", LIBRARY)
    for module in (moves, model_space):
        monkeypatch.setattr(module, "LIBRARY", LIBRARY)
        monkeypatch.setattr(module, "equivalents", lambda effect: {"lag": ("seen",), "seen": ("lag",)}.get(effect, ()))
    monkeypatch.setattr(noise_level, "ClosedLoop", lambda data, own=False: Toy(data, own, True))
    monkeypatch.setattr(score_test, "ClosedLoop", lambda data, own=False: Toy(data, own, True))
    for module in (model_space, noise_level):
        monkeypatch.setattr(module, "OpenLoop", Toy)
    monkeypatch.setattr(moves, "OpenLoop", Toy)
    # The base parameters of the toy are sizes of signals, of no shaft.
    monkeypatch.setattr(model_space, "on_no_shaft", lambda fit: False)


class Bench:
    """A record of a known truth, the moves over it, and fits of chosen models."""

    def __init__(
        self,
        effects: dict[str, tuple[float, ...]] | None = None,
        *,
        masses: int = 1,
        base: Sequence[float] = (),
        extra: Vector | float = 0.0,
        loop: bool = False,
        angle: bool = False,
        allowed: Sequence[Term] = TERMS,
        plain: bool = False,
        prefilter: Prefilter | None = None,
        noise: float = NOISE,
        seed: int = 0,
    ) -> None:
        self.masses = masses
        x = np.array([*base, *np.ones((2, 6)[masses - 1] - len(base))])
        w = x @ np.array(BASE[: len(x)]) + extra
        for name, z in (effects or {}).items():
            w = w + SHAPES[name](np.array(z))
        w = w + noise * np.random.default_rng(seed).standard_normal(N)
        still = np.zeros(N)
        rec = ga.Record(DT, still if loop else None, w, still, np.arange(N) * DT if angle else None)
        data = DataSet.of([rec], ga.PI(1.0, 1.0) if loop else None)
        self.data = replace(data, known_noise=noise, moving=(False,))
        family = OutputErrors(100.0, prefilter) if plain else Innovations()
        self.task = Task(Objective(self.data, np.ones(N), family), SCALES, ONE, tuple(allowed), lambda message: None)
        self.space = self.task.space()

    def hypothesis(self, *terms: Term, masses: int = 0, closed: bool = False) -> Hypothesis:
        parameters = Parameterisation.of(ONE if (masses or self.masses) == 1 else TWO, SCALES, [False])
        for t in terms:
            parameters = parameters.extended(t)
        return Hypothesis(parameters, Toy(self.data, False, closed))

    def start(self, hypothesis: Hypothesis) -> Vector:
        rows = [t.starts(SCALES)[0] for t in hypothesis.parameters.terms]
        return np.concatenate([np.ones(hypothesis.parameters.base), *map(np.array, rows)])

    def fit(self, *terms: Term, masses: int = 0, closed: bool = False) -> Fit:
        hypothesis = self.hypothesis(*terms, masses=masses, closed=closed)
        return self.space.refitted(hypothesis, self.start(hypothesis))


def names(fits: Sequence[Fit]) -> list[tuple[str, ...]]:
    return [f.effects for f in fits]


# What a model is worth.


def test_an_effect_that_is_there_is_worth_it_and_one_that_is_not_is_none() -> None:
    there, absent = Bench({"a": (0.3,)}), Bench()
    assert there.space.worth(there.fit(A), there.fit())
    assert not absent.space.worth(absent.fit(A), absent.fit())
    assert not there.space.worth(there.fit(A, B), there.fit(A))


def test_an_effect_is_worth_it_from_its_penalty_on() -> None:
    """The gain in BIC grows with the square of the amplitude: below the penalty it is not worth it, above it is."""
    gains = {}
    for size in (0.006, 0.02):
        bench = Bench({"a": (size,)})
        less, more = bench.fit(), bench.fit(A)
        gains[size] = less.bic - more.bic
        assert bench.space.worth(more, less) is (gains[size] > bench.space.penalty)
    assert gains[0.006] < POLICY.effect_penalty < gains[0.02]


def test_the_score_counts_what_an_effect_contains_a_mass_once_and_orders_that_were_searched() -> None:
    bench = Bench()
    space = bench.space

    def cost(fit: Fit) -> float:
        return (space.score(fit) - fit.bic) / space.penalty

    assert cost(bench.fit()) == 0.0
    assert cost(bench.fit(A, B)) == pytest.approx(2.0)
    assert cost(bench.fit(GENERAL)) == pytest.approx(2.0) and cost(bench.fit(LEVEL)) == pytest.approx(1.0)
    assert cost(bench.fit(DEEP)) == pytest.approx(3.0), "a generalisation of a generalisation"
    assert cost(bench.fit(masses=2)) == pytest.approx(1.0)
    assert cost(bench.fit(RIPPLE)) * space.penalty == pytest.approx(space.penalty + 2.0 * np.log(8.0))
    assert space.penalty == pytest.approx(POLICY.effect_penalty * (1.0 + POLICY.short_record / space.objective.count))
    assert Bench(plain=True).space.penalty == POLICY.effect_penalty


def test_the_key_is_of_the_model_whatever_the_order_and_the_same_for_equivalent_effects() -> None:
    bench = Bench()
    key = bench.space.key
    assert key(bench.fit(A, B)) == key(bench.fit(B, A))
    assert key(bench.fit(LAG)) == key(bench.fit(SEEN))
    assert key(bench.fit(A)) != key(bench.fit(B)) and key(bench.fit()) != key(bench.fit(masses=2))


def test_what_explains_little_of_a_misfit_is_significant_and_not_material() -> None:
    """Beside a misfit of 0.7 an effect of 0.1 explains 2 % of the squared error, one of 0.4 a quarter."""
    misfit = 0.7 * np.sin(70.0 * S**2)
    for size, counts in ((0.1, False), (0.4, True)):
        bench = Bench({"a": (size,)}, extra=misfit, plain=True, noise=0.01)
        less, more = bench.fit(), bench.fit(A)
        assert bench.space.material(less, more) is counts
        assert not bench.space.is_noise(more)
    # The same small effect is material where it leaves noise.
    bench = Bench({"a": (0.1,)}, plain=True, noise=0.05)
    assert bench.space.is_noise(bench.fit(A)) and bench.space.material(bench.fit(), bench.fit(A))


def test_what_is_not_material_is_not_worth_it_however_significant() -> None:
    misfit = 0.7 * np.sin(70.0 * S**2)
    bench = Bench({"a": (0.1,)}, extra=misfit, plain=True, noise=0.01)
    bench.space = replace(bench.space, objective=bench.space.objective.under(OutputErrors(float(N))))
    less, more = bench.fit(), bench.fit(A)
    assert bench.space.score(more) < bench.space.score(less)
    assert not bench.space.worth(more, less)


@pytest.mark.parametrize("plain", [True, False])
def test_a_cause_that_whitening_hid_is_one_by_the_errors_before_whitening(plain: bool) -> None:
    """A slow effect passes for noise. Against a model of other effects no specification test is defined: the score decides.

    It is one comparison, whichever errors the search at hand is made by.
    """
    bench = Bench({"a": (0.3,)}, plain=plain, noise=0.05)
    space, without, other = bench.space, bench.fit(B), bench.fit(A)
    assert space.hidden(without, other) and not space.hidden(other, without)
    assert not space.hidden(other, other), "the same causes hide nothing"
    assert not space.hidden(bench.fit(A, B), other), "nor does a model that contains them all"
    # Most of what is left without it has to be its work.
    little = Bench({"a": (0.3,)}, extra=0.7 * np.sin(70.0 * S**2), plain=plain, noise=0.01)
    assert not little.space.hidden(little.fit(B), little.fit(A))
    # What is left without it has to be more than noise: here it is 1.7 times that.
    small = Bench({"a": (0.1,)}, plain=plain, noise=0.05)
    costs = [small.space.of_output_errors().unwhitened_cost(small.fit(t)) for t in (B, A)]
    assert costs[1] < POLICY.overrules * costs[0] and not small.space.hidden(small.fit(B), small.fit(A))


def test_what_the_noise_of_a_measured_torque_makes_of_a_free_run_is_no_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """It lets the velocity wander: a ramp explains much of that by chance, and by the independent samples it would count."""
    monkeypatch.setitem(SHAPES, "a", lambda z: z[0] * S)
    monkeypatch.setattr(Toy, "torque_response", lambda self, parameters, x, torques: np.cumsum(torques, axis=1))
    monkeypatch.setattr(prediction, "noise_std", lambda torque: 0.01)

    def worth(measured: bool, seed: int, size: float = 0.0) -> bool:
        wander = 0.01 * np.cumsum(np.random.default_rng(seed).standard_normal(N))
        bench = Bench({"b": (size,)}, extra=wander, plain=True, seed=seed, noise=0.01)
        records = tuple(r.with_channels(torque_is="measured") for r in bench.data.records)
        bench.data = replace(bench.data, torque_measured=measured, records=records)
        space = replace(bench.task, objective=Objective(bench.data, np.ones(N), OutputErrors(100.0))).space()
        return space.worth(bench.fit(B if size else A), bench.fit())

    seeds = range(24)
    assert sum(worth(False, seed) for seed in seeds) > 12, "taken for an effect"
    assert [s for s in seeds if worth(True, s)] == []
    assert all(worth(True, seed, 1.0) for seed in seeds), "what is there shows through that noise"


def test_a_hidden_cause_counts_by_independent_samples() -> None:
    """Of too few of them the same cost says nothing; where errors are whitened they are those of the errors without the cause."""
    bench = Bench({"a": (0.3,)}, plain=True, noise=0.05)
    few = replace(bench.space, objective=bench.space.objective.under(OutputErrors(3.0)))
    less, more = (few.unwhitened(f, f.predictor) for f in (bench.fit(B), bench.fit(A)))
    assert more.cost < POLICY.overrules * less.cost and not few.hidden(less, more)
    slow = Bench({"a": (0.3,)}, noise=0.05)
    without = slow.space.of_output_errors().unwhitened(slow.fit(B), slow.fit(B).predictor)
    samples = effective_samples(slow.space.objective.unwhitened_errors(without))
    assert samples < 0.1 * N and slow.space.hidden(slow.fit(B), slow.fit(A))
    with_them = slow.space.of_output_errors(samples)
    scores = [with_them.score(with_them.unwhitened(slow.fit(t), without.predictor)) for t in (B, A)]
    assert scores[0] - scores[1] > with_them.margin


def test_the_specification_test_is_of_one_model_and_counts_what_a_fit_moves() -> None:
    """H = I ln(V_P(x_W) / V_P(x_P)); an order that is searched for is the same in both estimates."""
    bench = Bench({"a": (0.3,)}, noise=0.05)
    fit = bench.fit(A)
    # Its free run misses more than records without effects do.
    apart = replace(fit, x=fit.x + np.array([0.4, 0.0, 0.0]))
    found = specification(bench.space, bench.task, apart)
    objective = bench.space.objective
    plain = ls.fit(objective, fit.hypothesis, fit.x, WHITE, 12)
    assert found.bound == pytest.approx(chi2.isf(POLICY.noise_level, 3))
    whole = float(objective.costs(fit.hypothesis, apart.x[None, :], WHITE)[0])
    assert found.statistic == pytest.approx(objective.count * np.log(whole / plain.cost))
    assert found.contradicts and not specification(bench.space, bench.task, fit).contradicts
    searched = replace(A, steps=lambda s: (0.0,))
    assert specification(bench.space, bench.task, bench.fit(searched)).bound == pytest.approx(chi2.isf(POLICY.noise_level, 2))


def test_what_is_white_without_a_filter_needs_no_output_errors_and_contradicts_nothing() -> None:
    """Whitened and plain estimate are one there; a coloured rest has to be looked at."""
    colour = lfilter([1.0], [1.0, -0.9], 0.5 * NOISE * np.random.default_rng(1).standard_normal(N))
    white, slow = Bench({"a": (0.3,)}), Bench({"a": (0.3,)}, extra=colour)
    assert white.fit(A).noise.size == 0 and specification(white.space, white.task, white.fit(A)).statistic == 0.0
    assert "by_output_errors" not in vars(white.task), "no regression, no fit"
    specification(slow.space, slow.task, slow.fit(A))
    assert "by_output_errors" in vars(slow.task) and slow.task.by_output_errors is slow.task.by_output_errors


def test_models_are_compared_in_the_same_view() -> None:
    """A closed loop that follows the drift is no merit of the effect beside it."""
    bench = Bench(extra=DRIFT, loop=True)
    less, more = bench.fit(), bench.fit(A, closed=True)
    assert bench.space.score(more) < bench.space.score(less)
    assert not bench.space.worth(more, less)
    seen = bench.space.under_predictor_of(less, more)
    assert seen.predictor.closed and seen.bic < less.bic
    assert bench.space.under_predictor_of(less, bench.fit(A)) is less


def test_of_effects_that_are_the_same_to_every_record_the_first_has_the_name(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench({"lag": (0.5,)})
    lag, seen = bench.fit(LAG), bench.fit(SEEN)

    def better(final: Fit, other: Fit, behind: float) -> Fit | None:
        name = other.effects[0]
        monkeypatch.setattr(rivals, "rivals_of", lambda *arguments: (90.0, [Replacement(name, behind, other)]))
        return rivals.of_each_effect(bench.space, final, True, lambda effect: (), lambda message: None)[1]

    assert better(seen, lag, 0.3) is lag, "rounding decides"
    assert better(seen, lag, POLICY.swap + 0.1) is None
    assert better(lag, seen, -0.3) is None
    assert better(lag, seen, -POLICY.swap - 0.1) is seen


def test_two_masses_on_no_shaft_take_no_place_of_a_model_that_is_on_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever they explain; but effects are added to a linear fit that is on none, as that of a shaft with a gap may be."""
    bench = Bench({"a": (0.5,)}, base=(1.0, 0.4), masses=2)
    one, two, more = bench.fit(masses=1), bench.fit(), bench.fit(A)
    space = bench.space
    assert space.worth(two, one) and space.worth(more, two) and space.prefers(two, one)
    monkeypatch.setattr(model_space, "on_no_shaft", lambda fit: fit.parameters.masses == 2)
    assert not space.worth(two, one) and not space.prefers(two, one)
    assert space.worth(more, two)


def test_of_one_family_dry_friction_has_the_name_before_what_has_no_level(monkeypatch: pytest.MonkeyPatch) -> None:
    """A drag that grows with the root of the speed comes within the margin of dry friction; every axis has that."""
    bench = Bench({"level": (0.5,)})
    rooted = replace(A, family=LEVEL.family)
    level, drag = bench.fit(LEVEL), bench.fit(rooted)

    def better(final: Fit, other: Fit, behind: float) -> Fit | None:
        one = Replacement(other.effects[0], behind, other)
        monkeypatch.setattr(rivals, "rivals_of", lambda *arguments: (90.0, [one]))
        return rivals.of_each_effect(bench.space, final, True, lambda effect: (), lambda message: None)[1]

    assert better(drag, level, bench.space.margin - 0.1) is level
    assert better(drag, level, bench.space.margin + 0.1) is None
    assert better(level, drag, 0.3) is None
    assert better(level, drag, 0.1 - bench.space.margin) is None, "and it does not come back"
    assert better(level, drag, -0.1 - bench.space.margin) is drag
    assert better(bench.fit(A), level, 0.3) is None, "another family"


def test_dry_friction_is_tried_at_the_size_of_a_constant_torque_that_it_cannot_be_told_from(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From its own start it may stand still, where no slope shows the way: but its size is that of the torque, which is known."""
    monkeypatch.setitem(SHAPES, "level", lambda z: wave(10.5) * (z[0] if z[0] > 0.6 else 0.0))
    constant = toy("constant", [(0.5,)], constant=True)
    monkeypatch.setitem(SHAPES, "constant", lambda z: -z[0] * wave(10.5))
    monkeypatch.setattr(rivals, "LIBRARY", {**LIBRARY, "constant": constant})
    bench = Bench({"level": (0.9,)}, allowed=(*TERMS, constant))
    found = bench.fit(constant)
    assert found.x[-1] == pytest.approx(-0.9, abs=0.02)
    assert bench.fit(LEVEL).bic > found.bic + 100.0, "from its start"
    assert "level" not in [r.effect for r in rivals_of(bench.space, found, "constant")[1]], "where records tell them apart"
    alike = {r.effect: r for r in rivals_of(bench.space, found, "constant", ["level"])[1]}
    assert alike["level"].behind == pytest.approx(0.0, abs=1e-6) and alike["level"].fit.x[-1] == pytest.approx(0.9, abs=0.02)
    better = rivals.of_each_effect(bench.space, found, True, lambda name: ["level"], lambda message: None)[1]
    assert better is not None and better.effects == ("level",), "it has the name"


def test_a_rival_that_loses_its_effect_and_is_worse_takes_no_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reduced, it is a model without the effect: it stays an alternative, and the model keeps its name."""
    bench = Bench({"a": (0.5,)})
    final, rival = bench.fit(A), bench.fit(B)
    found = select._Found(bench.space, bench.fit(), final)
    asked = []

    def of_each(space: object, fit: Fit, may_swap: bool, classes: object, note: object, kept: frozenset[str]) -> object:
        asked.append(kept)
        return {"a": (90.0, [])}, rival if may_swap and "a" not in kept else None

    monkeypatch.setattr(select, "of_each_effect", of_each)
    kept = select._compared(found, lambda effect: (), lambda message: None)
    assert kept.final is final and asked == [set(), {"a"}], "the rivals of other effects may still take a place"
    better = bench.fit(A, C)
    monkeypatch.setattr(select, "of_each_effect", lambda space, fit, *more: ({}, better if fit is final else None))
    monkeypatch.setattr(select, "reduced_by", lambda fit, *more: fit)
    assert select._compared(found, lambda effect: (), lambda message: None).final.effects == better.effects


def test_beside_coloured_noise_only_what_promises_something_is_fitted_to_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before whitening every effect explains some of coloured noise; under a filter of its own error it does not."""
    coloured = lfilter([1.0], [1.0, -0.97], NOISE * np.random.default_rng(3).standard_normal(N))
    ended: list[tuple[str, ...]] = []
    whole = moves.Moves.completed
    monkeypatch.setattr(moves.Moves, "completed", lambda space, fit: ended.append(fit.effects) or whole(space, fit))
    for effects, found in (({}, []), ({"a": (0.8,)}, [("a",)])):
        bench = Bench(effects, allowed=(A, B, C, PLACED), extra=coloured, noise=NOISE)
        fit = bench.fit()
        monkeypatch.setattr(moves.Moves, "quiet", lambda space, fit: True)
        ended.clear()
        grown = bench.space.add(fit)
        assert set(ended) == set(found)
        assert names([f for f in grown if bench.space.worth(f, fit)]) == found


def test_quiet_and_noise_are_ratios_to_the_noise_of_the_velocity() -> None:
    quiet, loud = Bench(), Bench({"a": (0.3,)}, plain=True)
    assert quiet.space.quiet(quiet.fit()) and quiet.space.is_noise(quiet.fit())
    assert quiet.space.ratio(quiet.fit()) == pytest.approx(1.0, abs=0.08)
    assert not loud.space.is_noise(loud.fit()) and loud.space.quiet(loud.fit(A))


# Moves that add.


def test_candidates_are_what_the_model_allows() -> None:
    one, two = Bench(), Bench(masses=2)
    assert GAP not in one.space.candidates(one.fit()) and GAP in two.space.candidates(two.fit())
    beside = two.space.candidates(two.fit(GAP))
    assert RESONANCE not in beside and GAP not in beside
    assert not {LEVEL, GENERAL} & set(one.space.candidates(one.fit(LEVEL))), "one of a family"
    assert LIMIT in one.space.candidates(one.fit())
    plain = Bench(plain=True, loop=True)
    assert LIMIT not in plain.space.candidates(plain.fit())
    assert LIMIT in plain.space.candidates(plain.fit(closed=True))


def test_add_finds_the_effect_and_puts_the_best_first() -> None:
    bench = Bench({"b": (0.4,)}, allowed=(A, B, C))
    found = bench.space.add(bench.fit())
    assert found[0].effects == ("b",)
    assert found[0].x[found[0].parameters.slot("b")] == pytest.approx([0.4], abs=0.02)
    scores = [bench.space.score(f) for f in found]
    assert scores == sorted(scores)


def test_add_grows_a_model_behind_what_it_has() -> None:
    bench = Bench({"b": (0.4,), "c": (-0.3,)}, allowed=(A, B, C))
    assert bench.space.add(bench.fit(B))[0].effects == ("b", "c")
    assert bench.space.add(bench.fit(C))[0].effects == ("c", "b")


def test_add_is_remembered() -> None:
    bench = Bench({"b": (0.4,)}, allowed=(A, B))
    fit = bench.fit()
    assert bench.space.add(fit) is bench.space.add(fit)


def test_add_ends_at_the_most_effects_and_where_only_noise_is_left() -> None:
    bench = Bench({"a": (0.3,), "b": (0.3,)}, allowed=(A, B, C))
    small = replace(bench.space, policy=replace(POLICY, most_effects=1))
    assert small.add(bench.fit(A)) == []
    assert bench.space.add(bench.fit(A, B)) == [], "no linearised gain is near a penalty: no fit is spent"
    assert replace(bench.space, allowed=()).add(bench.fit()) == []


def test_a_generalisation_is_added_in_the_place_of_what_it_contains() -> None:
    bench = Bench({"general": (0.5, 0.3)}, allowed=(A, LEVEL, GENERAL))
    from_nothing = bench.space.add(bench.fit())
    assert from_nothing[0].effects == ("general",) and ("level",) in names(from_nothing)
    from_level = bench.space.add(bench.fit(LEVEL))
    assert from_level[0].effects == ("general",)
    assert all(len(set(f.effects) & {"level", "general"}) == 1 for f in from_level)


def test_a_generalisation_is_worth_two_penalties() -> None:
    for size, counts in ((0.0, False), (0.3, True)):
        bench = Bench({"general": (0.5, size)})
        assert bench.space.worth(bench.fit(GENERAL), bench.fit(LEVEL)) is counts


def test_a_generalisation_that_changes_less_than_the_simulation_is_exact_to_is_none() -> None:
    """However significant it is: the error of a simulation is a share of what the effects change."""
    for share, counts in ((0.2, False), (5.0, True)):
        detail = share * POLICY.simulation_exact * 5.0
        bench = Bench({"level": (5.0,)}, extra=detail * wave(13.7), noise=1e-5, allowed=(A, LEVEL, GENERAL))
        level, general = bench.fit(LEVEL), bench.fit(GENERAL)
        assert bench.space.score(general) < bench.space.score(level) - 100.0, "significant in either case"
        assert bench.space.worth(general, level) is counts
        rivals = [r.effect for r in rivals_of(bench.space, level, "level")[1]]
        assert ("general" in rivals) is counts


def test_what_effects_change_is_asked_of_a_spring_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spring is no effect, but it is one more of what a simulation may only seem to lack."""
    bench = Bench({"level": (5.0,)}, noise=1e-5)
    level = bench.fit(LEVEL)
    sprung = replace(level.parameters)
    monkeypatch.setattr(Parameterisation, "on_a_spring", property(lambda p: p is sprung))
    hypothesis = Hypothesis(sprung, level.predictor)
    with_spring = replace(level, hypothesis=hypothesis, x=level.x + np.array([1e-4, 0.0, 0.0]), bic=level.bic - 1000.0)
    assert bench.space.score(with_spring) < bench.space.score(level)
    assert not bench.space.worth(with_spring, level)


def test_the_neutral_case_of_a_generalisation_scores_as_the_simpler_effect() -> None:
    bench = Bench({"level": (0.5,)})
    level, general = bench.fit(LEVEL), bench.fit(GENERAL)
    # The same signal, under the filter of the same errors: the same score as that of the level itself.
    assert bench.space.neutral_score(level, general) == pytest.approx(bench.space.score(level), abs=1e-6)
    assert bench.space.neutral_score(bench.fit(), bench.fit(A)) == np.inf, "no generalisation"


def test_what_was_grown_already_is_known() -> None:
    bench = Bench({"a": (0.4,), "b": (0.4,)}, allowed=(A, B))
    fit = bench.fit(A)
    bench.space.add(fit)
    near = replace(fit, bic=fit.bic - 0.5 * POLICY.swap)
    better = replace(fit, bic=fit.bic - 2.0 * POLICY.swap)
    assert bench.space.known(near) is fit
    assert bench.space.known(better) is better
    assert bench.space.known(bench.fit(B)).effects == ("b",)


# Moves that reduce.


HANGING = toy("hanging", [(0.3, 0.5)], nested=("placed",), shared={"placed": (1,)}, beside=frozenset({"a"}))


def test_without_what_an_effect_stands_on_it_becomes_what_it_contains(monkeypatch: pytest.MonkeyPatch) -> None:
    """At its level there: the pulse stands at 0.52, and a fit from another place does not feel it."""
    monkeypatch.setitem(SHAPES, "hanging", lambda z: z[0] * wave(13.7) + pulse(z[1]))
    bench = Bench({"placed": (0.52,), "a": (0.4,), "b": (0.4,)})
    fit = bench.fit(A, B, HANGING)
    assert fit.x[fit.parameters.slot("hanging")][1] == pytest.approx(0.52, abs=0.01)
    less = bench.space.without(fit, "a")
    assert less.effects == ("b", "placed")
    assert less.x[less.parameters.slot("placed")] == pytest.approx([0.52], abs=0.01)
    assert bench.space.without(fit, "b").effects == ("a", "hanging"), "what it stands on is still there"
    assert bench.space.without(fit, "hanging").effects == ("a", "b")
    assert names(bench.space.drop(fit)) == [("b", "placed"), ("a", "hanging"), ("a", "b")]


def test_without_an_effect_beside_impacts_their_place_is_searched_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_space, "ObserverLoop", HalfFollowed)
    hit = replace(VALLEY, place="coupling")
    bench = Bench({"valley": (0.52,)}, masses=2, extra=DRIFT, loop=True)
    stuck = bench.fit(hit, A)
    assert abs(stuck.x[stuck.parameters.slot("valley")][0] - 0.52) > 0.1
    less = bench.space.without(stuck, "a")
    assert less.effects == ("valley",) and less.predictor.closed and less.x[-1] == pytest.approx(0.52, abs=2e-3)
    assert abs(bench.space.without(bench.fit(VALLEY, A), "a").x[-1] - 0.52) > 0.1, "no impacts"
    open_loop = Bench({"valley": (0.52,)}, masses=2)
    assert abs(open_loop.space.without(open_loop.fit(hit, A), "a").x[-1] - 0.52) > 0.1, "no loop in which they are searched"
    monkeypatch.setattr(moves.Moves, "evolved", lambda space, fit: replace(fit, bic=fit.bic + 1.0, x=fit.x + 0.3))
    worse = bench.space.without(stuck, "a")
    assert abs(worse.x[-1] - stuck.x[stuck.parameters.slot("valley")][0]) < 0.1, "a search that finds worse changes nothing"
    monkeypatch.setattr(moves.Moves, "quiet", lambda space, fit: True)
    monkeypatch.setattr(moves.Moves, "evolved", lambda space, fit: replace(fit, bic=-1e9))
    assert bench.space.without(stuck, "a").bic > -1e9, "nothing but noise is left"


def test_drop_leaves_out_each_effect_and_the_needless_one_goes() -> None:
    bench = Bench({"a": (0.4,)})
    both = bench.fit(A, B)
    without_a, without_b = bench.space.drop(both)
    assert names([without_a, without_b]) == [("b",), ("a",)]
    assert bench.space.prefers(without_b, both) and not bench.space.prefers(without_a, both)
    assert bench.space.drop(bench.fit()) == []


def test_simplify_takes_a_detail_back_that_is_not_there() -> None:
    for size, back in ((0.0, True), (0.3, False)):
        bench = Bench({"general": (0.5, size)})
        full = bench.fit(GENERAL, A)
        (simpler,) = bench.space.simplify(full)
        assert set(simpler.effects) == {"level", "a"}
        assert simpler.x[simpler.parameters.slot("level")] == pytest.approx([0.5], abs=0.01 + 0.15 * size)
        assert bench.space.prefers(simpler, full) is back
    assert bench.space.simplify(bench.fit(LEVEL)) == []
    assert replace(bench.space, allowed=(A, GENERAL)).simplify(bench.fit(GENERAL)) == [], "level is not allowed here"


def test_demote_makes_one_mass_where_the_second_explains_nothing() -> None:
    """One mass spans the first two base signals: the truth has no more, or all six."""
    for base, back in (((1.0, 1.0, 0.0, 0.0, 0.0, 0.0), True), ((1.0, 1.0, 0.4, 0.4, 0.4, 0.4), False)):
        bench = Bench({"a": (0.4,)}, masses=2, base=base, allowed=(A,))
        two = bench.fit(A)
        (one,) = bench.space.demote(two)
        assert one.parameters.masses == 1 and one.effects == ("a",)
        assert bench.space.prefers(one, two) is back


def test_demote_tries_another_effect_in_series_with_the_one_mass() -> None:
    """Two masses with the wrong one of two delays are as good as one mass with the right one."""
    one, two, shaft = replace(A, place="actuator"), replace(B, place="actuator"), LEVEL
    bench = Bench(
        {"b": (0.4,)}, masses=2, base=(1.0, 1.0, 0.0, 0.0, 0.0, 0.0), extra=-0.2 * wave(12.0), allowed=(one, two, shaft)
    )
    same, other = bench.space.demoted(bench.fit(one))
    assert same.effects == ("a",) and other.effects == ("b",) and other.parameters.masses == 1
    assert other.bic < same.bic
    assert [f.effects for f in bench.space.demoted(bench.fit(shaft))] == [("level",)], "no delay"


def test_demote_takes_the_spring_away_where_it_explains_nothing() -> None:
    """One mass on a spring spans the first three base signals: the third is there, or it is not."""
    for size, back in ((0.0, True), (0.4, False)):
        bench = Bench({"a": (0.4,)}, extra=size * BASE[2])
        parameters = Parameterisation.of(SPRUNG, SCALES, [False]).extended(A)
        hypothesis = Hypothesis(parameters, Toy(bench.data))
        sprung = bench.space.refitted(hypothesis, bench.start(hypothesis))
        (free,) = bench.space.demote(sprung)
        assert free.parameters.kind == "one mass" and free.effects == ("a",)
        assert bench.space.prefers(free, sprung) is back
        # It begins at the gain, the damping and the effects that the fit on the spring has.
        start, x = mechanisms.released(sprung)
        base = sprung.parameters.base_values(sprung.x[None, :])[0]
        assert start.parameters.base_values(x[None, :])[0] == pytest.approx(base[:2])
        assert x[start.parameters.slot("a")] == pytest.approx(sprung.x[parameters.slot("a")])


def test_demote_keeps_what_needs_two_masses() -> None:
    bench = Bench({"a": (0.4,)}, masses=2)
    assert bench.space.demote(bench.fit()) == [], "the linear model was chosen by the bases"
    assert bench.space.demote(bench.fit(GAP)) == [] and bench.space.demote(bench.fit(RESONANCE)) == []
    assert bench.space.demote(bench.fit(A, masses=1)) == []


def test_ground_puts_one_mass_on_a_spring_where_the_error_follows_the_angle(monkeypatch: pytest.MonkeyPatch) -> None:
    def answered(toy: Toy, parameters: Parameterisation, x: Vector, torques: Matrix) -> Matrix:
        """A torque -theta answers as the third base parameter does, which is the spring's; a constant does not."""
        return np.vstack([BASE[2], np.zeros(N)]) if len(torques) == 2 else np.zeros_like(torques)

    monkeypatch.setattr(Toy, "torque_response", answered)
    bench = Bench({"a": (1.0,)}, extra=0.7 * BASE[2])
    free = bench.fit(A)
    (sprung,) = bench.space.ground(free)
    assert sprung.parameters.on_a_spring and not free.parameters.on_a_spring and sprung.effects == ("a",)
    left = [float(np.std(bench.task.objective.error(f))) for f in (sprung, free)]
    assert left[0] < 1.05 * NOISE and left[1] > 3.0 * NOISE
    assert bench.space.score(sprung) < bench.space.score(free)
    assert Bench({"a": (1.0,)}).space.ground(Bench({"a": (1.0,)}).fit(A)) == []


def test_ground_begins_at_the_balance_too_where_nothing_but_a_spring_may_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(moves, "balanced_on_a_spring", lambda data: SPRUNG)
    bench = Bench({"a": (0.6,)}, extra=0.7 * BASE[2], plain=True)
    free = bench.fit()
    (sprung,) = bench.space.ground(free)
    assert sprung.parameters.on_a_spring and bench.space.score(sprung) < bench.space.score(free)
    assert bench.space.ground(bench.fit(A)) == [], "beside effects the linear test alone says how stiff it is"
    still = Bench(plain=True)
    assert still.space.ground(still.fit()) == [], "nothing is left to explain"
    driven = Bench({"a": (0.6,)}, extra=-0.7 * BASE[2], plain=True)
    assert driven.space.ground(driven.fit()) == [], "a negative stiffness is no spring"
    monkeypatch.setattr(moves, "balanced_on_a_spring", lambda data: None)
    assert bench.space.ground(free) == [], "the balance shows none"


def test_close_shows_friction_in_its_loop_where_the_open_one_drifts_away() -> None:
    bench = Bench({"level": (0.4,)}, extra=DRIFT, loop=True)
    fit = ls.fit(bench.space.objective, bench.hypothesis(LEVEL), bench.start(bench.hypothesis(LEVEL)), WHITE, 10)
    assert not bench.space.quiet(fit)
    (closed,) = bench.space.close(fit)
    assert closed.predictor.closed and closed.effects == fit.effects
    assert bench.space.prefers(closed, fit), "the same effects: the score alone decides"
    assert not bench.space.prefers(fit, closed)


def test_close_has_nothing_to_do() -> None:
    bench = Bench({"level": (0.4,)}, loop=True)
    assert bench.space.close(bench.fit(LEVEL)) == [], "nothing but noise is left"
    drifting = Bench({"level": (0.4,)}, extra=DRIFT, loop=True)
    rough = ls.fit(drifting.space.objective, drifting.hypothesis(A), np.ones(3), WHITE, 10)
    assert drifting.space.close(rough) == [], "no friction that would rest"
    assert drifting.space.close(drifting.fit(LEVEL, closed=True)) == [], "closed already"
    for other in (Bench({"level": (0.4,)}, extra=DRIFT), Bench({"level": (0.4,)}, extra=DRIFT, loop=True, plain=True)):
        assert other.space.close(other.fit(LEVEL)) == [], "no loop to be closed, or output errors"


def test_exchange_tries_an_equivalent_effect_beside_a_harmonic() -> None:
    bench = Bench({"seen": (0.4,), "ripple": (0.5, 0.2)})
    fit = bench.fit(LAG, RIPPLE)
    (other,) = bench.space.exchange(fit)
    assert set(other.effects) == {"seen", "ripple"}
    assert bench.space.prefers(other, fit) and not bench.space.prefers(fit, other)
    assert bench.space.exchange(bench.fit(LAG)) == [], "alone they are the same"
    logged = Bench({"seen": (0.4,), "ripple": (0.5, 0.2)}, angle=True)
    assert logged.space.exchange(logged.fit(LAG, RIPPLE)) == [], "a logged angle tells"
    assert replace(bench.space, allowed=(LAG, RIPPLE)).exchange(fit) == []


def test_an_effect_of_the_shaft_goes_to_the_other_side_where_it_explains_more() -> None:
    """Of two masses; what acts at the far end is no candidate of its own, and is found from the near one."""
    bench = Bench({"far": (0.6,)}, masses=2, allowed=(NEAR, A, RESONANCE), plain=True)
    near, far = bench.fit(NEAR), bench.fit(FAR)
    (other,) = bench.space.other_side(near)
    assert other.effects == ("far",) and bench.space.prefers(other, near) and not bench.space.quiet(near)
    assert bench.space.at_other_side(far, FAR) is not None and not bench.space.prefers(near, far)
    assert bench.space.other_side(far) == [], "where it leaves noise nothing is tried"
    assert FAR not in bench.space.candidates(bench.fit())
    assert bench.space.add(bench.fit())[0].effects == ("far",)
    # Not in one mass, not where a resonance changes the mechanism, and not where it is there already.
    assert bench.space.at_other_side(bench.fit(NEAR, masses=1), NEAR) is None
    assert bench.space.at_other_side(bench.fit(NEAR, RESONANCE), NEAR) is None
    assert bench.space.at_other_side(bench.fit(NEAR, FAR), NEAR) is None
    assert bench.space.demote(far) == []
    only = Bench({"far": (0.6,)}, masses=2, allowed=(A,)).space
    assert not only.may(FAR) and bench.space.may(FAR)


def test_a_load_makes_two_masses_of_one_with_its_effects_at_the_far_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_space.ModelSpace, "swings", lambda space, fit: True)  # the toy's numbers are no mechanism
    bench = Bench({"far": (0.6,)}, masses=2, allowed=(NEAR, A))
    one = bench.fit(NEAR, masses=1)
    (loaded,) = bench.space.with_a_load(one)
    assert loaded.parameters.masses == 2 and loaded.effects == ("far",)
    assert loaded.x[-1] == pytest.approx(0.6, abs=0.02) and bench.space.score(loaded) < bench.space.score(one)
    assert ("far",) in names(bench.space.add(one)), "add tries it, too"
    assert bench.space.with_a_load(bench.fit(NEAR)) == [], "two masses have a load"
    assert bench.space.with_a_load(bench.fit(A, masses=1)) == [], "what is not of the shaft has no other end"
    still = Bench({"near": (0.6,)}, allowed=(NEAR, A))
    assert still.space.with_a_load(still.fit(NEAR)) == [], "nothing is left to explain"


def test_elsewhere_looks_for_the_resonance_of_two_masses_beside_their_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mechanisms, "LIBRARY", LIBRARY)
    bench = Bench({"a": (0.4,)}, masses=2, allowed=(A, GAP))
    there = bench.fit(A)
    (other,) = bench.space.elsewhere(there)
    assert other.parameters.masses == 2 and other.effects == ("a",)
    assert other.x[-1] == pytest.approx(0.4, abs=0.02)
    assert bench.space.with_best_resonance(there) is min((there, other), key=bench.space.score)
    without = bench.space.elsewhere(bench.fit(A, GAP))
    assert names(without) == [("a",)], "what may stand for a resonance at the wrong place is left out"
    assert bench.space.elsewhere(bench.fit()) == [] and bench.space.elsewhere(bench.fit(A, masses=1)) == []
    assert bench.space.elsewhere(bench.fit(A, FAR)) == []


def test_two_masses_that_leave_more_than_noise_are_tried_behind_a_lag(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mechanisms, "LIBRARY", LIBRARY)
    monkeypatch.setattr(model_space.ModelSpace, "swings", lambda space, fit: True)  # the toy's numbers are no mechanism
    late = replace(LAG, late=True, place="actuator")
    bench = Bench({"lag": (1.5,)}, masses=2, allowed=(A, late))
    without = bench.fit(A)
    found = bench.space.behind_a_lag(without)
    assert found.effects == ("a", "lag") and found.x[-1] == pytest.approx(1.5, abs=0.02)
    assert bench.space.score(found) < bench.space.score(without)
    for fit in (bench.fit(A, masses=1), bench.fit(A, FAR), bench.fit(late), found):
        assert bench.space.behind_a_lag(fit) is fit, "no shaft, effects behind it, a lag that is there, or nothing left"
    none = replace(bench.space, allowed=(A,))
    assert none.behind_a_lag(without) is without


def test_dry_friction_is_tried_at_both_ends() -> None:
    bench = Bench({"near": (0.5,), "far": (0.6,)}, masses=2, allowed=(NEAR, A), plain=True)
    assert ("near", "far") in names(bench.space.at_the_load(bench.fit(NEAR), [bench.fit(NEAR, A)]))
    grown = bench.space.add(bench.fit(NEAR))
    assert sorted(grown[0].effects) == ["far", "near"]
    assert bench.space.worth(grown[0], bench.fit(NEAR)) and bench.space.worth(grown[0], bench.fit(FAR))


@pytest.mark.parametrize("size", [0.05, 0.6])
def test_what_shows_at_the_far_end_alone_is_screened_there(size: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SHAPES, "far", lambda z: z[0] * wave(25.3))
    monkeypatch.setattr(model_space.ModelSpace, "swings", lambda space, fit: True)  # the toy's numbers are no mechanism
    bench = Bench({"far": (size,)}, masses=2, allowed=(NEAR, A), plain=True)
    assert bench.space.screened_at_load(bench.fit()) == [FAR]
    assert bench.space.screened_at_load(bench.fit(NEAR)) == [FAR]
    assert bench.space.screened_at_load(bench.fit(FAR)) == []
    assert bench.space.screened_at_load(bench.fit(masses=1)) == []
    assert bench.space.add(bench.fit())[0].effects == ("far",)


def test_where_the_near_end_leaves_noise_the_far_end_is_a_rival_only() -> None:
    bench = Bench({"near": (0.6,)}, masses=2, allowed=(NEAR, A), plain=True)
    found = bench.space.add(bench.fit())
    assert found[0].effects == ("near",) and ("far",) not in names(found)
    gain, rivals = rivals_of(bench.space, found[0], "near")
    assert gain > 100.0 and rivals == [], "the far end is told apart"
    weak = Bench({"near": (0.025,)}, masses=2, allowed=(NEAR, A), plain=True)
    _, rivals = rivals_of(weak.space, weak.fit(NEAR), "near")
    assert [r.effect for r in rivals] == ["far"]


def test_one_mass_with_a_resonance_is_two_masses() -> None:
    bench = Bench({"resonance": (70.0, 0.3, 40.0, 0.1)})
    fit = bench.space.canonical(bench.fit(RESONANCE, A))
    assert fit.parameters.masses == 2 and fit.effects == ("a",)
    assert bench.space.canonical(bench.fit(A)).parameters.masses == 1


def test_as_own_resonance_puts_the_resonance_into_the_two_masses_alone_and_with_a_simple_effect() -> None:
    actuator = toy("c", [(0.5,)], place="actuator")
    bench = Bench({"c": (0.4,)}, masses=2, allowed=(A, actuator, GENERAL, RESONANCE))
    tries = bench.space.as_own_resonance(bench.fit(RESONANCE))
    assert names(tries) == [(), ("c",)], "neither at the shaft nor of more than one number"
    assert all(f.parameters.masses == 2 for f in tries)
    assert min(tries, key=bench.space.score).effects == ("c",)
    assert bench.space.as_own_resonance(bench.fit(A)) == [] and bench.space.as_own_resonance(bench.fit(RESONANCE, masses=1)) == []


# The same model again.


def test_only_a_resonance_that_leads_becomes_the_mechanisms_own(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, ...]] = []

    def as_own_resonance(space: moves.Moves, fit: Fit) -> list[Fit]:
        asked.append(fit.effects)
        return []

    monkeypatch.setattr(moves.Moves, "as_own_resonance", as_own_resonance)
    other = Bench({"a": (0.5,)}, masses=2, allowed=(A, RESONANCE))
    assert {("a",), ("resonance",)} <= set(names(other.space.add(other.fit())))
    resonance = Bench({"resonance": (70.0, 0.3, 40.0, 0.1)}, masses=2, allowed=(A, RESONANCE))
    resonance.space.add(resonance.fit())
    assert asked == [("a",), ("resonance",)]


def test_restarted_leaves_a_start_that_led_nowhere() -> None:
    """The pulse stands at 0.52, and a fit from 0.1 does not feel it."""
    bench = Bench({"placed": (0.52,)})
    stuck = bench.fit(PLACED)
    assert abs(stuck.x[-1] - 0.52) > 0.2
    found = bench.space.restarted(stuck, PLACED)
    assert found.x[-1] == pytest.approx(0.52, abs=2e-3) and found.bic < stuck.bic
    assert bench.space.restarted(stuck, toy("placed", [])) is stuck, "no starts"


def test_evolved_finds_a_valley_nearby_that_no_slope_leads_to() -> None:
    bench = Bench({"valley": (0.52,)})
    stuck = bench.fit(VALLEY)
    assert abs(stuck.x[-1] - 0.52) > 0.1
    found = bench.space.evolved(stuck)
    assert found.x[-1] == pytest.approx(0.52, abs=2e-3)
    assert bench.space.evolved(stuck) is found, "remembered"


def test_deepened_searches_near_impacts_until_nothing_more_is_gained(monkeypatch: pytest.MonkeyPatch) -> None:
    hit = replace(VALLEY, place="coupling")
    bench = Bench({"valley": (0.52,)}, masses=2)
    stuck = bench.fit(hit)
    assert hit.impacts and not VALLEY.impacts and abs(stuck.x[-1] - 0.52) > 0.1
    found = bench.space.deepened(stuck)
    assert found.x[-1] == pytest.approx(0.52, abs=2e-3) and bench.space.score(found) < bench.space.score(stuck)
    without = bench.fit(VALLEY)
    assert bench.space.deepened(without) is without, "no impacts"
    # It ends after two draws in a row that gain less than the margin; a search that finds worse changes nothing.
    margin, asked = bench.space.margin, []
    gains = iter([2.0 * margin, 2.0 * margin, 0.5 * margin, 3.0 * margin, -margin, 0.2 * margin])

    def evolved(space: object, fit: Fit, draw: int) -> Fit:
        asked.append(draw)
        return replace(fit, bic=fit.bic - next(gains))

    monkeypatch.setattr(type(bench.space), "evolved", evolved)
    monkeypatch.setattr(type(bench.space), "refitted", lambda space, hypothesis, x, iterations=0: replace(stuck, bic=1e9))
    assert bench.space.deepened(stuck).bic == pytest.approx(stuck.bic - 7.7 * margin) and asked == [0, 1, 2, 3, 4, 5]
    gains = iter([-5.0 * margin, -5.0 * margin])
    assert bench.space.deepened(stuck) is stuck
    monkeypatch.setattr(type(bench.space), "quiet", lambda space, fit: True)
    gains = iter([-5.0 * margin])
    assert bench.space.deepened(stuck) is stuck, "what leaves noise is searched once"


def test_where_one_with_impacts_leads_all_of_them_are_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench({"gap": (0.5,)}, masses=2)
    gap, alike, plain = (bench.fit(t) for t in (IMPACTS, replace(IMPACTS, name="a"), B))
    monkeypatch.setattr(type(bench.space), "evolved", lambda space, fit: replace(fit, bic=fit.bic - 1.0))
    monkeypatch.setattr(type(bench.space), "quiet", lambda space, fit: False)
    bare = bench.fit()
    found = bench.space.searched_alike(bare, [gap, alike, plain])
    assert [f.bic for f in found] == [gap.bic - 1.0, alike.bic - 1.0, plain.bic]
    leads = replace(plain, bic=gap.bic - 1e3)
    assert bench.space.searched_alike(bare, [gap, leads]) == [gap, leads], "another effect leads"
    assert bench.space.searched_alike(gap, [gap, alike]) == [gap, alike], "beside a gap that is there already"


@pytest.mark.parametrize(("noise", "left", "alike"), [(True, 0.9, False), (False, 0.9, True), (False, 0.2, False)])
def test_where_impacts_leave_much_of_the_error_the_others_are_rivals(
    monkeypatch: pytest.MonkeyPatch, noise: bool, left: float, alike: bool
) -> None:
    """Its search may have missed the minimum of either; not where it leaves noise, nor where it explains most of the error."""
    bench = Bench({"gap": (0.5,)}, masses=2)
    gap, other = bench.fit(IMPACTS), bench.fit(replace(IMPACTS, name="b"))
    assert other.bic > gap.bic + 10.0 * bench.space.margin, "far behind"
    space = type(bench.space)
    monkeypatch.setattr(space, "add", lambda self, fit: [other])
    monkeypatch.setattr(space, "instead", lambda self, fit, term: [other])
    monkeypatch.setattr(space, "deepened", lambda self, fit: fit)
    monkeypatch.setattr(space, "small_unwhitened", lambda self, fit: noise)
    monkeypatch.setattr(space, "unwhitened_cost", lambda self, fit: left if fit is gap else 1.0)
    assert [r.effect for r in rivals_of(bench.space, gap, "gap")[1]] == (["b"] if alike else [])


def test_rivals_are_in_the_order_after_their_search(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench({"gap": (0.5,)}, masses=2)
    gap = bench.fit(IMPACTS)
    near, far = (
        replace(bench.fit(replace(IMPACTS, name=name)), bic=gap.bic + behind) for name, behind in (("b", 1.0), ("c", 2.0))
    )
    space = type(bench.space)
    monkeypatch.setattr(space, "extended", lambda self, fit: [near, far])
    monkeypatch.setattr(space, "quiet", lambda self, fit: False)
    monkeypatch.setattr(space, "deepened", lambda self, fit: replace(far, bic=gap.bic - 5.0) if fit is far else fit)
    assert [r.effect for r in rivals_of(bench.space, gap, "gap")[1]] == ["c", "b"]


def test_another_effect_with_impacts_is_searched_in_the_place_of_one() -> None:
    other = replace(VALLEY, place="coupling")
    bench = Bench({"valley": (0.52,)}, masses=2, allowed=(IMPACTS, other, A))
    (found,) = bench.space.instead(bench.fit(IMPACTS, A), IMPACTS)
    assert found.effects == ("a", "valley") and found.x[-1] == pytest.approx(0.52, abs=2e-3)


def test_in_the_place_of_an_effect_another_is_fitted_beside_the_values_of_the_rest() -> None:
    """Where it was fitted the impacts lay elsewhere: it seemed far behind. It is searched globally within its reach alone."""
    hit = replace(VALLEY, place="coupling")
    bench = Bench({"valley": (0.52,), "a": (0.4,)}, masses=2)
    fit = bench.space.deepened(bench.fit(hit, A))
    assert fit.x[fit.parameters.slot("valley")] == pytest.approx(0.52, abs=2e-3)
    stuck = bench.fit(hit, B)
    assert abs(stuck.x[stuck.parameters.slot("valley")] - 0.52) > 0.1
    near = bench.space.in_its_place(fit, A, stuck, 0.0)
    assert near.effects == ("valley", "b") and bench.space.score(near) < bench.space.score(stuck)
    # b explains a's part badly and shifts the valley a little: a third of a width, where the start was three widths away.
    assert near.x[near.parameters.slot("valley")] == pytest.approx(0.52, abs=0.01)


def test_in_the_place_of_an_effect_what_is_within_reach_is_searched_globally(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench({"a": (0.4,), "gap": (0.5,)}, masses=2)
    fit, other = bench.fit(IMPACTS, A), bench.fit(IMPACTS, B)
    asked: list[Fit] = []
    monkeypatch.setattr(type(bench.space), "deepened", lambda space, f: asked.append(f) or f)
    behind = bench.space.score(other) - bench.space.score(fit)
    assert behind > 0.0
    bench.space.in_its_place(fit, A, other, 0.5 * behind)
    assert not asked, "too far behind"
    assert bench.space.in_its_place(fit, A, other, 2.0 * behind) is asked[0]


def test_demoted_takes_a_linear_model_too() -> None:
    bench = Bench({"a": (0.4,)}, masses=2)
    (one,) = bench.space.demoted(bench.fit())
    assert one.parameters.masses == 1 and one.effects == ()
    assert bench.space.demoted(one) == [] and bench.space.demoted(bench.fit(GAP)) == []


def test_search_goes_by_all_starts_and_globally_and_never_makes_worse() -> None:
    for term, name in ((PLACED, "placed"), (VALLEY, "valley")):
        bench = Bench({name: (0.52,)}, noise=0.02)
        stuck = ls.fit(bench.space.objective, bench.hypothesis(term), bench.start(bench.hypothesis(term)), WHITE, 8)
        assert not bench.space.quiet(stuck)
        found = bench.space.search(stuck)
        assert found.x[-1] == pytest.approx(0.52, abs=2e-3) and found.bic < stuck.bic
        assert bench.space.search(found) is found, "nothing but noise is left"
    beyond = Bench(extra=0.5 * np.sin(40.0 * S**2), plain=True)
    fit = beyond.fit(VALLEY)
    assert beyond.space.search(fit).bic <= fit.bic


def test_search_ends_under_the_predictor_that_shows_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """A model that grew in closed loop comes out of it where the record shows more without: here it drifts in the loop only."""
    bench = Bench({"a": (0.5,)}, loop=True, noise=1e-3)
    monkeypatch.setattr(type(bench.space), "with_best_resonance", lambda self, fit: fit)
    inside = bench.fit(A, closed=True)
    found = bench.space.search(inside)
    assert not found.predictor.closed and found.bic < inside.bic - 100.0


def test_valleys_are_searched_beside_a_linear_model() -> None:
    bench = Bench({"valley": (0.52,)}, allowed=(A, VALLEY))
    (found,) = bench.space.valleys(bench.fit())
    assert found.effects == ("valley",) and found.x[-1] == pytest.approx(0.52, abs=2e-3)
    assert replace(bench.space, allowed=(A, B)).valleys(bench.fit()) == []


def half_drifting(term: Term, age: float = 0.0, plain: bool = False) -> Fit:
    """A model of two masses in its loop, over a record with half of the drift, under the predictor that says most."""
    bench = Bench({"gap": (0.4,)}, masses=2, extra=0.5 * DRIFT, loop=True, plain=plain)
    data = bench.data.aged(age)
    space = replace(bench.space, objective=replace(bench.space.objective, data=data))
    return space.under_best_predictor(space.refitted(bench.fit(term, closed=True).hypothesis.over(data), np.ones(7)))


def test_a_gap_is_also_fitted_where_a_share_of_the_controller_holds_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_space, "ObserverLoop", HalfFollowed)
    best = half_drifting(IMPACTS)
    assert isinstance(best.predictor, HalfFollowed)
    assert best.x[-1] == pytest.approx(0.4, abs=0.02)


@pytest.mark.parametrize(
    ("term", "age", "plain"),
    [(IMPACTS, 0.5, False), (GAP, 0.0, False), (IMPACTS, 0.0, True)],
    ids=["the velocity is older than the controller's", "no impacts", "output errors"],
)
def test_elsewhere_no_share_of_the_controller_holds_a_model(
    monkeypatch: pytest.MonkeyPatch, term: Term, age: float, plain: bool
) -> None:
    monkeypatch.setattr(model_space, "ObserverLoop", HalfFollowed)
    assert type(half_drifting(term, age=age, plain=plain).predictor) is Toy


# The bootstrap.


@pytest.mark.parametrize("prefilter", [None, Prefilter(DT, 20.0, 60.0, 4)], ids=["raw", "weighed"])
def test_records_that_are_drawn_where_output_errors_count_are_as_slow_as_the_real_one(prefilter: Prefilter | None) -> None:
    """White noise would make the gains of chance too small, and a p-value of a slow misfit too good.

    Noise is drawn as raw errors, and weighed like those of the record.
    """

    def bench(seed: int) -> Bench:
        slow = lfilter([1.0], [1.0, -0.97], 0.05 * np.random.default_rng(seed).standard_normal(N))
        return Bench(extra=slow, plain=True, prefilter=prefilter, noise=1e-3, seed=seed, allowed=(A, PLACED))

    def gain(one: Bench) -> float:
        start = one.fit()
        return start.bic - min(f.bic for f in one.space.add(start))

    true = np.array([gain(bench(seed)) for seed in range(40)])
    one = bench(100)
    fit = one.fit()
    drawn = largest_gains(one.space, fit, fit, 40, 0, lambda message: None)
    for share, most in ((0.5, 2.0), (0.9, 5.0)):  # of white noise the largest are smaller by 6.6
        assert np.quantile(drawn, share) == pytest.approx(np.quantile(true, share), abs=most)
    again = largest_gains(one.space, fit, fit, 3, 0, lambda message: None)
    np.testing.assert_array_equal(again, drawn[:3])


# The same data on another grid of time.


class Finer(Toy):
    """The toy on a grid that is finer, with straight lines in between."""

    def velocities(self, parameters: Parameterisation, X: Matrix) -> Matrix:
        return np.array([finer(row, len(self.data.velocity) // N) for row in super().velocities(parameters, X)])


def finer(x: Vector, times: int) -> Vector:
    return np.interp(np.arange(N * times) / times, np.arange(N), x)


def followed_up(monkeypatch: pytest.MonkeyPatch, times: int, plain: bool) -> tuple[list[tuple[str, ...]], tuple[str, ...]]:
    """(what is fitted to the end beyond the linear model, what comes out best) of one record on a grid so much finer."""
    seen: list[tuple[str, ...]] = []
    completed = moves.Moves.completed

    def noted(space: moves.Moves, fit: Fit) -> Fit:
        seen.append(fit.effects)
        return completed(space, fit)

    with monkeypatch.context() as patch:
        patch.setattr(moves.Moves, "completed", noted)
        for module in (moves, model_space):
            patch.setattr(module, "OpenLoop", Finer)
        bench = Bench({"a": (0.3,), "b": (0.05,), "c": (0.01,)}, allowed=(A, B, C, PLACED, LAG))
        w, still = finer(bench.data.velocity, times), np.zeros(N * times)
        if not plain:  # whitened, each sample counts: the sensor's noise is on each
            clean = Bench({"a": (0.3,), "b": (0.05,), "c": (0.01,)}, noise=0.0).data.velocity
            w = finer(clean, times) + NOISE * np.random.default_rng(times).standard_normal(N * times)
        rec = ga.Record(DT / times, None, w, still)
        data = replace(DataSet.of([rec], None), moving=(False,))  # the noise is what the record shows: straight lines show less
        family = OutputErrors(100.0) if plain else Innovations()
        objective = Objective(data, np.ones(N * times), family)
        space = Task(objective, replace(SCALES, dt=DT / times), ONE, (A, B, C, PLACED, LAG), lambda message: None).space()
        hypothesis = Hypothesis(Parameterisation.of(ONE, SCALES, [False]), Finer(data))
        grown = space.add(space.refitted(hypothesis, np.ones(2)))
    return seen, grown[0].effects


@pytest.mark.parametrize("plain", [False, True])
def test_what_is_followed_up_is_the_same_however_finely_a_record_is_sampled(monkeypatch: pytest.MonkeyPatch, plain: bool) -> None:
    first, best = followed_up(monkeypatch, 1, plain)
    assert best == ("a",) and len(first) > 2 * plain  # whitened, the others promise too little to be fitted
    for times in (4, 10):
        found, same = followed_up(monkeypatch, times, plain)
        assert same == best, times
        # Output errors contain the same evidence; whitened ones with the noise of more samples contain more, which drops nothing.
        assert sorted(found) == sorted(first) if plain else set(found) >= set(first), times


def test_no_number_of_the_policy_counts_for_each_sample() -> None:
    """Evidence counts as a whole, or for each independent sample: the same data at 1 kHz and at 100 Hz decide alike."""
    assert not [r.name for r in rows() if "per sample" in r.unit]


# Harmonics with several waves.


def waves_of(z: Vector, grows: bool) -> Vector:
    """Sum of a cos(n x) + b sin(n x), whose size grows over the record or does not."""
    x = 3.3 * np.pi * S
    parts = [a * np.cos(n * x) + b * np.sin(n * x) for a, b, n in np.asarray(z).reshape(-1, 3)]
    return np.asarray(sum(parts) * (0.3 + 1.4 * S if grows else 1.0))


def harmonic(name: str, kind: str, **more: object) -> Cause:
    term = toy(name, [(0.1, 0.1, 7.0)], harmonic=kind, orders=(2, 40), most_waves=4, **more)
    # As of a real one, a search chooses the order and no slope moves it.
    return replace(term, steps=lambda s: (0.5, 0.5, 0.0), limits=lambda s: [(-10.0, 10.0), (-10.0, 10.0), (2.0, 40.0)])


STEADY = harmonic("steady", "torque", other_side="steady far")
GROWING = harmonic("growing", "velocity")
STEADY_FAR = harmonic("steady far", "torque", other_side="steady", at_load=True)
HARMONICS = (A, STEADY, GROWING)
FIRST, SECOND, THIRD = (0.5, 0.2, 5.0), (-0.3, 0.3, 8.0), (0.2, -0.3, 11.0)


@pytest.fixture
def harmonics(monkeypatch: pytest.MonkeyPatch) -> None:
    """The toy's library and shapes with these."""
    with_these = LIBRARY | {t.name: t for t in (STEADY, GROWING, STEADY_FAR)}
    for module in (wave_moves, moves, model_space, noise_level, side_moves):
        monkeypatch.setattr(module, "LIBRARY", with_these)
    monkeypatch.setitem(SHAPES, "steady", lambda z: waves_of(z, False))
    monkeypatch.setitem(SHAPES, "growing", lambda z: waves_of(z, True))
    monkeypatch.setitem(SHAPES, "steady far", lambda z: 0.6 * waves_of(z, False) + 0.3 * waves_of(z, True))


def with_waves(bench: Bench, *parts: tuple[Cause, tuple[tuple[float, ...], ...]]) -> Fit:
    """The model with these waves of each harmonic, refitted from them."""
    hypothesis = bench.hypothesis(*(of_waves(term, len(rows)) for term, rows in parts))
    x = np.concatenate([np.ones(hypothesis.parameters.base), *(np.array(rows).ravel() for _, rows in parts)])
    return bench.space.refitted(hypothesis, x)


def orders(model: Fit) -> dict[str, list[float]]:
    parameters = model.parameters
    return {t.name: sorted(t.orders_in(model.x[parameters.slot(t.name)]).tolist()) for t in parameters.terms}


@pytest.mark.usefixtures("harmonics")
def test_several_waves_are_the_coordinates_and_parameters_of_one_after_the_other() -> None:
    two = of_waves(STEADY, 2)
    assert of_waves(STEADY, 1) is STEADY and of_waves(STEADY, 2) is two
    assert (two.size, two.waves, two.components) == (6, 2, 3)
    assert two.orders_in(np.array([*FIRST, *SECOND])).tolist() == [5.0, 8.0]
    assert two.limits(SCALES) == 2 * STEADY.limits(SCALES) and two.steps(SCALES) == 2 * STEADY.steps(SCALES)
    assert two.search_cost == 2.0 * STEADY.search_cost
    assert two.strongest_first(np.array([0.1, 1.0, 2.0, 0.3, 4.0, 5.0])).tolist() == [3, 4, 5, 0, 1, 2]


@pytest.mark.usefixtures("harmonics")
def test_each_wave_costs_what_an_effect_does_and_makes_another_model() -> None:
    bench = Bench(allowed=HARMONICS)
    one, two = with_waves(bench, (STEADY, (FIRST,))), with_waves(bench, (STEADY, (FIRST, SECOND)))
    for model, count in ((one, 1), (two, 2)):
        cost = bench.space.score(model) - model.bic
        assert cost == pytest.approx(count * (bench.space.penalty + 2.0 * np.log(39.0))) and causes(model) == count
    assert bench.space.key(one) != bench.space.key(two) and one.effects == two.effects == ("steady",)


@pytest.mark.usefixtures("harmonics")
def test_a_wave_that_is_there_is_worth_it_and_one_that_is_not_goes() -> None:
    bench = Bench({"steady": (*FIRST, *SECOND)}, allowed=HARMONICS)
    one, two = with_waves(bench, (STEADY, (FIRST,))), with_waves(bench, (STEADY, (FIRST, SECOND)))
    three = with_waves(bench, (STEADY, (FIRST, SECOND, THIRD)))
    assert bench.space.worth(two, one) and not bench.space.worth(three, two)
    fewer = bench.space.fewer_waves(three)
    assert [orders(f)["steady"] for f in fewer] == [[8.0, 11.0], [5.0, 11.0], [5.0, 8.0]]
    assert [bench.space.prefers(f, three) for f in fewer] == [False, False, True]
    assert not any(bench.space.prefers(f, two) for f in bench.space.drop(two)) and len(bench.space.drop(two)) == 3
    assert bench.space.fewer_waves(one) == []


@pytest.mark.usefixtures("harmonics")
def test_a_wave_found_as_another_effects_becomes_one_of_its_own() -> None:
    """The second wave of one effect was taken for one of the other: as one effect of two waves the model is better."""
    bench = Bench({"steady": (*FIRST, *SECOND)}, allowed=HARMONICS)
    apart = with_waves(bench, (STEADY, (FIRST,)), (GROWING, (SECOND,)))
    assert not bench.space.quiet(apart)
    found = {str(orders(f)): f for f in bench.space.other_wave(apart)}
    assert set(found) == {"{'steady': [5.0, 8.0]}", "{'growing': [5.0, 8.0]}"}
    whole = found["{'steady': [5.0, 8.0]}"]
    assert bench.space.prefers(whole, apart) and not bench.space.prefers(apart, whole) and bench.space.quiet(whole)
    assert bench.space.other_wave(whole) == [], "where only noise is left nothing is tried"


@pytest.mark.usefixtures("harmonics")
def test_one_of_several_waves_becomes_another_effect() -> None:
    bench = Bench({"steady": FIRST, "growing": SECOND}, allowed=HARMONICS)
    together = with_waves(bench, (STEADY, (FIRST, SECOND)))
    found = {str(orders(f)): f for f in bench.space.other_wave(together)}
    assert set(found) == {
        "{'growing': [5.0, 8.0]}",
        "{'steady': [8.0], 'growing': [5.0]}",
        "{'steady': [5.0], 'growing': [8.0]}",
    }
    right = found["{'steady': [5.0], 'growing': [8.0]}"]
    assert bench.space.prefers(right, together) and not bench.space.prefers(together, right)
    wrong = found["{'steady': [8.0], 'growing': [5.0]}"]
    assert bench.space.score(wrong) > bench.space.score(together) and not bench.space.prefers(wrong, together)


@pytest.mark.usefixtures("harmonics")
def test_an_order_that_an_effect_has_is_no_second_wave_and_four_are_the_most() -> None:
    bench = Bench({"steady": (*FIRST, *SECOND, *THIRD)}, allowed=HARMONICS, noise=0.5 * NOISE)
    same = with_waves(bench, (STEADY, (FIRST, SECOND)), (GROWING, (FIRST,)))
    assert not [f for f in bench.space.one_wave_moved(same, same.parameters.term("growing")) if f.effects == ("steady",)]
    full = with_waves(bench, (STEADY, (FIRST, SECOND, THIRD, (0.1, 0.1, 20.0))), (GROWING, ((0.1, 0.1, 9.0),)))
    assert bench.space.one_wave_moved(full, full.parameters.term("growing")) == []


@pytest.mark.usefixtures("harmonics")
def test_all_waves_go_to_the_other_end_of_the_shaft_together() -> None:
    bench = Bench({"steady far": (*FIRST, *SECOND)}, masses=2, allowed=HARMONICS, plain=True)
    near = with_waves(bench, (STEADY, (FIRST, SECOND)))
    far = bench.space.at_other_side(near, near.parameters.term("steady"))
    assert far is not None and orders(far) == {"steady far": [5.0, 8.0]} and bench.space.prefers(far, near)


@pytest.mark.usefixtures("harmonics")
def test_the_core_is_given_all_waves_that_it_knows() -> None:
    one = REAL["cogging"]
    plain = Bench().hypothesis().parameters
    parameters: Parameterisation = plain.extended(of_waves(one, 2))
    x = np.concatenate([np.ones(plain.base), [0.03, 0.04, 5.0, 0.06, 0.08, 8.0]])
    names, values = parameters.values(x[None, :])
    assert names == ("cogging_waves",) and values.shape == (1, plain.base + 12)
    assert values[0, plain.base :].tolist() == pytest.approx(
        [0.05, 5.0, np.arctan2(4.0, 3.0), 0.1, 8.0, np.arctan2(4.0, 3.0), *[0.0] * 6]
    )
    (effect,) = parameters.model(x).effects
    assert (effect.parameters["amplitude"], effect.parameters["order"]) == pytest.approx((0.1, 8.0)), "the strongest first"
    assert plain.extended(one).values(x[None, : plain.base + 3])[0] == ("cogging",)
