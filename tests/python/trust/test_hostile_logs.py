"""Logs that a reader could read wrongly without a word: marks between thousands, lost rows, two runs in one file, a cut line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.data.formats import delimited

SPEEDS = np.linspace(0.0, 3000.0, 61)


def written(path: Path, rows: list[str], head: str = "time,command,velocity", end: str = "\n") -> Path:
    path.write_text("\n".join([head, *rows]) + end)
    return path


# ---- marks between thousands


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("mark", [",", "."])
@pytest.mark.parametrize("whole", [True, False], ids=["in memory", "in blocks"])
def test_whole_numbers_with_marked_thousands_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, delimiter: str, mark: str, whole: bool
) -> None:
    if not whole:
        monkeypatch.setattr(delimited, "WHOLE", 100)
    cells = [f'"{w:,.0f}"'.replace(",", mark) for w in SPEEDS]
    rows = [delimiter.join((str(i), cell, cell)) for i, cell in enumerate(cells)]
    log = written(tmp_path / "log.csv", rows, delimiter.join(("time", "command", "velocity")))
    with pytest.raises(ga.GaidentError, match=r"line 22: '1.000' may be a number with decimals or one with a mark"):
        ga.read(log)
    # Who knows that these are decimals says so.
    rec = ga.read(log, decimal=mark, delimiter=delimiter)
    assert rec.velocity[21] == 1.05


def test_all_marked_between_commas_is_refused_too(tmp_path: Path) -> None:
    rows = [f'{i},"{1000 + w:,.0f}","{1000 + w:,.0f}"' for i, w in enumerate(SPEEDS)]
    with pytest.raises(ga.GaidentError, match="a mark between its thousands"):
        ga.read(written(tmp_path / "log.csv", rows))


@pytest.mark.parametrize(
    "cells",
    [
        [f"{1 + i / 1000:.3f}" for i in range(61)],  # every number has three decimals
        [f"{1 + i / 8:g}" for i in range(61)],  # 1, 1.125, 1.25
        [f"{1000 * i + 0.125:g}" if i % 2 else "5" for i in range(61)],  # 1000.12: too long for a group
    ],
)
def test_decimals_are_read_as_before(tmp_path: Path, cells: list[str]) -> None:
    for decimal, delimiter in ((".", ","), (",", ";")):
        rows = [delimiter.join((str(i), c, c)).replace(".", decimal) for i, c in enumerate(cells)]
        log = written(tmp_path / "log.csv", rows, delimiter.join(("time", "command", "velocity")))
        np.testing.assert_array_equal(ga.read(log).velocity, [float(c) for c in cells])


# ---- rows that are lost, doubled, or of another run, where dt is given


def stamped(times: list[float], digits: int = 4) -> list[str]:
    return [f"{t:.{digits}f},{i % 7},{(i % 7) / 2}" for i, t in enumerate(times)]


EVEN = [i * 1e-3 for i in range(60)]


@pytest.mark.parametrize("digits", [3, 4, 6])
@pytest.mark.parametrize(
    ("times", "words"),
    [
        (EVEN[:30] + EVEN[31:], "line 32.*irregular"),
        (EVEN[:30] + EVEN[40:], "line 32.*irregular"),
        (EVEN[:30] + EVEN[29:], "line 32.*irregular"),
        (EVEN[:40] + EVEN[:40], "line 42.*does not increase"),
        (EVEN[:40] + [t + 1.0 for t in EVEN[:40]], "line 42.*irregular"),
    ],
    ids=["a row lost", "ten rows lost", "a row twice", "a second run", "a later run"],
)
def test_a_dt_does_not_hide_what_the_stamps_say(tmp_path: Path, times: list[float], words: str, digits: int) -> None:
    log = written(tmp_path / "log.csv", stamped(times, digits))
    with pytest.raises(ga.GaidentError, match=words):
        ga.read(log, dt=1e-3)
    # Who trusts dt and not the stamps says so.
    named: dict[str, Any] = {"command": "command", "velocity": "velocity", "time": None}
    assert len(ga.read(log, named, dt=1e-3)) == len(times)


def test_a_dt_overrules_jitter_and_coarse_stamps(tmp_path: Path) -> None:
    jitter = 6e-4 * (np.arange(60) % 4 == 3)
    assert len(ga.read(written(tmp_path / "a.csv", stamped(list(EVEN + jitter), 6)), dt=1e-3)) == 60
    coarse = [round(i * 2.5e-3, 2) for i in range(60)]
    assert len(ga.read(written(tmp_path / "b.csv", stamped(list(i * 1.005e-3 for i in range(400)), 3)), dt=1.005e-3)) == 400
    with pytest.raises(ga.GaidentError, match="dt"):  # such stamps do not even agree with dt on average
        ga.read(written(tmp_path / "c.csv", stamped(coarse, 2)), dt=2.5e-3)


# ---- a file that ends within a number


@pytest.mark.parametrize("whole", [True, False], ids=["in memory", "in blocks"])
@pytest.mark.parametrize("form", ["{:.4f}", "{:.5e}"])
def test_a_last_line_that_is_cut_within_a_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, form: str, whole: bool) -> None:
    if not whole:
        monkeypatch.setattr(delimited, "WHOLE", 100)
    rows = [f"{t:.3f},{form.format(np.sin(t))},{form.format(np.cos(t))}" for t in EVEN]
    log = written(tmp_path / "log.csv", rows, end="")
    assert len(ga.read(log)) == 60  # nothing is missing but the last line end
    text = log.read_text()
    for cut in range(1, 4):
        log.write_text(text[:-cut])
        with pytest.raises(ga.GaidentError, match=r"line 61.*(the file ends within a number|not a number)"):
            ga.read(log)
    log.write_text(text + "\n")
    assert ga.read(log).velocity[-1] == float(form.format(np.cos(EVEN[-1])))
