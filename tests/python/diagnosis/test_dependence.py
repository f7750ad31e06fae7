"""What an error depends on: the families of a short record."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.dependence import Dependence, _drifts, _strongest, dependence
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Hypothesis, Innovations, Objective, OutputErrors
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import ClosedLoop, OpenLoop
from gaident.estimation.prefilter import Prefilter
from gaident.estimation.projection import project_out
from gaident.estimation.term import Scales
from gaident.policy.table import POLICY

RNG = np.random.default_rng(0)


def test_a_short_record_takes_of_a_family_what_holds_most_of_it_whatever_the_order() -> None:
    few = RNG.standard_normal((3, 200))
    family = RNG.standard_normal((9, 3)) @ few + 1e-3 * RNG.standard_normal((9, 200))
    kept = _strongest(family, 4)
    assert kept.shape == (4, 200)
    left = project_out(kept, family)
    assert np.abs(left).max() < 0.01, "nine functions that are three to a thousandth"
    # A function that stands last counts as much as one that stands first.
    other = _strongest(family[::-1], 4)
    np.testing.assert_allclose(project_out(kept, other), 0.0, atol=1e-6)
    cut = project_out(np.vstack([family[:2], family[:2]]), family)
    assert np.abs(cut).max() > 0.1
    sizes = np.geomspace(1e-6, 1e6, 9)[:, None]
    np.testing.assert_allclose(project_out(kept, _strongest(sizes * family, 4)), 0.0, atol=1e-6)


@pytest.mark.parametrize("room", [9, 30])
def test_where_there_is_room_a_family_stays_as_it_is(room: int) -> None:
    family = RNG.standard_normal((9, 200))
    np.testing.assert_array_equal(_strongest(family, room), family)


def test_the_driver_of_output_errors_is_chosen_by_the_errors_that_it_is_tested_by() -> None:
    """What is left before whitening: weighed where there is a prefilter, else raw. Of whitened errors the gain decides."""
    n, dt = 1000, 1e-3
    axis = ga.OneMass(J=0.01, D=0.02).model()
    still = ga.Record(dt, velocity=np.zeros(n), torque=np.repeat(np.tile([1.0, -1.0], 5), n // 10))
    velocity = ga.simulate(axis, still) + 4.0 * np.linspace(0.0, 1.0, n) ** 2 + 0.1 * RNG.standard_normal(n)
    data = DataSet.of([still.with_channels(velocity=velocity)], None)
    scales = Scales(dt, n * dt, 50.0, 1.0, 1.0, 10.0, 0.02, float("nan"), float("nan"), False, 1.0)
    parameters = Parameterisation.of(axis, scales, [False])
    hypothesis, x = Hypothesis(parameters, OpenLoop(data)), parameters.start(axis)
    raw, weighed = (Objective(data, np.ones(n), OutputErrors(100.0, p)) for p in (None, Prefilter(dt, 2.0, 40.0, 4)))
    found = [dependence(o, o.fitted(hypothesis, x, WHITE, 1.0)) for o in (raw, weighed)]
    assert found[0].unwhitened == pytest.approx(found[0].least) and found[1].least == pytest.approx(found[0].least)
    rows, error = RNG.standard_normal((3, n)), velocity - ga.simulate(axis, still)
    left = project_out(weighed.whitened(rows, WHITE), weighed.whitened(error[None, :], WHITE))
    assert weighed.unwhitened_rest(rows, error) == pytest.approx(float(np.sum(left**2)))
    assert max(found[1].unwhitened.values()) < 0.5 * max(found[1].least.values()), "a slow drift is a small torque"
    apart = replace(found[1], least={"time": 1.0, "velocity": 2.0}, unwhitened={"time": 2.0, "velocity": 1.0})
    apart = replace(apart, gains={"time": 80.0, "velocity": 60.0}, needed=47.0)
    assert apart.strongest == apart.driver == "velocity" and replace(apart, whitened=True).driver == "time"


def test_a_driver_takes_away_a_share_of_the_error_whatever_its_gain() -> None:
    """With many exact samples what nobody would miss gains BIC units; one frequency is small by nature, and is told."""
    gains, least = {"position": 300.0, "time": 100.0}, {"position": 0.9998, "time": 0.9999}
    left = Dependence(gains, least, dict(least), needed=50.0, rest=1.0)
    assert left.strongest == "position" and left.driver is None
    assert replace(left, unwhitened={"position": 0.98, "time": 0.9999}).driver == "position"
    hum = replace(left, gains={"position": 10.0, "time": 100.0}, line=(50.0, 0.01))
    assert hum.driver == "time" and replace(hum, line=None).driver is None


def left_beside(u: np.ndarray, velocity: np.ndarray, dt: float, start: Mapping[str, Sequence[float]] = {}) -> Dependence:
    """What the errors of an axis with J = 0.01 and D = 0.02, fitted with these effects from these starts, depend on."""
    rec = ga.Record(dt, velocity=velocity, torque=u)
    axis, data = ga.OneMass(J=0.01, D=0.02).model(), DataSet.of([rec], None)
    scales = Scales(dt, rec.duration, 50.0, 1.0, 1.0, 10.0, 0.02, float("nan"), float("nan"), False, 1.0)
    parameters = Parameterisation.of(axis, scales, [False])
    x = parameters.start(axis)
    for name, z in start.items():
        parameters, x = parameters.extended(LIBRARY[name]), parameters.inserted(x, np.array(z))
    objective = Objective(data, np.ones(len(u)), Innovations())
    return dependence(objective, ls.fit(objective, Hypothesis(parameters, OpenLoop(data)), x, WHITE, POLICY.usual))


def driven(n: int = 4000) -> np.ndarray:
    """A torque of levels in both directions [N m]."""
    return np.repeat(np.random.default_rng(3).uniform(-0.6, 0.6, n // 100), 100)


def rolled(dt: float, torque: Callable[[int, float, float], float], n: int = 4000) -> np.ndarray:
    """The velocity of that axis under torque(line, velocity, angle), ten Euler steps a line, with noise of 0.02 rad/s."""
    w = angle = 0.0
    found = np.empty(n)
    for i in range(n):
        found[i] = w
        for _ in range(10):
            w, angle = w + 0.1 * dt * (torque(i, w, angle) - 0.02 * w) / 0.01, angle + 0.1 * dt * w
    return found + 0.02 * np.random.default_rng(4).standard_normal(n)


def test_a_torque_constant_that_falls_depends_on_the_time_and_not_on_the_torque() -> None:
    u, dt = driven(), 1e-3
    left = left_beside(u, rolled(dt, lambda i, w, _: u[i] * (1.0 - 0.2 * (1.0 - np.exp(-i / 1500.0)))), dt)
    assert left.driver == "time" and left.gains["time"] > 2.0 * left.gains["torque"], left.gains


def test_what_changes_in_time_is_in_one_of_the_families_of_the_time() -> None:
    """Friction that goes up, down and up again is no line or parabola; a winding that gets warm is nearly a parabola."""
    t, u = np.arange(4000) / 1000.0, driven()
    w = np.random.default_rng(8).standard_normal(4000)
    load, friction, constant = _drifts(t, w, u)
    walking, warming = np.sin(2.0 * np.pi * t / 3.0) * np.sign(w), u * (1.0 - np.exp(-t / 1.5))

    def left_of(x: np.ndarray, rows: np.ndarray) -> float:
        return float(np.std(project_out(rows, x[None, :])) / np.std(x))

    assert left_of(walking, friction) < 0.15 and left_of(walking, np.vstack([load, constant])) > 0.9
    assert left_of(warming, constant) < 0.1 and left_of(warming, np.vstack([load, friction])) > 0.9
    assert len(_drifts(t, w, None)) == 2, "of a measured torque a function contains its noise"
    assert left_of((0.3 - 0.1 * t) * w, np.vstack([w, friction])) < 1e-9, "damping that falls with the temperature"


def test_a_ripple_that_grows_with_the_speed_is_left_beside_one_that_does_not() -> None:
    """The sensor shows w + 1e-3 w abs(w) cos(3 theta); a ripple of order 3 explains it at one speed only."""
    u, dt = driven(), 1e-3
    w, ripple = rolled(dt, lambda i, w, _: u[i]), {"velocity_ripple": (0.01, 0.0, 3.0)}
    angle = dt * np.append(0.0, np.cumsum(0.5 * (w[1:] + w[:-1])))
    left = left_beside(u, w + 1e-3 * w * np.abs(w) * np.cos(3.0 * angle), dt, ripple)
    assert left.driver == "position", left.gains
    held = left_beside(u, w + 0.02 * w * np.cos(3.0 * angle), dt, ripple)
    assert held.driver is None, held.gains


@pytest.mark.parametrize("order", [1.0, 3.0])
def test_what_an_error_of_the_sensor_makes_in_the_loop(order: float) -> None:
    """A simulated loop with a small ripple against the linear answer to that ripple; the controller answers, too."""
    n, dt, a = 3000, 1e-3, 1e-4
    axis, loop = ga.OneMass(J=0.01, D=0.02).model(), ga.PI(kp=0.5, ki=10.0)
    command = 20.0 + 5.0 * np.sin(np.arange(n) / 200.0)
    scales = Scales(dt, n * dt, 50.0, 1.0, 1.0, 10.0, 0.02, float("nan"), float("nan"), False, 1.0)
    linear = Parameterisation.of(axis, scales, [False])
    x = linear.start(axis)
    rec = ga.Record(dt, velocity=np.zeros(n), command=command, torque=np.zeros(n))
    smooth = ClosedLoop(DataSet.of([rec], loop)).velocities(linear, x[None, :])[0]
    predictor = ClosedLoop(DataSet.of([rec.with_channels(velocity=smooth)], loop))  # whose angle is that of the motion
    rippled = linear.extended(LIBRARY["velocity_ripple"])
    moved = predictor.velocities(rippled, linear.inserted(x, np.array([a, 0.0, order]))[None, :])[0]
    moved -= predictor.velocities(linear, x[None, :])[0]
    angle = dt * np.append(0.0, np.cumsum(0.5 * (smooth[1:] + smooth[:-1])))
    error = smooth * a * order * np.cos(order * angle)
    answer = predictor.sensor_response(linear, x, error[None, :])[0]
    assert np.std(answer - moved) < 0.01 * np.std(moved)
    assert np.std(error - moved) > 0.1 * np.std(moved), "without the controller's answer"
