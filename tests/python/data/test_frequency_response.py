"""FrequencyResponse: what it refuses, how it is read from text, and what a record shows of one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.errors import ReadError, RecordError

F = np.geomspace(2.0, 200.0, 40)
G = 1.0 / (0.002 * 2j * np.pi * F + 0.01)


def test_it_is_immutable_and_copies() -> None:
    f, g = F.copy(), G.copy()
    fr = ga.FrequencyResponse(f, g, name="axis 1")
    f[:], g[:] = 0.0, 0.0
    np.testing.assert_array_equal(fr.frequency_hz, F)
    np.testing.assert_array_equal(fr.response, G)
    with pytest.raises(AttributeError, match="immutable"):
        fr.name = "other"
    with pytest.raises(ValueError, match="read-only"):
        fr.response[0] = 0.0
    assert "axis 1" in repr(fr) and len(fr) == 40
    assert fr.digest == ga.FrequencyResponse(F, G, name="another").digest != ga.FrequencyResponse(F, 2.0 * G).digest
    part = fr.band(5.0, 100.0)
    assert part.frequency_hz[0] >= 5.0 and part.frequency_hz[-1] <= 100.0 and part.name == "axis 1"


WRONG = {
    "is not above the one before": {"frequency_hz": F[::-1]},
    "shape": {"response": np.stack([G, G])},
    "one of each for every frequency": {"std": np.ones(3)},
    "frequency_hz has 5": {"frequency_hz": F[:5], "response": G[:5]},
    "finite": {"response": np.where(F < 3.0, np.nan, G)},
    "coherence[0] = 50": {"coherence": np.full(40, 50.0)},
    "std[0] = 0": {"std": np.zeros(40)},
    "kind is 'bode'": {"kind": "bode"},
    "half the sampling frequency": {"dt": 0.01},
    "amplitude=-1": {"amplitude": -1.0},
    "give complex numbers": {"response": ["a"] * 40},
    "frequency_hz[0] = 0": {"frequency_hz": F - F[0]},
}


@pytest.mark.parametrize("message", WRONG)
def test_what_it_refuses(message: str) -> None:
    with pytest.raises(RecordError) as caught:
        ga.FrequencyResponse(**{"frequency_hz": F, "response": G, **WRONG[message]})
    assert message in str(caught.value)


def table(path: Path, head: str, *columns: np.ndarray, mark: str = ",", comma: bool = False) -> Path:
    rows = [mark.join(f"{x:.9g}" for x in row) for row in zip(*columns, strict=True)]
    text = "\n".join([head, *rows])
    path.write_text(text.replace(".", ",") if comma else text, encoding="utf-8")
    return path


def test_text_in_the_units_of_drives(tmp_path: Path) -> None:
    size, phase = np.abs(G), np.angle(G)
    decibel = 20.0 * np.log10(size)
    german = "Frequenz [Hz];Betrag [dB];Phase [Grad];Kohärenz [%]"
    a = table(tmp_path / "a.csv", german, F, decibel, np.degrees(phase), 0 * F + 99.0, mark=";", comma=True)
    b = table(tmp_path / "b.csv", "omega (rad/s)\treal\timag", 2 * np.pi * F, G.real, G.imag, mark="\t")
    c = table(tmp_path / "c.txt", "f/kHz,|G|,arg(G)/rad", 1e-3 * F[::-1], size[::-1], phase[::-1])
    rpm = table(tmp_path / "d.csv", "frequency [Hz],magnitude [1],phase [deg]", F, size * 30 / np.pi, np.degrees(phase))
    found = [
        ga.read_response(a),
        ga.read_response(b),
        ga.read_response(c, units={"magnitude": "1"}),
        ga.read_response(rpm, scale=np.pi / 30),
    ]
    for fr in found:
        np.testing.assert_allclose(fr.frequency_hz, F, rtol=1e-7)
        np.testing.assert_allclose(fr.response, G, rtol=1e-6)
    assert found[0].coherence is not None and found[0].coherence[0] == pytest.approx(0.99)
    assert found[0].name == "a.csv"


def test_the_amplitude_of_a_text_is_kept(tmp_path: Path) -> None:
    file = table(tmp_path / "a.csv", "f [Hz],real,imag", F, G.real, G.imag)
    assert ga.read_response(file, amplitude=0.3).amplitude == 0.3 and ga.read_response(file).amplitude is None
    with pytest.raises(RecordError, match="amplitude=-1"):
        ga.read_response(file, amplitude=-1.0)


def test_text_that_leaves_a_doubt_is_refused(tmp_path: Path) -> None:
    size = np.abs(G)
    no_unit = table(tmp_path / "a.csv", "frequency [Hz],magnitude,phase [deg]", F, size, 0 * F)
    with pytest.raises(ReadError, match=r"does not say its unit: give 'dB' or '1' in units=\{'magnitude'"):
        ga.read_response(no_unit)
    no_phase = table(tmp_path / "b.csv", "frequency [Hz],magnitude [dB],coherence", F, size, 0 * F + 0.9)
    with pytest.raises(ReadError, match="no column is known to be the phase"):
        ga.read_response(no_phase)
    twice = table(tmp_path / "c.csv", "frequency [Hz],magnitude A [dB],magnitude B [dB],phase [deg]", F, size, size, 0 * F)
    with pytest.raises(ReadError, match="2 columns may be the magnitude"):
        ga.read_response(twice)
    assert len(ga.read_response(twice, columns={"magnitude": "magnitude B"})) == 40
    with pytest.raises(ReadError, match="there is no such file"):
        ga.read_response(tmp_path / "none.csv")
    with pytest.raises(ReadError, match="did you mean 'magnitude'"):
        ga.read_response(no_unit, units={"magnitud": "dB"})


def test_rows_at_standstill_and_beyond_the_sampling_are_left_out_and_said(tmp_path: Path) -> None:
    f = np.concatenate([[0.0], F, [600.0]])
    g = np.concatenate([[100.0], G, [1e-3]])
    file = table(tmp_path / "a.csv", "f [Hz],re,im", f, g.real, g.imag)
    fr = ga.read_response(file, dt=1e-3)
    assert len(fr) == 40 and len(fr.notes) == 2 and "0 Hz" in fr.notes[0] and "half the sampling" in fr.notes[1]


def test_a_row_at_standstill_may_have_no_number_and_other_units_name_the_scale(tmp_path: Path) -> None:
    decibel, phase = 20.0 * np.log10(np.abs(G)), np.degrees(np.angle(G))
    file = table(
        tmp_path / "a.csv", "f [Hz],magnitude [dB],phase [deg]", np.r_[0.0, F], np.r_[-np.inf, decibel], np.r_[0.0, phase]
    )
    assert len(ga.read_response(file)) == 40
    rpm = table(tmp_path / "b.csv", "f [Hz],real [rpm/Nm],imag [rpm/Nm]", F, G.real * 30 / np.pi, G.imag * 30 / np.pi)
    with pytest.raises(ReadError, match=r"is in 'rpm/Nm'.*scale.*pi/30"):
        ga.read_response(rpm)
    share = table(tmp_path / "c.csv", "f [Hz],real,imag,std [%]", F, G.real, G.imag, 0 * F + 1.0)
    with pytest.raises(ReadError, match="std in column"):
        ga.read_response(share)
    turned = table(tmp_path / "d.csv", "f [Hz],real,imag", F, -G.real, -G.imag)
    np.testing.assert_allclose(ga.read_response(turned, scale=-1.0).response, G, rtol=1e-6)
    twice = table(tmp_path / "e.csv", "f [Hz],real,imag", np.r_[F, F[-1]], np.r_[G, G[-1]].real, np.r_[G, G[-1]].imag)
    with pytest.raises(ReadError, match=r"e\.csv: frequency_hz\[40\]"):
        ga.read_response(twice)


DT, LOOP = 1e-3, ga.PI(kp=0.02, ki=0.4)
DRIVE = ga.TwoMass(JM=2e-4, DM=1e-3, JL=3e-4, DL=1e-3, KG=12.0, DG=2e-3).model()


def held(f: np.ndarray) -> np.ndarray:
    """Of the drive behind a hold, by its difference equation in powers of 1/z."""
    equation = DRIVE.discrete(DT)
    back = np.exp(-2j * np.pi * np.outer(f * DT, np.arange(len(equation.alpha))))
    return (back @ equation.alpha) / (1.0 - back[:, 1:] @ equation.beta)


def record(command: np.ndarray, noise: float, seed: int = 1) -> ga.Record:
    n = noise * np.random.default_rng(seed).standard_normal(len(command))
    done = ga.run(DRIVE, ga.Record(DT, command=command - n, velocity=0.0 * command), LOOP)
    return ga.Record(DT, command=command, velocity=done.velocity + n, torque=done.torque)


def test_a_multisine_is_averaged_over_its_periods_without_the_loops_bias() -> None:
    n, lines = 1000, np.arange(2, 400, 3)
    rng = np.random.default_rng(2)
    period = sum(0.8 * np.cos(2 * np.pi * k * np.arange(n) / n + rng.uniform(0, 6.28)) for k in lines)
    fr = ga.frequency_response(record(np.tile(period, 8), 0.3), LOOP)
    np.testing.assert_allclose(fr.frequency_hz, lines / (n * DT))
    off = np.abs(fr.response - held(fr.frequency_hz)) / fr.std
    assert fr.dt == DT and 0.8 < np.sqrt(np.mean(off**2)) < 1.25  # the stated deviations, no bias
    assert "Mean of 7 periods of 1000 lines" in fr.notes[0]
    idn = ga.identify(fr)
    assert (idn.p, idn.q, idn.falsified) == (1, 2, False)
    assert pytest.approx(2e-4, rel=0.03) == idn.mechanics.with_shaft_damping.JM


def test_without_periods_local_polynomials_have_deviations_that_hold() -> None:
    command = 20.0 * np.repeat(np.random.default_rng(3).choice([-1.0, 1.0], 4000), 4)
    fr = ga.frequency_response(record(command, 0.5), LOOP)
    away = np.abs(np.log(fr.frequency_hz / 50.0)) > 0.1  # the resonance is narrower than a window
    off = np.abs(fr.response - held(fr.frequency_hz)) / fr.std
    assert 0.7 < np.sqrt(np.mean(off[away] ** 2)) < 1.4
    idn = ga.identify(fr)
    assert (idn.p, idn.q) == (1, 2) and pytest.approx(2e-4, rel=0.03) == idn.mechanics.with_shaft_damping.JM


def test_a_multisine_of_few_lines_has_a_deviation_for_each() -> None:
    n, lines = 1000, np.unique(np.rint(np.geomspace(3, 400, 9)).astype(int))
    torque = np.tile(sum(np.cos(2 * np.pi * k * np.arange(n) / n + k * k) for k in lines), 6)
    still = ga.Record(DT, torque=torque, velocity=0.0 * torque)
    noise = 0.1 * np.random.default_rng(5).standard_normal(len(torque))
    fr = ga.frequency_response(ga.Record(DT, torque=torque, velocity=ga.simulate(DRIVE, still) + noise))
    assert len(fr) == 9 and np.all(fr.std > 0.0)


def test_records_that_show_none_are_refused() -> None:
    slow = ga.Cascade(LOOP, period=DT / 4)
    stepped = record(np.repeat([1.0, -1.0, 2.0, 0.0], 500), 0.1)
    with pytest.raises(RecordError, match="slower than its controller"):
        ga.frequency_response(stepped, slow)
    still = np.ones(2000)
    with pytest.raises(RecordError, match="command of this loop never changes"):
        ga.frequency_response(record(still, 0.1), LOOP)
    with pytest.raises(RecordError, match="no torque"):
        ga.frequency_response(ga.Record(DT, command=np.arange(500.0), velocity=np.arange(500.0)))
    with pytest.raises(RecordError, match="longer record"):
        ga.frequency_response(ga.Record(DT, torque=np.sin(np.arange(60.0)), velocity=np.arange(60.0)))
    with pytest.raises(RecordError, match="rec is list"):
        ga.frequency_response([1.0])  # type: ignore[arg-type]
