"""What a record's torque is, the controller's command or a measured current, from the log to what is made of it."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.cli import COMMANDS, main
from gaident.cli.drive import drive_of
from gaident.cli.options import parser_of
from gaident.data.torque_kind import kind_of_torque
from gaident.diagnosis.experiments import next_experiment
from gaident.diagnosis.records.hygiene import cleaned
from gaident.diagnosis.selection.decimated import decimated_record
from gaident.drive.drive_file import Drive, read_drive_file
from gaident.errors import ReadError, RecordError
from gaident.estimation.dataset import DataSet
from gaident.identification.notes import reading_notes

RPM = 2 * np.pi / 60
N = 300


def measured(**more: Any) -> ga.Record:
    n = np.arange(N)
    channels = {"command": np.sin(n / 9), "velocity": np.sin(n / 9 - 0.1), "torque": np.cos(n / 9), "position": -np.cos(n / 9)}
    return ga.Record(1e-3, **{**channels, "torque_is": "measured", "name": "run", **more})


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with step.csv: a drive in a closed loop, time in ms, speeds in rpm, its torque, and its current."""
    monkeypatch.chdir(tmp_path)
    still = ga.Record(1e-3, command=np.repeat([0.0, 40.0, -20.0], [20, 150, 130]), velocity=np.zeros(N))
    run = ga.run(ga.OneMass(J=5e-4, D=0.005), still, ga.PI(0.0232, 1.367))
    assert still.command is not None
    rows = np.column_stack([1e3 * still.time, still.command / RPM, run.velocity / RPM, run.torque])
    for name, torque in (("step.csv", "torque [Nm]"), ("current.csv", "Actual current [A]")):
        np.savetxt(name, rows, delimiter=",", header=f"t [ms],speed_ref [rpm],speed_act [rpm],{torque}", comments="")
    return tmp_path


def test_whatever_is_made_of_a_record_keeps_what_its_torque_is(tmp_path: Path) -> None:
    rec = measured()
    later = {name: values[20:] for name, values in rec.channels() if name != "torque"}
    assert rec.position is not None
    made = {
        "slice": rec[10:200],
        "between": rec.between(0.01, 0.2),
        "decimate": rec.decimate(3),
        "pickle": pickle.loads(pickle.dumps(rec)),
        "with_channels": rec.with_channels(velocity=rec.velocity + 1.0, position=None),
        "align": ga.align(rec[: N // 2], {"position": rec.position}, 1e-3, take=["position"], within=(-0.01, 0.01)).record,
        "align, torque of the other": ga.align(ga.Record(1e-3, **later), rec, on="velocity", within=(-0.03, -0.01)).record,
        "outliers taken out": cleaned(rec, np.array([7])),
        "on a coarse grid": decimated_record(rec, 2),
    }
    data = DataSet.of([rec], ga.PI(0.1, 1.0))
    made |= {"driven": data.driven[0], "turned": data.turned[0], "free": data.free[0]}
    rec.save(tmp_path / "rec.json")
    made["saved"] = ga.load(tmp_path / "rec.json")
    assert {key: value.torque_is for key, value in made.items()} == dict.fromkeys(made, "measured")
    assert made["saved"] == rec == made["pickle"]
    # The torque that a controller makes of a record without one is the controller's.
    bare = rec.with_channels(torque=None)
    assert bare.torque_is == "commanded" == DataSet.of([bare], ga.PI(0.1, 1.0)).driven[0].torque_is


def test_a_finding_beside_a_measured_torque_has_a_p_value() -> None:
    """Output errors decide there: what is drawn is weighed as torques, as the record is."""
    n = 1200
    drive = np.repeat(np.tile([1.0, -0.6, 0.4, -1.0], 3), n // 12)
    truth = ga.OneMass(J=0.01, D=0.03).model().with_effect("coulomb_friction", torque=0.15)
    velocity = ga.simulate(truth, ga.Record(2e-3, velocity=np.zeros(n), torque=drive))
    rng = np.random.default_rng(4)
    rec = ga.Record(
        2e-3,
        velocity=velocity + 0.02 * rng.standard_normal(n),
        torque=drive + 0.02 * rng.standard_normal(n),
        torque_is="measured",
    )
    dia = ga.diagnose(rec, bootstrap=2, seed=3)
    (cause,) = dia.causes
    assert cause.effect == "coulomb_friction" and cause.p_value == pytest.approx(1 / 3), "no gain of two draws is as large"


@pytest.mark.parametrize("kind", ["measured", "commanded", None])
def test_a_proposed_experiment_is_tried_on_records_of_the_same_kind_of_torque(
    kind: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A step in one direction leaves dry friction, a load and a dead band; each command is tried by simulated records."""
    tried: list[ga.Record] = []

    def noted(records: list[ga.Record], *rest: Any) -> DataSet:
        tried.extend(records)
        return of(records, *rest)

    loop, drive = ga.PI(0.05, 1.5), ga.OneMass(J=5e-4, D=2e-3).model().with_effect("coulomb_friction", torque=0.05)
    noise = 0.02 * np.random.default_rng(0).standard_normal(400)
    asked = np.repeat([0.0, 20.0], [50, 350])
    done = ga.run(drive, ga.Record(1e-3, command=asked - noise, velocity=np.zeros(400)), loop)
    rec = ga.Record(1e-3, command=asked, velocity=done.velocity + noise)
    if kind is not None:
        rec = rec.with_channels(torque=done.torque, torque_is=kind)
    of = DataSet.of
    monkeypatch.setattr(next_experiment, "DataSet", SimpleNamespace(of=noted))
    assert ga.diagnose(rec, loop).causes[0].alternatives
    assert tried, "an ambiguous finding asks for an experiment"
    assert {r.torque_is if r.torque is not None else None for r in tried} == {kind}


def test_with_channels_changes_what_it_is_given_and_shares_the_rest() -> None:
    rec = measured()
    other = rec.with_channels(velocity=np.ones(N), command=None, dt=2e-3)
    assert (other.dt, other.name, other.command) == (2e-3, "run", None)
    np.testing.assert_array_equal(other.velocity, 1.0)
    assert other.torque is not None and np.shares_memory(other.torque, rec.torque) and not other.velocity.flags.writeable
    assert rec.with_channels(torque=np.ones(N), torque_is="commanded").torque_is == "commanded"
    assert rec.with_channels() == rec
    for wrong, said in (
        ({"speed": np.ones(N)}, "the channel is 'speed': it must be one of command"),
        ({"velocity": np.ones(7)}, "velocity has 7 samples"),
        ({"velocity": np.ones(N + 1)}, "unequal lengths"),
        ({"velocity": None}, r"with_channels\(velocity=None\) leaves a record without its velocity"),
        ({"command": None, "torque": None}, r"with_channels\(command=None, torque=None\) leaves"),
        ({"torque": None, "torque_is": "measured"}, "torque_is='measured', but the record has no torque"),
        ({"dt": -1.0}, "dt=-1.0"),
    ):
        with pytest.raises(RecordError, match=said):
            rec.with_channels(**wrong)


def test_it_belongs_to_equality_and_to_the_digest_only_where_it_is_not_the_default() -> None:
    rec, same = measured(), measured(torque_is="commanded")
    assert rec != same and rec.digest != same.digest
    channels = {"command": np.arange(30.0), "velocity": np.ones(30), "torque": np.zeros(30)}
    # As gaident 0.1 wrote it before it knew of this.
    assert ga.Record(1e-3, **channels).digest == "ecc9522ae0537c034fa8ac2484ed42a4d0abf1f5d5ca194dc7526a00aa652962"
    assert "torque 0..0 (measured)" in repr(ga.Record(1e-3, **channels, torque_is="measured"))
    assert "torque (measured)" in rec._repr_html_() and "(measured)" not in same._repr_html_()


def test_old_files_hold_a_commanded_torque() -> None:
    data = json.loads(json.dumps(measured().to_dict()))
    assert data.pop("torque_is") == "measured"
    assert ga.Record.from_dict(data).torque_is == "commanded"


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"torque_is": "actual"}, ["torque_is is 'actual'", "commanded, measured"]),
        ({"torque_is": "mesured"}, ["did you mean 'measured'?"]),
        ({"torque_is": None}, ["torque_is is None"]),
        ({"torque": None}, ["torque_is='measured'", "no torque", "leave torque_is out"]),
    ],
)
def test_refusals(wrong: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(RecordError) as caught:
        measured(**wrong)
    assert all(word in str(caught.value) for word in words)


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("measured", "Actual current [A];measured current;I_q;Iq;Iq act;current feedback;Iist;M_ist;IqAct;torque feedback"),
        ("measured", "Torque actual value;tau_meas;Strom Ist;ActTorque;iq_act_A;trqFbk"),
        ("commanded", "Iq_ref;I_q,ref;torque command;Msoll;M_soll;Torque setpoint;Torque setpoint actual;iset"),
        (None, "Torque;current;Moment;u;M [Nm];field.effort;motor torque;time;data[:,3];Strom"),
    ],
)
def test_what_a_name_says(kind: str | None, names: str) -> None:
    assert {name: kind_of_torque([name]) for name in names.split(";")} == dict.fromkeys(names.split(";"), kind)


def test_read_guesses_from_the_name_and_obeys(here: Path) -> None:
    columns = {"velocity": "speed_act", "torque": "Actual current"}
    more = {"columns": columns, "torque_constant": 0.5}
    assert ga.read("current.csv", **more).torque_is == "measured"
    assert ga.read("current.csv", **more, torque_is="commanded").torque_is == "commanded"
    assert ga.read("current.csv", **more, decimate=2, resample=1e-3).torque_is == "measured"
    columns = {"velocity": "speed_act", "command": "speed_ref", "torque": "torque"}
    assert ga.read("step.csv", columns=columns).torque_is == "commanded"
    assert ga.read("step.csv", columns=columns, torque_is="measured").torque_is == "measured"
    with pytest.raises(ReadError, match="torque_is is 'real': it must be one of commanded, measured"):
        ga.read("step.csv", columns=columns, torque_is="real")
    del columns["torque"]
    with pytest.raises(ReadError, match=r"step.csv: torque_is='measured' speaks of the torque, but no such column is read; name"):
        ga.read("step.csv", columns=columns, torque_is="measured")


def test_a_torque_that_is_measured_is_said_to_be(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By the column's name in `columns`, `init` and the notes; the drive file and the option say otherwise."""
    assert main(["columns", "current.csv"]) == 0
    assert "measured torque" in capsys.readouterr().out.splitlines()[-1]
    assert main(["init", "current.csv"]) == 0
    assert "  torque   Actual current [A] (measured)\n" in capsys.readouterr().out
    assert read_drive_file("drive.toml")[""]["torque_is"] == "measured"
    Path("plain.toml").write_text("torque_constant = 1.0\n[columns]\ntorque = 'Actual current [A]'\nvelocity = 'speed_act'\n")

    def drive(*options: str) -> Drive:
        return drive_of(parser_of(dict.fromkeys(COMMANDS, print)).parse_args(["identify", "current.csv", *options]))

    assert drive("--drive", "plain.toml").read("current.csv").torque_is == "measured"
    assert drive("--drive", "plain.toml", "--torque-is", "commanded").read("current.csv").torque_is == "commanded"
    assert main(["identify", "current.csv", "--drive", "plain.toml"]) == 0
    assert "taken as measured, as the name of its column says" in " ".join(capsys.readouterr().out.split())
    assert main(["identify", "current.csv", "--drive", "plain.toml", "--torque-is", "measured"]) == 0
    assert "as the name of its column says" not in " ".join(capsys.readouterr().out.split())
    # From Python the same is said, once for all records that have it, and by name where not all do.
    columns = {"torque": "Actual current [A]", "velocity": "speed_act"}
    rec = ga.read("current.csv", columns, torque_constant=1.0)
    (note,) = [n for n in rec.notes if "taken as measured, as the name of its column says" in n]
    assert not [n for n in ga.read("current.csv", columns, torque_constant=1.0, torque_is="measured").notes if "taken as" in n]
    assert note in reading_notes([rec]) and note in reading_notes([rec, rec])
    assert f"{rec.name}: {note}" in reading_notes([rec, ga.Record(rec.dt, velocity=rec.velocity, torque=rec.torque)])
    assert "The force is taken as measured" in next(n for n in reading_notes([rec]) if n == note).linear
    # A torque that an option leaves out takes what was said of it along; without one there is nothing to be said.
    Path("said.toml").write_text(
        "torque_is = 'measured'\n[columns]\ncommand = 'speed_ref'\nvelocity = 'speed_act'\ntorque = 'torque'\n"
    )
    assert drive("--drive", "said.toml").read("step.csv").torque_is == "measured"
    assert drive("--drive", "said.toml", "--columns", "torque=").read("step.csv").torque_is == "commanded"
    call = ["identify", "step.csv", "--columns", "command=speed_ref,velocity=speed_act", "--torque-is", "measured", "--kp", "1"]
    assert main([*call, "--ki", "1"]) == 2
    assert "--torque-is 'measured' speaks of the torque" in capsys.readouterr().err
