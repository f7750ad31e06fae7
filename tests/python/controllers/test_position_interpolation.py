"""A command between the lines of a log that is slower than its controller: straight, as a profile, round the bends of ramps."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from drive_rig import Plant, rig, run_drive, skip_without_library
from gaident.control.between import at_the_clock, between_lines
from gaident.control.profile import profile_between
from gaident.errors import ControllerError
from gaident.identification.closed_loop import line_equation
from gaident.identification.controller_numbers import with_estimates
from gaident.identification.logged_torque import corrected, not_followed
from gaident.models.made_torque import _first_level

T, EVERY = 250e-6, 4
DRIVE = ga.Cascade(ga.PI(0.3, 15.0), T, position=ga.P(30.0), velocity_feedforward=1.0)
AXIS = Plant(J=1.5e-3, D=2e-3, kp=0.3, ki=15.0, dt=EVERY * T, cascade=DRIVE, name="axis")


def profile(seconds: float, period: float, rise: float = 1500.0) -> np.ndarray:
    """Positions at a controller's samples [rad] of moves with trapezoidal velocities, whose corners lie anywhere."""
    speeds = np.repeat([0.0, 60.0, 120.0, 25.0, -50.0, -120.0, -35.0, 0.0, 40.0, 0.0], int(np.ceil(seconds / period / 10.0)) + 1)
    speed, slope = np.zeros(round(seconds / period)), rise * period
    for n in range(1, len(speed)):
        speed[n] = speed[n - 1] + np.clip(speeds[n] - speed[n - 1], -slope, slope)
    return np.concatenate([[0.0], np.cumsum(speed[:-1])]) * period


def record(effects: dict[str, dict[str, float]], decimals: int = 9) -> ga.Record:
    """The log of a drive whose profile is made at the controller's samples; one line for four of them."""
    skip_without_library()
    whole = profile(2.0, T)
    noise = 0.002 * np.random.default_rng(1).standard_normal(len(whole))
    log = run_drive(AXIS, np.ascontiguousarray(whole), effects, velocity_noise=noise)
    lines = {"velocity": log.velocity, "torque": log.torque, "position": log.position, "position_command": whole}
    return ga.Record(EVERY * T, **{name: np.round(x[::EVERY], decimals) for name, x in lines.items()})


@pytest.mark.parametrize("every", [2, 4, 8])
@pytest.mark.parametrize("decimals", [7, 12])
def test_a_profile_is_found_again_between_its_lines(every: int, decimals: int) -> None:
    whole = profile(2.0, T)
    found, straight = (
        between(np.round(whole[::every], decimals), every)[: len(whole)] for between in (profile_between, at_the_clock)
    )
    off, plain = (np.abs(np.diff(x - whole)[: -2 * every]) / T for x in (found, straight))
    assert np.sqrt(np.mean(off**2)) < 0.05 * np.sqrt(np.mean(plain**2))  # rad/s
    assert np.max(off) < 1.1 * 1500.0 * T  # one sample of the acceleration, where a speed is reached within a sample


def test_a_smooth_profile_has_no_corners() -> None:
    t = np.arange(0.0, 1.0, T)
    whole = 3.0 * np.sin(20.0 * t) + np.sin(90.0 * t)
    found, straight = (between(whole[::EVERY], EVERY)[: len(t)] for between in (profile_between, at_the_clock))
    inside = slice(EVERY, -2 * EVERY)  # before the first line and behind the last nothing is known
    assert np.abs(found - whole)[inside].max() < 0.02 * np.abs(straight - whole)[inside].max()
    assert np.array_equal(found[::EVERY], whole[::EVERY])


@pytest.mark.long
def test_where_the_torque_shows_a_profile_the_position_command_is_no_staircase() -> None:
    rec = record({"coulomb_friction": {"torque": 0.3}})
    smooth = ga.Cascade(ga.PI(0.3, 15.0), T, position=ga.P(30.0), velocity_feedforward=1.0, interpolation="smooth")
    assert not_followed([rec], DRIVE) and not not_followed([rec], smooth)
    found = corrected([rec], DRIVE)
    assert found is not None and found.controller == smooth and found.estimates == {}
    dia = ga.diagnose(rec, DRIVE)
    assert dia.verdict == "explained" and {f.effect: f.alternatives for f in dia.causes} == {"coulomb_friction": ()}, (
        dia.summary()
    )
    assert dia.controller == smooth and any("interpolation" in note for note in dia.notes)
    assert dia.causes[0].parameters["torque"].value == pytest.approx(0.3, rel=2e-3)
    assert dia.mechanics["inertia"].value == pytest.approx(AXIS.J, rel=1e-3)


@pytest.mark.long
def test_a_feedforward_that_was_not_given_is_found_beside_the_way_of_the_command() -> None:
    rec = record({})
    bare = ga.Cascade(ga.PI(0.3, 15.0), T, position=ga.P(30.0))
    found = corrected([rec], bare)
    assert found is not None and isinstance(found.controller, ga.Cascade) and found.controller.interpolation == "smooth"
    assert found.estimates["velocity_feedforward"].value == pytest.approx(1.0, abs=1e-3)
    open_one = ga.Cascade(ga.PI(0.3, 15.0), T, position=ga.P(30.0), velocity_feedforward=None)
    assert with_estimates([rec], open_one).controller == found.controller
    idn = ga.identify(rec, controller=DRIVE, settings=ga.Settings(generations=3, population=20))
    assert any("interpolation" in note for note in idn.warnings)


def test_a_number_is_estimated_on_the_given_way_unless_another_is_clearly_better() -> None:
    skip_without_library()
    rng = np.random.default_rng(4)
    straight = rig(AXIS, profile(2.0, T)[::EVERY], {}, "none", 1, position_logged=True)
    for rec, true in ((record({}), "smooth"), (straight, "straight")):
        for noise in (0.0, 0.05):
            noisy = rec.with_channels(torque=rec.torque + noise * np.std(rec.torque) * rng.standard_normal(len(rec)))
            for given in ("smooth", "straight"):
                pi = ga.PI(0.3, None)
                one = ga.Cascade(pi, T, position=ga.P(30.0), velocity_feedforward=1.0, interpolation=given)
                found = with_estimates([noisy], one)
                assert isinstance(found.controller, ga.Cascade) and found.controller.interpolation == true
                assert found.estimates["velocity.ki"].value == pytest.approx(15.0, rel=0.01)
                said = [note for note in found.notes if f"(interpolation '{true}') (given: '{given}')" in note]
                assert len(said) == (given != true), found.notes


@pytest.mark.parametrize("given", ["straight", "smooth"])
def test_where_no_way_is_clearly_better_the_given_one_stays(given: str) -> None:
    skip_without_library()
    still = rig(AXIS, profile(2.0, T, rise=20.0)[::EVERY], {}, "none", 1, position_logged=True)
    torque = still.torque + 0.05 * np.std(still.torque) * np.random.default_rng(4).standard_normal(len(still))
    one = ga.Cascade(ga.PI(0.3, None), T, position=ga.P(30.0), velocity_feedforward=1.0, interpolation=given)
    found = with_estimates([still.with_channels(torque=torque)], one)
    assert isinstance(found.controller, ga.Cascade) and found.controller.interpolation == given and len(found.notes) == 1


def test_a_command_that_goes_straight_stays_straight() -> None:
    skip_without_library()
    rec = rig(AXIS, profile(2.0, T)[::EVERY], {}, "none", 1, position_logged=True)
    assert not not_followed([rec], DRIVE)
    assert (
        with_estimates([rec], ga.Cascade(ga.PI(0.3, 15.0), T, position=ga.P(None), velocity_feedforward=1.0)).controller
        is not None
    )


def test_the_way_of_a_command_is_a_setting() -> None:
    smooth = ga.Cascade(ga.PI(0.3, 15.0), T, position=ga.P(30.0), interpolation="smooth")
    assert ga.Cascade.from_dict(smooth.to_dict()) == smooth
    assert "interpolation" not in DRIVE.to_dict()
    assert [c.interpolation for c in smooth.readings(1e-3)] == ["smooth", "straight"] and len(smooth.readings(T)) == 1
    rec = record({})
    assert line_equation([rec], DRIVE, None) and not line_equation([rec], smooth, None)
    with pytest.raises(ControllerError, match="interpolation is 'cubic'"):
        ga.Cascade(ga.PI(0.3, 15.0), T, interpolation="cubic")


def test_what_the_integrator_stored_is_known_best_where_its_error_has_not_added_up() -> None:
    rng = np.random.default_rng(3)
    walk, noise = np.cumsum(1e-3 * rng.standard_normal(5000)), 0.01 * rng.standard_normal(5000)
    assert _first_level(1.2 + walk + noise) == pytest.approx(1.2, abs=0.01)
    assert _first_level(1.2 + noise) == pytest.approx(1.2, abs=1e-3)
    assert abs(np.mean(1.2 + walk + noise) - 1.2) > 0.01


def ramps(seconds: float, period: float, rise: float = 1500.0) -> np.ndarray:
    """Velocities at a controller's samples [rad/s] of ramps that begin and end anywhere between the lines of a log."""
    return np.diff(profile(seconds + period, period, rise), append=0.0)[: round(seconds / period)] / period


@pytest.mark.parametrize("every", [2, 4, 8])
@pytest.mark.parametrize("decimals", [3, 12])
def test_the_bends_of_ramps_are_found_again_between_the_lines(every: int, decimals: int) -> None:
    whole = ramps(2.0, T)
    line = np.round(whole[::every], decimals)
    found, straight = (between(line, every)[: len(whole) - every] for between in (between_lines, at_the_clock))
    off, plain = (np.abs(x - whole[: len(x)]) for x in (found, straight))
    assert plain.max() > 0.1 * 1500.0 * every * T, "a straight line cuts the bends"
    assert off.max() < 4.0 * 10.0**-decimals + 1e-9  # rad/s; `whole` is a difference of sums
    assert np.array_equal(found[::every], line[: len(found[::every])])


def test_steps_are_held_and_bent_curves_go_straight_between_the_lines() -> None:
    steps = np.repeat([0.0, 20.0, -30.0, -29.0], 10)
    assert np.array_equal(between_lines(steps, 4), np.repeat(steps, 4))
    curve = 50.0 * np.sin(0.3 * np.arange(200.0))
    assert np.array_equal(between_lines(curve, 4), at_the_clock(curve, 4)[: 199 * 4].tolist() + [curve[-1]] * 4)
    assert np.array_equal(between_lines(np.arange(4.0), 4)[:12], np.arange(12.0) / 4.0), "too short for a bend"


@pytest.mark.long
def test_a_ramp_whose_bends_lie_between_the_lines_is_no_cause() -> None:
    """Two masses behind a current loop, 1 kHz of 4 kHz: a straight line through the bends named a delay, J 7 % off."""
    skip_without_library()
    loop = ga.Cascade(ga.PI(1.3, 80.0, rule="backward"), T)
    axis = Plant(J=2.2e-3, D=1e-3, JL=3.4e-3, DL=1e-3, KG=900.0, DG=0.02, kp=1.3, ki=80.0, dt=EVERY * T, cascade=loop)
    whole = np.ascontiguousarray(ramps(2.0, T))
    lag = {"torque_lag": {"time_constant": 0.25e-3}}
    log = run_drive(axis, whole, lag, encoder=2 * np.pi / 2**20, differenced=True)
    lines = {"velocity": log.velocity, "torque": log.torque, "command": np.round(whole, 4)}
    rec = ga.Record(EVERY * T, **{name: x[::EVERY] for name, x in lines.items()})
    dia = ga.diagnose(rec, loop)
    assert [f.effect for f in dia.causes] == ["torque_lag"] and dia.causes[0].alternatives == ("velocity_filter",)
    assert dia.causes[0].parameters["time_constant"].value == pytest.approx(0.25e-3, rel=0.02)
    assert dia.mechanics["motor_inertia"].value == pytest.approx(2.2e-3, rel=5e-3)
