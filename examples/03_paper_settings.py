"""The paper's genetic algorithm to the letter (Table II), in its search ranges, beside the default engine."""

import numpy as np

import gaident as ga

controller = ga.PI(kp=0.0232, ki=1.367, loop="continuous")
truth = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59)  # Table III
command = np.full(250, 43.6)
still = ga.Record(0.444e-3, command=command, velocity=np.zeros(250))
noise = 0.3 * np.random.default_rng(3).standard_normal(250)
rec = ga.Record(still.dt, command=command, velocity=ga.simulate(truth, still, controller) + noise)

space = ga.SearchSpace(gain=(1e3, 2e4), real=(0.0, 60.0), imaginary=(0.0, 250.0), p=(0, 3), q=(0, 3), bits=10)
for name, settings in (("the paper", ga.Settings.paper()), ("default", ga.Settings())):
    idn = ga.identify(rec, controller=controller, space=space, settings=settings, trials=5, seed=1)
    print(f"{name:9}: (p,q) = ({idn.p},{idn.q}), rmse {idn.rmse:.3f} rad/s, {idn.seconds:.2f} s")
    print("           trials:", *(f"({t.p},{t.q})" for t in idn.trials))
