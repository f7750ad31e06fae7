"""Hide an effect in a simulated drive, and require that the diagnosis finds it: the quick set of bench/blind.py.

The drive shares no code with the library (drive_rig.py), drives, sizes and noise are drawn (drive_cases.py); what counts as named
or abstained is decided in blind_judge.py. Fixed seeds, so that a failure repeats.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import gaident as ga
from blind_judge import CLASSES, DRIVERS, Judgement, judge
from drive_cases import EFFECTS, random_case, random_plant, records
from drive_rig import OUTSIDE, skip_without_library
from gaident.diagnosis.library.terms import LIBRARY
from gaident.estimation.dataset import DataSet
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.term import Scales
from gaident.models.simulate_many import simulate_values

if not hasattr(ga, "diagnose"):
    pytest.skip("this gaident has no diagnose()", allow_module_level=True)
skip_without_library()

SEED = 20261121
SCALES = Scales(1e-3, 1.0, 50.0, 1.0, 1e3, 10.0, 0.02, float("nan"), float("nan"), False, 1.0)


@lru_cache
def diagnosed(
    effects: tuple[str, ...],
    kind: str = "multi",
    noise: str = "white",
    torque: bool = True,
    factor: float | None = None,
    seed: int = SEED,
) -> Judgement:
    record, validation, controller, truth = random_case(seed, effects, kind, noise, torque, factor)
    dia = ga.diagnose(record, controller=controller, validation=validation)
    assert dia.verdict in ("adequate", "explained", "partly explained", "unexplained")
    return judge(dia, truth.effects)


KNOWN = set(LIBRARY)


@pytest.mark.long
@pytest.mark.parametrize("effect", [e for e in EFFECTS if e not in CLASSES and e in KNOWN])
def test_a_hidden_effect_is_named(effect: str) -> None:
    judged = diagnosed((effect,), torque=EFFECTS.index(effect) % 2 == 0)
    assert judged.exact, judged


@pytest.mark.long
def test_a_cause_that_output_errors_do_not_show_is_looked_for_in_whitened_ones() -> None:
    """Without a torque, a late loop leaves an error so large and slow that under output errors no effect is worth its penalty."""
    judged = diagnosed(("transport_delay",), noise="coloured", torque=False, seed=131000002)
    assert judged.exact, judged


EQUIVALENT = ("torque_lag", "velocity_filter")


@pytest.mark.parametrize("effect", [e for e in CLASSES if e not in EQUIVALENT])
def test_a_member_of_a_class_is_reported_and_nothing_else(effect: str) -> None:
    judged = diagnosed((effect,))
    assert judged.in_set and not judged.wrong and not judged.extra, judged


@pytest.mark.long
@pytest.mark.parametrize("torque", [True, False])
@pytest.mark.parametrize("effect", EQUIVALENT)
def test_lag_and_filter_are_reported_and_never_told_apart(effect: str, torque: bool) -> None:
    judged = diagnosed((effect,), torque=torque)
    assert judged.in_set and not judged.wrong and not judged.extra, judged
    assert judged.equivalents_together and not judged.named, judged


@pytest.mark.long
def test_a_load_and_uneven_dry_friction_are_never_told_apart() -> None:
    """Tc sign(w) + T is the same torque as friction of two levels."""
    *_, controller, truth = random_case(SEED, ("coulomb_friction",), factor=1.0)
    truth.effects["load_torque"] = {"torque": 0.02}
    record, validation = records(truth)
    dia = ga.diagnose(record, controller=controller, validation=validation)
    judged = judge(dia, truth.effects)
    together = {"load_torque", "asymmetric_friction"}
    assert any(together <= set(each) for each in judged.sets), judged
    assert not together & set(judged.named), judged


# Classes of effects between which one velocity step cannot decide.
STEP_CLASSES = {
    "dry friction": ("coulomb_friction", "stribeck_friction", "presliding_friction"),
    "friction or dead band": ("torque_dead_band",),
    "limits": ("torque_saturation", "command_rate_limit", "integrator_clamp"),
    "drag or drift": ("quadratic_drag", "friction_drift", "square_root_drag"),
    "shaft": ("hardening_stiffness", "extra_resonance", "hysteretic_coupling"),
    "friction or torque once per turn": ("position_friction",),
    "lag or filter": ("torque_lag", "velocity_filter"),
}


@pytest.mark.long
@pytest.mark.parametrize("members", STEP_CLASSES.values(), ids=STEP_CLASSES.keys())
def test_on_a_single_step_no_wrong_name(members: tuple[str, ...]) -> None:
    for effect in members:
        judged = diagnosed((effect,), kind="step", torque=False)
        assert not judged.wrong, judged


# Outside the library and named nevertheless, or with another driver: known misses.
WALKS = "this walk has a trend that is called a drift of friction; what is left is said to depend on the time"
STANDS = "an axis that presses against a stop stands there for a while: what is left is said to depend on the time"
MISSES = {
    "random_walk_friction": pytest.mark.xfail(reason=WALKS, strict=True),
    "contact": pytest.mark.xfail(reason=STANDS, strict=True),
}


@pytest.mark.long
@pytest.mark.parametrize("effect", [pytest.param(name, marks=MISSES.get(name, ())) for name in OUTSIDE])
def test_what_the_library_does_not_know_gets_no_name(effect: str) -> None:
    judged = diagnosed((effect,), factor=1.5)
    assert not judged.wrong, judged
    assert judged.driver in DRIVERS[effect], judged
    assert judged.verdict in ("unexplained", "partly explained"), judged


@pytest.mark.long
@pytest.mark.parametrize("kind", ["multi", "step", "move"])
@pytest.mark.parametrize("noise", ["white", "encoder", "coloured"])
def test_nothing_is_named_where_nothing_is_hidden(kind: str, noise: str) -> None:
    for torque in (True, False) if kind == "multi" else (True,):
        judged = diagnosed((), kind, noise, torque)
        assert not judged.sets, judged
        if noise == "white":  # coloured remainders may be called unexplained, but not by a name
            assert judged.verdict == "adequate", judged


@pytest.mark.long
@pytest.mark.parametrize("pair", [("coulomb_friction", "transport_delay"), ("cogging", "quadratic_drag")])
def test_two_effects_are_both_found(pair: tuple[str, str]) -> None:
    judged = diagnosed(pair)
    assert judged.in_set and not judged.wrong and len(judged.sets) == 2, judged


@pytest.mark.long
def test_two_effects_of_which_none_is_a_first_step_are_both_found() -> None:
    """Without the friction a lag passes for a delay; without the lag the friction passes for noise."""
    judged = diagnosed(("coulomb_friction", "torque_lag"), noise="encoder", seed=21000001)
    assert judged.in_set and not judged.wrong and len(judged.sets) == 2, judged


@pytest.mark.long
def test_a_lag_is_no_delay_with_a_resonance() -> None:
    """A delay is the first step, a delay with an extra resonance the next; the lag alone explains more."""
    judged = diagnosed(("velocity_filter",), noise="encoder", torque=False, seed=40000000)
    assert judged.in_set and not judged.wrong and len(judged.sets) == 1, judged


@pytest.mark.long
def test_small_effects_beside_a_gap_are_not_named() -> None:
    """A cogging steers the impacts by 140 BIC units, and makes held-out data better."""
    judged = diagnosed(("backlash",), noise="coloured", seed=31000003)
    assert judged.exact and not judged.wrong, judged


def test_a_small_detail_of_friction_is_seen_where_nothing_but_white_noise_is_left() -> None:
    """At half its separability limit: its parent would be a wrong name."""
    rng = np.random.default_rng(41000007)
    plant = next(p for p in iter(lambda: random_plant(rng), None) if p.name == "small motor")
    record, validation, controller, truth = random_case(41000007, ("presliding_friction",), factor=0.03094, plant=plant)
    judged = judge(ga.diagnose(record, controller=controller, validation=validation), truth.effects)
    assert not judged.wrong and judged.in_set, judged


def test_the_angle_behind_a_filter_and_a_ripple_of_the_sensor_is_taken_back() -> None:
    """Driven by the logged torque, the true drive follows the log; at the angle that the sensor shows it misses by far."""
    rec, _, controller, truth = random_case(SEED, ("cogging", "velocity_ripple"), noise="none", factor=2.0)
    truth.effects["velocity_filter"] = {"time_constant": 2e-3}
    rec, _ = records(truth)
    plant, data = truth.plant, DataSet.of([rec], controller)
    assert not plant.two_masses
    parameters = Parameterisation.of(ga.OneMass(plant.J, plant.D).model(), SCALES, [False])
    x = parameters.base_vector(ga.OneMass(plant.J, plant.D).model())
    for effect, values in truth.effects.items():
        x = parameters.inserted(x, LIBRARY[effect].coordinates(values))
        parameters = parameters.extended(LIBRARY[effect])
    missed = np.std(rec.velocity - OpenLoop(data).velocities(parameters, x[None, :])[0])
    with_sensor = simulate_values(parameters.structure, *parameters.values(x[None, :]), data.driven[0])
    assert missed < 0.1 * np.std(rec.velocity - with_sensor), (missed, np.std(rec.velocity - with_sensor))
