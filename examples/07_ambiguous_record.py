"""A record that cannot say which of two causes is there: the diagnosis abstains, and proposes the experiment that can."""

import numpy as np

import gaident as ga

controller = ga.PI(kp=0.02, ki=0.6)
rng = np.random.default_rng(7)
drive = ga.OneMass(J=4e-4, D=2e-3).model().with_effect("coulomb_friction", torque=0.05)


def measured(command, dt, name):
    """A run of the drive, simulated here; the controller reads the noise too: e = command - (w + noise)."""
    noise = 0.1 * rng.standard_normal(command.size)
    run = ga.run(drive, ga.Record(dt, command=command - noise, velocity=noise), controller)
    return ga.Record(dt, command=command, velocity=run.velocity + noise, torque=run.torque, name=name)


# The axis turns forwards only: dry friction and a constant load are the same there.
first = ga.diagnose(measured(np.repeat([10.0, 30.0, 20.0], 80), 1e-3, "forwards only"), controller)
(finding,) = first.causes
print("found:", finding.effect, "or", " or ".join(finding.alternatives))
print(finding.evidence)

proposal = first.next_experiment
print(f"\nnext experiment: {proposal.command.size} samples of {1e3 * proposal.dt:g} ms, to tell {', '.join(proposal.separates)}")
print(proposal.reason)

# The proposed command, run on the same drive, beside the first record.
second = ga.diagnose(measured(proposal.command, proposal.dt, "as proposed"), controller)
print("\nafter it:", second.verdict, "-", ", ".join(" or ".join((f.effect, *f.alternatives)) for f in second.causes))
