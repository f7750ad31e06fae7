"""identify(): from records to structure and parameters."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.control import core
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.control.simplest import simplest
from gaident.data.record import Record
from gaident.errors import SettingsError, SpaceError
from gaident.identification import adequacy, covariance, selection
from gaident.identification.arguments import check_arithmetic, check_numbers, checked_records, checked_space, distinct
from gaident.identification.closed_loop import input_of, looped_over, space_of
from gaident.identification.controller_numbers import with_estimates
from gaident.identification.noise import Autoregression, autoregression_of, highest_order
from gaident.identification.notes import record_notes, unseen_notes, warnings_of
from gaident.identification.parts import search_parts
from gaident.identification.replay.notes import replay_notes
from gaident.identification.replay.timed_record import plain_of
from gaident.identification.selection import Candidate
from gaident.messages import Message
from gaident.models.drive_torque import as_differenced, without_age
from gaident.models.mechanics import mechanics_from_model
from gaident.models.model import Model
from gaident.models.search_space import SearchSpace
from gaident.models.starts import noise_std, starts_moving
from gaident.policy.table import POLICY
from gaident.processors import processors
from gaident.results.adequacy import Adequacy
from gaident.results.identification import Identification
from gaident.results.settings import Settings
from gaident.results.structures import Rival, Structure, TrialOutcome
from gaident.version import version

__all__ = ["identify"]

Vector = NDArray[np.float64]
ProgressCallback = Callable[[float, str], None]

FINAL_TOLERANCE = 1e-9  # no decision: of a solver


def identify(
    rec: Record | Sequence[Record],
    controller: Controller | None = None,
    space: SearchSpace | None = None,
    settings: Settings | None = None,
    trials: int = 1,
    seed: int = 0,
    workers: int | None = None,
    progress: ProgressCallback | None = None,
) -> Identification:
    """Find structure (p, q) and parameters of the model behind one or several records.

    A genetic search per structure with local fits; the structures are compared by the BIC of whitened errors.
    See docs/identification.md.

    Parameters
    ----------
    rec : Record or sequence of Record
        The data; one model for all, each record with its own initial state.
    controller : PI or Cascade, optional
        The velocity loop, driven by the record's command; None: open loop, the record's torque drives the model.
        Under a linear Cascade that is faster than the log, and starts at rest, the command drives the loop as well.
        Under any other Cascade the torque drives the model: as logged, or as this controller makes it.
        Its numbers that are None are estimated first, from the logged torque.
    space : SearchSpace, optional
        Search ranges; None: derived from the data, see `Identification.space`.
    settings : Settings, optional
        Settings of the search; None: `Settings()`.
    trials : int
        Independent genetic runs; the best of each structure is kept.
    seed : int
        Seed of the random numbers; the same seed gives the same result.
    workers : int, optional
        Threads; None: as many as the machine has. The result does not depend on it, nor on the order of records.
    progress : callable, optional
        Called now and then with (fraction done, message), see `gaident.progress`. Ctrl-C raises KeyboardInterrupt within 0.2 s.

    Returns
    -------
    Identification
        Model, parameters with standard deviations, and what they are worth.
        Bad luck is data: see `warnings`, `adequacy`, `rivals` and the flags of `parameters`.

    Raises
    ------
    GaidentError
        Names the argument, its value and the remedy.

    See Also
    --------
    diagnose : What the model misses, and why.

    References
    ----------
    The paper of docs/paper.md (the genetic search).
    G. Schwarz, "Estimating the dimension of a model", Annals of Statistics 6, 1978 (the BIC).

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> torque = np.repeat([1.0, -1.0, 0.5, -0.5], 100)
    >>> noise = 0.02 * np.random.default_rng(1).standard_normal(400)
    >>> drive = ga.OneMass(J=0.01, D=0.05)
    >>> still = ga.Record(1e-3, torque=torque, velocity=0.0 * torque)
    >>> rec = ga.Record(1e-3, torque=torque, velocity=ga.simulate(drive, still) + noise)
    >>> idn = ga.identify(rec, seed=1)
    >>> idn.p, idn.q, round(idn.mechanics.J, 3), round(idn.mechanics.D, 2), idn.falsified
    (1, 0, 0.01, 0.05, False)
    """
    began = time.perf_counter()
    recorded = checked_records(rec, controller)
    # A simulated loop knows no age of a velocity.
    checked = [as_differenced(r, controller) if bare_pi(controller) is None else without_age(r) for r in recorded]
    numbers = with_estimates(checked, controller).trusted()
    settings = Settings() if settings is None else settings
    if not isinstance(settings, Settings):
        raise SettingsError(f"settings is {settings!r}: give a gaident.Settings")
    looped = looped_over(checked, simplest(numbers.controller, (r.dt for r in checked)), space, settings.initial_state != "free")
    given, loop = looped.records, looped.controller
    check_numbers(trials, seed, workers, progress)
    check_arithmetic(settings, loop)
    threads = processors() if workers is None else int(workers)
    digests = distinct(given)
    # Sums must not depend on the order given.
    order = sorted(range(len(given)), key=lambda i: (digests[i], given[i].name))
    records, digests = [given[i] for i in order], [digests[i] for i in order]
    derived = space is None
    space = checked_space(space_of(records, loop) if space is None else space, loop)

    moving = [settings.initial_state == "free" or (settings.initial_state == "auto" and starts_moving(r, loop)) for r in records]
    work = _Work(records, digests, loop, space, settings, moving, threads)
    found = work.search(int(trials), int(seed), progress)
    best, scored = work.select(found)
    result = work.report(best, scored, found, int(seed))
    warnings = [*replay_notes(checked, controller), *numbers.notes, *looped.notes, *result.warnings]
    warnings += unseen_notes(result.mechanics, given[0].dt)
    if derived and not settings.species:
        warnings.append(
            "Search ranges derived from the data are wide; the plain engine needs narrow ones: give the search space."
        )
    overflows = sum(t.overflows for t in found)
    if overflows:
        evaluations = sum(t.evaluations for t in found)
        warnings.append(
            f"In {settings.arithmetic} {overflows} of {evaluations} candidates left its range or diverged; they count as worst."
        )
    shown = {**numbers.estimates, **looped.estimates}
    return replace(result, warnings=tuple(warnings), controller_numbers=shown, seconds=time.perf_counter() - began)


@dataclass(frozen=True)
class _Assessed:
    """A fit with what its residual says about it."""

    candidate: Candidate
    error_sum: float
    noise: Autoregression
    plain: Vector  # J'J
    coloured: Vector  # J'S J
    adequacy: Adequacy


@dataclass
class _Work:
    """One identification on its way."""

    records: list[Record]
    digests: list[str]
    controller: Controller | None
    space: SearchSpace
    settings: Settings
    moving: list[bool]
    workers: int

    def __post_init__(self) -> None:
        self.lengths = [len(r) for r in self.records]
        self.samples = sum(self.lengths)
        self.ranges = self.space.ranges(paper=not self.settings.species and self.settings.scale == "linear")
        whole = list(zip(self.records, self.moving, strict=True))
        self.experiment = self.experiment_of(whole)
        # A long record is searched in part, and what is found fitted to all of it.
        # The middle of a record has no start at rest, which a cascade needs.
        c = self.controller
        parts = whole
        if self.settings.species and (c is None or c.one_equation):
            parts = search_parts(self.records, bare_pi(c), self.moving)
        self.in_parts = sum(len(r) for r, _ in parts) < self.samples
        self.search_lengths = [len(r) for r, _ in parts]
        self.searched = self.experiment_of(parts) if self.in_parts else self.experiment

    def experiment_of(self, parts: Sequence[tuple[Record, bool]]) -> _core.Experiment:
        """The core's view of (record, whether it starts in motion)."""
        c = self.controller
        dt = parts[0][0].dt
        if c is not None and not c.one_equation:
            return core.experiment([c.line_record(r) for r, _ in parts], c, dt)
        rows = [
            # no decision: a start
            core.record(r.dt, input_of(r, c), r.velocity, "free" if moving else "rest", float(r.velocity[:3].mean()))
            for r, moving in parts
        ]
        return core.experiment(rows, c, dt)

    def search(self, trials: int, seed: int, progress: ProgressCallback | None) -> list[_core.Trial]:
        """The genetic runs."""
        total = trials * self.settings.generations
        usual = 4.0 * trials * self.settings.round  # species stop by themselves: the bar approaches its end

        def report(done: int, best: float, species: int, leading: tuple[int, int]) -> None:
            assert progress is not None
            fraction = done / (done + usual) if self.settings.species else done / total
            which = short = "" if species == 0 else f", {species} species"
            if species and leading[0] >= 0:
                which, short = f", species {leading} of {species} leads", f", ({leading[0]},{leading[1]}) of {species}"
            text = f"generation {done}, best fitness {best:.4g}{which}"
            progress(min(1.0, fraction), Message(text, f"gen. {done}, best {best:.4g}{short}"))

        return self.searched.search(
            ranges=self.ranges,
            settings=self.settings.engine_settings(),
            trials=trials,
            seed=seed,
            workers=self.workers,
            progress=None if progress is None else report,
        )

    def select(self, found: list[_core.Trial]) -> tuple[_Assessed, list[Candidate]]:
        """The winner, and all structures compared with their BIC (the plain engine compares none)."""
        if not self.settings.species:
            return self.assessed(self.plain_best(found)), []
        merged = [min((t.species[i] for t in found), key=lambda s: s.cost) for i in range(len(found[0].species))]
        candidates = [Candidate(s) for s in merged if s.cost < 1e300]
        if not candidates:
            raise SpaceError("space: every candidate diverged in it; widen the ranges, or leave space=None")
        others: list[Candidate] = []
        if self.in_parts:
            candidates, others = self.within_reach(candidates)
            candidates = self.on_all_samples(candidates)
        noise = selection.noise_of(self.experiment, min(candidates, key=lambda c: c.cost), self.lengths)
        scores = self.scored(candidates, noise)
        winner = selection.smallest_close(scores)
        best = self.assessed(self.refined(scores[winner]))
        if best.adequacy.falsified:
            scores += self.scored(self.on_all_samples([c for c in others if selection.is_chain(c)]), noise)
            chain = selection.smallest_mechanism(scores, self.samples)
            best = best if chain is None or chain == winner else self.assessed(self.refined(scores[chain]))
        return best, scores

    def within_reach(self, candidates: list[Candidate]) -> tuple[list[Candidate], list[Candidate]]:
        """(what may win on all samples, the rest) by the comparison on the parts that were searched."""
        noise = selection.noise_of(self.searched, min(candidates, key=lambda c: c.cost), self.search_lengths)
        scores = selection.scored(self.searched, candidates, noise, self.search_lengths, self.ranges, self.workers)
        best = min(c.bic for c in scores)
        near = [c.bic <= best + math.log(POLICY.part_reach) * sum(self.search_lengths) for c in scores]
        return [c for c, n in zip(candidates, near, strict=True) if n], [
            c for c, n in zip(candidates, near, strict=True) if not n
        ]

    def on_all_samples(self, candidates: list[Candidate]) -> list[Candidate]:
        """Fits of the parts, fitted to all samples; the start states of the whole records are other ones."""
        starts = [(*c.as_start()[:3], np.zeros(0)) for c in candidates]  # no decision: the first numbers of a start
        tolerance = selection.tolerance(self.samples)
        fits = self.experiment.refine(starts, self.ranges, [], POLICY.whole_record, self.workers, tolerance)
        return [Candidate(f) for f in fits if f.cost < 1e300]

    def scored(self, candidates: list[Candidate], noise: Autoregression) -> list[Candidate]:
        """The candidates with their BIC on all samples."""
        return selection.scored(self.experiment, candidates, noise, self.lengths, self.ranges, self.workers)

    def plain_best(self, found: list[_core.Trial]) -> Candidate:
        """The best candidate ever seen by the plain engine, without a local fit."""
        trial = min(found, key=lambda t: t.best_fitness)
        model = Model(*self.decoded(trial))
        # Only the start states that the search assumed (steady motion) and what stands at a bound.
        fits = self.experiment.refine(
            [(model.gain, np.array(model.poles, complex), np.array(model.zeros, complex), np.zeros(0))], self.ranges, [], 0, 1
        )
        return Candidate(fits[0])

    def decoded(self, trial: _core.Trial) -> tuple[float, NDArray[np.complex128], NDArray[np.complex128]]:
        """(gain, poles, zeros) of a trial's best chromosome."""
        s = self.settings
        return _core.decode(words=trial.best, ranges=self.ranges, gray=s.code == "gray", logarithmic=s.scale == "logarithmic")

    def refined(self, c: Candidate) -> Candidate:
        """The local fit taken to the end."""
        done = self.experiment.go_on([c.fit], self.ranges, [], POLICY.final, FINAL_TOLERANCE, 1)[0]
        best = Candidate(done if done.cost <= c.cost else c.fit, c.bic)
        # Once more without a step, from the roots in the order of Model: the core reports bounds in the order of its factors.
        return Candidate(self.experiment.refine([best.as_start()], self.ranges, [], 0, 1)[0], c.bic)

    def states(self, c: Candidate) -> list[Vector]:
        """Start state of each record; empty: at rest."""
        size = c.model.order + (self.controller is not None)
        states, at = [], 0
        for m in self.moving:
            n = size if m and len(c.starts) else 0
            states.append(c.starts[at : at + n])
            at += n
        return states

    def assessed(self, c: Candidate) -> _Assessed:
        """Whether the data contradict this candidate, and the sums its uncertainty is made of."""
        order = highest_order(self.lengths)
        products, largest = self.experiment.residual_sums(c.fit, max(order, adequacy.white_lags(self.lengths)))
        noise = autoregression_of(products[: order + 1], self.samples)
        lags = adequacy.regressor_lags(self.lengths, self.controller is None)
        plain, coloured, white = self.experiment.fit_sums(c.fit, noise.phi, lags, POLICY.no_direction * largest)
        sums = adequacy.Sums(products, white, len(plain), self.lengths, noise, self.quiet)
        return _Assessed(c, float(products[0]), noise, plain, coloured, adequacy.assess(sums))

    @cached_property
    def quiet(self) -> float:
        """Noise of the measured velocity as its third differences show it [rad/s]."""
        return math.sqrt(sum(len(r) * noise_std(r.velocity) ** 2 for r in self.records) / self.samples)

    def report(self, best: _Assessed, scored: list[Candidate], found: list[_core.Trial], seed: int) -> Identification:
        """Uncertainty, mechanics, and everything the user sees."""
        model, verdict, error_sum, bic = best.candidate.model, best.adequacy, best.error_sum, best.candidate.bic
        at_bound = best.candidate.at_bound
        cov = covariance.covariance_of_factors(model, best.plain, best.coloured, best.noise.std, at_bound)
        parameters = covariance.estimates(model, cov, at_bound)
        usable = covariance.usable_covariance(model, cov)
        mechanics = mechanics_from_model(model, usable)
        spread = _spread(self.records)
        s = self.settings
        lowest = min((c.bic for c in scored), default=0.0)
        # Where every structure is contradicted a criterion that supposes one of them true ranks nothing.
        closer = lowest < bic - POLICY.rival_margin  # the reported one is the smallest mechanism
        close = [] if verdict.falsified or closer else scored
        close = [c for c in close if c.bic <= bic + POLICY.rival_margin and (c.p, c.q) != (model.p, model.q)]
        rivals = sorted((Rival(c.p, c.q, c.bic - bic, c.model) for c in close), key=lambda r: r.delta_bic)
        notes = record_notes(self.records, self.controller, s.initial_state)
        states = {d: tuple(x.tolist()) for d, x in zip(self.digests, self.states(best.candidate), strict=True) if len(x)}
        return Identification(
            model=model,
            controller=self.controller,
            parameters=parameters,
            mechanics=mechanics,
            fitness=s.error_weight**2 * error_sum + s.order_weight * (model.p + model.q),
            rmse=float(np.sqrt(error_sum / self.samples)),
            fit_percent=float(100.0 * (1.0 - np.sqrt(error_sum / spread))) if spread > 0.0 else float("nan"),
            rivals=tuple(rivals),
            structures=tuple(Structure(c.p, c.q, c.cost, c.bic - lowest) for c in scored),
            trials=tuple(self.outcome(t) for t in found),
            adequacy=verdict,
            warnings=warnings_of(verdict, parameters, mechanics, rivals, model, closer, notes),
            space=self.space,
            settings=s,
            seed=seed,
            seconds=0.0,
            samples=self.samples,
            digests=tuple(self.digests),
            initial_states=states,
            covariance=None if usable is None else tuple(tuple(map(float, row)) for row in usable),
            version=version(),
            records=tuple(map(plain_of, self.records)),
        )

    def outcome(self, trial: _core.Trial) -> TrialOutcome:
        """One trial for the report."""
        s = self.settings
        if s.species:
            top = min(trial.species, key=lambda f: s.error_weight**2 * f.cost + s.order_weight * (f.p + f.q))
            p, q = top.p, top.q
        else:
            _, poles, zeros = self.decoded(trial)
            p, q = len(poles) - len(zeros), len(zeros)
        return TrialOutcome(
            p, q, trial.best_fitness, len(trial.history), trial.best_generation, trial.evaluations, tuple(trial.history.tolist())
        )


def _spread(records: Sequence[Record], block: int = 1 << 18) -> float:  # no decision: memory; samples of a block
    """Sum of squares of the velocity about its mean, a block at a time."""
    mean = sum(float(r.velocity.sum()) for r in records) / sum(len(r) for r in records)
    parts = (r.velocity[i : i + block] - mean for r in records for i in range(0, len(r), block))
    return sum(float(np.einsum("i,i", w, w)) for w in parts)  # in one thread, unlike w @ w
