"""The command line: what its commands print and write."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from cli_cases import LOOP, NAMES, TRUTH, refusal
from gaident.cli import main
from places import ROOT


def test_identify_prints_a_summary_and_writes_files(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    args = ["identify", "step.csv", *NAMES, *LOOP, "--out", "idn.json", "--plot", "idn.png"]
    assert main(args) == 0
    out, err = capsys.readouterr()
    assert err == ""  # nothing where stderr is no terminal
    assert out.startswith("(p,q) = (1,2), two masses on a shaft; the linear model stands\n")
    assert out.endswith("\nwritten: idn.json, idn.png\n")
    assert Path("idn.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(p.name for p in here.iterdir()) == ["idn.json", "idn.png", "step.csv"]  # no parts left
    idn = ga.load("idn.json")
    assert isinstance(idn.mechanics, ga.TwoMass)
    assert pytest.approx(TRUTH.JL, rel=0.05) == idn.mechanics.JL


def test_warnings_in_the_summary_name_no_python(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "step.csv", *NAMES, "--kp", "0.0232", "--ki", "1.367"]) == 0
    out, _ = capsys.readouterr()
    assert "give its loop as continuous" in " ".join(out.split()) and "loop='" not in out
    assert out.index("Keep in mind") < out.index("Mechanics")


def test_identify_says_what_the_log_says_of_the_controller(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Gains that are not the drive's, none at all, and the right ones."""

    def warnings(*options: str) -> list[str]:
        assert main(["identify", "step.csv", *NAMES, *options, "--json"]) == 0
        return list(json.loads(capsys.readouterr().out)["warnings"])

    biased = "The log has a command, but no controller is simulated"
    wrong = warnings("--kp", "0.05", "--ki", "1.367")[0]
    assert (
        wrong.startswith("The logged torque does not follow from command and velocity") and "Give kp = 0.0230" in wrong
    )  # the log is noisy
    assert warnings("--loop", "open")[0].startswith(biased)
    for options in (("--columns", "command="), LOOP):
        assert not any(w.startswith((biased, "The logged torque does not")) for w in warnings(*options))
    assert main(["identify", "step.csv", *NAMES]) == 0
    assert "give the gains of the controller." in " ".join(capsys.readouterr().out.split())


def test_json_is_what_is_saved_and_valid(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "step.csv", *NAMES, *LOOP, "--json", "--out", "idn.json"]) == 0
    out, err = capsys.readouterr()

    def refuse(word: str) -> float:
        raise AssertionError(f"{word} is no JSON")

    data = json.loads(out, parse_constant=refuse)
    assert err == "" and data == json.loads(Path("idn.json").read_text())
    assert data["schema"] == "gaident/identification" and data["schema_version"] == 1
    assert {"model", "controller", "parameters", "mechanics", "adequacy", "structures", "seed"} <= set(data)
    assert set(data["parameters"]["gain"]) == {"value", "std", "unit", "at_bound", "identifiable", "of_controller"}


def test_same_seed_same_result_for_any_workers(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results = []
    for workers in ("1", "2"):
        args = ["identify", "step.csv", *NAMES, *LOOP, "--paper", "--trials", "3", "--seed", "5"]
        assert main([*args, "--workers", workers, "--json"]) == 0
        results.append({k: v for k, v in json.loads(capsys.readouterr().out).items() if k != "seconds"})
    assert results[0] == results[1]
    assert results[0]["settings"]["engine"] == "plain" and len(results[0]["trials"]) == 3


def test_simulate_writes_csv_that_can_be_read(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("truth.json").write_text(json.dumps(TRUTH.to_dict()))
    assert main(["simulate", "truth.json", "step.csv", *NAMES, *LOOP, "--out", "sim.csv"]) == 0
    out, _ = capsys.readouterr()
    assert re.fullmatch(r"step: fit 97\.\d\d %, rmse 0\.\d+ rad/s; written: sim\.csv\n", out)
    rec = ga.read("step.csv", columns={"command": "w_ref", "velocity": "w"})
    run = ga.run(TRUTH, rec, ga.PI(0.0232, 1.367, loop="continuous"))
    again = ga.read("sim.csv")
    np.testing.assert_allclose(again.velocity, run.velocity, rtol=1e-11)
    assert again.torque is not None
    np.testing.assert_allclose(again.torque, run.torque, rtol=1e-11)
    assert main(["simulate", "truth.json", "step.csv", *NAMES, *LOOP]) == 0
    assert capsys.readouterr().out == Path("sim.csv").read_text()


def test_a_proposed_command_can_be_simulated_as_it_is(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("truth.json").write_text(json.dumps(TRUTH.to_dict()))
    # The drive's logs have names and units of their own, which are not the proposal's.
    columns, units = "[columns]\ncommand = 'w_ref'\nvelocity = 'w'\n", "[units]\ncommand = 'rpm'\nvelocity = 'rpm'\n"
    rest = "[controller]\nkp = 0.0232\nki = 1.367\n[limits]\nspeed = 100\ntorque = 2\n"
    Path("d.toml").write_text(f"dt = 1e-3\n{columns}{units}{rest}")
    assert main(["experiment", "--drive", "d.toml", "--out", "next.csv"]) == 0
    capsys.readouterr()
    assert main(["simulate", "truth.json", "next.csv", "--drive", "d.toml", "--out", "sim.csv"]) == 0
    assert capsys.readouterr().out == "next: no measured velocity to compare with; written: sim.csv\n"
    rec = ga.read("next.csv", measured=False)
    assert rec.command is not None and 50 < rec.command.max() <= 100 and not rec.velocity.any()
    np.testing.assert_allclose(ga.read("sim.csv").velocity, ga.simulate(TRUTH, rec, ga.PI(0.0232, 1.367)), rtol=1e-9)
    assert main(["simulate", "truth.json", "next.csv", "--drive", "d.toml", "--json"]) == 0
    (run,) = json.loads(capsys.readouterr().out)["runs"]
    assert run["rmse"] is None and run["fit_percent"] is None and len(run["velocity"]) == len(rec)
    assert "velocity" in refusal(["identify", "next.csv", "--kp", "0.0232", "--ki", "1.367"], capsys)
    with pytest.raises(ga.GaidentError, match="velocity of the record is constant"):
        ga.identify(rec, ga.PI(0.0232, 1.367))


def test_simulate_takes_the_saved_controller_and_start(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "step.csv", *NAMES, *LOOP, "--initial-state", "free", "--out", "idn.json"]) == 0
    idn = ga.load("idn.json")
    capsys.readouterr()
    assert main(["simulate", "idn.json", "step.csv", *NAMES, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["controller"]["loop"] == "continuous" and data["schema"] == "gaident/simulation"
    (run,) = data["runs"]
    assert run["rmse"] == pytest.approx(idn.rmse) and run["fit_percent"] == pytest.approx(idn.fit_percent)
    assert len(run["velocity"]) == len(run["torque"]) == run["samples"] == 250
    # The same model without the controller, from the log's torque.
    assert main(["simulate", "idn.json", "step.csv", *NAMES, "--loop", "open", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["controller"] is None
    torque = ga.read("step.csv", columns={"torque": "u", "velocity": "w"}).torque
    assert torque is not None
    np.testing.assert_allclose(data["runs"][0]["torque"], torque)


def test_simulate_takes_the_controller_that_was_found_where_the_file_does_not_know_its_gains(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", "step.csv", *NAMES, *LOOP, "--out", "idn.json"]) == 0
    assert main(["simulate", "idn.json", "step.csv", *NAMES, *LOOP, "--out", "known.csv"]) == 0
    capsys.readouterr()
    unknown = ["--kp", "unknown", "--ki", "unknown"]
    assert main(["simulate", "idn.json", "step.csv", *NAMES, *unknown, "--out", "found.csv"]) == 0
    assert "the controller that was found with the model closes the loop" in capsys.readouterr().err
    assert Path("found.csv").read_bytes() == Path("known.csv").read_bytes()


def test_simulate_several_logs_into_a_folder(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("m.json").write_text('{"gain": 5000, "poles": [-10]}')
    Path("other.csv").write_bytes(Path("step.csv").read_bytes())
    logs = ["step.csv", "other.csv"]
    assert main(["simulate", "m.json", *logs, *NAMES, *LOOP, "--out", "sim"]) == 0
    assert sorted(p.name for p in Path("sim").iterdir()) == ["other_simulated.csv", "step_simulated.csv"]
    capsys.readouterr()
    assert "--out" in refusal(["simulate", "m.json", *logs, *NAMES, *LOOP], capsys)


def test_help_and_version(capsys: pytest.CaptureFixture[str]) -> None:
    for args, parts in (
        ([], ("identify", "simulate", "demo")),
        (["--help"], ("identify", "simulate", "demo")),
        (["--version"], ("gaident ",)),
        (["identify", "--help"], ("examples:", "--drive", "[controller]", "rated_torque", "load_side", "exit codes")),
        (["simulate", "--help"], ("MODEL.json", "examples:")),
        (["demo", "--help"], ("GAIDENT_DATA",)),
        (["columns", "--help"], ("TwinCAT", "--quiet")),
        (["init", "--help"], ("FILL IN", "--force")),
        (["experiment", "--help"], ("[limits]", "--travel")),
        (["doctor", "--help"], ("Exit code 1",)),
        (["completion", "--help"], ("bash", "fish")),
    ):
        assert main(args) == 0
        out, err = capsys.readouterr()
        assert err == "" and all(part in out for part in parts)
        assert max(map(len, out.splitlines())) <= 110


@pytest.mark.long
def test_demo_without_measured_data(here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: Any) -> None:
    monkeypatch.delenv("GAIDENT_DATA", raising=False)
    assert main(["demo"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "(p,q) = (1,2), two masses on a shaft; the linear model stands" in out
    assert "Compared with the truth" in out
    assert "\nThe measured EMPS axis is left out: GAIDENT_DATA" in out
    assert "\nVerdict: explained\n" in out and "Cause: coulomb\nfriction at the motor." in out
    assert "\nThe truth: a dry friction of 0.04 N m" in out
    made = [f"demo_{name}.{suffix}" for name in ("friction", "two_mass") for suffix in ("csv", "png")]
    assert sorted(p.name for p in here.iterdir()) == [*made, "step.csv"]
    # The commands that it proposes, the first with the drive file of the examples.
    assert main(out.splitlines()[-1].split()[1:]) == 0
    assert "Cause: coulomb\nfriction at the motor." in capsys.readouterr().out
    drive = ROOT / "examples" / "drive.toml"
    assert main(["identify", "demo_two_mass.csv", "--drive", str(drive)]) == 0
    assert capsys.readouterr().out.startswith("(p,q) = (1,2)")


def test_effects_that_are_named_come_with_their_bounds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects", "stribeck friction", "backlash"]) == 0
    out = capsys.readouterr().out
    assert "  place: shaft, at motor or load\n  torque [N m], >= 0\n" in out and "static_torque must be at least torque" in out
    assert out.endswith("backlash: play between motor and load; gap is its full width\n  place: coupling\n  gap [rad], >= 0\n")
    assert main(["effects", "backlash", "--json"]) == 0
    assert [row["name"] for row in json.loads(capsys.readouterr().out)["effects"]] == ["backlash"]
    assert main(["effects", "backslash"]) == 2
    assert "did you mean 'backlash'" in capsys.readouterr().err
