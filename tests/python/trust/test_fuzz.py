"""The short forms of `make fuzz` and of the oracle, and what the long forms found."""

from __future__ import annotations

import copy
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.data.formats import delimited
from gaident.show.diagnosis_summary import DRIVERS
from places import GOLDEN, PACKAGE, ROOT

FUZZ = ROOT / "tests" / "fuzz"


def ran(script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(FUZZ / script), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=600)


@pytest.mark.long
def test_damaged_files_are_read_or_refused() -> None:
    done = ran(
        "run.py",
        "--inputs",
        "300",
        "--workers",
        "1",
        "--forms",
        *("text", "MAT", "NPZ", "SINUMERIK", "saved", "response", "drive"),
    )
    assert done.returncode == 0 and "300 inputs of seed 1" in done.stdout and ": 0 flawed" in done.stdout, (
        done.stdout + done.stderr
    )


@pytest.mark.long
@pytest.mark.parametrize(("form", "module"), [("HDF5", "h5py"), ("Parquet", "pyarrow"), ("TDMS", "nptdms"), ("MDF", "asammdf")])
def test_damaged_files_of_other_libraries_are_read_or_refused(form: str, module: str) -> None:
    pytest.importorskip(module)
    done = ran("run.py", "--inputs", "6", "--workers", "1", "--forms", form)
    assert done.returncode == 0 and "6 inputs of seed 1" in done.stdout and ": 0 flawed" in done.stdout, done.stdout + done.stderr


def test_the_fuzzer_sees_what_is_wrong(tmp_path: Path) -> None:
    """A crash, an odd exception and a warning in the reader are each reported, and the file is kept."""
    (tmp_path / "sitecustomize.py").write_text(
        "import os, sys, warnings\n"
        "if '--worker' in sys.argv:\n"
        "    import gaident as ga\n"
        "    def wrong(path):\n"
        "        kind = os.path.getsize(path) % 3\n"
        "        if kind == 0: os.abort()\n"
        "        if kind == 1: raise KeyError('odd')\n"
        "        warnings.warn('leaks')\n"
        "    ga.read = wrong\n"
    )
    program = f"import sys; sys.path.insert(0, {str(FUZZ)!r}); import run; from pathlib import Path; "
    program += f"run.FLAWS = Path({str(tmp_path)!r}); sys.exit(run.main())"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    command = [sys.executable, "-c", program, "--inputs", "12", "--workers", "1", "--forms", "NPZ"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300)
    assert done.returncode == 1 and ": 12 flawed" in done.stdout, done.stdout + done.stderr
    assert {word for word in ("a crash", "KeyError", "UserWarning") if word in done.stdout} == {
        "a crash",
        "KeyError",
        "UserWarning",
    }
    assert len(list(tmp_path.glob("1-*"))) == 12


def test_tables_with_known_values_are_read_as_they_are_or_refused() -> None:
    done = ran("oracle.py", "--cases", "400", "--workers", "1")
    assert done.returncode == 0 and "400 cases of seed 1: 0 wrong" in done.stdout, done.stdout + done.stderr


# ---- found by the long forms


def test_a_pair_of_roots_without_one_of_its_numbers_is_refused() -> None:
    """It was loaded, and its summary failed with KeyError."""
    data = json.loads((GOLDEN / "saved_0_1" / "identification.json").read_text())
    pairs = [name for name in data["parameters"] if "_pair_" in name]
    assert pairs
    for name in pairs:
        other = copy.deepcopy(data)
        del other["parameters"][name]
        with pytest.raises(ga.GaidentError, match=f"parameters lacks {name}"):
            ga.Identification.from_dict(other)


def test_what_is_left_depends_on_a_signal_that_has_words(tmp_path: Path) -> None:
    """A saved diagnosis whose driver was another text was loaded, and its summary failed with KeyError."""
    schema = json.loads((PACKAGE / "results" / "results.schema.json").read_text())
    known = schema["$defs"]["diagnosis"]["properties"]["driver"]["anyOf"][0]["enum"]
    assert known == list(DRIVERS)
    data = json.loads((GOLDEN / "saved_0_1" / "diagnosis.json").read_text())
    path = tmp_path / "dia.json"
    path.write_text(json.dumps(data | {"driver": known[0]}))
    assert ga.load(path).summary()
    path.write_text(json.dumps(data | {"driver": "nan"}))
    with pytest.raises(ga.GaidentError, match="driver is 'nan', which is none of 'velocity'"):
        ga.load(path)


def test_a_negative_standard_deviation_is_refused(tmp_path: Path) -> None:
    """It was loaded, and the summary took its logarithm."""
    data = json.loads((GOLDEN / "saved_0_1" / "identification.json").read_text())
    path = tmp_path / "idn.json"
    for std in (-1.0, {"number": "-inf"}):
        data["parameters"]["gain"]["std"] = std
        path.write_text(json.dumps(data))
        with pytest.raises(ga.GaidentError, match=r"parameters\.gain\.std"):
            ga.load(path)


def test_a_cause_that_takes_away_more_than_all_is_refused(tmp_path: Path) -> None:
    """A gain of 1e308 was loaded, and the summary rounded its per cent, which are infinite."""
    data = json.loads((GOLDEN / "saved_0_1" / "diagnosis.json").read_text())
    assert data["findings"][0]["gain"] <= 1.0
    path = tmp_path / "dia.json"
    for gain in (1.5, 1e308, {"number": "inf"}):
        data["findings"][0]["gain"] = gain
        path.write_text(json.dumps(data))
        with pytest.raises(ga.GaidentError, match=r"findings\.0\.gain"):
            ga.load(path)


@pytest.mark.parametrize("encoding", ["uJf-8", "gb2312", "utf-7", "idna"])
def test_an_xml_of_an_unknown_encoding_is_refused(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "trace.xml"
    path.write_text(f'<?xml version="1.0" encoding="{encoding}" ?>\n<traceSession version="01.00"></traceSession>\n')
    with pytest.raises(ga.GaidentError, match=r"trace\.xml"):
        ga.read(path)


def test_a_word_between_decimal_commas_and_blanks(tmp_path: Path) -> None:
    """Of as many numbers and words when it is cut at its commas: it was cut there, and gave 30 and 0000."""
    for form in ("{:.3f}", "{:.5e}"):
        rows = [f"{form.format(10 + k / 8)} {('on', 'off')[k % 2]} {k / 10:.4f}".replace(".", ",") for k in range(40)]
        (tmp_path / "log.dat").write_text("velocity state torque\n" + "\n".join(rows) + "\n")
        rec = ga.read(tmp_path / "log.dat", dt=1e-3)
        np.testing.assert_allclose(rec.velocity, 10 + np.arange(40) / 8, rtol=1e-5)


@pytest.mark.parametrize("whole", [True, False], ids=["in memory", "in blocks"])
def test_a_last_line_that_ends_at_the_decimal_mark(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: bool) -> None:
    monkeypatch.setattr(delimited, "WHOLE", 1 << 25 if whole else 0)
    monkeypatch.setattr(delimited, "ROWS", 13)  # 39 rows fill three blocks, the last row stands alone
    rows = [f"{k};{(k + 1) / 8:.9E}".replace(".", ",") for k in range(40)]
    path = tmp_path / "log.csv"
    for cut in (rows[-1][:-13], rows[-1][:-5]):
        path.write_text("torque;velocity\n" + "\n".join([*rows[:-1], cut]))
        with pytest.raises(ga.GaidentError, match="line 41: the file ends within a number"):
            ga.read(path, dt=1e-3)


def test_commas_between_quotation_marks_have_one_meaning(tmp_path: Path) -> None:
    """A title of one cell above two columns was taken for one name of two."""
    path = tmp_path / "log.csv"
    path.write_text("Log of a drive\n" + "\n".join(f'"{-k}","{k}"' for k in range(40)) + "\n")
    assert ga.read(path, {"velocity": "#0", "torque": "#1"}, dt=1e-3).velocity[-1] == -39.0
    path.write_text(path.read_text().replace('"', ""))
    with pytest.raises(ga.GaidentError, match="commas stand between the columns and, it seems, inside the numbers too"):
        ga.read(path, {"velocity": "#0", "torque": "#1"}, dt=1e-3)


def test_a_last_line_whose_quotation_mark_is_missing(tmp_path: Path) -> None:
    rows = [f'"{k}","{k / 7!r}"' for k in range(40)]
    path = tmp_path / "log.csv"
    for cut in range(1, 6):
        path.write_text('"torque","velocity"\n' + "\n".join(rows)[:-cut])
        with pytest.raises(ga.GaidentError, match="line 41: the file ends within a number"):
            ga.read(path, dt=1e-3)


@pytest.mark.parametrize("whole", [True, False], ids=["in memory", "in blocks"])
def test_a_last_number_that_may_be_cut_is_noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: bool) -> None:
    monkeypatch.setattr(delimited, "WHOLE", 1 << 25 if whole else 0)
    path = tmp_path / "log.csv"
    text = "torque,velocity\n" + "\n".join(f"{k / 8},{1000 + k}" for k in range(40))
    for cut, noted in ((text[:-1], True), (text, False), (text[:-1] + "\n", False)):
        path.write_text(cut)
        assert any("may be cut" in str(note) for note in ga.read(path, dt=1e-3).notes) == noted
    path.write_text(text[:-1])
    named = {"velocity": "torque", "torque": "torque"}
    assert not ga.read(path, named, dt=1e-3).notes  # of a column that is not read


def test_seconds_since_1970_have_the_sample_time_of_few_digits(tmp_path: Path) -> None:
    """A double tells them to 0.2 us; the sample time was 0.999998 ms."""
    path = tmp_path / "log.csv"
    path.write_text("time,torque,velocity\n" + "".join(f"{1772359872 + k * 1e-3:.4f},{k},{k}\n" for k in range(75)))
    assert ga.read(path).dt == 1e-3


@pytest.mark.long
def test_the_tables_end_when_their_time_is_over() -> None:
    done = ran("oracle.py", "--cases", "1000000", "--minutes", "0.02", "--workers", "1")
    said = done.stdout.splitlines()[-1]
    assert done.returncode == 0 and said.endswith("cases of seed 1: 0 wrong"), done.stdout + done.stderr
    assert 200 <= int(said.split()[0]) < 100_000


@pytest.mark.long
@pytest.mark.parametrize("script", ["run.py", "oracle.py"])
def test_nothing_tried_is_no_success(script: str) -> None:
    assert ran(script, "--cases" if script == "oracle.py" else "--inputs", "0", "--workers", "1").returncode == 1


def test_ci_runs_them() -> None:
    ci = ROOT / ".ci" / "run"
    if not ci.exists():
        pytest.skip("no CI here")
    assert "set -e" in ci.read_text() and "\nmake fuzz " in ci.read_text()
