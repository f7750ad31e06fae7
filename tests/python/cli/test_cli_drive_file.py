"""The drive file, and the options that stand for it or override it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from cli_cases import LOOP, NAMES, refusal
from gaident.cli import COMMANDS
from gaident.cli.drive import drive_of
from gaident.cli.options import parser_of
from gaident.drive.drive_file import read_drive_file
from places import ROOT


def test_drive_file_stands_for_options_and_options_win(here: Path) -> None:
    Path("drive.toml").write_text(
        '[columns]\ncommand = "w_ref"\nvelocity = "w"\ntime = "t"\n[units]\nvelocity = "rpm"\n'
        '[controller]\nkp = 0.02\nki = 1.367\nloop = "continuous"\n'
        "[space]\ninertia = [1e-4, 5e-3]\np = 1\nq = [0, 2]\n"
    )
    arguments = parser_of(dict.fromkeys(COMMANDS, print)).parse_args(
        [
            "identify",
            "step.csv",
            "--drive",
            "drive.toml",
            "--kp",
            "0.0232",
            "--unit",
            "velocity=0.5",
            "--q",
            "2",
        ]
    )
    drive = drive_of(arguments)
    assert drive.controller() == ga.PI(0.0232, 1.367, loop="continuous")
    rec = drive.read("step.csv")
    whole = ga.read("step.csv", columns={"command": "w_ref", "velocity": "w"})
    np.testing.assert_allclose(rec.velocity, 0.5 * whole.velocity)
    space = drive.space([whole], drive.controller())
    assert space is not None and (space.p, space.q) == ((1, 1), (2, 2))
    assert space.gain == (200.0, 1e5) and "inertia" in space.source and "derived" in space.source


def test_space_options(here: Path) -> None:
    def space(*options: str) -> ga.SearchSpace | None:
        parser = parser_of(dict.fromkeys(COMMANDS, print))
        drive = drive_of(parser.parse_args(["identify", "step.csv", *NAMES, *LOOP, *options]))
        return drive.space([drive.read("step.csv")], drive.controller())

    assert space() is None
    paper = space("--gain", "1e3", "2e4", "--real", "0", "60", "--imaginary", "0", "250", "--bits", "12")
    assert paper is not None
    assert (paper.gain, paper.real, paper.imaginary) == ((1e3, 2e4), (0.0, 60.0), (0.0, 250.0))
    assert (paper.p, paper.q, paper.bits) == ((0, 3), (0, 3), 12)
    known = space("--inertia", "1e-4", "1e-3", "--resonance-hz", "5", "100", "--p", "1", "--q", "0..2")
    expected = ga.SearchSpace.from_mechanics((1e-4, 1e-3), (5.0, 100.0), p=(1, 1), q=(0, 2))
    assert known == expected


WRONG_DRIVE_FILES = [
    ("[controller]\nkpp = 3", "[controller] has the key 'kpp'", "did you mean 'kp'?"),
    ('[controller]\nkp = "3"', "[controller] kp is '3'", "give one number"),
    ("[controler]\nkp = 3", "has the key 'controler'", "did you mean 'controller'?"),
    ("columns = 3", "[columns] is a int", ""),
    ("[columns]\nvelocity = 2.5", "[columns] velocity is 2.5", "in quotes"),
    ("[space]\ninertia = [1e-4]", "[space] inertia is [0.0001]", "[lowest, highest]"),
    ("[space]\np = [0.5, 1]", "[space] p is 0.5", "whole number"),
    ("skip = true", "skip is True", "whole number"),
    ('axis = "linaer"', "axis is 'linaer'", "did you mean 'linear'?"),
    ("dt = = 3", "this is not TOML", "line 1"),
    ("# gains\n[controller]\nkp = 0,0232  # N m s", "line 3: kp is 0,0232, with a decimal comma", "write 0.0232"),
    ("dt = 1,5e-3", "line 1: dt is 1,5e-3", "write 1.5e-3"),
    ("[controller]\nkp = .08  # N m s", "line 2: kp contains .08, which is no number in TOML", "write 0.08"),
    ("dt = -5.", "line 1: dt contains -5., which is no number in TOML", "write -5.0"),
    ("dt = 1.e-3", "line 1: dt contains 1.e-3", "write 1.0e-3"),
    ("[space]\ninertia = [.1, 05]", "line 2: inertia contains .1", "write 0.1"),
    ("[space]\ninertia = [0.1, 05]", "line 2: inertia contains 05", "write 5"),
    ("axis = linear", "line 1: axis is linear, which is no value in TOML", 'write "linear"'),
    ("[columns]\nvelocity = n_ist [1/min]", "line 2: velocity is n_ist [1/min]", 'write "n_ist [1/min]"'),
    ("pieces = True", "line 1: pieces is True", "write true"),
    ('[report]\ntext = "at .5" m', "this is not TOML", "line 2"),
    ("[space]\ninertia = [0,1, 0,5]", "[space] inertia is [0, 1, 0, 5]", "with decimal points"),
    ("kp = 0.1", "kp stands at the top", "put it below the line [controller]"),
    ("[controller]\nvelocity = 'w'", "velocity stands in [controller]", "below the line [columns] or below the line [units]"),
    ("[controller]\ndt = 1e-3", "dt stands in [controller]", "at the top, above the first [section]"),
    (
        "# nothing\n",
        "this drive file is empty",
        "[controller], [space], [limits], [show], [report] and axis, pitch, dt, velocity_cutoff_hz",
    ),
]


@pytest.mark.parametrize(("text", "what", "remedy"), WRONG_DRIVE_FILES)
def test_drive_file_names_key_value_and_remedy(text: str, what: str, remedy: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(ga.GaidentError) as caught:
        read_drive_file(str(path))
    assert str(caught.value).startswith(str(path))
    assert what in str(caught.value) and remedy in str(caught.value)


def test_the_drive_file_of_the_readme_is_one(tmp_path: Path) -> None:
    (tmp_path / "drive.toml").write_text((ROOT / "README.md").read_text().split("```toml\n")[1].split("```")[0])
    sections = read_drive_file(str(tmp_path / "drive.toml"))
    assert sections["controller"] == {"kp": 0.0232, "ki": 1.367} and sections["columns"]["torque"] == "M"


def test_a_drive_file_is_spoken_of_in_its_own_keys(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Not in the command line's options, and no word is suggested that looks nothing like the one that was written."""
    Path("drive.toml").write_text("zz = 0.1\n")
    said = refusal(["identify", "step.csv", "--drive", "drive.toml"], capsys)
    assert "has the key 'zz'" in said and "dt, velocity_cutoff_hz, counts_per_turn" in said
    assert "--velocity-cutoff" not in said and "did you mean" not in said


def test_no_utf8_is_no_drive_file(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ga.GaidentError, match="UTF-8"):
        read_drive_file(str(tmp_path / "bad.toml"))


def test_a_channel_that_is_left_out_takes_its_unit_along(here: Path) -> None:
    Path("drive.toml").write_text(
        '[columns]\ncommand = "w_ref"\nvelocity = "w"\ntorque = "u"\n[units]\ntorque = "mNm"\n# velocity = "rpm"  # FILL IN\n'
    )

    def rec(*options: str) -> ga.Record:
        parser = parser_of(dict.fromkeys(COMMANDS, print))
        return drive_of(parser.parse_args(["identify", "step.csv", "--drive", "drive.toml", *options])).read("step.csv")

    with pytest.raises(ga.GaidentError, match=r"line 7: velocity of \[units\], marked FILL IN, is not filled in"):
        rec()
    known = ("--units", "velocity=rpm")
    assert rec(*known).torque is not None
    assert rec(*known, "--columns", "torque=").torque is None
