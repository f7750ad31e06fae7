"""friction_map(): speeds that are held, the torque of each, and the law of friction behind them."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

import gaident as ga
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.identification.notes import slower_than_the_loop
from gaident.remedies.steady.laws import laws_of
from gaident.remedies.steady.plateaus import Plateau, plateaus_of

DT = 0.02
SPEEDS = (0.5, 1.0, 2.0, 4.0, 8.0, 15.0, 25.0, 40.0)
BOTH = (*SPEEDS, *(-s for s in SPEEDS))

Vector = NDArray[np.float64]


def held(speeds: tuple[float, ...], torque: Callable[[Vector], Vector], std: float = 2e-4, seed: int = 0) -> list[Plateau]:
    """Plateaus as they are found: the torque of a law at each speed, with errors of their deviations."""
    w = np.array(speeds)
    seen = torque(w) + std * np.random.default_rng(seed).standard_normal(len(w))
    return [Plateau("run", 0.0, 1.0, float(v), float(u), std, 50.0, 50) for v, u in zip(w, seen, strict=True)]


def stairs(levels: tuple[float, ...], seed: int = 0, lines: int = 100, ramp: int = 20, pole: float = 0.0) -> ga.Record:
    """Levels with ramps between them; torque 0.05 sign(w) + 2e-3 w + 1e-3 dw/dt and AR(1) noise of 0.01 N m on it."""
    rng = np.random.default_rng(seed)
    corners = np.cumsum([0, *([ramp, lines] * len(levels))])
    w = np.interp(np.arange(corners[-1]), corners, np.repeat([0.0, *levels], 2)[1:])
    noise = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.standard_normal(len(w)))
    torque = 0.05 * np.sign(w) + 2e-3 * w + 1e-3 * np.gradient(w, DT) + 0.01 * noise
    return ga.Record(DT, velocity=w + 0.02 * rng.standard_normal(len(w)), torque=torque, name="stairs")


def of(rec: ga.Record, inertia: float | None = None) -> list[Plateau]:
    return plateaus_of(rec, rec.name, inertia, np.full(len(rec), np.nan))[0]


def test_every_speed_that_is_held_is_found_and_nothing_else() -> None:
    levels = (2.0, 5.0, 10.0, -10.0, 0.0, -5.0, 20.0)
    found = of(stairs(levels))
    assert [round(p.velocity, 1) for p in found] == [v for v in levels if v], "standstill is no speed"
    for place, p in zip([0, 1, 2, 3, 5, 6], found, strict=True):
        begin = (20 + 120 * place) * DT
        assert begin - 0.1 < p.start < begin + 0.2 and p.stop - p.start == pytest.approx(100 * DT, abs=0.2)
        assert p.torque == pytest.approx(0.05 * np.sign(p.velocity) + 2e-3 * p.velocity, abs=4.0 * p.std)
        assert p.samples == round((p.stop - p.start) / DT) and np.isnan(p.temperature)
    t = DT * np.arange(2000)
    ramps = 40.0 * np.abs((t / 4.0) % 2.0 - 1.0) + 1.0  # with their turning points
    assert not of(ga.Record(DT, velocity=ramps, torque=0.1 + 0.0 * t)), "no piece of a ramp is held, no turning point"


@pytest.mark.parametrize("pole", [0.0, 0.8])
def test_the_deviation_of_a_plateau_is_that_of_independent_samples(pole: float) -> None:
    off, std = [], []
    for seed in range(40):
        found = of(stairs((10.0, -10.0), seed, lines=300, pole=pole))
        assert len(found) == 2
        off += [(p.torque - 0.05 * np.sign(p.velocity) - 2e-3 * p.velocity) / p.std for p in found]
        std += [p.std for p in found]
    assert 0.75 < np.sqrt(np.mean(np.square(off))) < 1.35
    independent = 300 * (1.0 - pole) / (1.0 + pole)
    assert np.mean(std) == pytest.approx(0.01 / np.sqrt(independent), rel=0.2)


def test_a_known_inertia_is_taken_out_and_keeps_accelerations_away() -> None:
    t = DT * np.arange(400)
    w = 10.0 + 0.04 * t  # 3 % in 8 s
    rec = ga.Record(DT, velocity=w, torque=0.1 + 0.05 * 0.04 + 0.0 * t)
    (plain,), (known,) = of(rec), of(rec, 0.05)
    assert plain.torque == pytest.approx(0.102) and known.torque == pytest.approx(0.1, abs=1e-6)
    found, left = plateaus_of(rec, "run", 0.5, np.full(len(rec), np.nan))
    assert not found and left.accelerating == 1
    notes = ga.friction_map(rec, inertia=0.5).notes
    assert any("1 stretch is left out, in which the torque of the acceleration is more than 5 %" in n for n in notes)


def test_a_ripple_of_the_angle_does_not_cut_a_held_speed() -> None:
    rng = np.random.default_rng(3)
    t = DT * np.arange(600)
    ripple = np.sin(2.0 * np.pi * t / 1.7)
    w = 5.0 + 0.25 * ripple + 0.05 * rng.standard_normal(len(t))
    (one,) = of(ga.Record(DT, velocity=w, torque=0.1 + 0.03 * ripple + 0.002 * rng.standard_normal(len(t))))
    assert (
        one.samples > 500 and one.velocity == pytest.approx(5.0, rel=0.01) and one.torque == pytest.approx(0.1, abs=3.0 * one.std)
    )


def test_an_axis_that_stands_under_a_sensor_with_an_offset_holds_no_speed() -> None:
    rng = np.random.default_rng(5)
    w = -0.011 + 0.002 * rng.standard_normal(500)
    torque = np.linspace(0.0, 0.5, 500)
    assert not of(ga.Record(DT, velocity=w, torque=torque, position=1e-4 * rng.standard_normal(500)))
    sticks = np.where(np.arange(500) % 60 < 30, 0.0, 2.0)  # for a second in two
    rec = ga.Record(DT, velocity=sticks, torque=torque + 0.1)
    assert not [p for p in of(rec) if p.samples > 60]


ODD: dict[str, tuple[Callable[[Vector], Vector], dict[str, dict[str, float]]]] = {
    "viscous": (lambda w: 4e-3 * w, {}),
    "dry": (lambda w: 2e-3 * w + 0.05 * np.sign(w), {"coulomb_friction": {"torque": 0.05}}),
    "dry, loaded": (
        lambda w: 2e-3 * w + 0.05 * np.sign(w) + 0.01,
        {"coulomb_friction": {"torque": 0.05}, "load_torque": {"torque": 0.01}},
    ),
    "by direction": (
        lambda w: 2e-3 * w + np.where(w > 0.0, 0.05 + 1e-3 * w, -0.03),
        {"asymmetric_friction": {"torque_positive": 0.05, "torque_negative": 0.03, "viscous_positive": 1e-3}},
    ),
    "hump": (
        lambda w: 2e-3 * w + (0.05 + 0.03 * np.exp(-((w / 3.0) ** 2))) * np.sign(w),
        {"stribeck_friction": {"torque": 0.05, "static_torque": 0.08, "stribeck_velocity": 3.0}},
    ),
    "drag": (
        lambda w: 0.05 * np.sign(w) + 1e-4 * w * np.abs(w),
        {"coulomb_friction": {"torque": 0.05}, "quadratic_drag": {"coefficient": 1e-4}},
    ),
    "grease": (
        lambda w: 0.05 * np.sign(w) + 0.02 * np.sign(w) * np.sqrt(np.abs(w)),
        {"coulomb_friction": {"torque": 0.05}, "square_root_drag": {"coefficient": 0.02}},
    ),
}


@pytest.mark.parametrize("name", ODD)
def test_the_law_is_named_with_its_numbers(name: str) -> None:
    torque, truth = ODD[name]
    plateaus = held(BOTH, torque)
    best, *rivals = laws_of(plateaus).laws
    assert set(best.effects) == set(truth)
    for effect, parameters in truth.items():
        for key, value in parameters.items():
            e = best.effects[effect][key]
            assert abs(e.value - value) < 4.0 * e.std and e.std < 0.1 * value, (effect, key)
    w = np.array(BOTH)
    assert np.allclose(best.torque(w), torque(w), atol=1e-3) and best.numbers == 1 + sum(map(len, best.effects.values())) - (
        name == "by direction"
    )
    assert all(best.bic <= rival.bic < best.bic + 10.0 for rival in rivals)
    assert not any(set(best.effects) <= set(rival.effects) for rival in rivals), "what only adds to it is no rival"


@pytest.mark.long
def test_numbers_of_a_law_are_as_far_off_as_their_deviations_say() -> None:
    off = []
    for seed in range(12):
        law = laws_of(held(BOTH, ODD["dry, loaded"][0], seed=seed)).laws[0]
        if set(law.effects) == {"coulomb_friction", "load_torque"}:
            found = (law.viscous, law.effects["coulomb_friction"]["torque"], law.effects["load_torque"]["torque"])
            off += [(e.value - v) / e.std for e, v in zip(found, (2e-3, 0.05, 0.01), strict=True)]
    assert len(off) >= 24 and 0.6 < np.sqrt(np.mean(np.square(off))) < 1.4


def test_plateaus_that_differ_by_more_than_their_deviations_widen_the_law() -> None:
    exact = held(BOTH, ODD["dry"][0], std=1e-5)
    rough = [
        Plateau(p.record, p.start, p.stop, p.velocity, p.torque + 2e-3 * e, p.std, p.independent, p.samples)
        for p, e in zip(exact, np.random.default_rng(2).standard_normal(len(exact)), strict=True)
    ]
    fitted = laws_of(rough)
    assert fitted.beyond == pytest.approx(2e-3, rel=0.5)
    level = fitted.laws[0].effects["coulomb_friction"]["torque"]
    assert level.std > 3e-4 and abs(level.value - 0.05) < 4.0 * level.std


def test_what_the_plateaus_cannot_tell_is_said_with_the_speeds_that_would() -> None:
    one = ga.friction_map(stairs((10.0, -10.0), ramp=100), inertia=1e-3)
    assert one.law is None and any("The one speed that is held, 9.99" in n for n in one.notes)
    assert any("5, 2, 1, 0.5, 0.2 rad/s" in n for n in one.notes) and "Law:" not in one.summary()
    forwards = ga.friction_map(stairs((2.0, 5.0, 10.0, 20.0), ramp=100), inertia=1e-3)
    assert any("held in one direction" in n and "Hold the same speeds in the other" in n for n in forwards.notes)
    assert forwards.law is not None and not {"load_torque", "asymmetric_friction"} & set(forwards.law.effects)
    two = ga.friction_map(stairs((10.0, 20.0, -20.0, -10.0), ramp=100), inertia=1e-3)
    assert two.law is not None and two.law.effects["coulomb_friction"]["torque"].value == pytest.approx(0.05, abs=0.01)
    few, slow, _ = two.notes
    assert few.startswith("2 speeds are held, too few for stribeck friction") and few.endswith("hold 4 at least, both ways.")
    assert "quadratic drag" in few and "the slowest speed that is held" in slow and "Hold slower ones: 4, 2, 1, 0.4 rad/s" in slow
    none = ga.friction_map(ga.Record(DT, velocity=np.linspace(1.0, 50.0, 400), torque=np.ones(400)), inertia=1e-6)
    assert none.law is None and not none.plateaus and any(n.startswith("No speed is held, for 20 lines") for n in none.notes)


def test_torques_without_noise_and_of_the_wrong_sign_are_taken() -> None:
    w = np.repeat([1.0, 2.0, 5.0, 10.0, -10.0, -5.0, -2.0, -1.0], 60)
    exact = ga.friction_map(ga.Record(DT, velocity=w, torque=0.1 * np.sign(w) + 0.01 * w))
    assert exact.law is not None and exact.law.effects["coulomb_friction"]["torque"].value == pytest.approx(0.1, rel=1e-6)
    assert "Held speeds" in exact.summary() and len(exact.plateaus) == 8
    nothing = ga.friction_map(ga.Record(DT, velocity=w, torque=0.0 * w))
    assert nothing.law is None and len(nothing.plateaus) == 8 and "Held speeds" in nothing.summary()
    turned = ga.friction_map(ga.Record(DT, velocity=w, torque=-0.1 * np.sign(w)))
    assert any("against the motion" in n and "check its sign" in n for n in turned.notes)


def test_a_temperature_is_regressed_beside_the_law() -> None:
    def run(heat: float, seed: int) -> ga.Record:
        rec = stairs((*BOTH[:8:2], *BOTH[8::2]), seed, ramp=40)
        assert rec.torque is not None
        return rec.with_channels(torque=rec.torque - 1e-3 * (heat - 30.0) * np.sign(rec.velocity))

    degrees = (20.0, 30.0, 45.0)
    records = [run(heat, seed) for seed, heat in enumerate(degrees)]
    slope = ga.friction_map(records, temperature=degrees).temperature_slope
    assert slope is not None and abs(slope.value + 1e-3) < 4.0 * slope.std and slope.std < 3e-4
    along = [np.full(len(rec), heat) for rec, heat in zip(records, degrees, strict=True)]
    found = ga.friction_map(records, temperature=along)
    assert found.temperature_slope == slope and {p.temperature for p in found.plateaus} == set(degrees)
    assert "per degree, a change" in found.summary() and "N per degree" in found.summary("linear")
    assert ga.friction_map(records[0], temperature=20.0).temperature_slope is None, "one temperature has no slope"
    for wrong, told in (((1.0, 2.0), "2 entries and there are 3 records"), ((1.0, "warm", None), "temperature is 'warm'"),
                        ((1.0, np.ones(7), None), r"shape \(7,\) for a record")):  # fmt: skip
        with pytest.raises(ga.GaidentError, match=told):
            ga.friction_map(records, temperature=wrong)


def test_tables_and_picture_have_what_was_found(tmp_path: Path) -> None:
    found = ga.friction_map(stairs((*BOTH[::2], *BOTH[1::2]), ramp=40))
    assert found.law is not None
    found.to_csv(tmp_path / "held.csv", "plateaus")
    rows = list(csv.DictReader((tmp_path / "held.csv").read_text().splitlines()))
    assert len(rows) == len(found.plateaus) == 16
    for row, p in zip(rows, found.plateaus, strict=True):
        assert float(row["torque"]) == p.torque and float(row["std"]) == p.std and row["record"] == "stairs"
        assert float(row["law"]) == pytest.approx(float(found.law.torque(p.velocity)))
    found.save(tmp_path / "map.json")
    data = json.loads((tmp_path / "map.json").read_text())
    assert data["schema"] == "gaident/friction_map" and len(data["plateaus"]) == 16
    assert data["law"]["effects"]["coulomb_friction"]["torque"]["value"] == found.law.effects["coulomb_friction"]["torque"].value
    bins, held_speeds = found.plot().axes
    assert len(bins.containers) == 1 == len(held_speeds.containers) and "held speeds" in held_speeds.get_ylabel()
    assert "coulomb friction" in found.summary() and "N m" not in found.summary("linear")
    with pytest.raises(ga.GaidentError, match="rows is 'all'"):
        found.to_csv(tmp_path / "all.csv", "all")


def test_held_speeds_without_an_inertia_are_mapped() -> None:
    """A record of one speed each, as a signal generator is logged: nothing in them accelerates."""
    rng = np.random.default_rng(4)

    def run(v: float) -> ga.Record:
        torque = 2e-3 * v + 0.05 * np.sign(v) + 0.002 * rng.standard_normal(200)
        return ga.Record(DT, velocity=v + 0.05 * rng.standard_normal(200), torque=torque)

    records = [run(v) for v in (2.0, 5.0, 10.0, -10.0, -5.0, -2.0)]
    found = ga.friction_map(records)
    assert np.isnan(found.inertia) and any(n.startswith("The records show no inertia") for n in found.notes)
    assert found.law is not None and found.law.effects["coulomb_friction"]["torque"].value == pytest.approx(0.05, abs=2e-3)
    assert "half of the difference" not in found.summary(), "its bins contain the acceleration"
    (only,) = found.plot().axes
    assert "held speeds" in only.get_ylabel() and len(only.containers) == 6


@pytest.mark.long
def test_a_log_slower_than_its_loop_gives_the_friction_within_its_deviations() -> None:
    """Controller 0.5 ms, loop 2 ms, log 20 ms: what `diagnose` says such a log still shows."""
    skip_without_library()
    servo = ga.Cascade(ga.PI(0.5, 20.0), 0.5e-3)
    plant = Plant(J=1e-3, D=2e-3, kp=0.5, ki=20.0, dt=20e-3, cascade=servo)
    (note,) = slower_than_the_loop(plant.J, servo, plant.dt)
    assert "settles in 2 ms" in note and "a line every 20 ms" in note and "`gaident.friction_map`" in note
    truth = {"torque": 0.05, "static_torque": 0.08, "stribeck_velocity": 4.0}
    speeds = np.array([1.0, 2.0, 4.0, 7.0, 12.0, 20.0, 30.0, 45.0])
    off = []
    for seed in range(3):
        command = np.repeat(np.concatenate([speeds, -speeds]), 100)
        found = ga.friction_map(rig(plant, command, {"stribeck_friction": truth}, Noise(white=0.03), seed))
        assert len(found.plateaus) == 16 and found.law is not None and set(found.law.effects) == {"stribeck_friction"}
        numbers = [*found.law.effects["stribeck_friction"].items(), ("viscous", found.law.viscous)]
        off += [(e.value - (truth | {"viscous": plant.D})[name]) / e.std for name, e in numbers]
        assert all(e.std < 0.25 * e.value for _, e in numbers)
    assert np.max(np.abs(off)) < 4.0 and np.sqrt(np.mean(np.square(off))) < 2.0


def test_a_number_at_its_bound_is_judged_there() -> None:
    """Of a fall from rest at no speed the torque jumps, however near the bound the solver ends."""
    speeds = np.array([2.0, 5.0, 10.0, 20.0, -2.0, -5.0, -10.0, -20.0])
    noise = np.random.default_rng(0).standard_normal((60, 8))[43]
    torque = 0.02 * speeds + 0.3 * np.sign(speeds) + 1e-3 * noise
    found = laws_of([Plateau("a", 0, 1, float(v), float(u), 1e-3, 50.0, 50) for v, u in zip(speeds, torque, strict=True)])
    assert "coulomb_friction" in found.laws[0].effects and found.beyond < 2e-3
    assert found.laws[0].effects["coulomb_friction"]["torque"].value == pytest.approx(0.3, abs=4e-3)
