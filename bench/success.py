"""Success rates of identify(): how often the true structure is reported and the fitted response is as good as noise permits.

    python bench/success.py [--cases 100] [--only NAME ...] [--paper]

"Right" means the true (p, q) *and* rms(fitted response - noise-free truth) below `limit` times the noise.
Every case has its own noise and its own seed of the genetic search.
Records: loop "continuous", dt 0.444 ms, white noise on the simulated output.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import gaident as ga

DT = 0.444e-3
KP, KI = 0.0232, 1.367


@dataclass(frozen=True)
class Case:
    """One record to identify: model, controller, command and noise."""

    model: ga.Model
    controller: ga.PI
    command: np.ndarray
    noise: float
    limit: float


def step(level: float = 43.6, samples: int = 250) -> np.ndarray:
    return np.full(samples, level)


def controller(scale: float) -> ga.PI:
    return ga.PI(KP * scale, KI * scale, loop="continuous")


def pair(re: float, im: float) -> list[complex]:
    return [complex(-re, im), complex(-re, -im)]


def one_mass_of_the_paper(_: np.random.Generator) -> Case:
    return Case(ga.Model(6278.26, [-34.13]), controller(1.6744), step(), 0.3, 0.35)


def two_mass_of_the_paper(_: np.random.Generator) -> Case:
    model = ga.Model(6545.29, [-15.41, *pair(10.30, 150.9)], pair(4.26, 93.98))
    return Case(model, controller(5.5637), step(), 0.3, 0.35)


def hard(_: np.random.Generator) -> Case:
    model = ga.Model(8000.0, [-8.0, *pair(30.0, 700.0)], pair(20.0, 500.0))
    return Case(model, controller(1.0), step(), 0.2, 0.35)


def staircase(rng: np.random.Generator, samples: int = 1000, stairs: int = 8) -> np.ndarray:
    return np.repeat(rng.uniform(-60.0, 60.0, stairs), -(-samples // stairs))[:samples]


def log_uniform(rng: np.random.Generator, lo: float, hi: float) -> float:
    return float(np.exp(rng.uniform(np.log(lo), np.log(hi))))


def random_drive(rng: np.random.Generator, resonances: int) -> Case:
    """J_M 5e-5..6e-4, damping pole 5..60 rad/s, antiresonance 60..400 rad/s, resonance 1.25..2.5 times it, modal damping
    0.02..0.1, loop bandwidth 80..400 rad/s, staircase command, noise 0.05 rad/s."""
    inertia = log_uniform(rng, 5e-5, 6e-4)
    poles: list[complex] = [-rng.uniform(5.0, 60.0)]
    zeros: list[complex] = []
    rigid, lowest = 1.0 / inertia, 60.0
    for _ in range(resonances):
        wz = log_uniform(rng, lowest, 400.0 if lowest == 60.0 else 2.0 * lowest)
        wp = wz * rng.uniform(1.25, 2.5)
        for w, roots in ((wz, zeros), (wp, poles)):
            zeta = rng.uniform(0.02, 0.1)
            roots += pair(zeta * w, w * np.sqrt(1.0 - zeta**2))
        rigid *= (wz / wp) ** 2
        lowest = 1.2 * wp
    bandwidth = log_uniform(rng, 80.0, 400.0)
    kp = bandwidth / rigid
    return Case(
        ga.Model(1.0 / inertia, poles, zeros), ga.PI(kp, kp * bandwidth / 5.0, loop="continuous"), staircase(rng), 0.05, 0.2
    )


CASES: dict[str, tuple[Callable[[np.random.Generator], Case], dict[str, tuple[int, int]]]] = {
    "one mass (paper)": (one_mass_of_the_paper, {}),
    "two masses (paper)": (two_mass_of_the_paper, {}),
    "hard": (hard, {}),
    "random one mass": (lambda rng: random_drive(rng, 0), {}),
    "random two masses": (lambda rng: random_drive(rng, 1), {}),
    "random three masses": (lambda rng: random_drive(rng, 2), {"q": (0, 4)}),
}


def bounded_loop(make: Callable[[np.random.Generator], Case], rng: np.random.Generator) -> Case:
    """A case whose loop is stable: an engineer would not have recorded another."""
    while True:
        case = make(rng)
        w = noise_free(case)
        if np.all(np.isfinite(w)) and np.abs(w).max() < 3.0 * np.abs(case.command).max():
            return case


def noise_free(case: Case) -> np.ndarray:
    blank = ga.Record(dt=DT, command=case.command, velocity=np.zeros_like(case.command))
    return ga.simulate(case.model, blank, case.controller)


def local_fit_from_truth(case: Case, rec: ga.Record) -> float:
    """Error sum that scipy's least squares reaches from the true parameters."""
    from scipy.optimize import least_squares

    _, values, _ = ga.factor_parameters(case.model)
    from gaident.models import FactorCounts

    structure = FactorCounts.of(case.model)

    def residual(scaled: np.ndarray) -> np.ndarray:
        return rec.velocity - ga.simulate(ga.model_from_factor_parameters(scaled * values, structure), rec, case.controller)

    return float(2.0 * least_squares(residual, np.ones_like(values), x_scale="jac", xtol=1e-12, ftol=1e-12).cost)


def run(name: str, cases: int, settings: ga.Settings, first: int, given: bool, verbose: bool) -> dict[str, float]:
    make, space_options = CASES[name]
    right = structure_right = 0
    seconds, deviations, excess = [], [], []
    for k in range(first, first + cases):
        rng = np.random.default_rng([k, len(name)])
        case = bounded_loop(make, rng)
        truth = noise_free(case)
        rec = ga.Record(dt=DT, command=case.command, velocity=truth + case.noise * rng.standard_normal(len(truth)))
        space = None
        if settings.engine == "plain":
            space = ga.SearchSpace(gain=(1e3, 2e4), real=(0.0, 60.0), imaginary=(0.0, 250.0))
        elif space_options or given:
            from dataclasses import replace

            from gaident.identification.space import derive_space

            p, q = case.model.p, case.model.q
            narrowed = {"p": (p, p), "q": (q, q)} if given else space_options
            space = replace(derive_space([rec], case.controller), **narrowed)
        began = time.perf_counter()
        idn = ga.identify(rec, case.controller, space=space, settings=settings, seed=1000 + k, workers=1)
        seconds.append(time.perf_counter() - began)
        deviation = float(np.sqrt(np.mean((idn.simulate(rec) - truth) ** 2)) / case.noise)
        deviations.append(deviation)
        same = (idn.p, idn.q) == (case.model.p, case.model.q)
        structure_right += same
        right += same and deviation < case.limit
        if name == "hard":
            excess.append(float(np.sum(idn.residual(rec) ** 2)) / local_fit_from_truth(case, rec) - 1.0)
        if verbose and not (same and deviation < case.limit):
            rows = ", ".join(f"({s.p},{s.q}) {s.delta_bic:.1f}" for s in sorted(idn.structures, key=lambda s: s.delta_bic)[:6])
            print(f"  case {k}: found ({idn.p},{idn.q}), true ({case.model.p},{case.model.q}), deviation {deviation:.3f}; {rows}")
            print(f"    true {case.model}")
    result = {
        "right": right,
        "structure": structure_right,
        "median ms": 1e3 * float(np.median(seconds)),
        "max ms": 1e3 * max(seconds),
        "median deviation": float(np.median(deviations)),
        "max deviation": max(deviations),
    }
    if excess:
        result["largest excess over the fit from the truth"] = max(excess)
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", nargs="*", help=f"from: {', '.join(CASES)}")
    space = parser.add_mutually_exclusive_group()
    space.add_argument("--paper", action="store_true", help="Settings.paper() with the ranges of the paper's records")
    space.add_argument("--given", action="store_true", help="the structure is given: SearchSpace with one p and one q")
    parser.add_argument("--verbose", action="store_true", help="show the cases that went wrong")
    options = parser.parse_args()
    settings = ga.Settings.paper() if options.paper else ga.Settings()
    for name in options.only or list(CASES):
        figures = run(name, options.cases, settings, options.first, options.given, options.verbose)
        print(
            f"{name}: {figures.pop('right'):.0f} of {options.cases} right; "
            + ", ".join(f"{k} {v:.4g}" for k, v in figures.items()),
            flush=True,
        )


if __name__ == "__main__":
    main()
