"""What a rotary and a linear axis call the same thing: words and units, and every text that a reader meets, in both."""

from __future__ import annotations

import ast
import copy
import pickle
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Text as Drawn

import gaident as ga
from gaident.axis import (
    AXES,
    UNITS,
    WORDS,
    Text,
    called,
    identifier_words,
    joined,
    linear_sentences,
    message_of,
    order,
    restored,
    said,
    say,
    turns,
    unit,
    word,
)
from gaident.data.listing import columns
from gaident.diagnosis.experiments.excitation import excitation
from gaident.diagnosis.experiments.first_experiment import candidate_commands, first_experiment
from gaident.diagnosis.explain.wording import evidence_of, or_other_form
from gaident.diagnosis.library.equivalences import EQUIVALENT
from gaident.diagnosis.records.folded import ADVICE
from gaident.diagnosis.selection.offset import Offset
from gaident.diagnosis.unlogged.controller_forms import VARIANTS
from gaident.drive.draft import draft
from gaident.errors import GaidentError, RecordError, SettingsError
from gaident.identification.notes import open_loop_notes
from gaident.identification.replay.replay import replay
from gaident.reporting import report_page
from gaident.results.finding import Finding
from gaident.show.report import parts
from page import Reader, charts_of
from report_cases import diagnosed, retuned_once
from written_out import CONTROLLER, DT, ONE_MASS, TWO_MASS, changed, drive

PACKAGE = Path(ga.__file__).parent
NAMES = sorted((row.name.replace("_", " ") for row in ga.effects.table()), key=len, reverse=True)
ROTARY = re.compile(
    r"\brad\b|\bN m\b|\b[Tt]orques?\b|\b[Ii]nertias?\b|\b[Tt]urns?\b|\b[Aa]ngles?\b|\bdegrees?\b|\bkg m\b|\b[Tt]wist\b|"
    r"\b[Rr]otation\b"
)
TWO_LEVELS = next(e.of for e in EQUIVALENT if e.of is not None)
LINEAR = re.compile(
    r"\bm/s|\b[Ff]orces?\b|\bN s?/m\b|\d N\b(?! m\b)|\[N\]|\[m\]|\bkg\b(?! m\b)|\bmetres?\b|\d m\b|\b1/m\b|\baxis moves\b"
)
# Angular frequencies and the angle of a period are rad on either axis.
ANGULAR = re.compile(
    r"(?:real|imaginary) parts? (?:\[rad/s\]|\S+(?: to \S+)? rad/s)|\[rad/s\] frequency|frequency \[rad/s\]|"
    r"phase +\S+(?: (?:\+-|±) \S+)? +rad\b|(?:frequency|bandwidth) +\S+(?: (?:\+-|±) \S+)? +rad/s|"
    r"(?:pole|zero) +\S+(?: \S+j)? rad/s"
)
CONVERTED = re.compile(r"\bturns?\b|degrees|orders? ")  # a number of turns, of degrees, per turn: of metres, per metre
NUMBER = re.compile(r"(?<![\w^.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def bare(text: str) -> str:
    """A text without names of effects, which are the same for both, and without angular frequencies."""
    text = ANGULAR.sub("", " ".join(text.split()))
    for name in NAMES:
        text = re.sub(rf"\b{name}\b", "", text, flags=re.IGNORECASE)
    return text


def numbers(text: str) -> list[str]:
    return NUMBER.findall(text)


# --- words and units


def test_a_sentence_is_made_for_both_axes_from_the_same_numbers() -> None:
    text = say("a limit above {:.3g} {N m}: no more {torque}, {} of {name}", 1.25, Text("few turns", "little way"), name="x {y}")
    assert text == "a limit above 1.25 N m: no more torque, few turns of x {y}"
    assert text.linear == "a limit above 1.25 N: no more force, little way of x {y}"
    assert said(text, "rotary") == text and said(text, "linear") == text.linear
    assert said("as it is", "linear") == "as it is" and say("nothing differs") == say("nothing differs").linear
    assert type(said(text, "rotary")) is str and type(said(text, "linear")) is str
    both = joined("; ", [text, "plain"])
    assert both == f"{text}; plain" and both.linear == f"{text.linear}; plain"
    assert say("{Torque} {turns}").linear == "Force moves" and say("{torque}").begun().linear == "Force"
    with pytest.raises(KeyError, match="twisted"):
        say("a {twisted} shaft")


def test_a_sentence_is_copied_and_saved_with_both_its_forms() -> None:
    text = say("{torque}")
    for same in (copy.deepcopy(text), copy.copy(text), pickle.loads(pickle.dumps(text))):
        assert isinstance(same, Text) and (same, same.linear) == ("torque", "force")
    linear = linear_sentences([text, "plain", Text("alike")])
    assert linear == {"torque": "force"}
    assert said(restored("torque", linear), "linear") == "force" and said(restored("old", linear), "linear") == "old"


def test_units_and_words_of_both() -> None:
    assert [unit(u, "linear") for u in ga.TwoMass.UNITS.values()][:5] == ["kg", "N s/m", "kg", "N s/m", "N/m"]
    units = {p.unit for row in ga.effects.table() for p in row.parameters} - {"1", "s", "1/s", "Hz"}
    assert units <= set(UNITS), "every unit of an effect has its like on a linear axis"
    assert unit("of one's own", "linear") == "of one's own" and unit("N m", "rotary") == "N m"
    assert unit("rad/s^3/(N m)", "linear") == "m/s^3/N"
    assert word("Torque", "linear") == "Force" and word("inertia", "rotary") == "inertia"
    assert identifier_words("load_inertia", "linear") == "load mass" and called("static_torque").linear == "static force"
    assert turns(np.pi) == "0.5 turns" and turns(np.pi).linear == "3.1 m"
    assert order(3) == "3" and order(3).linear == "0.48 1/m"
    for asked in (lambda: unit("N m", "round"), lambda: said("a", "round"), lambda: word("torque", "round")):
        with pytest.raises(SettingsError, match="axis is 'round': it must be one of 'rotary', 'linear'"):
            asked()


def test_what_an_error_says_is_said_in_both() -> None:
    error = RecordError(say("no {torque}: give {}", ga.arguments.arg("torque", "...")))
    assert (
        str(error) == "no torque: give torque=..." == message_of(error)
        and message_of(error).linear == "no force: give torque=..."
    )
    assert message_of(GaidentError("plain")).linear == "plain"


def templates() -> Iterator[tuple[str, str]]:
    """(file and line, text) of every constant of the package with a word of `WORDS` or a unit of `UNITS` in braces."""
    names = {*WORDS, *UNITS, *(w.capitalize() for w in WORDS)}
    for file in sorted(PACKAGE.rglob("*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        in_f_strings = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
        for node in ast.walk(tree):
            text = node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""
            if id(node) not in in_f_strings and names & {*re.findall(r"\{([^{}:]+)\}", text)}:
                yield f"{file.relative_to(PACKAGE)}:{node.lineno}", text


@pytest.mark.long
def test_no_sentence_that_is_made_for_both_says_a_word_of_one() -> None:
    in_c = ("export/c_source.py", "axis.py")  # names of C, and this module's own example
    found = [(place, text.replace("--torque-is", "")) for place, text in templates() if not place.startswith(in_c)]
    assert len(found) > 40
    wrong = [f"{place}: {text!r}" for place, text in found if ROTARY.search(bare(re.sub(r"\{[^{}]*\}", "", text)))]
    assert not wrong, "\n".join(wrong)


# --- every sentence of the library


def sentences() -> list[Text]:
    """What records, replays, findings and experiments of every kind are told in."""
    t = DT * np.arange(2000)
    still = ga.Record(0.444e-3, np.full(250, 43.6), np.zeros(250))
    step = ga.run(ONE_MASS, still, CONTROLLER)
    small = 0.2 * np.cos(31.4 * t)
    excited = [
        excitation(drive(Tc=0.05, samples=4000), replace(CONTROLLER, torque_limit=4.0)),
        excitation(ga.Record(still.dt, still.command, step.velocity, torque=step.torque), CONTROLLER, ONE_MASS.model()),
        excitation(ga.Record(DT, velocity=small, torque=0.01 * np.cos(31.4 * t + 1.0))),
        excitation(ga.Record(DT, velocity=0.0 * t, torque=0.0 * t)),
        excitation(ga.Record(DT, velocity=30.0 - small, torque=1.0 + small)),
        excitation(ga.Record(DT, velocity=0.1 + 0.01 * small, torque=1.0 + small)),
    ]
    rpm, good = 30.0 / np.pi, drive()
    torques: list[Any] = [1000.0 * good.torque, -good.torque, np.append(0.0, good.torque[:-1]), good.torque + 0.07]
    torques += [good.torque + 0.05 * np.sin(0.01 * np.arange(2000)), good.torque + 1e-9, None]
    torques += [good.torque + 0.01 * np.random.default_rng(0).standard_normal(2000)]
    replays = [replay(changed(good, torque=u), CONTROLLER) for u in torques]
    replays += [replay(rec, CONTROLLER) for rec in (good, drive(clamp=0.1), drive(limit=0.6), drive(clamp=0.1, limit=0.6))]
    replays += [replay(rec, CONTROLLER) for rec in (drive(rate=3000.0), drive(rectangular=True))]
    replays += [replay(good, None), replay(good, ga.PI(0.025, 0.4))]
    replays += [replay(ga.Record(DT, good.command * rpm, good.velocity * rpm, torque=good.torque), CONTROLLER)]
    limits = ga.Limits(50.0, 1.0, np.inf, 2.0)
    evidence = [evidence_of(row.name, 23.0, ()) for row in ga.effects.table()]
    evidence += [
        evidence_of(TWO_LEVELS.whole, 23.0, (), Offset(TWO_LEVELS, TWO_LEVELS.whole, 0.5, 31.0, 0.04)),
        evidence_of("backlash", 412.0, ("cogging",)),
        *(or_other_form(variant.words) for variant in VARIANTS),
    ]
    asked = [first_experiment(DT, limits, inertia, kp).reason for inertia in (None, 1e-4) for kp in (None, 0.02)]
    asked += [item.proposal(("cogging",), 1.0).reason for item in candidate_commands(DT, limits)]
    found: list[Any] = [*(s for e in excited for s in (e.sentence, *e.not_testable.values(), *e.one_sided.values()))]
    found += [
        *(r.sentence for r in replays),
        *evidence,
        *asked,
        *(e.otherwise for e in EQUIVALENT),
        ADVICE,
        *open_loop_notes([good], None),
    ]
    found += [row.meaning for row in ga.effects.table()]
    found += ga.TwoMass(JM=-1e-4, DM=-1.0, JL=1e-4, DL=0.0, KG=-1.0, inconsistency=0.1).notes
    return found


@pytest.fixture(scope="module")
def texts() -> list[Text]:
    return sentences()


def test_sentences_of_the_library_keep_to_their_axis(texts: list[Text]) -> None:
    assert all(isinstance(text, Text) for text in texts), [t for t in texts if not isinstance(t, Text)]
    assert len({*texts}) > 90
    wrong = [t.linear for t in texts if ROTARY.search(bare(t.linear))] + [t for t in texts if LINEAR.search(bare(t))]
    assert not wrong, "\n".join(wrong)


def test_both_sentences_tell_the_same_numbers(texts: list[Text]) -> None:
    alike = [t for t in texts if not CONVERTED.search(t)]
    assert len(alike) > 80
    wrong = [f"{t}\n{t.linear}" for t in alike if numbers(t) != numbers(t.linear)]
    assert not wrong, "\n".join(wrong)


# --- every page and picture


def opened() -> ga.Identification:
    """A model from torque to velocity, with the notes of an open loop."""
    rec = drive()
    return ga.identify(rec, space=ga.SearchSpace(gain=(100.0, 1e5), real=(-1.0, 200.0), imaginary=(0.0, 1e3), p=(1, 1), q=(0, 0)))


def everything(texts: list[Text]) -> ga.Diagnosis:
    """The friction that was found, beside findings of every other effect, and with all sentences among the notes."""
    dia = diagnosed()
    others = tuple(
        Finding(
            row.name,
            {p.name: ga.Estimate(3.0, 0.1, p.unit) for p in row.parameters},
            ("load_torque",) if row.name == "cogging" else (),
            evidence=evidence_of(row.name, 30.0, ()),
            is_noise=row.place == "record",
            place=row.place,
        )
        for row in ga.effects.table()
    )
    proposal = first_experiment(DT, ga.Limits(50.0, 1.0, np.inf, 2.0))
    proposal = replace(proposal, separates=("cogging", "load_torque"), margin=64.0)
    mechanics = {
        "inertia": ga.Estimate(1e-3, 1e-5, "kg m^2"),
        "motor_inertia": ga.Estimate(1e-3, 1e-5, "kg m^2"),
        "viscous_friction": ga.Estimate(1e-3, 1e-5, "N m s/rad"),
        "stiffness": ga.Estimate(1e-3, 1e-5, "N m/rad"),
        "resonance_damping": ga.Estimate(0.1, 0.01, "1"),
    }
    return replace(
        dia,
        findings=(*dia.findings, *others),
        notes=tuple(texts),
        not_testable={f"effect_{i}": t for i, t in enumerate(texts[:20])},
        driver="torque",
        left={name: 5.0 for name in ("torque", "position", "past")},
        line=(37.0, 0.05),
        verdict="partly explained",
        next_experiment=proposal,
        mechanics=mechanics,
        base_shift={name: (2.0, 1.0) for name in mechanics},
        controller=replace(CONTROLLER, torque_limit=3.0, integrator_limit=2.0),
        noise=0.1,
    )


def words_of(page: str) -> str:
    """All that a page shows: its text, and what its charts say."""

    def strings(data: Any) -> Iterator[str]:
        if isinstance(data, str):
            yield data
        elif isinstance(data, dict | list):
            for inner in data.values() if isinstance(data, dict) else data:
                yield from strings(inner)

    return " ".join([Reader(page).text, *strings(charts_of(page)["charts"])])


def drawn_words(*figures: Any) -> str:
    return " | ".join(filter(None, (t.get_text() for figure in figures for t in figure.findobj(Drawn))))


def unrecorded(dia: ga.Diagnosis) -> ga.Diagnosis:
    return replace(dia, records=(), validation_records=())


SHOWN: dict[str, Callable[[ga.Diagnosis, ga.Identification, str], str]] = {
    "summary of a diagnosis": lambda dia, _, axis: dia.summary(axis),
    "summary of an identification": lambda _, idn, axis: idn.summary(axis),
    "summary of its identification": lambda dia, _, axis: dia.identification.summary(axis),
    "page of a diagnosis": lambda dia, _, axis: words_of(report_page(dia, axis=axis)),
    "page of an identification": lambda _, idn, axis: words_of(report_page(idn, axis=axis)),
    "page without its record": lambda dia, _, axis: words_of(report_page(unrecorded(dia), axis=axis)),
    "pictures of a diagnosis": lambda dia, _, axis: drawn_words(dia.plot(axis=axis), dia.plot_bode(axis=axis)),
    "pictures of an identification": lambda _, idn, axis: drawn_words(idn.plot(axis=axis), idn.plot_bode(axis=axis)),
    "the model alone": lambda _, idn, axis: drawn_words(idn.plot_bode(records=(), axis=axis)),
    "inverse dynamics": lambda dia, _, axis: ga.inverse_dynamics(dia.records, axis=axis).summary(),
}


@pytest.fixture(scope="module")
def results(texts: list[Text]) -> tuple[ga.Diagnosis, ga.Identification]:
    return everything(texts), opened()


@pytest.mark.parametrize("name", SHOWN)
def test_what_is_shown_keeps_to_its_axis(
    name: str, results: tuple[ga.Diagnosis, ga.Identification], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parts, "picture", lambda chart: b"png")
    monkeypatch.setattr("plotly.offline.get_plotlyjs", lambda: "plotly()")
    retuned_once(monkeypatch)
    rotary, linear = (bare(SHOWN[name](*results, axis)) for axis in AXES)
    strange = [rotary[max(0, m.start() - 60) : m.end() + 20] for m in LINEAR.finditer(rotary)]
    strange += [linear[max(0, m.start() - 60) : m.end() + 20] for m in ROTARY.finditer(linear)]
    assert not strange, "\n".join(strange)
    assert len(rotary) > 50 and rotary != linear


def test_a_summary_tells_the_same_numbers_on_both(results: tuple[ga.Diagnosis, ga.Identification]) -> None:
    dia, idn = results
    told = replace(
        dia,
        notes=tuple(t for t in dia.notes if not CONVERTED.search(t)),
        not_testable={e: t for e, t in dia.not_testable.items() if not CONVERTED.search(t)},
        one_sided={e: t for e, t in dia.one_sided.items() if not CONVERTED.search(t)},
        findings=tuple(f for f in dia.findings if not CONVERTED.search(f.evidence)),
    )
    for result in (told, idn, dia.identification):
        assert numbers(result.summary()) == numbers(result.summary("linear"))


def test_a_saved_result_is_read_with_the_words_of_both(results: tuple[ga.Diagnosis, ga.Identification], tmp_path: Path) -> None:
    for i, result in enumerate(results):
        result.save(tmp_path / f"{i}.json")
        back = ga.load(tmp_path / f"{i}.json")
        assert isinstance(back, ga.Diagnosis | ga.Identification) and back.to_dict() == result.to_dict()
        assert [back.summary(axis) for axis in AXES] == [result.summary(axis) for axis in AXES]


def test_a_saved_result_of_before_keeps_its_sentences(results: tuple[ga.Diagnosis, ga.Identification]) -> None:
    data = results[0].to_dict()
    for linear in (data, data["identification"], data["next_experiment"]):
        del linear["linear_axis"]
    for finding in data["findings"]:
        del finding["place"]  # read back as that of the effect
    old = ga.Diagnosis.from_dict(data)
    assert old.notes == results[0].notes and old.summary() == results[0].summary()
    assert " kg\n" in old.summary("linear") and "0.05 N at the motor" in " ".join(old.summary("linear").split())


def test_a_c_file_differs_in_its_comments_only(results: tuple[ga.Diagnosis, ga.Identification]) -> None:
    rotary, linear = (results[0].model.to_c(None, DT, axis=axis) for axis in AXES)
    assert rotary.startswith("/* drive: torque [N m] to motor velocity [rad/s]") and " * SI units of a rotary axis" in rotary
    assert linear.startswith("/* drive: force [N] to motor velocity [m/s]") and " * SI units of a linear axis" in linear
    assert "double velocity; /* m/s, as" in linear and "double torque; /* N, as" in linear and "/* N, forces on" in linear
    rotary, linear = (re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL) for text in (rotary, linear))
    assert rotary == linear
    with pytest.raises(SettingsError, match="axis is 'round'"):
        results[0].model.to_c(None, DT, axis="round")


def test_a_drive_file_has_the_units_of_its_axis(tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    rows = "".join(f"{0.001 * n:.3f},{n % 7},{n % 5}\n" for n in range(40))
    for velocity, axis in (("rpm", "rotary"), ("mm/s", "linear")):
        for torque, constant in (("%", "{N m} at 100 %"), ("A", "{N m/A}")):
            log.write_text(f"t [s],v [{velocity}],M [{torque}]\n{rows}")
            text = draft(columns(log), {}).text
            assert f'axis = "{axis}"' in text and f"FILL IN: {said(say(constant), axis)}; the torque is logged in" in text
            remarks = dict(re.findall(r"^# (\w+) = .*?  # (.*)$", text, re.MULTILINE))
            assert remarks["speed"].split(";")[0] == unit("rad/s", axis) and remarks["torque"] == unit("N m", axis)
            assert remarks["travel"].split(";")[0] == unit("rad", axis)
            assert remarks["kp"].startswith(unit("N m s/rad", axis)) and remarks["ki"].startswith(unit("N m/rad", axis))
            assert remarks["inertia"].endswith(unit("kg m^2", axis))


def test_two_masses_are_coupled_by_what_the_axis_has(results: tuple[ga.Diagnosis, ga.Identification]) -> None:
    fake = replace(results[1], mechanics=TWO_MASS)
    assert "stiffness of the shaft" in fake.summary() and "inertia of the load" in fake.summary()
    assert "stiffness between them" in fake.summary("linear") and "mass of the load" in fake.summary("linear")
