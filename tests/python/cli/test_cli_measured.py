"""The command line on measured records."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.cli import main
from gaident.data import differentiate


@pytest.mark.long
def test_demo_with_measured_data(here: Path, data_dir: Path, capsys: Any, monkeypatch: Any) -> None:
    monkeypatch.setenv("GAIDENT_DATA", str(data_dir))
    assert main(["demo", "--json", "--out", "new/folder"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["two_masses"]["truth"]["structure"] == "two masses"
    assert data["emps"]["identification"]["adequacy"]["falsified"] is True
    assert (here / "new" / "folder" / "demo_emps.png").is_file()
    (found,) = data["friction"]["diagnosis"]["findings"]
    truth = data["friction"]["truth"]["coulomb_friction"]["torque"]
    assert found["effect"] == "coulomb_friction" and not found["alternatives"]
    assert found["parameters"]["torque"]["value"] == pytest.approx(truth, rel=0.02)


def test_emps_axis_falsifies_the_linear_model(here: Path, data_dir: Path, capsys: Any) -> None:
    log = data_dir / "emps" / "DATA_EMPS.mat"
    columns = ("--columns", "torque=vir,position=qm,time=t", "--unit", "torque=35.15065188248547")
    args = [
        "identify",
        str(log),
        *columns,
        "--velocity-cutoff",
        "100",
        "--axis",
        "linear",
        "--out",
        "emps.json",
    ]
    assert main(args) == 0
    out, _ = capsys.readouterr()
    assert "the linear model is FALSIFIED" in out and "m/s" in out
    idn = ga.load("emps.json")
    rec = ga.read(log, columns={"torque": "vir", "position": "qm"}, units={"torque": 35.15065188248547},
                  velocity_cutoff_hz=100.0)  # fmt: skip
    assert rec.position is not None
    np.testing.assert_allclose(rec.velocity, differentiate(rec.position, 1e-3), rtol=1e-6, atol=1e-9)
    assert idn.falsified and idn.adequacy.predictable > 0.9
    if idn.mechanics is not None:
        assert "NOT TO BE TRUSTED" in out


@pytest.mark.long
def test_hsm150_runs_together_falsify_the_linear_model(here: Path, data_dir: Path, capsys: Any) -> None:
    logs = sorted(str(path) for path in (data_dir / "hsm150").glob("idf_pos_*.mat"))
    assert len(logs) == 6
    columns = ("--columns", "velocity=data[:,3],torque=data[:,4]", "--columns", "time=data[:,0]")
    assert main(["identify", *logs, *columns, "--out", "hsm.json"]) == 0
    out, _ = capsys.readouterr()
    assert "120000 samples of 6 records" in out and "FALSIFIED" in out
    assert ga.load("hsm.json").falsified
