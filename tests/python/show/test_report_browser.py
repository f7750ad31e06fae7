"""The report in a real browser: no errors, nothing fetched, figures with data, zoom, download, phone, dark, print."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import gaident as ga
from browser import Browser
from gaident.show.report.command import proposal_csv
from report_cases import diagnosed, hostile

READY = "window.gaidentReady"
RANGE = "document.querySelector('[data-chart=\"{}\"]').layout.xaxis.range"
COLOUR = "getComputedStyle(document.body).backgroundColor"


@pytest.fixture(scope="module")
def result() -> ga.Diagnosis:
    """With everything that a page can show, and hostile names."""
    return hostile(diagnosed())


@pytest.fixture(scope="module")
def page(result: ga.Diagnosis, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    ga.report(result, path)
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    program = Browser.path()
    if program is None:
        pytest.skip("no Chromium on the path; name one in GAIDENT_CHROMIUM")
    shown = Browser(program)
    yield shown
    shown.close()


def test_a_browser_that_does_not_answer_leaves_no_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mute = tmp_path / "mute"
    mute.write_text("#!/bin/sh\nexec sleep 60\n")
    mute.chmod(0o755)
    monkeypatch.setattr("browser.PATIENCE", 0.1)
    spawn, begun = os.posix_spawn, []
    monkeypatch.setattr(os, "posix_spawn", lambda *args, **more: begun.append(spawn(*args, **more)) or begun[0])
    with pytest.raises(AssertionError, match="does not answer"):
        Browser(str(mute))
    with pytest.raises(ProcessLookupError):
        os.kill(begun[0], 0)


@pytest.mark.long
def test_it_draws_zooms_and_downloads_without_errors_and_without_a_network(
    browser: Browser, page: Path, result: ga.Diagnosis
) -> None:
    browser.prefers("light")
    browser.size(1280, 900)
    browser.open(page)
    assert browser.run(READY) is True
    assert browser.errors == []
    assert [url for url in browser.requests if not re.match(r"data:image/|blob:", url)] == [page.as_uri()]
    assert browser.run("window.hacked") is None and browser.run("document.querySelectorAll('[onerror]').length") == 0
    assert "window.hacked=1" in browser.run("document.querySelector('h1').textContent")

    figures = "[...document.querySelectorAll('figure')]"
    drawn = browser.run(
        figures + ".map(f => { const g = f.querySelector('.live'); return [f.classList.contains('drawn'), g.clientWidth, "
        "g._fullData.filter(t => t.y.length > 1).length, g.querySelectorAll('path').length]; })"
    )
    assert len(drawn) == 14 and all(ok and width > 900 and data > 0 and paths > 2 for ok, width, data, paths in drawn), drawn
    assert not any(browser.run(figures + ".map(f => f.querySelector('.still').offsetHeight)"))

    # A drag over the first chart narrows it and the missing torque further down, and nothing else.
    before = browser.run(RANGE.format("run-0"))
    browser.run("document.getElementById('figure-run-0').scrollIntoView()")
    box = browser.run(
        "(r => [r.x, r.y, r.width, r.height])(document.querySelector('[data-chart=\"run-0\"] .nsewdrag').getBoundingClientRect())"
    )
    x, y, width, height = box
    browser.drag(x + 0.25 * width, y + 0.5 * height, x + 0.5 * width, y + 0.5 * height)
    browser.wait(f"{RANGE.format('missing-time')}[1] < {0.6 * before[1]}")
    low, high = browser.run(RANGE.format("run-0"))
    assert 0.15 * before[1] < low < 0.35 * before[1] and 0.4 * before[1] < high < 0.6 * before[1]
    assert browser.run(RANGE.format("missing-time")) == pytest.approx([low, high])
    assert browser.run(RANGE.format("run-1")) == before
    browser.run(
        "Plotly.relayout(document.querySelector('[data-chart=\"missing-time\"]'), {'xaxis.autorange': true}).then(() => 0)"
    )
    browser.wait(f"{RANGE.format('run-0')}[1] > {0.9 * before[1]}")

    browser.downloads_to(page.parent)
    browser.run("document.querySelector('a[download]').click()")
    target = page.parent / "next_experiment.csv"
    for _ in range(200):
        if target.exists() and target.stat().st_size:
            break
        browser.run("new Promise(done => setTimeout(done, 25))")
    assert target.read_text() == proposal_csv(result.next_experiment)
    assert browser.errors == []


@pytest.mark.long
def test_a_phone_in_the_dark_and_a_printer(browser: Browser, page: Path) -> None:
    browser.size(390, 844, phone=True)
    browser.prefers("dark")
    browser.open(page)
    assert browser.run(READY) is True and browser.errors == []
    assert browser.run("document.documentElement.scrollWidth") == 390  # nothing sticks out
    assert browser.run(COLOUR) == "rgb(26, 30, 36)"
    line = "document.querySelector('[data-chart=\"run-0\"]')._fullData.map(t => t.line.color)"
    assert "#ffffff" in browser.run(line)
    browser.run("document.querySelector('[data-set=light]').click()")
    browser.wait(f"!{line}.includes('#ffffff')")
    assert browser.run(COLOUR) == "rgb(255, 255, 255)"
    assert browser.run("[...document.querySelectorAll('.switch button')].map(b => b.ariaPressed)") == ["false", "true", "false"]

    assert browser.pdf().startswith(b"%PDF")
    browser.ask("Emulation.setEmulatedMedia", media="print")
    sizes = browser.run(
        "[...document.querySelectorAll('figure')].map(f => [f.querySelector('.live').offsetHeight, "
        "f.querySelector('.still').offsetHeight, f.querySelector('.still').naturalWidth])"
    )
    assert all(live == 0 and still > 50 and wide > 900 for live, still, wide in sizes), sizes
    browser.ask("Emulation.setEmulatedMedia", media="")


def test_without_scripts_the_pictures_are_there(browser: Browser, page: Path) -> None:
    browser.ask("Emulation.setScriptExecutionDisabled", value=True)
    browser.open(page)
    shown = browser.run("[...document.querySelectorAll('figure')].map(f => f.querySelector('.still').offsetHeight)")
    browser.ask("Emulation.setScriptExecutionDisabled", value=False)
    assert len(shown) == 14 and min(shown) > 50
