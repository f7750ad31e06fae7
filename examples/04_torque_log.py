"""A torque log of one motor, no command and no controller: inertia and viscous friction of the axis, with their uncertainty."""

import numpy as np

import gaident as ga

# The log would come from the drive's own trace: ga.read("trace.csv", columns={"torque": "Tq", "velocity": "w"}, ...).
# Here it is simulated: a motor that accelerates, coasts and brakes, with noise on its velocity.
truth = ga.OneMass(J=3.2e-4, D=1.1e-3)  # kg m^2, N m s/rad
dt = 1e-3  # s
torque = np.repeat([0.0, 0.12, 0.02, 0.0, -0.10, -0.05, 0.08], 60)  # N m
clean = ga.simulate(truth, ga.Record(dt, torque=torque, velocity=0.0 * torque))  # no controller: the torque drives the motor
velocity = clean + 0.15 * np.random.default_rng(4).standard_normal(torque.size)  # rad/s

rec = ga.Record(dt, torque=torque, velocity=velocity, name="torque log")
idn = ga.identify(rec)

print(idn.summary())
print(f"\ninertia {idn.mechanics.J:.4g} +- {idn.mechanics.std['J']:.1g} kg m^2; true {truth.J:g}")
