"""Before and after: the free-run simulation, linear and extended, on data that no parameter was fitted to.

With validation records these are used whole.
Without, parameters are fitted again to the first part of each record (`fitted_share`) and scored on the rest of one continuous
run, which is not restarted; the linear model is then identified on the same first part.
Where a record is too short for that, or one of its parts holds no motion, the figures are in-sample and say so.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.data.torque_kind import MEASURED
from gaident.diagnosis.held_parts import held_parts
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records.hygiene import quantisation
from gaident.estimation.criterion import effective_samples
from gaident.estimation.dataset import DataSet
from gaident.estimation.least_squares import fit
from gaident.estimation.objective import Fit, Objective
from gaident.models import simulate
from gaident.models.made_torque import load_before, stored_torque
from gaident.models.model import Model
from gaident.models.simulate import initial_state
from gaident.models.starts import noise_std, rounding_noise, starts_moving, torque_before
from gaident.policy.table import POLICY
from gaident.results.fitness import IN_SAMPLE, Fitness

__all__ = [
    "Gains",
    "closed_over",
    "free_run_errors",
    "interval_of_fall",
    "measured_gains",
    "with_effects",
]

Vector = NDArray[np.float64]

STATE_STEP = 1e-3  # no decision: the step of a difference, of the largest velocity
MOST_BLOCKS = 1 << 14  # no decision: a block in memory: longer ones only hold more of what is correlated
TOGETHER = 1 << 20  # no decision: a block in memory
NOISES = 8  # no decision: draws of a torque's noise, how closely the floor of a free run is known


@dataclass(frozen=True)
class Gains:
    """before, after, interval of the total fall, how it was held out, and each effect's own fall.

    harmful: effects without which the extended model is better on the held-out data, beyond chance. scored: records, each with
    the first sample that is held out; mechanism, extended: the models, without and with the effects, fitted to the rest.
    closed: whether the runs were closed over the controller; the torque drives them else.
    notes: of records that are left out, and of a linear model that has seen what is held out.
    """

    before: Fitness
    after: Fitness
    interval: tuple[float, float]
    held_out: str
    steps: dict[str, float]
    scored: tuple[tuple[Record, int], ...]
    mechanism: Model
    extended: Model
    harmful: tuple[str, ...] = ()
    closed: bool = False
    notes: tuple[Text, ...] = ()

    @property
    def in_sample(self) -> bool:
        """Whether the figures are of the samples that were fitted."""
        return self.held_out == IN_SAMPLE

    def of(self, effect: str) -> float:
        """Fall of the error that one effect brought, as a fraction of the error before it."""
        return self.steps.get(effect, 0.0)

    @cached_property
    def floor(self) -> float:
        """Rms error [rad/s] that noise leaves of a free run: of the velocity, and of a measured torque that drives the model.

        The torque's noise passes the extended model, which is the one that is judged:
        a mechanism that was fitted without the effects may be far from the axis.
        What exceeds the motion itself is no bound of an error and left out.
        """
        if self.closed or not self.scored:
            return self.after.noise_floor
        moved = _moved_by_torque_noise(self.extended, self.scored)
        motion = np.concatenate([r.velocity[first:] for r, first in self.scored])
        shown = moved < float(np.sqrt(np.mean(motion**2)))
        return float(np.hypot(self.after.noise_floor, moved if shown else 0.0))


def measured_gains(
    records: Sequence[Record],
    validation: Sequence[Record],
    controller: Controller | None,
    linear: Callable[[tuple[int, ...] | None], tuple[Model, tuple[Text, ...]]],
    final: Fit,
    objective: Objective,
    noise: float | None,
    at_controller: dict[str, dict[str, float]],
) -> Gains:
    """Errors of the linear model, of each stage and of the extended model, closed over the controller where they can be.

    linear: the linear model of the first samples of each record, so many of each, and what is said of it; None: of all.
    """
    loop = closed_over(controller, (*records, *validation), final.effects)
    controller = objective.data.older(loop)
    scored, words, part, notes = held_parts(records, validation, noise)
    angles = [r.position is not None for r, _ in scored]
    scored = [(_turned(r, loop, final), first) for r, first in scored]
    stages = _stages(final, objective, part)
    named = list(at_controller.items())
    bare = stages[0].parameters.model(stages[0].x)
    first, told = (bare, ()) if judges_selected(objective, final, at_controller) else linear(part)
    chain = [first]
    chain += [with_effects(bare, dict(named[:k])) for k in range(1, len(named) + 1)]
    chain += [with_effects(f.parameters.model(f.x), at_controller) for f in stages[1:]]
    # Where the simulated loop is known not to be the drive's, the torque drives the models that are compared and printed.
    closing = controller if objective.data.loop_follows or not objective.data.torque_logged else None
    shaft = [(objective.data.as_old(r), first) for r, first in scored]
    timed = [one if logged else old for logged, one, old in zip(angles, scored, shaft, strict=True)]
    scored = shaft if closing is None else scored
    errors = [free_run_errors(m, scored, closing, loop) for m in chain]
    levels = [float(np.sqrt(np.mean(np.concatenate(e) ** 2))) for e in errors]
    base = free_run_errors(stages[0].parameters.model(stages[0].x), scored, closing, loop)
    level0 = float(np.sqrt(np.mean(np.concatenate(base) ** 2)))
    # The linear mechanism, refitted, may be better than the identified model already.
    previous = min(levels[0], level0) if np.isfinite(level0) else levels[0]
    steps = {}
    for effect, level in zip([*at_controller, *final.effects], levels[1:], strict=True):
        steps[effect] = 1.0 - level / previous if previous > 0.0 else 0.0
        previous = level
    if len(errors) == 1:
        errors.append(errors[0])
    spread = np.concatenate([r.velocity[first:] for r, first in scored])
    step = quantisation(tuple(r for r, _ in scored))
    floor = float(np.mean([noise_std(r.velocity, step) for r, _ in scored])) if noise is None else noise
    if noise is None and objective.data.slower:  # where the motion itself has third differences, the model has them too
        floor = min(floor, float(np.mean([noise_std(e, step) for e in errors[-1]])))
    old = objective.data.age > 0.0
    floor = max(floor, float(np.mean([rounding_noise(r.velocity, step, old) for r, _ in scored])))
    size = float(np.sqrt(np.mean((spread - spread.mean()) ** 2)))

    def fitness(parts: list[Vector]) -> Fitness:
        rmse = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
        return Fitness(rmse, 100.0 * (1.0 - rmse / size) if size > 0.0 else float("nan"), floor)

    extended_level = float(np.sqrt(np.mean(np.concatenate(errors[-1]) ** 2)))
    harmful = []
    for effect in final.effects if words != IN_SAMPLE else ():
        less = stages[0] if len(final.effects) == 1 else _without(stages[-1], effect, _part(objective, part))
        spared = free_run_errors(with_effects(less.parameters.model(less.x), at_controller), scored, closing, loop)
        level = float(np.sqrt(np.mean(np.concatenate(spared) ** 2)))
        if level < (1.0 - POLICY.harm) * extended_level and interval_of_fall(spared, errors[-1])[1] < 0.0:
            harmful.append(effect)
    return Gains(
        before=fitness(errors[0]),
        after=fitness(errors[-1]),
        interval=interval_of_fall(errors[0], errors[-1]),
        held_out=words,
        steps=steps,
        scored=tuple(timed),
        mechanism=bare,
        extended=chain[-1],
        closed=closing is not None,
        harmful=tuple(harmful),
        notes=(*notes, *told),
    )


def closed_over(controller: Controller | None, records: Sequence[Record], effects: Collection[str] = ()) -> Controller | None:
    """What the free runs of these records are closed over, with these effects; None: their torque drives them.

    How a loop moved before a record is known of a bare PI only; any other is simulated from rest.
    Where the log has a line for each sample of another controller, the torque drives the model.
    What that controller answered to noise is in the torque, and would be missing from a loop.
    At impacts the errors of such a model grow, so that a model with impacts is simulated in the loop.
    """
    if controller is None or controller.one_equation:
        return controller
    told = all(controller.told_by_torque(r.dt) for r in records) and not any(LIBRARY[e].impacts for e in effects if e in LIBRARY)
    return None if told or any(starts_moving(r, None) for r in records) else controller


def _turned(rec: Record, controller: Controller | None, final: Fit) -> Record:
    """The record with the angle that the model's effects turned with when it was selected.

    Where none is logged that is the measured velocity, integrated, or the simulation's own.
    A pendulum that is simulated with its own angle falls to the other side some time, however small the error of the model.
    """
    if final.predictor.own_angle or rec.position is not None or not any(t.turns_with_the_shaft for t in final.parameters.terms):
        return rec
    (turned,) = DataSet.of([rec], controller).turned
    return turned


def _without(found: Fit, effect: str, objective: Objective) -> Fit:
    return fit(objective, found.hypothesis.without(effect), found.parameters.removed(found.x, effect), found.noise, POLICY.usual)


def _part(objective: Objective, part: tuple[int, ...] | None) -> Objective:
    """The objective with the last of each record left out, from these samples on."""
    if part is None:
        return objective
    weight = objective.weight.copy()
    places = objective.data.places or [(i, 0, n) for i, n in enumerate(objective.lengths)]
    at = 0
    for i, start, stop in places:
        weight[at + max(part[i] - start, 0) : at + stop - start] = 0.0
        at += stop - start
    return objective.weighted(weight)


def with_effects(model: Model, effects: dict[str, dict[str, float]]) -> Model:
    for name, values in effects.items():
        model = model.with_effect(name, **values)
    return model


def judges_selected(objective: Objective, final: Fit, at_controller: Mapping[str, object]) -> bool:
    """Whether the linear model of the figures is the selected one, and not the identified one.

    Not known to the identification: the velocity's age, and what the torque did between the lines of a slower log.
    Where nothing was found, the linear model that was selected is the one that is judged.
    """
    return bool(objective.data.slower or objective.data.age) or not (final.effects or at_controller)


def _stages(final: Fit, objective: Objective, part: tuple[int, ...] | None) -> list[Fit]:
    """The final model without its effects, with the first, the first two, ...; each refitted to the part that is not held out."""
    objective = _part(objective, part)
    fits = []
    hypothesis, x = final.hypothesis, final.x
    for e in reversed(final.effects):
        whole = part is None and hypothesis is final.hypothesis
        fits.append(final if whole else fit(objective, hypothesis, x, final.noise, POLICY.usual))
        x, hypothesis = hypothesis.parameters.removed(x, e), hypothesis.without(e)
    fits.append(fit(objective, hypothesis, x, final.noise, POLICY.usual))
    return fits[::-1]


def free_run_errors(
    model: Model, scored: Sequence[tuple[Record, int]], controller: Controller | None, read: Controller | None = None
) -> list[Vector]:
    """Measured minus simulated velocity of each record from a sample on [rad/s]; 1e150 where a simulation diverges.

    read: the controller that read the logged velocity, where the one of the runs has its age; None: the same.
    """
    errors = []
    for r, first in scored:
        state = start_state(model, r, controller, read)
        with np.errstate(over="ignore", invalid="ignore"):
            e = (r.velocity - simulate(model, r, controller, state))[first:]
        errors.append(np.where(np.isfinite(e), e, 1e150))
    return errors


def _moved_by_torque_noise(model: Model, scored: Sequence[tuple[Record, int]]) -> float:
    """Rms [rad/s] by which noise of measured torques moves free runs from a sample on; 0 where none was measured.

    The noise of a torque u is white of the standard deviation s of its third differences:

        mean over draws v of (w(u + s v) - w(u))^2,   w(u) the model's free run, with its friction and its gravity.
    """
    rng, power, count = np.random.default_rng(0), 0.0, 0
    for rec, first in scored:
        count += len(rec) - first
        if rec.torque is None or rec.torque_is != MEASURED:
            continue
        std, state = noise_std(rec.torque), start_state(model, rec, None)
        with np.errstate(over="ignore", invalid="ignore"):
            quiet = simulate(model, rec, None, state)
            for _ in range(NOISES):
                noisy = rec.with_channels(torque=rec.torque + std * rng.standard_normal(len(rec)))
                power += float(np.sum((simulate(model, noisy, None, state) - quiet)[first:] ** 2)) / NOISES
    return float(np.sqrt(power / max(count, 1))) if np.isfinite(power) else float("inf")


def start_state(model: Model, rec: Record, controller: Controller | None, read: Controller | None = None) -> Vector | None:
    """Initial state of the model at the record's start, and of its controller behind it; None where it starts from rest.

    At rest the integral may be a load's torque, which the logged torque shows.
    In motion a bare PI and a linear model have the state with which the whole record comes closest.
    Any other is not linear in its state: two steps of Gauss and Newton over the record's head, from the first velocity.
    """
    loop = read or controller
    pi, order = bare_pi(loop), model.mechanism.order
    stored = 0.0 if controller is None or loop is None else stored_torque(rec, loop)
    if not starts_moving(rec, pi):
        before = torque_before(rec, load_before(rec, read)) if controller is None else stored
        return np.append(np.zeros(order), before) if before else None
    closed = bare_pi(controller)
    if not model.effects and (controller is None or (closed is not None and not closed.limited)):
        return np.asarray(initial_state(model, rec, controller))
    head = rec[: min(len(rec), POLICY.head)]
    state = np.zeros(order if controller is None else order + 1)
    state[0] = rec.velocity[0]
    steps = np.full(len(state), STATE_STEP * float(np.abs(head.velocity).max()))
    if controller is not None:
        state[-1] = stored
        steps[-1] *= controller.gains.kp or 1.0
    for _ in range(2):
        with np.errstate(over="ignore", invalid="ignore"):
            here = simulate(model, head, controller, state)
            slopes = np.array([simulate(model, head, controller, state + d) - here for d in np.diag(steps)]) / steps[:, None]
        if not (np.all(np.isfinite(here)) and np.all(np.isfinite(slopes))):
            break
        state = state + np.linalg.lstsq(slopes.T, head.velocity - here, rcond=1e-9)[0]
    return state


def interval_of_fall(before: list[Vector], after: list[Vector]) -> tuple[float, float]:
    """95 % interval of 1 - rmse_after/rmse_before by a paired block bootstrap.

    Blocks are longer than the errors stay correlated: `block_memory` times samples over independent samples.
    """
    b, a = np.concatenate(before), np.concatenate(after)
    n = len(b)
    memory = n / effective_samples(a)
    block = max(
        min(n // POLICY.least_blocks, round(POLICY.block_memory * memory)),
        n // MOST_BLOCKS if n > POLICY.whole_samples else 1,
    )
    count = n // block
    if count < 2:
        return (float("-inf"), 1.0)
    ends = [*range(0, count * block, max(TOGETHER // block, 1) * block), count * block]
    parts = (np.column_stack([b[i:j] ** 2, a[i:j] ** 2]) for i, j in pairwise(ends))
    sums = np.vstack([np.add.reduceat(part, np.arange(0, len(part), block), axis=0) for part in parts])
    rng = np.random.default_rng(0)
    drawn = sums[rng.integers(0, count, (POLICY.draws, count))].sum(axis=1)
    falls = 1.0 - np.sqrt(drawn[:, 1] / np.maximum(drawn[:, 0], 1e-300))
    tail = 0.5 * POLICY.interval_level
    low, high = np.quantile(falls, (tail, 1.0 - tail))
    return float(low), float(high)
