"""What version 0.1.0 saved loads in this version, is checked by its schema, and is used like a new result."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.results.store import schema
from places import GOLDEN

SAVED = GOLDEN / "saved_0_1"
STILL = ga.Record(1e-3, torque=np.repeat([0.2, -0.2], 50), velocity=np.zeros(100))


@pytest.mark.parametrize("name", ["record", "identification", "diagnosis"])
def test_it_is_of_0_1_and_meets_the_schema(name: str, tmp_path: Path) -> None:
    data = json.loads((SAVED / f"{name}.json").read_text())
    assert (data["schema"], data["schema_version"], data["gaident_version"]) == (f"gaident/{name}", 1, "0.1.0")
    jsonschema = pytest.importorskip("jsonschema", reason="jsonschema is not installed: pip install '.[test]'")
    jsonschema.Draft202012Validator(schema()).validate(data)
    found = ga.load(SAVED / f"{name}.json")
    assert isinstance(found, ga.Record | ga.Identification | ga.Diagnosis)
    found.save(tmp_path / "again.json")
    assert ga.load(tmp_path / "again.json") == found


def test_a_record_has_its_samples() -> None:
    rec = ga.load(SAVED / "record.json")
    assert isinstance(rec, ga.Record)
    assert (len(rec), rec.dt, rec.name, rec.torque_is, rec.torque_log) == (
        40,
        1e-3,
        "one mass with friction",
        "commanded",
        "sample",
    )
    assert rec.command is not None and not rec.command.any() and rec.torque is not None and rec.position is None
    assert rec.velocity.std() == pytest.approx(0.05, rel=0.5)


def test_an_identification_has_its_model() -> None:
    idn = ga.load(SAVED / "identification.json")
    assert isinstance(idn, ga.Identification)
    assert (idn.p, idn.q, idn.seed) == (1, 1, 0)
    gain = idn.parameters["gain"]
    assert (gain.value, gain.unit) == (idn.model.gain, "rad/s^2/(N m)")
    assert idn.model.gain == pytest.approx(1.0 / 8e-4, rel=0.02)
    assert np.abs(idn.simulate(STILL)).max() > 1.0
    assert "(1,1)" in idn.summary()


def test_a_diagnosis_has_its_cause_and_its_controller() -> None:
    dia = ga.load(SAVED / "diagnosis.json")
    assert isinstance(dia, ga.Diagnosis)
    assert dia.verdict == "explained" and [f.effect for f in dia.findings] == ["coulomb_friction"]
    torque = dia.findings[0].parameters["torque"]
    assert torque.unit == "N m" and abs(torque.value - 0.05) < torque.std
    assert dia.after.rmse < 0.2 * dia.before.rmse
    assert isinstance(dia.controller, ga.Cascade)
    assert (dia.controller.velocity.kp, dia.controller.torque_filters) == (0.0232, (ga.LowPass(time_constant=0.4e-3),))
    assert np.abs(ga.simulate(dia.model, STILL)).max() > 1.0
    assert "coulomb friction" in dia.summary() and "gaident 0.1.0" in dia.summary()


def test_a_file_of_a_newer_version_says_so(tmp_path: Path) -> None:
    data = json.loads((SAVED / "diagnosis.json").read_text())
    for made_by, words in (("999.0.0", "is of gaident 999.0.0, newer than this"), ("0.1.0", "damaged")):
        path = tmp_path / "later.json"
        path.write_text(json.dumps({**data, "gaident_version": made_by, "of_a_later_version": 1}))
        with pytest.raises(ga.GaidentError, match=words):
            ga.load(path)
