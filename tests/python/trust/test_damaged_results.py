"""Saved results that are damaged: refused when they are loaded, with a line that says where, or as good as before."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from places import GOLDEN

VALUES: list[Any] = [None, True, "x", "", 0, -1, 1.5, 1e300, [], [1], [[]], {}, {"a": 1}, {"number": "nan"}, {"number": "x"}]


def places(x: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place of plain data, of long lists the first ones."""
    if at:
        yield at
    inside = x.items() if isinstance(x, dict) else enumerate(x[:3]) if isinstance(x, list) else ()
    for key, value in inside:
        yield from places(value, (*at, key))


def damaged(data: Any, at: tuple[Any, ...], rng: np.random.Generator) -> Any:
    """The data with one place taken out, doubled, or with another value in it."""
    other = copy.deepcopy(data)
    inside = other
    for key in at[:-1]:
        inside = inside[key]
    kind = rng.integers(0, 3)
    if kind == 0:
        del inside[at[-1]]
    elif kind == 1 and isinstance(inside, list):
        inside.insert(at[-1], copy.deepcopy(inside[at[-1]]))
    else:
        inside[at[-1]] = VALUES[rng.integers(0, len(VALUES))]
    return other


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Plain data of an identification, a diagnosis, one of an earlier version, and a record."""
    folder = tmp_path_factory.mktemp("saved")
    pi = ga.PI(0.02, 0.5)
    command = np.repeat([0.0, 20.0, -5.0, 60.0, -40.0, 3.0], 60)
    noise = 0.05 * np.random.default_rng(0).standard_normal(len(command))
    drive = ga.OneMass(J=2e-4, D=3e-3).model().with_effect("coulomb_friction", torque=0.02)
    run = ga.run(drive, ga.Record(1e-3, command=command, velocity=noise), pi)
    rec = ga.Record(1e-3, command=command, velocity=run.velocity + noise, torque=run.torque)
    idn = ga.identify(rec, pi)
    found = {"identification": idn, "diagnosis": ga.diagnose(rec, pi, idn), "record": rec[:30]}
    for name, result in found.items():
        result.save(folder / f"{name}.json")
    old = json.loads((GOLDEN / "diagnosis_schema_1.json").read_text())
    return {name: json.loads((folder / f"{name}.json").read_text()) for name in found} | {"old": old}


def used(result: ga.Identification | ga.Diagnosis | ga.Record) -> None:
    """What is done with a loaded result."""
    if isinstance(result, ga.Record):
        assert len(result) and repr(result) and result.to_dict()
        return
    assert result.summary() and result.to_json()
    assert ga.simulate(result.model, ga.Record(1e-3, torque=np.ones(20), velocity=np.zeros(20))).shape == (20,)


@pytest.mark.long
@pytest.mark.parametrize("name", ["identification", "diagnosis", "record", "old"])
def test_a_damaged_result_is_refused_or_can_be_used(name: str, saved: dict[str, Any], tmp_path: Path) -> None:
    """A third was loaded, and failed where it was used."""
    rng, data = np.random.default_rng(1), saved[name]
    everywhere = list(places(data))
    chosen = rng.permutation(len(everywhere))[:400]
    path, wrong, refused = tmp_path / "damaged.json", [], 0
    for k in chosen:
        other = damaged(data, everywhere[k], rng)
        path.write_text(json.dumps(other))
        try:
            with np.errstate(all="ignore"):
                used(ga.load(path))
        except ga.GaidentError as error:
            assert "\n" not in str(error)
            refused += 1
        except Exception as error:
            wrong.append(f"{everywhere[k]}: {type(error).__name__}: {error}")
    assert not wrong, "\n".join(wrong)
    assert refused > len(chosen) // 4


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        '{"schema": ' * 50_000,
        '{"schema": NaN}',
        '{"dt": ' + "9" * 5000 + "}",
        '{"schema": "gaident/record"}',
        "",
        "\0",
    ],
)
def test_what_is_no_result_is_one_error(text: str, tmp_path: Path) -> None:
    path = tmp_path / "no.json"
    path.write_text(text)
    with pytest.raises(ga.GaidentError, match=r"no\.json"):
        ga.load(path)


def test_the_place_of_the_damage_is_named(saved: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "idn.json"
    data = copy.deepcopy(saved["identification"])
    name = next(iter(data["parameters"]))
    data["parameters"][name]["std"] = "small"
    path.write_text(json.dumps(data))
    with pytest.raises(ga.GaidentError, match=rf"idn\.json: parameters\.{name}\.std is 'small' where .* is needed"):
        ga.load(path)
