"""The picture of a diagnosis: the numbers they draw are right, every kind renders, no state is left behind."""

from __future__ import annotations

import io
import math
import warnings
from typing import Any

import numpy as np
import pytest

from gaident.errors import SettingsError
from gaident.show import plot_evidence
from gaident.show.diagnosis_charts import missing_reversals
from gaident.show.diagnosis_numbers import binned_mean, branches, order_lines, reversal_averages, spectrum
from gaident.show.draw import picture

DT = 1e-3
N = 4000
TIME = DT * np.arange(N)
VELOCITY = 60.0 * np.sin(2.0 * math.pi * 1.5 * TIME) * np.repeat([0.2, 1.0], N // 2)
POSITION = DT * np.cumsum(VELOCITY)
NOISE = np.random.default_rng(0).standard_normal(N)
FRICTION = -0.05 * np.sign(VELOCITY)


def rendered(figure: Any) -> None:
    drawn = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a layout that does not fit together warns
        figure.savefig(drawn, format="png", dpi=50)
    assert drawn.getvalue().startswith(b"\x89PNG")


def test_bins_have_an_edge_at_standstill_and_the_right_mean_and_spread() -> None:
    found = binned_mean(VELOCITY, FRICTION + 0.01 * NOISE, 20)
    assert np.all(np.diff(found.x) > 0.0) and found.count.sum() > 0.99 * N
    np.testing.assert_allclose(found.mean, -0.05 * np.sign(found.x), atol=0.003)
    np.testing.assert_allclose(found.std, 0.01, rtol=0.3)
    half = binned_mean(VELOCITY, FRICTION, 20, VELOCITY > 0.0)
    assert np.all(half.x > 0.0)
    assert len(binned_mean(np.zeros(50), np.ones(50)).x) == 1


def test_branches_are_told_by_speed_not_velocity() -> None:
    faster, slower = branches(VELOCITY, DT)
    assert not np.any(faster & slower)
    late = slice(N // 2 + 100, N - 100)
    rate = np.gradient(np.abs(VELOCITY), DT)[late]
    clear = np.abs(rate) > 0.5 * np.abs(rate).max()
    assert np.mean((rate > 0.0)[clear] == faster[late][clear]) > 0.95
    assert np.mean((rate < 0.0)[clear] == slower[late][clear]) > 0.95


def test_an_order_line_stands_at_its_order_with_its_amplitude() -> None:
    """Friction beside it is no line; noise alone has no peak."""
    ripple = 0.01 * np.sin(7.0 * POSITION + 0.3)
    velocity = 30.0 + 5.0 * np.sin(9.0 * TIME)
    position = DT * np.cumsum(velocity)
    steady = order_lines(position, 0.01 * np.sin(7.0 * position + 0.3) + 0.005 * NOISE, velocity)
    assert steady.turns == pytest.approx(np.ptp(position) / math.tau)
    assert [k for k, _ in steady.peaks] == [7.0]
    assert steady.peaks[0][1] == pytest.approx(0.01, rel=0.03)
    mixed = order_lines(POSITION, ripple + FRICTION + 0.005 * NOISE, VELOCITY)
    # A motion that repeats itself ties angle to velocity: a part of the line goes with the velocity.
    assert mixed.peaks[0][0] == 7.0 and mixed.peaks[0][1] == pytest.approx(0.01, rel=0.2)
    for seed in range(5):
        noise = np.random.default_rng(seed).standard_normal(N)
        assert order_lines(position, noise, velocity).peaks == []
    # Coloured noise over little more than a turn: a level that falls with it, no order that the travel does not contain.
    for seed in range(5):
        short = position[: int(1.3 * math.tau / 30.0 / DT)]
        coloured = 1e-5 * np.cumsum(np.random.default_rng(seed).standard_normal(len(short)))
        found = order_lines(short, coloured, velocity[: len(short)])
        assert found.peaks == [] and found.order[0] >= 1.0 / found.turns > 0.5
        assert found.level[0] > 2.0 * found.level[-1]
        ripple = order_lines(short, coloured + 0.01 * np.sin(6.0 * short), velocity[: len(short)])
        assert len(ripple.peaks) == 1 and ripple.peaks[0][0] == pytest.approx(6.0, abs=0.4)
    assert len(order_lines(0.01 * POSITION[:100], NOISE[:100], VELOCITY[:100]).order) == 0


def test_reversals_are_averaged_in_the_new_direction() -> None:
    found = reversal_averages(VELOCITY, FRICTION, np.repeat([0.1, 0.5], N // 2), DT)
    assert set(found.groups) == {"small", "large"}
    assert sum(count for *_, count in found.groups.values()) in (10, 11)
    for mean, spread, w, _ in found.groups.values():
        assert len(mean) == len(found.time) == 101
        np.testing.assert_allclose(mean[:45], 0.05, atol=1e-12)
        np.testing.assert_allclose(mean[56:], -0.05, atol=1e-12)
        assert spread.max() < 0.06 and w[0] < 0.0 < w[-1]
    assert np.ptp(found.groups["large"][2]) > 3.0 * np.ptp(found.groups["small"][2])
    assert reversal_averages(30.0 + VELOCITY[:900], FRICTION[:900], FRICTION[:900], DT).groups == {}
    one = reversal_averages(VELOCITY[:500], FRICTION[:500], FRICTION[:500], DT)
    assert [count for *_, count in one.groups.values()] == [1]


def test_white_noise_stands_at_its_floor_and_a_hum_at_its_frequency() -> None:
    found = spectrum(0.2 * NOISE + 0.5 * np.sin(2.0 * math.pi * 50.0 * TIME), DT)
    assert found.frequency[int(np.argmax(found.density))] == pytest.approx(50.0, abs=2.0)
    quiet = np.abs(found.frequency - 50.0) > 10.0
    assert np.median(found.density[quiet]) == pytest.approx(0.2 * math.sqrt(2.0 * DT), rel=0.1)


def panels(figure: Any) -> dict[str, Any]:
    """The panels of the evidence, by letter."""
    return {ax.get_title(loc="left")[0]: ax for ax in figure.axes}


def test_torque_against_velocity_draws_both_branches_and_the_named_curve() -> None:
    grid = np.linspace(-60.0, 60.0, 50)
    missing, named = FRICTION + 0.01 * NOISE, (grid, -0.05 * np.sign(grid), "Coulomb friction")
    figure = plot_evidence(TIME, VELOCITY, VELOCITY, missing, POSITION, FRICTION, 0.1, std=0.01, curve=named)
    ax = panels(figure)["b"]
    figure.draw_without_rendering()
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert ax.get_legend().get_window_extent().y0 >= ax.get_window_extent().y1  # no point is covered
    assert sorted(labels) == sorted(["±2 std of the estimate", "accelerating", "decelerating", "Coulomb friction", "mean ± sd"])
    assert ax.get_ylabel() == "missing torque [N m]" and ax.get_xlabel() == "velocity [rad/s]"
    rendered(figure)
    linear = panels(plot_evidence(TIME, VELOCITY, VELOCITY, FRICTION, POSITION, FRICTION, 0.1, axis="linear"))["b"]
    assert linear.get_ylabel() == "missing force [N]" and linear.get_xlabel() == "velocity [m/s]"
    with pytest.raises(SettingsError, match="axis is 'round'"):
        plot_evidence(TIME, VELOCITY, VELOCITY, FRICTION, POSITION, FRICTION, 0.1, axis="round")


@pytest.mark.long
def test_orders_reversals_and_residual_render() -> None:
    ripple = 0.02 * np.sin(6.0 * POSITION)
    figure = plot_evidence(
        TIME, VELOCITY, VELOCITY - 0.3 * NOISE, ripple, POSITION, FRICTION, 0.3, extended=VELOCITY - 0.1 * NOISE
    )
    drawn = panels(figure)
    assert "6" in [text.get_text() for text in drawn["d"].texts]
    floor = [line for line in drawn["e"].lines if line.get_label() == "white noise of the sensor"]
    assert floor[0].get_ydata()[0] == pytest.approx(0.3 * math.sqrt(2.0 * DT))
    rendered(figure)
    one_way = plot_evidence(TIME, 80.0 + VELOCITY, VELOCITY, NOISE, 0.001 * POSITION, FRICTION, 0.1)
    drawn = panels(one_way)
    assert "too few" in drawn["d"].texts[0].get_text()
    assert drawn["f"].texts[0].get_text() == "no reversals in the record"
    assert not len(drawn["f"].get_xticks()) and not len(drawn["f"].get_yticks())
    rendered(one_way)
    for velocity in (VELOCITY, 80.0 + VELOCITY):  # as the report draws it, the velocity below
        averaged = missing_reversals(velocity, FRICTION, np.repeat([0.1, 0.5], N // 2), DT, "rotary")
        assert len(averaged.panels) == 2 and bool(averaged.panels[0].note) == (velocity is not VELOCITY)
        assert picture(averaged).startswith(b"\x89PNG")


@pytest.mark.long
def test_the_evidence_at_a_glance() -> None:
    before = {"velocity": VELOCITY.copy(), "dhat": FRICTION + 0.005 * NOISE}
    simulated = VELOCITY + 0.5 * np.sin(30.0 * TIME)
    figure = plot_evidence(
        TIME, VELOCITY, simulated, before["dhat"], POSITION, 2.0 * FRICTION, 0.1, std=0.01, extended=VELOCITY + 0.1 * NOISE,
        title="Test drive: explained",
    )  # fmt: skip
    rendered(figure)
    assert not any(ax.yaxis.get_offset_text().get_text() for ax in figure.axes)  # it would stand in the legend
    assert len(figure.axes) == 6 and figure.get_suptitle() == "Test drive: explained"
    heads = [ax.get_title(loc="left") for ax in figure.axes]
    assert [head[0] for head in heads] == list("abcdef")
    residual = next(ax for ax in figure.axes if ax.get_title(loc="left").startswith("c"))
    drawn = {line.get_label(): line.get_ydata() for line in residual.lines}
    np.testing.assert_allclose(drawn["linear model"], VELOCITY - simulated)
    rendered(figure)
    np.testing.assert_array_equal(VELOCITY, before["velocity"])
    rendered(plot_evidence(TIME, VELOCITY, simulated, FRICTION, POSITION, FRICTION, 0.1))


@pytest.mark.long
def test_a_motionless_and_a_long_record_render() -> None:
    still = np.zeros(300)
    noise = 0.01 * NOISE[:300]
    rendered(plot_evidence(TIME[:300], still, noise, noise, still, still, 0.01))
    long = 100_000
    t, w = DT * np.arange(long), np.tile(VELOCITY, long // N)
    figure = plot_evidence(t, w, w + 0.1, np.tile(FRICTION, long // N), DT * np.cumsum(w), np.tile(FRICTION, long // N), 0.1)
    assert max(len(line.get_xdata()) for ax in figure.axes for line in ax.lines) < 30_000
    rendered(figure)
