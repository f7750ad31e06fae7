"""Blind cases: random drives, commands and hidden effects for drive_rig; `random_case(seed, effect)` draws one.

Sizes are the typical ones of a small servo (1 N m rated) times a factor; for the limiting effects (saturation, clamp, rate
limit) a larger factor is a lower limit. Cases in which the effect changes nothing at all, or the loop is unstable, are redrawn.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

import gaident as ga
from drive_rig import AT_LOAD, COUPLING, NOISES, Array, LoadSensor, Noise, Plant, RanAwayError, between_lines, log_of, run_drive

__all__ = [
    "ANYWHERE",
    "EFFECTS",
    "KINDS",
    "NOISE_EFFECTS",
    "PAIRS",
    "RAMPS",
    "WAVE_ORDERS",
    "Truth",
    "command_for",
    "draw_effect",
    "level_command",
    "random_case",
    "random_plant",
    "two_masses",
]

EFFECTS = (
    "coulomb_friction",
    "stribeck_friction",
    "asymmetric_friction",
    "presliding_friction",
    "quadratic_drag",
    "load_torque",
    "unbalance",
    "cogging",
    "friction_drift",
    "backlash",
    "hardening_stiffness",
    "torque_saturation",
    "torque_dead_band",
    "transport_delay",
    "torque_lag",
    "integrator_clamp",
    "command_rate_limit",
    "velocity_filter",
    "velocity_ripple",
    "velocity_quantisation",
    "extra_resonance",
    "outliers",
    "lugre_friction",
    "hysteretic_coupling",
    "square_root_drag",
    "position_friction",
    "torque_hum",
    "position_inertia",
)
NOISE_EFFECTS = ("velocity_quantisation", "outliers")
LATER = ("hysteretic_coupling", "square_root_drag", "position_friction", "torque_hum", "position_inertia")
"""Effects that are younger than the tables of bench/README.md: what a seed draws there stays the same without them."""
WAVE_ORDERS = {"cogging": (2, 4, 6, 8, 12, 18, 24), "velocity_ripple": (1, 2, 3, 4, 8)}
"""Effects that may have several waves -> orders that these are drawn from."""
FRICTION = (
    *("coulomb_friction", "stribeck_friction", "asymmetric_friction", "presliding_friction", "friction_drift"),
    "lugre_friction",
)
LINEAR = ("transport_delay", "torque_lag", "velocity_filter", "extra_resonance")
# Of these only one at a time, in a pair: the others would act on the same thing and hide or imitate it.
RELATED = (FRICTION, ("transport_delay", "torque_lag", "velocity_filter"), (*COUPLING, "extra_resonance"),
           ("torque_saturation", "integrator_clamp", "command_rate_limit"), ("load_torque", "asymmetric_friction"))  # fmt: skip
PAIRS = tuple(
    (a, b)
    for i, a in enumerate(EFFECTS)
    for b in EFFECTS[i + 1 :]
    # Without the LuGre friction, as without what is later: so that the pairs that a seed draws stay those of the tables.
    if not {a, b} & {*NOISE_EFFECTS, "lugre_friction", *LATER} and not any(a in group and b in group for group in RELATED)
)
KINDS = ("multi", "step", "move")
RAMPS = {"trapezoid": False, "s-shape": True}
"""Kinds of command that a ramp generator makes, for loops with a clock of their own -> whether the acceleration is rounded."""
ANYWHERE = (*RAMPS, "jump")
"""Kinds of command that change at any of the controller's samples, not at the lines of a log alone."""

STEP_SAMPLES, LONG_SAMPLES = 250, 3500
LONG_TIME = 1.75  # s, the least of a long record under a cascade, whose log may have many lines a second
SPEEDS = (1, 3, 5, 10, 20, 30, 40, 60, 80)  # rad/s
SLOPES = (500.0, 10_000.0)  # rad/s2, the greatest of a ramp
ROUNDED = (0.2, 0.5)  # of the time of an S-shaped ramp, in which its acceleration rises, and in which it falls
RAMPED = 0.7  # of the time of a level, that the ramp to it takes at most


@dataclass(frozen=True)
class Truth:
    """What is hidden in a case; `effects` as the drive has them, {} for a clean one. Commands are at the controller's clock."""

    effects: dict[str, dict[str, float]]
    plant: Plant
    kind: str
    noise: Noise
    factor: float
    seed: int
    command: Array
    validation_command: Array | None
    settle: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.effects)


def nominal_plants() -> list[Plant]:
    """Small servo axes. The first has the published controller, the others (kp = ki = 0) are tuned when they are varied."""
    return [
        Plant(J=1.02e-4, D=0.003, JL=5.815e-4, DL=0.008, KG=2.59, kp=0.0232, ki=1.367, dt=0.444e-3, name="table 3"),
        Plant(J=2e-4, D=1e-3, JL=3e-4, DL=1e-3, KG=55.0, DG=2.4e-3, kp=0, ki=0, dt=0.444e-3, name="stiff shaft"),
        Plant(J=3e-4, D=2e-3, JL=3e-4, DL=1e-3, KG=12.0, DG=1e-3, kp=0, ki=0, dt=1e-3, name="soft shaft"),
        Plant(J=3e-4, D=1.5e-3, kp=0, ki=0, dt=1e-3, name="one mass"),
        Plant(J=1.2e-4, D=0.8e-3, kp=0, ki=0, dt=0.444e-3, name="small motor"),
    ]


BANDWIDTH = {"stiff shaft": 70.0, "soft shaft": 45.0, "one mass": 80.0, "small motor": 110.0}  # rad/s


def random_plant(rng: np.random.Generator, two_masses: bool | None = None) -> Plant:
    """One of the nominal plants, every parameter within 30 %."""
    choice = [p for p in nominal_plants() if two_masses is None or p.two_masses == two_masses]
    plant = choice[rng.integers(len(choice))]
    names = ("J", "D", "JL", "DL", "KG", "DG")
    plant = replace(plant, **{name: getattr(plant, name) * rng.uniform(0.7, 1.3) for name in names})
    return plant if plant.kp else tuned(plant, rng)


RATIOS, ANTIRESONANCE = (0.3, 10.0), (60.0, 400.0)  # load to motor, rad/s


def two_masses(rng: np.random.Generator) -> Plant:
    """A drive of two masses of any usual inertia ratio, whose antiresonance a log of 0.444 or 1 ms shows."""
    whole, ratio, swing = (float(np.exp(rng.uniform(*np.log(r)))) for r in ((4e-4, 1e-3), RATIOS, ANTIRESONANCE))
    load = whole * ratio / (1 + ratio)
    stiffness, damped = load * swing**2, float(np.exp(rng.uniform(*np.log((0.005, 0.03)))))
    D, DL = (float(np.exp(rng.uniform(*np.log((0.7e-3, 4e-3))))) for _ in range(2))
    plant = Plant(J=whole - load, D=D, JL=load, DL=DL, KG=stiffness, DG=2 * damped * swing * load, kp=0, ki=0,
                  dt=float(rng.choice([0.444e-3, 1e-3])), name=f"ratio {ratio:.2g}")  # fmt: skip
    for bandwidth in (0.5, 0.35, 0.25, 0.15, 0.1):
        slow = tuned(plant, rng, min(bandwidth * swing, 80.0))
        if comes_to_rest(slow, {}):
            return slow
    return two_masses(rng)


def tuned(plant: Plant, rng: np.random.Generator, bandwidth: float | None = None) -> Plant:
    """With a PI controller, the poles of the rigid loop at wn [rad/s] with damping zeta: kp = 2 zeta wn J - D, ki = wn^2 J."""
    wn, zeta = (bandwidth or BANDWIDTH[plant.name]) * rng.uniform(0.8, 1.2), rng.uniform(0.6, 0.9)
    inertia, damping = plant.J + plant.JL, plant.D + plant.DL
    return replace(plant, kp=float(f"{2 * zeta * wn * inertia - damping:.4g}"), ki=float(f"{wn**2 * inertia:.4g}"))


def command_for(kind: str, plant: Plant, rng: np.random.Generator, other_order: bool = False) -> Array:
    """A velocity command [rad/s]: one step, levels with reversals and dither, point-to-point moves, or one of ANYWHERE.

    Its sum, a position command [rad], for a drive with a position controller.
    It is at the controller's clock; all but ANYWHERE are made at the lines of the log.
    """
    if kind in ANYWHERE:
        ticks = ramp_command(plant, rng, other_order, kind)
        return np.cumsum(ticks) * (plant.dt / plant.log_every) if plant.placed else ticks
    command = {"step": step_command, "multi": level_command, "move": move_command}[kind](plant, rng, other_order)
    return between_lines(plant, np.cumsum(command) * plant.dt if plant.placed else command)


def samples_of(kind: str, plant: Plant) -> int:
    """Lines of a record."""
    if kind == "step":
        return STEP_SAMPLES
    return LONG_SAMPLES if plant.cascade is None else max(LONG_SAMPLES, round(LONG_TIME / plant.dt))


def step_command(plant: Plant, rng: np.random.Generator, other_order: bool) -> Array:
    command = np.zeros(STEP_SAMPLES)
    command[10:] = 50.0 if not other_order else 35.0
    return command


def levels_for(rng: np.random.Generator, other_order: bool) -> list[float]:
    """Twenty levels with reversals, from rest to rest, slow ones together so that they settle [rad/s]."""
    groups = [list(rng.permutation(SPEEDS[:4])), list(rng.permutation(SPEEDS[4:]))]
    levels = [0.0]
    for group in reversed(groups) if other_order else groups:
        for speed in group:
            first = rng.choice([-1, 1])
            levels += [first * speed, -first * speed]
    return [*levels, 0.0]


def level_command(plant: Plant, rng: np.random.Generator, other_order: bool) -> Array:
    """The levels, at the lines of the log; every other one with a PRBS worth 0.05 N m."""
    levels = levels_for(rng, other_order)
    samples = samples_of("multi", plant)
    edges = np.linspace(0, samples, len(levels) + 1).astype(int)
    command = np.empty(samples)
    # A log that is slower than the controller shows a held command as such only where it stays for two lines: no shorter chip.
    slower = plant.log_every > 1
    shortest = 2 if slower else 1
    for i, level in enumerate(levels):
        length = edges[i + 1] - edges[i]
        command[edges[i] : edges[i + 1]] = level
        if i % 2 == 1:
            clock = max(shortest, round((4e-3 if i % 4 == 1 else 1e-3) / plant.dt))
            chips = rng.choice([-1.0, 1.0], length // clock + 1)
            chip = np.arange(length) // clock
            chip = np.minimum(chip, length // clock - 1) if slower else chip
            command[edges[i] : edges[i + 1]] += 0.05 / plant.kp * chips[chip]
    return command


def ramp_command(plant: Plant, rng: np.random.Generator, other_order: bool, kind: str) -> Array:
    """The levels, at the controller's clock; to each a ramp of its own slope that begins at any sample, and ends at any time.

    "jump": no ramp, but a jump at that sample.

    x goes from 0 to 1 over the ramp; rounded: the acceleration rises over a share s of it, and falls over as much,

        v = (x^2 - (x - s)^2 - (x - 1 + s)^2)/(2 s (1 - s)),  of each square only where its base is positive
    """
    levels = levels_for(rng, other_order)
    samples, period = samples_of("multi", plant) * plant.log_every, plant.dt / plant.log_every
    length, command = samples / len(levels), np.full(samples, levels[0])
    rounded = RAMPS.get(kind, False)
    share = float(rng.uniform(*ROUNDED)) if rounded else 0.0
    for i, (before, level) in enumerate(pairwise(levels), start=1):
        slope = float(np.exp(rng.uniform(*np.log(SLOPES))))
        lasts = min(abs(level - before) / (slope * (1 - share) * period), RAMPED * length)  # samples
        begins = round((i + rng.uniform(0, 1 - RAMPED)) * length)
        since = np.arange(samples) - begins
        x = np.clip(since / lasts, 0.0, 1.0) if kind in RAMPS else (since >= 0.0).astype(np.float64)
        if rounded:
            rises, held, falls = (np.maximum(x - late, 0.0) ** 2 for late in (0.0, share, 1 - share))
            x = (rises - held - falls) / (2 * share * (1 - share))
        command += (level - before) * x
    return command


def move_command(plant: Plant, rng: np.random.Generator, other_order: bool) -> Array:
    """Moves back and forth with limited acceleration and jerk, and dwells; the other order is another job."""
    command = np.zeros(0)
    samples = samples_of("move", plant)
    while len(command) < samples:
        speed, acceleration = rng.uniform(20, 90), 10 ** rng.uniform(3, 3.6)
        ramp = max(2, round(speed / acceleration / plant.dt))
        hold = round(rng.uniform(0.03, 0.15) / plant.dt)
        profile = np.concatenate([np.arange(ramp) / ramp, np.ones(hold), 1 - np.arange(ramp) / ramp])
        smooth = np.ones(max(1, ramp // 3)) / max(1, ramp // 3)
        dwell = np.zeros(round(rng.uniform(0.05, 0.12) / plant.dt))
        move = speed * np.convolve(np.concatenate([profile, np.zeros(len(smooth))]), smooth)
        command = np.concatenate([command, dwell, move, dwell, -move])
    return command[:samples]


def draw_effect(name: str, factor: float, plant: Plant, samples: int, rng: np.random.Generator) -> dict[str, float]:
    """Parameters of one effect, also "name@load", at `factor` times its typical size."""
    name = name.removesuffix(AT_LOAD)
    sign = float(rng.choice([-1, 1]))
    phase = float(rng.uniform(-np.pi, np.pi))
    near = float(np.exp(rng.uniform(-0.35, 0.35)))  # for parameters that are no size
    damping = plant.D + plant.DL
    if name == "asymmetric_friction":
        viscous = (0.4 * damping * factor, 0.0)[:: int(sign)]
        uneven = 0.3 * float(rng.choice([-1, 1]))
        return {
            "torque_positive": 0.05 * factor * (1 + uneven),
            "torque_negative": 0.05 * factor * (1 - uneven),
            "viscous_positive": viscous[0],
            "viscous_negative": viscous[1],
        }
    if name == "friction_drift":
        rate = 0.2 * factor
        return {"torque": 0.05 * near, "rate": rate if sign > 0 else -min(rate, 0.8 / (samples * plant.dt))}
    if name == "extra_resonance":
        # A third mass on the motor: (wp/wz)^2 - 1 is its share of the inertia before it.
        wz, ratio, zz = 1000.0 * near, float(np.sqrt(1 + 0.3 * factor)), float(rng.uniform(0.01, 0.03))
        return {"frequency": wz * ratio, "damping": zz * ratio, "zero_frequency": wz, "zero_damping": zz}
    drawn: dict[str, dict[str, float]] = {
        "coulomb_friction": {"torque": 0.05 * factor},
        "stribeck_friction": {"torque": 0.04 * factor, "static_torque": 0.07 * factor, "stribeck_velocity": 2 * near},
        "presliding_friction": {"torque": 0.05 * factor, "stiffness": 3 * near},
        "lugre_friction": {
            "torque": 0.04 * factor,
            "static_torque": 0.07 * factor,
            "stribeck_velocity": 2 * near,
            "stiffness": 10 * near,
            "damping": 0.005 * near,
        },
        "quadratic_drag": {"coefficient": 1.5e-5 * factor},
        "square_root_drag": {"coefficient": 0.05 / np.sqrt(80) * factor},
        "load_torque": {"torque": 0.03 * factor * sign},
        "unbalance": {"amplitude": 0.05 * factor, "phase": phase},
        "cogging": {"amplitude": 0.03 * factor, "order": float(rng.choice([4, 6, 12, 18])), "phase": phase},
        "backlash": {"gap": 0.01 * factor},
        # The same relative hardening at the same torque: k3 (T/K)^2 / K.
        "hardening_stiffness": {"cubic_stiffness": 1e5 * (plant.KG / 55) ** 3 * factor},
        # 1.4 N m where a reversal at full speed asks for 3.7.
        "torque_saturation": {"limit": 1.4 / factor * max(1.0, plant.kp / 0.0232)},
        "torque_dead_band": {"width": 0.03 * factor},
        # Two samples: a delay inside one sample is, at the samples, the same as a lag.
        "transport_delay": {"delay": max(1e-3, 2 * plant.dt) * factor},
        "torque_lag": {"time_constant": 1e-3 * factor},
        "integrator_clamp": {"limit": 0.05 / factor},
        "command_rate_limit": {"rate": 3000 / factor},
        "velocity_filter": {"time_constant": 1e-3 * factor},
        "velocity_ripple": {"amplitude": 5e-3 * factor, "order": float(rng.choice([1, 2, 4])), "phase": phase},
        "velocity_quantisation": {"step": 0.63 * factor},
        "outliers": {"fraction": max(3, round(0.002 * factor * samples)) / samples},
        "position_inertia": {"amplitude": min(0.6, 0.2 * factor), "order": float(1 + round(1e8 * phase) % 3), "phase": phase},
        "torque_hum": {"amplitude": 0.03 * factor, "frequency": float(rng.uniform(10, 50)), "phase": phase},
        "position_friction": {"torque": 0.05 * factor, "amplitude": 0.8, "order": float(rng.choice([1, 2, 3])), "phase": phase},
        # A torque of friction, beside a shaft that has as much stiffness as the element, from half of it to twice as much.
        "hysteretic_coupling": {"torque": 0.04 * factor, "stiffness": 0.4 * factor * plant.KG},
        "random_walk_friction": {"torque": 0.05 * factor, "size": 0.6, "number": float(round(1e8 * phase))},
        "thermal_gain": {"share": min(0.6, 0.25 * factor), "time_constant": 0.5 * samples * plant.dt},
        # The angle is a share of the way that the axis makes, see `as_the_way_is`.
        "contact": {"stiffness": 200 * near, "angle": 0.8, "damping": 0.05 * near},
        "growing_inertia": {"rate": 0.5 * factor / (samples * plant.dt)},
        "resolver_error_of_speed": {"error": 1.5e-4 * factor, "order": float(2 ** (round(1e8 * phase) % 3)), "phase": phase},
    }
    return drawn[name]


def as_ramps_ask(hidden: dict[str, dict[str, float]], plant: Plant, command: Array) -> None:
    """Make a limit of the torque the share of what these ramps ask for that it is of what a reversal at full speed does."""
    if "torque_saturation" in hidden:
        asked = float(np.abs(run_drive(plant, command).torque).max())
        hidden["torque_saturation"]["limit"] *= asked / (3.7 * max(1.0, plant.kp / 0.0232))


def with_waves(name: str, first: dict[str, float], count: int, rng: np.random.Generator) -> dict[str, float]:
    """An effect with so many waves in all, the further ones smaller and of other orders; others as they are."""
    if (orders := WAVE_ORDERS.get(name.removesuffix(AT_LOAD))) is None:
        return first
    found, left = dict(first), [n for n in orders if n != first["order"]]
    shares = sorted(rng.uniform(0.3, 1.0, count - 1), reverse=True)
    for k, (order, share) in enumerate(zip(rng.choice(left, count - 1, replace=False), shares, strict=True), 2):
        found |= {f"amplitude_{k}": first["amplitude"] * float(share)}
        found |= {f"order_{k}": float(order), f"phase_{k}": float(rng.uniform(-np.pi, np.pi))}
    return found


def as_the_way_is(hidden: dict[str, dict[str, float]], plant: Plant, command: Array) -> None:
    """Put a stop at that share of the largest angle of the axis without it."""
    if "contact" in hidden:
        angle = run_drive(plant, command).position
        hidden["contact"]["angle"] *= float(angle[np.abs(angle).argmax()])


def stable(plant: Plant, effects: dict[str, dict[str, float]]) -> bool:
    """Whether the loop with its linear effects comes to rest at a level; a bare PI without such an effect does."""
    linear = {name: values for name, values in effects.items() if name in LINEAR}
    return (not linear and plant.cascade is None) or comes_to_rest(plant, linear)


def comes_to_rest(plant: Plant, effects: dict[str, dict[str, float]]) -> bool:
    """Whether the loop settles at a level."""
    every = plant.log_every
    try:
        level = np.full(round(0.9 / plant.dt) * every, 1.0 if plant.placed else 50.0)
        end = run_drive(plant, level, effects).truth[-round(0.15 / plant.dt) * every :]
    except RanAwayError:
        return False
    return bool(np.ptp(end) < 0.5)


def acts(truth: Truth) -> bool:
    """Whether every hidden effect changes the noise-free record at all."""
    if not truth.effects:
        return True
    try:
        command = truth.command
        whole = run_drive(truth.plant, command, truth.effects).velocity
        for name in set(truth.effects) - {"outliers"}:
            rest = {key: value for key, value in truth.effects.items() if key != name}
            if np.sqrt(np.mean((run_drive(truth.plant, command, rest).velocity - whole) ** 2)) < 1e-6:
                return False
    except RanAwayError:
        return False
    return True


def random_case(
    seed: int,
    effect: str | Sequence[str] | None = None,
    kind: str = "multi",
    noise: str | Noise = "white",
    torque_logged: bool = True,
    factor: float | None = None,
    plant: Plant | None = None,
    position_logged: bool = False,
    settle: int = 0,
    waves: int = 1,
    load_sensor: LoadSensor | None = None,
) -> tuple[ga.Record, ga.Record | None, ga.PI | ga.Cascade, Truth]:
    """Draw record, validation record (None for a single step), controller and truth; arguments as in `random_truth`."""
    truth = random_truth(seed, effect, kind, noise, factor, plant, settle, waves)
    return *records(truth, torque_logged, position_logged, load_sensor), truth.plant.controller, truth


def random_truth(
    seed: int,
    effect: str | Sequence[str] | None = None,
    kind: str = "multi",
    noise: str | Noise = "white",
    factor: float | None = None,
    plant: Plant | None = None,
    settle: int = 0,
    waves: int = 1,
) -> Truth:
    """Draw a drive, what hides in it and the commands; the same arguments give the same case.

    `factor` None: log-uniform in 0.5..2, for each effect of a pair its own.
    `waves`: so many of each effect that may have several, of orders of their own.
    Random numbers depend on seed, effect and kind, not on noise or factor, so that curves over the size follow one drive.
    """
    effects = (effect,) if isinstance(effect, str) else tuple(effect or ())
    rng = np.random.default_rng([seed, zlib.crc32(" ".join((kind, *effects)).encode())])
    encoder = float(np.exp(rng.uniform(np.log(1e-4), np.log(6.3e-4))))
    noise_now = replace(NOISES[noise], encoder=encoder) if noise in ("encoder", "differenced") else noise
    noise_now = NOISES[noise_now] if isinstance(noise_now, str) else noise_now
    for _ in range(200 if plant is None else 10):
        factors = [float(np.exp(rng.uniform(np.log(0.5), np.log(2)))) for _ in effects]
        # One mass with an extra resonance is a drive of two masses, which identify() finds: nothing would be hidden.
        now = plant or random_plant(rng, True if set(effects) & {*COUPLING, "extra_resonance"} else None)
        samples = samples_of(kind, now)
        hidden = {
            name: draw_effect(name, factors[i] if factor is None else factor, now, samples, rng) for i, name in enumerate(effects)
        }
        if waves > 1:
            hidden = {name: with_waves(name, values, waves, rng) for name, values in hidden.items()}
        commands = [command_for(kind, now, rng, other_order) for other_order in (False, True)]
        if kind in ANYWHERE:
            as_ramps_ask(hidden, now, commands[0])
        as_the_way_is(hidden, now, commands[0])
        truth = Truth(
            effects=hidden, plant=now, kind=kind, noise=noise_now, factor=factor or (factors[0] if factors else 0.0), seed=seed,
            command=commands[0], validation_command=None if kind == "step" else commands[1], settle=settle,
        )  # fmt: skip
        if stable(now, hidden) and acts(truth):
            return truth
    raise RuntimeError(f"no drive found on which {effects} acts in a {kind} record at factor {factor}")


def records(
    truth: Truth, torque_logged: bool = True, position_logged: bool = False, load_sensor: LoadSensor | None = None
) -> tuple[ga.Record, ga.Record | None]:
    """The log and, with other noise, the validation log of a case."""
    before = np.zeros(truth.settle * truth.plant.log_every)
    logs = [
        log_of(truth.plant, np.concatenate([before, command]), truth.effects, truth.noise, seed=2 * truth.seed + i,
               torque_logged=torque_logged, position_logged=position_logged, settle=truth.settle, name=name,
               load_sensor=load_sensor)
        for i, (command, name) in enumerate([(truth.command, truth.kind), (truth.validation_command, "validation")])
        if command is not None
    ]  # fmt: skip
    return logs[0], logs[1] if len(logs) > 1 else None
