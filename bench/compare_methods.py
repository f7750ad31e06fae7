"""The comparative study that the paper asks for: grey box against black boxes, by free-run error on held-out data.

    pip install gaident[compare]
    GAIDENT_DATA=... python bench/compare_methods.py [--only NAME ...] [--json FILE]

Every method gets the training record; black boxes choose their sizes on the last quarter of it.
Then it simulates the test record from its input alone:
no measured output but the first samples that a difference equation needs to begin. Time: fitting and choosing, one core.
"""

from __future__ import annotations

import argparse
import json
import os
import time
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass

os.environ.update({name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")})

import numpy as np
from compare_tasks import Task, Vector, all_tasks

import gaident as ga
from gaident.models.factors import FactorCounts

MLP_WIDTHS = (8, 16)
MLP_SEEDS = 3
# A free run that leaves this many times the range of the training data has diverged.
DIVERGED = 20.0


@dataclass(frozen=True)
class Outcome:
    """One method on one task: free-run rmse in the task's unit (nan: it diverged), of the position in mm or None."""

    task: str
    method: str
    rmse: float
    fit_percent: float
    position_mm: float | None
    parameters: int
    seconds: float
    detail: str


Predict = Callable[[ga.Record], Vector]


# --- gaident


def linear(task: Task) -> tuple[Predict, int, str]:
    idn = ga.identify(task.train, task.controller, workers=1)
    return _simulator(task, idn.model), FactorCounts.of(idn.model).size, f"(p,q) = ({idn.p},{idn.q})"


def extended(task: Task) -> tuple[Predict, int, str]:
    dia = ga.diagnose(task.train, task.controller)
    count = FactorCounts.of(dia.model.mechanism).size + sum(len(e.values) for e in dia.model.effects)
    certain = {f.effect for f in dia.causes if f.named}
    names = ", ".join(e.name.replace("_", " ") + ("" if e.name in certain else "?") for e in dia.model.effects)
    return _simulator(task, dia.model), count, f"{dia.verdict}: {names or 'nothing'}"


def _simulator(task: Task, model: ga.Model) -> Predict:
    def predict(rec: ga.Record) -> Vector:
        state = None
        if task.continued:  # a record that begins in motion
            state = ga.initial_state(model, task.train, task.controller)
        return ga.simulate(model, rec, task.controller, state)

    return predict


# --- black boxes: y(n) = f(y(n-1)..y(n-L), u(n)..u(n-L))


@dataclass(frozen=True)
class Decimated:
    """A record's input and output at every d-th sample; the input is the mean over the samples that it stands for."""

    u: Vector
    y: Vector
    d: int

    @classmethod
    def of(cls, task: Task, rec: ga.Record, d: int) -> Decimated:
        u, y = task.input_of(rec), rec.velocity
        n = len(y) // d
        return cls(u[: n * d].reshape(n, d).mean(axis=1), y[: n * d : d], d)

    def cut(self, a: int, b: int) -> Decimated:
        return Decimated(self.u[a:b], self.y[a:b], self.d)


@dataclass
class BlackBox:
    """One candidate: how it is fitted and how it runs freely; `run` gets the data and uses the first `lag` outputs only."""

    lag: int
    parameters: int
    run: Callable[[Decimated], Vector]
    detail: str


Fit = Callable[[Decimated], BlackBox]


def chosen(task: Task, candidates: list[Fit]) -> tuple[Predict, int, str]:
    """The candidate with the least free-run error on the last quarter of the training record, fitted again to all of it."""
    found: list[tuple[float, Fit, int]] = []
    for d in task.decimation:
        data = Decimated.of(task, task.train, d)
        split = int(0.75 * len(data.y))
        fit, rest = data.cut(0, split), data.cut(split, len(data.y))
        for candidate in candidates:
            box = candidate(fit)
            error = rest.y[box.lag :] - safe(box, rest)[box.lag :]
            with np.errstate(over="ignore", invalid="ignore"):
                found.append((float(np.sqrt(np.mean(error**2))), candidate, d))
    _, best, d = min(found, key=lambda entry: entry[0] if np.isfinite(entry[0]) else np.inf)
    box = best(Decimated.of(task, task.train, d))

    def predict(rec: ga.Record) -> Vector:
        data = Decimated.of(task, rec, d)
        out = np.full(len(rec), np.nan)
        out[: len(data.y) * d : d] = safe(box, data)
        return out

    return predict, box.parameters, f"{box.detail}, every {d}. sample" if d > 1 else box.detail


def safe(box: BlackBox, data: Decimated) -> Vector:
    """The free run, infinite where it leaves every bound."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        y = np.asarray(box.run(data), dtype=float).ravel()
    y = np.where(np.isfinite(y), y, np.inf)
    return np.full_like(y, np.inf) if np.abs(y).max() > DIVERGED * (1e-9 + np.abs(data.y).max()) else y


def lagged(u: Vector, y: Vector, L: int) -> Vector:
    """Rows (y(n-1)..y(n-L), u(n)..u(n-L)), n = L.."""
    n = len(y)
    return np.column_stack([*(y[L - i : n - i] for i in range(1, L + 1)), *(u[L - i : n - i] for i in range(L + 1))])


def free_run(step: Callable[[Vector], float], data: Decimated, L: int) -> Vector:
    """The output from its own past; the first L are the measured ones."""
    y = data.y.copy()
    bound = 1e3 * (1e-9 + np.abs(data.y).max())
    y[L:] = 0.0
    for n in range(L, len(y)):
        y[n] = step(np.r_[y[n - L : n][::-1], data.u[n - L : n + 1][::-1]])
        if not abs(y[n]) < bound:
            y[n:] = np.inf
            break
    return y


def arx(task: Task) -> tuple[Predict, int, str]:
    def candidate(L: int) -> Fit:
        def fit(data: Decimated) -> BlackBox:
            X = np.column_stack([lagged(data.u, data.y, L), np.ones(len(data.y) - L)])
            theta = np.linalg.lstsq(X, data.y[L:], rcond=None)[0]
            return BlackBox(L, len(theta), lambda d: free_run(lambda x: float(theta[:-1] @ x + theta[-1]), d, L), f"order {L}")

        return fit

    return chosen(task, [candidate(L) for L in (1, 2, 3, 4, 6, 8, 12)])


def polynomial(task: Task) -> tuple[Predict, int, str]:
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    def candidate(degree: int, L: int) -> Fit:
        def fit(data: Decimated) -> BlackBox:
            su, sy = np.abs(data.u).max(), np.abs(data.y).max()
            model = FROLS(
                order_selection=True, n_info_values=20, info_criteria="bic", ylag=L, xlag=L,
                estimator=LeastSquares(), basis_function=Polynomial(degree=degree),
            )  # fmt: skip
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                model.fit(X=(data.u / su).reshape(-1, 1), y=(data.y / sy).reshape(-1, 1))

            def run(d: Decimated) -> Vector:
                return np.asarray(sy * model.predict(X=(d.u / su).reshape(-1, 1), y=(d.y[:L] / sy).reshape(-1, 1)))

            return BlackBox(L, len(model.theta), run, f"degree {degree}, lags {L}")

        return fit

    return chosen(task, [candidate(degree, L) for degree, L in ((2, 2), (2, 4), (3, 2), (3, 3))])


def network(task: Task) -> tuple[Predict, int, str]:
    from sklearn.neural_network import MLPRegressor

    def candidate(L: int, width: int, seed: int) -> Fit:
        def fit(data: Decimated) -> BlackBox:
            su, sy = data.u.std() + 1e-12, data.y.std() + 1e-12
            net = MLPRegressor(
                hidden_layer_sizes=(width, width), activation="tanh", solver="lbfgs", max_iter=500, random_state=seed
            )
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                net.fit(lagged(data.u / su, data.y / sy, L), data.y[L:] / sy)
            layers = list(zip(net.coefs_, net.intercepts_, strict=True))
            scale = np.r_[np.full(L, sy), np.full(L + 1, su)]

            def step(x: Vector) -> float:
                a = x / scale
                for W, b in layers[:-1]:
                    a = np.tanh(a @ W + b)
                return float((a @ layers[-1][0] + layers[-1][1])[0] * sy)

            count = sum(W.size + b.size for W, b in layers)
            return BlackBox(L, count, lambda d: free_run(step, d, L), f"2 x {width} tanh, lags {L}")

        return fit

    return chosen(task, [candidate(L, w, s) for L in (2, 4, 8) for w in MLP_WIDTHS for s in range(MLP_SEEDS)])


METHODS: dict[str, Callable[[Task], tuple[Predict, int, str]]] = {
    "gaident, linear": linear,
    "gaident, extended": extended,
    "ARX, least squares": arx,
    "polynomial NARX (sysidentpy)": polynomial,
    "neural NARX (scikit-learn MLP)": network,
}


def judged(task: Task, name: str) -> Outcome:
    """Fits one method and runs it freely on the test record."""
    began = time.process_time()
    predict, parameters, detail = METHODS[name](task)
    seconds = time.process_time() - began
    y, answer = task.test.velocity, predict(task.test)
    there = ~np.isnan(answer)
    there[: task.first] = False
    error = (y - answer)[there]
    rmse = float(np.sqrt(np.mean(error**2))) if np.all(np.isfinite(error)) else float("nan")
    spread = float(np.std(y[there]))
    position = None
    if task.position and np.isfinite(rmse):
        times = task.test.time[there]
        travelled = np.r_[0.0, np.cumsum(0.5 * (answer[there][1:] + answer[there][:-1]) * np.diff(times))]
        measured = task.test.position[there]
        position = 1e3 * float(np.sqrt(np.mean((measured - measured[0] - travelled) ** 2)))
    return Outcome(task.name, name, task.factor * rmse, 100.0 * (1.0 - rmse / spread), position, parameters, seconds, detail)


def table(task: Task, outcomes: list[Outcome]) -> str:
    """Markdown, the best in bold."""
    best = min((o.rmse for o in outcomes if np.isfinite(o.rmse)), default=float("nan"))
    more = " position [mm] |" if task.position else ""
    lines = [
        f"**{task.name}**: {len(task.train)} samples to fit, {len(task.test) - task.first} to judge",
        "",
        f"| method | error [{task.unit}] | fit [%] |{more} parameters | time | chosen |",
        "|---|---|---|" + ("---|" if more else "") + "---|---|---|",
    ]
    for o in outcomes:
        error = "diverged" if not np.isfinite(o.rmse) else f"{o.rmse:.3g}"
        error = f"**{error}**" if o.rmse == best else error
        place = "" if not more else f" {'' if o.position_mm is None else format(o.position_mm, '.3g')} |"
        fit = f"{o.fit_percent:.1f}" if np.isfinite(o.fit_percent) else ""
        lines.append(f"| {o.method} | {error} | {fit} |{place} {o.parameters} | {o.seconds:.2g} s | {o.detail} |")
    winner = next((o.method for o in outcomes if o.rmse == best), "nobody")
    lines += ["", f"Least error: {winner}." + ("" if winner.startswith("gaident") else " A black box wins here.")]
    if task.published:
        lines += ["", "Published: " + ", ".join(f"{name} {figure}" for name, figure in task.published) + f" ({task.note})."]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", help="tasks whose name begins so: rig, EMPS, CED")
    parser.add_argument("--json", metavar="FILE", help="write all figures")
    options = parser.parse_args()
    everything = []
    for task in all_tasks():
        if options.only and not any(task.name.startswith(name) for name in options.only):
            continue
        outcomes = [judged(task, name) for name in METHODS]
        everything += outcomes
        print(table(task, outcomes), end="\n\n", flush=True)
    if options.json:
        with open(options.json, "w") as file:
            json.dump([asdict(o) for o in everything], file, indent=1)


if __name__ == "__main__":
    main()
