"""The same seed and records give the same diagnosis to the last bit: whatever their order and the number of workers.

With the sums of another processor, which NumPy, SciPy and their BLAS form otherwise, it is the same to what a fit converges to.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga

DT = 1e-3
LEVELS = (20.0, -20.0, 5.0, -5.0, 40.0, -40.0)  # rad/s
CONTROLLER = ga.PI(kp=0.05, ki=1.5)
DRIVE = ga.OneMass(J=5e-4, D=2e-3).model().with_effect("coulomb_friction", torque=0.05)


def recorded(seed: int, levels: tuple[float, ...] = LEVELS, torque: bool = False) -> ga.Record:
    """Dry friction under steps with a dither, noise inside the loop; a record of its own for each seed."""
    rng = np.random.default_rng(seed)
    asked = np.repeat(levels, 160) + np.repeat(rng.choice([-1.0, 1.0], 40 * len(levels)), 4)
    noise = 0.05 * rng.standard_normal(len(asked))
    done = ga.run(DRIVE, ga.Record(DT, command=asked - noise, velocity=np.zeros(len(asked))), CONTROLLER)
    logged = done.torque if torque else None
    return ga.Record(DT, command=asked, velocity=done.velocity + noise, torque=logged, name=f"run {seed}")


def content(dia: ga.Diagnosis) -> dict[str, Any]:
    """All of a result but the time that it took."""
    found = dia.to_dict() | {"seconds": 0.0}
    return found | {"identification": found["identification"] | {"seconds": 0.0}}


@pytest.mark.long
def test_two_records_in_either_order_held_out_ones_too_and_a_bootstrap() -> None:
    records, later = [recorded(0), recorded(1, LEVELS[::-1])], [recorded(2), recorded(3)]
    one = ga.diagnose(records, CONTROLLER, validation=later, bootstrap=1, seed=5)
    two = ga.diagnose(records[::-1], CONTROLLER, validation=later[::-1], bootstrap=1, seed=5)
    assert [f.effect for f in one.causes] == ["coulomb_friction"], one.summary()
    assert content(one) == content(two)
    assert one.causes[0].p_value == 0.5 and one.bootstrap == 1  # (1 + 0) / (1 + 1)
    assert "(bootstrap): at most 0.5." in " ".join(one.summary().split())


@pytest.mark.long
def test_three_records_of_another_controller_in_any_order() -> None:
    """The gains that the logged torques show are a mean over the records, and the sentence that says so quotes one of them."""
    a, b, c = (recorded(seed, LEVELS[seed : seed + 3], torque=True) for seed in range(3))
    given = ga.PI(kp=0.06, ki=1.2)
    first, *others = (ga.diagnose(r, given, validation=recorded(9)) for r in ([a, b, c], [c, b, a], [b, c, a]))
    assert [f.effect for f in first.causes if f.place != "controller"] == ["coulomb_friction"], first.summary()
    assert any("instead of the given ones" in note for note in first.notes)
    for other in others:
        assert content(other) == content(first)


@pytest.mark.long
def test_any_number_of_workers() -> None:
    records = [recorded(0, LEVELS[:3]), recorded(1, LEVELS[2:])]
    identified = [ga.identify(records, CONTROLLER, workers=n) for n in (1, 2, 4)]
    one, *others = (ga.diagnose(records, CONTROLLER, identification=idn) for idn in identified)
    for other in others:
        assert content(other) == content(one)


OF_ANOTHER = """
import json, sys
sys.path.insert(0, sys.argv[1])
from test_same_result import CONTROLLER, recorded
import gaident as ga
dia = ga.diagnose(recorded(0), CONTROLLER, seed=5)
idn = ga.identify(recorded(0), CONTROLLER, seed=5)
said = [dia.verdict, [f.effect for f in dia.findings], dia.model.to_dict(), idn.model.to_dict(), dia.summary()]
print(json.dumps(said))
"""


# OPENBLAS_CORETYPE -> what the processor must be able to do.
CORES = {"Prescott": "pni", "Nehalem": "sse4_2", "Sandybridge": "avx", "Haswell": "fma", "SkylakeX": "avx512f"}
NO_AVX512 = {"NPY_DISABLE_CPU_FEATURES": "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR"}


def _said(more: dict[str, str]) -> list[Any]:
    # A processor without these features warns that there is nothing to disable.
    command = [sys.executable, "-W", "ignore", "-c", OF_ANOTHER, str(Path(__file__).parent)]
    done = subprocess.run(command, env={**os.environ, **more}, capture_output=True, text=True, timeout=120, check=True)
    return json.loads(done.stdout)  # type: ignore[no-any-return]


@pytest.fixture(scope="module")
def said_here() -> list[Any]:
    return _said({})


@pytest.mark.long
@pytest.mark.parametrize(
    "setting", [*({"OPENBLAS_CORETYPE": core} for core in CORES), NO_AVX512], ids=[*CORES, "NumPy without AVX-512"]
)
def test_the_sums_of_another_processor_change_no_name_and_no_digit_that_is_shown(
    said_here: list[Any], setting: dict[str, str]
) -> None:
    """The core gives the same bits on every processor; a sum of NumPy or BLAS may end in another digit."""
    needed, processor = CORES.get(setting.get("OPENBLAS_CORETYPE", ""), ""), Path("/proc/cpuinfo")
    if processor.exists() and needed and needed not in processor.read_text().split():
        pytest.skip(f"this processor has no {needed}")

    def digits(text: str) -> str:
        return "\n".join(line for line in text.splitlines() if "simulations" not in line)

    here, there = said_here, _said(setting)
    assert there[:2] == here[:2] and here[0] == "explained"
    assert digits(there[4]) == digits(here[4])
    numbers = [np.array(_numbers(x)) for x in (here[2:4], there[2:4])]
    np.testing.assert_allclose(*numbers, rtol=1e-7)


def _numbers(x: object) -> list[float]:
    """Every number of a nested structure, in order."""
    if isinstance(x, dict):
        return [v for value in x.values() for v in _numbers(value)]
    if isinstance(x, list):
        return [v for value in x for v in _numbers(value)]
    return [float(x)] if isinstance(x, int | float) and not isinstance(x, bool) else []


@pytest.fixture(scope="module")
def varied() -> tuple[ga.Diagnosis, Any]:
    dia = ga.diagnose(recorded(4, LEVELS * 2, torque=True), CONTROLLER)
    return dia, dia.stability()


@pytest.mark.long
def test_a_cause_of_the_drive_is_named_in_its_variations(varied: tuple[ga.Diagnosis, Any]) -> None:
    """Dry friction is in every part of the record; with a torque logged it is looked for in half as many lines, too."""
    dia, found = varied
    assert [f.effect for f in dia.causes] == ["coulomb_friction"]
    whats = [v.what for v in found.variations]
    assert whats == ["first half", "middle half", "second half", "every second line", "seed 1", "seed 2"]
    again, of = found.named("coulomb_friction")
    assert of == 6 and again >= 5
    assert f"coulomb_friction: named in {again} of 6 variations that could show it" in found.summary()
    assert all(v.verdict in found.summary() for v in found.variations)
    with pytest.raises(ga.errors.SettingsError, match="the causes of this diagnosis are coulomb_friction"):
        found.named("backlash")


@pytest.mark.long
def test_stability_says_the_same_again_and_of_a_loaded_diagnosis(varied: tuple[ga.Diagnosis, Any]) -> None:
    dia, found = varied
    loaded = ga.Diagnosis.from_dict(dia.to_dict())
    with pytest.raises(ga.GaidentError, match=r"give stability\(records\)"):
        loaded.stability()
    said: list[tuple[float, str]] = []
    assert loaded.stability(dia.records, progress=lambda part, text: said.append((part, text))) == found
    assert said[0][1].startswith("first half: ") and [part for part, _ in said] == sorted(part for part, _ in said)
    assert json.loads(json.dumps(found.to_dict()))["causes"] == [["coulomb_friction"]]
    with pytest.raises(ga.errors.SettingsError, match="progress is 3"):
        dia.stability(progress=3)  # type: ignore[arg-type]


def test_a_cause_of_one_part_alone_is_a_hint() -> None:
    """Counted by what each variation says, whatever was diagnosed."""
    from gaident.results.what_if import Stability, Variation

    said = (
        Variation("first half", "explained", (("backlash",),)),
        Variation("second half", "adequate"),
        Variation("middle half", "explained", (("backlash", "compliance"),)),
        Variation("seed 1", "adequate", hidden=("backlash",)),
        Variation("seed 2", "", refused="too short"),
    )
    found = Stability("explained", (("backlash",),), said)
    assert found.named("backlash") == (1, 3)
    assert found.sentences[0] == "Verdict explained in 2 of 4 variations of the records."
    assert found.sentences[1].startswith("backlash: named in 1 of 3 variations that could show it, in 1 more not told apart")
    assert found.sentences[1].endswith(": a hint, and no cause to act on.")
    assert found.others == {}
    unseen = Stability("explained", (("backlash",),), said[3:])
    assert unseen.sentences[1] == "backlash: named in 0 of 0 variations that could show it."


@pytest.mark.long
def test_what_the_integrator_held_when_a_record_began_is_no_load() -> None:
    """Cut out of a run, without a torque: the integral at its start acts like a constant load, which the drive has not."""
    whole = recorded(4, LEVELS * 2)
    dia = ga.diagnose(whole[500:1500], CONTROLLER)
    found = {f.effect: f for f in dia.causes}
    assert "coulomb_friction" in found and not found["coulomb_friction"].alternatives
    assert all("integrator_start" in f.alternatives for name, f in found.items() if name == "load_torque")
    assert "load_torque" in found
    logged = ga.diagnose(recorded(4, LEVELS * 2, torque=True)[500:1500], CONTROLLER)
    assert [f.effect for f in logged.causes] == ["coulomb_friction"]
