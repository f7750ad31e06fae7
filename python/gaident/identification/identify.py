"""identify(): from records and frequency responses to structure and parameters."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.control import core
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.control.simplest import simplest
from gaident.data.frequency.response import FrequencyResponse
from gaident.data.record import Record
from gaident.errors import SettingsError
from gaident.identification import adequacy, selection
from gaident.identification.arguments import check_arithmetic, check_numbers, checked_records, checked_space, distinct, parted
from gaident.identification.closed_loop import input_of, looped_over, space_of
from gaident.identification.controller_numbers import with_estimates
from gaident.identification.noise import Autoregression, autoregression_of, highest_order
from gaident.identification.notes import inertia_of, record_notes, seen_up_to, slower_than_the_loop, unseen_notes
from gaident.identification.parts import search_parts
from gaident.identification.replay.notes import replay_notes
from gaident.identification.replay.timed_record import plain_of
from gaident.identification.response.response_search import ResponseSearch, distinct_responses, response_space, told_of
from gaident.identification.response.weighed import assessed_responses, weighed
from gaident.identification.selection import Candidate
from gaident.identification.structure_search import PERCENT, Assessed, ProgressCallback, StructureSearch
from gaident.models.drive_torque import as_differenced, without_age
from gaident.models.search_space import SearchSpace
from gaident.models.starts import noise_std, starts_moving
from gaident.policy.table import POLICY
from gaident.processors import processors
from gaident.results.identification import Identification
from gaident.results.settings import Settings

__all__ = ["identify"]

Vector = NDArray[np.float64]


def identify(
    rec: Record | FrequencyResponse | Sequence[Record | FrequencyResponse],
    controller: Controller | None = None,
    space: SearchSpace | None = None,
    settings: Settings | None = None,
    trials: int = 1,
    seed: int = 0,
    workers: int | None = None,
    progress: ProgressCallback | None = None,
) -> Identification:
    """Find structure (p, q) and parameters of the model behind one or several records or frequency responses.

    A genetic search per structure with local fits; the structures are compared by the BIC of whitened errors.
    See docs/identification.md.

    Parameters
    ----------
    rec : Record, FrequencyResponse, or a sequence of them
        The data; one model for all, each record with its own initial state.
        A response counts by its standard deviations, beside records as much as their noise allows.
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
    settings = Settings() if settings is None else settings
    if not isinstance(settings, Settings):
        raise SettingsError(f"settings is {settings!r}: give a gaident.Settings")
    check_numbers(trials, seed, workers, progress)
    threads = processors() if workers is None else int(workers)
    given, responses = parted(rec)
    responses = distinct_responses(responses)
    runs = _Runs(settings, int(trials), int(seed), threads, progress)
    if responses and not given:
        if controller is not None:
            raise SettingsError(
                f"controller is {type(controller).__name__}: a frequency response is that of the axis from its torque, in any "
                "loop; leave it out"
            )
        space = checked_space(response_space(responses) if space is None else space, None)
        result = runs.report(ResponseSearch(responses, space, settings, threads))
    else:
        result = _of_records(given, responses, controller, space, runs)
    return replace(result, seconds=time.perf_counter() - began)


@dataclass(frozen=True)
class _Runs:
    """How often, and from which random numbers, an identification searches."""

    settings: Settings
    trials: int
    seed: int
    workers: int
    progress: ProgressCallback | None

    def report(self, work: StructureSearch) -> Identification:
        """The result, with what left the range of a drive's arithmetic."""
        found = work.search(self.trials, self.seed, self.progress)
        best, scored = work.select(found)
        result = work.report(best, scored, found, self.seed)
        overflows = sum(t.overflows for t in found)
        if not overflows:
            return result
        evaluations = sum(t.evaluations for t in found)
        left = f"{overflows} of {evaluations} candidates left its range or diverged; they count as worst."
        return replace(result, warnings=(*result.warnings, f"In {self.settings.arithmetic} {left}"))


def _of_records(
    rec: Sequence[Record],
    responses: Sequence[FrequencyResponse],
    controller: Controller | None,
    space: SearchSpace | None,
    runs: _Runs,
) -> Identification:
    """Of records, and of frequency responses beside them."""
    recorded = checked_records(rec, controller)
    # A simulated loop knows no age of a velocity.
    checked = [as_differenced(r, controller) if bare_pi(controller) is None else without_age(r) for r in recorded]
    numbers = with_estimates(checked, controller).trusted()
    settings = runs.settings
    looped = looped_over(checked, simplest(numbers.controller, (r.dt for r in checked)), space, settings.initial_state != "free")
    given, loop = looped.records, looped.controller
    check_arithmetic(settings, loop)
    digests = distinct(given)
    # Sums must not depend on the order given.
    order = sorted(range(len(given)), key=lambda i: (digests[i], given[i].name))
    records, digests = [given[i] for i in order], [digests[i] for i in order]
    derived = space is None
    space = checked_space(space_of(records, loop) if space is None else space, loop)
    moving = [settings.initial_state == "free" or (settings.initial_state == "auto" and starts_moving(r, loop)) for r in records]
    result = runs.report(RecordSearch(records, digests, loop, space, settings, moving, runs.workers, responses))
    warnings = [*replay_notes(checked, controller), *numbers.notes, *looped.notes, *result.warnings]
    warnings += unseen_notes(result.mechanics, given[0].dt)
    warnings += slower_than_the_loop(inertia_of(result.mechanics), controller, given[0].dt)
    if derived and not settings.species:
        warnings.append(
            "Search ranges derived from the data are wide; the plain engine needs narrow ones: give the search space."
        )
    shown = {**numbers.estimates, **looped.estimates}
    return replace(result, warnings=tuple(warnings), controller_numbers=shown)


class RecordSearch(StructureSearch):
    """The search for the model behind records, and frequency responses beside them."""

    def __init__(
        self,
        records: list[Record],
        digests: list[str],
        controller: Controller | None,
        space: SearchSpace,
        settings: Settings,
        moving: list[bool],
        workers: int,
        responses: Sequence[FrequencyResponse] = (),
    ) -> None:
        self.records, self.digests, self.moving = records, digests, moving
        self.controller, self.space, self.settings, self.workers = controller, space, settings, workers
        self.lengths = [len(r) for r in records]
        self.samples = sum(self.lengths)
        continuous = controller is not None and controller.loop == "continuous"
        # Until a fit says more: the noise of the velocity, and one per cent where a response states no deviation.
        self.weighed = weighed(responses, continuous, self.quiet or 1e-6, size=0.01) if responses else []
        self.whole = list(zip(records, moving, strict=True))
        self.experiment = self.experiment_of(self.whole)
        # A long record is searched in part, and what is found fitted to all of it.
        # The middle of a record has no start at rest, which a cascade needs.
        parts = self.whole
        if settings.species and (controller is None or controller.one_equation):
            parts = search_parts(records, bare_pi(controller), moving)
        self.in_parts = sum(len(r) for r, _ in parts) < self.samples
        self.search_lengths = [len(r) for r, _ in parts]
        self.searched = self.experiment_of(parts) if self.in_parts else self.experiment
        beside = 2 * sum(len(r) for r in responses)
        self.count, self.searched_count = self.samples + beside, sum(self.search_lengths) + beside

    def experiment_of(self, parts: Sequence[tuple[Record, bool]]) -> _core.Experiment:
        """The core's view of (record, whether it starts in motion)."""
        c = self.controller
        dt = parts[0][0].dt
        if c is not None and not c.one_equation:
            rows = [c.line_record(r) for r, _ in parts]
        else:
            rows = [
                # no decision: a start
                core.record(r.dt, input_of(r, c), r.velocity, "free" if moving else "rest", float(r.velocity[:3].mean()))
                for r, moving in parts
            ]
        return core.experiment(rows, c, dt, responses=[w.core() for w in self.weighed])

    def compared(self, candidates: list[Candidate], others: list[Candidate]) -> tuple[Assessed, list[Candidate]]:
        """See `StructureSearch`; beside records a response is weighed by what the first comparison leaves of either."""
        best, scores = super().compared(candidates, others)
        if not self.weighed:
            return best, scores
        model = best.candidate.model
        self.weighed = [replace(w.resized(model), scale=best.noise_std or w.scale) for w in self.weighed]
        self.experiment = self.experiment_of(self.whole)
        return super().compared(self.on_all_samples(scores), others)

    def noise_of(self, c: Candidate, in_part: bool = False) -> Autoregression:
        """See `StructureSearch`."""
        experiment, lengths = (self.searched, self.search_lengths) if in_part else (self.experiment, self.lengths)
        return selection.noise_of(experiment, c, lengths)

    def scored(self, candidates: Sequence[Candidate], noise: Autoregression, in_part: bool = False) -> list[Candidate]:
        """See `StructureSearch`."""
        experiment, lengths = (self.searched, self.search_lengths) if in_part else (self.experiment, self.lengths)
        beside = self.count - self.samples
        return selection.scored(experiment, candidates, noise, lengths, self.ranges, self.workers, beside)

    def states(self, c: Candidate) -> list[Vector]:
        """Start state of each record; empty: at rest."""
        size = c.model.order + (self.controller is not None)
        states, at = [], 0
        for m in self.moving:
            n = size if m and len(c.starts) else 0
            states.append(c.starts[at : at + n])
            at += n
        return states

    def assessed(self, c: Candidate) -> Assessed:
        """See `StructureSearch`."""
        order = highest_order(self.lengths)
        products, largest = self.experiment.residual_sums(c.fit, max(order, adequacy.white_lags(self.lengths)))
        noise = autoregression_of(products[: order + 1], self.samples)
        lags = adequacy.regressor_lags(self.lengths, self.controller is None)
        plain, coloured, white = self.experiment.fit_sums(c.fit, noise.phi, lags, POLICY.no_direction * largest)
        sums = adequacy.Sums(products, white, len(plain), self.lengths, noise, self.quiet, self.count - self.samples)
        verdict = adequacy.assess(sums)
        if self.weighed:
            beside = assessed_responses(self.weighed, c.model, c.size)
            verdict = beside if beside.falsified and not verdict.falsified else verdict
        return Assessed(c, float(products[0]), noise.std, plain, coloured, verdict)

    @cached_property
    def quiet(self) -> float:
        """Noise of the measured velocity as its third differences show it [rad/s]."""
        return math.sqrt(sum(len(r) * noise_std(r.velocity) ** 2 for r in self.records) / self.samples)

    def notes(self, best: Assessed) -> Sequence[str]:
        """See `StructureSearch`."""
        of_responses = [note for w in self.weighed for note in w.response.notes]
        return [*record_notes(self.records, self.controller, self.settings.initial_state), *of_responses]

    def of_data(self, best: Assessed) -> dict[str, Any]:
        """See `StructureSearch`."""
        spread, error_sum = _spread(self.records), best.error_sum
        states = {d: tuple(x.tolist()) for d, x in zip(self.digests, self.states(best.candidate), strict=True) if len(x)}
        return {
            "rmse": float(np.sqrt(error_sum / self.samples)),
            "fit_percent": PERCENT * (1.0 - math.sqrt(error_sum / spread)) if spread > 0.0 else math.nan,
            "samples": self.samples,
            "digests": tuple(self.digests),
            "initial_states": states,
            "records": tuple(map(plain_of, self.records)),
            **told_of([w.response for w in self.weighed]),
            "unseen_above": max([seen_up_to(self.records[0].dt), *(float(w.response.frequency_hz[-1]) for w in self.weighed)]),
        }


def _spread(records: Sequence[Record], block: int = 1 << 18) -> float:  # no decision: memory; samples of a block
    """Sum of squares of the velocity about its mean, a block at a time."""
    mean = sum(float(r.velocity.sum()) for r in records) / sum(len(r) for r in records)
    parts = (r.velocity[i : i + block] - mean for r in records for i in range(0, len(r), block))
    return sum(float(np.einsum("i,i", w, w)) for w in parts)  # in one thread, unlike w @ w
