"""gaident identify --response: a measured frequency response in the place of a log."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.cli import main

F = np.geomspace(2.0, 200.0, 40)


@pytest.fixture
def bode(tmp_path: Path) -> Path:
    noise = np.random.default_rng(1).standard_normal((2, F.size))
    g = ga.OneMass(J=2e-3, D=0.01).model().frequency_response(2.0 * np.pi * F) * (1.0 + 0.01 * (noise[0] + 1j * noise[1]))
    rows = [f"{f:.7g},{abs(x):.7g},{np.degrees(np.angle(x)):.5f}" for f, x in zip(F, g, strict=True)]
    path = tmp_path / "bode.csv"
    path.write_text("\n".join(["frequency [Hz],magnitude,phase [deg]", *rows]))
    return path


def test_a_response_is_identified_and_saved(bode: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    saved, picture = tmp_path / "axis.json", tmp_path / "axis.png"
    units = ["--response-units", "magnitude=1"]
    assert main(["identify", "--response", str(bode), *units, "--out", str(saved), "--plot", str(picture)]) == 0
    said = capsys.readouterr().out
    assert "(p,q) = (1,0)" in said and "40 frequencies of 1 response" in said
    found = ga.load(saved)
    assert isinstance(found, ga.Identification) and found.of_responses
    assert pytest.approx(2e-3, rel=0.01) == found.mechanics.J
    assert picture.stat().st_size > 10_000
    assert main(["identify", "--response", str(bode), *units, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["frequencies"] == 40


def test_what_is_missing_is_said_in_options(bode: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "--response", str(bode)]) == 2
    assert "--response-units magnitude=" in capsys.readouterr().err
    assert main(["identify"]) == 2
    assert "--response FILE" in capsys.readouterr().err
    assert main(["identify", "--response", str(bode), "--response-units", "size=1"]) == 2
    assert "write one of frequency, magnitude" in capsys.readouterr().err
