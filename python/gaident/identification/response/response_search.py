"""identify() of frequency responses alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.control import core
from gaident.data.frequency.response import FrequencyResponse
from gaident.errors import RecordError, SettingsError, SpaceError
from gaident.estimation.criterion import bic
from gaident.identification import covariance, selection
from gaident.identification.noise import Autoregression
from gaident.identification.response.path import NO_PATH, Path, Together, fitted, is_start, lags_after, starts, with_lag
from gaident.identification.response.response_notes import GIVES_POWER, NO_STD, compared_notes, path_note, tail_notes
from gaident.identification.response.weighed import assessed_responses, weighed
from gaident.identification.selection import Candidate
from gaident.identification.structure_search import FINAL_TOLERANCE, PERCENT, Assessed, ProgressCallback, StructureSearch
from gaident.models.model import Model
from gaident.models.search_space import SearchSpace
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.settings import Settings

__all__ = ["ResponseSearch", "distinct_responses", "response_space", "told_of"]

Matrix = NDArray[np.float64]

DIGITS = 1e-7  # no decision: rounding: of a value that is written with seven digits
MOST_LINES = 600  # no decision: memory and time: frequencies of a response, where a path is looked for
ABOVE = 4.0  # no decision: a start: a range to search, times the highest frequency
MOST = 0.5  # no decision: a formula: more than half
GIVEN = 0.1  # no decision: rounding: of |G|, by which errors of a response make a real part negative


def distinct_responses(responses: Sequence[FrequencyResponse]) -> list[FrequencyResponse]:
    """The responses in an order of their own, for sums must not depend on the one given; a RecordError where two are the same."""
    ordered = sorted(responses, key=lambda r: (r.digest, r.name))
    for one, next_one in pairwise(ordered):
        if one.digest == next_one.digest:
            raise RecordError(
                "two frequency responses contain the same data: counted twice they halve every variance; leave one out"
            )
    return ordered


def response_space(responses: Sequence[FrequencyResponse]) -> SearchSpace:
    """Search ranges of responses: K about |G| omega, which a rigid axis has all along, roots where the frequencies lie and above.

    K from thirty times less to a thousand times more, as of records.
    A resonance above the frequencies bends the response below it, by which it is found where the errors are small; behind a hold
    none lies above half the sampling frequency.
    """
    found = np.concatenate([np.abs(r.velocity_response) * r.omega for r in responses])
    low, high = min(float(r.omega[0]) for r in responses), max(float(r.omega[-1]) for r in responses)
    middle = float(np.median(found))
    held = max(math.inf if r.dt is None else math.pi / r.dt for r in responses)
    return SearchSpace(
        gain=(middle / 30.0, middle * 1000.0),
        real=(-0.1 * low, 10.0 * high),  # no decision: a start: a range to search
        imaginary=(0.1 * low, min(ABOVE * high, held)),
        p=(1, 3),
        q=(0, 4),  # no decision: a start: up to three masses
        source=f"derived from the responses: K about {middle:.4g}, {low / math.tau:.4g} to {high / math.tau:.4g} Hz",
    )


def told_of(responses: Sequence[FrequencyResponse]) -> dict[str, Any]:
    """What an `Identification` says of its responses."""
    return {
        "frequencies": sum(len(r) for r in responses),
        "unseen_above": max((float(r.frequency_hz[-1]) for r in responses), default=None),
        "response_digests": tuple(r.digest for r in responses),
        "responses": tuple(responses),
    }


def _thinned(r: FrequencyResponse) -> FrequencyResponse:
    """Every so many frequencies of a long response."""
    every = 1 + len(r) // MOST_LINES
    if every == 1:
        return r
    std, coherence = (None if a is None else a[::every] for a in (r.std, r.coherence))
    return FrequencyResponse(r.frequency_hz[::every], r.response[::every], std, coherence, r.kind, dt=r.dt)


@dataclass(frozen=True)
class _Behind:
    """A chain of masses behind a path. rival: another path with as many unknowns that fits as well."""

    together: Together
    fit: Candidate
    holds: bool
    rival: Path | None = None

    @property
    def path(self) -> Path:
        return self.together.path

    @property
    def q(self) -> int:
        return self.fit.q

    @property
    def bic(self) -> float:
        return self.fit.bic

    @property
    def size(self) -> int:
        return self.fit.size + len(self.path.unknowns)


def _simplest(found: Sequence[_Behind]) -> _Behind:
    """The smallest within the margin of the least BIC, as among structures."""
    least = min(one.bic for one in found)
    close = sorted((one for one in found if one.bic <= least + POLICY.rival_margin), key=lambda one: (one.size, one.bic))
    best = close[0]
    others = [one.path for one in close if one.size == best.size and one.q == best.q and one.path.unknowns != best.path.unknowns]
    return replace(best, rival=others[0]) if others else best


class ResponseSearch(StructureSearch):
    """The search for the model behind frequency responses.

    path, together  what lies in front of the axis, and with the axis as they were fitted last
    """

    path: Path
    together: Together | None

    def __init__(self, responses: Sequence[FrequencyResponse], space: SearchSpace, settings: Settings, workers: int) -> None:
        if settings.arithmetic != "double":
            raise SettingsError(
                f"settings.arithmetic is {settings.arithmetic!r}: frequency responses are searched in double only; leave it out"
            )
        self.controller, self.space, self.settings, self.workers = None, space, settings, workers
        self.responses = list(responses)
        self.count = self.searched_count = 2 * sum(len(r) for r in self.responses)
        self.runs = 1, 0
        self.rival: Path | None = None
        self._behind(NO_PATH)

    def _behind(self, path: Path, axis: Model | None = None) -> None:
        """Take out a path of the torque; axis: what lies behind it, where a response has a hold."""
        self.path, self.together = path, None
        parts = weighed(self.responses, continuous=False, scale=1.0)
        self.parts = [replace(w, turned=path.inverse(w.response, axis)) for w in parts] if path.unknowns else parts
        self.experiment = self.searched = core.experiment([], None, 1.0, responses=[p.core() for p in self.parts])

    def search(self, trials: int, seed: int, progress: ProgressCallback | None) -> list[_core.Trial]:
        """See `StructureSearch`."""
        self.runs = trials, seed
        return super().search(trials, seed, progress)

    def select(self, found: list[_core.Trial]) -> tuple[Assessed, list[Candidate]]:
        """See `StructureSearch`; where no chain of masses holds, one behind a delay and a lag is looked for."""
        best, scores = super().select(found)
        if not scores:
            return best, scores
        # A chain behind a path is smaller than what makes up for one: it wins within the margin, as the smallest does.
        enough = min(c.bic for c in scores) + POLICY.rival_margin
        if best.candidate.bic <= enough and self.holds(best.candidate):
            return best, scores
        behind = self._best_path(enough)
        if behind is None or not behind.holds:
            self._refuse_other_signs()
        if behind is None:
            return best, scores
        self._behind(behind.path, behind.fit.model)
        found[:] = super().search(*self.runs, None)
        best, scores = super().select(found)
        self.rival = behind.rival
        done = self._with_path(behind.path, best.candidate, final=True) or self._behind_again(behind.together)
        return self.assessed(replace(done.fit, bic=best.candidate.bic)), scores

    def holds(self, c: Candidate) -> bool:
        """Whether a candidate is a chain of masses that the data do not contradict.

        A chain that is driven and measured at the motor takes power at every frequency: Re G(j omega) >= 0.
        """
        return selection.is_chain(c) and not self.gives_power(c) and not self.assessed(c).adequacy.falsified

    def gives_power(self, c: Candidate) -> bool:
        """Whether a model has a real part below 0 in the band, more than errors make one."""
        g = c.model.mechanism.frequency_response(np.concatenate([r.omega for r in self.responses]))
        return bool(np.any(g.real < -GIVEN * np.abs(g)))

    def _refuse_other_signs(self) -> None:
        """Raises SpaceError where a chain of masses holds once the response's sign, or that of its phase, is another one."""
        held: list[tuple[float, str]] = []
        for turned, what in (
            (
                np.negative,
                "has the opposite sign: the velocity falls where the torque rises; give -response (scale=-1 of read_response)",
            ),
            (np.conj, "counts its phase the other way: a lag is positive in it; give the conjugate, numpy.conj(response)"),
        ):
            made = [
                FrequencyResponse(r.frequency_hz, turned(r.response), r.std, r.coherence, r.kind, dt=r.dt) for r in self.responses
            ]
            work = ResponseSearch(made, self.space, self.settings, self.workers)
            best, scores = super(ResponseSearch, work).select(work.search(*self.runs, None))
            late: Candidate | None = best.candidate
            if not work.holds(best.candidate):
                # The phase of an axis behind a path falls below 0 at most frequencies.
                lags = np.mean([np.mean(r.velocity_response.imag < 0.0) for r in made]) > MOST
                path = work._best_path(min(c.bic for c in scores) + POLICY.rival_margin) if lags else None
                late = path.fit if path is not None and path.holds else None
            if late is not None:
                held.append((late.cost, what))
        if held:
            raise SpaceError(f"the response {min(held)[1]}")

    def _best_path(self, less_than: float) -> _Behind | None:
        """The first chain of masses that holds behind a path, or a better one that is larger; else that of the least BIC.

        None: none is below `less_than`.
        """
        few = [_thinned(r) for r in self.responses]
        work, whole = (ResponseSearch(of, self.space, self.settings, self.workers) for of in (few, self.responses))
        begin = starts(self._highest)
        least: dict[int, _Behind] = {}  # of each chain of masses
        while begin:
            better: list[_Behind] = []
            for found in work._chains_behind(begin.pop(0)):
                one = whole._with_path(found.path, found.fit, final=True)
                if one is None or one.bic >= less_than:
                    continue
                one = replace(one, rival=found.rival)
                if one.holds:
                    return whole._largest(work, one)
                if one.q not in least or one.bic < least[one.q].bic - POLICY.rival_margin:
                    least[one.q] = one
                    better.append(one)
            # Behind a better path the structures are searched anew: from a wrong one the larger do not find their way.
            begin[:0] = [one.path for one in sorted(better, key=lambda one: one.bic)]
        return min(least.values(), key=lambda one: one.bic, default=None)

    def _largest(self, work: ResponseSearch, best: _Behind) -> _Behind:
        """A larger chain behind the path of one that holds, where its BIC is lower by the margin, else that one."""
        for found in work._chains_behind(best.path, best.q + 1):
            one = self._with_path(found.path, found.fit, final=True)
            if one is not None and one.holds and one.bic < best.bic - POLICY.rival_margin:
                return self._largest(work, replace(one, rival=found.rival))
        return best

    def _chains_behind(self, begin: Path, q: int = 0) -> Iterator[_Behind]:
        """Each chain of masses behind the simplest path that fits it as well as any, from a path on, the smallest chain first.

        q: zeros that it has at least.
        """
        self._behind(begin)
        scores = super().select(self.search(*self.runs, None))[1]
        chains = {c.q: c for c in scores if selection.is_chain(c) and c.q >= q}
        lagged = {c.q: c for c in scores if c.p == 2}
        for q in sorted(chains):
            fits: list[_Behind | None] = []
            if begin.unknowns:
                late = self._with_path(Path(begin.total), chains[q])
                total, start = (begin.total, chains[q]) if late is None else (late.path.total, late.fit)
                fits += [late, *(self._with_path(path, start) for path in with_lag(total))]
            if q in lagged:
                self._behind(begin)
                more = [self._with_path(path, c) for path, c in self._of_a_pole(begin, lagged[q])]
                totals = [(fit.path.total, fit.fit) for fit in more if fit is not None]
                fits += [*more, *(self._with_path(Path(t), c) for t, c in totals if is_start(t, self._highest))]
            found = [fit for fit in fits if fit is not None]
            if found:
                yield _simplest(found)

    def _of_a_pole(self, begin: Path, c: Candidate) -> list[tuple[Path, Candidate]]:
        """Chains of masses behind a lag that was a pole of a structure: the fastest real one."""
        model = c.model
        reals = [r for r in model.poles if r.imag == 0.0 and r.real < 0.0]
        if not reals:
            return []
        pole = min(reals, key=lambda r: r.real)
        poles = list(model.poles)
        poles.remove(pole)
        lag = -1.0 / pole.real
        start = model.gain * lag, np.array(poles, complex), np.array(model.zeros, complex), np.zeros(0)
        chain = Candidate(self.experiment.refine([start], self.ranges, [], 0, 1)[0])
        return [(path, chain) for path in lags_after(begin.delay, lag, self._highest)]

    @property
    def _highest(self) -> float:
        return max(float(r.omega[-1]) for r in self.responses)

    def _with_path(self, path: Path, c: Candidate, final: bool = False) -> _Behind | None:
        """Path and chain of masses fitted together, from a path on, which is taken out then; None: there is no such path."""
        together = fitted(self.parts, c.model, path, FINAL_TOLERANCE if final else selection.tolerance(self.count))
        return None if together is None else self._behind_again(together)

    def _behind_again(self, together: Together) -> _Behind:
        """What was fitted together, as a candidate behind its path."""
        self._behind(together.path, together.axis)
        self.together = together
        axis = together.axis
        start = axis.gain, np.array(axis.poles, complex), np.array(axis.zeros, complex), np.zeros(0)
        c = Candidate(self.experiment.refine([start], self.ranges, [], 0, 1)[0])
        (scored,) = self.scored([c], self.noise_of(c))
        return _Behind(together, scored, self.holds(scored))

    def reported(self, model: Model) -> Model:
        """See `StructureSearch`: behind the path."""
        return self.path.behind(model)

    def spread(self, best: Assessed, of_model: Matrix | None) -> Matrix | None:
        """See `StructureSearch`: with the path's unknowns."""
        return of_model if self.together is None else self.together.covariance(best.noise_std)

    @property
    def rounding(self) -> float:
        """The error sum that a value's last digits make: what is less is rounding, which no structure explains."""
        return DIGITS**2 * sum(float(np.sum(np.abs(p.weight * p.value) ** 2)) for p in self.parts)

    def noise_of(self, c: Candidate, in_part: bool = False) -> Autoregression:
        """White: the errors are weighed."""
        return Autoregression(np.zeros(0), math.sqrt(c.cost / self.count))

    def scored(self, candidates: Sequence[Candidate], noise: Autoregression, in_part: bool = False) -> list[Candidate]:
        """See `StructureSearch`."""
        costs = [c.cost if c.cost > self.rounding else self.rounding for c in candidates]
        return [
            selection.charged(c, bic(cost / self.count, self.count, c.size + len(self.path.unknowns)))
            for c, cost in zip(candidates, costs, strict=True)
        ]

    def assessed(self, c: Candidate) -> Assessed:
        """See `StructureSearch`; deviations are those that are stated, or larger where what is left is."""
        plain = self.experiment.fit_sums(c.fit, [], [], 0.0)[0]
        if self.together is not None:
            plain = self.together.freed(covariance.core_layout(self.together.axis)[0])
        verdict = assessed_responses(self.parts, c.model, c.size + len(self.path.unknowns))
        verdict = replace(verdict, falsified=verdict.falsified and c.cost > self.rounding)
        known = all(p.known for p in self.parts)
        std = max(1.0, verdict.noise_std) if known else verdict.noise_std
        return Assessed(c, c.cost, std, plain, plain, verdict)

    def of_data(self, best: Assessed) -> dict[str, Any]:
        """See `StructureSearch`; rmse is that of the relative error."""
        model = best.candidate.model
        errors = [p.errors(model) / p.weight for p in self.parts]
        relative = np.concatenate([np.abs(e) / np.abs(p.value) for e, p in zip(errors, self.parts, strict=True)])
        size = sum(float(np.sum(np.abs(p.weight * p.value) ** 2)) for p in self.parts)
        return {
            "rmse": float(np.sqrt(np.mean(relative**2))),
            "fit_percent": PERCENT * (1.0 - math.sqrt(best.error_sum / size)),
            "samples": 0,
            "digests": (),
            "initial_states": {},
            **self.found_path(best),
            **told_of(self.responses),
        }

    def found_path(self, best: Assessed) -> dict[str, Estimate]:
        """Delay and lag of the path with their deviations, where there are any."""
        if self.together is None:
            return {}
        values, spread = self.path.values, self.together.covariance(best.noise_std)
        std = np.full(len(values), math.inf) if spread is None else np.sqrt(np.diag(spread)[-len(values) :])
        made = [Estimate(float(v), float(off), "s", False, bool(off < v)) for v, off in zip(values, std, strict=True)]
        return dict(zip(self.path.unknowns, made, strict=True))

    def notes(self, best: Assessed) -> Sequence[str]:
        """See `StructureSearch`."""
        found: list[str] = [note for r in self.responses for note in r.notes]
        if any(r.std is None for r in self.responses):
            found.append(NO_STD)
        if self.path.unknowns:
            found.append(path_note(self.found_path(best), self.rival))
        if selection.is_chain(best.candidate) and self.gives_power(best.candidate):
            found.append(GIVES_POWER)
        found += tail_notes(best.candidate.model, self._highest)
        return list(dict.fromkeys(found)) + compared_notes(self.responses)
