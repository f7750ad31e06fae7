"""What is not followed: rows of errors that are lost, models far behind under other controllers, a search of no fewer effects."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from gaident import _core
from gaident.diagnosis.records.sizes import scales_of
from gaident.diagnosis.selection import select, sensor_age
from gaident.diagnosis.selection.bases import Task
from gaident.diagnosis.unlogged.under_controller import UnderController, out_of_reach
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Objective
from gaident.policy.table import POLICY

DT, GAINS = 1e-3, ga.PI(kp=0.05, ki=1.5)


def test_errors_are_measured_less_simulated_and_a_row_that_diverges_is_lost() -> None:
    measured = np.array([1.0, 2.0, 3.0])
    rows = np.array([[0.5, 0.5, 0.5], [0.0, np.nan, 0.0], [0.0, -5.0, 0.0], [0.0, 9.0, np.inf]])
    errors = _core.errors_of(measured, rows, 7.0)
    assert errors is rows, "written over the rows"
    assert errors.tolist() == [[0.5, 1.5, 2.5], [7.0] * 3, [7.0] * 3, [7.0] * 3]
    with pytest.raises(ValueError, match="as many columns"):
        _core.errors_of(measured[:2], rows, 7.0)


def setting(wrong: float) -> tuple[Any, Objective, Any]:
    """(space, objective, selected linear model) of one mass under GAINS without a torque; given: ki times `wrong`."""
    rng = np.random.default_rng(2)
    levels = np.repeat([0, 20.0, -35, 10, -10, 50, -50, 25, -5, 5], 90)
    noise = 0.03 * rng.standard_normal(len(levels))
    still = ga.Record(DT, command=levels - noise, velocity=np.zeros(len(levels)))
    done = ga.run(ga.OneMass(J=3e-4, D=2e-3).model(), still, GAINS)
    data = DataSet.of([ga.Record(DT, command=levels, velocity=done.velocity + noise)], replace(GAINS, ki=wrong * GAINS.ki))
    objective = Objective(data, np.ones(len(levels)))
    task = Task(objective, scales_of(data), ga.OneMass(J=3e-4, D=2e-3).model(), (), lambda message: None)
    return task.space(), objective, ls.reestimated(objective, task.one_mass())


def under(data: DataSet) -> UnderController:
    given = data.pi
    assert given is not None
    return UnderController(data, lambda z: replace(given, ki=given.ki * float(np.exp(z[0]))), np.array([-0.4]), np.array([0.4]))


def test_gains_that_explain_the_record_are_followed_to_the_end() -> None:
    space, objective, fit = setting(1.15)
    found = under(objective.data).fitted(space, replace(objective), fit, np.zeros(1), out_of_reach(space, fit))
    assert found is not None
    z, model = found
    assert z[0] == pytest.approx(-np.log(1.15), abs=2e-3)
    assert model.bic < fit.bic - 100.0
    # A step that changes no decision ends the search: the number is known far better than its deviation.
    (std,) = under(objective.data).deviations(replace(objective), model, z)
    assert abs(z[0] + np.log(1.15)) < 4.0 * std


def test_what_stays_far_behind_a_selected_model_is_left_after_a_few_steps() -> None:
    space, objective, fit = setting(1.0)
    here = replace(objective)
    far = replace(fit, bic=fit.bic - 1e6)  # a selected model far better than any of these
    before = objective.counter.simulations
    assert under(objective.data).fitted(space, here, fit, np.array([0.4]), space.score(far)) is None
    short = objective.counter.simulations - before
    assert under(objective.data).fitted(space, replace(objective), fit, np.array([0.4]), np.inf) is not None
    assert short < 0.8 * (objective.counter.simulations - before - short)


def test_the_reach_is_that_of_a_beam_behind_the_selected_model_fitted_before_whitening() -> None:
    space, objective, fit = setting(1.0)
    plain = ls.scored(objective, ls.fit(objective, fit.hypothesis, fit.x, WHITE, 12))
    reach = out_of_reach(space, fit) - max(space.score(plain), space.score(fit))
    assert reach == pytest.approx(space.policy.beam_reach * space.penalty)


def test_a_fit_from_its_optimum_makes_one_jacobian_and_one_grid_of_steps() -> None:
    _, objective, fit = setting(1.0)
    hypothesis, x = fit.hypothesis, fit.x
    for _ in range(6):  # until it moves no further
        found = ls.fit(replace(objective), hypothesis, x, WHITE, 12)
        if np.array_equal(found.x, x):
            break
        x = found.x
    before = objective.counter.simulations
    again = ls.fit(replace(objective), hypothesis, x, WHITE, 12)
    assert again.converged and np.array_equal(again.x, x)
    assert objective.counter.simulations - before == 1 + len(x) + len(ls.DAMPINGS)


@pytest.mark.long
def test_a_model_of_output_errors_that_leaves_noise_is_where_the_search_of_whitened_errors_begins(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rec, validation, controller, _ = random_case(3, "torque_lag", torque_logged=False)
    families: list[bool] = []
    explored = select._explored
    monkeypatch.setattr(
        select, "_explored", lambda task, space, bases: families.append(space.whitens) or explored(task, space, bases)
    )
    dia = ga.diagnose(rec, controller, validation=validation)
    assert "torque_lag" in {name for f in dia.causes for name in (f.effect, *f.alternatives)}
    assert families == [False]


@dataclass
class Searches:
    """Searches whose results are given: (effects, score) without an age, and with it by the effects that are allowed."""

    plain: tuple[int, float]
    older: dict[int, tuple[int, float]]
    asked: list[tuple[bool, int]] = field(default_factory=list)
    ages: list[tuple[float, tuple[float, ...]]] = field(default_factory=list)
    beside: list[Any] = field(default_factory=list)

    def __call__(self, objective: Objective, most: int, beside: Any) -> Any:
        self.beside.append(beside)
        aged = objective.data.age > 0.0
        self.asked.append((aged, most))
        self.ages.append((objective.data.age, objective.data.other_ages))
        effects, score = self.older[most] if aged else self.plain
        parameters = SimpleNamespace(terms=[SimpleNamespace(in_series=True)] * effects)
        final = SimpleNamespace(effects=("lag",) * effects, parameters=parameters, score=score)
        return SimpleNamespace(space=SimpleNamespace(whitens=True, score=lambda fit: fit.score), final=final)


def test_a_search_with_an_encoders_age_is_made_whole_only_where_fewer_effects_may_do(monkeypatch: pytest.MonkeyPatch) -> None:
    _, objective, _ = setting(1.0)
    monkeypatch.setattr(sensor_age, "encoder_step", lambda velocity, linear: 0.01)
    monkeypatch.setattr(sensor_age, "encoder_lines", lambda velocity, dt, turn: 0)
    monkeypatch.setattr(sensor_age, "_score_beside", lambda again, found: again.final.score)
    closest = SimpleNamespace(effects=("lag",))
    monkeypatch.setattr(sensor_age, "_over_older", lambda found, older, margin: (closest, False))
    model, scales = ga.OneMass(J=3e-4, D=2e-3).model(), scales_of(objective.data)
    for older, whole, taken in (
        ({0: (0, 5.0)}, False, False),  # worse without effects: no whole search
        ({0: (0, -5.0), 4: (0, -5.0)}, True, True),
        ({0: (0, -5.0), 4: (1, -9.0)}, True, False),  # the whole search ends with as many effects
    ):
        search = Searches((1, 0.0), older)
        found, notes = sensor_age.searched(objective, scales, model, (), search)
        assert search.asked == [(False, 4), (True, 0), *[(True, 4)] * whole]
        assert search.beside == [None, None, *[closest] * whole], "the model that was found has more effects than none"
        assert bool(notes) is taken and len(found.final.effects) == (0 if taken else 1)
    monkeypatch.setattr(sensor_age, "_over_older", lambda found, older, margin: (closest, True))
    margin = POLICY.rival_margin
    for whole_lines, effects, score, taken in (
        (0, 1, -1.1 * margin, True),
        (0, 1, -0.9 * margin, False),
        (0, 0, -1.0, True),
        (0, 2, -99.0 * margin, False),
        (4096, 1, 0.9 * margin, True),  # an encoder's lines: the model has to speak against the age
        (4096, 1, 1.1 * margin, False),
        (4096, 0, 0.9 * margin, True),
        (4096, 2, -99.0 * margin, False),
    ):
        monkeypatch.setattr(sensor_age, "encoder_lines", lambda velocity, dt, turn, lines=whole_lines: lines)
        # The linear mechanism speaks against the age, so that both searches are made.
        monkeypatch.setattr(sensor_age, "_score", lambda objective, scales, model: 99.0 * margin * (objective.data.age > 0.0))
        search = Searches((1, 0.0), {4: (effects, score)})
        found, notes = sensor_age.searched(objective, scales, model, (), search)
        assert search.asked == [(False, 4), (True, 4)] and bool(notes) is taken


@pytest.mark.parametrize(("logged", "follows", "every"), [(True, False, 1), (True, True, 1), (False, False, 1), (True, False, 2)])
def test_a_logged_torque_that_does_not_follow_from_its_controller_may_go_on_between_the_lines(
    monkeypatch: pytest.MonkeyPatch, logged: bool, follows: bool, every: int
) -> None:
    """Half a line ahead of its velocity is then an age that each search counts beside its own; else it is none."""
    _, objective, _ = setting(1.0)
    data = objective.data
    read = tuple(r.with_channels(torque=r.velocity if logged else None) for r in data.records)
    period = ga.Cascade(GAINS, period=DT / every) if every > 1 else GAINS
    data = replace(data, read=read, controller=period, loop_follows=follows)
    for name, found in (
        ("ahead_of_line", None),
        ("_over_older", (SimpleNamespace(effects=("lag",)), False)),
        ("encoder_lines", 0),
        ("encoder_step", 0.01),
        ("_score_beside", 9.0),
    ):
        monkeypatch.setattr(sensor_age, name, lambda *arguments, found=found: found)
    search = Searches((1, 0.0), {0: (0, 5.0)})
    model = ga.OneMass(J=3e-4, D=2e-3).model()
    sensor_age.searched(Objective(data, objective.weight), scales_of(objective.data), model, (), search)
    ahead = (-0.5,) if logged and not follows and every == 1 else ()
    assert search.ages == [(0.0, ahead), (0.5 / every, (0.0, *ahead))]
