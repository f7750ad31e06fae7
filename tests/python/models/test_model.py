"""The factored model: order and symmetry of its roots, responses, natural parameters, refusals."""

from __future__ import annotations

import dataclasses
import json
import math
import pickle
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaident.errors import ModelError
from gaident.models.factors import FactorCounts, factor_parameters, model_from_factor_parameters
from gaident.models.model import Model
from gaident.models.roots import polynomial_roots

TWO_MASS = Model(gain=6545.29, poles=[-15.41, -10.30 + 150.9j, -10.30 - 150.9j], zeros=[-4.26 + 93.98j, -4.26 - 93.98j])

PART = st.floats(0.1, 1e3)
REAL = st.builds(lambda a, s: complex(s * a, 0.0), PART, st.sampled_from([-1.0, 1.0]))
PAIR = st.builds(lambda a, b: [complex(-a, b), complex(-a, -b)], PART, PART)


@st.composite
def models(draw: st.DrawFn) -> Model:
    def group(reals: int, pairs: int) -> list[complex]:
        found = [draw(REAL) for _ in range(reals)]
        for _ in range(pairs):
            found += draw(PAIR)
        return found

    zeros = group(draw(st.integers(0, 2)), draw(st.integers(0, 1)))
    poles = group(draw(st.integers(0, 2)), draw(st.integers(0, 2)))
    while len(poles) < len(zeros):
        poles.append(draw(REAL))
    gain = draw(st.floats(1e-3, 1e5)) * draw(st.sampled_from([-1.0, 1.0]))
    return Model(gain, poles, zeros)


def test_properties_of_the_papers_two_mass_model() -> None:
    assert (TWO_MASS.p, TWO_MASS.q, TWO_MASS.order) == (1, 2, 3)
    assert TWO_MASS.stable
    static_gain = 6545.29 * abs(4.26 + 93.98j) ** 2 / (15.41 * abs(10.3 + 150.9j) ** 2)
    assert TWO_MASS.static_gain == pytest.approx(static_gain)
    real, pair, antiresonance = TWO_MASS.modes
    assert (real.kind, real.natural_frequency, real.damping) == ("pole", 15.41, 1.0)
    assert pair.natural_frequency == pytest.approx(math.hypot(10.3, 150.9))
    assert pair.damping == pytest.approx(10.3 / math.hypot(10.3, 150.9))
    assert antiresonance.kind == "zero"
    assert antiresonance.frequency_hz == pytest.approx(math.hypot(4.26, 93.98) / (2 * math.pi))


@given(models(), st.randoms(use_true_random=False))
@settings(max_examples=60, deadline=None)
def test_order_of_the_roots_does_not_matter(model: Model, random: object) -> None:
    poles, zeros = list(model.poles), list(model.zeros)
    random.shuffle(poles)  # type: ignore[attr-defined]
    random.shuffle(zeros)  # type: ignore[attr-defined]
    again = Model(model.gain, poles, np.array(zeros))
    assert again == model
    assert hash(again) == hash(model)
    for roots in (model.poles, model.zeros):
        reals = [r for r in roots if r.imag == 0.0]
        pairs = list(roots[len(reals) :])
        assert [abs(r) for r in reals] == sorted(abs(r) for r in reals)
        assert all(a.imag > 0.0 and b == a.conjugate() for a, b in zip(pairs[::2], pairs[1::2], strict=True))
        assert [abs(r) for r in pairs[::2]] == sorted(abs(r) for r in pairs[::2])


def test_rounding_asymmetry_is_repaired_and_a_wrong_digit_is_not() -> None:
    model = Model(1.0, [-10.0 - 150.0j, -10.0 * (1 + 1e-13) + 150.0j, complex(-3.0, 1e-12)])
    assert model.poles[0] == -3.0
    assert model.poles[1] == model.poles[2].conjugate()
    with pytest.raises(ModelError, match=r"poles has -10\+150j without its conjugate -10-150j.*add it"):
        Model(1.0, [-10.0 + 150.0j, -10.0 - 150.1j])


def test_equal_pairs_are_matched_each_with_its_own() -> None:
    model = Model(1.0, [-1 + 2j, -1 + 2j, -1 - 2j, -1 - 2j, -1 + 2.5j, -1 - 2.5j])
    assert model.poles == (-1 + 2j, -1 - 2j, -1 + 2j, -1 - 2j, -1 + 2.5j, -1 - 2.5j)
    with pytest.raises(ModelError, match="without its conjugate"):
        Model(1.0, [-1 + 2j, -1 + 2j, -1 - 2j])


@pytest.mark.parametrize(
    ("gain", "poles", "zeros", "words"),
    [
        (0.0, [], [], ["gain is 0"]),
        (math.nan, [], [], ["gain", "nan"]),
        (1j, [], [], ["gain", "1j"]),
        ("5", [], [], ["gain", "'5'"]),
        (1.0, [-1.0, math.inf], [], ["poles[1]", "inf"]),
        (1.0, [-1.0], [complex(math.nan, 0)], ["zeros[0]", "nan"]),
        (1.0, [-1.0], [-2.0, -3.0], ["zeros has 2", "poles 1", "drop zeros or add poles"]),
        (1.0, [-1 + 1j], [], ["poles", "-1+1j", "conjugate", "-1-1j"]),
        (1.0, [-5.0, -6.0], [-1 - 1j, -3.0], ["zeros", "-1-1j", "conjugate"]),
        (1.0, "abc", [], ["poles", "'abc'"]),
        (1.0, ["a"], [], ["poles", "rad/s"]),
        (1.0, [[-1.0, -2.0]], [], ["poles", "(1, 2)"]),
    ],
)
def test_refuses_with_name_value_and_remedy(gain: float, poles: list[complex], zeros: list[complex], words: list[str]) -> None:
    with pytest.raises(ModelError) as refusal:
        Model(gain, poles, zeros)
    for word in words:
        assert word in str(refusal.value)


def test_the_users_array_is_not_changed_nor_kept() -> None:
    poles = np.array([-2.0, -1.0])
    model = Model(1.0, poles)
    poles[:] = 7.0
    assert model.poles == (-1.0, -2.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        model.gain = 2.0  # type: ignore[misc]


@given(models())
@settings(max_examples=60, deadline=None)
def test_frequency_response_is_the_ratio_of_the_polynomials(model: Model) -> None:
    omega = np.geomspace(0.1, 1e4, 7)
    numerator = np.polyval(np.atleast_1d(np.poly(model.zeros)), 1j * omega)
    denominator = np.polyval(np.atleast_1d(np.poly(model.poles)), 1j * omega)
    expected = model.gain * numerator / denominator
    np.testing.assert_allclose(model.frequency_response(omega), expected, rtol=1e-7)
    at_zero = model.frequency_response(0.0)
    assert at_zero.shape == ()
    assert complex(at_zero) == pytest.approx(model.static_gain, rel=1e-12)


def test_static_gain_with_roots_at_zero() -> None:
    assert Model(-2.0, [0.0, -1.0]).static_gain == -math.inf
    assert Model(2.0, [-1.0, -4.0], [0.0]).static_gain == 0.0
    assert Model(2.0, [0.0, -4.0], [0.0]).static_gain == 0.5
    assert Model(3.0).static_gain == 3.0
    assert not np.isfinite(Model(2.0, [0.0]).frequency_response([0.0])[0])
    assert not Model(2.0, [0.0]).stable
    assert math.isnan(Model(2.0, [0.0]).modes[0].damping)


@given(models())
@settings(max_examples=60, deadline=None)
def test_round_trips(model: Model) -> None:
    assert Model.from_dict(json.loads(json.dumps(model.to_dict()))) == model
    assert pickle.loads(pickle.dumps(model)) == model
    assert eval(repr(model)) == model
    names, values, units = factor_parameters(model)
    structure = FactorCounts.of(model)
    assert len(names) == len(set(names)) == len(values) == len(units) == structure.size
    assert (structure.p, structure.q) == (model.p, model.q)
    again = model_from_factor_parameters(values, structure)
    assert FactorCounts.of(again) == structure
    np.testing.assert_allclose(again.poles, model.poles, rtol=1e-9)
    np.testing.assert_allclose(again.zeros, model.zeros, rtol=1e-9)


def test_from_dict_takes_plain_numbers_and_names_what_is_wrong() -> None:
    assert Model.from_dict({"gain": 2.0, "poles": [-1.0, [-2.0, 0.0]]}) == Model(2.0, [-1.0, -2.0])
    with pytest.raises(ModelError, match=r"'pole'.*did you mean 'poles'"):
        Model.from_dict({"gain": 2.0, "pole": [-1.0]})
    with pytest.raises(ModelError, match="lacks gain"):
        Model.from_dict({"poles": [-1.0]})
    with pytest.raises(ModelError, match="poles is"):
        Model.from_dict({"gain": 1.0, "poles": [[1.0, 2.0, 3.0]]})


def test_names_and_units_of_the_natural_parameters() -> None:
    names, values, units = factor_parameters(TWO_MASS)
    assert names == ("gain", "pole_1", "pole_pair_1_e1", "pole_pair_1_e0", "zero_pair_1_e1", "zero_pair_1_e0")
    assert units == ("rad/s^2/(N m)", "rad/s", "rad/s", "rad^2/s^2", "rad/s", "rad^2/s^2")
    np.testing.assert_allclose(values, [6545.29, 15.41, 20.6, 22876.9, 8.52, 8850.388], rtol=1e-12)
    assert factor_parameters(Model(1.0, [-1.0], [-2.0]))[2][0] == "rad/s/(N m)"


def test_a_pair_may_become_two_real_roots() -> None:
    model = model_from_factor_parameters([2.0, 1e6, 1.0], FactorCounts(0, 1, 0, 0))
    np.testing.assert_allclose([r.real for r in model.poles], [-1e-6, -1e6], rtol=1e-11)
    assert FactorCounts.of(model) == FactorCounts(2, 0, 0, 0)
    with pytest.raises(ModelError, match="takes 3 numbers"):
        model_from_factor_parameters([2.0, 1.0], FactorCounts(0, 1, 0, 0))
    with pytest.raises(ModelError, match=r"values\[1\] is nan"):
        model_from_factor_parameters([2.0, math.nan, 1.0], FactorCounts(0, 1, 0, 0))


def test_to_scipy() -> None:
    signal = pytest.importorskip("scipy.signal")
    omega = np.array([1.0, 90.0, 150.0, 1000.0])
    _, response = signal.freqresp(TWO_MASS.to_scipy(), omega)
    np.testing.assert_allclose(response, TWO_MASS.frequency_response(omega), rtol=1e-10)


def test_to_control() -> None:
    pytest.importorskip("control")
    omega = np.array([1.0, 90.0, 150.0, 1000.0])
    response = TWO_MASS.to_control()(1j * omega)
    np.testing.assert_allclose(response, TWO_MASS.frequency_response(omega), rtol=1e-10)


def test_to_control_without_the_package_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ImportError, match=r'pip install "gaident\[control\]"'):
        TWO_MASS.to_control()


@given(st.lists(st.floats(0.05, 2e3), min_size=1, max_size=5, unique=True))
@settings(max_examples=60, deadline=None)
def test_roots_of_a_polynomial_solve_it(values: list[float]) -> None:
    coefficients = np.poly([-v for v in values]).astype(np.float64)
    roots = polynomial_roots(coefficients[1:])
    for root in roots:
        terms = np.abs(coefficients) * np.abs(root) ** np.arange(len(values), -1, -1)
        assert abs(np.polyval(coefficients, root)) <= 1e-13 * terms.sum()


def test_roots_at_zero() -> None:
    assert list(polynomial_roots([0.0, 0.0])) == [0.0, 0.0]
    assert sorted(polynomial_roots([0.0, 4.0, 0.0]), key=lambda r: r.imag) == [-2j, 0.0, 2j]
