"""The benchmarks in Python compare like with like: the peers' problem is the core's, and the rows assert their answers."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

import gaident as ga
from gaident import _core
from places import BENCH


@pytest.fixture(scope="module")
def peer_problem() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH / "packages"))
        import peer_problem

        return peer_problem


@pytest.fixture(scope="module")
def scaling() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        import scaling

        return scaling


@pytest.fixture(scope="module")
def compare_methods() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
            patch.setenv(name, "1")
        import compare_methods

        return compare_methods


def words_of(bits: np.ndarray) -> list[int]:
    padded = np.concatenate([bits, np.zeros(-len(bits) % 64, dtype=bits.dtype)])
    return [int("".join(map(str, word)), 2) for word in padded.reshape(-1, 64)]


def by_size(roots: list[complex]) -> list[complex]:
    return sorted((complex(r) for r in roots), key=lambda r: (r.imag, r.real))


def test_peers_read_the_bits_as_the_core_does(peer_problem: ModuleType) -> None:
    problem = peer_problem.problem("two masses (paper)", 0)
    rng = np.random.default_rng(5)
    for bits in rng.integers(0, 2, (60, peer_problem.BITS)):
        K, A, B = problem.from_bits(bits)
        gain, poles, zeros = _core.decode(words_of(bits), problem.space.ranges(paper=True), False, False)
        assert abs(K - gain) <= 1e-12 * gain
        np.testing.assert_allclose(by_size(A), by_size(list(-poles)), rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(by_size(B), by_size(list(-zeros)), rtol=1e-9, atol=1e-9)


def test_both_error_sums_by_scipy_are_the_core_s(peer_problem: ModuleType) -> None:
    problem = peer_problem.problem("two masses (paper)", 1)
    case, output = problem.case, problem.output
    rng = np.random.default_rng(6)
    tried = 0
    for bits in rng.integers(0, 2, (40, peer_problem.BITS)):
        K, A, B = problem.from_bits(bits)
        model = ga.Model(K, [-a for a in A], [-b for b in B])
        ours = float(np.sum((output - ga.simulate(model, problem.record, case.controller)) ** 2))
        if not ours < 1e9:
            continue
        tried += 1
        assert peer_problem.independent_error(case, output, K, A, B) == pytest.approx(ours, rel=1e-7)
        # powers of z lose digits where poles crowd at z = 1
        assert peer_problem.scipy_error(case, output, K, A, B) == pytest.approx(ours, rel=1e-3)
    assert tried > 20


def test_the_truth_is_within_the_ranges_and_reaches_the_noise(peer_problem: ModuleType) -> None:
    for name in ("two masses (paper)", "hard"):
        problem = peer_problem.problem(name, 2)
        m = problem.case.model
        poles, zeros = np.array(m.poles), np.array(m.zeros)
        sum_at_truth = peer_problem.independent_error(problem.case, problem.output, m.gain, -poles, -zeros)
        assert sum_at_truth == pytest.approx(len(problem.truth) * problem.case.noise**2, rel=0.3)
        K, re, im = problem.ranges()
        assert K[0] < m.gain < K[1]
        for roots in (poles, zeros):
            assert np.all((re[0] < -roots.real) & (-roots.real < re[1]))
            shaken = np.abs(roots.imag[roots.imag != 0.0])
            assert np.all((im[0] < shaken) & (shaken < im[1]))


def test_a_peer_s_run_ends_at_the_optimum_or_in_time(peer_problem: ModuleType) -> None:
    fitness = peer_problem.Fitness(lambda x: float(x @ x), until=lambda x: bool(abs(x).max() < 0.1))
    assert fitness.one(np.array([0.5])) == 0.25
    with pytest.raises(peer_problem.Reached):
        fitness.many(np.array([[0.3], [0.05], [0.2]]))
    assert fitness.reached and fitness.evaluations == 4 and fitness.x == pytest.approx([0.05])
    late = peer_problem.Fitness(lambda x: 1.0, seconds=0.0)
    with pytest.raises(peer_problem.Reached):
        late.one(np.zeros(1))
    assert not late.reached


@pytest.mark.parametrize("arithmetic", ["double", "float"])
def test_scaling_measures_and_asserts(scaling: ModuleType, arithmetic: str) -> None:
    found = scaling.measure(scaling.Row("small", arithmetic=arithmetic, repeats=1))
    assert 0.0 < found["seconds"] < 0.1
    assert found["before"] <= found["peak"]


def test_a_difference_equation_runs_freely_as_it_was_made(compare_methods: ModuleType) -> None:
    rng = np.random.default_rng(1)
    u, y = rng.standard_normal(400), np.zeros(400)
    for n in range(2, 400):
        y[n] = 1.5 * y[n - 1] - 0.7 * y[n - 2] + 0.3 * u[n] + 0.1 * u[n - 2]
    X = compare_methods.lagged(u, y, 2)
    theta = np.linalg.lstsq(X, y[2:], rcond=None)[0]
    np.testing.assert_allclose(theta, [1.5, -0.7, 0.3, 0.0, 0.1], atol=1e-10)
    free = compare_methods.free_run(lambda x: float(theta @ x), compare_methods.Decimated(u, y, 1), 2)
    np.testing.assert_allclose(free, y, atol=1e-9)
    unstable = compare_methods.free_run(lambda x: 2.0 * float(x[0]) + 1.0, compare_methods.Decimated(u, y, 1), 2)
    assert np.all(np.isinf(unstable[-10:]))


@pytest.mark.long
def test_the_comparison_judges_on_the_rig(compare_methods: ModuleType) -> None:
    """The extended model reaches the noise of 0.3 rad/s on the record that it has not seen; linear models do not."""
    task = next(t for t in compare_methods.all_tasks() if t.name == "rig, one mass")
    names = ("gaident, linear", "gaident, extended", "ARX, least squares")
    outcomes = [compare_methods.judged(task, name) for name in names]
    linear, extended, arx = (o.rmse for o in outcomes)
    assert 0.28 < extended < 0.33
    assert linear > 2.0 * extended and arx > 2.0 * extended
    assert [o.parameters for o in outcomes][:2] == [2, 5]
    text = compare_methods.table(task, outcomes)
    assert f"**{extended:.3g}**" in text and "Least error: gaident, extended." in text
    assert "A black box wins here." in compare_methods.table(task, outcomes[2:])
