"""identify(): from records to structure and parameters."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.data.record import Record
from gaident.errors import RecordError, SettingsError, SpaceError
from gaident.identification import adequacy, covariance, selection
from gaident.identification.noise import Autoregression, fit_autoregression
from gaident.identification.result import Identification, Rival, Structure, TrialOutcome
from gaident.identification.selection import MARGIN, Candidate
from gaident.identification.settings import Settings
from gaident.identification.space import SearchSpace, derive_space
from gaident.identification.starts import doubtful_start, starts_moving
from gaident.models.controller import PI
from gaident.models.mechanics import OneMass, TwoMass, mechanics_from_model
from gaident.models.model import Model
from gaident.version import version

__all__ = ["identify"]

Vector = NDArray[np.float64]
ProgressCallback = Callable[[float, str], None]

FINAL_ITERATIONS = 60


def identify(
    rec: Record | Sequence[Record],
    controller: PI | None = None,
    space: SearchSpace | None = None,
    settings: Settings | None = None,
    trials: int = 1,
    seed: int = 0,
    workers: int | None = None,
    progress: ProgressCallback | None = None,
) -> Identification:
    """Finds structure (p, q) and parameters of the model behind one or several records.

    rec: a Record or a list (one model for all, each with its own initial state). controller: the velocity loop's PI, driven by
    the
        record's command; None: open loop, the record's torque drives the model.
    space: search ranges; None: derived from the data, see `Identification.space`. settings: Settings() unless given.
    trials: independent genetic runs, the best of each structure is kept. workers: threads, None: as many as the machine has;
        the result does not depend on it, nor on the order of records.
    progress: called now and then with (fraction done, message). Ctrl-C raises KeyboardInterrupt within 0.2 s.

    Raises GaidentError (a ValueError) that names the argument, its value and the remedy. Bad luck is data: see `warnings`,
    `adequacy`, `rivals` and the flags of `parameters`.
    """
    began = time.perf_counter()
    given = _checked_records(rec, controller)
    settings = Settings() if settings is None else settings
    if not isinstance(settings, Settings):
        raise SettingsError(f"settings is {settings!r}: give a gaident.Settings")
    for name, value, low, high in (("trials", trials, 1, 10**6), ("seed", seed, 0, 2**63 - 1), ("workers", workers, 1, 1024)):
        if value is None and name == "workers":
            continue
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not low <= value <= high:
            raise SettingsError(f"{name} is {value!r}: it must be a whole number from {low} to {high}")
    threads = _processors() if workers is None else int(workers)
    records = sorted(given, key=lambda r: (r.digest, r.name))  # sums must not depend on the order given
    derived = space is None
    space = _checked_space(derive_space(records, controller) if space is None else space, controller)

    moving = [
        settings.initial_state == "free" or (settings.initial_state == "auto" and starts_moving(r, controller)) for r in records
    ]
    work = _Work(records, controller, space, settings, moving)
    found = work.search(int(trials), int(seed), threads, progress)
    best, scored, noise = work.select(found, threads)
    result = work.report(best, scored, noise, found, int(seed))
    if derived and not settings.species:
        warning = "Search ranges derived from the data are wide; the plain engine needs narrow ones: give space=SearchSpace(...)."
        object.__setattr__(result, "warnings", (*result.warnings, warning))
    object.__setattr__(result, "seconds", time.perf_counter() - began)
    return result


@dataclass
class _Work:
    """One identification on its way."""

    records: list[Record]
    controller: PI | None
    space: SearchSpace
    settings: Settings
    moving: list[bool]

    def __post_init__(self) -> None:
        c = self.controller
        loop, kp, ki = ("open", 0.0, 0.0) if c is None else (c.loop, c.kp, c.ki)
        limits = (np.inf, np.inf) if c is None else c.limits
        self.inputs = [_input(r, c) for r in self.records]
        rows = [
            (u, r.velocity, r.dt, "free" if m else "rest", float(r.velocity[:3].mean()))
            for u, r, m in zip(self.inputs, self.records, self.moving, strict=True)
        ]
        self.experiment = _core.Experiment(
            records=rows, loop=loop, kp=kp, ki=ki, torque_limit=limits[0], integrator_limit=limits[1]
        )
        self.loop = (loop, kp, ki, *limits)
        self.samples = sum(len(r) for r in self.records)
        self.ranges = self.space.ranges(paper=not self.settings.species and self.settings.scale == "linear")

    def search(self, trials: int, seed: int, workers: int, progress: ProgressCallback | None) -> list[_core.Trial]:
        """The genetic runs."""
        total = trials * self.settings.generations
        usual = 4.0 * trials * self.settings.round  # species stop by themselves: the bar approaches its end

        def report(done: int, best: float) -> None:
            assert progress is not None
            fraction = done / (done + usual) if self.settings.species else done / total
            progress(min(1.0, fraction), f"generation {done}, best fitness {best:.4g}")

        return self.experiment.search(
            ranges=self.ranges,
            settings=self.settings.engine_settings(),
            trials=trials,
            seed=seed,
            workers=workers,
            progress=None if progress is None else report,
        )

    def select(self, found: list[_core.Trial], workers: int) -> tuple[Candidate, list[Candidate], Autoregression]:
        """The winner, all structures with their BIC (the plain engine compares none), and the noise model of the winner."""
        if self.settings.species:
            merged = [min((t.species[i] for t in found), key=lambda s: s.cost) for i in range(len(found[0].species))]
            candidates = [selection.from_core(s) for s in merged if s.cost < 1e300]
            if not candidates:
                raise SpaceError("space: every candidate diverged in it; widen the ranges, or leave space=None")
            scored, winner, _ = selection.choose(
                self.experiment, candidates, self.residuals, [len(r) for r in self.records], self.ranges, workers
            )
            best = self.polished(scored[winner])
            if self.judged(best).falsified:
                chain = selection.smallest_mechanism(scored, self.samples)
                best = best if chain is None or chain == winner else self.polished(scored[chain])
        else:
            trial = min(found, key=lambda t: t.best_fitness)
            gain, poles, zeros = _core.decode(
                words=trial.best,
                ranges=self.ranges,
                gray=self.settings.code == "gray",
                logarithmic=self.settings.scale == "logarithmic",
            )
            model = Model(gain, poles, zeros)
            # No local fit: only the start states the search assumed (steady motion) and what stands at a bound.
            best = self.refined(Candidate(model, np.zeros(0), np.inf, ()), 0)
            scored = []
        return best, scored, fit_autoregression(self.residuals(best))

    def polished(self, c: Candidate) -> Candidate:
        """The local fit taken to the end."""
        done = self.refined(c, FINAL_ITERATIONS)
        # Once more without a step: the core reports bounds in the order of the factors it was given, and Model may have put
        # the roots into another.
        return self.refined(done if done.cost <= c.cost else c, 0)

    def refined(self, c: Candidate, iterations: int) -> Candidate:
        """The local fit from c; with no iterations, c with its start states, cost and what stands at a bound."""
        fit = self.experiment.refine(
            models=[(c.model.gain, np.array(c.model.poles, complex), np.array(c.model.zeros, complex), c.starts)],
            ranges=self.ranges,
            whitening=[],
            max_iterations=iterations,
            workers=1,
        )[0]
        done = selection.from_core(fit)
        return replace(done, model=done.model if iterations else c.model, bic=c.bic)

    def states(self, c: Candidate) -> list[Vector]:
        """Start state of each record; empty: at rest."""
        size = c.model.order + (self.controller is not None)
        states, at = [], 0
        for m in self.moving:
            n = size if m and len(c.starts) else 0
            states.append(c.starts[at : at + n])
            at += n
        return states

    def outputs(self, c: Candidate) -> list[Vector]:
        """Simulated velocity of each record."""
        loop, kp, ki, torque_limit, integrator_limit = self.loop
        poles, zeros = np.array(c.model.poles, complex), np.array(c.model.zeros, complex)
        return [
            _core.simulate(c.model.gain, poles, zeros, r.dt, u, loop, kp, ki, torque_limit, integrator_limit, s)[0]
            for r, u, s in zip(self.records, self.inputs, self.states(c), strict=True)
        ]

    def residuals(self, c: Candidate) -> list[Vector]:
        """Measured minus simulated velocity of each record."""
        return [r.velocity - y for r, y in zip(self.records, self.outputs(c), strict=True)]

    def sensitivities(self, c: Candidate) -> Any:
        """de/dx of the plain error, parameters (start states last) x samples."""
        return self.experiment.sensitivities(
            gain=c.model.gain,
            poles=np.array(c.model.poles, complex),
            zeros=np.array(c.model.zeros, complex),
            starts=list(c.starts),
            whitening=[],
        )[1]

    def judged(self, c: Candidate) -> adequacy.Adequacy:
        """Whether the data contradict this candidate."""
        outputs = self.outputs(c)
        residuals = [r.velocity - y for r, y in zip(self.records, outputs, strict=True)]
        return adequacy.assess(
            residuals, self.sensitivities(c), self.inputs, outputs, fit_autoregression(residuals), self.controller is None
        )

    def report(
        self, best: Candidate, scored: list[Candidate], noise: Autoregression, found: list[_core.Trial], seed: int
    ) -> Identification:
        """Uncertainty, tests, mechanics, and everything the user sees."""
        model = best.model
        outputs = self.outputs(best)
        residuals = [r.velocity - y for r, y in zip(self.records, outputs, strict=True)]
        J = self.sensitivities(best)
        lengths = [len(r) for r in self.records]
        cov = covariance.covariance_of_factors(model, J, noise, lengths, best.at_bound)
        parameters = covariance.estimates(model, cov, best.at_bound)
        judged = adequacy.assess(residuals, J, self.inputs, outputs, noise, self.controller is None)
        mechanics = mechanics_from_model(model, covariance.usable_covariance(model, cov))
        error_sum = sum(float(e @ e) for e in residuals)
        mean = sum(float(r.velocity.sum()) for r in self.records) / self.samples
        spread = sum(float(np.sum((r.velocity - mean) ** 2)) for r in self.records)
        s = self.settings
        lowest = min((c.bic for c in scored), default=0.0)
        # Where every structure is contradicted a criterion that supposes one of them true ranks nothing.
        close = [] if judged.falsified else scored
        rivals = sorted(
            (
                Rival(c.model.p, c.model.q, c.bic - best.bic, c.model)
                for c in close
                if c.bic <= best.bic + MARGIN and (c.model.p, c.model.q) != (model.p, model.q)
            ),
            key=lambda r: r.delta_bic,
        )
        states = {r.digest: tuple(float(v) for v in x) for r, x in zip(self.records, self.states(best), strict=True) if len(x)}
        return Identification(
            model=model,
            controller=self.controller,
            parameters=parameters,
            mechanics=mechanics,
            fitness=s.error_weight**2 * error_sum + s.order_weight * (model.p + model.q),
            rmse=float(np.sqrt(error_sum / self.samples)),
            fit_percent=float(100.0 * (1.0 - np.sqrt(error_sum / spread))) if spread > 0.0 else float("nan"),
            rivals=tuple(rivals),
            structures=tuple(Structure(c.model.p, c.model.q, c.cost, c.bic - lowest) for c in scored),
            trials=tuple(self.outcome(t) for t in found),
            adequacy=judged,
            warnings=_warnings(
                judged,
                parameters,
                mechanics,
                rivals,
                model,
                lowest < best.bic - MARGIN,
                [n for r in self.records if (n := doubtful_start(r, self.controller))] if s.initial_state == "auto" else [],
            ),
            space=self.space,
            settings=s,
            seed=seed,
            seconds=0.0,
            samples=self.samples,
            digests=tuple(r.digest for r in self.records),
            initial_states=states,
            version=version(),
            records=tuple(self.records),
        )

    def outcome(self, trial: _core.Trial) -> TrialOutcome:
        """One trial for the report."""
        s = self.settings
        if s.species:
            top = min(trial.species, key=lambda f: s.error_weight**2 * f.cost + s.order_weight * (f.p + f.q))
            p, q = top.p, top.q
        else:
            model = _core.decode(
                words=trial.best, ranges=self.ranges, gray=s.code == "gray", logarithmic=s.scale == "logarithmic"
            )
            p, q = len(model[1]) - len(model[2]), len(model[2])
        return TrialOutcome(
            p, q, trial.best_fitness, len(trial.history), trial.best_generation, trial.evaluations, tuple(trial.history.tolist())
        )


def _warnings(
    judged: adequacy.Adequacy,
    parameters: dict[str, covariance.Estimate],
    mechanics: OneMass | TwoMass | None,
    rivals: Sequence[Rival],
    model: Model,
    larger_fits_better: bool,
    started: Sequence[str],
) -> tuple[str, ...]:
    notes = list(started)
    if judged.falsified or judged.undecided:
        notes.append(judged.sentence)
    if judged.falsified and larger_fits_better:
        notes.append(
            "Larger structures come closer, but only by absorbing what no linear structure holds; the smallest mechanism "
            f"is reported, ({model.p},{model.q})."
        )
    bound = [n for n, e in parameters.items() if e.at_bound]
    if bound:
        notes.append(f"At a bound of the search range: {', '.join(bound)}. Widen the space, or doubt the structure.")
    unknown = [n for n, e in parameters.items() if not e.at_bound and not e.identifiable]
    if unknown:
        notes.append(f"Not identifiable from this data (standard deviation as large as the value): {', '.join(unknown)}.")
    if rivals:
        names = ", ".join(f"({r.p},{r.q})" for r in rivals)
        notes.append(f"Structures within {MARGIN:.0f} BIC units of ({model.p},{model.q}): {names}; the smallest is reported.")
    if mechanics is not None:
        notes.extend(_shaft_notes(mechanics))
        notes.extend(mechanics.notes)
    return tuple(notes)


def _shaft_notes(mechanics: OneMass | TwoMass) -> list[str]:
    """A sentence where the six numbers of a two-mass model contradict a shaft without damping by more than three deviations."""
    std = mechanics.std.get("inconsistency", 0.0)
    found = mechanics.inconsistency or 0.0
    if not isinstance(mechanics, TwoMass) or not std > 0.0 or found < 3.0 * std:
        return []
    damped = mechanics.with_shaft_damping
    remedy = "an effect that the model lacks bends them; trust neither"
    if damped is not None and damped.physical:
        remedy = (
            f"use mechanics.with_shaft_damping (JM = {damped.JM:.4g}, JL = {damped.JL:.4g}, KG = {damped.KG:.4g}, "
            f"DG = {damped.DG:.3g}), or look for an effect that the model lacks"
        )
    return [f"The mechanics without shaft damping contradict the model by {100 * found:.2g} +- {100 * std:.2g} %: {remedy}."]


def _checked_records(rec: Record | Sequence[Record], controller: PI | None) -> list[Record]:
    records = [rec] if isinstance(rec, Record) else list(rec) if isinstance(rec, Sequence) else None
    if not records or not all(isinstance(r, Record) for r in records):
        raise RecordError(f"rec is {type(rec).__name__}: give a gaident.Record or a list of them, at least one")
    if controller is not None and not isinstance(controller, PI):
        raise SettingsError(f"controller is {controller!r}: give a gaident.PI, or None for open loop")
    for i, r in enumerate(records):
        where = f"record {i} ({r.name})" if r.name else f"record {i}"
        if controller is not None and r.command is None:
            raise RecordError(
                f"{where} has no command, which drives the loop with a controller: give Record(command=...), or "
                "controller=None to identify from torque to velocity"
            )
        if controller is None and r.torque is None:
            raise RecordError(
                f"{where} has no torque, which drives the model in open loop: give Record(torque=...), or "
                "controller=PI(...) to identify in closed loop"
            )
    seen: dict[str, str] = {}
    for i, r in enumerate(records):
        where = f"record {i} ({r.name})" if r.name else f"record {i}"
        if r.digest in seen:
            raise RecordError(
                f"{where} holds the same data as {seen[r.digest]}: counted twice it would halve every variance; leave one out"
            )
        seen[r.digest] = where
    return records


def _checked_space(space: SearchSpace, controller: PI | None) -> SearchSpace:
    if not isinstance(space, SearchSpace):
        raise SpaceError(f"space is {space!r}: give a gaident.SearchSpace, or None to derive it from the data")
    if (controller is None or controller.loop == "sampled") and space.p[0] < 1:
        if space.p[1] < 1:
            raise SpaceError(
                f"p is {space.p!r}: with a held torque the plant needs at least one pole more than zeros; "
                "use p=(1, 3), or PI(..., loop='continuous')"
            )
        return replace(space, p=(1, space.p[1]))
    return space


def _input(r: Record, controller: PI | None) -> Vector:
    source = r.torque if controller is None else r.command
    assert source is not None  # checked on entry
    return source


def _processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
