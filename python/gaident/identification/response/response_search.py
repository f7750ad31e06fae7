"""identify() of frequency responses alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from gaident import _core
from gaident.axis import Text, say
from gaident.control import core
from gaident.data.frequency.response import FrequencyResponse
from gaident.errors import RecordError, SettingsError, SpaceError
from gaident.estimation.criterion import bic
from gaident.identification import selection
from gaident.identification.noise import Autoregression
from gaident.identification.response.path import LONGEST, NO_PATH, SMALL, STEPS, Path, Turned, freed, path_step, starts, with_lag
from gaident.identification.response.weighed import assessed_responses, weighed
from gaident.identification.selection import Candidate
from gaident.identification.structure_search import PERCENT, Assessed, ProgressCallback, StructureSearch
from gaident.models.search_space import SearchSpace
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.settings import Settings

__all__ = ["ResponseSearch", "distinct_responses", "response_space", "told_of"]


DIGITS = 1e-7  # no decision: rounding: of a value that is written with seven digits
MS = 1e3  # no decision: a unit: s to ms
MOST_LINES = 600  # no decision: memory and time: frequencies of a response, where a path is looked for
STANDS_OUT = 2.0  # no decision: which peak a sentence speaks of: one of twice the median
GIVES_POWER = (
    "The model gives power at some frequencies, which no chain of masses does that is driven and measured at the motor: take no "
    "mechanics from it. A sensor at the load would do that."
)
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
    """Search ranges of responses: K about |G| omega, which a rigid axis has all along, roots where the frequencies lie.

    From thirty times less to a thousand times more, as of records.
    """
    found = np.concatenate([np.abs(r.velocity_response) * r.omega for r in responses])
    low, high = min(float(r.omega[0]) for r in responses), max(float(r.omega[-1]) for r in responses)
    middle = float(np.median(found))
    return SearchSpace(
        gain=(middle / 30.0, middle * 1000.0),
        real=(-0.1 * low, 10.0 * high),  # no decision: a start: a range to search
        imaginary=(0.1 * low, high),  # no decision: a start: a range to search
        p=(1, 3),
        q=(0, 4),  # no decision: a start: up to three masses
        source=f"derived from the responses: K about {middle:.4g}, {low / math.tau:.4g} to {high / math.tau:.4g} Hz",
    )


def told_of(responses: Sequence[FrequencyResponse]) -> dict[str, Any]:
    """What an `Identification` says of its responses."""
    return {
        "frequencies": sum(len(r) for r in responses),
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


class ResponseSearch(StructureSearch):
    """The search for the model behind frequency responses."""

    def __init__(self, responses: Sequence[FrequencyResponse], space: SearchSpace, settings: Settings, workers: int) -> None:
        if settings.arithmetic != "double":
            raise SettingsError(
                f"settings.arithmetic is {settings.arithmetic!r}: frequency responses are searched in double only; leave it out"
            )
        self.controller, self.space, self.settings, self.workers = None, space, settings, workers
        self.responses = list(responses)
        self.count = self.searched_count = 2 * sum(len(r) for r in self.responses)
        self.runs = 1, 0
        self._behind(NO_PATH)

    def _behind(self, path: Path) -> None:
        """Take out a path of the torque."""
        self.path = path
        self.parts = [replace(w, path=path) for w in weighed(self.responses, continuous=False, scale=1.0)]
        self.experiment = self.searched = core.experiment([], None, 1.0, responses=[p.core() for p in self.parts])

    def search(self, trials: int, seed: int, progress: ProgressCallback | None) -> list[_core.Trial]:
        """See `StructureSearch`."""
        self.runs = trials, seed
        return super().search(trials, seed, progress)

    def select(self, found: list[_core.Trial]) -> tuple[Assessed, list[Candidate]]:
        """See `StructureSearch`; where no chain of masses holds, one behind a delay and a lag is looked for."""
        best, scores = super().select(found)
        if self.path.unknowns or not scores:
            return best, scores
        # A chain behind a path is smaller than what makes up for one: it wins within the margin, as the smallest does.
        enough = min(c.bic for c in scores) + POLICY.rival_margin
        if best.candidate.bic <= enough and self.holds(best.candidate):
            return best, scores
        path = self._best_path(enough)
        if path is None:
            self._refuse_other_signs()
            return best, scores
        self._behind(path)
        found[:] = super().search(*self.runs, None)
        return super().select(found)

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
            best = super(ResponseSearch, work).select(work.search(*self.runs, None))[0]
            if work.holds(best.candidate):
                held.append((best.candidate.cost, what))
        if held:
            raise SpaceError(f"the response {min(held)[1]}")

    def _best_path(self, less_than: float) -> Path | None:
        """The path of the first chain of masses that holds behind one, else of the least BIC; None: none below that."""
        few = [_thinned(r) for r in self.responses]
        work, whole = (ResponseSearch(of, self.space, self.settings, self.workers) for of in (few, self.responses))
        begin = [Path(delay) for delay in starts(self._highest)]
        least: dict[int, tuple[float, Path]] = {}  # of each chain of masses
        while begin:
            better: dict[int, Path] = {}
            for path, c in work._chains_behind(begin.pop(0)):
                whole._behind(path)
                fit = whole.refined(c)
                cost = bic(fit.cost / whole.count, whole.count, fit.size + len(path.unknowns))
                if cost < less_than and whole.holds(fit):
                    return path
                if c.q not in least or cost < least[c.q][0] - POLICY.rival_margin:
                    least[c.q], better[c.q] = (cost, path), path
            # Behind a better path the structures are searched anew: from a wrong one the larger do not find their way.
            begin[:0] = [better[q] for q in sorted(better)]
        cost, path = min(least.values(), key=lambda found: found[0], default=(math.inf, NO_PATH))
        return path if cost < less_than else None

    def _chains_behind(self, begin: Path) -> Iterator[tuple[Path, Candidate]]:
        """Chains of masses with their paths, from a path on."""
        self._behind(begin)
        scores = super().select(self.search(*self.runs, None))[1]
        # The smallest first: a larger structure takes a part of the path for itself.
        for c in sorted(filter(selection.is_chain, scores), key=lambda c: c.size):
            # A delay alone, a lag alone, then both: the simpler path that holds is taken.
            late, fitted = self._with_path(begin, c)
            if late.unknowns:
                yield late, fitted
            for start in with_lag(late) if late.lag is None else ():
                path, fit = self._with_path(start, fitted)
                if path.unknowns:
                    yield path, fit

    @property
    def _highest(self) -> float:
        return max(float(r.omega[-1]) for r in self.responses)

    def _with_path(self, path: Path, c: Candidate) -> tuple[Path, Candidate]:
        """Path and chain of masses fitted together, from a path on."""
        self._behind(path)
        c = self.refined(c)
        for _ in range(STEPS):
            if not self.path.unknowns:
                break
            step = path_step(self._turned(c))[0]
            phase = float(np.max(np.abs(step))) * self._highest
            self._behind(self.path.moved(step / max(1.0, phase / LONGEST)))
            c = self.refined(c)
            if phase < SMALL:
                break
        return self.path, c

    def _turned(self, c: Candidate) -> Turned:
        error, columns, _ = self.experiment.sensitivities(c.fit.gain, c.fit.poles, c.fit.zeros, [], [])
        of_path = [
            np.concatenate([p.weight * p.value * p.path.derivatives(p.response.omega)[i] for p in self.parts])
            for i in range(len(self.path.unknowns))
        ]
        return Turned(error, columns, np.array([np.stack([z.real, z.imag], axis=1).ravel() for z in of_path]))

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
            selection.charged(c, bic(cost / self.count, self.count, c.size)) for c, cost in zip(candidates, costs, strict=True)
        ]

    def assessed(self, c: Candidate) -> Assessed:
        """See `StructureSearch`; deviations are those that are stated, or larger where what is left is."""
        plain = self.experiment.fit_sums(c.fit, [], [], 0.0)[0]
        if self.path.unknowns:
            plain = freed(self._turned(c), plain)
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
        if not self.path.unknowns:
            return {}
        std = best.noise_std * np.sqrt(np.diag(path_step(self._turned(best.candidate))[1]))
        values = [getattr(self.path, name) for name in self.path.unknowns]
        made = [Estimate(value, float(off), "s", False, bool(off < value)) for value, off in zip(values, std, strict=True)]
        return dict(zip(self.path.unknowns, made, strict=True))

    def notes(self, best: Assessed) -> Sequence[str]:
        """See `StructureSearch`."""
        found: list[str] = [note for r in self.responses for note in r.notes]
        if any(r.std is None for r in self.responses):
            found.append(
                "A response without standard deviations (std): how large its errors are is taken from what the model leaves, and "
                "whether they are as large as they should be cannot be tested."
            )
        if self.path.unknowns:
            found.append(_said(self.found_path(best)))
        if selection.is_chain(best.candidate) and self.gives_power(best.candidate):
            found.append(GIVES_POWER)
        return list(dict.fromkeys(found)) + compared_notes(self.responses)


def _said(path: dict[str, Estimate]) -> Text:
    """That the axis lies behind a path."""
    late = "the controller's computing, its bus" + ("" if "lag" in path else ", about the lag of its current loop")
    causes = {"delay": late, "lag": "the current loop, or a filter of the {torque}"}
    there = [f"a {name} of {MS * e.value:.4g} +- {MS * e.std:.2g} ms ({causes[name]})" for name, e in path.items()]
    return say(f"The response is that of the axis behind {' and '.join(there)}, of which nothing was said.")


def compared_notes(responses: Sequence[FrequencyResponse]) -> list[Text]:
    """What responses of one axis at several amplitudes say about its linearity: a hint, and no name.

    The smallest amplitude is set beside the largest: |G| omega in the lowest third of the band that both have, and the
    frequency of its peak.
    """
    told = sorted((r for r in responses if r.amplitude is not None), key=lambda r: r.amplitude or 0.0)
    if len(told) < 2:
        return []
    small, large = told[0], told[-1]
    low, high = max(small.omega[0], large.omega[0]), min(small.omega[-1], large.omega[-1])
    if not high > low:
        return []
    curves = []
    for r in (small, large):
        inside = (r.omega >= low) & (r.omega <= high)
        curves.append((r.omega[inside], (np.abs(r.velocity_response) * r.omega)[inside], r.relative_std[inside]))
    if min(len(omega) for omega, _, _ in curves) < 3:  # no decision: a formula: a third of them is one at least
        return []
    gains, errors, peaks, spacing = [], [], [], []
    for (omega, size, off), r in zip(curves, (small, large), strict=True):
        part = len(omega) // 3  # no decision: which part the sentence speaks of
        gains.append(float(np.median(size[:part])))
        # A median's deviation is sqrt(pi/2) that of a mean.
        stated = float(np.median(off[:part])) if r.std is not None else float(np.std(np.log(size[:part])))
        errors.append(math.sqrt(0.5 * math.pi / part) * stated)
        at = int(np.argmax(size))
        # A resonance stands out of |G| omega, which is flat for a rigid axis, and inside the band.
        if 0 < at < len(size) - 1 and size[at] > STANDS_OUT * float(np.median(size)):
            peaks.append(float(omega[at]) / math.tau)
            spacing.append(float(np.ptp(omega[at - 1 : at + 2])) / math.tau)
    change, off_by = gains[1] / gains[0] - 1.0, POLICY.contradiction * math.hypot(*errors)
    between = f"Not linear: with {{torque}} of {large.amplitude:.3g} instead of {small.amplitude:.3g} N m"
    last = "Record a motion and diagnose it to know the cause."
    found = []
    if abs(change) > off_by:
        way, why = ("larger", "dry friction or a dead band") if change > 0.0 else ("smaller", "a limit of the {torque}")
        gain = f"the gain at low frequencies is {PERCENT * abs(change):.2g} % {way}"
        found.append(say(f"{between} {gain}; {why} would do that. {last}"))
    if len(peaks) == len(curves) and abs(peaks[1] - peaks[0]) > max(spacing):
        why = "a gap or a hardening coupling" if peaks[1] > peaks[0] else "friction in the coupling or a softening one"
        moved = f"the peak moves from {peaks[0]:.4g} to {peaks[1]:.4g} Hz"
        found.append(say(f"{between} {moved}; {why} would do that. {last}"))
    return found
