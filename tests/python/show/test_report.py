"""The report as a text: what it contains, that nothing from a file gets out of its place, what is said where data are missing."""

from __future__ import annotations

import base64
import html
import io
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from friction_drive import CONTROLLER, drive_record
from gaident.cli import main
from gaident.cli.output import csv_text
from gaident.errors import GaidentError, SettingsError
from gaident.reporting.report import report_page, view_of
from gaident.results.what_if import Stability, Variation
from gaident.show.chart import BINS, PALETTES, Band, Chart, Mark, Panel, Trace, cloud, series
from gaident.show.diagnosis_charts import residual_spectrum
from gaident.show.draw import picture
from gaident.show.html import Html, tag, typeset
from gaident.show.report import parts
from gaident.show.report.charts import held_out_chart, run_chart
from gaident.show.report.command import proposal_csv
from gaident.show.report.live import figure, json_of
from gaident.show.report.packing import packed
from page import Reader, charts_of, text_of, unpacked
from report_cases import HOSTILE, ambiguous, diagnosed, hostile, retuned_once

CHAPTERS = ["measured", "wrong", "cause", "parameters", "gain", "remedies", "untested", "next", "how"]


@pytest.fixture(scope="module")
def dia() -> ga.Diagnosis:
    return diagnosed()


@pytest.fixture
def fast(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the pictures for print, which take most of the time, and with a short name for plotly.js."""
    monkeypatch.setattr(parts, "picture", lambda chart: b"png of " + chart.key.encode())
    monkeypatch.setattr("plotly.offline.get_plotlyjs", lambda: "plotly()")
    retuned_once(monkeypatch)


def test_a_diagnosis_reads_from_verdict_to_how_it_was_computed(dia: ga.Diagnosis, fast: None) -> None:
    page = report_page(ambiguous(dia))
    seen = Reader(page)
    assert [a["id"] for a in seen.found("section")] == ["verdict", *CHAPTERS]
    for words in (
        "The model lacks one of coulomb friction, load torque or stribeck friction, which these data do not tell apart; with it "
        "nothing significant is left.",
        "What “cannot be told apart” means.",
        "Chance of such a finding where there is no effect at all (bootstrap): at most 0.01.",
        "inertia", "kg m", "Free-run simulation on validation records.", "the torque never changes its sign",
        "It tells coulomb friction from load torque, beyond doubt (64 BIC units, 10 are enough).",
        "sampled PI, kp 0.05 N m s/rad", f"{dia.simulations} simulations", "plotly ", *dia.digests, *dia.validation_digests,
    ):  # fmt: skip
        assert words in seen.text, words
    charts = charts_of(page)["charts"]
    wanted = {"run-0", "run-1", "missing-velocity", "missing-reversals", "missing-orders", "missing-place", "missing-time"}
    wanted |= {"residual-frequency", "response", "held-out-record", "loop", "loop-step", "following-error", "next-command"}
    assert set(charts) == wanted
    assert charts["missing-time"]["link"] == charts["run-0"]["link"] == "run-0"
    titles = [charts["run-0"]["layout"][f"yaxis{n}"]["title"]["text"] for n in ("", "2", "3")]
    assert titles == ["velocity [rad/s]", "error [rad/s]", "torque [N m]"]
    label = [t["name"] for t in charts["missing-velocity"]["data"] if t["showlegend"]]
    assert label == ["accelerating", "decelerating", "mean ± sd", "coulomb friction (not told apart from others)"]
    stills = [a for a in seen.found("img") if a.get("class") == "still"]
    assert len(stills) == len(charts) and all(a["alt"] for a in stills)
    sizes = dia.one_sided["torque_saturation"]
    assert "Tested up to what these records asked for" in seen.text and sizes in seen.text
    assert "Tested up to" not in Reader(report_page(replace(dia, one_sided={}))).text
    linear = unpacked(report_page(dia, axis="linear"))
    assert sizes.replace("N m", "N").replace("torque", "force") in Reader(linear).text
    assert "velocity [m/s]" in linear and "rad/s" not in json.dumps(charts_of(linear)["charts"]["run-0"])


def test_the_command_is_in_the_page_as_csv(dia: ga.Diagnosis, fast: None) -> None:
    result = ambiguous(dia)
    (link,) = [a for a in Reader(report_page(result)).found("a") if "download" in a]
    assert link["download"] == "next_experiment.csv" and link["href"] is not None
    kind, _, data = link["href"].partition(";base64,")
    text = base64.b64decode(data).decode()
    assert kind == "data:text/csv" and text == proposal_csv(result.next_experiment)
    rows = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[:, 1], result.next_experiment.command, rtol=1e-8)


def test_nothing_of_a_file_gets_out_of_its_place(dia: ga.Diagnosis, fast: None) -> None:
    plain, evil = (Reader(report_page(r)) for r in (ambiguous(dia), hostile(dia)))
    page = report_page(hostile(dia))
    assert "window.hacked=1</script>" not in page and "<img src=x" not in page and "\u2028" not in page.partition("library")[2]
    for name in ("script", "style", "iframe", "object", "link"):  # what may run or load
        assert len(evil.found(name)) == len(plain.found(name)), name
    assert all(a["src"].startswith("data:image/png;base64,") for a in evil.found("img") if a["src"])
    assert not any(key.startswith("on") for _, attributes in evil.tags for key in attributes)
    assert evil.text.count("window.hacked=1") > 8  # it is shown, as a text
    assert all(HOSTILE not in str(t["name"]) for c in charts_of(page)["charts"].values() for t in c["data"])
    idn = replace(dia.identification, warnings=(HOSTILE,), version=HOSTILE, records=hostile(dia).records)
    assert "<img src=x" not in report_page(idn)
    for shown in (hostile(dia)._repr_html_(), idn._repr_html_()):
        assert "<script" not in shown and "<img" not in shown and "window.hacked=1" in shown


def test_what_a_script_unpacks_survives_what_ends_a_script() -> None:
    data = {"a": HOSTILE, "b": "<!--<script>"}
    text, size = packed(json_of(data))
    assert re.fullmatch(r"[#-;=-~]+", text) and packed(json_of(data)) == (text, size) and size == len(json_of(data).encode())
    assert json.loads(text_of(text)) == data


@pytest.mark.long
def test_a_page_with_its_library_is_small(dia: ga.Diagnosis, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "picture", lambda chart: b"png")
    assert 1.2e6 < len(report_page(dia)) < 1.7e6  # without its pictures


def test_texts_are_escaped_unless_they_are_html() -> None:
    assert tag("p", "a<b", Html("<i>"), title='"') == '<p title="&quot;">a&lt;b<i></p>'
    assert typeset("(1.20 +- 0.03)e-04 kg m^2") == "(1.20 &plusmn; 0.03)&times;10<sup>&minus;4</sup> kg m<sup>2</sup>"
    assert typeset("-3 to 1e+05 rad/s^2/(N m) <x>") == "&minus;3 to 1&times;10<sup>5</sup> rad/s<sup>2</sup>/(N m) &lt;x&gt;"
    assert typeset("effect-5 p-q a1e-x") == "effect-5 p-q a1e-x"


def test_an_identification_has_its_search_and_says_who_finds_causes(dia: ga.Diagnosis, fast: None) -> None:
    page = report_page(dia.identification)
    seen = Reader(page)
    assert [a["id"] for a in seen.found("section")] == ["verdict", "measured", "wrong", "cause", "parameters", "structure", "how"]
    assert "gaident diagnose LOG" in seen.text and "the data contradict it" in seen.text and "falsified" in seen.text
    assert {"structures", "convergence", "roots", "response", "run-0", "missing-velocity"} <= set(charts_of(page)["charts"])


def test_a_loaded_result_says_what_needs_the_record(dia: ga.Diagnosis, fast: None, tmp_path: Path) -> None:
    dia.save(tmp_path / "dia.json")
    back = ga.load(tmp_path / "dia.json")
    seen = Reader(report_page(back))
    assert seen.text.count("gaident report RESULT.json LOG") == 5 and charts_of(report_page(back))["charts"] == {}
    assert "inertia" in seen.text and dia.digests[0] in seen.text and "not at hand" in seen.text
    # Without anything to draw 2 MB less.
    assert "plotly()" in unpacked(report_page(dia)) and "plotly()" not in unpacked(report_page(back))
    whole = Reader(report_page(back, drive_record(), drive_record(1)))
    assert whole.text == Reader(report_page(dia)).text
    other = Reader(report_page(back, drive_record(5)))
    assert "This is not a record of this result: its hash is another one." in other.text
    part = Reader(report_page(back, drive_record()))
    assert "The validation record is not at hand" in part.text


def test_wrong_use_is_refused_and_leaves_no_file(dia: ga.Diagnosis, tmp_path: Path) -> None:
    for arguments, error, words in (
        ((dia, None, None, "round"), SettingsError, "axis is 'round'"),
        ((3, None, None, "rotary"), GaidentError, "result is int"),
        ((dia, [3], None, "rotary"), GaidentError, "records is list"),
    ):
        result, records, validation, axis = arguments
        with pytest.raises(error, match=words):
            ga.report(result, tmp_path / "a.html", records, validation, axis)  # type: ignore[arg-type]
    with pytest.raises(OSError):
        ga.report(ga.Diagnosis.from_dict(dia.to_dict()), tmp_path / "nowhere" / "a.html")
    assert list(tmp_path.iterdir()) == []


def test_the_linear_model_of_the_pictures_is_that_of_the_figures(dia: ga.Diagnosis) -> None:
    """Both are fitted alike, and simulated in the same loop; old files have the identified model alone."""
    assert dia.linear_model is not None
    runs = view_of(dia, None, None, "rotary").runs
    (held_out,) = (run for run in runs if run.used == "held out")
    error = held_out.measured - held_out.linear
    assert float(np.sqrt(np.mean(error**2))) == pytest.approx(dia.before.rmse, rel=1e-6)
    run = runs[0]
    back = ga.Diagnosis.from_dict(dia.to_dict())
    assert back.linear_model == dia.linear_model
    older = {name: value for name, value in dia.to_dict().items() if name != "linear_model"}
    assert ga.Diagnosis.from_dict(older).linear_model is None
    other = replace(dia, linear_model=ga.Model(0.5 * dia.linear_model.gain, dia.linear_model.poles))
    assert not np.allclose(view_of(other, None, (), "rotary").runs[0].linear, run.linear)


def test_no_loop_is_drawn_over_a_controller_that_does_not_make_the_torque(dia: ga.Diagnosis) -> None:
    (closed, *_), (driven, *_) = (view_of(replace(dia, loop_follows=f), None, (), "rotary").runs for f in (True, False))
    assert closed.torque_logged and not np.allclose(closed.linear, driven.linear)
    assert driven.extended is not None and np.all(np.isfinite(driven.extended))


def test_a_run_that_runs_away_is_drawn_up_to_there(dia: ga.Diagnosis) -> None:
    model = ga.Model(dia.model.gain, [400.0])
    wild = replace(dia, model=model, linear_model=model, validation_records=())
    (run,) = view_of(wild, None, (), "rotary").runs
    assert "runs away" in run.notes[0] and np.isnan(run.linear[-1]) and np.all(np.isfinite(run.linear[:10]))
    for chart in (
        run_chart(run, 0.05, "run", "rotary"),
        residual_spectrum(run.measured - run.linear, None, run.dt, 0.05, "rotary"),
    ):
        assert picture(chart).startswith(b"\x89PNG")
        assert any(y is not None for y in figure(chart)["data"][-1]["y"])


def test_the_last_part_of_a_record_is_marked_where_it_is_held_out(dia: ga.Diagnosis) -> None:
    alone = replace(dia, validation_digests=(), validation_records=(), held_out="the last 30 % of the record")
    (run,) = view_of(alone, None, None, "rotary").runs
    assert run.used == "fitted" and run.held_out_from == 1120
    (mark,) = run_chart(run, 0.05, "run", "rotary").panels[0].marks
    assert mark.x == pytest.approx(1.12) and mark.text == "held out from here"
    assert held_out_chart(run, 0.05, "run", "rotary").panels[0].traces[0].x[0] == pytest.approx(1.12)


@pytest.mark.parametrize(("gain", "mark"), [(60.0, "most"), (-5.0, "closest")])
def test_text_and_table_agree_on_what_the_rest_depends_on(dia: ga.Diagnosis, fast: None, gain: float, mark: str) -> None:
    left = replace(dia, driver="position", left={"position": gain, "time": -3.0}, left_needed=47.0)
    page = " ".join(re.sub("<[^>]*>", " ", report_page(left)).split())
    assert re.search(rf"on the position \S*{abs(gain):.0f} {mark}", page)
    assert ("What is left depends on the position." in page) == (mark == "most")
    assert ("No single signal explains what is left; what comes closest depends on the position." in page) == (mark == "closest")
    assert ("A signal counts above 47 units. None does" in page) == (mark == "closest")


def test_it_says_which_record_is_shown_and_that_it_never_reverses(dia: ga.Diagnosis, fast: None) -> None:
    view = view_of(dia, None, None, "rotary")
    one_way = replace(view.fitted[0], measured=80.0 + view.fitted[0].measured)
    text = parts.missing_section(replace(view, runs=(one_way, replace(one_way, name="other"))), 0.05, parts.Charts()).body
    assert "No reversals in the record." in text
    assert f"Shown for <b>{one_way.name}</b>, the first of the longest of those fitted." in text


def test_long_signals_keep_their_peaks_and_clouds_are_thinned() -> None:
    t = np.arange(200_000) * 1e-3
    y = np.sin(t)
    y[123_457] = 50.0
    drawn = series(t, y, "", "ink")
    assert len(drawn.x) <= 2 * BINS + 2 and drawn.y.max() == 50.0
    assert len(cloud(t, y, "ink").x) < 2000


def every_kind() -> Chart:
    x = np.linspace(0.1, 10.0, 30)
    kinds = ("line", "points", "bars", "means", "crosses", "rings", "area")
    traces = tuple(Trace(x, np.where(x > 9.8, np.nan, x**2), k, "ink", k, spread=0.1 * x) for k in kinds)
    panels = (
        Panel(
            "a [$m^2$]", traces, (Band(-1.0, 1.0, "band"),), (Mark(2.0, "<b>x</b>"), Mark(3.0, "$y$", 5.0)), limits=(-2.0, 120.0)
        ),
        Panel("b", traces[:1], log=True, ticks=(1.0, 10.0)),
    )
    return Chart("all", "x", panels, "everything", log=True, limits=(0.1, 10.0))


def test_plotly_knows_every_property_and_names_are_no_tags() -> None:
    """plotly.js passes over what it does not know; plotly.py refuses it."""
    from plotly.graph_objects import Figure

    def painted(x: Any) -> Any:
        if isinstance(x, str) and x.startswith("@"):
            return PALETTES["dark"][x[1:].split("/")[0]]
        if isinstance(x, dict):
            return {k: painted(v) for k, v in x.items()}
        return [painted(v) for v in x] if isinstance(x, list) else x

    drawn = figure(every_kind())
    assert len(Figure(painted(drawn)).data) == 9
    assert html.escape("<b>x</b>") in [a["text"] for a in drawn["layout"]["annotations"]]
    assert PALETTES["dark"].keys() == PALETTES["light"].keys()
    numbers = [t["y"][-1] for t in drawn["data"]]
    assert numbers == [None] * 9 and drawn["layout"]["xaxis"]["range"] == [-1.0, 1.0]


def test_the_picture_for_print_shows_every_kind() -> None:
    from PIL import Image

    image = Image.open(io.BytesIO(picture(every_kind())))
    assert image.format == "PNG" and image.size[0] > 900
    assert len(image.convert("RGB").getcolors(1 << 24) or ()) > 5


def test_the_command_line_writes_the_page(
    dia: ga.Diagnosis, fast: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("run0.csv").write_text(csv_text(drive_record(), None, "rotary"))
    dia.identification.save("idn.json")
    loop = ("--kp", str(CONTROLLER.kp), "--ki", str(CONTROLLER.ki))
    assert main(["report", "idn.json", "run0.csv", "--out", "a.html"]) == 0
    out, _ = capsys.readouterr()
    assert "not the data of this result, by their hash: run0" in out and "written: a.html (" in out  # 12 digits are not all
    assert main(["identify", "run0.csv", *loop, "--p", "1", "--q", "0", "--out", "own.json", "--report", "b.html"]) == 0
    assert capsys.readouterr().out.endswith("written: own.json, b.html\n")
    assert main(["report", "own.json", "run0.csv", "--json", "--out", "c.html"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["schema"] == "gaident/report" and printed["bytes"] == Path("c.html").stat().st_size
    assert Reader(Path("b.html").read_text()).text == Reader(Path("c.html").read_text()).text
    for arguments, words in (
        (["report", "own.json", "--out", "own.json"], "this is the log itself"),
        (["report", "run0.csv"], "is not JSON"),
        (["identify", "run0.csv", *loop, "--out", "x", "--report", "x"], "--out and --report both name x"),
    ):
        assert main(arguments) == 2
        assert words in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.html", "b.html", "c.html", "idn.json", "own.json", "run0.csv"]


def test_what_variations_say_is_a_chapter_where_it_is_of_this_diagnosis(dia: ga.Diagnosis, fast: None) -> None:
    named = tuple((f.effect, *f.alternatives) for f in dia.causes)
    shown = Stability(
        dia.verdict, named, (Variation("first half", "explained", named), Variation("every second line", "adequate"))
    )
    seen = Reader(report_page(dia, stability=shown))
    text = seen.text[seen.text.rindex("Is it beyond doubt?") :]
    assert text.index("named in 1 of 2 variations") < text.index("first half") < text.index("every second line")
    assert "not named" in text and "Is it beyond doubt?" not in Reader(report_page(dia)).text
    other = Stability(dia.verdict, (("backlash",),), ())
    for wrong, message in ((other, "with other causes"), ("stable", "give what dia.stability")):
        with pytest.raises(ga.GaidentError, match=message):
            report_page(dia, stability=wrong)  # type: ignore[arg-type]
    with pytest.raises(ga.GaidentError, match="of the one diagnosis"):
        report_page([dia], stability=shown)
