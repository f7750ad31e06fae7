"""Pictures: what is drawn, that all kinds render, and that no global state is left behind."""

from __future__ import annotations

import dataclasses
import io
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.errors import SettingsError
from gaident.show import plot_bode, plot_convergence, plot_identification, plot_poles_zeros, plot_structures
from gaident.show.chart import envelope
from one_mass import one_mass_record
from places import SUPPORT


@pytest.fixture(scope="module")
def result() -> tuple[ga.Record, Any]:
    rec, controller = one_mass_record()
    return rec, ga.identify(rec, controller=controller, trials=3)


def rendered(figure: Any) -> bytes:
    """The picture as PNG; a warning (an error in these tests) would say that it does not fit together."""
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png")
    assert drawn.getvalue().startswith(b"\x89PNG")
    return drawn.getvalue()


def test_identification_shows_measured_simulated_residual(result: tuple[ga.Record, Any]) -> None:
    rec, idn = result
    figure = idn.plot()
    top, low = figure.axes
    lines = {line.get_label(): line.get_ydata() for line in top.lines}
    assert list(lines) == ["command", "measured", "simulated"]
    np.testing.assert_array_equal(lines["measured"], rec.velocity)
    np.testing.assert_array_equal(lines["simulated"], idn.simulate(rec))
    drawn = {line.get_label(): line.get_ydata() for line in low.lines}
    np.testing.assert_array_equal(drawn["measured − simulated"], idn.residual(rec))
    assert top.get_ylabel() == "velocity [rad/s]" and low.get_xlabel() == "time [s]"
    band = low.patches[0].get_extents().transformed(low.transData.inverted())
    assert band.y1 == pytest.approx(2.0 * idn.adequacy.noise_std)
    rendered(figure)


def test_open_loop_shows_the_force_of_a_linear_axis(result: tuple[ga.Record, Any]) -> None:
    rec, idn = result
    figure = plot_identification(dataclasses.replace(idn, controller=None), [rec], axis="linear")
    assert [ax.get_ylabel() for ax in figure.axes] == ["velocity [m/s]", "residual [m/s]", "force [N]"]
    rendered(figure)


def test_three_records_at_most(result: tuple[ga.Record, Any]) -> None:
    rec, idn = result
    figure = plot_identification(idn, [rec] * 5)
    assert len(figure.axes) == 6
    assert "not shown: 2 more records" in figure._suptitle.get_text()  # type: ignore[attr-defined]
    rendered(figure)


def test_other_pictures_render(result: tuple[ga.Record, Any]) -> None:
    _, idn = result
    convergence = plot_convergence(idn)
    assert len(convergence.axes[0].lines) == 3
    structures = plot_structures(idn)
    assert len(structures.axes[0].patches) == len(idn.structures)
    roots = plot_poles_zeros(idn)
    assert roots.axes[0].get_xlabel() == "real part [rad/s]"
    two = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59).model()
    bode = plot_bode([two, idn.model], ["two masses", "one mass"])
    assert [ax.get_ylabel() for ax in bode.axes] == ["magnitude [rad/s/(N m)]", "phase [deg]"]
    integrator = plot_bode(ga.Model(1.0, [0.0]), axis="linear")
    assert integrator.axes[0].get_ylabel() == "magnitude [m/s/N]"
    for figure in (convergence, structures, roots, bode, integrator):
        rendered(figure)
    top_of_resonance = np.abs(two.frequency_response(np.linspace(160.0, 185.0, 20001))).max()
    assert np.max(np.asarray(bode.axes[0].lines[0].get_ydata())) == pytest.approx(top_of_resonance, rel=1e-3)


def test_a_record_is_drawn_before_anything_is_fitted() -> None:
    t = 1e-3 * np.arange(400)
    w = np.sin(20.0 * t)
    rec = ga.Record(1e-3, command=w, velocity=0.9 * w, torque=2.0 * w, position=0.1 * w, name="run1", torque_is="measured")
    top, torque, angle = rec.plot().axes
    assert {line.get_label() for line in top.lines} == {"measured", "command"} and top.get_ylabel() == "velocity [rad/s]"
    assert (torque.get_ylabel(), angle.get_ylabel()) == ("torque (measured) [N m]", "angle [rad]")
    figure = rec.plot("linear", {"velocity": "mm/s"})
    rendered(figure)
    assert [ax.get_ylabel() for ax in figure.axes] == ["velocity [mm/s]", "force (measured) [N]", "position [m]"]
    both = rec.with_channels(load_position=7.0 * w, load_velocity=3.0 * w).plot("rotary", {"velocity": "rpm"})
    rendered(both)
    titles = ["velocity [rpm]", "load velocity", "torque (measured) [N m]", "angle [rad]", "load position"]
    assert [ax.get_ylabel() for ax in both.axes] == titles
    assert np.asarray(both.axes[1].lines[0].get_ydata()) == pytest.approx(3.0 * w)
    (only,) = ga.Record(1e-3, velocity=w, command=w).plot().axes
    assert only.get_xlabel() == "time [s]"
    with pytest.raises(SettingsError, match="which no linear axis is measured in"):
        rec.plot("linear", {"velocity": "rpm"})


def test_long_signals_keep_their_extremes() -> None:
    t = np.arange(50_000, dtype=np.float64) * 1e-3
    y = np.sin(t)
    y[[777, 31_000]] = 9.0, -7.0
    thin_t, thin_y = envelope(t, y)
    assert len(thin_t) == len(thin_y) <= 2002
    assert thin_y.max() == 9.0 and thin_y.min() == -7.0
    assert np.all(np.diff(thin_t) > 0.0) and thin_t[0] == t[0] and thin_t[-1] == t[-1]
    short = envelope(t[:100], y[:100])
    np.testing.assert_array_equal(short[1], y[:100])


def test_no_pyplot_and_no_window() -> None:
    code = """
import sys
from one_mass import one_mass_record
import gaident as ga
rec, controller = one_mass_record()
figure = ga.identify(rec, controller=controller).plot()
assert type(figure.canvas).__name__ == "FigureCanvasAgg", figure.canvas
assert "matplotlib.pyplot" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], cwd=SUPPORT, check=True)
