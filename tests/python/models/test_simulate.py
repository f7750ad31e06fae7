"""gaident.simulate and gaident.run against the independent computation of independent.py; their properties.

Agreement: largest deviation over largest response, 1e-9 in double and 1e-4 in float, over every structure
p, q <= 3 (loops up to order 7), slow clustered roots, roots up to Nyquist, stable and unstable.

Kept apart from errors of the simulator: clamps around an unstable plant can be chaotic.
Cases whose response moves by more than 300 times a relative change of gain, poles and kp are not drawn: `draw_limited`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from gaident import _core
from independent import (
    FAMILIES,
    INF,
    Array,
    Case,
    deviation,
    exact_simulate,
    random_case,
    random_signal,
    scipy_simulate,
)

LOOPS = ("continuous", "sampled", "open")
STRUCTURES = [(p, q) for p in range(4) for q in range(4)]
DOUBLE, FLOAT = 1e-9, 1e-4
EVERY = [
    (loop, family, p, q)
    for loop in LOOPS
    for family in FAMILIES
    for p, q in STRUCTURES
    if (p > 0 or loop == "continuous") and (p + q > 0 or family == "mixed")
]


def generator(*key: object) -> np.random.Generator:
    """A generator of its own for every test, from the test's parameters."""
    return np.random.default_rng([sum(ord(c) * 31**i for i, c in enumerate(str(k))) for k in key])


Result = tuple[Array, Array]
Clamped = tuple[Case, Array, Array, Result]


def core_loop(case: Case) -> _core.Loop:
    controller = _core.Controller(kp=case.kp, ki=case.ki, torque_limit=case.torque_limit, integrator_limit=case.integrator_limit)
    return _core.Loop(kind=case.loop, controller=controller)


def core(case: Case, signal: Array, state: Array | None = None, arithmetic: str = "double") -> Result:
    """(velocity, torque) of gaident._core.simulate."""
    return _core.simulate(
        case.gain,
        case.poles,
        case.zeros,
        _core.Clock(period=case.dt),
        signal,
        core_loop(case),
        np.zeros(0) if state is None else state,
        arithmetic,
    )


def controller_of(case: Case) -> ga.PI | None:
    if case.loop == "open":
        return None
    limits = [None if limit == INF else limit for limit in (case.torque_limit, case.integrator_limit)]
    return ga.PI(case.kp, case.ki, loop=case.loop, torque_limit=limits[0], integrator_limit=limits[1])


def record_of(case: Case, signal: Array) -> ga.Record:
    signals = {"torque" if case.loop == "open" else "command": signal}
    return ga.Record(dt=case.dt, velocity=np.zeros(len(signal)), **signals)


def public(case: Case, signal: Array) -> ga.Run:
    model = ga.Model(case.gain, case.poles, case.zeros)
    return ga.run(model, record_of(case, signal), controller=controller_of(case))


def draw(rng: np.random.Generator, loop: str, family: str, samples: int, growth: float = 1e6) -> Case:
    p, q = STRUCTURES[rng.integers(1 if loop == "continuous" else 4, len(STRUCTURES))]
    return random_case(rng, loop, p, q, family, samples, growth)


def random_state(rng: np.random.Generator, case: Case, torque: float) -> Array:
    """A state whose parts all matter: the k-th difference of the velocity is about (rate*dt)^k of it."""
    rate = min(1.0, float(np.mean(np.abs(case.poles))) * case.dt) if len(case.poles) else 1.0
    plant = 20.0 * rng.normal(size=len(case.poles)) * rate ** np.arange(len(case.poles))
    return plant if case.loop == "open" else np.append(plant, torque * rng.normal())


def assert_agrees(result: Result, reference: Result, tolerance: float, case: Case) -> None:
    for name, value, expected in zip(("velocity", "torque"), result, reference, strict=True):
        assert value.shape == expected.shape and value.dtype == np.float64
        found = deviation(value, expected)
        assert found <= tolerance, f"{name} deviates by {found:.2e} (allowed {tolerance:.0e}): {case}"


def draw_limited(rng: np.random.Generator, loop: str, family: str, which: str, with_state: bool) -> Clamped:
    """A case whose clamps act, its signal of 300 samples, its state and its reference."""
    while True:
        case = draw(rng, loop, family, 300, 1e3)
        signal = random_signal(rng, 300)
        free = scipy_simulate(case, signal)
        peak = float(np.max(np.abs(free[1])))
        names = [f"{name}_limit" for name in ("torque", "integrator") if which in (name, "both")]
        case = replace(case, **{name: peak * rng.uniform(0.05, 0.5) for name in names})
        state = random_state(rng, case, peak) if with_state else np.zeros(0)
        reference = scipy_simulate(case, signal, state)
        up, down = 1 + 1e-8, 1 - 1e-8
        moved = replace(case, gain=case.gain * up, poles=case.poles * down, kp=case.kp * down)
        shift = max(map(deviation, scipy_simulate(moved, signal, state), reference))
        if shift < 300 * 1e-8 and deviation(reference[1], free[1]) > 1e-3:
            return case, signal, state, reference


# ------------------------------------------------------- agreement


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("loop", LOOPS)
def test_the_two_references_agree(loop: str, family: str) -> None:
    """120-digit polynomials and double-precision state space have nothing in common but the specification."""
    rng = generator("references", loop, family)
    for limited in (False, True):
        case = draw(rng, loop, family, 150, 1e3)
        signal = random_signal(rng, 150)
        peak = float(np.max(np.abs(exact_simulate(case, signal)[1])))
        if limited and loop != "open":
            case = replace(case, torque_limit=0.4 * peak, integrator_limit=0.2 * peak)
        state = random_state(rng, case, 0.3 * peak) if limited else ()
        exact, double = exact_simulate(case, signal, state), scipy_simulate(case, signal, state)
        assert_agrees(double, exact, 1e-11, case)


@pytest.mark.parametrize(("loop", "family", "p", "q"), EVERY)
def test_every_structure_in_double_and_float(loop: str, family: str, p: int, q: int) -> None:
    rng = generator("structure", loop, family, p, q)
    case = random_case(rng, loop, p, q, family, 200)
    signal = random_signal(rng, 200)
    reference = exact_simulate(case, signal)
    assert_agrees(core(case, signal), reference, DOUBLE, case)
    assert_agrees(core(case, signal, arithmetic="float"), reference, FLOAT, case)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("loop", LOOPS)
def test_long_records_in_double(loop: str, family: str) -> None:
    rng = generator("long", loop, family)
    for _ in range(4):
        case = draw(rng, loop, family, 2000)
        signal = random_signal(rng, 2000)
        assert_agrees(core(case, signal), scipy_simulate(case, signal), DOUBLE, case)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("loop", LOOPS)
def test_float_on_records_of_the_papers_length(loop: str, family: str) -> None:
    rng = generator("float", loop, family)
    for _ in range(12):
        case = draw(rng, loop, family, 250)
        signal = random_signal(rng, 250)
        assert_agrees(core(case, signal, arithmetic="float"), scipy_simulate(case, signal), FLOAT, case)


def test_float_next_to_nyquist_to_1e_4() -> None:
    """A lightly damped pair at 0.98 of Nyquist in a loop that grows 2000-fold: what plain floats cannot hold."""
    poles, zeros = np.array([-106 + 6145j, -106 - 6145j]), np.array([-978 + 0j])
    case = Case(3.54e6, poles, zeros, 5e-4, "sampled", 1.26e-4, 2.3e-5)
    signal = np.full(250, 43.6)
    assert_agrees(core(case, signal, arithmetic="float"), exact_simulate(case, signal), FLOAT, case)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("loop", LOOPS)
def test_initial_state(loop: str, family: str) -> None:
    rng = generator("state", loop, family)
    for _ in range(3):
        case = draw(rng, loop, family, 120, 1e3)
        signal = random_signal(rng, 120)
        state = random_state(rng, case, float(np.max(np.abs(scipy_simulate(case, signal)[1]))))
        reference = exact_simulate(case, signal, state)
        assert_agrees(core(case, signal, state), reference, DOUBLE, case)
        assert_agrees(core(case, signal, state, "float"), reference, FLOAT, case)


@pytest.mark.parametrize("which", ["torque", "integrator", "both"])
@pytest.mark.parametrize("loop", LOOPS[:2])
def test_limits(loop: str, which: str) -> None:
    """Limits inside the unlimited torque; the continuous loop's reference is a bracketing root finder."""
    rng = generator("limits", loop, which)
    for family in FAMILIES:
        for with_state in (False, True):
            case, signal, state, reference = draw_limited(rng, loop, family, which, with_state)
            assert_agrees(core(case, signal, state), reference, DOUBLE, case)
            assert_agrees(core(case, signal, state, "float"), reference, FLOAT, case)


def test_limits_of_the_continuous_loop_against_120_digits() -> None:
    rng = generator("exact limits")
    for family in FAMILIES:
        case, signal, state, _ = draw_limited(rng, "continuous", family, "both", True)
        assert_agrees(core(case, signal, state), exact_simulate(case, signal, state), DOUBLE, case)


# ------------------------------------------------------- the public functions


@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("loop", LOOPS)
def test_run_and_simulate(loop: str, limited: bool) -> None:
    rng = generator("public", loop, limited)
    for family in FAMILIES:
        case = draw(rng, loop, family, 250, 1e3)
        signal = random_signal(rng, 250)
        reference = scipy_simulate(case, signal)
        if limited and loop != "open":
            peak = float(np.max(np.abs(reference[1])))
            case = replace(case, torque_limit=0.4 * peak, integrator_limit=0.2 * peak)
            reference = scipy_simulate(case, signal)
        run = public(case, signal)
        assert_agrees((run.velocity, run.torque), reference, DOUBLE, case)
        model = ga.Model(case.gain, case.poles, case.zeros)
        velocity = ga.simulate(model, record_of(case, signal), controller=controller_of(case))
        np.testing.assert_array_equal(velocity, run.velocity)


@pytest.mark.parametrize("loop", LOOPS)
def test_initial_state_through_the_public_function(loop: str) -> None:
    rng = generator("public state", loop)
    case = draw(rng, loop, "mixed", 150, 1e3)
    signal = random_signal(rng, 150)
    state = random_state(rng, case, float(np.max(np.abs(scipy_simulate(case, signal)[1]))))
    model, kept = ga.Model(case.gain, case.poles, case.zeros), state.copy()
    record, controller = record_of(case, signal), controller_of(case)
    velocity = ga.simulate(model, record, controller=controller, initial_state=state)
    assert deviation(velocity, exact_simulate(case, signal, state)[0]) <= DOUBLE
    np.testing.assert_array_equal(state, kept)


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize("arithmetic", ["double", "float"])
def test_the_users_arrays_stay_as_they_are(loop: str, arithmetic: str) -> None:
    rng = generator("untouched", loop)
    case = draw(rng, loop, "mixed", 100)
    signal = random_signal(rng, 100)
    state = random_state(rng, case, 1.0)
    arrays = [signal, state, case.poles, case.zeros]
    copies = [a.copy() for a in arrays]
    velocity, torque = core(case, signal, state, arithmetic)
    velocity[:], torque[:] = 1.0, 2.0
    for array, copy in zip(arrays, copies, strict=True):
        np.testing.assert_array_equal(array, copy)
    assert not np.shares_memory(velocity, torque)


def test_run_leaves_the_record_as_it_is() -> None:
    case = draw(generator("record"), "sampled", "mixed", 100)
    signal = random_signal(generator("record"), 100)
    copy = signal.copy()
    run = public(case, signal)
    np.testing.assert_array_equal(signal, copy)
    assert not np.shares_memory(run.velocity, signal) and not np.shares_memory(run.torque, signal)


def test_a_sampled_loop_needs_more_poles_than_zeros() -> None:
    model = ga.Model(100.0, [-10.0, -20.0], [-5.0, -8.0])
    record = ga.Record(dt=1e-3, command=np.ones(50), velocity=np.zeros(50))
    with pytest.raises(ValueError, match="pole"):
        ga.simulate(model, record, controller=ga.PI(0.01, 0.1))
    assert np.all(np.isfinite(ga.simulate(model, record, controller=ga.PI(0.01, 0.1, loop="continuous"))))


# ------------------------------------------------------- properties

PROPERTY = pytest.mark.parametrize(("loop", "family"), [(x, y) for x in LOOPS for y in FAMILIES])


@PROPERTY
def test_linearity_and_superposition_of_the_initial_state(loop: str, family: str) -> None:
    rng = generator("linear", loop, family)
    for _ in range(5):
        case = draw(rng, loop, family, 250)
        first, second, state = random_signal(rng, 250), random_signal(rng, 250), random_state(rng, case, 1.0)
        a, b = rng.normal(size=2)
        parts = [core(case, first), core(case, second), core(case, np.zeros(250), state)]
        whole = core(case, a * first + b * second, state)
        for i in range(2):
            terms = [a * parts[0][i], b * parts[1][i], parts[2][i]]
            scale = max(float(np.max(np.abs(t))) for t in terms)
            assert np.max(np.abs(whole[i] - sum(terms))) <= 1e-10 * scale, case


@PROPERTY
def test_time_invariance(loop: str, family: str) -> None:
    """A delayed command gives the delayed response, and nothing before it."""
    rng = generator("delay", loop, family)
    case, delay = draw(rng, loop, family, 250), 37
    signal = random_signal(rng, 250)
    late = core(case, np.concatenate([np.zeros(delay), signal]))
    for value, reference in zip(late, core(case, signal), strict=True):
        assert np.all(value[:delay] == 0.0)
        assert deviation(value[delay:], reference) <= 1e-13


@PROPERTY
def test_causality(loop: str, family: str) -> None:
    rng = generator("causal", loop, family)
    case = draw(rng, loop, family, 200)
    signal = random_signal(rng, 200)
    changed = signal.copy()
    changed[120:] += 5.0
    for value, reference in zip(core(case, changed), core(case, signal), strict=True):
        np.testing.assert_array_equal(value[:120], reference[:120])


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("loop", LOOPS[:2])
def test_limits_that_are_never_reached_change_nothing(loop: str, family: str) -> None:
    rng = generator("wide limits", loop, family)
    for _ in range(5):
        case = draw(rng, loop, family, 250)
        signal = random_signal(rng, 250)
        free = core(case, signal)
        integral = free[1] - case.kp * (signal - free[0])
        wide = replace(
            case,
            torque_limit=1.01 * float(np.max(np.abs(free[1]))),
            integrator_limit=1.01 * float(np.max(np.abs(integral))) + 1e-9,
        )
        assert_agrees(core(wide, signal), free, 1e-10, case)


@pytest.mark.parametrize("with_state", [False, True])
@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("loop", LOOPS[:2])
def test_torque_is_the_controller_replayed(loop: str, limited: bool, with_state: bool) -> None:
    rng = generator("replay", loop, limited, with_state)
    for family in FAMILIES:
        case = draw(rng, loop, family, 250, 1e3)
        signal = random_signal(rng, 250)
        peak = float(np.max(np.abs(core(case, signal)[1])))
        if limited:
            case = replace(case, torque_limit=0.5 * peak, integrator_limit=0.1 * peak)
        state = random_state(rng, case, 0.3 * peak) if with_state else None
        velocity, torque = core(case, signal, state)
        half, stored = case.ki * case.dt / 2, 0.0 if state is None else float(state[-1])
        replayed = np.zeros(250)
        for n, error in enumerate(signal - velocity):
            integral = float(np.clip(stored + half * error, -case.integrator_limit, case.integrator_limit))
            replayed[n] = np.clip(case.kp * error + integral, -case.torque_limit, case.torque_limit)
            stored = integral + half * error
        # e = r - w is known to the rounding of w only, so the torque to kp times that
        scale = max(np.max(np.abs(torque)), case.kp * np.max(np.abs(velocity)))
        assert np.max(np.abs(replayed - torque)) <= 1e-11 * scale, case
        if limited:
            assert np.max(np.abs(torque)) <= case.torque_limit


def test_open_loop_returns_the_torque_it_was_given() -> None:
    case = draw(generator("open"), "open", "mixed", 100)
    signal = random_signal(generator("open"), 100)
    np.testing.assert_array_equal(core(case, signal)[1], signal)


@pytest.mark.parametrize("loop", LOOPS[:2])
def test_the_loop_settles_on_a_constant_command(loop: str) -> None:
    poles = np.array([-15.41, -10.30 + 150.9j, -10.30 - 150.9j])
    case = Case(6545.29, poles, np.array([-4.26 + 93.98j, -4.26 - 93.98j]), 0.444e-3, loop, 0.0232, 1.367)
    velocity, torque = core(case, np.full(20000, 43.6))
    static = case.gain * np.prod(-case.zeros).real / np.prod(-case.poles).real
    assert abs(velocity[-1] - 43.6) < 1e-9 and abs(torque[-1] - 43.6 / static) < 1e-9


def test_a_step_of_torque_on_one_mass_is_an_exponential() -> None:
    """w(n) = K/A (1 - exp(-A n dt)), the one case that everybody knows by heart."""
    case = Case(6278.26, np.array([-34.13 + 0j]), np.zeros(0, dtype=complex), 0.444e-3, "open")
    time = case.dt * np.arange(500)
    expected = -6278.26 / 34.13 * np.expm1(-34.13 * time)
    assert deviation(core(case, np.ones(500))[0], expected) < 1e-13
    assert deviation(exact_simulate(case, np.ones(500))[0], expected) < 1e-14


@pytest.mark.parametrize("dt", [4e-10, 1e-9, 1e-7])
def test_a_delay_longer_than_the_record_keeps_its_drive_at_rest(dt: float) -> None:
    """More than 2^31 samples of it were none, and 2^30 of them more memory than there is."""
    late = ga.OneMass(J=1e-4, D=1e-3).model().with_effect("transport_delay", delay=1.0)
    rec = ga.Record(dt, torque=np.ones(300), velocity=np.zeros(300))
    assert np.all(ga.simulate(late, rec, None) == 0.0)
    assert np.all(ga.simulate_many([late] * 3, rec, None) == 0.0)
