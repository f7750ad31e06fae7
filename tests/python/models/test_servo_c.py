"""The C file under every controller that `gaident.run` simulates: at each of its samples, block by block and all at once.

The same operations in the same order, so that the numbers are the same to the last bit; where effects add their torques in
another order they agree to 1e-12 of the largest value.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.export.servo import Servo

DT = 1e-3
N = 240
ONE = ga.OneMass(J=3e-4, D=0.004).model()
TWO = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59, DG=1e-3).model()
BOTH = TWO.with_effect("backlash", gap=0.01).with_effect("coulomb_friction", torque=0.02)
ANGLE = 1.5 * (1.0 - np.cos(np.pi * np.clip((np.arange(N) - 20.0) / 160.0, 0.0, 1.0)))
NOTCH = ga.Notch(frequency=110.0, numerator_damping=0.1, denominator_damping=0.7)
LOW = ga.LowPass(time_constant=0.8e-3)
SAME, ROUNDED = 0.0, 1e-12


def pi(**more: Any) -> ga.PI:
    return ga.PI(0.02, 0.6, **more)


def around(velocity: ga.PI | None = None, **more: Any) -> ga.Cascade:
    return ga.Cascade(pi() if velocity is None else velocity, **more)


@dataclass(frozen=True)
class Case:
    """off: how far it may be, of the largest value; start: angle at which the axis rests [rad]."""

    controller: ga.PI | ga.Cascade
    model: ga.Model = TWO
    off: float = SAME
    substeps: int | None = None
    start: float = 0.0
    steps: tuple[float, ...] = (0.0, 20.0, 60.0, -40.0, -5.0, 0.0)

    def commands(self) -> np.ndarray:
        """At the lines."""
        return np.repeat(self.steps, N // 6) if self.controller.driven_by == "command" else self.start + ANGLE

    def expected(self, dt: float = DT, commands: np.ndarray | None = None) -> ga.Run:
        given = self.commands() if commands is None else commands
        rec = ga.Record(dt, velocity=np.zeros(len(given)), **{self.controller.driven_by: given})
        return ga.run(self.model, rec, self.controller, substeps=self.substeps)

    def inputs(self) -> tuple[np.ndarray, int]:
        """The commands at the controller's samples, with what a step reads after the last of them; samples to a step."""
        ticks = self.controller.ticks(DT, self.commands(), None)
        servo = Servo.of(self.controller, DT)
        assert servo is not None and servo.samples == ticks.log_every
        return np.append(ticks.source, np.full(servo.ahead, ticks.source[-1])), ticks.log_every


LIMITED = {"torque_limit": 0.35, "integrator_limit": 0.3}
FED = {"velocity_feedforward": 0.9, "acceleration_feedforward": 2e-4, "friction_feedforward": 0.03}
PLACED = around(position=ga.P(30.0))
WHOLE = ga.Cascade(
    velocity=pi(rule="backward", command_weight=0.6, anti_windup="hold", **LIMITED),
    position=ga.P(30.0),
    torque_filters=(LOW, NOTCH),
    velocity_filters=(ga.LowPass(0.4e-3), NOTCH),
    command_filters=(ga.LowPass(2e-3),),
    delay=0.3e-3,
    **FED,
)


def clocked(controller: ga.Cascade, samples: int, position: int = 0, **more: Any) -> ga.Cascade:
    """The controller `samples` times faster than the log, its position controller at every `position`-th of its samples."""
    values = {name: getattr(controller, name) for name in ga.Cascade.__dataclass_fields__}
    values |= {"period": DT / samples, "position_period": position * DT / samples if position else None}
    return ga.Cascade(**(values | more))


CASES: dict[str, Case] = {
    "bare_in_a_cascade": Case(around()),
    "backward": Case(pi(rule="backward")),
    "forward": Case(pi(rule="forward")),
    "weight": Case(pi(command_weight=0.3)),
    "ip": Case(pi(command_weight=0.0)),
    "limits": Case(around(pi(**LIMITED))),
    "hold": Case(pi(anti_windup="hold", torque_limit=0.35)),
    "tracking": Case(pi(anti_windup="tracking", tracking_time=5e-3, **LIMITED)),
    "torque_low_pass": Case(around(torque_filters=(LOW,))),
    "torque_notch": Case(around(torque_filters=(NOTCH,))),
    "velocity_filters": Case(around(velocity_filters=(ga.LowPass(0.3e-3), NOTCH))),
    "command_filters": Case(around(command_filters=(ga.LowPass(5e-3), NOTCH))),
    "eight_filters": Case(around(torque_filters=tuple(ga.Notch(60.0 + 50.0 * i, 0.2, 0.5) for i in range(8)))),
    "late": Case(around(delay=0.3e-3)),
    "late_by_more_than_a_sample": Case(around(delay=2.4e-3)),
    "late_beside_an_effect": Case(around(delay=0.3e-3), ONE.with_effect("transport_delay", delay=0.4e-3)),
    "acceleration": Case(around(acceleration_feedforward=2e-4)),
    "acceleration_over_the_past": Case(around(acceleration_feedforward=2e-4, feedforward_over="past")),
    "acceleration_from_a_step": Case(
        around(acceleration_feedforward=2e-4, feedforward_over="past"), steps=(20.0, 60.0, -40.0, -5.0, 5.0, 0.0)
    ),
    "friction": Case(around(friction_feedforward=0.03)),
    "four_to_a_line": Case(clocked(around(pi(rule="forward"), velocity_filters=(LOW,)), 4)),
    "position": Case(PLACED),
    "position_elsewhere": Case(PLACED, start=-2.5),
    "slow_position": Case(clocked(PLACED, 1, 3)),
    "slow_position_in_a_fast_loop": Case(clocked(PLACED, 4, 6)),
    "velocity_fed": Case(around(position=ga.P(30.0), velocity_feedforward=0.9)),
    "friction_fed": Case(around(position=ga.P(30.0), friction_feedforward=0.03)),
    "acceleration_fed": Case(around(position=ga.P(30.0), acceleration_feedforward=2e-4)),
    "fed": Case(around(position=ga.P(30.0), **FED)),
    "fed_over_the_past": Case(around(position=ga.P(30.0), feedforward_over="past", **FED)),
    "fed_over_the_past_elsewhere": Case(around(position=ga.P(30.0), feedforward_over="past", **FED), start=1.0),
    "fed_slowly": Case(clocked(around(position=ga.P(30.0), **FED), 4, 2)),
    "fed_slowly_over_the_past": Case(clocked(around(position=ga.P(30.0), feedforward_over="past", **FED), 4, 8)),
    "whole": Case(WHOLE, ONE),
    "whole_on_two_masses": Case(WHOLE),
    "whole_at_its_clock": Case(clocked(WHOLE, 4, 2)),
    "whole_at_its_clock_and_smooth": Case(clocked(WHOLE, 4, 8, interpolation="smooth", feedforward_over="past")),
    "in_substeps": Case(clocked(WHOLE, 2), substeps=3),
    "linear_in_substeps": Case(pi(rule="backward"), substeps=3),
    "with_play": Case(clocked(WHOLE, 4, 2), BOTH, ROUNDED),
    "with_friction": Case(
        WHOLE, ONE.with_effect("stribeck_friction", torque=0.02, static_torque=0.04, stribeck_velocity=2.0), ROUNDED
    ),
    "with_cogging": Case(
        WHOLE, ONE.with_effect("cogging", amplitude=0.02, order=6.0, phase=0.3), ROUNDED, substeps=16, start=0.7
    ),
    "with_its_effects": Case(
        around(pi(anti_windup="hold", **LIMITED), delay=0.2e-3),
        ONE.with_effect("command_rate_limit", rate=900.0)
        .with_effect("integrator_clamp", limit=0.1)
        .with_effect("velocity_quantisation", step=0.05)
        .with_effect("torque_lag", time_constant=1e-3),
    ),
    "with_path_and_sensor": Case(
        clocked(WHOLE, 4, 2),
        TWO.with_effect("torque_saturation", limit=0.3)
        .with_effect("torque_dead_band", width=0.01)
        .with_effect("torque_lag", time_constant=1e-3)
        .with_effect("velocity_difference", samples=3.0)
        .with_effect("velocity_observer", bandwidth=900.0)
        .with_effect("velocity_filter", time_constant=1e-3),
    ),
}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Callable[[dict[str, tuple[Case, float]]], ctypes.CDLL]:
    """Cases, each in steps of so many seconds, compiled; warnings are errors."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler: no 'cc' on the path")

    def made(cases: dict[str, tuple[Case, float]]) -> ctypes.CDLL:
        folder = tmp_path_factory.mktemp("c")
        runs = []
        for name, (case, dt) in cases.items():
            text = case.model.to_c(folder / f"{name}.c", dt, case.controller, substeps=case.substeps)
            several = f"{name}_step({name}_state *s, const double *input)" in text
            runs.append(
                f'#define {name.upper()}_DECLARATIONS_ONLY\n#include "{name}.c"\n'
                f"void run_{name}(const double *input, double start, int every, int n,\n"
                f"    double *velocity, double *torque, double *angle) {{\n"
                f"    {name}_state s;\n    int i;\n    {name}_reset_at(&s, start);\n"
                f"    for (i = 0; i < n; ++i) {{\n        angle[i] = s.angle;\n"
                f"        velocity[i] = {name}_step(&s, {'input + every * i' if several else 'input[every * i]'});\n"
                f"        torque[i] = s.torque;\n    }}\n}}\n"
            )
        (folder / "runs.c").write_text("\n".join(runs))
        flags = ["-std=c99", "-O0", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wshadow", "-shared", "-fPIC"]
        files = [str(folder / f"{name}.c") for name in (*cases, "runs")]
        done = subprocess.run([compiler, *flags, *files, "-lm", "-o", str(folder / "all.so")], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return ctypes.CDLL(str(folder / "all.so"))

    return made


@pytest.fixture(scope="module")
def compiled(library: Callable[[dict[str, tuple[Case, float]]], ctypes.CDLL]) -> ctypes.CDLL:
    return library({name: (case, DT) for name, case in CASES.items()})


def answers(compiled: ctypes.CDLL, name: str, source: np.ndarray, start: float, every: int, n: int) -> list[np.ndarray]:
    """Velocity, torque and angle of n steps."""
    signals = [np.empty(n) for _ in range(3)]
    pointers = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (np.ascontiguousarray(source), *signals)]
    getattr(compiled, f"run_{name}")(pointers[0], ctypes.c_double(start), every, n, *pointers[1:])
    return signals


def same(found: list[np.ndarray], expected: ga.Run, off: float) -> None:
    for answer, wanted in zip(found, (expected.velocity, expected.torque, expected.position), strict=True):
        assert np.abs(wanted).max() > 0.1
        if off == SAME:
            np.testing.assert_array_equal(answer, wanted)
        np.testing.assert_allclose(answer, wanted, rtol=0.0, atol=off * np.abs(wanted).max())


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_c_acts_as_the_controller_that_is_simulated(compiled: ctypes.CDLL, name: str) -> None:
    case = CASES[name]
    source, every = case.inputs()
    same(answers(compiled, name, source, case.start, every, N), case.expected(), case.off)


def test_a_step_is_a_line_or_a_sample(library: Callable[[dict[str, tuple[Case, float]]], ctypes.CDLL]) -> None:
    """In steps of the log, and in steps of the controller's period, at each of its samples."""
    case = CASES["whole_at_its_clock"]
    both = library({"lines": (case, DT), "samples": (case, DT / 4)})
    source, every = case.inputs()
    lines = answers(both, "lines", source, 0.0, every, N)
    samples = answers(both, "samples", source, 0.0, 1, every * N)
    same(lines, case.expected(), SAME)
    assert all(np.array_equal(sample[::every], line) for sample, line in zip(samples, lines, strict=True))
    same(samples, case.expected(DT / every, source[: every * N]), SAME)


def test_the_file_says_what_a_step_reads_and_gives() -> None:
    text = CASES["whole_at_its_clock"].model.to_c(None, DT, CASES["whole_at_its_clock"].controller, name="axis")
    assert "/* axis: position command [rad] to motor velocity [rad/s], every 0.001 s (sampled loop, kp 0.02, ki 0.6)." in text
    assert "input: AXIS_INPUTS numbers, the position command at the controller's samples, one every 0.00025 s:" in text
    assert "4 from this step on, then 4 after them, of which a feedforward takes slopes." in text
    assert "enum { AXIS_INPUTS = 8 };" in text and "double axis_step(axis_state *s, const double *input);" in text
    assert "void axis_reset_at(axis_state *s, double angle); /* at rest at this angle [rad] */" in text
    assert (
        "velocity controller: kp 0.02, ki 0.6, backward rule, command weight 0.6, torque limit 0.35, integrator limit 0.3" in text
    )
    assert "position controller: gain 30 1/s, every 0.0005 s" in text and "delay of the torque: 0.0003 s" in text
    assert "torque filter: notch, frequency 110, numerator damping 0.1, denominator damping 0.7" in text
    linear = TWO.to_c(None, DT, around(delay=1e-4), name="axis", axis="linear")
    assert "double axis_step(axis_state *s, double input);" in linear and "AXIS_INPUTS" not in linear
    assert "input: the velocity command at this sample of the controller, which has one every 0.001 s." in linear
    assert "delay of the force: 0.0001 s" in linear and "/* at rest at this position [m] */" in linear


def test_what_it_refuses() -> None:
    with pytest.raises(ga.errors.ControllerError, match=r"velocity\.kp is None, not known: give a number here"):
        ONE.to_c(None, DT, ga.Cascade(ga.PI(None, 0.6)))
    with pytest.raises(ga.errors.ControllerError, match=r"the record's dt is 0\.001 s and period 0\.0003 s"):
        ONE.to_c(None, DT, around(period=3e-4))
    with pytest.raises(ga.errors.ControllerError, match="frequency is 600"):
        ONE.to_c(None, DT, around(torque_filters=(ga.Notch(600.0, 0.1, 0.7),)))
    with pytest.raises(ga.errors.ModelError, match=r"delay of transport_delay is 1\.5"):
        ONE.with_effect("transport_delay", delay=0.6).to_c(None, DT, around(delay=0.9))
