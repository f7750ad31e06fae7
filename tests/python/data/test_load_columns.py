"""A sensor at the load in logs: named, with units, guessed by its name, in the drive file and on the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import gaident as ga
from gaident.cli import COMMANDS, main
from gaident.cli.drive import drive_of
from gaident.cli.options import parser_of
from gaident.data.column_names import load_says
from gaident.data.guess import guess_channels
from gaident.drive.drive_file import Drive
from gaident.errors import ReadError

N = 300
TIME = 1e-3 * np.arange(N)
SPEED = 40.0 * np.sin(15.0 * TIME) + 30.0
TURNED = 1e-3 * np.cumsum(SPEED)
LOG = pd.DataFrame(
    {
        "time [s]": TIME,
        "speed [rad/s]": SPEED,
        "torque [Nm]": np.cos(15.0 * TIME),
        "scale": 5.0 * TURNED,
        "tacho": 0.25 * SPEED,
        "encoder 2": np.floor(8000.0 * TURNED) % 65536.0,
    }
)
NAMED = {"velocity": "speed [rad/s]", "torque": "torque [Nm]", "time": "time [s]"}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    LOG.to_csv(tmp_path / "run.csv", index=False)
    return tmp_path / "run.csv"


def test_columns_of_the_load_are_named_with_any_unit(log: Path) -> None:
    named = {**NAMED, "load_position": "scale", "load_velocity": "tacho"}
    plain = ga.read(log, named)
    assert plain.load_position == pytest.approx(5.0 * TURNED) and plain.load_velocity == pytest.approx(0.25 * SPEED)
    straight = ga.read(log, named, {"load_position": "mm", "load_velocity": "m/min"})
    assert straight.load_position == pytest.approx(5e-3 * TURNED) and straight.load_velocity == pytest.approx(0.25 / 60.0 * SPEED)
    turned = ga.read(log, named, {"load_position": "deg", "load_velocity": -2.0})
    assert turned.load_position == pytest.approx(np.radians(5.0 * TURNED)) and turned.load_velocity == pytest.approx(-0.5 * SPEED)
    with pytest.raises(ReadError, match="'V' is no unit of load_velocity"):
        ga.read(log, named, {"load_velocity": "V"})


def test_counts_of_the_load_are_those_of_no_motor(log: Path) -> None:
    named = {**NAMED, "load_position": "encoder 2"}
    rec = ga.read(log, named, {"load_position": "counts"}, counts_per_turn=8192)
    assert rec.load_position == pytest.approx(np.floor(8000.0 * TURNED), abs=1.0)
    assert rec.notes == ("The load position wrapped once, by 65536, and was continued over these jumps.",)


def test_what_reads_in_parts_keeps_the_load(log: Path) -> None:
    named = {**NAMED, "load_position": "encoder 2", "load_velocity": "tacho"}
    whole = ga.read(log, named)
    parts = ga.read_pieces(log, named, start=0.1, stop=0.25)
    assert parts[0].load_velocity == pytest.approx(whole.load_velocity[100:251])  # type: ignore[index]
    slow = ga.read(log, named, decimate=4)
    assert slow.load_velocity == pytest.approx(0.25 * slow.velocity, abs=1e-9) and len(slow) == N // 4
    even = ga.read(log, named, resample=1e-3)
    assert even.load_velocity == pytest.approx(whole.load_velocity, abs=1e-9)
    moved = ga.read(log, named, shift={"load_velocity": 2})
    assert moved.load_velocity == pytest.approx(whole.load_velocity[:-2])  # type: ignore[index]
    axes = ga.read_axes(LOG, {"x": {key: name for key, name in named.items() if key != "time"}}, columns={"time": "time [s]"})
    assert axes["x"].load_velocity is not None


def test_a_log_names_the_channels_itself(tmp_path: Path) -> None:
    pd.DataFrame({"time": TIME, "velocity": SPEED, "torque": SPEED, "load_position": TURNED}).to_csv(tmp_path / "run.csv")
    assert ga.read(tmp_path / "run.csv").load_position == pytest.approx(TURNED)


def test_the_load_side_is_for_channels_of_the_motor(log: Path) -> None:
    with pytest.raises(ReadError, match="load_side names 'load_position', whose scale is estimated"):
        ga.read(log, {**NAMED, "load_position": "scale"}, gear_ratio=10.0, load_side="load_position")


def drive(*options: str) -> Drive:
    return drive_of(parser_of(dict.fromkeys(COMMANDS, print)).parse_args(["identify", "run.csv", *options]))


def test_drive_file_and_options_name_the_load(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(log.parent)
    Path("drive.toml").write_text(
        '[columns]\nvelocity = "speed [rad/s]"\ntorque = "torque [Nm]"\ntime = "time [s]"\nload_position = "scale"\n'
        '[units]\nload_position = "mm"\n[shift]\nload_position = 1\n'
    )
    read = drive("--drive", "drive.toml").read("run.csv")
    assert read.load_position == pytest.approx(5e-3 * TURNED[:-1]) and read.load_velocity is None
    over = drive("--drive", "drive.toml", "--columns", "load_velocity=tacho,load_position=", "--units", "load_velocity=rpm")
    again = over.read("run.csv")
    assert again.load_position is None and again.load_velocity == pytest.approx(0.25 * np.pi / 30.0 * SPEED)


GUESSED = {
    "Load position": "position",
    "load_pos": "position",
    "LoadSpeed": "velocity",
    "Load velocity actual": "velocity",
    "Load encoder": "position",
    "Lastgeber": "position",
    "Lastdrehzahl": "velocity",
    "Second encoder": "position",
    "External encoder velocity": "velocity",
    "zweiter Geber": "position",
}
NOT_GUESSED = (
    *("Load torque", "Motor load", "Load ratio", "Load position command", "load_pos_ref", "Load position error", "no-load speed"),
    *("load angle", "Lastwinkel", "last position", "p_load", "enc2", "Load cell", "Load speed limit", "Master external encoder"),
)


@pytest.mark.parametrize("name", GUESSED)
def test_names_of_a_sensor_at_the_load(name: str) -> None:
    assert list(load_says([name])) == [GUESSED[name]]


@pytest.mark.parametrize("name", NOT_GUESSED)
def test_names_that_leave_a_doubt(name: str) -> None:
    assert not load_says([name])


def guess(*names: str) -> dict[str, str]:
    waves = {name: np.sin((k + 3) * 7.0 * TIME) for k, name in enumerate(names)}
    listing = ga.columns(pd.DataFrame({"time": TIME, **waves}))
    return {channel: column.name for channel, column in guess_channels(listing).channels.items()}


def test_a_guess_takes_no_column_from_another_channel() -> None:
    both = guess("Motor position", "External encoder position", "torque")
    assert (both["position"], both["load_position"]) == ("Motor position", "External encoder position")
    alone = guess("External encoder position", "torque")
    assert alone["position"] == "External encoder position" and "load_position" not in alone
    assert "load_position" not in guess("speed", "torque", "load position", "Lastgeber")


def test_a_unit_of_another_quantity_speaks_against_the_load(tmp_path: Path) -> None:
    waves = {"speed [rpm]": SPEED, "load position [N m]": TURNED, "load speed [m/s]": TURNED}
    pd.DataFrame({"time [s]": TIME, **waves}).to_csv(tmp_path / "run.csv", index=False)
    assert set(guess_channels(ga.columns(tmp_path / "run.csv")).channels) == {"velocity", "load_velocity"}


def test_a_velocity_that_is_known_by_its_values_stays_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, out = str(tmp_path / "run.csv"), str(tmp_path / "drive.toml")
    pair = {"a": 3.0 * TIME**2 + np.cos(60.0 * TIME), "load position": TIME**3 + np.sin(60.0 * TIME) / 60.0}
    pd.DataFrame({"time": TIME, **pair, "torque": TIME**2}).to_csv(log, index=False)
    assert main(["init", log, "--out", out]) == 0
    written = Path(out).read_text()
    assert '\nposition = "load position"' in written and '\nvelocity = "a"' in written and "load_position" not in written


def test_init_writes_the_load_down(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    load = {"load position [mm]": 5.0 * TURNED, "load speed": 0.25 * SPEED}
    pd.DataFrame({"time [s]": TIME, "speed [rpm]": SPEED, "torque [Nm]": SPEED, **load}).to_csv("run.csv", index=False)
    assert main(["init", "run.csv"]) == 0
    written = Path("drive.toml").read_text()
    assert 'axis = "rotary"' in written and '\nload_position = "mm"' in written and "\nload_velocity = 1 " in written
    assert "units.load" not in written
    rec = drive("--drive", "drive.toml").read("run.csv")
    assert rec.load_position == pytest.approx(5e-3 * TURNED) and rec.load_velocity == pytest.approx(0.25 * SPEED)
