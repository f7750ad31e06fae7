"""Logs with a line for every 1, 2, 4, 8, 16 samples of the controller, whose sample time nobody gave: which one is taken.

The drive is tests/python/support/drive_rig.py, which shares no code with the library.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga
from drive_rig import Plant, run_drive
from gaident.diagnosis.controller.period_shown import period_shown

__all__ = ["period_taken", "periods"]

DT, LINES = 1e-3, 2400  # of the log
EVERY = (1, 2, 4, 8, 16)
CONTROLLERS = ("limit", "low pass", "position")
SENSORS = ("differenced", "read", "noise")
LEVELS = (0.0, 50.0, 100.0, 20.0, -40.0, -100.0, -30.0, 10.0, 70.0, 0.0, 5.0, -5.0)  # rad/s


def periods(count: int, seed: int) -> list[Case]:
    made = [(every, controller, sensor) for controller in CONTROLLERS for sensor in SENSORS for every in EVERY]
    return [Case("periods", f"{controller}/{sensor}/{every}/{seed}/{n}", (every, controller, sensor), n + 1000 * seed)
            for n in range(count) for every, controller, sensor in made]  # fmt: skip


def controller_of(name: str, inertia: float, period: float) -> ga.Cascade:
    limit = {"torque_limit": 1000.0 * inertia, "anti_windup": "hold"} if name == "limit" else {}
    pi = ga.PI(round(150.0 * inertia, 6), round(8000.0 * inertia, 5), **limit)  # type: ignore[arg-type]
    filters = (ga.LowPass(0.5e-3),) if name == "low pass" else ()
    placed = {"position": ga.P(20.0), "velocity_feedforward": 1.0, "interpolation": "smooth"} if name == "position" else {}
    return ga.Cascade(pi, period, torque_filters=filters, **placed)  # type: ignore[arg-type]


def period_taken(case: Case) -> Result:
    every, name, sensor = case.what
    rng = np.random.default_rng([case.number, len(name), len(sensor)])
    inertia = float(10.0 ** rng.uniform(-4.0, -2.5))
    true = controller_of(name, inertia, DT / every)
    pi = true.velocity
    plant = Plant(J=inertia, D=2.0 * inertia, kp=pi.kp, ki=pi.ki, dt=DT, cascade=true)  # type: ignore[arg-type]
    step = 2500.0 * DT / every  # a ramp that the controller makes at its own samples
    levels = np.repeat(rng.permutation(LEVELS), LINES // len(LEVELS) * every)
    speed = np.zeros(len(levels))
    for n in range(1, len(speed)):
        speed[n] = speed[n - 1] + np.clip(levels[n] - speed[n - 1], -step, step)
    noise = 0.02 * rng.standard_normal(len(speed)) if sensor == "noise" else None
    encoder = 0.0 if sensor == "noise" else 2.0 * np.pi / 2**20
    friction = {"coulomb_friction": {"torque": 150.0 * inertia}}
    source = np.cumsum(speed) * DT / every if name == "position" else speed
    log = run_drive(plant, source, friction, encoder=encoder, differenced=sensor == "differenced", velocity_noise=noise)
    lines = {"position_command" if name == "position" else "command": source, "velocity": log.velocity, "torque": log.torque}
    lines |= {"position": log.position} if name == "position" else {}
    rec = ga.Record(DT, **{channel: x[::every] for channel, x in lines.items()})
    given = replace(true, period=None, velocity=replace(pi, torque_limit=None, anti_windup="none"))
    found = period_shown([rec], ga.PI(pi.kp, pi.ki) if name == "limit" else given)
    taken = None if found is None or not isinstance(found.controller, ga.Cascade) else found.controller.period
    if taken is None:
        return Result("right" if every == 1 else "missed", "asked" if found else "none", digest(""))
    taken_every = round(DT / taken)
    called = "right" if taken_every == every else "false alarm" if every == 1 else "wrong"
    return Result(called, f"{taken_every} to a line", digest(""))
