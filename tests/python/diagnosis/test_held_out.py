"""A model that loses on held-out data names nothing that no second method sees; what is printed is what is judged."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from drive_rig import skip_without_library
from gaident.axis import Text
from gaident.diagnosis.check import Check
from gaident.diagnosis.explain.held_out import standing
from gaident.diagnosis.gains import IN_SAMPLE, Gains, interval_of_fall
from gaident.results.diagnosis import Fitness

MODEL = ga.OneMass(3e-4, 1e-3).model()
RNG = np.random.default_rng(1)


def gains(low: float, high: float, held_out: str = "the rest") -> Gains:
    """Gains of this interval, the error of the model behind being in the middle of it."""
    before, after = Fitness(1.0, 0.0, 0.1), Fitness(1.0 - 0.5 * (low + high), 0.0, 0.1)
    return Gains(before, after, (low, high), held_out, {}, (), MODEL, MODEL)


def check(before: float | None, after: float | None, better: bool = False, terms: tuple[str, ...] = ()) -> Check:
    regression = None
    if terms:
        t = 1e-3 * np.arange(4000)
        w = 5.0 * np.sin(5.0 * t)
        rec = ga.Record(1e-3, velocity=w, torque=2e-3 * 25.0 * np.cos(5.0 * t) + 0.01 * w + 0.1 * np.sign(w))
        regression = ga.inverse_dynamics(rec, terms=terms)
    force = [Fitness(1.0, 0.0, 0.1, force_error=x, torque_rms=1.0, force_floor=0.0) for x in (before, after)]
    return Check(regression, None, (), force[0], force[1], (), Text(""), better)


def alone(effect: str) -> set[str]:
    """Records that tell every effect from every other."""
    return set()


@pytest.mark.parametrize(
    ("low", "high", "before", "after", "better", "stands"),
    [
        (0.1, 0.5, 0.2, 0.1, True, True),  # the free run gains: what the regression leaves does not matter
        (-0.5, -0.1, 0.2, 0.3, False, False),  # both figures are worse
        (-0.5, -0.1, 0.2, 0.1, False, True),  # speeds that are only held: the torque is explained, the free run drifts
        (-0.5, -0.1, None, None, False, False),  # no torque to go by
        (-0.02, -0.01, 0.2, 0.3, False, True),  # surely worse, by less than matters
        (-0.5, 0.1, 0.2, 0.3, False, True),  # a lower error within its variation decides nothing
        (-0.5, 0.1, 0.2, 0.3, True, False),  # no gain, and the regression leaves less
    ],
)
def test_what_stands(low: float, high: float, before: float | None, after: float | None, better: bool, stands: bool) -> None:
    causes, why = standing(["torque_dead_band"], gains(low, high), check(before, after, better), alone)
    assert (causes == ["torque_dead_band"], why == ()) == (stands, stands)


def test_a_cause_that_the_regression_holds_has_a_second_witness() -> None:
    seen = check(0.2, 0.3, terms=("inertia", "viscous", "coulomb"))
    causes, why = standing(["torque_dead_band", "stribeck_friction"], gains(-0.5, -0.1), seen, alone)
    assert causes == ["stribeck_friction"] and len(why) == 1 and "no explanation" in why[0]
    assert standing(["stribeck_friction"], gains(-0.5, -0.1), seen, alone) == (["stribeck_friction"], ())
    # What the records cannot tell from it is the same witness.
    assert standing(["torque_dead_band"], gains(-0.5, -0.1), seen, lambda e: {"coulomb_friction"})[0] == ["torque_dead_band"]


def test_in_sample_figures_decide_nothing() -> None:
    assert standing(["backlash"], gains(-0.5, -0.1, IN_SAMPLE), check(0.2, 0.3), alone)[0] == ["backlash"]


def test_the_interval_of_a_fall_is_wide_where_errors_are_slow() -> None:
    white = [RNG.standard_normal(4000)]
    slow = [np.repeat(RNG.standard_normal(8), 500)]
    low, high = interval_of_fall(white, [0.9 * white[0][RNG.permutation(4000)]])
    assert 0.05 < low < 0.1 < high < 0.15
    assert interval_of_fall(slow, [0.9 * slow[0][::-1]])[0] < 0.0


def test_a_load_that_the_integrator_carries_before_the_record_is_named() -> None:
    skip_without_library()
    rec, validation, controller, truth = random_case(10, "load_torque", settle=1500)
    assert abs(rec.torque[0]) > 0.5 * truth.effects["load_torque"]["torque"] and rec.command[0] == 0.0
    dia = ga.diagnose(rec, controller, validation=validation)
    assert [{f.effect, *f.alternatives} >= {"load_torque"} for f in dia.causes] == [True], dia.summary()
    assert dia.verdict == "explained" and dia.after.rmse < dia.before.rmse
