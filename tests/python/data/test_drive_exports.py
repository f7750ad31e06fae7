"""Traces as EPOS Studio and SINUMERIK Operate export them, written here by formula in their layouts, and EPOS Studio's own."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.cli import main
from gaident.data import read_columns
from gaident.errors import ReadError
from samples.dialects import sample_log

REC = sample_log()
RPM = 60 / (2 * np.pi)
assert REC.command is not None and REC.torque is not None

EPOS_HEAD = '''Date:;2024-01-02 03:04:05\r
Firmware Version:;0x0120;0x6150;0x0000;0x0000\r
Recorded samples:;40\r
Sampling period:;0.500\r
Scale:;0;True;100.000;0.500;-400.500;399.500\r
"Trigger:;0;0.000000;""Parameter values"";""Channel 1"";""Rising above value"""\r
;Velocity actual value averaged;Torque actual value averaged\r
ms;rpm;%\r
'''


def epos_log(path: Path) -> Path:
    rows = zip(0.5 * np.arange(40), REC.velocity * RPM, 100 * np.asarray(REC.torque), strict=True)
    body = "".join(f"{t:.3f};{n:.4f};{m:.4f}\r\n" for t, n, m in rows)
    path.write_text(EPOS_HEAD + body, newline="")
    return path


def test_epos_studio_names_no_time_but_its_unit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    log = epos_log(Path("epos.csv"))
    assert list(read_columns(log)) == ["Time", "Velocity actual value averaged", "Torque actual value averaged"]
    rec = ga.read(
        log,
        columns={"velocity": "Velocity actual value averaged", "torque": "Torque actual value averaged"},
        rated_torque=1.0,
    )
    assert rec.dt == REC.dt and rec.torque_is == "measured"
    np.testing.assert_allclose(rec.velocity, REC.velocity, atol=1e-4)
    np.testing.assert_allclose(rec.torque, REC.torque, atol=1e-5)
    assert main(["init", "epos.csv"]) == 0
    draft = Path("drive.toml").read_text()
    assert "# dt = 0.0005" in draft and 'velocity = "rpm"' in draft and "# rated_torque = 2.4      # FILL IN" in draft


def test_epos_studios_own_exports(data_dir: Path) -> None:
    """114 files, their sampling period in the head."""
    logs = sorted((data_dir / "epos_screws").rglob("*.csv"))
    assert len(logs) == 114
    for log in logs[::10]:
        columns = ga.columns(log).columns
        assert [c.unit for c in columns] == ["ms", "rpm", "%"] and columns[0].is_time
        period = next(line for line in log.read_text().splitlines() if line.startswith("Sampling period:;"))
        assert columns[1].sample_time == pytest.approx(1e-3 * float(period.split(";")[1].rstrip(",")), rel=1e-14)


@pytest.mark.parametrize("period", ["0.04", "40", "0.125", "12.8", "37.6"])
def test_a_period_that_stamps_in_single_precision_were_rounded_from_is_the_exact_one(period: str, tmp_path: Path) -> None:
    """ms; the stamps are printed with three decimals more than the period has, and cut off."""
    stamps = np.nextafter(np.float32(float(period) * np.arange(500)), np.float32(0.0)).astype(float)
    decimals = len(period.partition(".")[2]) + 3
    cut = np.floor(stamps * 10**decimals) / 10**decimals
    rows = (f"{t:.{decimals}f};{0.1 * k:.3f}" for k, t in enumerate(cut))
    (tmp_path / "log.csv").write_text("Time [ms];w [rad/s]\n" + "\n".join(rows) + "\n")
    assert ga.columns(tmp_path / "log.csv").columns[1].sample_time == pytest.approx(1e-3 * float(period), rel=1e-14)


def test_a_period_of_many_digits_stays_the_mean(tmp_path: Path) -> None:
    """1500 Hz: 0.666667 ms is no period of few digits."""
    rows = (f"{k / 1.5:.6f};{0.1 * k:.3f}" for k in range(300))
    (tmp_path / "log.csv").write_text("Time [ms];w [rad/s]\n" + "\n".join(rows) + "\n")
    assert ga.columns(tmp_path / "log.csv").columns[1].sample_time == pytest.approx(1e-3 / 1.5, rel=1e-8)


# Of ten signals that a trace may hold, four: three at 0.5 ms, written where they change, one at 1 ms, from the second record on.
SIGNALS = (
    ("f1", "/Nck/!SD/nckServoDataCmdVelCtrlIn64 [u1, 7]", "Velocity setpoint controller input (64 bit)", 0.5e-3, "velo"),
    ("f2", "/Nck/!SD/nckServoDataActVelMot32 [u1, 7]", "Speed / velocity act. Value motor (32 bit)", 0.5e-3, "velo"),
    ("f3", "/Nck/!SD/nckServoDataActCurr32 [u1, 7]", "Torque-prod. Current act. Val. i(q) (32 bit)", 0.5e-3, "current"),
    ("f4", "/Nck/!SEMA/measPos1 [u1, 7]", "Actual position value for measuring system 1.", 1e-3, "posn"),
)


def sinumerik_log(path: Path, *, drop_outs: int = 0, frames: int = 1, root: str = "traceSession") -> Path:
    assert REC.command is not None and REC.torque is not None
    values = {"f1": REC.command * RPM, "f2": REC.velocity * RPM, "f3": 2.0 * REC.torque}
    last: dict[str, str] = {}
    records = []
    for k in range(len(REC)):
        now = {key: f"{x[k]:.6f}" for key, x in values.items()} | ({"f4": f"{k / 2:.6f}"} if k % 2 else {})
        changed = {key: text for key, text in now.items() if last.get(key) != text}
        last.update(changed)
        if changed:
            written = " ".join(f'{key}="{text}"' for key, text in changed.items())
            records.append(f'  <rec time="{k * REC.dt:.6f}" {written}/>')
    counts = {"f4": len(REC) // 2}
    signals = [
        f'  <dataSignal domain="NCU_1" interval="{interval:.6f}" id="{key}" description="{told}" '
        f'datapointCount="{counts.get(key, len(REC))}" name="{name}" unitsType="{unit}" dataType="double"/>'
        for key, name, told, interval, unit in SIGNALS
    ]
    header = f'  <frameHeader dropOuts="{drop_outs}" startTime="2024-01-02T03:04:05.000Z" stopInc="0.0195"/>'
    frame = "\n".join([" <dataFrame>", header, *signals, *records, " </dataFrame>"])
    text = "\n".join([f'<traceData dataFrames="{frames}">', *[frame] * frames, "</traceData>"])
    path.write_text(f'<?xml version="1.0" encoding="utf-8" ?>\n<{root} version="01.00">\n{text}\n</{root}>\n')
    return path


def test_a_sinumerik_trace_holds_a_value_until_it_changes(tmp_path: Path) -> None:
    log = sinumerik_log(tmp_path / "trace.xml")
    assert log.read_text().count("<rec ") < len(REC)  # four samples of the step's foot say nothing new
    listing = ga.columns(log)
    assert listing.form == "SINUMERIK trace"
    assert {c.name: (c.unit, c.samples, c.sample_time) for c in listing.columns if not c.is_time} == {
        SIGNALS[0][1]: (None, 40, 0.5e-3),
        SIGNALS[1][1]: (None, 40, 0.5e-3),
        SIGNALS[2][1]: ("A", 40, 0.5e-3),
        SIGNALS[3][1]: (None, 20, 1e-3),
    }
    units: dict[str, str | float] = {"command": "rpm", "velocity": "1/min"}
    columns: dict[str, str | int | None] = {"command": "f1", "velocity": SIGNALS[1][2], "torque": SIGNALS[2][1]}
    rec = ga.read(log, columns=columns, units=units, torque_constant=0.5)
    assert rec.dt == REC.dt and rec.torque_is == "measured"
    for name, values in rec.channels():
        np.testing.assert_allclose(values, getattr(REC, name), atol=1e-6, err_msg=name)


def test_a_slower_signal_of_a_sinumerik_trace_has_a_time_of_its_own(tmp_path: Path) -> None:
    log = sinumerik_log(tmp_path / "trace.xml")
    columns: dict[str, str | int | None] = {"position": "f4", "torque": "f3"}
    with pytest.raises(ReadError, match=r"time columns of their own.*resample="):
        ga.read(log, columns=columns, units={"position": "deg"}, torque_constant=0.5)
    rec = ga.read(log, columns=columns, units={"position": "deg"}, torque_constant=0.5, resample=0.5e-3)
    assert rec.position is not None
    np.testing.assert_allclose(np.diff(rec.position), np.deg2rad(0.5), rtol=1e-6)


def test_init_asks_what_a_sinumerik_trace_does_not_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Units of speed stand in no such file: 1/min for a rotary axis, others for a linear one."""
    monkeypatch.chdir(tmp_path)
    sinumerik_log(Path("trace.xml"))
    assert main(["init", "trace.xml", "--json"]) == 0
    draft = Path("drive.toml").read_text()
    for channel in ("command", "velocity", "position"):
        assert any(line.startswith(f"# {channel} =") and "FILL IN" in line for line in draft.splitlines()), channel
    assert f'velocity = "{SIGNALS[1][1]}"' in draft and 'torque = "A"' in draft


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"drop_outs": 3}, r"3 points of the trace were lost"),
        ({"frames": 2}, r"contains several recordings"),
        ({"root": "configuration"}, r"contains <configuration>, no trace of SINUMERIK"),
    ],
)
def test_another_xml_file_is_refused(tmp_path: Path, more: dict[str, object], words: str) -> None:
    with pytest.raises(ReadError, match=words):
        ga.columns(sinumerik_log(tmp_path / "trace.xml", **more))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('interval="0.000500" id="f1"', 'interval="0" id="f1"', "has the interval 0 s"),
        ('<rec time="0.0', '<rec time="zero', "the time of a record is 'zero"),
        ("</traceData>", "", "not a whole XML file"),
        ("<rec ", "<record ", "contains no records"),
    ],
)
def test_a_damaged_trace_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    log = sinumerik_log(tmp_path / "trace.xml")
    log.write_text(log.read_text().replace(old, new))
    with pytest.raises(ReadError, match=words):
        ga.columns(log)


def test_a_trace_of_text_options(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match="is for text tables"):
        ga.columns(sinumerik_log(tmp_path / "trace.xml"), skip=3)


@pytest.mark.parametrize(
    "name", ["t/ms", "Zeit/ms", "time_ms", "Timestamp ms", "t,ms", "Zeit in ms", "ms", "millis", "Temps [ms]"]
)
def test_milliseconds_in_the_name_of_the_time(tmp_path: Path, name: str) -> None:
    log = tmp_path / "log.csv"
    log.write_text(f"{name};w;u\n" + "".join(f"{k};{np.sin(k):.5f};{np.cos(k):.5f}\n" for k in range(40)))
    rec = ga.read(log, columns={"velocity": "w", "torque": "u"})
    assert rec.dt == 1e-3 and rec.notes == ()
    if ";" not in name:
        np.savez(tmp_path / "log.npz", **{name: np.arange(40), "velocity": rec.velocity, "torque": rec.torque})
        assert ga.read(tmp_path / "log.npz").dt == 1e-3


def test_long_steps_without_a_unit_are_said_and_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    rows = "".join(f"{k};{np.sin(k):.5f};{np.cos(k):.5f}\n" for k in range(40))
    Path("log.csv").write_text("Zeit;w [rad/s];u [Nm]\n" + rows)
    rec = ga.read("log.csv", columns={"velocity": "w [rad/s]", "torque": "u [Nm]"})
    assert rec.dt == 1.0 and "says no unit, and s was taken: a sample time of 1 s" in rec.notes[0]
    columns = {"velocity": "w", "torque": "u"}
    (held,) = ga.read("log.csv", columns=columns, units={"time": "s"}).notes
    assert held.startswith("The torque counts as commanded, held for 1000 ms from each line on, and few drives hold it that long")
    for kind in ("measured", "commanded"):
        assert ga.read("log.csv", columns=columns, units={"time": "s"}, torque_is=kind).notes == ()
    assert main(["init", "log.csv", "--json"]) == 0
    assert any("its lines would be 1 s apart" in line for line in json.loads(capsys.readouterr().out)["fill_in"])
    assert main(["identify", "log.csv", "--drive", "drive.toml", "--loop", "open"]) == 2
    assert "time of [units], marked FILL IN" in capsys.readouterr().err
