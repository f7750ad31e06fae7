"""A gear with play: a linear model of two masses misses it, the diagnosis measures its gap."""

import numpy as np

import gaident as ga

controller = ga.PI(kp=0.05, ki=2.0)
rng = np.random.default_rng(6)
masses = ga.TwoMass(JM=1.2e-4, DM=1e-3, JL=6e-4, DL=2e-3, KG=30.0, DG=2e-3)
drive = masses.model().with_effect("backlash", gap=0.02)  # rad, full width

command = np.repeat([20.0, -20.0, 5.0, -5.0, 10.0, -10.0], 100)  # rad/s: play shows where the torque changes its sign
noise = 0.05 * rng.standard_normal(command.size)  # rad/s; the controller reads it too: e = command - (w + noise)
run = ga.run(drive, ga.Record(1e-3, command=command - noise, velocity=noise), controller)
rec = ga.Record(1e-3, command=command, velocity=run.velocity + noise, torque=run.torque, name="reversals")

dia = ga.diagnose(rec, controller)
print(dia.summary())
