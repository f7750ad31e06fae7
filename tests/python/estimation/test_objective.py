"""The objective: noise filters that are a matter of the error alone, and what masked samples and several records do to it."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.mechanics import mechanics_of
from gaident.diagnosis.records.sizes import scales_of
from gaident.estimation import uncertainty
from gaident.estimation.dataset import DataSet
from gaident.estimation.least_squares import fit as fitted
from gaident.estimation.noise_model import WHITE, ShaftNoise
from gaident.estimation.objective import Hypothesis, Innovations, Objective, OutputErrors
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.prefilter import Prefilter
from gaident.estimation.term import Scales
from gaident.estimation.uncertainty import estimates_of

Vector = NDArray[np.float64]

DT, N = 1e-3, 1000
TWO = ga.TwoMass(JM=1e-3, DM=1e-3, JL=2e-3, DL=2e-3, KG=50.0, DG=1e-2).model()


def disturbed_error(rng: np.random.Generator) -> Vector:
    """What a true model leaves under a slow torque, a hum and steps of a load, beside the sensor's noise; sizes drawn wide."""
    t = np.arange(N) * DT
    size = 10.0 ** rng.uniform(-3.0, [1.0, 0.0, 0.0])
    torque = size[1] * np.sin(2.0 * np.pi * rng.uniform(1.0, 300.0) * t) + size[2] * np.repeat(rng.standard_normal(20), N // 20)
    w = ga.simulate(TWO, ga.Record(DT, velocity=np.zeros(N), torque=torque))
    return np.asarray(w + size[0] * rng.standard_normal(N))


def fresh() -> Objective:
    """An objective with noise at the shaft in its family, that was asked nothing yet."""
    rest = ga.Record(DT, velocity=np.zeros(N), torque=np.zeros(N))
    return Objective(DataSet.of([rest], None), np.ones(N), Innovations(ShaftNoise(TWO, DT, None)))


def test_the_noise_filter_of_an_error_is_the_same_whatever_was_asked_before() -> None:
    rng = np.random.default_rng(2)
    errors = [disturbed_error(rng) for _ in range(12)]
    alone = [fresh().noise_of(e, False).key for e in errors]
    assert len(set(alone)) > 6, "these errors have filters of their own"
    forwards, backwards, shared = fresh(), fresh(), fresh()
    assert [forwards.noise_of(e, False).key for e in errors] == alone
    assert [backwards.noise_of(e, False).key for e in errors[::-1]] == alone[::-1]
    for i in rng.integers(0, len(errors), 40):
        assert shared.noise_of(errors[i], False).key == alone[i]


def test_a_shaft_noise_keeps_nothing_of_what_it_was_asked() -> None:
    shaft = ShaftNoise(TWO, DT, ga.PI(1.0, 10.0))
    with pytest.raises(FrozenInstanceError):
        shaft.dt = 1.0  # type: ignore[misc]
    one, many = shaft.filters([(3, 5)], True)[0], ShaftNoise(TWO, DT, ga.PI(1.0, 10.0)).filters([(9, 17), (3, 5), (-1, 0)], True)
    assert one is not None and many[1] is not None and one.key == many[1].key
    assert many[0] is not None and many[2] is None, "outside the grid there is none"


def masked(lengths: tuple[int, ...], gaps: list[int]) -> Objective:
    """An objective over records of these lengths at rest, with samples that do not count."""
    rest = [ga.Record(DT, velocity=np.zeros(n), torque=np.zeros(n)) for n in lengths]
    weight = np.ones(sum(lengths))
    weight[gaps] = 0.0
    return Objective(DataSet.of(rest, None), weight)


def test_a_bridge_ends_where_its_record_ends() -> None:
    """A line from the end of one record to the start of the next would be an error that no model made."""
    lengths = (60, 50, 40)
    e = np.concatenate([np.full(60, 1.0), np.full(50, 10.0), np.full(40, -5.0)])
    objective = masked(lengths, [0, 1, 30, 57, 58, 59, 60, 61, 109, 149])
    np.testing.assert_array_equal(objective.bridged(e[None, :])[0], e)
    # Records by themselves and one after the other come to the same.
    e = np.random.default_rng(1).standard_normal(150)
    parts = [masked((n,), g).bridged(part[None, :])[0] for n, g, part in
             zip(lengths, ([0, 1, 30, 57, 58, 59], [0, 1, 49], [39]), np.split(e, [60, 110]), strict=True)]  # fmt: skip
    np.testing.assert_array_equal(objective.bridged(e[None, :])[0], np.concatenate(parts))
    assert parts[0][30] == pytest.approx(0.5 * (e[29] + e[31])) and parts[0][59] == e[56] and parts[1][0] == e[62]


def test_a_record_of_which_no_sample_counts_leaves_nothing() -> None:
    objective = masked((60, 50, 40), list(range(60, 110)))
    row = objective.bridged(np.ones((2, 150)))
    np.testing.assert_array_equal(row, np.tile(np.repeat([1.0, 0.0, 1.0], (60, 50, 40)), (2, 1)))
    assert objective.count == 100.0 - 2 * objective.head
    np.testing.assert_array_equal(masked((60, 50), list(range(110))).bridged(np.ones((1, 110))), np.zeros((1, 110)))


def test_what_stands_in_masked_samples_passes_no_prefilter() -> None:
    """A prefilter without phase spreads every sample both ways; over masked ones it sees the straight line between the others."""
    lengths, gaps = (900, 700), [0, 1, 400, 401, 402, 899, 900, 1300]
    weigh = Prefilter(DT, 4.0, 40.0, 4)
    objective = masked(lengths, gaps).under(OutputErrors(50.0, weigh))
    e = np.cumsum(np.random.default_rng(3).standard_normal(sum(lengths)))
    spoiled = e.copy()
    spoiled[gaps] = 1e3
    found, same = objective.whitened(np.vstack([e, spoiled]), WHITE)
    np.testing.assert_array_equal(found, same)
    np.testing.assert_array_equal(found, weigh.of(objective.bridged(e[None, :]), lengths)[0] * objective.counted)
    assert not found[gaps].any() and objective.count == sum(lengths) - 2 * objective.head - 5
    # The mask costs next to nothing beside it: the line is near what stood there.
    whole = masked(lengths, []).under(OutputErrors(50.0, weigh)).whitened(e[None, :], WHITE)[0]
    assert np.std((found - whole)[objective.counted > 0.0]) < 0.1 * np.std(whole)


def test_a_phase_is_determined_by_its_deviation_alone() -> None:
    """0 is as good a phase as any other; only an amplitude that is not there leaves it open."""
    one, t = ga.OneMass(J=1e-3, D=1e-3).model(), DT * np.arange(N)
    rec = ga.Record(DT, velocity=np.zeros(N), torque=0.1 * np.sin(2.0 * np.pi * 2.0 * t))
    scales = Scales(DT, 1.0, 50.0, 0.1, 1.0, 10.0, 0.002, float("nan"), float("nan"), False, 0.1)
    term = LIBRARY["unbalance"]

    def phase(amplitude: float, at: float, noise: float) -> ga.Estimate:
        drive = one.with_effect("unbalance", amplitude=amplitude, phase=at)
        seen = ga.simulate(drive, rec) + noise * np.random.default_rng(1).standard_normal(N)
        data = DataSet.of([rec.with_channels(velocity=seen)], None)
        parameters = Parameterisation.of(one, scales, [False])
        hypothesis = Hypothesis(parameters, OpenLoop(data)).extended(term)
        start = parameters.inserted(parameters.start(one), term.coordinates({"amplitude": amplitude, "phase": at}))
        objective = Objective(data, np.ones(N))
        return estimates_of(objective, fitted(objective, hypothesis, start, WHITE, 10))["unbalance"]["phase"]

    found = phase(0.02, 0.0, 0.01)
    assert abs(found.value) < 5.0 * found.std and found.std < 0.1 and found.identifiable
    for at in (0.0, 0.7):
        none = phase(1e-6, at, 0.3)
        assert none.std > 1.0 and not none.identifiable


def test_the_covariance_of_a_fit_is_worked_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Effects and mechanics both ask for it; beside a gap it costs eight fits."""
    one = ga.OneMass(J=1e-3, D=1e-3).model()
    torque = np.repeat([0.1, -0.1], N // 2)
    rec = ga.Record(DT, velocity=np.zeros(N), torque=torque)
    noise = 0.01 * np.random.default_rng(0).standard_normal(N)
    data = DataSet.of([rec.with_channels(velocity=ga.simulate(one, rec) + noise)], None)
    objective = Objective(data, np.ones(N))
    scales = Scales(DT, 1.0, 50.0, 0.1, 1.0, 10.0, 0.002, float("nan"), float("nan"), False, 0.1)
    parameters = Parameterisation.of(one, scales, [False])
    fit = fitted(objective, Hypothesis(parameters, OpenLoop(data)), parameters.start(one), WHITE, 5)
    asked: list[object] = []
    at_one_point = uncertainty._at_one_point
    monkeypatch.setattr(uncertainty, "_at_one_point", lambda o, f, *rest: asked.append(f) or at_one_point(o, f, *rest))
    assert estimates_of(objective, fit) == {} and mechanics_of(objective, fit)["inertia"].value == pytest.approx(1e-3, rel=1e-2)
    assert asked == [fit]


def test_a_fit_simulates_no_model_twice_and_leaves_its_error_behind() -> None:
    """Of two masses with six parameters: 1 + 6 rows at the start, 8 for each step, 6 more before each step but the first."""
    torque = np.repeat(np.random.default_rng(5).standard_normal(20), N // 20)
    velocity = np.asarray(ga.simulate(TWO, ga.Record(DT, velocity=np.zeros(N), torque=torque)))
    rec = ga.Record(DT, velocity=velocity + 0.01 * np.random.default_rng(6).standard_normal(N), torque=torque)
    objective = Objective(DataSet.of([rec], None), np.ones(N))
    parameters = Parameterisation.of(TWO, scales_of(objective.data), [False])
    hypothesis = Hypothesis(parameters, OpenLoop(objective.data))
    start = 1.1 * parameters.base_vector(TWO)
    found = fitted(objective, hypothesis, start, WHITE, 2)
    assert objective.counter.simulations == (1 + 6 + 8) + (6 + 8)
    error = objective.error(found)
    assert objective.counter.simulations == 29, "the error of the last step was simulated with it"
    assert np.array_equal(error, objective.errors(hypothesis, found.x[None, :])[0]), "alone the same bits as among eight"
    known = objective.linearised(hypothesis, found.x, WHITE, error)
    assert all(np.array_equal(a, b) for a, b in zip(known, objective.linearised(hypothesis, found.x, WHITE), strict=True))
