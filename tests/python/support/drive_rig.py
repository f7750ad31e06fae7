"""A simulated drive to hide effects in, independent of the library: `rig(plant, command, effects)` returns its log as a Record.

The drive itself is tests/cpp/drive_rig.cpp: continuous time, fourth-order Runge-Kutta steps cut at every event, at least
40 to a line of the log, dry friction with exact rest, a digital controller, noise inside the loop (what is logged as torque
follows from what is logged as velocity). It is compiled here when it is first needed.
Names and signs of effects are those of the library's table; OUTSIDE lists what the library does not know.

    rec = rig(Plant(J=3e-4, D=2e-3, kp=0.03, ki=1.9, dt=1e-3), command, {"coulomb_friction": {"torque": 0.05}}, seed=1)

The controller is a bare PI at the log's clock, or that of `Plant.cascade`: only its numbers are read from it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import fields as dataclass_fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

import compiled
import gaident as ga
from places import ROOT

Array = NDArray[np.float64]
Effects = Mapping[str, Mapping[str, float]]

SOURCE = ROOT / "tests" / "cpp" / "drive_rig.cpp"
CONTROLLER = SOURCE.with_name("drive_rig_controller.hpp")
SUBSTEPS, MOST_SUBSTEPS = 40, 400
LEAST_SUBSTEPS = 8  # of a sample of a controller that is faster than the log
NEWEST = {"trapezoidal": 0.5, "backward": 1.0, "forward": 0.0}  # share of e(n) in a step of the integral
PLACES = ("command_filters", "velocity_filters", "torque_filters")  # as the simulated drive numbers them


@dataclass(frozen=True)
class Plant:
    """A drive without effects. One mass J [kg m2], D [N m s/rad]; with JL also a load JL, DL on a shaft KG [N m/rad], DG.

    ground, rest: a spring between motor and ground [N m/rad], and the angle at which it rests [rad].
    dt: of the log [s]. cascade: the controller where it is more than the PI of kp and ki at the log's clock; its gains are
    then those that act.
    """

    J: float
    D: float
    kp: float
    ki: float
    dt: float
    JL: float = 0.0
    DL: float = 0.0
    KG: float = 0.0
    DG: float = 0.0
    ground: float = 0.0
    rest: float = 0.0
    name: str = "drive"
    cascade: ga.Cascade | None = None

    @property
    def controller(self) -> ga.PI | ga.Cascade:
        return self.cascade or ga.PI(self.kp, self.ki)

    @property
    def log_every(self) -> int:
        """Controller samples to a line of the log."""
        return 1 if self.cascade is None or self.cascade.period is None else round(self.dt / self.cascade.period)

    @property
    def placed(self) -> bool:
        """Whether a position command drives it [rad], not a velocity command [rad/s]."""
        return self.cascade is not None and self.cascade.position is not None

    @property
    def two_masses(self) -> bool:
        return self.JL > 0


@dataclass(frozen=True)
class Noise:
    """What disturbs a record: white velocity noise [rad/s], encoder resolution [rad], AR(1) shaft torque [N m rms]."""

    white: float = 0.1
    encoder: float = 0.0
    torque: float = 0.0
    pole: float = 0.98
    differenced: bool = False  # the encoder's angle is really differenced, which costs half a sample: no noise, but an effect


NOISES = {
    "none": Noise(white=0.0),
    "white": Noise(),
    "encoder": Noise(white=0.0, encoder=2e-4),
    "coloured": Noise(torque=0.004),
    "differenced": Noise(white=0.0, encoder=2e-4, differenced=True),
}

# Library effect -> parameter -> field of the drive; friction adds to fields that several effects share.
FIELDS: dict[str, dict[str, str]] = {
    "presliding_friction": {"torque": "dahl", "stiffness": "dahl_stiffness"},
    "lugre_friction": {
        "torque": "lugre",
        "static_torque": "lugre_static",
        "stribeck_velocity": "lugre_velocity",
        "stiffness": "lugre_stiffness",
        "damping": "lugre_damping",
    },
    "quadratic_drag": {"coefficient": "drag"},
    "square_root_drag": {"coefficient": "root"},
    "position_friction": {"torque": "uneven", "amplitude": "uneven_share", "order": "uneven_order", "phase": "uneven_phase"},
    "load_torque": {"torque": "load"},
    "unbalance": {"amplitude": "unbalance", "phase": "unbalance_phase"},
    "cogging": {"amplitude": "cogging", "order": "cogging_order", "phase": "cogging_phase"},
    "friction_drift": {"torque": "drifting", "rate": "drift_rate"},
    "backlash": {"gap": "gap"},
    "hardening_stiffness": {"cubic_stiffness": "cubic"},
    "hysteretic_coupling": {"torque": "hysteretic_torque", "stiffness": "hysteretic"},
    "torque_saturation": {"limit": "saturation"},
    "torque_dead_band": {"width": "dead_band"},
    "transport_delay": {"delay": "delay"},
    "torque_lag": {"time_constant": "lag"},
    "integrator_clamp": {"limit": "integrator_limit"},
    "command_rate_limit": {"rate": "command_rate"},
    "velocity_filter": {"time_constant": "filter"},
    "velocity_ripple": {"amplitude": "ripple", "order": "ripple_order", "phase": "ripple_phase"},
    "velocity_quantisation": {"step": "quantum"},
    "extra_resonance": {"frequency": "wp", "damping": "zp", "zero_frequency": "wz", "zero_damping": "zz"},
    "position_inertia": {"amplitude": "turning", "order": "turning_order", "phase": "turning_phase"},
    "torque_hum": {"amplitude": "hum", "frequency": "hum_frequency", "phase": "hum_phase"},
    "random_walk_friction": {"torque": "walking", "size": "walk_size", "number": "walk_number"},
    "thermal_gain": {"share": "gain_lost", "time_constant": "warming"},
    "resolver_error_of_speed": {"error": "resolver", "order": "resolver_order", "phase": "resolver_phase"},
    "contact": {"stiffness": "stop", "angle": "stop_angle", "damping": "stop_damping"},
    "growing_inertia": {"rate": "growing"},
}
FRICTION: dict[str, dict[str, str]] = {
    "coulomb_friction": {"torque": "both"},
    "load_dependent_friction": {"torque": "both", "share": "loaded"},
    "stribeck_friction": {"torque": "both", "static_torque": "static", "stribeck_velocity": "stribeck_velocity"},
    "asymmetric_friction": {
        "torque_positive": "friction_positive",
        "torque_negative": "friction_negative",
        "viscous_positive": "viscous_positive",
        "viscous_negative": "viscous_negative",
    },
}
AT_LOAD = "@load"
SHAFT = (
    *FRICTION,
    "presliding_friction",
    "lugre_friction",
    "quadratic_drag",
    "load_torque",
    "unbalance",
    "cogging",
    "friction_drift",
    "square_root_drag",
    "position_friction",
)
OUTSIDE = ("random_walk_friction", "thermal_gain", "resolver_error_of_speed", "contact", "growing_inertia")
SEVERAL_WAVES = ("cogging", "velocity_ripple")
"""Effects that may have up to four waves: the second one's parameters are amplitude_2, order_2, phase_2, and so on."""
COUPLING = ("backlash", "hardening_stiffness", "hysteretic_coupling")


@dataclass(frozen=True)
class Log:
    """Everything one run left behind, arrays (n,); `truth` is the velocity [rad/s] that no sensor saw, nor the load's motion."""

    velocity: Array
    torque: Array
    position: Array
    truth: Array
    load_velocity: Array
    load_position: Array


@dataclass(frozen=True)
class LoadSensor:
    """A sensor at the load: the channel it is logged as, its white noise, scale and offset."""

    channel: str
    noise: float
    scale: float = 1.0
    offset: float = 0.0

    def read(self, log: Log, settle: int, rng: np.random.Generator) -> dict[str, Array]:
        """Its channel of a record, without the first `settle` lines."""
        at_load = getattr(log, self.channel)[settle:]
        return {self.channel: self.scale * at_load + self.offset + self.noise * rng.standard_normal(len(at_load))}


class RanAwayError(RuntimeError):
    """The simulated drive is unstable with these settings."""


def fields() -> dict[str, float]:
    """Name -> neutral value of the fields of the drive, in their order."""
    return compiled.fields(SOURCE)


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """The drive's functions. Raises RuntimeError without a compiler."""
    loaded = compiled.library(SOURCE)
    pointer = ctypes.POINTER(ctypes.c_double)
    integer = ctypes.c_int
    loaded.drive_rig_run.argtypes = [*[pointer] * 4, integer, integer, ctypes.c_double, integer, *[pointer] * 12]
    return loaded


def skip_without_library() -> None:
    """Skip the test, or on top of a file all of its tests, where the simulated drive cannot be compiled."""
    import pytest  # here, because bench/ draws its drives without the tests' requirements

    try:
        library()
    except RuntimeError as missing:
        pytest.skip(str(missing), allow_module_level=True)


def drive_values(plant: Plant, effects: Effects) -> tuple[dict[str, float], dict[str, float]]:
    """The fields of the simulated drive that has these effects, and those of what acts at its load, "name@load".

    Raises ValueError for parameters that an effect does not take, and where its place is not in the plant.
    """
    values, at_load = dict(fields()), dict(fields())
    values.update(J1=plant.J, D1=plant.D, J2=plant.JL, D2=plant.DL, K=plant.KG, DG=plant.DG)
    values.update(ground=plant.ground, rest=plant.rest)
    delay = 0.0 if plant.cascade is None else plant.cascade.delay
    if plant.cascade is not None and plant.cascade.velocity.integrator_limit is not None:
        values["integrator_limit"] = plant.cascade.velocity.integrator_limit
    for key, parameters in effects.items():
        effect = key.removesuffix(AT_LOAD)
        if effect != key and not (plant.two_masses and effect in SHAFT):
            raise ValueError(f"{key}: effects of the shaft are at the load, and only of two masses")
        if effect != "outliers":  # they spoil the log, not the drive
            _add(values if effect == key else at_load, effect, parameters, plant)
    values["delay"] += delay  # of the controller: its torque is logged before it
    return values, at_load


def _add(values: dict[str, float], effect: str, parameters: Mapping[str, float], plant: Plant) -> None:
    """One effect in the fields of a drive."""
    known = FIELDS.get(effect) or FRICTION[effect]
    waves = (len(parameters) // len(known) if effect in SEVERAL_WAVES else 1) or 1
    known = known | {f"{name}_{k}": f"{place}_{k}" for k in range(2, waves + 1) for name, place in known.items()}
    if set(parameters) != set(known):
        raise ValueError(f"{effect} takes {sorted(known)}, not {sorted(parameters)}")
    if effect in COUPLING and not plant.two_masses:
        raise ValueError(f"{effect} acts in the shaft between two masses")
    if "both" in known.values():
        values["friction_positive"] += parameters["torque"]
        values["friction_negative"] += parameters["torque"]
    if effect == "stribeck_friction":
        values["stribeck"] = parameters["static_torque"] - parameters["torque"]
        values["stribeck_velocity"] = parameters["stribeck_velocity"]
    elif effect == "load_dependent_friction":
        values["loaded"] = parameters["share"]
    elif effect == "asymmetric_friction":
        for name, place in known.items():
            values[place] += parameters[name]
    elif effect in FIELDS:
        values.update({known[name]: value for name, value in parameters.items()})


def controller_values(plant: Plant) -> tuple[dict[str, float], Array]:
    """The fields of the simulated controller, and its filters as rows (place, kind, three numbers)."""
    values = dict(compiled.fields(CONTROLLER))
    values.update(kp=plant.kp, ki=plant.ki)
    rows: list[list[float]] = []
    c = plant.cascade
    if c is None:
        return values, np.zeros((0, 5))
    pi = c.velocity
    values.update(kp=pi.kp, ki=pi.ki, newest=NEWEST[pi.rule], weight=pi.command_weight, hold=float(pi.anti_windup == "hold"))
    values.update(kff=c.velocity_feedforward, aff=c.acceleration_feedforward, fff=c.friction_feedforward)
    values["tracking_time"] = pi.tracking_time or 0.0
    if pi.torque_limit is not None:
        values["torque_limit"] = pi.torque_limit
    if c.position is not None:
        period = plant.dt / plant.log_every
        values.update(position_gain=c.position.gain, position_every=round((c.position_period or period) / period))
    for place, name in enumerate(PLACES):
        for f in getattr(c, name):
            if isinstance(f, ga.LowPass):
                rows.append([place, 0, f.time_constant, 0, 0])
            else:
                rows.append([place, 1, f.frequency, f.numerator_damping, f.denominator_damping])
    return values, np.array(rows, dtype=np.float64).reshape(-1, 5)


def substeps_for(values: Mapping[str, float], dt: float, least: int) -> int:
    """So many substeps that the fastest state stays well inside the step's stability and accuracy: bristle, lag or filter."""
    rates = [values["dahl_stiffness"] * 150 / values["dahl"] if values["dahl"] else 0.0]
    rates += [values["lugre_stiffness"] * 150 / values["lugre"] if values["lugre"] else 0.0]
    rates += [1 / values[name] for name in ("lag", "filter") if values[name] > 0]
    fastest = max(rates)
    needed = int(np.ceil(dt * fastest / 0.5))
    if needed > MOST_SUBSTEPS:
        raise RanAwayError(f"a bristle, lag or filter this fast needs {needed} substeps a sample; give a slower one or none")
    return max(least, needed)


def run_drive(
    plant: Plant,
    command: Array | None,
    effects: Effects | None = None,
    *,
    torque: Array | None = None,
    measured: Array | None = None,
    velocity_noise: Array | None = None,
    torque_noise: Array | None = None,
    encoder: float = 0.0,
    differenced: bool = False,
    table: Array | None = None,
    substeps: int = SUBSTEPS,
) -> Log:
    """Simulate from rest, at the controller's clock: every array has `plant.log_every` values to a line of the log.

    `torque` without a command: open loop; `measured`: the controller reads this (a replay).
    `table`: numbers of the torque that the controller adds beforehand, as drive_rig_controller.hpp has them.
    """
    values, at_load = drive_values(plant, effects or {})
    values.update(encoder=encoder, differenced=float(differenced))
    driving = command if command is not None else torque
    if driving is None:
        raise ValueError("give a command, or a torque for the open loop")
    n = len(driving)

    def pointer(array: Array | None) -> ctypes.Array[ctypes.c_double] | None:
        if array is None:
            return None
        if array.shape != (n,) or array.dtype != np.float64 or not array.flags.c_contiguous:
            raise ValueError(f"every array is float64, contiguous and {n} long")
        return address(array)

    def address(array: Array) -> ctypes.Array[ctypes.c_double]:
        return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))

    settings, filters = controller_values(plant)
    every = plant.log_every
    period = plant.dt / every
    least = substeps if every == 1 else max(LEAST_SUBSTEPS, -(-substeps // every))
    drive, load, control = (np.array(list(v.values()), dtype=np.float64) for v in (values, at_load, settings))
    out = [np.empty(n) for _ in dataclass_fields(Log)]
    given = [
        None if a is None else np.ascontiguousarray(a, dtype=np.float64)
        for a in (command, torque if command is None else None, measured, velocity_noise, torque_noise)
    ]
    failed = library().drive_rig_run(
        address(drive),
        address(load),
        address(control),
        address(filters),
        len(filters),
        n,
        period,
        max(substeps_for(each, period, least) for each in (values, at_load)),
        *map(pointer, given),
        None if table is None else address(table),
        *map(pointer, out),
    )
    if failed:
        raise RanAwayError(f"{plant.name} with {sorted(effects or {})} ran away")
    return Log(*out)


def rig(
    plant: Plant,
    command: Array,
    effects: Effects | None = None,
    noise: Noise | str = "white",
    seed: int = 0,
    torque_logged: bool = True,
    position_logged: bool = False,
    settle: int = 0,
    substeps: int = SUBSTEPS,
    name: str = "",
    load_sensor: LoadSensor | None = None,
) -> ga.Record:
    """The log of one run: `command` as its lines have it, a position command [rad] where the drive is `placed`.

    Starts from rest with an empty integrator; `settle` lines at command 0 before it are not logged.
    """
    ticks = between_lines(plant, np.concatenate([np.zeros(settle), np.asarray(command, dtype=np.float64)]))
    return log_of(plant, ticks, effects, noise, seed, torque_logged, position_logged, settle, substeps, name, load_sensor)


def log_of(
    plant: Plant,
    ticks: Array,
    effects: Effects | None = None,
    noise: Noise | str = "white",
    seed: int = 0,
    torque_logged: bool = True,
    position_logged: bool = False,
    settle: int = 0,
    substeps: int = SUBSTEPS,
    name: str = "",
    load_sensor: LoadSensor | None = None,
) -> ga.Record:
    """The log of one run whose command changes at the controller's clock; its first `settle` lines are not logged."""
    noise = NOISES[noise] if isinstance(noise, str) else noise
    effects = effects or {}
    rng = np.random.default_rng(seed)
    sensor = {"encoder": noise.encoder, "differenced": noise.differenced}
    every = plant.log_every
    whole = run_drive(plant, ticks, effects, substeps=substeps, **sensor, **disturbances(noise, len(ticks), rng))
    log = Log(*(getattr(whole, each.name)[::every] for each in dataclass_fields(Log)))
    velocity, command = log.velocity.copy(), ticks[::every][settle:]
    if "outliers" in effects:
        count = round(effects["outliers"]["fraction"] * len(command))
        hit = settle + rng.choice(len(command), count, replace=False)
        velocity[hit] += rng.choice([-1, 1], count) * rng.uniform(10, 60, count)
    return ga.Record(
        dt=plant.dt,
        command=None if plant.placed else command,
        position_command=command if plant.placed else None,
        velocity=velocity[settle:],
        torque=log.torque[settle:] if torque_logged else None,
        position=log.position[settle:] - log.position[settle] if position_logged else None,
        name=name or plant.name,
        **({} if load_sensor is None else load_sensor.read(log, settle, rng)),
    )


def between_lines(plant: Plant, line: Array) -> Array:
    """A command at the controller's clock: a velocity is held until the log's next line, a position goes straight there."""
    every = plant.log_every
    if not plant.placed or every == 1:
        return np.repeat(line, every)
    ahead = np.append(line, 2 * line[-1] - line[-2])
    return np.interp(np.arange(len(line) * every) / every, np.arange(len(ahead)), ahead)


def disturbances(noise: Noise, n: int, rng: np.random.Generator) -> dict[str, Array | None]:
    """White velocity noise and coloured torque for one run, from its own random numbers."""
    white, driving = rng.standard_normal((2, n))
    driving[1:] *= np.sqrt(1 - noise.pole**2)
    coloured = lfilter([1.0], [1.0, -noise.pole], driving)
    return {
        "velocity_noise": noise.white * white if noise.white else None,
        "torque_noise": noise.torque * coloured if noise.torque else None,
    }
