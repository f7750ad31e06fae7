"""Refit a drive of a given structure to a record, with SciPy and the simulated drive of the blind tests.

`oracle`: the true structure, refitted to the record.
It works on the replay, where the controller reads the recorded velocity: for the true drive the remainder is then exactly
the sensor's noise and the filtered disturbance, and an autoregressive filter whitens it.

`limit`: the separability limit of an effect, the size at which the nearest rival, refitted together with the mechanics, leaves
chi2 = 25 in the simulated closed loop (noise-free record, 0.1 rad/s, velocity alone).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.optimize import least_squares
from scipy.signal import lfilter

from drive_cases import Truth
from drive_rig import COUPLING, SUBSTEPS, Array, Noise, Plant, RanAwayError, disturbances, run_drive

Values = dict[str, float]
FAST = 12  # substeps: fourth order, and far below the noise
SIGMA = 0.1  # rad/s

MECHANICS = ("J", "D", "JL", "DL", "KG", "DG")
POSITIVE = ("J", "JL", "KG")
# Parameters that are no size: fitted as logarithms. Of amplitude and phase the two components are fitted, of the rest the values.
LOGARITHMIC = {"stribeck_velocity", "stiffness", "limit", "frequency", "zero_frequency", "damping", "zero_damping"}
SCALES = {"torque": 0.02, "static_torque": 0.02, "torque_positive": 0.02, "torque_negative": 0.02, "coefficient": 5e-6,
          "rate": 0.1, "gap": 2e-3, "width": 0.01, "delay": 3e-4, "time_constant": 3e-4, "share": 0.1}  # fmt: skip
# Without bounds a resonance becomes a lag, and Stribeck friction imitates half of the library.
BOUNDS = {"damping": 0.3, "zero_damping": 0.3, "stribeck_velocity": 8.0}
SIGNED = {("load_torque", "torque"), ("friction_drift", "rate"), ("hardening_stiffness", "cubic_stiffness")}


@dataclass(frozen=True)
class Fit:
    """The refitted drive, and what its whitened replay leaves (sum of squares in units of the noise)."""

    plant: Plant
    effects: dict[str, Values]
    chi2: float


class Refitted:
    """Which parameters are free, and the vector they are packed into."""

    def __init__(self, plant: Plant, effects: dict[str, Values]) -> None:
        self.plant, self.effects = plant, effects
        self.mechanics = [name for name in MECHANICS if getattr(plant, name) > 0 or (name == "DG" and plant.two_masses)]

    def pack(self) -> Array:
        x = [0.0 if name in POSITIVE else getattr(self.plant, name) / self._damping(name) for name in self.mechanics]
        for effect, values in self.effects.items():
            if effect == "asymmetric_friction":
                x += [values["torque_positive"] / 0.02, values["torque_negative"] / 0.02]
                x += [(values["viscous_positive"] - values["viscous_negative"]) / self._damping("D")]
            elif "phase" in values:
                x += [values["amplitude"] / self._amplitude(effect) * f(values["phase"]) for f in (np.cos, np.sin)]
            else:
                x += [0.0 if self._log(effect, name) else value / self._scale(effect, name) for name, value in values.items()]
        return np.array(x)

    def unpack(self, x: Array) -> tuple[Plant, dict[str, Values]]:
        parts = iter(x)
        mechanics = {
            name: getattr(self.plant, name) * np.exp(next(parts)) if name in POSITIVE else next(parts) * self._damping(name)
            for name in self.mechanics
        }
        effects: dict[str, Values] = {}
        for effect, values in self.effects.items():
            if effect == "asymmetric_friction":
                positive, negative, slope = (abs(next(parts)) * 0.02, abs(next(parts)) * 0.02, next(parts) * self._damping("D"))
                effects[effect] = {"torque_positive": positive, "torque_negative": negative,
                                   "viscous_positive": max(slope, 0.0), "viscous_negative": max(-slope, 0.0)}  # fmt: skip
            elif "phase" in values:
                c, s = next(parts), next(parts)
                scale = self._amplitude(effect)
                effects[effect] = {**values, "amplitude": scale * float(np.hypot(c, s)), "phase": float(np.arctan2(s, c))}
            else:
                effects[effect] = {
                    name: min(value * float(np.exp(next(parts))), BOUNDS.get(name, np.inf))
                    if self._log(effect, name)
                    else (next(parts) if (effect, name) in SIGNED else abs(next(parts))) * self._scale(effect, name)
                    for name, value in values.items()
                }
            if effect == "stribeck_friction":
                kinetic = effects[effect]["torque"]
                effects[effect]["static_torque"] = float(np.clip(effects[effect]["static_torque"], kinetic, 3 * kinetic))
        return replace(self.plant, **mechanics), effects

    def _damping(self, name: str) -> float:
        return 0.01 * self.plant.KG / 200 + 1e-5 if name == "DG" else 0.3 * (self.plant.D + self.plant.DL)

    @staticmethod
    def _log(effect: str, name: str) -> bool:
        return name in LOGARITHMIC or (effect == "command_rate_limit")

    @staticmethod
    def _amplitude(effect: str) -> float:
        return 1e-3 if effect == "velocity_ripple" else 0.01

    def _scale(self, effect: str, name: str) -> float:
        if effect == "square_root_drag":
            return 2e-3
        return 2e4 * (self.plant.KG / 55) ** 3 if name == "cubic_stiffness" else SCALES[name]


def whitener(truth: Truth, order: int = 20) -> tuple[Array, float]:
    """The autoregressive filter and the innovation's standard deviation [rad/s] of this case's noise, from a run of its own."""
    noise: Noise = truth.noise
    if not (noise.encoder or noise.torque):
        return np.ones(1), noise.white
    shaken = {"encoder": noise.encoder, "differenced": noise.differenced}
    rng = np.random.default_rng(99)
    log = run_drive(truth.plant, truth.command, truth.effects, **shaken, **disturbances(noise, len(truth.command), rng))
    rest = log.velocity - run_drive(truth.plant, truth.command, truth.effects, measured=log.velocity).velocity
    return autoregression(rest, order)


def autoregression(rest: Array, order: int) -> tuple[Array, float]:
    """Yule-Walker: filter [1, -a1, ...] and standard deviation of what it leaves."""
    lags = np.array([rest[: len(rest) - k] @ rest[k:] for k in range(order + 1)]) / len(rest)
    a = solve_toeplitz(lags[:-1] * (1 + 1e-9 * (np.arange(order) == 0)), lags[1:])
    return np.concatenate([[1.0], -a]), float(np.sqrt(lags[0] - a @ lags[1:]))


def refit(structure: Refitted, truth: Truth, velocity: Array, white: tuple[Array, float] | None, evaluations: int = 25) -> Fit:
    """Least squares over all free parameters, from the structure's own values; on the replay where `white` is given."""
    measured = None if white is None else velocity
    taps, scale = white or (np.ones(1), SIGMA)

    def rest(x: Array) -> Array:
        plant, effects = structure.unpack(x)
        try:
            simulated = run_drive(plant, truth.command, effects, measured=measured, substeps=FAST).velocity
        except RanAwayError:
            return np.full(len(velocity), 1e4)
        return np.asarray(lfilter(taps, [1.0], np.clip(velocity - simulated, -1e4, 1e4)) / scale)

    found = least_squares(rest, structure.pack(), diff_step=1e-5, max_nfev=evaluations, xtol=1e-6, ftol=1e-5)
    plant, effects = structure.unpack(found.x)
    return Fit(plant, effects, 2 * float(found.cost))


def oracle(truth: Truth, velocity: Array, validation: Array) -> float:
    """Free-run rmse [rad/s] on the validation record of the true structure, refitted to the record."""
    structure = Refitted(truth.plant, {k: v for k, v in truth.effects.items() if k not in ("outliers", "velocity_quantisation")})
    fit = refit(structure, truth, velocity, whitener(truth))
    assert truth.validation_command is not None
    free = run_drive(fit.plant, truth.validation_command, fit.effects, substeps=SUBSTEPS).velocity
    return float(np.sqrt(np.mean((validation - free) ** 2)))


# Who comes near whom: the parent, the rest of the family, and what measured confusion tables say.
# None of them a generalisation of the truth, and no equivalent effect.
NEAR = {
    "coulomb_friction": ("torque_dead_band", "unbalance", "quadratic_drag", "load_torque"),
    "stribeck_friction": ("coulomb_friction", "asymmetric_friction", "friction_drift", "presliding_friction"),
    "asymmetric_friction": ("coulomb_friction", "friction_drift", "stribeck_friction", "presliding_friction", "load_torque"),
    "presliding_friction": ("coulomb_friction", "stribeck_friction", "asymmetric_friction", "torque_dead_band", "backlash"),
    "quadratic_drag": ("integrator_clamp", "friction_drift", "asymmetric_friction", "torque_saturation"),
    "load_torque": ("unbalance", "coulomb_friction", "presliding_friction"),
    "unbalance": ("load_torque", "presliding_friction", "asymmetric_friction", "velocity_ripple"),
    "cogging": ("stribeck_friction", "velocity_ripple", "asymmetric_friction", "unbalance"),
    "friction_drift": ("coulomb_friction", "stribeck_friction", "asymmetric_friction", "presliding_friction", "quadratic_drag"),
    "backlash": ("torque_dead_band", "hardening_stiffness", "transport_delay", "presliding_friction", "extra_resonance"),
    "hardening_stiffness": ("extra_resonance", "backlash", "transport_delay", "torque_lag"),
    "torque_saturation": ("command_rate_limit", "integrator_clamp", "stribeck_friction", "velocity_filter"),
    "torque_dead_band": ("presliding_friction", "coulomb_friction", "stribeck_friction", "backlash"),
    "transport_delay": ("torque_lag", "velocity_filter", "stribeck_friction", "extra_resonance"),
    "torque_lag": ("transport_delay", "extra_resonance", "command_rate_limit"),
    "velocity_filter": ("transport_delay", "extra_resonance", "command_rate_limit"),
    "integrator_clamp": ("presliding_friction", "coulomb_friction", "torque_saturation", "quadratic_drag"),
    "command_rate_limit": ("torque_saturation", "presliding_friction", "velocity_filter", "torque_lag"),
    "velocity_ripple": ("cogging", "unbalance", "velocity_filter", "coulomb_friction"),
    "extra_resonance": ("transport_delay", "torque_lag", "velocity_filter", "hardening_stiffness", "backlash"),
    "hysteretic_coupling": ("extra_resonance", "hardening_stiffness", "backlash", "torque_lag"),
    "square_root_drag": ("coulomb_friction", "stribeck_friction", "asymmetric_friction", "quadratic_drag"),
    "position_friction": ("coulomb_friction", "unbalance", "cogging", "friction_drift"),
}


def rivals(truth: Truth, torque: Array) -> dict[str, list[dict[str, Values]]]:
    """Rival structures with starting values; "none" is the mechanics alone."""
    (name,) = truth.effects
    own = truth.effects[name]
    peak, dt = float(np.abs(torque).max()), truth.plant.dt
    harmonic = {"order": own["order"]} if "order" in own else {}
    starts: dict[str, list[Values]] = {
        "coulomb_friction": [{"torque": 0.03}],
        "stribeck_friction": [{"torque": 0.02, "static_torque": 0.05, "stribeck_velocity": v} for v in (1.0, 4.0)],
        "asymmetric_friction": [dict.fromkeys(("torque_positive", "torque_negative"), 0.03)
                                | {"viscous_positive": 1e-4, "viscous_negative": 0.0}],
        "presliding_friction": [{"torque": 0.03, "stiffness": s} for s in (3.0, 30.0)],
        "quadratic_drag": [{"coefficient": 5e-6}],
        "load_torque": [{"torque": 0.01}],
        "unbalance": [{"amplitude": 0.01, "phase": 0.0}],
        "cogging": [{"amplitude": 0.01, "phase": 0.0, **harmonic}] if harmonic.get("order", 1) >= 2 else [],
        "velocity_ripple": [{"amplitude": 1e-3, "phase": 0.0, "order": harmonic.get("order", 1.0)}],
        "friction_drift": [{"torque": 0.03, "rate": r} for r in (0.1, -0.1)],
        "backlash": [{"gap": g} for g in (2e-3, 1e-2)],
        "hardening_stiffness": [{"cubic_stiffness": 2e4 * (truth.plant.KG / 55) ** 3}],
        "torque_saturation": [{"limit": 0.8 * peak}],
        "torque_dead_band": [{"width": 0.01}],
        "transport_delay": [{"delay": d * dt} for d in (0.4, 1.5)],
        "torque_lag": [{"time_constant": 4e-4}],
        "velocity_filter": [{"time_constant": 4e-4}],
        "integrator_clamp": [{"limit": 0.5 * peak}],
        "command_rate_limit": [{"rate": 2e4}],
        "extra_resonance": [{"frequency": 1.08 * w, "damping": 0.03, "zero_frequency": w, "zero_damping": 0.03}
                            for w in (500.0, 1100.0)],
    }  # fmt: skip
    names = [rival for rival in NEAR[name] if truth.plant.two_masses or rival not in COUPLING]
    # From sizes like the truth's own, or a small effect is not found from afar.
    size_like = {*SCALES, "cubic_stiffness", "amplitude"}

    def start(rival: str, values: Values) -> dict[str, Values]:
        if rival in ("command_rate_limit", "torque_saturation", "integrator_clamp"):
            return {rival: values}
        return {rival: {name: v * min(1.0, truth.factor) if name in size_like else v for name, v in values.items()}}

    listed: dict[str, list[dict[str, Values]]] = {"none": [{}]}
    listed.update({rival: [start(rival, values) for values in starts[rival]] for rival in names})
    return listed


@dataclass(frozen=True)
class Limit:
    """The size, in typical sizes, at which the nearest rival leaves chi2 = 25, and what was left close to it, at `factor`."""

    size: float
    factor: float
    base: float
    nearest: float
    rival: str


def separability(truth: Truth, only: Sequence[str] | None = None, evaluations: int = 15) -> dict[str, float]:
    """chi2 that each rival leaves of the noise-free record of a case after its refit."""
    log = run_drive(truth.plant, truth.command, truth.effects)
    left: dict[str, float] = {}
    for rival, structures in rivals(truth, log.torque).items():
        if not structures or (only and rival not in only and rival != "none"):
            continue
        fits = (refit(Refitted(truth.plant, start), truth, log.velocity, None, evaluations) for start in structures)
        left[rival] = min(fit.chi2 for fit in fits)
    return left


def limit(case: Callable[[float], Truth], largest: float = 8.0, rounds: int = 9) -> Limit:
    """The separability limit of an effect: every rival at the typical size, the three nearest on the way to chi2 = 25.

    chi2 grows with the square of a small effect, but not always: a delay inside one sample is a lag, and a limit acts
    suddenly. So the square is only the first guess; once the size lies between two others, their middle is tried.
    """
    factor, below, above = 1.0, 0.0, float("inf")
    near: list[str] | None = None
    best: Limit | None = None
    for _ in range(rounds):
        try:
            left = separability(case(factor), near)
        except RuntimeError:  # a limit this wide is never reached
            left = {"none": 0.0}
        if near is None:
            near = sorted(left, key=left.__getitem__)[:3]
        rival = min(left, key=left.__getitem__)
        guess = factor * np.sqrt(25 / max(left[rival], 1e-9))
        if left[rival] > 0 and (best is None or abs(np.log(guess / factor)) < abs(np.log(best.size / best.factor))):
            best = Limit(float(guess), factor, left["none"], left[rival], rival)
        if 12 < left[rival] < 50 or below > 0.8 * above or below >= largest:
            break
        below, above = (max(below, factor), above) if left[rival] < 25 else (below, min(above, factor))
        inside = (below < guess < above and above == float("inf")) or below == 0
        factor = float(np.clip(guess, factor / 100, min(largest, factor * 4)) if inside else np.sqrt(below * above))
    if best is None:
        raise RuntimeError("the effect never acts")
    return replace(best, size=best.size if below < best.size < above else min(above, largest))
