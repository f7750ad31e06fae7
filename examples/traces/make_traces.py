"""Makes the traces of this folder: simulated drives, written as drives and their tools export them.

    python make_traces.py

The same numbers each time.
What is hidden in each: 0.04 N m of dry friction in run1.csv and run2.csv, 0.12 N m in velocity_mode.csv and position_mode.csv,
1.5 N m of gravity beside 0.3 N m of dry friction in robot_joint.csv.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

import gaident as ga

HERE = Path(__file__).parent
RPM = 60.0 / (2.0 * np.pi)


def write(name: str, header: str, columns: list[np.ndarray], delimiter: str = ",", decimal: str = ".") -> None:
    """A text table; numbers to six digits, with a comma where the tool's language has one."""
    rows = [delimiter.join(f"{x:.7g}".replace(".", decimal) for x in row) for row in np.column_stack(columns).tolist()]
    HERE.joinpath(name).write_text("\n".join([header, *rows, ""]), encoding="utf-8")


def two_masses() -> None:
    """run1.csv, run2.csv: the drive of the README, levels and levels in another order, each line a sample of the controller."""
    T, controller = 0.444e-3, ga.PI(kp=0.0232, ki=1.367)
    drive = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59).model().with_effect("coulomb_friction", torque=0.04)
    for k, levels in enumerate(([20, -30, 8, -4, 12, -50], [-12, 45, -6, 25, -20, 3]), 1):
        command = np.repeat(np.array(levels, dtype=float), 400)
        noise = 0.1 * np.random.default_rng(k).standard_normal(command.size)
        run = ga.run(drive, ga.Record(T, command=command - noise, velocity=noise), controller)
        velocity = run.velocity + noise
        write(f"run{k}.csv", "t,w_ref,w,M", [T * np.arange(command.size), command * RPM, velocity * RPM, run.torque])


def velocity_mode() -> None:
    """velocity_mode.csv: a German export, decimal commas, % of the rated 2.4 N m, every fourth sample of an 8 kHz controller."""
    T = 125e-6
    drive = ga.TwoMass(JM=1.2e-4, DM=0.002, JL=3.1e-4, DL=0.003, KG=60.0, DG=0.004).model()
    drive = drive.with_effect("coulomb_friction", torque=0.12)
    controller = ga.Cascade(ga.PI(0.06, 5.0, torque_limit=7.2), period=T, torque_filters=(ga.LowPass(time_constant=0.2e-3),))
    levels = np.repeat([0, 150, -300, 600, -60, 60, -900, 450, -30, 30, 0], 640) / RPM
    command = np.zeros(levels.size)
    for k in range(1, levels.size):
        command[k] = command[k - 1] + np.clip(levels[k] - command[k - 1], -1885.0 * T, 1885.0 * T)
    noise = 0.02 * np.random.default_rng(1).standard_normal(command.size)
    run = ga.run(drive, ga.Record(T, command=command - noise, velocity=np.zeros(command.size)), controller)
    columns = [1e3 * T * np.arange(command.size), command * RPM, (run.velocity + noise) * RPM, 100.0 * run.torque / 2.4]
    header = "t/ms;Drehzahlsollwert [1/min];Drehzahlistwert [1/min];Drehmomentsollwert [%]"
    write("velocity_mode.csv", header, [c[::4] for c in columns], ";", ",")


def position_mode() -> None:
    """position_mode.csv: an English export of a positioning axis at 1 kHz, its velocity controller at 8 kHz."""
    T = 125e-6
    drive = ga.OneMass(J=4.3e-4, D=5e-3).model().with_effect("coulomb_friction", torque=0.12)
    controller = ga.Cascade(
        ga.PI(kp=0.06, ki=5.0, torque_limit=7.2), period=T, torque_filters=(ga.LowPass(time_constant=0.2e-3),),
        position=ga.P(60.0), position_period=1e-3, velocity_feedforward=1.0, acceleration_feedforward=4e-4,
    )  # fmt: skip
    stops = [0, 0, 6, -2, 8, 7.5, 8, 0, -10, 0]
    s = np.linspace(0, 1, round(0.12 / T), endpoint=False)
    shape = 10 * s**3 - 15 * s**4 + 6 * s**5
    moves = [np.append(a + (b - a) * shape, np.full(round(0.03 / T), b)) for a, b in pairwise(stops)]
    path = np.concatenate(moves)
    run = ga.run(drive, ga.Record(T, position_command=path, velocity=np.zeros(path.size)), controller)
    angle = np.append(0.0, np.cumsum(0.5 * T * (run.velocity[1:] + run.velocity[:-1])))
    count = 360.0 / 2**20
    noise = 0.005 * np.random.default_rng(0).standard_normal(path.size)
    columns = [
        1e3 * T * np.arange(path.size), np.degrees(path), np.round(np.degrees(angle) / count) * count,
        (run.velocity + noise) * RPM, 100.0 * run.torque / 2.4,
    ]  # fmt: skip
    header = "Time (ms),Position command (deg),Position feedback (deg),Velocity feedback (rpm),Torque reference (%)"
    write("position_mode.csv", header, [c[::8] for c in columns])


def robot_joint() -> None:
    """robot_joint.csv: a joint that lifts its arm, in degrees and A, no gains known: the current drives the model."""
    T, controller = 1e-3, ga.PI(kp=4.0, ki=60.0)
    drive = ga.OneMass(J=0.08, D=0.4).model().with_effect("coulomb_friction", torque=0.3)
    drive = drive.with_effect("unbalance", amplitude=1.5, phase=0.4)
    t = T * np.arange(4000)
    command = 1.6 * np.sin(2.0 * np.pi * 0.5 * t) + 0.9 * np.sin(2.0 * np.pi * 1.3 * t)
    noise = 0.004 * np.random.default_rng(2).standard_normal(t.size)
    run = ga.run(drive, ga.Record(T, command=command - noise, velocity=noise), controller)
    angle = np.degrees(np.append(0.0, np.cumsum(0.5 * T * (run.velocity[1:] + run.velocity[:-1]))))
    velocity = np.degrees(run.velocity + noise)
    write("robot_joint.csv", "time_s,q_deg,dq_deg_s,current_setpoint_A", [t, angle, velocity, run.torque / 0.5])


if __name__ == "__main__":
    for make in (two_masses, velocity_mode, position_mode, robot_joint):
        make()
