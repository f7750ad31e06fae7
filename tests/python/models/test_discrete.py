"""Model.discrete, equation (7): w(n) = sum_{i=0..N} alpha_i r(n-i) + sum_{i=1..N} beta_i w(n-i)."""

from __future__ import annotations

import numpy as np
import pytest
from test_simulate import core, core_loop

import gaident as ga
from gaident import _core
from independent import (
    FAMILIES,
    Array,
    Case,
    deviation,
    exact_equation7,
    random_case,
    random_signal,
)

LOOPS = ("continuous", "sampled", "open")
STRUCTURES = [(p, q) for p in range(4) for q in range(4) if p + q > 0]

# Table IV, identified; factor of the loop gain; equation (7) from these (docs/paper.md, loop gain) and as Table V prints it.
Coefficients = tuple[list[float], list[float]]
Table = tuple[ga.Model, float, Coefficients, Coefficients]
ONE_MASS: Table = (
    ga.Model(gain=6278.26, poles=[-34.13], zeros=[]),
    1.6744,
    ([0.051627, 0.0013332, -0.0502938], [1.88115, -0.88382]),
    ([0.051627, 0.001330, -0.050297], [1.881221, -0.883881]),
)
TWO_MASS: Table = (
    ga.Model(6545.29, poles=[-15.41, -10.3 + 150.9j, -10.3 - 150.9j], zeros=[-4.26 + 93.98j, -4.26 - 93.98j]),
    5.5637,
    ([0.158765, -0.312555, -0.004676, 0.312562, -0.154081], [3.66034, -4.99511, 3.00858, -0.67382]),
    ([0.158765, -0.312558, -0.004672, 0.312565, -0.154086], [3.660535, -4.995487, 3.008738, -0.673800]),
)


def discrete(case: Case) -> tuple[Array, Array]:
    return _core.discrete(case.gain, case.poles, case.zeros, _core.Clock(period=case.dt), core_loop(case))


def recurrence(alpha: Array, beta: Array, signal: Array) -> Array:
    """Equation (7) word by word, from rest."""
    w = np.zeros(len(signal))
    for n in range(len(signal)):
        w[n] = sum(alpha[i] * signal[n - i] for i in range(len(alpha)) if i <= n)
        w[n] += sum(beta[i - 1] * w[n - i] for i in range(1, len(beta) + 1) if i <= n)
    return w


def cases(loop: str, family: str) -> list[Case]:
    def case(p: int, q: int) -> Case:
        rng = np.random.default_rng([p, q, LOOPS.index(loop), FAMILIES.index(family)])
        return random_case(rng, loop, p, q, family, 30)

    return [case(p, q) for p, q in STRUCTURES if p > 0 or loop == "continuous"]


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("loop", LOOPS)
def test_coefficients_of_every_structure(loop: str, family: str) -> None:
    for case in cases(loop, family):
        alpha, beta = discrete(case)
        assert alpha.shape == (case.order + 1,) and beta.shape == (case.order,)
        expected = exact_equation7(case)
        assert deviation(alpha, expected[0]) < 1e-11, case
        assert deviation(beta, expected[1]) < 1e-12, case


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("loop", LOOPS)
def test_the_recurrence_is_the_simulation(loop: str, family: str) -> None:
    """Short records only: in powers of z a slow cluster of roots loses eight digits within 60 samples.

    (alpha and beta of the 120-digit reference, rounded to double, deviate by up to 5e-10 within these 30.)
    """
    for case in cases(loop, family):
        signal = random_signal(np.random.default_rng(case.order), 30)
        velocity, _ = core(case, signal)
        tolerance = 1e-11 if family == "fast" else 1e-8
        assert deviation(recurrence(*discrete(case), signal), velocity) < tolerance, case


@pytest.mark.parametrize("table", [ONE_MASS, TWO_MASS], ids=["one mass", "two masses"])
def test_table_5_from_table_4(table: Table) -> None:
    """One factor on the loop gain gives all of Table V: the computed figures to 1e-5, the paper's to 1e-4."""
    model, factor, method, paper = table
    found = model.discrete(0.444e-3, controller=ga.PI(0.0232 * factor, 1.367 * factor, loop="continuous"))
    largest = max(np.max(np.abs(found.alpha)), np.max(np.abs(found.beta)))
    for value, ours, printed in zip((found.alpha, found.beta), method, paper, strict=True):
        np.testing.assert_allclose(value, printed, rtol=0.0, atol=1e-4 * largest)
        np.testing.assert_allclose(value, ours, rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(found.alpha, paper[0], rtol=0.0, atol=1e-4 * np.max(np.abs(paper[0])))


def test_table_5_does_not_follow_from_the_printed_gains() -> None:
    model, _, _, (alpha, _) = TWO_MASS
    found = model.discrete(0.444e-3, controller=ga.PI(0.0232, 1.367, loop="continuous"))
    assert deviation(found.alpha, np.array(alpha)) > 0.5


@pytest.mark.parametrize("loop", LOOPS)
def test_the_method_of_the_model_is_the_core(loop: str) -> None:
    model = TWO_MASS[0]
    controller = None if loop == "open" else ga.PI(0.0232, 1.367, loop=loop)
    found = model.discrete(0.444e-3, controller=controller)
    case = Case(model.gain, np.array(model.poles), np.array(model.zeros), 0.444e-3, loop, 0.0232, 1.367)
    np.testing.assert_array_equal(found.alpha, discrete(case)[0])
    np.testing.assert_array_equal(found.beta, discrete(case)[1])


def test_only_the_continuous_loop_passes_its_input_through_at_once() -> None:
    model = TWO_MASS[0]
    assert model.discrete(0.444e-3).alpha[0] == 0.0
    assert model.discrete(0.444e-3, controller=ga.PI(0.0232, 1.367)).alpha[0] == 0.0
    assert model.discrete(0.444e-3, controller=ga.PI(0.0232, 1.367, loop="continuous")).alpha[0] > 0.0


def test_a_loop_with_an_integrator_has_gain_one_at_standstill() -> None:
    """sum alpha + sum beta = 1."""
    for model, factor, *_ in (ONE_MASS, TWO_MASS):
        for loop in LOOPS[:2]:
            found = model.discrete(0.444e-3, controller=ga.PI(0.0232 * factor, 1.367 * factor, loop=loop))
            assert abs(np.sum(found.alpha) + np.sum(found.beta) - 1.0) < 1e-13


def test_sampled_loop_without_excess_poles_is_refused() -> None:
    model = ga.Model(100.0, [-10.0, -20.0], [-5.0, -8.0])
    with pytest.raises(ValueError):
        model.discrete(1e-3, controller=ga.PI(0.01, 0.1))
