"""Lags, delays and filters of a drive with a resonance that is fast beside the substep, against what is exact there."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga

Array = NDArray[np.float64]

DT = 0.125e-3  # s
TIME_CONSTANT = 0.2e-3  # s
BANDWIDTH = 8e3  # rad/s
DELAY = 3  # fifths of a sample
SPAN = 3  # samples
INERTIA = 1e-3  # kg m^2, of motor and load


def drive(resonance: float) -> ga.Model:
    """Two masses with a resonance [Hz], damped by 2 %."""
    w = 2.0 * np.pi * resonance
    stiffness = 0.5 * w**2 * INERTIA
    return ga.TwoMass(INERTIA, 1e-3, INERTIA, 1e-3, stiffness, 0.04 * stiffness / w).model()


def steps(n: int = 2000) -> Array:
    """A torque that jumps every hundred samples [N m]."""
    return np.repeat(np.random.default_rng(1).uniform(-1.0, 1.0, n // 100), 100)


def velocity(model: ga.Model, torque: Array, dt: float = DT, substeps: int | None = 1) -> Array:
    return ga.simulate(model, ga.Record(dt, torque=torque, velocity=np.zeros(len(torque))), substeps=substeps)


def rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


EFFECTS = {
    "transport_delay": {"delay": DELAY * DT / 5},
    "torque_lag": {"time_constant": TIME_CONSTANT},
    "velocity_filter": {"time_constant": TIME_CONSTANT},
    "velocity_observer": {"bandwidth": BANDWIDTH},
    "velocity_difference": {"samples": float(SPAN)},
}


def exact(model: ga.Model, names: tuple[str, ...]) -> Array:
    """The linear recurrence alone, five times a sample: lags and filters as more poles, the difference as a sum of ten parts."""
    torque = np.repeat(steps(), 5)
    for name in names:
        if name == "transport_delay":
            torque = np.concatenate([np.zeros(DELAY), torque[:-DELAY]])
        elif name == "velocity_observer":
            model = ga.Model(model.gain * BANDWIDTH**2, [*model.poles, -BANDWIDTH, -BANDWIDTH], model.zeros)
        elif name != "velocity_difference":
            model = ga.Model(model.gain / TIME_CONSTANT, [*model.poles, -1.0 / TIME_CONSTANT], model.zeros)
    if "velocity_difference" not in names:
        return velocity(model, torque, DT / 5, None)[::5]
    fine = velocity(model, np.repeat(torque, 2), DT / 10, None)
    simpson = np.concatenate([[0.0], np.cumsum(fine[:-2:2] + 4.0 * fine[1:-1:2] + fine[2::2])]) / 6.0
    angle = simpson[::5] / 5.0  # samples' means, summed
    return (angle - np.concatenate([np.zeros(SPAN), angle[:-SPAN]])) / SPAN


def with_effects(model: ga.Model, names: tuple[str, ...]) -> ga.Model:
    for name in names:
        model = model.with_effect(name, **EFFECTS[name])
    return model


PAIRS = [("transport_delay", "torque_lag"), ("torque_lag", "velocity_filter")]


@pytest.mark.parametrize("names", [*((name,) for name in EFFECTS), *PAIRS])
@pytest.mark.parametrize("resonance", [100.0, 442.0])
def test_one_substep_is_enough(resonance: float, names: tuple[str, ...]) -> None:
    # A torque held at its mean over the substep, and a velocity that is straight there, miss 1 to 5 % of what the effect changes.
    model = drive(resonance)
    truth = exact(model, names)
    changed = rms(truth - velocity(model, steps()))
    assert changed > 0.02
    assert rms(velocity(with_effects(model, names), steps()) - truth) < 1e-3 * changed


def test_what_is_left_falls_with_the_third_power_of_the_step() -> None:
    model, names = drive(442.0), ("transport_delay", "torque_lag")
    truth = exact(model, names)
    coarse, fine = (rms(velocity(with_effects(model, names), steps(), substeps=m) - truth) for m in (1, 4))
    assert fine < coarse / 4.0**2.5


@pytest.mark.parametrize(
    ("effect", "side", "numbers"),
    [
        ("hardening_stiffness", "motor", {"cubic_stiffness": 1e6}),
        ("coulomb_friction", "load", {"torque": 0.05}),
        ("coulomb_friction", "motor", {"torque": 0.05}),
    ],
)
def test_beside_friction_and_a_nonlinear_coupling_as_finer_steps_say(effect: str, side: str, numbers: dict[str, float]) -> None:
    bare = drive(200.0)
    late = with_effects(bare, ("transport_delay", "torque_lag", "velocity_filter"))
    bare, late = (m.with_effect(effect, side=side, **numbers) for m in (bare, late))  # type: ignore[arg-type]
    truth = velocity(late, steps(), substeps=32)
    changed = rms(truth - velocity(bare, steps(), substeps=32))
    assert rms(velocity(late, steps()) - truth) < 5e-3 * changed


FAST: list[tuple[list[complex], float]] = [
    ([-3e4], 2e-3),
    ([-3e4, -5e4], 2e-3),
    ([-1e5 + 1e5j, -1e5 - 1e5j], 2e-3),
    ([-2e5, -2.5e5, -3e5, -3.5e5], 5e-3),
    ([-1e6, -2e6], 4e-3),
    ([-1e3 + np.pi / DT * 1j, -1e3 - np.pi / DT * 1j], 1.7e-2),  # swings once in two substeps: no state at their ends shows it
]
"""(more poles, what one substep may leave of the change); a straight line's where the state does not show them."""


@pytest.mark.parametrize(("fast", "left"), FAST)
def test_modes_that_end_within_a_substep_are_no_obstacle(fast: list[complex], left: float) -> None:
    """Of two that are gone the state before the substep tells nothing: the velocity is then straight between its ends again."""
    slow = drive(100.0)
    model = ga.Model(slow.gain * float(np.prod(np.abs(fast))), [*slow.poles, *fast], slow.zeros)
    for name in ("torque_lag", "velocity_filter"):
        truth = exact(model, (name,))
        changed = rms(truth - velocity(model, steps()))
        assert rms(velocity(with_effects(model, (name,)), steps()) - truth) < left * changed, name
        assert rms(velocity(with_effects(model, (name,)), steps(), substeps=None) - truth) < 2e-3 * changed, name


@pytest.mark.parametrize("name", ["velocity_filter", "velocity_observer", "velocity_difference"])
@pytest.mark.parametrize("masses", [1, 2])
def test_a_shaft_that_sticks_is_seen_at_rest_while_its_torque_rises(name: str, masses: int) -> None:
    model = ga.OneMass(INERTIA, 1e-3).model() if masses == 1 else drive(200.0)
    late = with_effects(model, ("transport_delay", name)).with_effect("coulomb_friction", torque=0.5)
    torque = 0.4 * np.sign(steps())
    for substeps in (None, 1):
        assert np.all(velocity(late, torque, substeps=substeps) == 0.0)


@pytest.mark.parametrize("late", ["transport_delay", "torque_lag"])
@pytest.mark.parametrize(
    ("effect", "side", "numbers"),
    [
        ("coulomb_friction", "load", {"torque": 0.05}),
        ("position_inertia", "motor", {"amplitude": 0.3, "order": 1.0, "phase": 0.2}),
    ],
)
def test_a_load_behind_a_stiff_damper_is_not_moved_beforehand(
    late: str, effect: str, side: str, numbers: dict[str, float]
) -> None:
    """What stands for the rise of the torque is no motion of the load that its friction or its inertia would see."""
    model = ga.TwoMass(INERTIA, 1e-3, INERTIA, 1e-3, 200.0, 30.0).model().with_effect(effect, side=side, **numbers)  # type: ignore[arg-type]
    both = model.with_effect(late, **({"delay": 0.6e-3} if late == "transport_delay" else {"time_constant": 1e-3}))
    truth = velocity(both, steps(), 1e-3, 64)
    assert rms(velocity(both, steps(), 1e-3, None) - truth) < 1e-2 * rms(truth - velocity(model, steps(), 1e-3, 64))
