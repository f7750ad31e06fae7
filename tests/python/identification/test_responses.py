"""identify() of measured frequency responses: structure, parameters and deviations right, alone and beside records.

The responses are made here, of state-space models in SciPy and of formulas, and not by the library's simulation.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

import gaident as ga
from gaident.errors import GaidentError, RecordError, SettingsError, SpaceError

JM, DM, JL, DL, KG, DG = 2e-4, 1e-3, 3e-4, 1e-3, 12.0, 2e-3
F = np.geomspace(5.0, 400.0, 60)


def state_space() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two masses; states: both velocities and the twist."""
    A = np.array([[-(DM + DG) / JM, DG / JM, -KG / JM], [DG / JL, -(DL + DG) / JL, KG / JL], [1.0, -1.0, 0.0]])
    return A, np.array([1.0 / JM, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])


def exact(f: np.ndarray = F, dt: float | None = None) -> np.ndarray:
    """C (v - A)^-1 B: v = j omega, or e^(j omega dt) with what A and B become behind a hold."""
    A, B, C = state_space()
    variable = 2j * np.pi * f
    if dt is not None:
        block = np.zeros((4, 4))
        block[:3, :3], block[:3, 3] = A, B
        whole = expm(block * dt)
        A, B, variable = whole[:3, :3], whole[:3, 3], np.exp(variable * dt)
    return np.array([C @ np.linalg.solve(v * np.eye(3) - A, B) for v in variable])


def noisy(g: np.ndarray, share: float, seed: int) -> np.ndarray:
    """With complex errors in proportion to the magnitude."""
    e = np.random.default_rng(seed).standard_normal((2, len(g)))
    return g * (1.0 + share / np.sqrt(2.0) * (e[0] + 1j * e[1]))


def within(idn: ga.Identification, deviations: float = 4.0) -> None:
    """Every number of the mechanism, by its deviation."""
    assert isinstance(idn.mechanics, ga.TwoMass)
    found = idn.mechanics.with_shaft_damping
    assert found is not None and (idn.p, idn.q) == (1, 2) and not idn.falsified
    for name, truth in (("JM", JM), ("DM", DM), ("JL", JL), ("DL", DL), ("KG", KG), ("DG", DG)):
        off = abs(getattr(found, name) - truth)
        assert off < deviations * found.std[name], name
        assert found.std[name] < 0.2 * truth, name


@pytest.mark.parametrize("dt", [None, 1e-3])
@pytest.mark.parametrize("stated", [True, False])
def test_two_masses_from_one_response(dt: float | None, stated: bool) -> None:
    g = noisy(exact(dt=dt), 0.01, 1)
    idn = ga.identify(ga.FrequencyResponse(F, g, 0.01 * np.abs(g) if stated else None, dt=dt))
    within(idn)
    assert idn.of_responses and idn.frequencies == 60 and idn.samples == 0 and 0.005 < idn.rmse < 0.02
    assert any("without standard deviations" in w for w in idn.warnings) != stated


def test_kinds_of_response_are_one_model() -> None:
    s = 2j * np.pi * F
    for kind, g in (("torque to position", exact() / s), ("torque to acceleration", exact() * s)):
        within(ga.identify(ga.FrequencyResponse(F, noisy(g, 0.01, 2), kind=kind)))


def test_deviations_hold_over_many_responses() -> None:
    """Of 95 % intervals, over 40 responses and six numbers each, 90 to 99 % contain the truth."""
    inside = []
    truth = np.array([JM, DM, JL, DL, KG, DG])
    for seed in range(40):
        g = noisy(exact(), 0.02, 100 + seed)
        m = ga.identify(ga.FrequencyResponse(F, g, 0.02 * np.abs(exact()))).mechanics.with_shaft_damping
        found = np.array([m.JM, m.DM, m.JL, m.DL, m.KG, m.DG])
        inside.append(np.abs(found - truth) < 1.96 * np.array([m.std[n] for n in ("JM", "DM", "JL", "DL", "KG", "DG")]))
    assert 0.90 < np.mean(inside) < 0.99


def test_several_responses_count_together() -> None:
    parts = [ga.FrequencyResponse(F, noisy(exact(), 0.02, s), 0.02 * np.abs(exact())) for s in (5, 6, 7, 8)]
    one, all_four = ga.identify(parts[0]), ga.identify(parts)
    within(all_four)
    ratio = all_four.mechanics.std["J"] / one.mechanics.std["J"]
    assert 0.4 < ratio < 0.6  # half, as of four times the data
    assert ga.identify(parts[::-1]) == all_four  # the order is nobody's
    with pytest.raises(RecordError, match="the same data"):
        ga.identify([parts[0], parts[0]])


def test_a_delay_in_the_path_is_found_and_taken_out() -> None:
    late = 0.4e-3
    g = noisy(exact() * np.exp(-2j * np.pi * F * late), 0.01, 9)
    idn = ga.identify(ga.FrequencyResponse(F, g, 0.01 * np.abs(g)))
    within(idn)
    assert idn.delay is not None and abs(idn.delay.value - late) < 4.0 * idn.delay.std < 1e-5
    assert any("behind a delay of 0.399" in w for w in idn.warnings)
    again = ga.Identification.from_dict(idn.to_dict())
    assert again == idn and again.delay == idn.delay


@pytest.mark.parametrize(("late", "lag"), [(0.3e-3, 0.2e-3), (0.0, 0.4e-3), (0.05e-3, 0.6e-3)])
def test_delay_and_lag_of_the_path_are_told_apart(late: float, lag: float) -> None:
    """A delay turns the phase alone, a lag makes the magnitude smaller, too."""
    g = noisy(exact() * np.exp(-2j * np.pi * F * late) / (1.0 + 2j * np.pi * F * lag), 0.01, 22)
    idn = ga.identify(ga.FrequencyResponse(F, g, 0.01 * np.abs(g)))
    within(idn)
    assert idn.lag is not None and abs(idn.lag.value - lag) < 4.0 * idn.lag.std < 2e-5
    assert (idn.delay is None) == (late == 0.0)
    if idn.delay is not None:
        assert abs(idn.delay.value - late) < 4.0 * idn.delay.std < 2e-5
    assert any(f"a lag of {1e3 * idn.lag.value:.4g} +- {1e3 * idn.lag.std:.2g} ms (the current loop" in w for w in idn.warnings)
    again = ga.Identification.from_dict(idn.to_dict())
    assert again == idn and again.lag == idn.lag


@pytest.mark.long
def test_deviations_of_a_lag_hold_where_the_noise_is_large() -> None:
    """With 20 % of noise the mean error is chance, and the errors are as large as stated."""
    lag, f = 0.4e-3, np.geomspace(5.0, 400.0, 300)
    g = 1.0 / ((1e-3 + 2j * np.pi * f * 2e-4) * (1.0 + 2j * np.pi * f * lag))
    off = []
    for seed in range(16):
        idn = ga.identify(ga.FrequencyResponse(f, noisy(g, 0.2, seed), 0.2 * np.abs(g)))
        assert idn.lag is not None and idn.delay is None
        off.append((idn.lag.value - lag) / idn.lag.std)
    assert abs(np.mean(off)) < 3.0 / np.sqrt(len(off)) and 0.5 < np.std(off) < 1.5


@pytest.mark.parametrize("count", [8, 9, 12])
@pytest.mark.parametrize("stated", [True, False])
def test_few_frequencies_behind_delay_and_lag_have_both(count: int, stated: bool) -> None:
    """A delay alone leaves little there that a test would show, yet both are worth 60 units of BIC and more."""
    f = np.geomspace(5.0, 400.0, count)
    g = noisy(exact(f) * np.exp(-2j * np.pi * f * 0.3e-3) / (1.0 + 2j * np.pi * f * 0.2e-3), 0.01, 1)
    idn = ga.identify(ga.FrequencyResponse(f, g, 0.01 * np.abs(g) if stated else None))
    assert (idn.p, idn.q) == (1, 2) and not idn.falsified and idn.path.keys() == {"delay", "lag"}
    for name, truth in (("delay", 0.3e-3), ("lag", 0.2e-3)):
        assert abs(idn.path[name].value - truth) < 4.0 * idn.path[name].std < 6e-5


@pytest.mark.parametrize("lag", [6e-3, 20e-3])
@pytest.mark.parametrize("late", [0.0, 1e-3])
def test_a_long_lag_is_found(late: float, lag: float) -> None:
    g = noisy(exact() * np.exp(-2j * np.pi * F * late) / (1.0 + 2j * np.pi * F * lag), 0.01, 1)
    idn = ga.identify(ga.FrequencyResponse(F, g, 0.01 * np.abs(g)))
    within(idn)
    assert idn.lag is not None and abs(idn.lag.value - lag) < 4.0 * idn.lag.std < 0.02 * lag
    assert (idn.delay is None) == (late == 0.0)


def held_late(f: np.ndarray, dt: float, late: float, lag: float) -> np.ndarray:
    """The two masses behind a hold, a delay and a lag, from the matrix exponential over both parts of a sample."""
    A, B, C = state_space()
    if lag:
        A, B, C = (
            np.block([[A, B[:, None]], [np.zeros((1, 3)), np.full((1, 1), -1.0 / lag)]]),
            np.eye(4)[3] / lag,
            np.append(C, 0.0),
        )
    n = len(B)

    def over(time: float) -> tuple[np.ndarray, np.ndarray]:
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n] = A, B
        whole = expm(block * time)
        return whole[:n, :n], whole[:n, n]

    samples, rest = divmod(late, dt)
    (late_F, late_G), (early_F, early_G) = over(dt - rest), over(rest)
    z = np.exp(2j * np.pi * f * dt)
    answers = [C @ np.linalg.solve(v * np.eye(n) - late_F @ early_F, late_G + late_F @ early_G / v) for v in z]
    return np.array(answers) * z**-samples


@pytest.mark.parametrize(("late", "lag"), [(0.3e-3, 0.0), (1.5e-3, 0.0), (0.0, 0.4e-3), (1e-3, 2e-3), (0.5e-3, 0.4e-3)])
def test_a_path_behind_a_hold_is_exact(late: float, lag: float) -> None:
    """Behind a hold a delay is no exp(-j omega tau) of the sampled response, and a lag no factor."""
    f = np.geomspace(5.0, 400.0, 80)
    g = noisy(held_late(f, 1e-3, late, lag), 0.01, 3)
    idn = ga.identify(ga.FrequencyResponse(f, g, 0.01 * np.abs(g), dt=1e-3))
    within(idn)
    truth = {name: value for name, value in (("delay", late), ("lag", lag)) if value}
    assert idn.path.keys() == truth.keys()
    for name, value in truth.items():
        assert abs(idn.path[name].value - value) < 4.0 * idn.path[name].std < 2e-5


def test_the_model_has_the_path_and_its_covariance() -> None:
    """What is exported or simulated is the axis behind its path; the covariance is of all that was fitted."""
    late, lag = 0.3e-3, 0.4e-3
    g = noisy(exact() * np.exp(-2j * np.pi * F * late) / (1.0 + 2j * np.pi * F * lag), 0.01, 25)
    idn = ga.identify(ga.FrequencyResponse(F, g, 0.01 * np.abs(g)))
    assert idn.delay is not None and idn.lag is not None and idn.covariance is not None
    assert [e.name for e in idn.model.effects] == ["transport_delay", "torque_lag"]
    assert np.max(np.abs(idn.model.frequency_response(2.0 * np.pi * F) / g - 1.0)) < 0.05
    covariance = np.array(idn.covariance)
    assert covariance.shape == (len(ga.factor_parameters(idn.model)[1]) + 2,) * 2
    np.testing.assert_allclose(np.sqrt(np.diag(covariance))[-2:], [idn.delay.std, idn.lag.std])
    assert np.min(np.linalg.eigvalsh(covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance))))) > 0.0
    # Delay and lag have one sum that is known better than either.
    both = np.ones(2) @ covariance[-2:, -2:] @ np.ones(2)
    assert np.sqrt(both) < 0.8 * min(idn.delay.std, idn.lag.std)
    assert f"Path of the torque: delay {1e4 * idn.delay.value:.4f}"[:30] in idn.summary().replace("(", "")
    gain = idn.parameters["gain"].std
    assert gain == pytest.approx(np.sqrt(covariance[0, 0]), rel=1e-4)


@pytest.mark.long
@pytest.mark.parametrize(("turn", "remedy"), [(np.negative, "opposite sign"), (np.conj, "conjugate")])
def test_a_response_of_another_sign_behind_a_path_is_refused(turn: np.ufunc, remedy: str) -> None:
    g = turn(noisy(exact() * np.exp(-2j * np.pi * F * 0.3e-3) / (1.0 + 2j * np.pi * F * 0.2e-3), 0.01, 1))
    with pytest.raises(SpaceError, match=remedy):
        ga.identify(ga.FrequencyResponse(F, g, 0.01 * np.abs(g)))


@pytest.mark.long
def test_gains_are_designed_with_the_path_in_the_loop() -> None:
    """Behind a lag the loop is slower, and the model of the gains has it."""
    lag, loop = 2e-3, ga.PI(kp=0.02, ki=0.4)
    g = noisy(exact(), 0.01, 23)
    without = ga.retune(ga.identify(ga.FrequencyResponse(F, g, 0.01 * np.abs(g))), loop, dt=1e-3)
    g = g / (1.0 + 2j * np.pi * F * lag)
    behind = ga.retune(ga.identify(ga.FrequencyResponse(F, g, 0.01 * np.abs(g))), loop, dt=1e-3)
    assert behind.after.bandwidth.value < 0.8 * without.after.bandwidth.value
    (effect,) = behind.model.effects
    assert effect.name == "torque_lag" and effect.parameters["time_constant"] == pytest.approx(lag, rel=0.01)


def test_the_picture_has_the_model_behind_its_path() -> None:
    """The curve that is drawn lies on what was measured."""
    g = exact() * np.exp(-2j * np.pi * F * 0.3e-3) / (1.0 + 2j * np.pi * F * 0.4e-3)
    idn = ga.identify(ga.FrequencyResponse(F, noisy(g, 0.001, 24)))
    axes = idn.plot_bode(hz=True).axes
    (curve,) = (line for line in axes[0].lines if len(line.get_xdata()) > 2 * len(F))
    shown = np.interp(np.log(F), np.log(np.asarray(curve.get_xdata(), float)), np.asarray(curve.get_ydata(), float))
    assert np.max(np.abs(shown / np.abs(g) - 1.0)) < 0.02


def test_what_no_linear_model_has_is_falsified() -> None:
    """A gain that falls in steps, as of a drive that saturates at some frequencies."""
    g = noisy(exact(), 0.005, 10) * np.where(np.arange(60) // 7 % 2, 1.0, 0.85)
    idn = ga.identify(ga.FrequencyResponse(F, g, 0.005 * np.abs(g)))
    assert idn.falsified and "goes on from frequency to frequency" in idn.adequacy.sentence


def drive_record(noise: float, seed: int) -> tuple[ga.Record, ga.PI]:
    """A loop over the exact held plant, simulated here."""
    A, B, _ = state_space()
    dt, loop = 1e-3, ga.PI(kp=0.02, ki=0.4)
    block = np.zeros((4, 4))
    block[:3, :3], block[:3, 3] = A, B
    whole = expm(block * dt)
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.uniform(-20.0, 20.0, 10), 250)
    x, stored, before = np.zeros(3), 0.0, 0.0
    velocity, torque = np.zeros(len(command)), np.zeros(len(command))
    for n, r in enumerate(command):
        velocity[n] = x[0] + noise * rng.standard_normal()
        e = r - velocity[n]
        stored += 0.4 * dt * (e + before) / 2.0
        before = e
        torque[n] = 0.02 * e + stored
        x = whole[:3, :3] @ x + whole[:3, 3] * torque[n]
    return ga.Record(dt, command=command, velocity=velocity, torque=torque), loop


def test_a_response_beside_a_record_sharpens_both() -> None:
    rec, loop = drive_record(0.1, 11)
    g = noisy(exact(dt=1e-3), 0.01, 12)
    alone = ga.identify(rec, loop)
    for std in (0.01 * np.abs(g), None):
        both = ga.identify([rec, ga.FrequencyResponse(F, g, std, dt=1e-3)], loop)
        within(both)
        assert both.mechanics.std["JM"] < 0.5 * alone.mechanics.std["JM"]
        assert both.samples == len(rec) and both.frequencies == 60 and not both.of_responses
        assert np.sqrt(np.mean(both.residual(rec) ** 2)) == pytest.approx(0.1, rel=0.1)
    assert "2500 samples of 1 record, 60 frequencies of 1 response" in both.summary()


def test_a_response_of_another_axis_beside_a_record_falsifies() -> None:
    rec, loop = drive_record(0.05, 13)
    other = noisy(1.1 * exact(dt=1e-3), 0.01, 14)
    assert ga.identify([rec, ga.FrequencyResponse(F, other, 0.01 * np.abs(other), dt=1e-3)], loop).falsified


@pytest.mark.long
def test_responses_at_two_amplitudes_hint_at_what_is_not_linear() -> None:
    peak = np.abs(exact() * F).argmax()
    shifted = exact(F / 1.3) / 1.3  # of a shaft that is stiffer
    small = ga.FrequencyResponse(F, noisy(0.8 * exact(), 0.01, 15), 0.01 * np.abs(exact()), amplitude=0.05)
    large = ga.FrequencyResponse(F, noisy(shifted, 0.01, 16), 0.01 * np.abs(shifted), amplitude=0.5)
    notes = [w for w in ga.identify([small, large]).warnings if w.startswith("Not linear")]
    assert len(notes) == 2 and "larger; dry friction or a dead band" in notes[0]
    assert f"{F[peak]:.4g}" in notes[1] and "a gap or a hardening coupling" in notes[1]
    alike = ga.FrequencyResponse(F, noisy(exact(), 0.01, 17), 0.01 * np.abs(exact()), amplitude=0.05)
    other = ga.FrequencyResponse(F, noisy(exact(), 0.01, 18), 0.01 * np.abs(exact()), amplitude=0.5)
    assert not [w for w in ga.identify([alike, other]).warnings if w.startswith("Not linear")]


@pytest.mark.long
def test_a_gap_that_less_torque_does_not_cross_is_no_limit_alone() -> None:
    """In a wide gap a small torque moves the motor alone: the gain falls as the torque grows, as it does at a limit."""
    free = 1.0 / (2j * np.pi * F * JM + DM)
    drawn = ((0.05, free), (0.5, exact()))
    parts = [ga.FrequencyResponse(F, noisy(g, 0.01, 30), 0.01 * np.abs(g), amplitude=size) for size, g in drawn]
    (note, *_) = (w for w in ga.identify(parts).warnings if w.startswith("Not linear"))
    assert "smaller; a limit of the torque, or a gap that less torque does not cross, would do that" in note


@pytest.mark.long
def test_what_is_made_of_it(tmp_path: Path) -> None:
    g = noisy(exact(), 0.02, 19)
    fr = ga.FrequencyResponse(F, g, name="bode")
    idn = ga.identify(fr)
    assert "60 frequencies of 1 response" in idn.summary() and "rad/s, white part" not in idn.summary()
    for figure in (idn.plot(), idn.plot_bode(), fr.plot("linear")):
        figure.savefig(io.BytesIO())
    idn.save(f"{tmp_path}/i.json")
    again = ga.load(f"{tmp_path}/i.json")
    assert again == idn and again.responses == () and again.response_digests == (fr.digest,)
    ga.report(idn, f"{tmp_path}/r.html", live=False)
    page = Path(f"{tmp_path}/r.html").read_text(encoding="utf-8")
    assert "explains the frequency response" in page and fr.digest in page


def test_a_rigid_axis_has_no_peak_that_moves() -> None:
    g = 1.0 / (2j * np.pi * F * 2e-3 + 0.01)
    for seed in range(20, 28):
        parts = [ga.FrequencyResponse(F, noisy(g, 0.01, seed + 100 * k), 0.01 * np.abs(g), amplitude=0.1 + k) for k in (0, 1)]
        assert not [w for w in ga.identify(parts).warnings if w.startswith("Not linear")]


def test_exact_numbers_are_not_falsified_by_their_rounding() -> None:
    for g in (1.0 / (2j * np.pi * F * 1e-3 + 0.01), exact()):
        idn = ga.identify(ga.FrequencyResponse(F, g))
        assert (idn.p, idn.q) in ((1, 0), (1, 2)) and not idn.falsified and idn.delay is None


def test_few_frequencies_behind_a_delay_are_no_chain_that_gives_power() -> None:
    """Nineteen frequencies have no power against a chain that turns the delay into masses; physics has."""
    f = np.geomspace(7.0, 475.0, 19)
    idn = ga.identify(ga.FrequencyResponse(f, noisy(exact(f) * np.exp(-2j * np.pi * f * 0.3e-3), 0.001, 21)))
    assert (idn.p, idn.q, idn.falsified) == (1, 2, False)
    assert idn.delay is not None and idn.delay.value == pytest.approx(0.3e-3, rel=0.01)
    assert pytest.approx(JM, rel=0.01) == idn.mechanics.with_shaft_damping.JM
    assert not any("gives power" in w for w in idn.warnings)


@pytest.mark.long
def test_a_chain_that_gives_power_says_so() -> None:
    """Behind a delay and a current loop of second order the nearest chain turns what is left into masses."""
    f = np.geomspace(4.0, 700.0, 200)
    s = 2j * np.pi * f
    late = np.exp(-s * 0.3e-3) / (1.0 + s * 0.3e-3 + (s * 0.2e-3) ** 2)
    idn = ga.identify(ga.FrequencyResponse(f, noisy(exact(f) * late, 0.0015, 31)))
    assert (idn.p, idn.q) == (1, 4) and any("gives power" in w for w in idn.warnings)
    plain = ga.identify(ga.FrequencyResponse(f, noisy(exact(f), 0.0015, 31)))
    assert (plain.p, plain.q) == (1, 2) and not any("gives power" in w for w in plain.warnings)


@pytest.mark.long
@pytest.mark.parametrize(("turn", "remedy"), [(np.negative, "give -response"), (np.conj, r"numpy\.conj")])
def test_a_response_of_another_sign_is_refused_with_the_remedy(turn: np.ufunc, remedy: str) -> None:
    g = noisy(exact(), 0.01, 20)
    with pytest.raises(SpaceError, match=remedy):
        ga.identify(ga.FrequencyResponse(F, turn(g), 0.01 * np.abs(g)))


def test_wrong_use() -> None:
    fr = ga.FrequencyResponse(F, exact())
    with pytest.raises(SettingsError, match="controller is PI"):
        ga.identify(fr, ga.PI(0.02, 0.4))
    with pytest.raises(RecordError, match="rec is list"):
        ga.identify([fr, "bode.csv"])  # type: ignore[list-item]
    with pytest.raises(GaidentError, match="arithmetic"):
        ga.identify(fr, settings=ga.Settings(arithmetic="c30"))
    with pytest.raises(RecordError, match="rec is FrequencyResponse"):
        ga.diagnose(fr)  # type: ignore[arg-type]
