"""The pictures of docs/catalogue.md: what each effect changes, simulated by the core. `python docs/tools/pictures.py FOLDER`.

Left: the velocity with the effect and without. Right: what the effect is, read off the simulated run: a torque at the shaft is
J dw/dt + D w - u of a single mass, an actuator's torque J dw/dt + D w, a sensor's error what is seen minus what is.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import gaident as ga

Vector = NDArray[np.float64]

DT = 2e-4  # s
ONE = ga.OneMass(J=4e-4, D=2e-3)
TWO = ga.TwoMass(JM=1.5e-4, DM=1e-3, JL=4e-4, DL=1e-3, KG=12.0, DG=2e-3)
CONTROLLER = ga.PI(kp=0.03, ki=0.9)
WITHOUT, WITH, COMMAND = "#7a7a7a", "#0072b2", "#c8c8c8"  # colour-blind safe

Curve = tuple[Vector, Vector]


@dataclass(frozen=True)
class Run:
    """One simulated run of the drive: with the effect, its true velocity, the torque that was asked for."""

    time: Vector
    command: Vector
    seen: Vector
    true: Vector
    torque: Vector
    angle: Vector
    acceleration: Vector

    @property
    def acting(self) -> Vector:
        """Torque that moved the single mass [N m]."""
        return ONE.J * self.acceleration + ONE.D * self.true

    @property
    def asked(self) -> Vector:
        """Mean of the torques on either side of the sample, which the central differences see [N m]."""
        return 0.5 * (self.torque + np.concatenate([[0.0], self.torque[:-1]]))


@dataclass(frozen=True)
class Picture:
    """What is drawn of one effect. axes: labels of the right panel; curve: its lines as (x, y); beside: effects in both runs."""

    values: dict[str, float]
    axes: tuple[str, str]
    curve: Callable[[Run], Curve]
    command: Vector
    dots: bool = True
    masses: int = 1
    beside: Mapping[str, dict[str, float]] = field(default_factory=dict)


def levels(*speeds: float, dwell: float = 0.1) -> Vector:
    return np.repeat(np.array(speeds), round(dwell / DT))


def swing(top: float, period: float, periods: float = 2.0) -> Vector:
    t = np.arange(round(period * periods / DT)) * DT
    return top * np.sin(2.0 * np.pi * t / period)


STEPS, STEP, SWING, SLOW = levels(20.0, -20.0, 8.0), levels(20.0), swing(20.0, 0.3), swing(3.0, 0.3)
AGAINST_VELOCITY, AGAINST_ANGLE = ("velocity [rad/s]", "torque at the shaft [N m]"), ("angle [rad]", "torque at the shaft [N m]")
AT_ACTUATOR = ("torque asked for [N m]", "torque that acts [N m]")
ASKED = "torque [N m]"


def shaft_of_velocity(r: Run) -> Curve:
    return r.true, r.acting - r.asked


def shaft_of_angle(r: Run) -> Curve:
    return r.angle, r.acting - r.asked


def shaft_of_time(r: Run) -> Curve:
    return r.time, r.acting - r.asked


def actuator(r: Run) -> Curve:
    jumps = np.abs(np.diff(r.torque, prepend=0.0)) > 0.02  # the mean on either side of these says nothing
    return np.where(jumps, np.nan, r.asked), r.acting


def acting_in_time(r: Run) -> Curve:
    return r.time, r.acting


def controller(r: Run) -> Curve:
    return r.time, r.torque


def sensor_in_time(r: Run) -> Curve:
    return r.time, r.seen - r.true


def sensor_of_angle(r: Run) -> Curve:
    return r.angle, r.seen - r.true


def motor(r: Run) -> Curve:
    return r.time, r.torque


PICTURES: dict[str, Picture] = {
    "coulomb_friction": Picture({"torque": 0.05}, AGAINST_VELOCITY, shaft_of_velocity, SWING),
    "stribeck_friction": Picture(
        {"torque": 0.04, "static_torque": 0.09, "stribeck_velocity": 1.5}, AGAINST_VELOCITY, shaft_of_velocity, swing(6.0, 0.3)
    ),
    "asymmetric_friction": Picture(
        {"torque_positive": 0.03, "torque_negative": 0.06, "viscous_positive": 2e-3, "viscous_negative": 0.0},
        AGAINST_VELOCITY, shaft_of_velocity, SWING,
    ),
    "presliding_friction": Picture({"torque": 0.05, "stiffness": 1.0}, AGAINST_ANGLE, shaft_of_angle, SLOW, dots=False),
    "lugre_friction": Picture(
        {"torque": 0.04, "static_torque": 0.07, "stribeck_velocity": 1.0, "stiffness": 5.0, "damping": 0.01},
        AGAINST_ANGLE, shaft_of_angle, SLOW, dots=False,
    ),
    "quadratic_drag": Picture({"coefficient": 3e-4}, AGAINST_VELOCITY, shaft_of_velocity, SWING),
    "square_root_drag": Picture({"coefficient": 0.015}, AGAINST_VELOCITY, shaft_of_velocity, SWING),
    "load_torque": Picture({"torque": 0.08}, AGAINST_VELOCITY, shaft_of_velocity, SWING),
    "unbalance": Picture({"amplitude": 0.08, "phase": 0.5}, AGAINST_ANGLE, shaft_of_angle, levels(25.0, dwell=0.5)),
    "cogging": Picture({"amplitude": 0.06, "order": 6.0, "phase": 0.0}, AGAINST_ANGLE, shaft_of_angle, levels(15.0, dwell=0.3)),
    "friction_drift": Picture(
        {"torque": 0.08, "rate": -1.2}, ("time [s]", AGAINST_VELOCITY[1]), shaft_of_time, swing(15.0, 0.1, 6.0), dots=False
    ),
    "load_dependent_friction": Picture(
        {"torque": 0.02, "share": 0.3}, AGAINST_ANGLE, shaft_of_angle, swing(18.0, 0.8),
        beside={"unbalance": {"amplitude": 0.12, "phase": 0.0}},
    ),
    "position_friction": Picture(
        {"torque": 0.06, "amplitude": 0.7, "order": 1.0, "phase": 0.0}, AGAINST_ANGLE, shaft_of_angle, swing(18.0, 0.8)
    ),
    "torque_hum": Picture(
        {"amplitude": 0.05, "frequency": 25.0, "phase": 0.0},
        ("time [s]", AGAINST_VELOCITY[1]), shaft_of_time, levels(15.0, dwell=0.3), dots=False,
    ),
    "position_inertia": Picture(
        {"amplitude": 0.5, "order": 1.0, "phase": 0.0}, AGAINST_ANGLE, shaft_of_angle, levels(25.0, -25.0, dwell=0.4)
    ),
    "backlash": Picture({"gap": 0.06}, ("time [s]", ASKED), motor, levels(12.0, -12.0, dwell=0.2), dots=False, masses=2),
    "hardening_stiffness": Picture(
        {"cubic_stiffness": 4e4}, ("time [s]", ASKED), motor, levels(25.0, -25.0, dwell=0.15), dots=False, masses=2
    ),
    "hysteretic_coupling": Picture(
        {"torque": 0.08, "stiffness": 4.0}, ("time [s]", ASKED), motor, levels(12.0, -12.0, dwell=0.2), dots=False, masses=2
    ),
    "torque_saturation": Picture({"limit": 0.25}, AT_ACTUATOR, actuator, STEPS),
    "torque_dead_band": Picture({"width": 0.06}, AT_ACTUATOR, actuator, SWING),
    "transport_delay": Picture({"delay": 4e-3}, ("time [s]", AT_ACTUATOR[1]), acting_in_time, STEP, dots=False),
    "torque_lag": Picture({"time_constant": 4e-3}, ("time [s]", AT_ACTUATOR[1]), acting_in_time, STEP, dots=False),
    "integrator_clamp": Picture({"limit": 0.03}, ("time [s]", ASKED), controller, STEPS, dots=False),
    "command_rate_limit": Picture({"rate": 600.0}, ("time [s]", ASKED), controller, STEPS, dots=False),
    "velocity_difference": Picture(
        {"samples": 16.0}, ("time [s]", "seen minus true velocity [rad/s]"), sensor_in_time, STEP, dots=False
    ),
    "velocity_observer": Picture(
        {"bandwidth": 500.0}, ("time [s]", "seen minus true velocity [rad/s]"), sensor_in_time, STEP, dots=False
    ),
    "velocity_filter": Picture(
        {"time_constant": 4e-3}, ("time [s]", "seen minus true velocity [rad/s]"), sensor_in_time, STEP, dots=False
    ),
    "velocity_ripple": Picture(
        {"amplitude": 8e-3, "order": 6.0, "phase": 0.0},
        ("angle [rad]", "seen minus true velocity [rad/s]"), sensor_of_angle, levels(15.0, dwell=0.3),
    ),
    "velocity_quantisation": Picture(
        {"step": 1.5}, ("time [s]", "seen minus true velocity [rad/s]"), sensor_in_time, SLOW, dots=False
    ),
    "extra_resonance": Picture(
        {"frequency": 220.0, "damping": 0.05, "zero_frequency": 180.0, "zero_damping": 0.05},
        ("time [s]", ASKED), controller, levels(20.0, dwell=0.2), dots=False,
    ),
}  # fmt: skip


def run_of(model: ga.Model, command: Vector) -> Run:
    still = ga.Record(DT, command=command, velocity=np.zeros(command.size))
    found = ga.run(model, still, CONTROLLER, substeps=8)
    true = np.gradient(found.position, DT)
    return Run(still.time, command, found.velocity, true, found.torque, found.position, np.gradient(true, DT))


def draw(name: str, picture: Picture) -> Figure:
    drive = (ONE if picture.masses == 1 else TWO).model()
    for other, values in picture.beside.items():
        drive = drive.with_effect(other, **values)
    plain, changed = (run_of(m, picture.command) for m in (drive, drive.with_effect(name, **picture.values)))
    figure = Figure(figsize=(8.4, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    left.plot(plain.time, picture.command, color=COMMAND, lw=1.0, label="command")
    left.plot(plain.time, plain.seen, color=WITHOUT, lw=1.2, ls="--", label="without")
    left.plot(changed.time, changed.seen, color=WITH, lw=1.5, label=name.replace("_", " "))
    left.set(xlabel="time [s]", ylabel="velocity [rad/s]", xlim=(0.0, plain.time[-1]))
    _legend(left)
    if not picture.dots and picture.axes[0] == "time [s]" and picture.curve in (acting_in_time, controller, motor):
        right.plot(*picture.curve(plain), color=WITHOUT, lw=1.2, ls="--")
    x, y = picture.curve(changed)
    inner = slice(3, -3)  # the ends have no derivative
    if picture.dots:
        right.plot(x[inner], y[inner], ".", color=WITH, ms=2.2, rasterized=True)
    else:
        right.plot(x[inner], y[inner], color=WITH, lw=1.3)
    right.set(xlabel=picture.axes[0], ylabel=picture.axes[1])
    right.update_datalim([(x[5], 0.0)])
    right.autoscale_view()
    for axes in (left, right):
        axes.grid(color="#ececec", lw=0.6)
        axes.set_axisbelow(True)
    return figure


def outliers() -> Figure:
    """Not simulated: a record that contains some."""
    plain = run_of(ONE.model(), STEPS)
    rng = np.random.default_rng(0)
    seen = plain.seen + 0.3 * rng.standard_normal(plain.seen.size)
    hit = rng.choice(seen.size, 9, replace=False)
    seen[hit] += rng.choice([-1.0, 1.0], 9) * rng.uniform(8.0, 20.0, 9)
    figure = Figure(figsize=(8.4, 2.9), layout="constrained")
    axes = figure.subplots()
    axes.plot(plain.time, seen, color=WITH, lw=0.9, label="record")
    axes.plot(plain.time[hit], seen[hit], "o", mfc="none", color="#d55e00", label="outliers")
    axes.set(xlabel="time [s]", ylabel="velocity [rad/s]", xlim=(0.0, plain.time[-1]))
    axes.grid(color="#ececec", lw=0.6)
    _legend(axes)
    return figure


def _legend(axes: Axes) -> None:
    axes.legend(frameon=False, fontsize="small", ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1)


def main(folder: Path) -> None:
    missing = {row.name for row in ga.effects.table() if row.simulated} - set(PICTURES)
    if missing:
        sys.exit(f"no picture for {', '.join(sorted(missing))}: give it its line in PICTURES")
    folder.mkdir(parents=True, exist_ok=True)
    for name, picture in PICTURES.items():
        draw(name, picture).savefig(folder / f"{name}.svg", dpi=200)
    outliers().savefig(folder / "outliers.svg")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
