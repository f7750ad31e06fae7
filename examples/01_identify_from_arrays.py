"""Arrays of a velocity step -> structure, poles, zeros and mechanics of the drive, with their uncertainty."""

import numpy as np

import gaident as ga

# The arrays would come from your drive; here a two-mass drive is simulated, with noise on its velocity.
controller = ga.PI(kp=0.0232, ki=1.367)  # N m s/rad, N m/rad; a digital PI, as drives have
truth = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59)
dt = 0.444e-3  # s
command = np.full(500, 43.6)  # rad/s
clean = ga.simulate(truth, ga.Record(dt, command=command, velocity=0.0 * command), controller)
velocity = clean + 0.3 * np.random.default_rng(1).standard_normal(command.size)

rec = ga.Record(dt, command=command, velocity=velocity, name="velocity step")
idn = ga.identify(rec, controller=controller)

print(idn.summary())
print()
print("structure", (idn.p, idn.q), "gain", idn.model.gain, "poles", idn.model.poles)
print("load inertia", idn.mechanics.JL, "+-", idn.mechanics.std["JL"], "kg m^2; true", truth.JL)
