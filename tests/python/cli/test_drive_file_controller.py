"""[controller] of a drive file: gains of a drive, what stands around a PI, and how it reaches the commands."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from cli_cases import refusal
from gaident.cli import COMMANDS, main
from gaident.cli.drive import drive_of
from gaident.cli.options import parser_of
from gaident.drive.drive_file import read_drive_file
from gaident.errors import ReadError

NAMES = '[columns]\ntime = "t"\ncommand = "r"\nvelocity = "w"\ntorque = "u"\n'
SINAMICS = ga.PI(0.02, 2.0)
NOTCH = ga.Notch(frequency=285.0, numerator_damping=0.1, denominator_damping=0.7)
CASES: dict[str, tuple[str, ga.PI | ga.Cascade]] = {
    "gains of a drive": ('[controller]\ndrive = "sinamics"\np1460 = 0.02\np1462 = 10\n', SINAMICS),
    "with a torque constant": (
        'torque_constant = 0.5\n[controller]\ndrive = "simplefoc"\npid_velocity_p = 0.04\npid_velocity_i = 4\n',
        ga.PI(0.02, 2.0),
    ),
    "a limit beside them": (
        '[controller]\ndrive = "sinamics"\np1460 = 0.02\np1462 = 10\ntorque_limit = 2.0\nanti_windup = "hold"\n',
        ga.PI(0.02, 2.0, torque_limit=2.0, anti_windup="hold"),
    ),
    "rule and weight": (
        '[controller]\nkp = 0.02\nki = 2\nrule = "backward"\ncommand_weight = 0\n',
        ga.PI(0.02, 2.0, rule="backward", command_weight=0.0),
    ),
    "tracking": (
        '[controller]\nkp = 0.02\nki = 2\ntorque_limit = 1\nanti_windup = "tracking"\ntracking_time = 2e-3\n',
        ga.PI(0.02, 2.0, torque_limit=1.0, anti_windup="tracking", tracking_time=2e-3),
    ),
    "filters": (
        '[controller]\nkp = 0.02\nki = 2\nperiod = 250e-6\ntorque_filters = [{ kind = "low pass", time_constant = 4e-4 }, '
        '{ kind = "notch", frequency = 285, numerator_damping = 0.1, denominator_damping = 0.7 }]\n'
        'velocity_filters = [{ kind = "low pass", time_constant = 1e-3 }]\n',
        ga.Cascade(SINAMICS, period=250e-6, torque_filters=(ga.LowPass(4e-4), NOTCH), velocity_filters=(ga.LowPass(1e-3),)),
    ),
    "position and feedforward": (
        "[controller]\nkp = 0.02\nki = 2\nposition_gain = 40\nposition_period = 1e-3\nvelocity_feedforward = 1\n"
        "acceleration_feedforward = 3e-4\n",
        ga.Cascade(SINAMICS, position=ga.P(40.0), position_period=1e-3, velocity_feedforward=1.0, acceleration_feedforward=3e-4),
    ),
    "a profile that the controller makes": (
        '[controller]\nkp = 0.02\nki = 2\nperiod = 250e-6\nposition_gain = 40\ninterpolation = "smooth"\n',
        ga.Cascade(SINAMICS, period=250e-6, position=ga.P(40.0), interpolation="smooth"),
    ),
    "position gain of a drive": (
        '[controller]\ndrive = "ax5000"\ns_0_0100 = 0.02\ns_0_0101 = 10\ns_0_0104 = 1.5\n',
        ga.Cascade(SINAMICS, position=ga.P(25.0)),
    ),
    "delay": ("[controller]\nkp = 0.02\nki = 2\ndelay = 60e-6\n", ga.Cascade(SINAMICS, delay=60e-6)),
    "unknown": (
        '[controller]\nkp = "unknown"\nki = "unknown"\nposition_gain = "unknown"\nvelocity_feedforward = "unknown"\n'
        'torque_filters = [{ kind = "low pass", time_constant = "unknown" }]\n',
        ga.Cascade(
            ga.PI(None, None), position=ga.P(None), velocity_feedforward=None, torque_filters=(ga.LowPass(time_constant=None),)
        ),
    ),
    "a cascade in drive units": (
        'torque_constant = 0.5\nrated_torque = 2.0\n[controller]\nkp = "0.04 A s/rad"\ntn = "10 ms"\ntorque_limit = "150 %"\n'
        'period = "125 us"\nposition_gain = "1.5 1000/min"\nposition_period = "1 ms"\nvelocity_feedforward = "100 %"\n'
        'torque_filters = [{ kind = "low pass", time_constant = "0.4 ms" }]\n',
        ga.Cascade(
            ga.PI(0.02, 2.0, torque_limit=3.0),
            period=125e-6,
            position=ga.P(25.0),
            position_period=1e-3,
            velocity_feedforward=1.0,
            torque_filters=(ga.LowPass(4e-4),),
        ),
    ),
    "a low pass by its frequency": (
        '[controller]\nkp = 0.02\nki = 2\ntorque_filters = [{ kind = "low pass", frequency = "250 Hz" }]\n',
        ga.Cascade(SINAMICS, torque_filters=(ga.LowPass(1.0 / (2.0 * np.pi * 250.0)),)),
    ),
    "gains of a slide, of a motor on a screw": (
        'screw = 0.036\ntorque_constant = 0.94\n[controller]\nkp = "180 A/(m/s)"\nki = "12000 A/m"\n',
        ga.PI(180 * (0.036 / (2 * np.pi)) * 0.94, 12000 * (0.036 / (2 * np.pi)) * 0.94),
    ),
    "forces of a slide, of a motor on a screw": (
        'screw = "10 mm"\n[controller]\nkp = "2000 N s/m"\nki = "5e4 N/m"\ntorque_limit = "900 N"\n',
        ga.PI(
            2000 * ((0.01 / (2 * np.pi)) * (0.01 / (2 * np.pi))),
            5e4 * ((0.01 / (2 * np.pi)) * (0.01 / (2 * np.pi))),
            torque_limit=900 * (0.01 / (2 * np.pi)),
        ),
    ),
    "a bandwidth and an inertia": (
        '[controller]\nkp = "200 1/s"\ntotal_inertia = "1 kg cm^2"\ntn = 0.01\n',
        ga.PI(0.02, 2.0),
    ),
    "percent of the rated torque per percent of the reference speed": (
        'rated_torque = 3.0\nreference_speed = "3000 rpm"\n[controller]\nkp = "5 %/%"\nki = 2\n',
        ga.PI(15.0 / (3000 * (2 * np.pi / 60)), 2.0),
    ),
    "percent of the rated torque per rpm": (
        'rated_torque = 3.0\n[controller]\nkp = "0.5 %/rpm"\nki = "0.01 N·m/rad"\n',
        ga.PI(0.005 * 3.0 / (2 * np.pi / 60), 0.01),
    ),
}


def controller_in(text: str) -> Any:
    Path("drive.toml").write_text(text)
    call = ["identify", "log.csv", "--drive", "drive.toml"]
    return drive_of(parser_of(dict.fromkeys(COMMANDS, print)).parse_args(call)).controller()


@pytest.mark.parametrize("case", CASES)
def test_a_drive_file_says_the_controller(case: str, here: Path) -> None:
    text, expected = CASES[case]
    found = controller_in(text)
    assert type(found) is type(expected)
    assert json.dumps(found.to_dict()) == json.dumps(expected.to_dict())


WRONG = {
    "drive": ('drive = "sinamic"\np1460 = 1', "did you mean 'sinamics'"),
    "other drive": ('drive = "sinamics"\np1460 = 1\ns_0_0101 = 10', "has the key 's_0_0101'"),
    "missing": ('drive = "sinamics"\np1460 = 1', "lacks p1462 [ms]"),
    "no constant": ('drive = "epos2"\nspeed_regulator_p_gain = 1\nspeed_regulator_i_gain = 1', "lacks torque_constant [N m/A]"),
    "no drive": ("p1460 = 1\np1462 = 10", "which is a drive's: say which"),
    "twice": ('drive = "sinamics"\nkp = 1\np1460 = 1\np1462 = 10', "has kp and the gains of a drive"),
    "two positions": ('drive = "odrive"\nvel_gain = 1\nvel_integrator_gain = 1\npos_gain = 1\nposition_gain = 1', "the one or"),
    "filter": ('kp = 1\nki = 1\ntorque_filters = [{ kind = "low pas" }]', 'is a "low pass" or a "notch"'),
    "no list": ("kp = 1\nki = 1\ntorque_filters = 3", "give a list of filters"),
    "delay": ("kp = 1\nki = 1\ndelay = -1", "delay is -1: give seconds, from 0 to 1"),
    "unit": ('kp = "0.12 A s/rd"\nki = 1', "'A s/rd' is none of its units (did you mean 'A s/rad'?)"),
    "unit of another": ('kp = 1\nki = 1\ntorque_limit = "3 Nm s"', "give one of N m, A, mA"),
    "no torque constant": ('kp = "0.12 A s/rad"\nki = 1', "which needs torque_constant: give it above the first section"),
    "no inertia": ('kp = "200 1/s"\nki = 1', "which needs total_inertia: give it in [controller]"),
    "no speed": ('kp = "5 %/%"\nki = 1', "which needs rated_torque: give it above the first section"),
    "unkown": ('kp = "unkown"\nki = 1', "did you mean 'unknown'?"),
    "no number": ('kp = "much"\nki = 1', "a number with its unit (N m s/rad, A s/rad, mA s/rad, % s/rad"),
    "a limit is known": ('kp = 1\nki = 1\ntorque_limit = "unknown"', "torque_limit is 'unknown': give one number"),
    "ki and tn": ('kp = 1\nki = 1\ntn = "10 ms"', "the controller has tn and ki"),
    "tn alone": ('kp = "unknown"\ntn = "10 ms"', "tn is given without kp"),
    "ti and tn": ('kp = 1\nti = "10 ms"\ntn = "10 ms"', "the controller has tn and ti"),
    "ti alone": ('kp = "unknown"\nti = "10 ms"', "ti is given without kp"),
    "no ti": ("kp = 1\nti = 0", "ti is 0.0: give a time > 0"),
    "no time": ("kp = 1\ntn = 0", "tn is 0.0: give a time > 0"),
    "typing error": ("kp = 1\nki = 1\nposition_gian = 3", "did you mean 'position_gain'?"),
    "rule": ('kp = 1\nki = 1\nrule = "backwards"', "did you mean 'backward'"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_controller_is_one_line(case: str, here: Path) -> None:
    text, words = WRONG[case]
    with pytest.raises(ga.GaidentError) as caught:
        controller_in(f"[controller]\n{text}\n")
    assert words in str(caught.value)


def test_gains_of_a_drive_fill_the_marks_of_init(here: Path) -> None:
    marked = "# kp = 0.0232  # FILL IN: N m s/rad\n# ki = 1.367  # FILL IN: N m/rad\n"
    assert controller_in(f'[controller]\n{marked}drive = "sinamics"\np1460 = 0.02\np1462 = 10\n') == SINAMICS
    with pytest.raises(ga.GaidentError, match="marked FILL IN"):
        controller_in(f"[controller]\n{marked}")


def test_a_log_without_a_velocity_command_asks_for_the_position_gain(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing else drives the velocity loop; beside a velocity command the gain may be left out."""
    with pytest.raises(ga.GaidentError, match=r"position_gain of \[controller\], marked FILL IN"):
        controller_in("[controller]\nkp = 0.02\nki = 2\n# position_gain = 40.0  # FILL IN: 1/s\n")
    t = 1e-3 * np.arange(400)
    columns = {"t [s]": t, "v_act [rad/s]": np.sin(t), "pos_act [rad]": 1 - np.cos(t), "pos_cmd [rad]": 1 - np.cos(t)}
    for names, marks in ((tuple(columns), 1), ((*columns, "v_cmd [rad/s]"), 0)):
        values = np.column_stack([{**columns, "v_cmd [rad/s]": np.sin(t)}[name] for name in names])
        np.savetxt("axis.csv", values, delimiter=",", header=",".join(names), comments="")
        assert main(["init", "axis.csv", "--out", f"{marks}.toml"]) == 0
        assert capsys.readouterr().out.count("controller.position_gain: 1/s") == marks
        assert "feedforward_over" in Path(f"{marks}.toml").read_text() and "[show]" in Path(f"{marks}.toml").read_text()


def test_a_cascade_reaches_identify_diagnose_and_simulate(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A backward PI with a torque filter, its gains as the drive shows them, a log of all its samples."""
    dt, samples = 1e-3, 1200
    drive = ga.Cascade(ga.PI(0.3, 6.0, rule="backward"), torque_filters=(ga.LowPass(1e-3),))
    noise = 0.02 * np.random.default_rng(5).standard_normal(samples)
    r = np.repeat(np.random.default_rng(4).uniform(-60.0, 60.0, 12), samples // 12)
    truth = ga.OneMass(J=0.004, D=0.02)
    run = ga.run(truth, ga.Record(dt, command=r - noise, velocity=noise), drive)
    np.savetxt("log.csv", np.column_stack([dt * np.arange(samples), r, run.velocity + noise, run.torque]), delimiter=",",
               header="t,r,w,u", comments="")  # fmt: skip
    Path("drive.toml").write_text(
        f'{NAMES}[controller]\ndrive = "ax5000"\ns_0_0100 = 0.3\ns_0_0101 = 50\nrule = "backward"\n'
        'torque_filters = [{ kind = "low pass", time_constant = 1e-3 }]\n'
    )
    given = ["log.csv", "--drive", "drive.toml", "--json", "--quiet"]
    assert main(["identify", *given, "--out", "run.json"]) == 0
    idn = ga.load("run.json")
    assert isinstance(idn, ga.Identification)
    assert 1.0 / idn.model.gain == pytest.approx(0.004, rel=5e-3)
    capsys.readouterr()
    assert main(["diagnose", *given, "--model", "run.json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"] == "adequate"
    assert main(["simulate", "run.json", *given]) == 0
    simulated = json.loads(capsys.readouterr().out)
    assert simulated["controller"]["velocity"]["rule"] == "backward"
    assert np.abs(np.array(simulated["runs"][0]["velocity"]) - run.velocity).max() < 1.0


def test_a_position_controller_needs_its_command(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("log.csv").write_text("t,r,w,u\n" + "".join(f"{k / 1000},1,{k},0.5\n" for k in range(50)))
    Path("drive.toml").write_text(f"{NAMES}[controller]\nkp = 0.02\nki = 2\nposition_gain = 40\n")
    said = refusal(["identify", "log.csv", "--drive", "drive.toml"], capsys)
    assert "there is no position_command" in said and "--columns position_command=..." in said


def test_numbers_of_the_axis_may_have_their_unit(here: Path) -> None:
    text = 'rated_torque = "4,2 N m"\ntorque_constant = "56 mN m/A"\ndt = "250 us"\ninductance = "2.1 mH"\nfrom = "1.5 s"\n'
    text += 'back_emf_constant = "0.0105 V/rpm"\nresistance = "0.8 Ohm"\n[limits]\nspeed = "3000 rpm"\nduration = "800 ms"\n'
    Path("drive.toml").write_text(text)
    found = read_drive_file("drive.toml")
    top = {"rated_torque": 4.2, "torque_constant": 0.056, "dt": 250e-6, "inductance": 2.1e-3, "from": 1.5, "resistance": 0.8}
    assert {key: found[""][key] for key in top} == pytest.approx(top)
    assert found[""]["back_emf_constant"] == pytest.approx(0.0105 * 60.0 / (2.0 * np.pi))
    assert found["limits"] == pytest.approx({"speed": 100.0 * np.pi, "duration": 0.8})
    call = ["identify", "log.csv", "--rated-torque", "4.2 N m", "--dt", "1 ms"]
    drive = drive_of(parser_of(dict.fromkeys(COMMANDS, print)).parse_args(call))
    assert (drive.general["rated_torque"], drive.general["dt"]) == (4.2, 1e-3)
    for wrong, said in (
        ('rated_torque = "4.2 V"', "'V' is none of its units; give one of N m"),
        ('torque_constant = "much"', "torque_constant is 'much': give one number, a number with its unit"),
        ('resample = "-1 ms"', "resample is '-1 ms': give a number > 0"),
    ):
        Path("drive.toml").write_text(wrong)
        with pytest.raises(ReadError, match=re.escape(said)):
            read_drive_file("drive.toml")
