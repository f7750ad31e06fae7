"""Without the extra "pictures" the package works, and what draws says so before any work."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

import gaident as ga
from cli_cases import LOOP, NAMES, refusal
from gaident.cli import examination, main
from gaident.cli.commands import reproduce
from places import GOLDEN

REMEDY = 'pip install "gaident[pictures]"'
DRAWING = ("matplotlib", "PIL", "plotly")


@pytest.fixture(autouse=True)
def without_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where none of them is installed: Python finds no module whose entry is None."""
    for name in [*sys.modules]:
        if name.split(".")[0] in DRAWING:
            monkeypatch.delitem(sys.modules, name)
    for name in DRAWING:
        monkeypatch.setitem(sys.modules, name, None)


def test_numbers_need_no_pictures(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "step.csv", *NAMES, *LOOP, "--out", "step.json", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["p"] == 1
    assert isinstance(ga.load("step.json"), ga.Identification)


@pytest.mark.parametrize(("option", "what"), [("--plot=a.png", "a picture"), ("--report=a.html", "a report")])
def test_options_that_draw_are_refused_first(
    option: str, what: str, here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for command in ("identify", "diagnose"):
        err = refusal([command, "no such file.csv", *NAMES, *LOOP, option], capsys)
        assert what in err and "matplotlib" in err and REMEDY in err
    assert [path.name for path in here.iterdir()] == ["step.csv"]


def test_commands_that_draw_are_refused_first(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert REMEDY in refusal(["report", "no such file.json", "--out", "a.html"], capsys)
    monkeypatch.setattr(reproduce.paper, "reproduce", None)
    assert REMEDY in refusal(["reproduce", "--out", "paper"], capsys)
    assert not (here / "paper").exists()


def test_methods_that_draw_say_what_to_install(here: Path) -> None:
    dia = ga.load(GOLDEN / "diagnosis_schema_1.json")
    assert isinstance(dia, ga.Diagnosis) and dia.summary()
    rec = ga.Record(1e-3, torque=[0.0, 0.1] * 20, velocity=[float(k) for k in range(40)])
    for draw in (rec.plot, dia.identification.plot_poles, dia.identification.plot_convergence):
        with pytest.raises(ga.GaidentError, match=r"a picture needs matplotlib, .*gaident\[pictures\]"):
            draw()
    with pytest.raises(ga.GaidentError, match="a report needs matplotlib and plotly, which are not installed"):
        ga.report(dia, here / "a.html")


def test_doctor_finds_no_fault_in_an_installation_without_what_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = ["numpy>=1.26", "matplotlib>=3.6.3", 'matplotlib>=3.6.3; extra == "test"', 'matplotlib>=3.6.3; extra == "pictures"']
    monkeypatch.setattr(examination.metadata, "requires", lambda name: asked)
    whole = examination.metadata.version

    def version(name: str) -> str:
        if name == "matplotlib":
            raise examination.metadata.PackageNotFoundError(name)
        return whole(name)

    monkeypatch.setattr(examination.metadata, "version", version)
    used = {x.name: x for x in examination._libraries()}
    assert used["matplotlib"].extra == "pictures" and not used["matplotlib"].flaw
    assert not used["numpy"].extra
    asked.pop()  # what no extra installs is missing
    assert "not installed" in {x.name: x for x in examination._libraries()}["matplotlib"].flaw
