"""Dry friction that nobody told the model of: found, named and put into the model, which is then checked on another run."""

import numpy as np

import gaident as ga

controller = ga.PI(kp=0.02, ki=0.6)
rng = np.random.default_rng(5)
# The drive, simulated; a real one would be read from its log.
drive = ga.OneMass(J=4e-4, D=2e-3).model().with_effect("coulomb_friction", torque=0.05)


def measured(levels, name):
    """A run through levels of velocity with reversals [rad/s], 60 ms each; the torque is logged as well."""
    command = np.repeat(levels, 60)
    noise = 0.1 * rng.standard_normal(command.size)
    # The controller reads the noise too: e = command - (w + noise).
    run = ga.run(drive, ga.Record(1e-3, command=command - noise, velocity=noise), controller)
    return ga.Record(1e-3, command=command, velocity=run.velocity + noise, torque=run.torque, name=name)


dia = ga.diagnose(
    measured([20.0, -30.0, 8.0, -4.0, 12.0], "levels"),
    controller,
    validation=measured([-15.0, 25.0, -8.0], "other levels"),
)

print(dia.summary())
for finding in dia.causes:
    print("\nfound:", finding.effect, {name: round(e.value, 4) for name, e in finding.parameters.items()})
    print(finding.evidence)
