"""Logs whose torque changes between two lines: sampled from a measured torque, or made by a controller that is faster.

The drive is tests/python/support/drive_rig.py, which shares no code with the library. Hidden is dry friction, and nothing else.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga
from drive_rig import Noise, Plant, rig, run_drive

__all__ = ["ahead", "measured_torques", "named_ahead", "named_sampled"]

FINE = 62.5e-6  # s, of a current controller: its torque is held so long
SAMPLED = (1e-3, 2e-3, 3e-3, 5e-3, 10e-3)  # s, lines of a log of a faster torque
HELD = (1e-3, 2e-3, 3e-3, 4e-3)  # s, of a torque that is held over each line: controllers as slow as there are
LOOPED = 1e-3  # s, lines of the torque of a velocity loop
SHAFT = (60.0, 150.0)  # Hz, resonances of a shaft in that loop
SLOPE = 400.0  # rad/s^2, of its command
LINES = 2500
EVERY = (1, 2, 4, 8)
CLOSE = 0.01  # of an inertia


def measured_torques(count: int, seed: int) -> list[Case]:
    made = [("sampled", dt) for dt in SAMPLED] + [("held", dt) for dt in HELD]
    made += [("loop", LOOPED), ("shaft", LOOPED)]
    return [Case("sampled", f"{kind}/{1e3 * dt:g} ms/{seed}/{n}", (kind, dt), n + 1000 * seed)
            for n in range(count) for kind, dt in made]  # fmt: skip


def ahead(count: int, seed: int) -> list[Case]:
    made = [(every, sensor, given) for every in EVERY for sensor in ("differenced", "noise") for given in ("none", "P and PI")]
    return [Case("ahead", f"{every}/{sensor}/{given}/{seed}/{n}", (every, sensor, given), n + 1000 * seed)
            for n in range(count) for every, sensor, given in made]  # fmt: skip


def judged(dia: ga.Diagnosis, inertia: float) -> Result:
    """Dry friction alone, and the inertia to 1 % or its deviations."""
    sets = [{f.effect, *f.alternatives} for f in dia.findings if not f.is_noise]
    found = dia.mechanics.get("inertia")
    off = np.inf if found is None else abs(found.value - inertia)
    near = found is not None and off < max(CLOSE * inertia, 3.0 * found.std)
    friction = [s for s in sets if "coulomb_friction" in s]
    called = "missed" if not friction else "wrong" if len(sets) > 1 or not near else "in set" if len(friction[0]) > 1 else "right"
    said = "; ".join(" or ".join(sorted(s)) for s in sets)
    moved = any("goes on, as that of a controller" in note for note in dia.notes)
    return Result(called, f"{dia.verdict}: {said}; inertia {'right' if near else 'off'}{', torque ahead' if moved else ''}",
                  digest([f"{off / inertia:.1g}", dia.notes]))  # fmt: skip


def named_sampled(case: Case) -> Result:
    """A torque of some slow waves, and of steps that are smoothed over 10 ms, drives one mass in the open loop."""
    kind, dt = case.what
    rng = np.random.default_rng([case.number, round(1e6 * dt)])
    every = round(dt / FINE)
    if kind in ("loop", "shaft"):
        return in_a_loop(kind == "shaft", every, rng)
    t = FINE * np.arange(LINES * every)
    inertia = float(10.0 ** rng.uniform(-1.0, 1.0))
    waves = zip(rng.uniform(0.3, 1.0, 3), rng.uniform(0.5, 6.0, 3), rng.uniform(0.0, 6.0, 3), strict=True)
    u = 5.0 * inertia * np.sum([a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in waves], axis=0)
    lasts, rise = round(0.2 / FINE), round(0.01 / FINE)
    steps = np.repeat(rng.uniform(-5.0, 5.0, len(t) // lasts + 1), lasts)[: len(t)] * inertia
    u += np.convolve(steps, np.full(rise, 1.0 / rise), "same")
    u = np.repeat(u[::every], every) if kind == "held" else u
    plant = Plant(J=inertia, D=inertia, kp=0.0, ki=0.0, dt=FINE)
    friction = {"coulomb_friction": {"torque": 1.5 * inertia}}
    log = run_drive(plant, None, friction, torque=np.ascontiguousarray(u), substeps=2)
    velocity = log.truth[::every] + 2e-3 * float(np.std(log.truth)) * rng.standard_normal(LINES)
    torque = u[::every] + 1e-3 * float(np.std(u)) * rng.standard_normal(LINES)
    return judged(ga.diagnose(ga.Record(dt, velocity=velocity, torque=torque, torque_is="measured")), inertia)


def in_a_loop(shaft: bool, every: int, rng: np.random.Generator) -> Result:
    """Ramps with a random binary signal in a velocity loop of 16 kHz; its torque is measured and logged every so many samples."""
    inertia = float(10.0 ** rng.uniform(-3.5, -2.5))
    count = LINES * every
    levels = rng.permutation([5.0, -10.0, 20.0, -40.0, 40.0, -30.0, 30.0, -5.0, 10.0, -20.0])
    starts = 0.1 * LINES * every * FINE * np.arange(len(levels))
    times = np.column_stack([starts, starts + np.abs(np.diff(levels, prepend=0.0)) / SLOPE])
    command = np.interp(FINE * np.arange(count), times.ravel(), np.column_stack([np.append(0.0, levels[:-1]), levels]).ravel())
    lasts = 48 if shaft else 160  # 3 ms, short enough to excite the shaft
    chips = np.repeat(rng.choice([-1.0, 1.0], count // lasts + 1), lasts)[:count]
    command += np.where(np.arange(count) // (count // 10) % 2, chips, 0.0)
    plant = Plant(J=inertia, D=inertia, kp=300.0 * inertia, ki=15000.0 * inertia, dt=FINE)
    if shaft:
        motor, load = 0.6 * inertia, 0.4 * inertia
        pole = 2.0 * np.pi * rng.uniform(*SHAFT)
        stiffness = pole**2 * motor * load / inertia
        plant = replace(
            plant, J=motor, JL=load, KG=stiffness, DG=0.04 * stiffness / pole, kp=150.0 * inertia, ki=3000.0 * inertia
        )
    log = run_drive(plant, command, {"coulomb_friction": {"torque": 75.0 * inertia}}, substeps=2)
    velocity = log.truth[::every] + 1e-3 * float(np.std(log.truth)) * rng.standard_normal(LINES)
    torque = log.torque[::every] + (0.02 if shaft else 0.0) * float(np.std(log.torque)) * rng.standard_normal(LINES)
    dia = ga.diagnose(ga.Record(dt=FINE * every, velocity=velocity, torque=torque, torque_is="measured"))
    called = judged(dia, inertia)
    stiff = "stiffness" in dia.mechanics
    return called if stiff == shaft else replace(called, outcome="wrong", said=f"{called.said}; {'a' if stiff else 'no'} shaft")


def named_ahead(case: Case) -> Result:
    """A position loop with a notch filter, both unknown but for the gains; a line for every so many of its samples."""
    every, sensor, given = case.what
    rng = np.random.default_rng([case.number, every, len(sensor)])
    inertia, dt = float(10.0 ** rng.uniform(-3.5, -2.5)), 1e-3
    pi = ga.PI(80.0 * inertia, 4000.0 * inertia)
    loop = ga.Cascade(pi, dt / every, position=ga.P(20.0), torque_filters=(ga.Notch(200.0, 0.1, 0.7),))
    plant = Plant(J=inertia, D=2.0 * inertia, kp=pi.kp, ki=pi.ki, dt=dt, cascade=loop)  # type: ignore[arg-type]
    levels = np.repeat(rng.permutation([5.0, -10.0, 20.0, -40.0, 60.0, -60.0, 30.0, -3.0, 0.0, 15.0]), 300)
    speed = np.convolve(levels, np.full(30, 1.0 / 30.0), "same")
    differenced = Noise(white=0.0, encoder=2.0 * np.pi / 2**20, differenced=True)
    noise = differenced if sensor == "differenced" else Noise(white=0.01)
    rec = rig(plant, np.cumsum(speed) * dt, {"coulomb_friction": {"torque": 150.0 * inertia}}, noise, case.number)
    if given == "none":
        return judged(ga.diagnose(rec.with_channels(position_command=None)), inertia)
    return judged(ga.diagnose(rec, ga.Cascade(pi, position=ga.P(20.0))), inertia)
