"""The same seed and records give the same diagnosis to the last bit: whatever their order and the number of workers."""

from __future__ import annotations

from typing import Any

import numpy as np

import gaident as ga

DT = 1e-3
LEVELS = (20.0, -20.0, 5.0, -5.0, 40.0, -40.0)  # rad/s
CONTROLLER = ga.PI(kp=0.05, ki=1.5)
DRIVE = ga.OneMass(J=5e-4, D=2e-3).model().with_effect("coulomb_friction", torque=0.05)


def recorded(seed: int, levels: tuple[float, ...] = LEVELS, torque: bool = False) -> ga.Record:
    """Dry friction under steps with a dither, noise inside the loop; a record of its own for each seed."""
    rng = np.random.default_rng(seed)
    asked = np.repeat(levels, 160) + np.repeat(rng.choice([-1.0, 1.0], 40 * len(levels)), 4)
    noise = 0.05 * rng.standard_normal(len(asked))
    done = ga.run(DRIVE, ga.Record(DT, command=asked - noise, velocity=np.zeros(len(asked))), CONTROLLER)
    logged = done.torque if torque else None
    return ga.Record(DT, command=asked, velocity=done.velocity + noise, torque=logged, name=f"run {seed}")


def content(dia: ga.Diagnosis) -> dict[str, Any]:
    """All of a result but the time that it took."""
    found = dia.to_dict() | {"seconds": 0.0}
    return found | {"identification": found["identification"] | {"seconds": 0.0}}


def test_two_records_in_either_order_held_out_ones_too_and_a_bootstrap() -> None:
    records, later = [recorded(0), recorded(1, LEVELS[::-1])], [recorded(2), recorded(3)]
    one = ga.diagnose(records, CONTROLLER, validation=later, bootstrap=1, seed=5)
    two = ga.diagnose(records[::-1], CONTROLLER, validation=later[::-1], bootstrap=1, seed=5)
    assert [f.effect for f in one.causes] == ["coulomb_friction"], one.summary()
    assert content(one) == content(two)
    assert one.causes[0].p_value == 0.5 and one.bootstrap == 1  # (1 + 0) / (1 + 1)
    assert "(bootstrap): at most 0.5." in " ".join(one.summary().split())


def test_three_records_of_another_controller_in_any_order() -> None:
    """The gains that the logged torques show are a mean over the records, and the sentence that says so quotes one of them."""
    a, b, c = (recorded(seed, LEVELS[seed : seed + 3], torque=True) for seed in range(3))
    given = ga.PI(kp=0.06, ki=1.2)
    first, *others = (ga.diagnose(r, given, validation=recorded(9)) for r in ([a, b, c], [c, b, a], [b, c, a]))
    assert [f.effect for f in first.causes if f.place != "controller"] == ["coulomb_friction"], first.summary()
    assert any("instead of the given ones" in note for note in first.notes)
    for other in others:
        assert content(other) == content(first)


def test_any_number_of_workers() -> None:
    records = [recorded(0, LEVELS[:3]), recorded(1, LEVELS[2:])]
    identified = [ga.identify(records, CONTROLLER, workers=n) for n in (1, 2, 4)]
    one, *others = (ga.diagnose(records, CONTROLLER, identification=idn) for idn in identified)
    for other in others:
        assert content(other) == content(one)
