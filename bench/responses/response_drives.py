"""Structure and parameters of random drives from one frequency response each, with 1 % of noise.

    python bench/responses/response_drives.py [--cases 100] [--seed 1] [--held] [--late] [--peer]

Chains of one, two and three masses in turn, 60 to 200 frequencies from 1 to 450 Hz, standard deviations stated in every second.
A mass counts as shown where the best chain that is smaller, fitted to the response with a tenth of the noise, is worse by
more than ten units of BIC, whatever the noise does to them.
Chance moves the gain D in 2 ln(likelihood) by 2 sqrt(D), of which three are left.
--held: behind a hold of 1 ms.
--late: behind a delay of 0.05 to 0.5 ms, a lag of 0.1 to 0.6 ms, both, or none, in turn; what was found counts, too.
--long: delays up to 3 ms and lags up to 30 ms instead.
--noise: of the response, over its magnitude.
--peer: the same responses to scikit-rf's vector fitting (where it is installed), which is told the true order.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
import scipy.linalg

import gaident as ga

F = (1.0, 450.0)


def chain(rng: np.random.Generator, masses: int) -> ga.Model:
    """A chain of masses on damped shafts, from its equations of motion."""
    J = 10.0 ** rng.uniform(-4.5, -2.0) * 10.0 ** rng.uniform(-0.5, 0.5, masses)
    f = np.sort(rng.uniform(15.0, 200.0, masses - 1))
    while masses == 3 and f[1] < 1.5 * f[0]:
        f = np.sort(rng.uniform(15.0, 200.0, 2))
    both = J[:-1] * J[1:] / (J[:-1] + J[1:])
    K, Z = (2.0 * np.pi * f) ** 2 * both, 2.0 * rng.uniform(0.01, 0.04, masses - 1) * 2.0 * np.pi * f * both
    A, B = np.zeros((2 * masses - 1, 2 * masses - 1)), np.zeros(2 * masses - 1)  # velocities, twists
    A[range(masses), range(masses)] = -rng.uniform(0.3, 5.0, masses)
    for i in range(masses - 1):
        A[masses + i, i], A[masses + i, i + 1] = 1.0, -1.0
        for a, b in ((i, i + 1), (i + 1, i)):
            A[a, a] -= Z[i] / J[a]
            A[a, b] += Z[i] / J[a]
            A[a, masses + i] += (-K[i] if a == i else K[i]) / J[a]
    B[0] = 1.0 / J[0]
    n = len(A)
    C = np.eye(n)[0]
    system = np.block([[A, B[:, None]], [C[None, :], np.zeros((1, 1))]])
    zeros = scipy.linalg.eigvals(system, np.diag([1.0] * n + [0.0]))
    return ga.Model(1.0 / J[0], list(np.linalg.eigvals(A)), list(zeros[np.isfinite(zeros) & (np.abs(zeros) < 1e9)]))


def exact(model: ga.Model, f: np.ndarray, dt: float | None, delay: float = 0.0, lag: float = 0.0) -> np.ndarray:
    """The response behind a delay and a lag [s]; behind a hold from partial fractions, of which each has its exact sum.

    A part c/(s - p) is at the samples, behind a hold and a delay of a fraction e of a sample,

        c/p ((exp(p T (1 - e)) - 1) + (exp(p T) - exp(p T (1 - e))) / z) / (z - exp(p T))
    """
    w = 2.0 * np.pi * f
    if dt is None:
        return model.frequency_response(w) * np.exp(-1j * w * delay) / (1.0 + 1j * w * lag)
    gain, poles = (model.gain / lag, [*model.poles, -1.0 / lag]) if lag else (model.gain, list(model.poles))
    whole, e = divmod(delay / dt, 1.0)
    z, g = np.exp(1j * w * dt), np.zeros(len(f), complex)
    for i, p in enumerate(poles):
        c = gain * np.prod([p - r for r in model.zeros]) / np.prod([p - r for k, r in enumerate(poles) if k != i])
        early, all_of_it = np.exp(p * dt * (1.0 - e)), np.exp(p * dt)
        g += c / p * ((early - 1.0) + (all_of_it - early) / z) / (z - all_of_it)
    return g * z**-whole


def path_of(rng: np.random.Generator, kind: int, long: bool) -> dict[str, float]:
    """Delay and lag [s] of the torque's path: none, a delay, a lag, both."""
    delay, lag = (3e-3, 30e-3) if long else (0.5e-3, 0.6e-3)
    drawn = {"delay": rng.uniform(0.05e-3, delay), "lag": rng.uniform(0.1e-3, lag)}
    return {name: value for bit, (name, value) in enumerate(drawn.items()) if kind >> bit & 1}


def shown_masses(model: ga.Model, f: np.ndarray, dt: float | None, noise: float) -> int:
    """Masses that the response shows: a smaller chain is worse by more than ten units of BIC at this noise.

    How much worse is read off a response with a tenth of the noise, whose own share 2 n is taken out.
    """
    g = exact(model, f, dt)
    e = np.random.default_rng(0).standard_normal((2, len(f)))
    g = g * (1.0 + 0.1 * noise / np.sqrt(2.0) * (e[0] + 1j * e[1]))
    clear = ga.identify(ga.FrequencyResponse(f, g, 0.1 * noise * np.abs(g), dt=dt))
    largest = 1 + model.q // 2
    sums = {s.q: s.error_sum for s in clear.structures if s.p == 1}
    for masses in range(1, largest):
        # With noise the sum of a chain is 2 n more.
        size = 2.0 * len(f)
        smaller = max(sums.get(2 * (masses - 1), np.inf) - size, 0.0) / 100.0
        gain = size * np.log1p(smaller / size)
        if gain - 6.0 * np.sqrt(gain) - 4.0 * (largest - masses) * np.log(size) < 10.0:
            return masses
    return largest


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--held", action="store_true")
    parser.add_argument("--late", action="store_true")
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--noise", type=float, default=0.01)
    parser.add_argument("--peer", action="store_true")
    options = parser.parse_args()
    noise = options.noise
    dt = 1e-3 if options.held else None
    right = unseen = false = paths = 0
    inside: list[np.ndarray] = []
    seconds, errors, others = [], [], []
    for i in range(options.cases):
        rng = np.random.default_rng([options.seed, i])
        model = chain(rng, 1 + i % 3)
        f = np.geomspace(*F, int(rng.integers(60, 200)))
        e = rng.standard_normal((2, len(f)))
        path = path_of(rng, i // 3 % 4, options.long) if options.late or options.long else {}
        g = exact(model, f, dt, **path) * (1.0 + noise / np.sqrt(2.0) * (e[0] + 1j * e[1]))
        began = time.perf_counter()
        idn = ga.identify(ga.FrequencyResponse(f, g, noise * np.abs(g) if i % 2 else None, dt=dt))
        seconds.append(time.perf_counter() - began)
        false += idn.falsified
        late = {name: e for name, e in (("delay", idn.delay), ("lag", idn.lag)) if e is not None}
        paths += late.keys() == path.keys()
        if late.keys() != path.keys():
            print(f"case {i}: {', '.join(late) or 'nothing'} for {', '.join(path) or 'nothing'}")
        if (idn.p, idn.q) == (1, model.q):
            right += 1
            found, truth = (ga.factor_parameters(m)[1] for m in (idn.model, model))
            assert idn.covariance is not None
            inside.append(np.abs(found - truth) < 1.96 * np.sqrt(np.diag(np.array(idn.covariance)))[: len(truth)])
            both = late.keys() & path.keys()
            inside.append(np.array([abs(late[name].value - path[name]) < 1.96 * late[name].std for name in both], bool))
        elif (idn.p, idn.q) == (1, 2 * (shown_masses(model, f, dt, noise) - 1)):
            unseen += 1  # the mass that is missing does not show
        else:
            print(f"case {i}: ({idn.p},{idn.q}) for (1,{model.q}), falsified {idn.falsified}")
        if options.peer:
            truth = exact(model, f, None)
            errors.append(off(idn.model.frequency_response(2.0 * np.pi * f), truth))
            others.append(off(vector_fitted(f, g, model), truth))
    print(f"{options.cases} drives: structure right {right}, a mass that does not show left out {unseen}, ", end="")
    print(f"other {options.cases - right - unseen}, falsified {false}")
    print(f"delay and lag right, or none where there is none: {paths}")
    print(f"95 % intervals that contain the truth: {100.0 * np.mean(np.concatenate(inside)):.1f} % of {sum(map(len, inside))}")
    print(f"median {np.median(seconds):.2f} s, longest {np.max(seconds):.2f} s")
    if options.peer:
        own, other = np.median(errors), np.median(others)
        print(f"rms relative error of the response, medians: {own:.2%}, vector fitting {other:.2%}")
    assert right + unseen >= 0.98 * options.cases, "the structure is right in less than 98 of 100"


def off(g: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square of the relative error."""
    return float(np.sqrt(np.mean(np.abs(g / truth - 1.0) ** 2)))


def vector_fitted(f: np.ndarray, g: np.ndarray, model: ga.Model) -> Any:
    """The same response by scikit-rf, told how many real poles and pairs there are."""
    import skrf
    import skrf.vectorFitting

    network = skrf.Network(frequency=skrf.Frequency.from_f(f, unit="hz"), s=g.reshape(-1, 1, 1))
    fit = skrf.vectorFitting.VectorFitting(network)
    fit.vector_fit(n_poles_real=1, n_poles_cmplx=model.q // 2, fit_constant=False, fit_proportional=False)
    return fit.get_model_response(0, 0, f)


if __name__ == "__main__":
    main()
