"""What a drive does without a cause, and models against the same record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
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


def test_wrong_use_is_told(rec: ga.Record) -> None:
    with pytest.raises(ga.GaidentError, match="models is empty"):
        ga.compare([], rec)
    with pytest.raises(ga.GaidentError, match="models is int"):
        ga.compare(3, rec)  # type: ignore[arg-type]
    with pytest.raises(ga.GaidentError, match="rec is list"):
        ga.compare([STUCK], [])
    with pytest.raises(ga.GaidentError, match="rec is str"):
        ga.compare([STUCK], "rec")  # type: ignore[arg-type]
