"""The unit table: values known by heart, constants of the drive, refusals; units in the headers of logs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaident.data import read
from gaident.data.formats.units import QUANTITIES, Constants, factor, is_unit, known_units
from gaident.errors import ReadError
from samples.logs import rows, write

PI = math.pi
DRIVE = Constants(counts_per_turn=10_000, torque_constant=0.5, rated_torque=2.0, torque_per_volt=0.25, reference_speed=300.0)

KNOWN = [
    ("velocity", "rad/s", 1.0),
    ("velocity", "rpm", 2 * PI / 60),
    ("velocity", "1/min", 2 * PI / 60),
    ("velocity", "min^-1", 2 * PI / 60),
    ("velocity", "U/min", 2 * PI / 60),
    ("velocity", "rps", 2 * PI),
    ("velocity", "deg/s", PI / 180),
    ("velocity", "°/s", PI / 180),
    ("velocity", "counts/s", 2 * PI / 10_000),
    ("velocity", "m/s", 1.0),
    ("velocity", "mm/s", 1e-3),
    ("velocity", "m/min", 1 / 60),
    ("command", "RPM", 2 * PI / 60),
    ("position", "rad", 1.0),
    ("position", "deg", PI / 180),
    ("position", "Grad", PI / 180),
    ("velocity", "U/s", 2 * PI),
    ("position", "turn", 2 * PI),
    ("position", "counts", 2 * PI / 10_000),
    ("position", "m", 1.0),
    ("position", "mm", 1e-3),
    ("position", "um", 1e-6),
    ("position", "\N{MICRO SIGN}m", 1e-6),
    ("position", "\N{GREEK SMALL LETTER MU}m", 1e-6),
    ("torque", "N m", 1.0),
    ("torque", "Nm", 1.0),
    ("torque", "N.m", 1.0),
    ("torque", "N·m", 1.0),
    ("torque", "N*m", 1.0),
    ("torque", "mN m", 1e-3),
    ("torque", "mNm", 1e-3),
    ("torque", "kNm", 1e3),
    ("torque", "N", 1.0),
    ("torque", "kN", 1e3),
    ("torque", "%", 0.02),
    ("torque", "A", 0.5),
    ("torque", "mA", 0.5e-3),
    ("torque", "V", 0.25),
    ("velocity", "%", 3.0),
    ("command", "‰", 0.3),
    ("command", "4000 hex", 300.0 / 16384),
    ("torque", "4000 hex", 2.0 / 16384),
    ("time", "s", 1.0),
    ("time", "ms", 1e-3),
    ("time", "us", 1e-6),
    ("time", "µs", 1e-6),
    ("time", "min", 60.0),
    ("time", " Ms ", 1e-3),
]


@pytest.mark.parametrize(("quantity", "unit", "expected"), KNOWN)
def test_known_values(quantity: str, unit: str, expected: float) -> None:
    assert factor(quantity, unit, DRIVE) == pytest.approx(expected, rel=1e-14)
    assert is_unit(unit)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_every_listed_unit_can_be_used(quantity: str) -> None:
    for unit in known_units(quantity):
        assert factor(quantity, unit, DRIVE) > 0


@given(st.sampled_from(QUANTITIES), st.floats(-1e6, 1e6).filter(bool) | st.integers(1, 1000))
def test_a_number_is_its_own_factor(quantity: str, number: float) -> None:
    assert factor(quantity, number) == number


REFUSED: list[tuple[str, Any, list[str]]] = [
    ("velocity", "rmp", ["'rmp' is no unit of velocity", "did you mean", "rad/s, rpm", "as a number"]),
    ("velocity", "V", ["'V' is no unit of velocity", "known are rad/s"]),
    ("torque", "MNm", ["'MNm' is no unit of torque"]),
    ("time", "h", ["'h' is no unit of time", "s, ms, us"]),
    ("torque", "%", ["rated_torque=..."]),
    ("velocity", "%", ["reference_speed=..."]),
    ("command", "4000 hex", ["reference_speed=..."]),
    ("torque", "A", ["torque_constant=...", "N m/A"]),
    ("torque", "V", ["torque_per_volt=...", "N m/V"]),
    ("position", "counts", ["counts_per_turn=..."]),
    ("velocity", "counts/s", ["counts_per_turn=..."]),
    ("velocity", 0, ["velocity=0", "not 0"]),
    ("velocity", math.nan, ["velocity=nan", "finite"]),
    ("velocity", 10**400, ["finite"]),
    ("velocity", True, ["velocity=True is neither text nor a number"]),
    ("velocity", None, ["velocity=None"]),
    ("velocity", "", ["'' is no unit"]),
    ("speed", "rpm", ["quantity='speed'", "velocity"]),
]


@pytest.mark.parametrize(("quantity", "unit", "words"), REFUSED)
def test_refusals(quantity: str, unit: Any, words: list[str]) -> None:
    with pytest.raises(ReadError) as caught:
        factor(quantity, unit)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("name", ["counts_per_turn", "torque_constant", "rated_torque", "torque_per_volt", "reference_speed"])
@pytest.mark.parametrize("value", [0, -1.0, math.nan, math.inf, "4096", True, 10**400])
def test_constants_are_positive_numbers(name: str, value: Any) -> None:
    with pytest.raises(ReadError, match=f"{name}=.* positive finite number"):
        factor("velocity", "rpm", Constants(**{name: value}))


# ---- units in the headers of logs

HEADERS = {
    "no units": ("t,w,u", 1.0),
    "brackets": ("t [s],w [rpm],u [N m]", 2 * PI / 60),
    "round brackets": ("t (s),w (rpm),u (Nm)", 2 * PI / 60),
    "slash": ("t / s,w / rpm,u / Nm", 2 * PI / 60),
    "german": ("t in s,w in 1/min,u in Nm", 2 * PI / 60),
    "unit line": ("t,w,u\ns,rpm,Nm", 2 * PI / 60),
    "unit line in brackets": ("t,w,u\n[s],[rpm],[Nm]", 2 * PI / 60),
    "unit line with dashes": ("t,w,u\ns,rpm,-", 2 * PI / 60),
    "unit line with gaps": ("t,w,u\n,rpm,", 2 * PI / 60),
    "title above": ("Axis 1, run 7\n\nt,w,u", 1.0),
    "comment between": ("t,w,u\n# started by hand\n", 1.0),
    "names in a comment": ("# t,w,u", 1.0),
    "names and units in comments": ("% t,w,u\n% s,rpm,Nm", 2 * PI / 60),
    "no unit after all": ("t,w (motor),u", 1.0),
    "index in brackets": ("t,w[0],u", 1.0),
}


@pytest.mark.parametrize(("header", "size"), HEADERS.values(), ids=HEADERS.keys())
def test_names_and_units_in_headers(tmp_path: Path, header: str, size: float) -> None:
    path = write(tmp_path / "a.csv", header, rows())
    name = {"no unit after all": "w (motor)", "index in brackets": "w[0]"}
    wanted = next((name[key] for key, (text, _) in HEADERS.items() if text == header and key in name), "w")
    rec = read(path, columns={"time": "t", "velocity": wanted, "torque": "u"})
    np.testing.assert_allclose(rec.velocity, np.round(np.sin(np.arange(30)), 4) * size, rtol=1e-12)
    assert rec.dt == 1e-3
    # the user's word counts before the file's
    turned = read(path, columns={"time": "t", "velocity": wanted, "torque": "u"}, units={"velocity": -2})
    np.testing.assert_allclose(turned.velocity, rec.velocity / size * -2, rtol=1e-12)


def test_units_and_constants_of_the_drive(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "t [ms],n [counts/s],theta [counts],i [A]", rows(form="{k},{k},{k},{w:.4f}"))
    rec = read(
        path,
        columns={"time": "t", "velocity": "n", "position": "theta", "torque": "i"},
        counts_per_turn=4096,
        torque_constant=0.5,
    )
    k = np.arange(30)
    assert rec.dt == 1e-3
    np.testing.assert_allclose(rec.velocity, k * 2 * math.pi / 4096, rtol=1e-14)
    assert rec.torque is not None
    np.testing.assert_allclose(rec.torque, np.round(np.sin(k), 4) * 0.5, rtol=1e-14)
