"""The search of an identification: genetic runs, the comparison of the structures, and the report of the best one.

What was measured, records or frequency responses, is the subclass's: `RecordSearch`, `ResponseSearch`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.control.controller import Controller
from gaident.errors import SpaceError
from gaident.identification import covariance, selection
from gaident.identification.noise import Autoregression
from gaident.identification.notes import warnings_of
from gaident.identification.selection import Candidate
from gaident.messages import Message
from gaident.models.mechanics import mechanics_from_model
from gaident.models.model import Model
from gaident.models.search_space import SearchSpace
from gaident.policy.table import POLICY
from gaident.results.adequacy import Adequacy
from gaident.results.identification import Identification
from gaident.results.settings import Settings
from gaident.results.structures import Rival, Structure, TrialOutcome
from gaident.version import version

__all__ = ["FINAL_TOLERANCE", "PERCENT", "Assessed", "ProgressCallback", "StructureSearch"]

Vector = NDArray[np.float64]
ProgressCallback = Callable[[float, str], None]

FINAL_TOLERANCE = 1e-9  # no decision: of a solver
PERCENT = 100.0  # no decision: a unit


@dataclass(frozen=True)
class Assessed:
    """A fit with what its residual says about it."""

    candidate: Candidate
    error_sum: float
    noise_std: float  # of the whitened residual
    plain: Vector  # J'J
    coloured: Vector  # J'S J
    adequacy: Adequacy


class StructureSearch(ABC):
    """One identification on its way.

    experiment  what candidates are held against; searched: a part of it, for the genetic search, where in_parts
    count, searched_count  numbers that were measured in them
    """

    controller: Controller | None
    space: SearchSpace
    settings: Settings
    workers: int

    experiment: _core.Experiment
    searched: _core.Experiment
    in_parts: bool = False
    count: int
    searched_count: int

    @property
    def ranges(self) -> _core.SearchRanges:
        """The search ranges for the core."""
        return self.space.ranges(paper=not self.settings.species and self.settings.scale == "linear")

    @abstractmethod
    def noise_of(self, c: Candidate, in_part: bool = False) -> Autoregression:
        """The noise model of a candidate's residual; in_part: on what was searched."""

    @abstractmethod
    def scored(self, candidates: Sequence[Candidate], noise: Autoregression, in_part: bool = False) -> list[Candidate]:
        """The candidates with their BIC under a common noise model."""

    @abstractmethod
    def assessed(self, c: Candidate) -> Assessed:
        """Whether the data contradict this candidate, and the sums its uncertainty is made of."""

    @abstractmethod
    def of_data(self, best: Assessed) -> dict[str, Any]:
        """What the report says of the data: rmse, fit_percent, samples, digests, initial_states, records, responses."""

    @abstractmethod
    def notes(self, best: Assessed) -> Sequence[str]:
        """What is doubtful about the data themselves, and about the model for such data."""

    def reported(self, model: Model) -> Model:
        """What the result says of a model of the search."""
        return model

    def spread(self, best: Assessed, of_model: Vector | None) -> Vector | None:
        """Covariance of what the reported model has, from that of the model of the search."""
        return of_model

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

    def select(self, found: list[_core.Trial]) -> tuple[Assessed, list[Candidate]]:
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
        return self.compared(candidates, others)

    def compared(self, candidates: list[Candidate], others: list[Candidate]) -> tuple[Assessed, list[Candidate]]:
        """The winner among fits, and all of them with their BIC; others: of them chains, where it is contradicted."""
        noise = self.noise_of(min(candidates, key=lambda c: c.cost))
        scores = self.scored(candidates, noise)
        winner = selection.smallest_close(scores)
        best = self.assessed(self.refined(scores[winner]))
        if best.adequacy.falsified:
            scores += self.scored(self.on_all_samples([c for c in others if selection.is_chain(c)]), noise)
            chain = selection.smallest_mechanism(scores, self.count)
            best = best if chain is None or chain == winner else self.assessed(self.refined(scores[chain]))
        return best, scores

    def within_reach(self, candidates: list[Candidate]) -> tuple[list[Candidate], list[Candidate]]:
        """(what may win on all samples, the rest) by the comparison on the parts that were searched."""
        noise = self.noise_of(min(candidates, key=lambda c: c.cost), in_part=True)
        scores = self.scored(candidates, noise, in_part=True)
        best = min(c.bic for c in scores)
        near = [c.bic <= best + math.log(POLICY.part_reach) * self.searched_count for c in scores]
        return [c for c, n in zip(candidates, near, strict=True) if n], [
            c for c, n in zip(candidates, near, strict=True) if not n
        ]

    def on_all_samples(self, candidates: list[Candidate]) -> list[Candidate]:
        """Fits of the parts, fitted to all samples; the start states of the whole records are other ones."""
        starts = [(*c.as_start()[:3], np.zeros(0)) for c in candidates]  # no decision: the first numbers of a start
        tolerance = selection.tolerance(self.count)
        fits = self.experiment.refine(starts, self.ranges, [], POLICY.whole_record, self.workers, tolerance)
        return [Candidate(f) for f in fits if f.cost < 1e300]

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

    def report(self, best: Assessed, scored: list[Candidate], found: list[_core.Trial], seed: int) -> Identification:
        """Uncertainty, mechanics, and everything the user sees."""
        model, verdict, error_sum, bic = best.candidate.model, best.adequacy, best.error_sum, best.candidate.bic
        at_bound = best.candidate.at_bound
        cov = covariance.covariance_of_factors(model, best.plain, best.coloured, best.noise_std, at_bound)
        parameters = covariance.estimates(model, cov, at_bound)
        usable = covariance.usable_covariance(model, cov)
        mechanics = mechanics_from_model(model, usable)
        s = self.settings
        lowest = min((c.bic for c in scored), default=0.0)
        # Where every structure is contradicted a criterion that supposes one of them true ranks nothing.
        closer = lowest < bic - POLICY.rival_margin  # the reported one is the smallest mechanism
        close = [] if verdict.falsified or closer else scored
        close = [c for c in close if c.bic <= bic + POLICY.rival_margin and (c.p, c.q) != (model.p, model.q)]
        rivals = sorted((Rival(c.p, c.q, c.bic - bic, self.reported(c.model)) for c in close), key=lambda r: r.delta_bic)
        spread = self.spread(best, usable)
        return Identification(
            model=self.reported(model),
            controller=self.controller,
            parameters=parameters,
            mechanics=mechanics,
            fitness=s.error_weight**2 * error_sum + s.order_weight * (model.p + model.q),
            rivals=tuple(rivals),
            structures=tuple(Structure(c.p, c.q, c.cost, c.bic - lowest) for c in scored),
            trials=tuple(self.outcome(t) for t in found),
            adequacy=verdict,
            warnings=warnings_of(verdict, parameters, mechanics, rivals, model, closer, self.notes(best)),
            space=self.space,
            settings=s,
            seed=seed,
            seconds=0.0,
            covariance=None if spread is None else tuple(tuple(map(float, row)) for row in spread),
            version=version(),
            **self.of_data(best),
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
