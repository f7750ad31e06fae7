"""Saved results against their schema, versions that are refused, and results as pandas tables."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.results.json_text import json_text
from gaident.results.store import schema
from places import GOLDEN

OLD = GOLDEN / "diagnosis_schema_1.json"


@pytest.fixture(scope="module")
def diagnosis() -> ga.Diagnosis:
    """As saved by the first version whose files have a schema, read by this one."""
    found = ga.load(OLD)
    assert isinstance(found, ga.Diagnosis)
    return found


@pytest.fixture(scope="module")
def rec() -> ga.Record:
    w = 0.1 * np.random.default_rng(5).standard_normal(40)
    return ga.Record(1e-3, command=np.full(40, 1.0 / 3.0), velocity=w, position=np.cumsum(w), name="<b>")


@pytest.fixture(scope="module")
def saved(diagnosis: ga.Diagnosis, rec: ga.Record, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One file of each kind."""
    folder = tmp_path_factory.mktemp("saved")
    things = {"diagnosis": diagnosis, "identification": diagnosis.identification, "record": rec}
    for name, thing in things.items():
        thing.save(folder / f"{name}.json")
    return {name: folder / f"{name}.json" for name in things}


@pytest.fixture(scope="module")
def validator() -> Any:
    jsonschema = pytest.importorskip("jsonschema", reason="jsonschema is not installed: pip install '.[test]'")
    jsonschema.Draft202012Validator.check_schema(schema())
    return jsonschema.Draft202012Validator(schema())


def test_saved_files_meet_the_schema(saved: dict[str, Path], diagnosis: ga.Diagnosis, rec: ga.Record, validator: Any) -> None:
    for name, path in saved.items():
        errors = [f"{name}: {e.json_path}: {e.message}" for e in validator.iter_errors(json.loads(path.read_text()))]
        assert not errors, "\n".join(errors)
    idn = ga.identify(ga.Record(1e-3, torque=np.repeat([0.0, 0.1], 30), velocity=np.arange(60.0)))
    own = {"name": "mine", "parameters": {"size": 1.0, "limit": None}, "own": True}
    data = idn.to_dict()
    data["model"]["effects"] = [own]
    validator.validate(json.loads(json_text(data)))
    two = ga.TwoMass(JM=1e-4, DM=1e-3, JL=5e-4, DL=1e-3, KG=2.0)
    data = diagnosis.identification.to_dict()
    data |= {"mechanics": {**two.to_dict(), "with_shaft_damping": two.to_dict()}, "model": two.model().to_dict()}
    validator.validate(json.loads(json_text(data)))
    assert ga.load(saved["diagnosis"]) == diagnosis
    assert ga.load(saved["identification"]) == diagnosis.identification
    assert ga.load(saved["record"]) == rec


@pytest.mark.parametrize(
    "controller",
    [ga.PI(0.3, 15.0), ga.Cascade(ga.PI(0.3, 15.0), 1e-3, position=ga.P(30.0), interpolation="smooth"),
     ga.Cascade(ga.PI(0.3, 15.0, torque_limit=1.0), torque_filters=ga.LowPass(time_constant=1e-3), delay=1e-4)],
)  # fmt: skip
def test_every_controller_meets_the_schema(controller: Any, diagnosis: ga.Diagnosis, validator: Any) -> None:
    data = diagnosis.to_dict()
    data |= {"controller": controller.to_dict(), "identification": data["identification"] | {"controller": controller.to_dict()}}
    validator.validate(json.loads(json_text(data)))
    data["controller"] |= {"interpolation": "cubic"}
    assert not validator.is_valid(data)


def test_the_schema_refuses_what_load_refuses(saved: dict[str, Path], validator: Any, tmp_path: Path) -> None:
    for name, path in saved.items():
        data = json.loads(path.read_text())
        key = {"diagnosis": "findings", "identification": "model", "record": "velocity"}[name]
        for change in ({"schema_version": 2}, {"schema": f"gaident/{name}s"}, {key: None}):
            other = tmp_path / "other.json"
            other.write_text(json.dumps(data | change))
            assert not validator.is_valid(data | change)
            with pytest.raises(ga.GaidentError, match=r"other\.json"):
                ga.load(other)


@pytest.mark.parametrize(
    ("version", "message"),
    [(2, "schema_version is 2: this gaident reads 1; load it with a newer gaident"), ("x", "'x': this gaident reads 1"),
     (None, "None: this gaident reads 1; save it again"), (0, "0: this gaident reads 1; save it again")],
)  # fmt: skip
def test_other_versions_are_refused(saved: dict[str, Path], tmp_path: Path, version: object, message: str) -> None:
    for path in saved.values():
        other = tmp_path / path.name
        other.write_text(json.dumps(json.loads(path.read_text()) | {"schema_version": version}))
        with pytest.raises(ga.GaidentError, match=message):
            ga.load(other)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    (tmp_path / "log.bin").write_bytes(b"\xff\xfe\x80")
    for name, message in (("nofile", r"nofile: there is no such file; check the path"), ("", "cannot be read .Is a directory"),
                          ("log.bin", r"log\.bin: is no text.*gaident\.read")):  # fmt: skip
        with pytest.raises(ga.GaidentError, match=message):
            ga.load(tmp_path / name)
    with pytest.raises(ga.GaidentError, match="path is 3: give the file"):
        ga.load(3)  # type: ignore[arg-type]


def test_a_damaged_record_is_refused(saved: dict[str, Path], tmp_path: Path) -> None:
    data = json.loads(saved["record"].read_text())
    for change, message in (
        ({"dt": "x"}, "dt"),
        ({"velocity": [1.0]}, "velocity has 1 entries"),
        ({"command": None}, "command"),
    ):
        other = tmp_path / "record.json"
        other.write_text(json.dumps(data | change))
        with pytest.raises(ga.GaidentError, match=message):
            ga.load(other)
    del data["torque"]
    other.write_text(json.dumps(data))
    with pytest.raises(ga.GaidentError, match="lacks torque"):
        ga.load(other)


def test_tables(diagnosis: ga.Diagnosis, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    pandas = pytest.importorskip("pandas", reason="pandas is not installed: pip install 'gaident[pandas]'")
    idn = diagnosis.identification
    table = idn.to_pandas()
    assert isinstance(table, pandas.DataFrame)
    gain = idn.parameters["gain"]
    assert table.loc[("model", "gain"), ["value", "std", "unit"]].tolist() == [gain.value, gain.std, gain.unit]
    assert set(table.loc["model"].index) == set(idn.parameters)
    assert idn.mechanics is not None
    row = table.loc[("mechanics", "J")]
    assert (row["value"], row["std"], row["unit"]) == (idn.mechanics.J, idn.mechanics.std["J"], "kg m^2")
    assert not table["at_bound"].any()
    bounded = replace(idn, parameters={**idn.parameters, "gain": replace(gain, at_bound=True)})
    assert bounded.to_pandas().loc["mechanics", "at_bound"].all()  # what follows from a bound is no better
    finding = diagnosis.causes[0]
    torque = replace(finding.parameters["torque"], of_controller=0.5 * finding.parameters["torque"].std)
    finding = replace(finding, parameters={**finding.parameters, "torque": torque})
    diagnosis = replace(diagnosis, findings=tuple(finding if f.effect == finding.effect else f for f in diagnosis.findings))
    found = diagnosis.to_pandas()
    told = {"value", "std", "unit", "at_bound", "identifiable", "of_controller"}
    assert told <= set(found.columns) and set(table.columns) == told
    row = found.loc[(finding.effect, "torque")]
    assert row["value"] == torque.value and row["unit"] == "N m" and row["order"] == 1
    assert row["of_controller"] == torque.of_controller
    assert len(found) == sum(len(f.parameters) for f in diagnosis.findings) and row["evidence"] == finding.evidence
    monkeypatch.setitem(sys.modules, "pandas", None)
    for result in (idn, diagnosis):
        with pytest.raises(ImportError, match=r'pip install "gaident\[pandas\]"'):
            result.to_pandas()
