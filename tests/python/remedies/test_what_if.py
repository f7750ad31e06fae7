"""What a drive does without a cause, and models against the same record."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

import gaident as ga
from drive_rig import Plant, run_drive, skip_without_library
from gaident.control.differencing import older
from gaident.remedies.nonlinear import simulated_with, without_each
from gaident.results.retuning import LoopFigures, Spread
from gaident.results.what_if import WhatIf

DRIVE = ga.OneMass(J=4e-4, D=2e-3).model()
STUCK = DRIVE.with_effect("coulomb_friction", torque=0.2)
GIVEN = ga.PI(0.03, 1.0)


@pytest.fixture(scope="module")
def rec() -> ga.Record:
    command = np.repeat([20.0, -30.0, 5.0, -3.0, 12.0], 150)
    noise = 0.05 * np.random.default_rng(3).standard_normal(len(command))
    run = ga.run(STUCK, ga.Record(1e-3, command=command - noise, velocity=noise), GIVEN)
    return ga.Record(1e-3, command=command, velocity=run.velocity + noise, torque=run.torque)


@pytest.fixture(scope="module")
def found(rec: ga.Record) -> ga.Diagnosis:
    return ga.diagnose(rec, GIVEN, seed=1)


def test_without_a_cause_the_drive_is_the_mended_one(found: ga.Diagnosis, rec: ga.Record) -> None:
    mended = found.simulate_without("coulomb_friction")
    truth = ga.run(DRIVE, rec, GIVEN)
    assert np.sqrt(np.mean((mended.velocity - truth.velocity) ** 2)) < 0.05
    assert np.array_equal(mended.velocity, found.simulate_without("coulomb_friction", rec, side="motor").velocity)
    assert isinstance(found, WhatIf)
    with pytest.raises(ga.GaidentError, match="no effect 'backlash'"):
        found.simulate_without("backlash")
    with pytest.raises(ga.GaidentError, match="rec is int"):
        found.simulate_without("coulomb_friction", 3)  # type: ignore[arg-type]
    with pytest.raises(ga.GaidentError, match=r"contains no data; give simulate_without\('coulomb_friction', rec\)"):
        replace(found, records=()).simulate_without("coulomb_friction")


def test_models_are_compared_on_the_same_record(found: ga.Diagnosis, rec: ga.Record) -> None:
    models = {"found": found, "linear": found.identification, "truth": STUCK, "mechanism": ga.OneMass(J=4e-4, D=2e-3)}
    both = ga.compare(models, [rec, rec], GIVEN)
    rows = {m.name: m for m in both.models}
    assert list(rows) == list(models) and both.best.name in ("found", "truth")
    assert rows["found"].rmse == pytest.approx(rows["truth"].rmse, rel=0.05) and rows["mechanism"].rmse > rows["found"].rmse
    expected = rec.velocity - ga.simulate(STUCK, rec, GIVEN)
    assert rows["truth"].rmse == pytest.approx(float(np.sqrt(np.mean(expected**2))))
    assert rows["truth"].largest == float(np.max(np.abs(expected)))
    assert rows["truth"].force_error is not None and rows["mechanism"].force_error is not None
    assert rows["truth"].force_error < rows["mechanism"].force_error
    assert "truth" in both.summary() and "N m" not in both.summary(axis="linear")
    assert both.to_dict()["models"][0]["name"] == "found"
    alone = ga.compare([STUCK], replace(rec, torque=None), GIVEN)
    assert alone.models[0].name == "1" and alone.models[0].force_error is None
    wild = ga.compare([ga.Model(2500.0, [5e4])], rec, GIVEN)
    assert wild.best.rmse == np.inf


AXIS = Plant(J=4e-4, D=2e-3, kp=0.03, ki=1.0, dt=1e-3)
LSB = 2.0 * np.pi / 2**22


@pytest.fixture(scope="module")
def differenced() -> ga.Record:
    """The log of an encoder whose difference the drive takes for its velocity."""
    skip_without_library()
    command = np.repeat([0.0, 20.0, -30.0, 5.0, -3.0, 12.0], 150)
    log = run_drive(AXIS, command, {"coulomb_friction": {"torque": 0.2}}, encoder=LSB, differenced=True)
    return ga.Record(1e-3, command=command, velocity=log.velocity, torque=log.torque, position=1e-3 * np.cumsum(log.velocity))


def rmse(rec: ga.Record, velocity: np.ndarray) -> float:
    return float(np.sqrt(np.mean((rec.velocity - velocity) ** 2)))


@pytest.mark.parametrize("controller", [GIVEN, None])
def test_a_differenced_velocity_is_as_old_in_what_it_is_compared_with(
    found: ga.Diagnosis, differenced: ga.Record, controller: ga.PI | None
) -> None:
    (true,) = ga.compare([STUCK], differenced, controller).models
    ignored = rmse(differenced, ga.simulate(STUCK, differenced, controller))
    assert 100.0 * true.rmse < ignored
    # A diagnosis found the age, so that the position need not be logged; nor is what the log moved off the lines.
    old = replace(found, model=STUCK, velocity_age=0.5)
    bare = replace(differenced, position=None)
    known, young = (ga.compare([one], bare, controller).models[0] for one in (old, STUCK))
    assert known.rmse < 2.0 * true.rmse and young.rmse == pytest.approx(ignored)
    assert known.force_error is not None and young.force_error is not None and known.force_error < 0.8 * young.force_error
    late = bare.with_channels(velocity=np.append([0.0, 0.0], bare.velocity[:-2]))
    moved = replace(old, log_shifts={late.digest: {"velocity": -2}})
    assert ga.compare([moved], late, controller).models[0].rmse < 2.0 * true.rmse
    # Where the log has the difference over two lines, the controller read that over one.
    assert differenced.position is not None
    central = differenced.with_channels(velocity=np.gradient(differenced.position, 1e-3))
    assert ga.compare([STUCK], central, controller).models[0].rmse == pytest.approx(true.rmse, rel=0.05)


@pytest.mark.parametrize("controller", [GIVEN, None])
def test_a_mended_drive_has_the_velocity_that_its_sensor_shows(
    found: ga.Diagnosis, differenced: ga.Record, controller: ga.PI | None
) -> None:
    assert differenced.torque is not None
    drag = STUCK.with_effect("quadratic_drag", coefficient=1e-4)
    old = replace(found, model=drag, controller=controller, velocity_age=0.5)
    mended = old.simulate_without("quadratic_drag", differenced)
    young = replace(old, velocity_age=0.0).simulate_without("quadratic_drag", differenced)
    assert 5.0 * rmse(differenced, mended.velocity) < rmse(differenced, young.velocity)
    if controller is None:
        assert np.array_equal(mended.torque, differenced.torque) and np.array_equal(mended.position, young.position)


def test_a_proposal_is_tried_with_the_velocity_that_the_controller_reads() -> None:
    """Of a delay of a sample: z^2 - z + k, stable below 1; half a sample more: z^3 - z^2 + k (z + 1)/2, stable below 0.83."""
    swinging = ga.PI(0.95 * 4e-4 / 1e-3, 0.1)
    stable = ga.OneMass(J=4e-4, D=0.0).model().with_effect("quadratic_drag", coefficient=1e-6)
    stable = stable.with_effect("transport_delay", delay=1e-3)
    figure = Spread(0.01, 0.01, 0.01, "s")
    after = LoopFigures(**{f.name: figure for f in fields(LoopFigures)})
    (now,) = without_each(stable, swinging, 1e-3, 10.0, after)
    (then,) = without_each(stable, older(swinging, 0.5), 1e-3, 10.0, after)
    assert now[1] < 2.0 and then[1] > 1e3
    assert simulated_with(stable, swinging, older(swinging, 0.5), 1e-3, 10.0, after)[0].startswith("With all effects")


def test_wrong_use_is_told(rec: ga.Record) -> None:
    with pytest.raises(ga.GaidentError, match="models is empty"):
        ga.compare([], rec)
    with pytest.raises(ga.GaidentError, match="models is int"):
        ga.compare(3, rec)  # type: ignore[arg-type]
    with pytest.raises(ga.GaidentError, match="rec is empty: give a gaident"):
        ga.compare([STUCK], [])
    with pytest.raises(ga.GaidentError, match=r"rec\[1\] is int"):
        ga.compare([STUCK], [rec, 3])  # type: ignore[list-item]
    with pytest.raises(ga.GaidentError, match="rec is str"):
        ga.compare([STUCK], "rec")  # type: ignore[arg-type]
