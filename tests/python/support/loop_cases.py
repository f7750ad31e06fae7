"""Kinds of loop that servo drives have, drawn for the blind tests: `loop_plant("notch", 4, rng)` is a drive in such a loop."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.linalg import expm

import gaident as ga
from drive_cases import EFFECTS, LATER, RAMPS, Truth, command_for, level_command, random_case, random_plant, stable
from drive_rig import Array, Noise, Plant, RanAwayError, between_lines, run_drive

__all__ = [
    "EVERY",
    "LOOPS",
    "BAND",
    "DECAY",
    "PERIOD",
    "SCHEMES",
    "industrial_case",
    "industrial_plant",
    "jump_levels",
    "jump_log",
    "loop_effects",
    "loop_kind",
    "loop_noise",
    "loop_plant",
    "ramp_kind",
    "scheme_log",
    "scheme_run",
]

PERIOD = 125e-6  # s, of the velocity controller
EVERY = (1, 2, 4, 8)  # its samples to a line of the log
INDUSTRY_BITS = (17, 25)  # of an encoder's turn: 17 to 24
ENCODERS = {"encoder": (17, 21), "differenced": INDUSTRY_BITS}  # noise -> lines of a turn: 2^17 to 2^20, and to 2^24
OUT_OF_REACH = 1e6  # N m, a limit that is none
LIMIT_SHARE = (0.4, 0.7)  # of the greatest torque that is asked for
JOBS = 4  # commands of ramps that a limit is drawn from
LIMITS = ("torque_saturation", "integrator_clamp", "command_rate_limit")


def pi(plant: Plant, **more: object) -> ga.PI:
    return ga.PI(plant.kp, plant.ki, **more)  # type: ignore[arg-type]


def low_pass(rng: np.random.Generator, low: float, high: float) -> ga.LowPass:
    """Its time constant between these [s]."""
    return ga.LowPass(time_constant=float(rng.uniform(low, high)))


def notch(plant: Plant, rng: np.random.Generator) -> ga.Notch:
    """On the drive's resonance, 10 % beside it at most; of one mass anywhere from 150 to 500 Hz."""
    hertz = float(rng.uniform(150, 500))
    if plant.two_masses:
        hertz = float(np.sqrt(plant.KG * (1 / plant.J + 1 / plant.JL)) / (2 * np.pi) * rng.uniform(0.9, 1.1))
    return ga.Notch(frequency=hertz, numerator_damping=float(rng.uniform(0.05, 0.2)), denominator_damping=0.7)


def limit_for(plant: Plant, rng: np.random.Generator) -> float:
    """A torque limit [N m] of 0.4 to 0.7 of the greatest torque that the drive would ask for, in its loop or under a bare PI."""
    line = level_command(plant, np.random.default_rng(int(rng.integers(1 << 31))), False)
    free = plant if plant.cascade is not None else replace(plant, cascade=ga.Cascade(pi(plant), period=PERIOD))
    return greatest(free, between_lines(free, line)) * rng.uniform(*LIMIT_SHARE)


def greatest(plant: Plant, ticks: Array) -> float:
    """The greatest torque that the drive asks for under this command [N m]."""
    return float(np.abs(run_drive(plant, ticks).torque).max())


def reached_on(kind: str, plant: Plant, rng: np.random.Generator) -> Plant:
    """The drive with its torque limit, if it has one, where such commands reach it: of several the one that asks for least."""
    if plant.cascade is None or plant.cascade.velocity.torque_limit is None:
        return plant
    velocity = plant.cascade.velocity
    free = replace(plant, cascade=replace(plant.cascade, velocity=replace(velocity, torque_limit=OUT_OF_REACH)))
    least = min(greatest(free, command_for(kind, free, rng)) for _ in range(JOBS))
    limit = least * rng.uniform(*LIMIT_SHARE)
    return replace(plant, cascade=replace(plant.cascade, velocity=replace(velocity, torque_limit=limit)))


def hold(plant: Plant, rng: np.random.Generator) -> ga.Cascade:
    return ga.Cascade(pi(plant, torque_limit=limit_for(plant, rng), anti_windup="hold"), PERIOD)


def tracking(plant: Plant, rng: np.random.Generator) -> ga.Cascade:
    time = float(rng.uniform(1e-3, 10e-3))
    return ga.Cascade(pi(plant, torque_limit=limit_for(plant, rng), anti_windup="tracking", tracking_time=time), PERIOD)


def position(plant: Plant, rng: np.random.Generator) -> ga.Cascade:
    return ga.Cascade(
        pi(plant), PERIOD, position=ga.P(float(rng.uniform(10, 30))), position_period=8 * PERIOD,
        velocity_feedforward=1.0, acceleration_feedforward=float((plant.J + plant.JL) * rng.uniform(0.8, 1.1)),
    )  # fmt: skip


def together(plant: Plant, rng: np.random.Generator) -> ga.Cascade:
    velocity = pi(plant, rule="backward", command_weight=float(rng.uniform(0.3, 0.8)), torque_limit=limit_for(plant, rng),
                  anti_windup="hold")  # fmt: skip
    return ga.Cascade(
        velocity, PERIOD, torque_filters=(low_pass(rng, 0.2e-3, 0.5e-3), notch(plant, rng)),
        velocity_filters=(low_pass(rng, 0.2e-3, 0.4e-3),), command_filters=(low_pass(rng, 1e-3, 3e-3),),
    )  # fmt: skip


LOOPS: dict[str, Callable[[Plant, np.random.Generator], ga.Cascade]] = {
    "bare": lambda plant, rng: ga.Cascade(pi(plant), PERIOD),
    "backward": lambda plant, rng: ga.Cascade(pi(plant, rule="backward"), PERIOD),
    "ip": lambda plant, rng: ga.Cascade(pi(plant, command_weight=0.0), PERIOD),
    "torque low pass": lambda plant, rng: ga.Cascade(pi(plant), PERIOD, torque_filters=(low_pass(rng, 0.2e-3, 0.8e-3),)),
    "notch": lambda plant, rng: ga.Cascade(pi(plant), PERIOD, torque_filters=(notch(plant, rng),)),
    "hold": hold,
    "tracking": tracking,
    "command filter": lambda plant, rng: ga.Cascade(pi(plant), PERIOD, command_filters=(low_pass(rng, 1e-3, 5e-3),)),
    "velocity filter": lambda plant, rng: ga.Cascade(pi(plant), PERIOD, velocity_filters=(low_pass(rng, 0.3e-3, 1e-3),)),
    "computing delay": lambda plant, rng: ga.Cascade(pi(plant), PERIOD, delay=PERIOD * float(rng.choice([0.5, 1.0, 1.5]))),
    "position": position,
    "together": together,
}
LIMITED = ("hold", "tracking", "together")


def loop_kind(loop: str) -> str:
    """The kind of command that drives it: a position command is a move."""
    return "move" if loop == "position" else "multi"


def ramp_kind(turn: int) -> str:
    """The kinds of ramps, each for two numbers, so that both have either noise."""
    return list(RAMPS)[turn // 2 % len(RAMPS)]


def loop_effects(loop: str) -> tuple[str, ...]:
    """What can hide in such a loop: no second limit where one acts, no rate limit behind a position controller."""
    without = LIMITS if loop in LIMITED else ("command_rate_limit",) if loop == "position" else ()
    return tuple(effect for effect in EFFECTS if effect not in (*without, *LATER))


def loop_noise(name: str, seed: int) -> Noise | str:
    """The noise of that name; an encoder is one of a drive: 2^17 to 2^20 lines a turn, differenced 2^17 to 2^24."""
    if name not in ENCODERS:
        return name
    bits = int(np.random.default_rng(seed).integers(*ENCODERS[name]))
    return Noise(white=0.0, encoder=2 * np.pi / 2.0**bits, differenced=name == "differenced")


def loop_plant(loop: str, every: int, rng: np.random.Generator, two_masses: bool | None = None, kind: str | None = None) -> Plant:
    """A random drive in such a loop, its log at every `every`-th controller sample. Raises RuntimeError where none is stable.

    kind: of the command that reaches its torque limit; None: levels.
    """
    for _ in range(50):
        plant = replace(random_plant(rng, two_masses), dt=PERIOD * every)
        try:
            plant = replace(plant, cascade=LOOPS[loop](plant, rng))
            plant = plant if kind is None else reached_on(kind, plant, rng)
        except RanAwayError:
            continue
        if stable(plant, {}):
            return plant
    raise RuntimeError(f"no stable drive found in the loop {loop!r}")


RESONANCE = (60.0, 500.0)  # Hz
INERTIA_RATIO = (0.3, 10.0)  # load over motor
CURRENT_LOOP = (0.1e-3, 0.5e-3)  # s, its time constant
GAIN_MARGIN = 1.6  # that a commissioned drive has at least; with less its shaft rings through a whole record
LIMITED_SHARE = 1 / 3  # of the drives without an anti-windup, those that reach a torque limit


def louder(plant: Plant, factor: float) -> Plant:
    """The drive with the gains of its velocity controller times this factor."""
    assert plant.cascade is not None
    pi = plant.cascade.velocity
    assert pi.kp is not None and pi.ki is not None
    cascade = replace(plant.cascade, velocity=replace(pi, kp=factor * pi.kp, ki=factor * pi.ki))
    return replace(plant, kp=factor * plant.kp, ki=factor * plant.ki, cascade=cascade)


def industrial_plant(loop: str, every: int, rng: np.random.Generator) -> Plant:
    """A drive of two masses as industry has them, in such a loop. Raises RuntimeError where none is stable.

    Its loop is as fast as the resonance allows; the rigid loop's poles have wn of an eighth of it, and at most 200 rad/s.
    """
    for _ in range(50):
        f, ratio = (float(np.exp(rng.uniform(*np.log(ends)))) for ends in (RESONANCE, INERTIA_RATIO))
        J = float(np.exp(rng.uniform(*np.log((1e-4, 1e-3)))))
        JL, w = ratio * J, 2 * np.pi * f
        reduced = J * JL / (J + JL)
        K = reduced * w**2
        wn, zeta = min(w / 8, 200.0) * rng.uniform(0.5, 1.0), rng.uniform(0.7, 1.0)
        D = float((J + JL) * rng.uniform(1.0, 5.0))
        plant = Plant(
            J=J, D=0.5 * D, JL=JL, DL=0.5 * D, KG=K, DG=float(2 * rng.uniform(0.01, 0.05) * reduced * w),
            kp=float(f"{2 * zeta * wn * (J + JL) - D:.4g}"), ki=float(f"{wn**2 * (J + JL):.4g}"), dt=PERIOD * every,
            name="industry",
        )  # fmt: skip
        try:
            plant = replace(plant, cascade=LOOPS[loop](plant, rng))
            assert plant.cascade is not None
            if plant.cascade.velocity.torque_limit is None and rng.uniform() < LIMITED_SHARE and loop != "position":
                limited = replace(plant.cascade.velocity, torque_limit=limit_for(plant, rng))
                plant = replace(plant, cascade=replace(plant.cascade, velocity=limited))
            if stable(louder(plant, GAIN_MARGIN), {"torque_lag": {"time_constant": CURRENT_LOOP[1]}}):
                return plant
        except RanAwayError:
            continue
    raise RuntimeError(f"no stable drive found in the loop {loop!r}")


def industrial_case(
    loop: str, every: int, effect: str, number: int, bits: tuple[int, int] = INDUSTRY_BITS, torque: bool = True
) -> tuple[ga.Record, ga.Record, ga.Cascade, Truth]:
    """(record, another one for validation, controller, truth) of an industrial drive with a current loop."""
    rng = np.random.default_rng([number, zlib.crc32(f"{loop} {every} {effect}".encode())])
    plant = industrial_plant(loop, every, rng)
    factor = float(rng.uniform(*CURRENT_LOOP)) / 1e-3
    noise = Noise(white=0.0, encoder=2 * np.pi / 2.0 ** int(rng.integers(*bits)), differenced=True)
    hidden = ("torque_lag", effect) if effect else ("torque_lag",)
    record, validation, controller, truth = random_case(number, hidden, loop_kind(loop), noise, torque, factor, plant)
    assert isinstance(controller, ga.Cascade)
    return record, validation, controller, truth


def jump_levels(every: int, seed: int, on_lines: bool = False) -> Array:
    """Levels [rad/s] that begin at any of a controller's samples, at least 60 lines each; (1000 every,)."""
    rng, whole, at = np.random.default_rng(seed), np.zeros(1000 * every), 100
    while at < 1000:
        whole[at * every + (0 if on_lines else int(rng.integers(every))) :] = rng.uniform(-40.0, 40.0)
        at += int(rng.integers(60, 150))
    return whole


def jump_log(whole: Array, every: int, loop: ga.Cascade, **effects: dict[str, float]) -> ga.Record:
    """The log of two masses under this command at the controller's samples [rad/s], every so-many-th of them."""
    axis = Plant(J=4e-4, D=1e-3, JL=4e-4, DL=1e-3, KG=60.0, DG=5e-3, kp=0.1, ki=6.0, dt=every * PERIOD, cascade=loop)
    log = run_drive(axis, whole, effects, encoder=2 * np.pi / 2**20, differenced=True)
    lines = {"velocity": log.velocity, "torque": log.torque, "command": whole}
    return ga.Record(every * PERIOD, **{name: x[::every] for name, x in lines.items()})


SCHEMES: dict[str, set[str]] = {
    "decay": {"integration_rule", "torque_saturation", "anti_windup"},
    "clamps": {"torque_saturation", "integrator_clamp"},
    "dead band": {"error_dead_band"},
    "reset": {"integral_reset"},
}
"""Velocity controllers whose integral does what `PI` has no word for -> the findings that say it.

    e = r - w,   u = kp e + I,   clamped to +-L,   T the controller's period

decay       I += ki T e after u; where u is limited, I *= 0.99 instead (ODrive, Firmware/MotorControl/controller.cpp)
clamps      I trapezoidal, clamped to +-L as the output is (SimpleFOC, src/common/pid.cpp)
dead band   e = 0 where abs(r - w) is below a width
reset       I = 0 in a sample in which the command changes its sign
"""
DECAY = 0.99  # of the integral that stays in each limited sample
SCHEME_LIMIT = 0.4  # of the greatest torque that is asked for, where the scheme acts at a limit
BAND = 0.02  # of the greatest command
COARSE = 2 * np.pi / 2**17  # rad, an encoder's


def matrices(plant: Plant, period: float) -> tuple[Array, Array]:
    """(F, G) of x(n+1) = F x(n) + G u(n), exact behind a held torque.

    The first state is the motor's velocity [rad/s], the last one its angle [rad].
    """
    if plant.two_masses:
        A = np.array(
            [
                [-(plant.D + plant.DG) / plant.J, plant.DG / plant.J, -plant.KG / plant.J, 0.0],
                [plant.DG / plant.JL, -(plant.DL + plant.DG) / plant.JL, plant.KG / plant.JL, 0.0],
                [1.0, -1.0, 0.0, 0.0],
                [1.0, 0.0, 0.0, 0.0],
            ]
        )
    else:
        A = np.array([[-plant.D / plant.J, 0.0], [1.0, 0.0]])
    B = np.eye(len(A))[:, :1] / plant.J
    n = len(A)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n:] = A * period, B * period
    whole = expm(whole)
    return whole[:n, :n], whole[:n, n]


KEPT = {"decay": DECAY, "hold": 1.0}  # scheme -> what is kept of the integral in a limited sample


def scheme_run(plant: Plant, command: Array, scheme: str, size: float, noise: Array | None = None) -> tuple[Array, Array]:
    """(velocity that the controller reads [rad/s], torque [N m]) at the controller's samples.

    size: the torque limit [N m], or the width of the dead band [rad/s]. noise [rad/s] is on what the controller reads.
    """
    period = plant.dt / plant.log_every
    F, G = matrices(plant, period)
    kp, ki = plant.kp, plant.ki
    x, integral, before, asked = np.zeros(len(G)), 0.0, 0.0, 0.0
    limit = size if scheme in (*KEPT, "clamps") else np.inf
    velocity, torque = np.empty(len(command)), np.empty(len(command))
    for n, r in enumerate(command):
        w = x[0] + (0.0 if noise is None else noise[n])
        e = r - w
        if scheme == "dead band" and abs(e) < size:
            e = 0.0
        if scheme == "reset" and r * asked < 0.0:
            integral = 0.0
        if scheme not in KEPT:
            integral += 0.5 * ki * period * (e + before)
        if scheme == "clamps":
            integral = min(max(integral, -limit), limit)
        u = kp * e + integral
        limited = min(max(u, -limit), limit)
        if scheme in KEPT:
            integral = KEPT[scheme] * integral if limited != u else integral + ki * period * e
        velocity[n], torque[n] = w, limited
        before, asked = e, r if r else asked
        x = F @ x + G * limited
    return velocity, torque


def scheme_log(plant: Plant, command: Array, scheme: str, seed: int) -> ga.Record:
    """The log of one run, with white noise on the velocity or that of a differenced encoder's angle, in turn."""
    rng = np.random.default_rng(seed)
    period = plant.dt / plant.log_every
    noise = rng.standard_normal(len(command)) * (0.1 if seed % 2 else COARSE / np.sqrt(6.0) / period)
    free = np.abs(scheme_run(plant, command, "", np.inf)[1]).max()
    size = SCHEME_LIMIT * free if scheme in (*KEPT, "clamps") else BAND * float(np.abs(command).max())
    velocity, torque = scheme_run(plant, command, scheme, size, noise)
    every = plant.log_every
    return ga.Record(plant.dt, command=command[::every], velocity=velocity[::every], torque=torque[::every], name=scheme)
