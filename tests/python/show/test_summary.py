"""The summary's text: a golden file from a result made by hand, and what must not be missing in others."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import gaident as ga
from gaident.results.estimate import Estimate
from gaident.results.fitness import Fitness
from gaident.show import identification_summary, mechanics_comparison
from gaident.show.diagnosis_summary import moved_words
from gaident.show.wording import free_run_words, number, structure_words, table, with_std
from places import GOLDEN

TEXT = GOLDEN / "identification.txt"


@dataclass
class Fake:
    """What a summary looks at, with the figures of a drive that never was."""

    p: int = 1
    q: int = 2
    falsified: bool = False
    fit_percent: float = 97.42
    rmse: float = 0.30153
    seconds: float = 0.0478
    samples: int = 250
    fitness: float = 28.7312
    seed: int = 7
    version: str = "0.1.0"
    digests: tuple[str, ...] = ("c0ffee",)
    frequencies: int = 0
    unseen_above: float | None = 400.0
    path: dict[str, Estimate] = field(default_factory=dict)
    response_digests: tuple[str, ...] = ()
    of_responses: bool = False
    controller: Any = field(default_factory=lambda: ga.PI(0.0232, 1.367, torque_limit=2.4))
    adequacy: Any = field(
        default_factory=lambda: SimpleNamespace(noise_std=0.3011, undecided=False, sentence="The residual is white.")
    )
    parameters: dict[str, Estimate] = field(
        default_factory=lambda: {
            "gain": Estimate(9790.12, 64.3, "rad/s^2/(N m)"),
            "pole_1": Estimate(-16.186, 0.151, "rad/s"),
            "pole_pair_1_real": Estimate(-14.374, 0.512, "rad/s"),
            "pole_pair_1_imaginary": Estimate(171.667, 0.463, "rad/s"),
            "pole_pair_1_frequency": Estimate(172.268, 0.452, "rad/s"),
            "pole_pair_1_damping": Estimate(0.08344, 0.0029, "1"),
            "zero_pair_1_real": Estimate(-0.0, math.nan, "rad/s", at_bound=True, identifiable=False),
            "zero_pair_1_imaginary": Estimate(66.37, 0.12, "rad/s"),
            "zero_pair_1_frequency": Estimate(66.37, 0.12, "rad/s"),
            "zero_pair_1_damping": Estimate(0.0, math.nan, "1", at_bound=True, identifiable=False),
        }
    )
    mechanics: Any = field(
        default_factory=lambda: ga.TwoMass(
            JM=1.0197e-4, DM=0.00318, JL=5.773e-4, DL=0.007878, KG=2.571, inconsistency=0.0274,
            std={"JM": 6.4e-7, "DM": 1.1e-4, "JL": 2e-6, "DL": 9.5e-5, "KG": 0.013, "J": 2.3e-6, "D": 5.1e-5,
                 "inconsistency": 0.0281},
            with_shaft_damping=ga.TwoMass(
                JM=1.0215e-4, DM=0.00306, JL=5.793e-4, DL=0.00796, KG=2.58, DG=-4.1e-4, inconsistency=0.0,
                std={"JM": 6.7e-7, "DM": 1.7e-4, "JL": 2.9e-6, "DL": 1.3e-4, "KG": 0.016, "DG": 1.2e-4,
                     "J": 3.2e-6, "D": 6.5e-5},
            ),
        )
    )  # fmt: skip
    controller_numbers: dict[str, Estimate] = field(default_factory=dict)
    rivals: tuple[Any, ...] = (SimpleNamespace(p=1, q=3, delta_bic=6.71),)
    structures: tuple[Any, ...] = tuple(
        SimpleNamespace(p=p, q=q, delta_bic=bic, error_sum=cost)
        for p, q, bic, cost in (
            (1, 0, 1350.7, 2413.8), (1, 1, 1311.0, 1986.4), (1, 2, 0.0, 22.731), (1, 3, 6.71, 22.65),
            (2, 3, 33.8, 24.35), (3, 2, 39.8, 25.5), (3, 3, 39.6, 24.38),
        )
    )  # fmt: skip
    trials: tuple[Any, ...] = (SimpleNamespace(generations=80, evaluations=4000),)
    warnings: tuple[str, ...] = (
        "Structures within 10 BIC units of (1,2): (1,3); the smallest is reported.",
        "At a bound of the search range: zero_pair_1_real, zero_pair_1_damping. Widen the space, or doubt the structure.",
    )
    space: Any = field(
        default_factory=lambda: ga.SearchSpace(
            gain=(200.0, 1e5), real=(0.0, 1257.0), imaginary=(6.28, 1257.0), source="given: inertia"
        )
    )
    settings: Any = field(default_factory=ga.Settings)


def test_summary_is_the_golden_text() -> None:
    assert identification_summary(Fake()) + "\n" == TEXT.read_text(encoding="utf-8")


def test_summary_of_a_falsified_linear_axis() -> None:
    sentence = "The linear model is falsified: the residual still depends on the motion."
    one_mass = {
        "gain": Estimate(0.00946, 0.00074, "rad/s^2/(N m)"),
        "pole_1": Estimate(4.06, 0.36, "rad/s", identifiable=False),
    }
    fake = Fake(
        q=0,
        falsified=True,
        controller=None,
        parameters=one_mass,
        adequacy=SimpleNamespace(undecided=False, noise_std=2.2e-4, sentence=sentence),
        mechanics=ga.OneMass(105.7, 429.0, std={"J": 8.3, "D": 17.0}),
        warnings=(sentence,),
        rivals=(),
        structures=(),
    )
    text = identification_summary(fake, axis="linear")
    assert text.startswith("(p,q) = (1,0), one mass; the linear model is FALSIFIED\n")
    assert "Mechanics, NOT TO BE TRUSTED" in text
    assert "105.7 +- 8.3  kg     mass\n" in text and "429 +- 17     N s/m  viscous damping\n" in text
    assert "N s/m" in text and "m/s^2/N" in text and "open loop, force [N] to velocity [m/s]" in text
    assert "not identifiable, unstable" in text
    assert text.count(sentence) == 1  # the verdict stands at the top, not again among the warnings
    assert "rad/s^2" not in text and "N m" not in text


def test_warnings_stand_under_the_verdict_and_letters_are_explained() -> None:
    sections = identification_summary(Fake()).split("\n\n")
    assert [s.split()[0] for s in sections] == ["(p,q)", "Keep", "Mechanics", "Model:", "Structures,", "Searched"]
    words = {line.split()[0]: line for line in sections[2].splitlines()}
    assert words["KG"].endswith("stiffness of the shaft") and words["JL"].endswith("inertia of the load")
    assert "mass of the load" in identification_summary(Fake(), axis="linear")


def test_summary_without_mechanics_names_the_reason() -> None:
    assert "Mechanics: none, (2,1) is neither" in identification_summary(Fake(p=2, q=1, mechanics=None))
    assert "Mechanics: no such mechanism" in identification_summary(Fake(mechanics=None))


def test_summary_hints_at_a_significant_inconsistency() -> None:
    two = Fake().mechanics
    two.std["inconsistency"] = 0.004
    assert "significant; a hint at shaft damping" in identification_summary(Fake(mechanics=two))


def test_comparison_with_the_truth() -> None:
    truth = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59)
    lines = mechanics_comparison(Fake().mechanics, truth).splitlines()
    assert lines[0].split() == ["true", "identified", "deviation"]
    assert lines[3].split() == [*("JL", "0.0005815", "(5.773", "+-", "0.020)e-04", "-0.7", "%", "(2.1", "std)", "kg", "m^2")]
    assert not any(line.split()[0] == "DG" for line in lines[1:])


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (9790.12, 64.3, "9790 +- 64"),
        (9790.12, 643.0, "9790 +- 643"),
        (-16.186, 0.151, "-16.19 +- 0.15"),
        (1.0197e-4, 6.4e-7, "(1.0197 +- 0.0064)e-04"),
        (1.23456e7, 2e5, "(1.235 +- 0.020)e+07"),
        (-1e-12, 0.1, "0.00 +- 0.10"),
        (2.0, 1e-13, "2 +- 1.0e-13"),
        (2.0, math.nan, "2"),
        (2.0, None, "2"),
        (2.0, math.inf, "2 +- inf"),
        (math.nan, 1.0, "-"),
    ],
)
def test_value_with_std(value: float, std: float | None, text: str) -> None:
    assert with_std(value, std) == text


def test_what_diverges_has_no_figures_and_what_turns_has_no_share() -> None:
    assert free_run_words(Fitness(6.4e140, -2.7e141, 0.01)) == ("diverges", "")
    assert free_run_words(Fitness(0.1585, 99.731, 0.01)) == ("0.1585", "99.73")
    assert [moved_words(*values, 1e-4) for values in ((-0.0032, 0.0229), (0.02, 0.021), (1e-5, 0.02))] == [
        "other sign",
        "+5.0 %",
        "",
    ]


def test_wording() -> None:
    assert number(-0.0) == "0"
    assert table([("a", "", "b"), ("ccc", "", "d")]) == ["  a    b", "  ccc  d"]
    assert structure_words(1, 0) == "one mass"


def test_real_result_and_its_copy_from_a_file_read_alike(tmp_path: Path) -> None:
    from one_mass import one_mass_record

    rec, controller = one_mass_record()
    idn = ga.identify(rec, controller=controller)
    idn.save(tmp_path / "idn.json")
    text = idn.summary()
    assert text == ga.load(tmp_path / "idn.json").summary()
    assert text.startswith("(p,q) = (1,0), one mass; the linear model stands\n")
