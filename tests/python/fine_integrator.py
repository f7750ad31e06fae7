"""A drive with effects, integrated finely: what the core is compared with. It shares no code with the package.

Every case is one column, and all cases advance together: explicit steps of a hundredth of a sample or less, the
twist half before and half after the velocity (leapfrog), friction by clipping the velocity that the other torques
would bring (Moreau), delay by a buffer of fine steps, filters by the midpoint rule, the bristle by Heun, an analog
controller's torque extrapolated by half a step. The equations are those of the public table of effects.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass
class FineCase:
    """One drive, loop and set of effects (name -> parameters).

    motor, load: (inertia, damping); shaft: (stiffness, damping); without a load one mass.
    """

    dt: float
    loop: str  # open, sampled, continuous
    source: Array  # torque in open loop, else command
    motor: tuple[float, float]
    load: tuple[float, float] | None = None
    shaft: tuple[float, float] = (0.0, 0.0)
    kp: float = 0.0
    ki: float = 0.0
    effects: dict[str, dict[str, float]] = field(default_factory=dict)


@dataclass
class FineRun:
    """What came out: columns of samples x cases; velocity as the sensor shows it."""

    velocity: Array
    torque: Array
    angle: Array


NEUTRAL = {
    "coulomb_friction.torque": 0.0,
    "stribeck_friction.torque": 0.0,
    "stribeck_friction.static_torque": 0.0,
    "stribeck_friction.stribeck_velocity": 1.0,
    "asymmetric_friction.torque_positive": 0.0,
    "asymmetric_friction.torque_negative": 0.0,
    "asymmetric_friction.viscous_positive": 0.0,
    "asymmetric_friction.viscous_negative": 0.0,
    "presliding_friction.torque": 1.0,
    "presliding_friction.stiffness": 0.0,
    "quadratic_drag.coefficient": 0.0,
    "load_torque.torque": 0.0,
    "unbalance.amplitude": 0.0,
    "unbalance.phase": 0.0,
    "cogging.amplitude": 0.0,
    "cogging.order": 2.0,
    "cogging.phase": 0.0,
    "friction_drift.torque": 0.0,
    "friction_drift.rate": 0.0,
    "backlash.gap": 0.0,
    "hardening_stiffness.cubic_stiffness": 0.0,
    "torque_saturation.limit": np.inf,
    "torque_dead_band.width": 0.0,
    "transport_delay.delay": 0.0,
    "torque_lag.time_constant": 0.0,
    "integrator_clamp.limit": np.inf,
    "command_rate_limit.rate": np.inf,
    "velocity_filter.time_constant": 0.0,
    "velocity_ripple.amplitude": 0.0,
    "velocity_ripple.order": 1.0,
    "velocity_ripple.phase": 0.0,
    "velocity_quantisation.step": 0.0,
    "extra_resonance.frequency": 1.0,
    "extra_resonance.damping": 1.0,
    "extra_resonance.zero_frequency": 1.0,
    "extra_resonance.zero_damping": 1.0,
}


def parameter(cases: list[FineCase], effect: str, name: str) -> Array:
    neutral = NEUTRAL[f"{effect}.{name}"]
    return np.array([case.effects.get(effect, {}).get(name, neutral) for case in cases])


def integrate(cases: list[FineCase], fine: int = 100) -> FineRun:
    """All cases, which have the same number of samples, in steps of dt/fine."""

    def of(effect: str, name: str) -> Array:
        return parameter(cases, effect, name)

    samples, count = len(cases[0].source), len(cases)
    source = np.column_stack([case.source for case in cases])
    dt = np.array([case.dt for case in cases])
    h = dt / fine
    is_open = np.array([case.loop == "open" for case in cases])
    analog = np.array([case.loop == "continuous" for case in cases])
    kp, ki = np.array([case.kp for case in cases]), np.array([case.ki for case in cases])
    JM, DM = (np.array([case.motor[i] for case in cases]) for i in (0, 1))
    rigid = np.array([case.load is None for case in cases])
    JL, DL = (np.array([1.0 - i if case.load is None else case.load[i] for case in cases]) for i in (0, 1))
    K, D = (np.array([case.shaft[i] for case in cases]) for i in (0, 1))

    Tc = of("coulomb_friction", "torque")
    T0, T1, vs = (of("stribeck_friction", n) for n in ("torque", "static_torque", "stribeck_velocity"))
    Tp, Tn = of("asymmetric_friction", "torque_positive"), of("asymmetric_friction", "torque_negative")
    bp, bn = of("asymmetric_friction", "viscous_positive"), of("asymmetric_friction", "viscous_negative")
    Td, rate = of("friction_drift", "torque"), of("friction_drift", "rate")
    s0 = of("presliding_friction", "stiffness")
    per_zc = s0 / of("presliding_friction", "torque")
    drag, load = of("quadratic_drag", "coefficient"), of("load_torque", "torque")
    Au, pu = of("unbalance", "amplitude"), of("unbalance", "phase")
    Ac, nc, pc = (of("cogging", n) for n in ("amplitude", "order", "phase"))
    half_gap, k3 = 0.5 * of("backlash", "gap"), of("hardening_stiffness", "cubic_stiffness")
    limit, width = of("torque_saturation", "limit"), of("torque_dead_band", "width")
    delay, tau_u = of("transport_delay", "delay") / h, of("torque_lag", "time_constant")
    I_max, slope = of("integrator_clamp", "limit"), of("command_rate_limit", "rate")
    tau_y = of("velocity_filter", "time_constant")
    ar, nr, pr = (of("velocity_ripple", n) for n in ("amplitude", "order", "phase"))
    quantum = of("velocity_quantisation", "step")
    wp, zp = of("extra_resonance", "frequency"), of("extra_resonance", "damping")
    wz, zz = of("extra_resonance", "zero_frequency"), of("extra_resonance", "zero_damping")

    # A lag in steps of h by the midpoint rule; without a time constant it follows at once.
    share_u = np.where(tau_u > 0.0, h / (np.where(tau_u > 0.0, tau_u, 1.0) + 0.5 * h), 1.0)
    share_y = np.where(tau_y > 0.0, h / (np.where(tau_y > 0.0, tau_y, 1.0) + 0.5 * h), 1.0)
    damp, damp_L = 0.5 * h * DM / JM, 0.5 * h * DL / JL
    ring = np.zeros((int(np.max(delay)) + 3, count))
    whole = np.floor(delay).astype(int)
    part = delay - whole
    column = np.arange(count)
    resonant, sticky = (wp / wz) ** 2, quantum > 0.0
    step = np.where(sticky, quantum, 1.0)
    r_step = np.where(analog, slope * h, slope * dt)
    control_time = np.where(analog, h, dt)

    w, wL, twist, angle, z = (np.zeros(count) for _ in range(5))
    x1, x2, lag, filtered, integral, error, command, u = (np.zeros(count) for _ in range(8))
    out = FineRun(*(np.zeros((samples, count)) for _ in range(3)))
    before = np.zeros(count)

    def sensed() -> Array:
        return np.where(sticky, np.round(filtered / step) * step, filtered)

    def control(r: Array, which: Array) -> None:
        nonlocal integral, error, command, u
        command = np.where(which, command + np.clip(r - command, -r_step, r_step), command)
        e = command - sensed()
        I = np.clip(integral + 0.5 * ki * control_time * (e + error), -I_max, I_max)
        integral, error = np.where(which, I, integral), np.where(which, e, error)
        u = np.where(which, kp * e + I, u)

    digital = ~is_open & ~analog
    k = 0
    for n in range(samples):
        target = source[n]
        control(target, digital)
        u = np.where(is_open, target, u)
        out.velocity[n], out.torque[n], out.angle[n] = sensed(), u, angle
        for j in range(fine):
            last = u
            control(before + (target - before) * (j / fine), analog)
            v = np.clip(np.where(analog, 1.5 * u - 0.5 * last, u), -limit, limit)
            v = np.sign(v) * np.maximum(np.abs(v) - width, 0.0)
            # The torque at the middle of the fine step, `delay` steps ago.
            ring[k % len(ring)] = v
            late = ring[(k - whole) % len(ring), column]
            v = late + part * (ring[(k - whole - 1) % len(ring), column] - late)
            step_u = share_u * (v - lag)
            T = np.where(tau_u > 0.0, lag + 0.5 * step_u, v)
            lag = lag + step_u

            old1, old2 = x1, x2
            x2 = x2 + h * (T - 2.0 * zp * wp * x2 - wp * wp * x1)
            x1 = x1 + h * x2
            # Its mean over the step: at both ends, the half step between x1 and x2 taken back.
            x1_mean = 0.5 * (old1 + x1) - 0.5 * h * 0.5 * (x2 - old2)
            T = resonant * (T + (zz * wz - zp * wp) * (old2 + x2) + (wz * wz - wp * wp) * x1_mean)

            theta = angle + 0.5 * h * w
            T = T - load - Au * np.sin(theta + pu) - Ac * np.sin(nc * theta + pc)
            twist = twist + 0.5 * h * (w - wL)
            x = np.sign(twist) * np.maximum(np.abs(twist) - half_gap, 0.0)
            inside = np.abs(twist) < half_gap
            coupling = K * x + k3 * x**3 + np.where(inside, 0.0, D * (w - wL))
            coupling = np.where(rigid, 0.0, coupling)
            dz = w - np.abs(w) * z * per_zc
            force = s0 * (z + 0.5 * h * dz)
            z = z + h * (w - np.abs(w) * (z + 0.5 * h * dz) * per_zc)
            smooth = drag * w * np.abs(w) + np.where(w > 0.0, bp, bn) * w + force
            free = ((1.0 - damp) * w + h / JM * (T - coupling - smooth)) / (1.0 + damp)
            t = np.maximum((n + (j + 0.5) / fine - analog) * dt, 0.0)
            level = (
                Tc
                + T0
                + (T1 - T0) * np.exp(-((0.5 * (w + free) / vs) ** 2))
                + Td * (1.0 + rate * t)
                + np.where(free > 0.0, Tp, Tn)
            )
            new = np.sign(free) * np.maximum(np.abs(free) - h / JM * level, 0.0)
            wL = ((1.0 - damp_L) * wL + h / JL * coupling) / (1.0 + damp_L)
            angle = angle + 0.5 * h * (w + new)
            w = new
            twist = twist + 0.5 * h * (w - wL)
            seen = w * (1.0 + ar * nr * np.cos(nr * angle + pr))
            filtered = np.where(tau_y > 0.0, filtered + share_y * (seen - filtered), seen)
            k += 1
        before = target
        # The continuous loop's sample is the end of the interval.
        if np.any(analog):
            out.velocity[n] = np.where(analog, sensed(), out.velocity[n])
            out.torque[n] = np.where(analog, u, out.torque[n])
            out.angle[n] = np.where(analog, angle, out.angle[n])
    return out
