"""What an error depends on: the families of a short record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from gaident.diagnosis.selection.dependence import Dependence, _strongest, dependence
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Hypothesis, Objective, OutputErrors
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.prefilter import Prefilter
from gaident.estimation.projection import project_out
from gaident.estimation.term import Scales

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
