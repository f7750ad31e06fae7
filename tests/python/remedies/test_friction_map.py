"""friction_map(): friction and load of each record by velocity."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.results.json_text import json_text

J, T = 4e-4, 1e-3


def log_of(friction: float, load: float, name: str) -> ga.Record:
    drive = ga.OneMass(J, 2e-3).model().with_effect("coulomb_friction", torque=friction).with_effect("load_torque", torque=load)
    command = np.interp(np.arange(4000) * T, np.linspace(0.0, 4.0, 9), [0.0, 40.0, 0.0, -40.0, 0.0, 10.0, -10.0, 3.0, 0.0])
    noise = 0.05 * np.random.default_rng(4).standard_normal(len(command))
    run = ga.run(drive, ga.Record(T, command=command - noise, velocity=noise), ga.PI(0.03, 1.0))
    return ga.Record(T, command=command, velocity=run.velocity + noise, torque=run.torque, name=name)


def test_friction_and_load_of_each_record(tmp_path: Path) -> None:
    found = ga.friction_map([log_of(0.06, 0.02, "cold"), log_of(0.04, 0.02, "warm")], bins=8)
    assert found.names == ("cold", "warm") and found.inertia == pytest.approx(J, rel=0.03)
    speeds = found.velocity[8:]
    fast = speeds > 3.0
    for row, level in zip(found.friction, (0.06, 0.04), strict=True):
        assert np.allclose(row[fast], level + 2e-3 * speeds[fast], atol=6e-3)
    assert np.allclose(found.load[:, fast], 0.02, atol=5e-3)
    assert np.allclose(found.velocity, -found.velocity[::-1]) and len(found.edges) == 9
    assert found.count.shape == found.torque.shape == found.scatter.shape == (2, 16)
    found.to_csv(tmp_path / "map.csv")
    lines = (tmp_path / "map.csv").read_text().splitlines()
    assert len(lines) == 33 and lines[0] == "record,velocity,torque,scatter,count" and lines[1].startswith("cold,-")
    assert "cold" in found.summary() and "N m" not in found.summary(axis="linear")
    sliding = replace(found, axis="linear")
    assert sliding.summary() == found.summary(axis="linear") and sliding.summary(axis="rotary") == found.summary()
    assert "m/s" in sliding.plot().axes[0].get_xlabel() and sliding.to_dict()["axis"] == "linear"
    assert len(found.plot().axes[0].containers) == 2 and "gaident/friction_map" in json_text(found.to_dict())


def test_wrong_use_is_told() -> None:
    rec = log_of(0.06, 0.0, "one")
    with pytest.raises(ga.GaidentError, match="records is int"):
        ga.friction_map(3)  # type: ignore[arg-type]
    with pytest.raises(ga.GaidentError, match="axis is 'round'"):
        ga.friction_map(rec, axis="round")
    assert ga.friction_map(rec, inertia=J, bins=2, axis="linear").axis == "linear"
    with pytest.raises(ga.GaidentError, match="bins is 0"):
        ga.friction_map(rec, bins=0)
    with pytest.raises(ga.GaidentError, match="inertia is -1"):
        ga.friction_map(rec, inertia=-1.0)
    with pytest.raises(ga.errors.RecordError, match="record 'bare' has no torque"):
        ga.friction_map(ga.Record(T, command=rec.command, velocity=rec.velocity, name="bare"))
    still = np.zeros(200)
    with pytest.raises(ga.errors.RecordError, match="does not move"):
        ga.friction_map(ga.Record(T, torque=still + 0.01, velocity=still, name="still"), inertia=J)
