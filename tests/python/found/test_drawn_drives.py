"""What is found in drives that the independent rig draws: effects at the load, ages of velocities, shafts that ring."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

import gaident as ga
from blind_judge import judge
from drive_cases import Noise, random_case, two_masses
from gaident.diagnosis.library.terms import LIBRARY
from loop_cases import industrial_case, loop_kind, loop_plant

LOAD = "@load"


def drawn(effect: str, seed: int, noise: str) -> tuple[ga.Diagnosis, dict[str, dict[str, float]]]:
    """(the diagnosis of a drawn drive that hides an effect at its load, the effect with its values)."""
    plant = two_masses(np.random.default_rng([seed, zlib.crc32(effect.encode())]))
    record, validation, controller, truth = random_case(seed, (effect + LOAD,), "multi", noise, True, plant=plant)
    dia = ga.diagnose(record, controller=controller, validation=validation)
    return dia, {name.removesuffix(LOAD): values for name, values in truth.effects.items()}


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "seed", "noise"),
    [
        # At the motor a drag leaves noise, but a filter of many numbers whitens it: at the load it is far better.
        ("quadratic_drag", 3001000000, "white"),
        ("square_root_drag", 3001000000, "white"),
        ("square_root_drag", 3001000001, "encoder"),
        # Friction with all its details at the load; dry friction alone is no better there than a drag.
        ("lugre_friction", 3001000001, "white"),
    ],
)
def test_what_acts_at_the_load_is_named_with_its_end(effect: str, seed: int, noise: str) -> None:
    dia, hidden = drawn(effect, seed, noise)
    assert dia.verdict == "explained" and judge(dia, hidden).exact
    (cause,) = (f for f in dia.findings if not f.is_noise)
    assert cause.sides == ("load",)
    for name, value in hidden[effect].items():
        found = cause.parameters[name]
        assert abs(found.value - value) < 4.0 * found.std


@pytest.mark.long
def test_a_constant_torque_that_the_loop_compensates_is_named_although_the_free_run_does_not_show_it() -> None:
    """The regression leaves less of the torque, but the model leaves less than noise and filter do: nothing speaks against it."""
    dia, hidden = drawn("load_torque", 3001000001, "encoder")
    assert dia.verdict == "explained" and judge(dia, hidden).exact
    assert not dia.gain_interval[0] > 0.0, "the free run shows nothing of it"
    (cause,) = (f for f in dia.findings if not f.is_noise)
    assert cause.parameters["torque"].value == pytest.approx(hidden["load_torque"]["torque"], rel=1e-3)


@pytest.mark.long
@pytest.mark.parametrize(("every", "effect"), [(4, "cogging"), (2, "coulomb_friction")])
def test_a_velocity_on_an_encoders_lattice_that_is_not_late_makes_no_resonance(every: int, effect: str) -> None:
    """Taken for half a sample old, it needs a resonance above the log's band beside the effect, and shows no end of the shaft."""
    number = 3003000
    rng = np.random.default_rng([number, zlib.crc32(f"ip {every} {effect}".encode())])
    plant = loop_plant("ip", every, rng, None, None)
    noise = Noise(white=0.0, encoder=2.0 * np.pi / 2.0**19)
    record, validation, controller, truth = random_case(number, (effect,), loop_kind("ip"), noise, True, plant=plant)
    dia = ga.diagnose(record, controller=controller, validation=validation)
    assert dia.verdict == "explained" and judge(dia, truth.effects).exact
    assert any("are no difference over one sample" in note for note in map(str, dia.notes))
    assert [f.sides for f in dia.findings if f.effect == effect] == [("motor",)]


@pytest.mark.long
def test_peaks_of_a_shaft_that_rings_faster_than_the_log_resolves_are_no_outliers() -> None:
    """The linear model under the given controller misses them; with the rule of the drive a model follows each line."""
    record, validation, controller, truth = industrial_case("backward", 4, "", 3032000)
    plant = truth.plant
    given = ga.Cascade(ga.PI(plant.kp, plant.ki), period=plant.dt / 4)
    assert isinstance(controller, ga.Cascade) and controller.velocity.rule == "backward"
    dia = ga.diagnose(record, controller=given, validation=validation)
    assert dia.verdict == "explained" and "outliers" not in {f.effect for f in dia.findings}, dia.summary()
    assert "integration_rule" in {f.effect for f in dia.findings}
    assert dia.mechanics["inertia"].value == pytest.approx(plant.J + plant.JL, rel=1e-4)


@pytest.mark.long
def test_a_tracking_time_between_those_of_the_grid_is_no_integrator_that_is_held() -> None:
    """Each time of the grid leaves more than an integrator that is held; the one between two of them leaves next to nothing."""
    record, validation, controller, truth = industrial_case("tracking", 4, "", 3032000)
    plant = truth.plant
    assert isinstance(controller, ga.Cascade) and controller.velocity.anti_windup == "tracking"
    given = ga.Cascade(ga.PI(plant.kp, plant.ki), period=plant.dt / 4)
    dia = ga.diagnose(record, controller=given, validation=validation)
    (windup,) = (f for f in dia.findings if f.effect == "anti_windup")
    assert windup.parameters["tracking_time"].value == pytest.approx(controller.velocity.tracking_time, rel=1e-3)
    assert dia.verdict == "explained" and {f.effect for f in dia.causes if f.place != "controller"} == {"torque_lag"}
    assert dia.mechanics["inertia"].value == pytest.approx(plant.J + plant.JL, rel=1e-4)


def test_a_tone_acts_at_one_end() -> None:
    """A hum of 24 N m at the load and one of 0.016 N m at the motor cancelled each other, but for the first lines of a record."""
    motor, load = LIBRARY["torque_hum"], LIBRARY["torque_hum@load"]
    assert motor.name in load.excludes and load.other_side == motor.name
    assert "cogging" not in LIBRARY["cogging@load"].excludes


@pytest.mark.long
def test_two_resonances_may_stand_in_each_others_place() -> None:
    """The model and the whole inertia are right; the parts of it are those of the other choice, by any number of deviations."""
    record, validation, controller, truth = random_case(4101000000, ("extra_resonance",), "multi", "encoder", False)
    dia = ga.diagnose(record, controller=controller, validation=validation)
    whole = truth.plant.J + truth.plant.JL
    assert abs(dia.mechanics["inertia"].value - whole) < 4.0 * dia.mechanics["inertia"].std
    assert abs(dia.mechanics["motor_inertia"].value - truth.plant.J) > 100.0 * dia.mechanics["motor_inertia"].std
    assert any("which of two resonances is that of the shaft" in note for note in dia.notes)
