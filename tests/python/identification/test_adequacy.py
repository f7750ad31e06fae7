"""When a linear model stands, is falsified, or cannot be judged; short records; starts and bounds that must agree."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from clock import fastest
from gaident.axis import said
from gaident.errors import RecordError, SpaceError
from gaident.identification.noise import chi2_tail
from gaident.identification.notes import inertia_of, reading_notes, slower_than_the_loop, unseen_notes

DT = 0.444e-3
ONE_MASS = ga.OneMass(J=2e-4, D=3e-3).model()
TWO_MASS = ga.Model(6545.29, [-15.41, -10.30 + 150.9j, -10.30 - 150.9j], [-4.26 + 93.98j, -4.26 - 93.98j])


def stairs(samples: int, seed: int = 0) -> np.ndarray:
    return np.repeat(np.random.default_rng(seed).uniform(-40.0, 40.0, 6), -(-samples // 6))[:samples]


def closed(model: ga.Model, ctl: ga.PI, command: np.ndarray, noise: float, seed: int = 0) -> ga.Record:
    blank = ga.Record(dt=DT, command=command, velocity=np.zeros(len(command)))
    w = ga.simulate(model, blank, ctl)
    return replaced(blank, w + noise * np.random.default_rng(seed).standard_normal(len(command)))


def replaced(rec: ga.Record, velocity: np.ndarray) -> ga.Record:
    return ga.Record(dt=rec.dt, command=rec.command, torque=rec.torque, velocity=velocity)


def test_torque_from_a_feedback_loop_does_not_falsify_a_true_model() -> None:
    """Identified in open loop from the torque a PI made of the *noisy* velocity: torque and noise of a sample are correlated."""
    for seed in range(8):
        rng = np.random.default_rng(seed)
        noise = 0.05 * rng.standard_normal(300)
        ctl = ga.PI(0.05, 2.0)
        w = integral = last = state = 0.0
        command, velocity, torque = np.full(300, 20.0), np.empty(300), np.empty(300)
        decay = math.exp(-3e-3 / 2e-4 * DT)
        for n in range(300):
            w = state
            velocity[n] = w + noise[n]
            e = command[n] - velocity[n]
            integral += ctl.ki * DT * (e + last) / 2.0
            last = e
            torque[n] = ctl.kp * e + integral
            state = decay * w + (1.0 - decay) / 3e-3 * torque[n]
        idn = ga.identify(ga.Record(dt=DT, torque=torque, velocity=velocity), workers=1, seed=seed)
        assert not idn.falsified, idn.adequacy
        assert (idn.p, idn.q) == (1, 0)


@pytest.mark.parametrize("structure", [(1, 0), (2, 0), (1, 1)])
def test_a_wrong_structure_is_never_said_to_stand(structure: tuple[int, int]) -> None:
    ctl = ga.PI(0.0232 * 5.5637, 1.367 * 5.5637, loop="continuous")
    rec = closed(TWO_MASS, ctl, np.full(250, 43.6), 0.3)
    p, q = structure
    space = ga.SearchSpace(gain=(1e3, 2e4), real=(0.0, 60.0), imaginary=(0.0, 250.0), p=(p, p), q=(q, q))
    idn = ga.identify(rec, ctl, space=space, workers=1)
    assert idn.rmse > 1.0
    assert idn.falsified or idn.adequacy.undecided
    assert "stands" not in idn.summary()
    assert idn.adequacy.sentence in idn.warnings


@pytest.mark.parametrize("samples", [20, 25, 31, 32, 40])
def test_short_records_are_identified_or_refused_not_crashed(samples: int) -> None:
    ctl = ga.PI(0.05, 2.0)
    rec = closed(ONE_MASS, ctl, stairs(samples), 0.01)
    idn = ga.identify([rec, closed(ONE_MASS, ctl, stairs(200, 1), 0.01)], ctl, workers=1)
    assert idn.rmse < 0.1
    assert math.isfinite(ga.identify(rec, ctl, workers=1).rmse)


@pytest.mark.parametrize("initial_state", ["auto", "rest", "free"])
@pytest.mark.parametrize("loop", ["sampled", "continuous", "open"])
@pytest.mark.parametrize("engine", ["species", "plain"])
def test_figures_agree_with_the_residual_whatever_the_start(initial_state: str, loop: str, engine: str) -> None:
    ctl = None if loop == "open" else ga.PI(0.05, 2.0, loop=loop)
    source = stairs(700) * (0.002 if loop == "open" else 1.0)
    channel = {"torque" if loop == "open" else "command": source}
    w = ga.simulate(ONE_MASS, ga.Record(dt=DT, velocity=np.zeros(700), **channel), ctl)
    noisy = w + 0.05 * np.random.default_rng(1).standard_normal(700)
    rec = ga.Record(dt=DT, velocity=noisy, **channel)[200:]
    settings = replace(
        ga.Settings() if engine == "species" else ga.Settings.paper(), initial_state=initial_state, generations=100
    )
    idn = ga.identify(rec, ctl, space=ga.SearchSpace(real=(0.0, 100.0)), settings=settings, workers=1)
    assert np.sqrt(np.mean(idn.residual(rec) ** 2)) == pytest.approx(idn.rmse, rel=1e-9)
    expected = np.sum(idn.residual(rec) ** 2) + 2.0 * (idn.p + idn.q)
    assert idn.fitness == pytest.approx(expected, rel=1e-9)
    if engine == "plain":
        assert min(idn.history) == pytest.approx(idn.fitness, rel=1e-6)


def test_a_moving_record_and_limits_are_refused_in_simulate() -> None:
    ctl = ga.PI(0.05, 2.0, torque_limit=5.0)
    rec = closed(ONE_MASS, ctl, stairs(900), 0.05)
    idn = ga.identify(rec, ctl, workers=1)
    with pytest.raises(ga.GaidentError, match="starts in motion and the controller has limits"):
        idn.simulate(rec[300:])


def test_flags_belong_to_the_parameters_that_stand_at_a_bound() -> None:
    """A real pole pair that the core pairs before a complex one, and a range that cuts off one of them."""
    model = ga.Model(3e7, [-40.0, -300.0, -10.0 + 150.0j, -10.0 - 150.0j], [-5.0 + 94.0j, -5.0 - 94.0j])
    ctl = ga.PI(0.02, 0.5, loop="continuous")
    rec = closed(model, ctl, stairs(1000), 0.02)
    for seed in range(4):
        space = ga.SearchSpace(gain=(1e2, 1e6), real=(0.0, 200.0), imaginary=(0.0, 400.0), p=(2, 2), q=(2, 2))
        idn = ga.identify(rec, ctl, space=space, workers=1, seed=seed)
        for name, e in idn.parameters.items():
            if name.endswith("_real") or name in ("pole_1", "pole_2", "zero_1", "zero_2"):
                at_end = min(abs(-e.value - 0.0), abs(-e.value - 200.0)) < 1e-6
                assert e.at_bound == at_end, (name, e)


def test_one_parameter_at_its_bound_leaves_the_others_their_deviation() -> None:
    frictionless = ga.Model(5000.0, [0.0])
    ctl = ga.PI(0.05, 2.0)
    rec = closed(frictionless, ctl, stairs(600), 0.05, seed=3)
    space = ga.SearchSpace(gain=(1e3, 2e4), real=(0.0, 60.0), imaginary=(0.0, 250.0), p=(1, 1), q=(0, 0))
    found = [ga.identify(replaced(rec, rec.velocity + 1e-3 * k), ctl, space=space, workers=1) for k in (-3, 3)]
    bound = [idn for idn in found if idn.parameters["pole_1"].at_bound]
    assert bound, "one of the two must end at the bound for this test to mean anything"
    for idn in bound:
        assert idn.mechanics is not None and 0.0 < idn.mechanics.std["J"] < 0.01 * idn.mechanics.J


def test_a_slightly_unstable_plant_is_found_without_given_ranges() -> None:
    ctl = ga.PI(0.05, 2.0)
    rec = closed(ga.Model(5000.0, [8.0]), ctl, stairs(1000), 0.05)
    idn = ga.identify(rec, ctl, workers=1)
    assert (idn.p, idn.q) == (1, 0)
    assert abs(idn.model.poles[0].real - 8.0) < 5.0 * idn.parameters["pole_1"].std


def test_the_same_data_twice_is_refused() -> None:
    ctl = ga.PI(0.05, 2.0)
    rec = closed(ONE_MASS, ctl, stairs(300), 0.05)
    with pytest.raises(RecordError, match="same data"):
        ga.identify([rec, rec], ctl)


def test_the_plain_engine_without_ranges_warns() -> None:
    ctl = ga.PI(0.05, 2.0)
    rec = closed(ONE_MASS, ctl, stairs(300), 0.05)
    idn = ga.identify(rec, ctl, settings=replace(ga.Settings.paper(), generations=20), workers=1)
    assert any("narrow" in w for w in idn.warnings)


@pytest.mark.parametrize(
    "call",
    [
        lambda: ga.Settings(population="50"),
        lambda: ga.Settings(elites=50),
        lambda: ga.SearchSpace.from_mechanics(inertia=1e-4, resonance_hz=(1.0, 2.0)),
        lambda: ga.SearchSpace.from_mechanics(inertia=("a", "b"), resonance_hz=(1.0, 2.0)),
        lambda: ga.SearchSpace(gain_scale="1"),
        lambda: ga.simulate(ONE_MASS, None),
        lambda: ga.load(None),
    ],
)
def test_wrong_types_end_in_a_value_error(call: object) -> None:
    assert callable(call)
    with pytest.raises(ga.GaidentError):
        call()
    assert issubclass(ga.GaidentError, ValueError)


def test_numpy_numbers_are_numbers() -> None:
    assert ga.Settings(population=np.int64(60)).population == 60
    assert ga.SearchSpace(gain=np.array([1e3, 2e4])) == ga.SearchSpace()
    with pytest.raises(SpaceError):
        ga.SearchSpace(gain=np.array([1e3, 2e4, 3e4]))


def test_ctrl_c_returns_within_a_fifth_of_a_second() -> None:
    """From the signal to KeyboardInterrupt, in a search that would take minutes and in a fit of a long record."""
    import _thread
    import signal

    # A shell starts background jobs with SIGINT ignored, and interrupt_main() respects that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    ctl = ga.PI(0.05, 2.0)
    for samples, settings in ((300, ga.Settings(engine="plain", generations=5_000_000)), (6_000_000, ga.Settings())):
        rec = closed(TWO_MASS, ctl, stairs(samples), 0.05)

        def seconds(rec: ga.Record = rec, settings: ga.Settings = settings) -> float:
            sent: list[float] = []

            def interrupt() -> None:
                sent.append(time.perf_counter())
                _thread.interrupt_main()

            timer = threading.Timer(0.5, interrupt)
            timer.start()
            with pytest.raises(KeyboardInterrupt):
                ga.identify(rec, ctl, settings=settings, workers=2)
            return time.perf_counter() - sent[0]

        assert fastest(seconds, below=0.2) < 0.2


def test_a_damped_shaft_is_named_as_the_better_mechanics() -> None:
    drive = ga.TwoMass(JM=4e-4, DM=5e-4, JL=9e-4, DL=1e-4, KG=1.2, DG=0.004)
    ctl = ga.PI(0.05, 0.8)
    idn = ga.identify(closed(drive.model(), ctl, stairs(2000), 0.02), ctl, workers=1)
    assert isinstance(idn.mechanics, ga.TwoMass) and idn.mechanics.with_shaft_damping is not None
    assert any("with_shaft_damping" in w for w in idn.warnings)
    damped = idn.mechanics.with_shaft_damping
    assert abs(damped.JM - 4e-4) < 5.0 * damped.std["JM"]
    undamped = ga.TwoMass(JM=4e-4, DM=5e-4, JL=9e-4, DL=1e-4, KG=1.2)
    plain = ga.identify(closed(undamped.model(), ctl, stairs(2000), 0.02), ctl, workers=1)
    assert not any("with_shaft_damping" in w for w in plain.warnings)


def test_the_tail_of_chi_square_is_as_in_its_tables() -> None:
    """Two degrees of freedom: e^(-x/2); one: erfc(sqrt(x/2)); beside them a table's 5 % and 1 %."""
    for x in (0.0, 0.01, 1.0, 7.3, 40.0, 300.0):
        assert chi2_tail(x, 2) == pytest.approx(math.exp(-0.5 * x), rel=1e-12)
        assert chi2_tail(x, 1) == pytest.approx(math.erfc(math.sqrt(0.5 * x)), rel=1e-12)
    for dof, x, tail in ((3, 7.815, 0.05), (8, 15.507, 0.05), (25, 44.314, 0.01), (80, 101.879, 0.05)):
        assert chi2_tail(x, dof) == pytest.approx(tail, rel=1e-3)


def test_python_says_what_the_log_says_of_the_controller() -> None:
    command = np.repeat([20.0, -30.0, 10.0, -5.0], 100)
    run = ga.run(ga.OneMass(J=0.01, D=0.05), ga.Record(1e-3, command=command, velocity=0.0 * command), ga.PI(kp=0.5, ki=5.0))
    rec = ga.Record(1e-3, command=command, velocity=run.velocity, torque=run.torque)
    wrong, right = (ga.identify(rec, ga.PI(kp=kp, ki=5.0)).warnings for kp in (0.4, 0.5))
    assert wrong[0].startswith("The logged torque does not follow") and "Give kp = 0.5 N m s/rad" in wrong[0]
    assert "Give kp = 0.5 N s/m" in said(wrong[0], "linear")
    assert not any("does not follow" in w for w in right)


def test_a_resonance_above_what_the_log_shows_is_said_to_be_unseen() -> None:
    seen, fast = (ga.TwoMass(JM=1e-4, DM=0.003, JL=3e-4, DL=0.003, KG=K) for K in (60.0, 2200.0))
    assert unseen_notes(seen, 1e-3) == [] == unseen_notes(ga.OneMass(J=1e-4, D=0.1), 1e-3) == unseen_notes(None, 1e-3)
    (note,) = unseen_notes(fast, 1e-3)
    assert "above 4e+02 Hz does not show" in note and "862 Hz stands for something else" in note
    assert unseen_notes(fast, 0.25e-3) == []


def test_a_log_that_is_slower_than_the_velocity_loop_is_said_and_what_it_still_shows() -> None:
    """kp/J = 500 rad/s: a line every 5 ms shows it just so, one every 20 ms does not."""
    axis = ga.TwoMass(JM=4e-4, DM=1e-3, JL=6e-4, DL=1e-3, KG=400.0)
    assert inertia_of(axis) == 1e-3 == inertia_of(ga.OneMass(J=1e-3, D=0.1)) and inertia_of(None) is None
    servo = ga.Cascade(ga.PI(0.5, 20.0), 125e-6)
    assert slower_than_the_loop(1e-3, servo, 5e-3) == [] == slower_than_the_loop(1e-3, None, 20e-3)
    assert slower_than_the_loop(None, servo, 20e-3) == [] == slower_than_the_loop(1e-3, ga.PI(None, 20.0), 20e-3)
    (note,) = slower_than_the_loop(inertia_of(axis), servo, 20e-3)
    assert note.startswith("The velocity loop settles in 2 ms (inertia over kp), and the log has a line every 20 ms")
    assert "the torque at held speeds: `gaident.friction_map`" in note


def test_a_velocity_of_another_unit_than_its_position_is_said() -> None:
    t = 0.01 * np.arange(2000)
    velocity = np.sin(t) + np.sin(3.1 * t)
    angle = np.cumsum(velocity) * 0.01

    def told(velocity: np.ndarray, position: np.ndarray) -> list[str]:
        rec = ga.Record(0.01, velocity=velocity, torque=velocity, position=position)
        return [said(note, "linear") for note in reading_notes([rec]) if "as fast as the logged velocity" in note]

    noise = 0.05 * np.random.default_rng(1).standard_normal(len(t))
    assert not told(velocity, angle) and not told(velocity + noise, angle) and not told(1.02 * velocity, angle)
    (note,) = told(velocity / 2.0, angle)
    assert note.startswith("The logged position moves 2 times") and "Mass and friction" in note
    assert not told(velocity, np.cos(40.0 * t)), "another motion is no unit"
