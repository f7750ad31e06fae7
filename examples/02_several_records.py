"""Several runs -> one model for all of them, saved, loaded and checked on a run that it has not seen."""

import tempfile
from pathlib import Path

import numpy as np

import gaident as ga

controller = ga.PI(kp=0.02, ki=0.8)
truth = ga.OneMass(J=3e-4, D=0.004)
rng = np.random.default_rng(2)


def measured(command, name):
    """A run of the drive, simulated here; yours: ga.read("run1.csv", columns={"velocity": "w", ...})."""
    still = ga.Record(1e-3, command=command, velocity=np.zeros(command.size), name=name)
    noise = 0.2 * rng.standard_normal(command.size)
    return ga.Record(1e-3, command=command, velocity=ga.simulate(truth, still, controller) + noise, name=name)


runs = [
    measured(np.full(400, 20.0), "step"),
    measured(np.repeat([10.0, 40.0, -30.0, 0.0], 150), "staircase"),
]
validation = measured(30.0 * np.sin(np.linspace(0.0, 12.0, 800)), "sine")

idn = ga.identify(runs, controller=controller)
print(idn.summary())

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "drive.json"
    idn.save(path)
    again = ga.load(path)
residual = again.residual(validation)
print(f"\nOn the run it has not seen: rmse {np.sqrt(np.mean(residual**2)):.3f} rad/s; the noise is 0.2 rad/s")
