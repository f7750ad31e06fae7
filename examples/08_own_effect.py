"""An effect of one's own, from Python: friction in a gear in proportion to the torque that it transmits."""

import numpy as np

import gaident as ga


def gear_friction(signals, share):
    """Level of the dry friction [N m]; arrays, an entry per drive that is simulated side by side."""
    return share * np.abs(signals.torque)


ga.effects.register(
    "gear_friction",
    [ga.effects.Parameter("share", "1", neutral=0.0, lowest=0.0, highest=0.9)],
    meaning="dry friction in proportion to the torque transmitted",
    friction=gear_friction,
)

# From here on it is an effect like the others: in models, ...
controller = ga.PI(kp=0.02, ki=0.6)
drive = ga.OneMass(J=3e-4, D=4e-3).model().with_effect("gear_friction", share=0.3)
command = np.repeat([20.0, -40.0, 10.0, 60.0, -5.0, 0.0], 40)
clean = ga.simulate(drive, ga.Record(1e-3, command=command, velocity=0.0 * command), controller)
noise = 0.1 * np.random.default_rng(8).standard_normal(command.size)
rec = ga.Record(1e-3, command=command, velocity=clean + noise, name="levels")

# ... and among the causes that a diagnosis may name.
dia = ga.diagnose(rec, controller)
print(dia.summary())

ga.effects.unregister("gear_friction")
