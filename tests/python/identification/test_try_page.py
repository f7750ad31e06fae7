"""The page that identifies in a browser, opened as a file: its numbers are those of `identify`, its errors are sentences."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from browser import Browser
from places import ROOT

TOOLS = ROOT / "docs" / "tools"
DONE = "Boolean(window.gaidentResult)"
MESSAGE = "document.getElementById('message').textContent"
WRONG = "document.getElementById('message').className === 'wrong'"
DROPPED = """(text => {{
    const data = new DataTransfer();
    data.items.add(new File([text], "log.csv", {{ type: "text/csv" }}));
    document.body.dispatchEvent(new DragEvent("drop", {{ dataTransfer: data, bubbles: true }}));
}})({})"""
PATIENCE = 120.0  # s for an identification in a browser

pytestmark = [pytest.mark.long, pytest.mark.alone]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if shutil.which("em++") is None:
        pytest.skip("no emscripten on the path, which builds the core of the page; on Debian: apt install emscripten")
    folder = ROOT / "build" / "wasm" if os.access(ROOT, os.W_OK) else tmp_path_factory.mktemp("wasm")
    make = ["make", "--silent", "-f", "csrc/wasm/wasm.mk", "core", f"OUT={folder}"]
    subprocess.run(make, cwd=ROOT, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    written = tmp_path_factory.mktemp("try") / "index.html"
    subprocess.run([sys.executable, TOOLS / "try_page.py", folder / "core.js", written], check=True)
    return written


@pytest.fixture
def browser(page: Path) -> Iterator[Browser]:
    program = Browser.path()
    if program is None:
        pytest.skip("no Chromium on the path; name one in GAIDENT_CHROMIUM")
    shown = Browser(program)
    shown.size(1280, 900)
    shown.open(page)
    yield shown
    shown.close()


def result(browser: Browser) -> dict[str, object]:
    browser.wait(f"{DONE} || {WRONG}", PATIENCE)
    assert browser.run(DONE), browser.run(MESSAGE)
    found: dict[str, object] = browser.run("window.gaidentResult")
    return found


def drop(browser: Browser, text: str) -> None:
    browser.run("window.gaidentResult = null")
    browser.run(DROPPED.format(json.dumps(text)))


def equals(found: dict[str, object], idn: ga.Identification) -> None:
    """The page's result is the identification's, to what other last digits of exp and log make of an optimum."""
    mechanics = found["mechanics"]
    assert isinstance(mechanics, dict) and idn.mechanics is not None
    assert (found["p"], found["q"]) == (idn.p, idn.q)
    for name in ("J", "D") if idn.q == 0 else ("JM", "DM", "JL", "DL", "KG"):
        assert mechanics[name] == pytest.approx(getattr(idn.mechanics, name), rel=1e-5), name
        assert mechanics["std"][name] == pytest.approx(idn.mechanics.std[name], rel=1e-4), name
    assert found["rmse"] == pytest.approx(idn.rmse, rel=1e-8)
    assert found["fitPercent"] == pytest.approx(idn.fit_percent, rel=1e-8)
    adequacy = found["adequacy"]
    assert isinstance(adequacy, dict) and adequacy["falsified"] == idn.falsified
    assert adequacy["independenceP"] == pytest.approx(idn.adequacy.independence_p, rel=1e-3)
    structures = found["structures"]
    assert isinstance(structures, list) and {(s["p"], s["q"]) for s in structures} == {(s.p, s.q) for s in idn.structures}


def test_the_example_is_found_without_a_network(browser: Browser, page: Path, tmp_path: Path) -> None:
    browser.run("document.getElementById('example').click()")
    found = result(browser)
    true = browser.run("EXAMPLE.mechanics")
    for name, value in true.items():
        mechanics = found["mechanics"]
        assert isinstance(mechanics, dict)
        assert abs(mechanics[name] - value) < 5.0 * mechanics["std"][name], name
    time, _, torque, velocity = browser.run("table.columns")
    equals(found, ga.identify(ga.Record(time[1] - time[0], torque=torque, velocity=velocity)))
    assert browser.run("document.querySelectorAll('#charts polyline').length") == 3
    assert browser.errors == []
    assert [url for url in browser.requests if not url.startswith("blob:")] == [page.as_uri()]
    assert "diagnosis" in browser.run("document.body.textContent")
    # Closed over its controller, from the same columns.
    browser.run("window.gaidentResult = null; document.getElementById('loop').value = 'sampled'; changed()")
    browser.run("document.getElementById('run').click()")
    gains = browser.run("EXAMPLE.controller")
    command = browser.run("table.columns[1]")
    rec = ga.Record(time[1] - time[0], command=command, torque=torque, velocity=velocity)
    equals(result(browser), ga.identify(rec, ga.PI(**gains)))
    browser.downloads_to(tmp_path)
    browser.run("document.getElementById('download').click()")
    for _ in range(200):
        if (tmp_path / "identification.json").exists():
            break
        browser.run("new Promise(done => setTimeout(done, 20))")
    assert json.loads((tmp_path / "identification.json").read_text())["loop"] == "sampled"


def test_a_dropped_file_in_other_units(browser: Browser) -> None:
    rng = np.random.default_rng(4)
    torque = np.repeat(rng.choice([-1.0, 0.6, 1.0], 20), 40)
    still = ga.Record(2e-3, torque=torque, velocity=0.0 * torque)
    clean = ga.simulate(ga.OneMass(J=0.01, D=0.05), still)
    rpm = np.round((clean + 0.02 * rng.standard_normal(len(clean))) * 30.0 / np.pi, 3)
    lines = [f"{2 * i};{t:g};{w:.3f}".replace(".", ",") for i, (t, w) in enumerate(zip(torque, rpm, strict=True))]
    drop(browser, "time [ms];torque [Nm];speed [rpm]\n" + "\n".join(lines))
    browser.wait("!document.getElementById('columns').hidden")
    assert browser.run("['time', 'velocity', 'torque'].map(k => document.getElementById(k + '-unit').value)") == [
        "ms",
        "rpm",
        "N m",
    ]
    browser.run("document.getElementById('run').click()")
    equals(result(browser), ga.identify(ga.Record(2e-3, torque=torque, velocity=rpm * np.pi / 30.0)))


def test_errors_are_sentences(browser: Browser) -> None:
    rows = [f"{1e-3 * i:.4f},{i % 7},{0.1 * i:.2f}" for i in range(60)]
    header = "time,torque,velocity\n"

    def refused(text: str, click: bool = True) -> str:
        drop(browser, text)
        if click:
            browser.wait("!document.getElementById('run').disabled")
            browser.run("document.getElementById('run').click()")
        browser.wait(WRONG, PATIENCE)
        said: str = browser.run(MESSAGE)
        return said

    assert "holds numbers only" in refused("no,numbers\nat,all\n", click=False)
    assert "Line 6 has 2 columns" in refused(header + "\n".join([*rows[:4], "1,2", *rows[4:]]), click=False)
    assert "at least 20" in refused(header + "\n".join(rows[:10]))
    assert "not evenly spaced" in refused(header + "\n".join(rows[:20] + rows[40:]))
    assert re.search(
        r'Line 12, column "torque".*no number', refused(header + "\n".join([*rows[:10], "0.0100,,1.00", *rows[11:]]))
    )
    assert "velocity is constant" in refused(header + "\n".join(f"{1e-3 * i:.4f},{i % 7},2" for i in range(60)))
    browser.run("document.getElementById('torque-column').value = '-1'; document.getElementById('run').click()")
    assert "Choose the column of the torque" in browser.run(MESSAGE)


def test_it_can_be_cancelled_and_fits_a_phone(browser: Browser) -> None:
    browser.size(400, 800, phone=True)
    browser.run("document.getElementById('example').click()")
    browser.wait("document.getElementById('message').textContent.startsWith('Generation')", PATIENCE)
    browser.run("document.getElementById('cancel').click()")
    assert browser.run(MESSAGE) == "Cancelled." and browser.run("worker === null && document.getElementById('cancel').hidden")
    browser.run("document.getElementById('run').click()")
    result(browser)
    assert browser.run("document.documentElement.scrollWidth") <= 400
