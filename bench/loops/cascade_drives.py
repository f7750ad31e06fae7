"""identify() on random drives whose log has a line for every 8th sample of a known controller: right (p, q), and deviations.

    python bench/loops/cascade_drives.py [--drives 20] [--noise 0.01]

Each drive is one or two masses under a cascade (rule, weight and filters at random) at 125 us; its log has a line each
millisecond.
A record is right if (p, q) is that of the drive; "deviations" is the mean square of (estimate - truth)/standard deviation over
the parameters, near 1 where the deviations are what they say.
"""

from __future__ import annotations

import argparse
import math

import numpy as np

import gaident as ga

T, EVERY, LINES = 125e-6, 8, 1500


def drive(random: np.random.Generator) -> ga.OneMass | ga.TwoMass:
    """A motor alone, or with a load on a shaft: resonance at 60 to 300 Hz, inertia ratio of 0.3 to 3."""
    motor = 10 ** random.uniform(-4.0, -3.0)
    if random.random() < 0.3:
        return ga.OneMass(J=motor, D=motor * random.uniform(2.0, 20.0))
    load = motor * 10 ** random.uniform(-0.5, 0.5)
    w = 2.0 * math.pi * 10 ** random.uniform(math.log10(60.0), math.log10(300.0))
    stiffness = w**2 * motor * load / (motor + load)
    damping = random.uniform(0.02, 0.06) * stiffness / w
    return ga.TwoMass(
        JM=motor, DM=motor * random.uniform(2.0, 20.0), JL=load, DL=load * random.uniform(2.0, 20.0), KG=stiffness, DG=damping
    )


def controller(model: ga.Model, random: np.random.Generator) -> ga.Cascade:
    """Gains for some 15 Hz over all inertia; a rule, a weight and filters at random."""
    still = abs(np.prod([z for z in model.zeros])) if model.zeros else 1.0
    inertia = abs(np.prod([p for p in model.poles if p.imag != 0.0])) / (model.gain * still) if model.zeros else 1.0 / model.gain
    w = 2.0 * math.pi * random.uniform(10.0, 20.0)
    pi = ga.PI(
        kp=inertia * w,
        ki=inertia * w * w / random.uniform(5.0, 10.0),
        rule=("trapezoidal", "backward", "forward")[random.integers(3)],
        command_weight=(1.0, 1.0, 0.5)[random.integers(3)],
    )
    low, notch = ga.LowPass(time_constant=0.3e-3), ga.Notch(frequency=285.0, numerator_damping=0.1, denominator_damping=0.7)
    filters = ((), (low,), (notch,), (low, notch))[random.integers(4)]
    return ga.Cascade(velocity=pi, period=T, torque_filters=filters, delay=T * random.integers(2))


def command(random: np.random.Generator) -> np.ndarray:
    """Steps of random height and length, with ramps between some of them [rad/s]."""
    w = np.zeros(LINES)
    k, before = 20, 0.0
    while k < LINES:
        n, level = int(random.integers(15, 120)), random.uniform(-50.0, 50.0)
        if random.random() < 0.4:
            w[k : k + n] = np.linspace(before, level, n)[: LINES - k]
        else:
            w[k : k + n] = level
        k, before = k + n, level
    return w


def truth(model: ga.Model) -> dict[str, float]:
    """The numbers of a model by the names that an Identification gives them."""
    numbers = {"gain": model.gain}
    for kind, roots in (("pole", model.poles), ("zero", model.zeros)):
        reals = [r.real for r in roots if r.imag == 0.0]
        pairs = [r for r in roots if r.imag > 0.0]
        numbers |= {f"{kind}_{k + 1}": r for k, r in enumerate(reals)}
        numbers |= {f"{kind}_pair_{k + 1}_real": r.real for k, r in enumerate(pairs)}
        numbers |= {f"{kind}_pair_{k + 1}_imaginary": r.imag for k, r in enumerate(pairs)}
    return numbers


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drives", type=int, default=20)
    parser.add_argument("--noise", type=float, default=0.01, help="of the velocity's rms")
    args = parser.parse_args()
    right, squares = 0, []
    for seed in range(args.drives):
        random = np.random.default_rng([15, seed])
        mechanics = drive(random)
        model = mechanics.model()
        loop = controller(model, random)
        still = ga.Record(EVERY * T, command=command(random), velocity=np.zeros(LINES))
        velocity = ga.simulate(model, still, loop)
        size = args.noise * float(np.sqrt(np.mean(velocity**2)))
        noisy = velocity + size * random.standard_normal(LINES)
        idn = ga.identify(ga.Record(EVERY * T, command=still.command, velocity=noisy), loop, seed=seed, workers=1)
        good = (idn.p, idn.q) == (model.p, model.q)
        right += good
        shown = ""
        if good:
            true = truth(model)
            error = [(idn.parameters[n].value - v) / idn.parameters[n].std for n, v in true.items()]
            relative = max(abs(idn.parameters[n].value - v) / abs(v) for n, v in true.items())
            squares += [e * e for e in error]
            shown = f"largest error {relative:.2g}, in deviations {np.round(error, 1).tolist()}"
        print(
            f"{seed:3d} ({model.p},{model.q}) -> ({idn.p},{idn.q}) falsified {idn.falsified} {idn.seconds:.2f} s {shown}",
            flush=True,
        )
    print(f"right {right} of {args.drives}; mean square of deviations {np.mean(squares) if squares else math.nan:.2f}")


if __name__ == "__main__":
    main()
