"""A model as a C99 file: compiled, run and compared with gaident.simulate, effect by effect."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from effect_sizes import SIZES
from gaident.errors import ModelError, SettingsError

DT = 1e-3
N = 300
CONTROLLER = ga.PI(0.02, 0.6)
ONE = ga.OneMass(J=3e-4, D=0.004).model()
TWO = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59, DG=1e-3).model()
THREE = ga.Model(4000.0, [-12.0, -6 + 160j, -6 - 160j, -20 + 420j, -20 - 420j], [-3 + 95j, -3 - 95j, -8 + 380j, -8 - 380j])

ROUNDED = 1e-9  # of the largest velocity: the order of the sums differs, nothing else

CASES: dict[str, tuple[ga.Model, ga.PI | None, dict[str, object]]] = {
    "alone": (ONE, None, {}),
    "sampled": (TWO, CONTROLLER, {}),
    "five_poles": (THREE, CONTROLLER, {}),
    "limited": (TWO, ga.PI(0.02, 0.6, torque_limit=0.4, integrator_limit=0.1), {}),
    "continuous": (TWO, ga.PI(0.02, 0.6, loop="continuous"), {}),
    "no_excess": (ga.Model(5.0, [-10.0], [-40.0]), ga.PI(0.02, 0.6, loop="continuous", torque_limit=2.0), {}),
    "order_zero": (ga.Model(3.0), ga.PI(0.02, 0.6, loop="continuous"), {}),
    "limited_effect": (
        TWO.with_effect("backlash", gap=0.01).with_effect("coulomb_friction", torque=0.02),
        ga.PI(0.02, 0.6, torque_limit=0.4, integrator_limit=0.3),
        {},
    ),
    "effect_alone": (ONE.with_effect("stribeck_friction", **SIZES["stribeck_friction"]), None, {"substeps": 3}),
    "neutral": (TWO.with_effect("coulomb_friction", torque=0.0), CONTROLLER, {}),
    "filtered_ripple": (
        ONE.with_effect("velocity_ripple", **SIZES["velocity_ripple"]).with_effect("velocity_filter", time_constant=1e-3),
        CONTROLLER,
        {},
    ),
}
for _name, _values in SIZES.items():
    CASES[_name] = (TWO.with_effect(_name, **_values), CONTROLLER, {})
for _name in (row.name for row in ga.effects.table() if row.place == "shaft"):
    _load = TWO.with_effect(_name, side="load", **SIZES[_name])
    CASES[f"load_{_name}"] = (_load, CONTROLLER, {})
    if "friction" in _name:
        CASES[f"both_{_name}"] = (_load.with_effect(_name, **SIZES[_name]), CONTROLLER, {})
CASES["play_before_a_load"] = (CASES["both_stribeck_friction"][0].with_effect("backlash", gap=0.01), None, {"substeps": 4})
_all = ONE
for _name in ("coulomb_friction", "stribeck_friction", "presliding_friction", "friction_drift", "cogging", "torque_saturation",
              "torque_dead_band", "transport_delay", "torque_lag", "command_rate_limit", "velocity_filter"):  # fmt: skip
    _all = _all.with_effect(_name, **SIZES[_name])
CASES["many"] = (_all, CONTROLLER, {})
_loaded = ONE
for _name in ("load_dependent_friction", "load_torque", "unbalance", "cogging"):
    _loaded = _loaded.with_effect(_name, **SIZES[_name])
CASES["loaded"] = (_loaded, CONTROLLER, {})
_waves = {"amplitude": [0.03, 0.02, 0.01], "order": [4.0, 12.0, 6.0], "phase": [0.4, -1.0, 2.0]}
CASES["cogging_of_three_orders"] = (ONE.with_effect("cogging", **_waves), CONTROLLER, {})
CASES["load_cogging_of_three_orders"] = (
    TWO.with_effect("cogging", side="load", **_waves).with_effect("cogging", **SIZES["cogging"]),
    CONTROLLER,
    {},
)
_loaded = ONE.with_effect("cogging", **_waves).with_effect("load_dependent_friction", **SIZES["load_dependent_friction"])
CASES["loaded_by_cogging_of_three_orders"] = (_loaded, CONTROLLER, {})
_loaded = TWO.with_effect("cogging", side="load", **_waves)
_loaded = _loaded.with_effect("load_dependent_friction", side="load", **SIZES["load_dependent_friction"])
CASES["load_loaded_by_cogging_of_three_orders"] = (_loaded, CONTROLLER, {})
CASES["ripple_of_two_orders"] = (
    ONE.with_effect("velocity_ripple", amplitude=[5e-3, 3e-3], order=[2.0, 1.0], phase=[0.2, 1.0]),
    CONTROLLER,
    {},
)

COMMAND = np.repeat([20.0, 60.0, -40.0, -5.0, 5.0, 0.0], N // 6)
TORQUE = 0.3 * np.sin(np.linspace(0.0, 25.0, N)) + 0.15 * (np.arange(N) > 120)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """All cases in one library, one compilation for all; warnings are errors."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler: no 'cc' on the path")
    folder = tmp_path_factory.mktemp("c")
    runs = []
    for name, (model, controller, options) in CASES.items():
        model.to_c(folder / f"{name}.c", DT, controller, **options)  # type: ignore[arg-type]
        runs.append(
            f'#define {name.upper()}_DECLARATIONS_ONLY\n#include "{name}.c"\n'
            f"void run_{name}(const double *input, double *velocity, double *torque, int n) {{\n"
            f"    {name}_state s; int i;\n    {name}_reset(&s);\n"
            f"    for (i = 0; i < n; ++i) {{ velocity[i] = {name}_step(&s, input[i]); torque[i] = s.torque; }}\n}}\n"
        )
    (folder / "runs.c").write_text("\n".join(runs))
    flags = ["-std=c99", "-O0", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wshadow", "-shared", "-fPIC"]
    sources = [str(folder / f"{name}.c") for name in (*CASES, "runs")]
    done = subprocess.run([compiler, *flags, *sources, "-lm", "-o", str(folder / "all.so")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(folder / "all.so"))


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_c_is_what_is_simulated(compiled: ctypes.CDLL, name: str) -> None:
    model, controller, options = CASES[name]
    source = TORQUE if controller is None else COMMAND
    still = np.zeros(N)
    rec = ga.Record(DT, command=source, velocity=still) if controller else ga.Record(DT, torque=source, velocity=still)
    turning = any(
        e.name in ("cogging", "unbalance", "velocity_ripple", "position_friction", "position_inertia") for e in model.effects
    )
    substeps = options.get("substeps", 16 if turning else None)
    expected = ga.run(model, rec, controller, substeps=substeps)  # type: ignore[arg-type]
    velocity, torque = np.empty(N), np.empty(N)
    pointer = ctypes.POINTER(ctypes.c_double)
    getattr(compiled, f"run_{name}")(*(np.ascontiguousarray(a).ctypes.data_as(pointer) for a in (source, velocity, torque)), N)
    assert np.abs(expected.velocity).max() > 1.0
    np.testing.assert_allclose(velocity, expected.velocity, rtol=0.0, atol=ROUNDED * np.abs(expected.velocity).max())
    np.testing.assert_allclose(torque, expected.torque, rtol=0.0, atol=ROUNDED * np.abs(expected.torque).max())


def test_every_effect_has_its_case() -> None:
    assert set(SIZES) == {row.name for row in ga.effects.table() if row.simulated}


def test_the_file_says_what_it_is(tmp_path: Path) -> None:
    text = CASES["many"][0].to_c(tmp_path / "my-axis.c", DT, CONTROLLER)
    assert (tmp_path / "my-axis.c").read_text() == text
    assert "my_axis_step(my_axis_state *s, double input)" in text
    assert "transport_delay: delay 0.00073" in text and "command [rad/s]" in text
    assert re.findall(r"#include <(.*)>", text) == ["math.h"]
    assert "drive_step" in ONE.to_c(None, DT) and list(tmp_path.iterdir()) == [tmp_path / "my-axis.c"]


def test_the_file_says_what_acts_at_the_load() -> None:
    text = CASES["both_coulomb_friction"][0].to_c(None, DT, CONTROLLER)
    assert " *   coulomb_friction: torque 0.05\n *   coulomb_friction at the load: torque 0.05\n" in text
    assert ".at_motor.effects = GAIDENT_COULOMB_FRICTION," in text and ".at_load.effects = GAIDENT_COULOMB_FRICTION," in text


def test_what_c_refuses() -> None:
    with pytest.raises(ModelError, match=r"coulomb_friction.*continuous loop"):
        ONE.with_effect("coulomb_friction", torque=0.1).to_c(None, DT, ga.PI(1.0, 1.0, loop="continuous"))
    with pytest.raises(ModelError, match="dt is 0"):
        ONE.to_c(None, 0.0)
    with pytest.raises(ModelError, match="p = 0"):
        ga.Model(3.0).to_c(None, DT)
    with pytest.raises(ModelError, match="name is '2x'"):
        ONE.to_c(None, DT, name="2x")
    with pytest.raises(ModelError, match="substeps is 0"):
        ONE.to_c(None, DT, substeps=0)
    with pytest.raises(SettingsError, match="controller is '"):
        ONE.to_c(None, DT, "PI")  # type: ignore[arg-type]


def test_a_delay_of_more_torques_than_a_drive_keeps_is_refused() -> None:
    """At 4e-10 s a second was written as no delay at all."""
    late = ONE.with_effect("transport_delay", delay=1.0)
    with pytest.raises(ModelError, match=r"looks back 10000000 torques at a sample time of 1e-07 s.*at most 1000000"):
        late.to_c(None, 1e-7)
    with pytest.raises(ModelError, match=r"transport_delay: a delay of 1 s is 2500000000 torques of 4e-10 s"):
        late.to_c(None, 4e-10)
    assert "transport_delay = {1001," in late.to_c(None, DT)
