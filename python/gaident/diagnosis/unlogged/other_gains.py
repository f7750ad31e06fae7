"""Other gains than the given ones as a hypothesis beside the mechanical ones, for records without a torque.

Without a logged torque a model is driven by what the given PI makes of command and velocity,

    e = r - w,   u = kp (e + ki/kp int e dt),   w_model = G(u)

A common factor of kp and ki scales u; inertia and torques of the model scale with it, and no record shows it.
The ratio ki/kp does show: a wrong one leaves errors of the command's shape, or looks like mechanics.
With limits in the PI the record also shows kp itself.

The hypothesis is a model with some of the selected effects under a PI with

    ki exp(z),   abs(z) <= ln((1 + d)/(1 - d)),   d = `gain_doubt` of each gain;   with limits kp exp(z2) as well

z is fitted with all other numbers (Gauss and Newton, what the model explains projected out of its slope), and costs what an
effect costs. What comes out is compared with the selected model by the criterion that selected it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, joined, say, unit_text
from gaident.control.found import NUMBER_STEP, FoundNumbers
from gaident.control.pi import PI
from gaident.diagnosis.selection.moves import Moves
from gaident.diagnosis.selection.select import Selection
from gaident.diagnosis.unlogged.under_controller import UnderController, out_of_reach
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import cost_of, gained
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Objective
from gaident.estimation.projection import WORST, project_out
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

__all__ = ["OTHER_GAINS", "GainDoubt", "OtherGains", "gain_doubt", "under_given"]

Vector = NDArray[np.float64]

OTHER_GAINS = "other_gains"
"""The finding."""


@dataclass(frozen=True)
class OtherGains:
    """A model under other gains: its fit, the PI, and how well its gains are known.

    gain: BIC units by which the selected model, under the given gains, is worse.
    found: the gains' logarithms over the given ones. rivals: findings of forms of controller that explain as much, and how.
    """

    fit: Fit
    controller: PI
    estimates: dict[str, Estimate]
    score: float
    bic: float
    gain: float
    found: FoundNumbers
    rivals: Mapping[str, Text] = field(default_factory=dict)

    def moves(self, pi: PI) -> bool:
        """Whether a gain differs from that of a PI by more than its deviation."""
        return any(abs(e.value - getattr(pi, name)) > e.std for name, e in self.estimates.items())

    def finding(self, given: PI) -> Finding:
        """What is reported of these gains in the place of the given ones."""
        text = (
            "No {torque} is logged; with {} instead of the given {} command and velocity agree with the axis{}. "
            "{}{}Log the {torque}, which shows both gains."
        )
        shown = joined(" and ", (say("{} = {:.4g} {}", name, e.value, unit_text(e.unit)) for name, e in self.estimates.items()))
        was = joined(" and ", (say("{:.4g}", getattr(given, name)) for name in self.estimates))
        more = Text("" if len(self.estimates) > 1 else "Only the ratio ki/kp shows, kp is taken as given. ")
        worse = say(", and the best model under the given gains is {:.0f} BIC units worse", self.gain) if self.gain > 0.0 else ""
        instead = say("So it does with the given gains and {}. ", joined(" or ", self.rivals.values())) if self.rivals else ""
        return Finding(OTHER_GAINS, self.estimates, tuple(self.rivals), 0.0, self.gain, None,
                       say(text, shown, was, worse, more, instead), place="controller")  # fmt: skip


@dataclass(frozen=True)
class GainDoubt:
    """better: the model under other gains that explains the records better than the selected one, None where none does.

    rivals: effects of the selected model in whose place other gains are within reach, and those that the better model lacks.
    """

    better: OtherGains | None = None
    rivals: frozenset[str] = field(default_factory=frozenset)


def gain_doubt(space: Moves, final: Fit, again: bool = False) -> GainDoubt:
    """What other gains say against the selected model; nothing where a torque is logged, or no bare PI closes the loop.

    again: the model was selected under gains that an earlier model showed; these are then moved by what this model shows.
    """
    data = space.data
    if data.pi is None or any(r.torque is not None or r.command is None for r in data.records):
        return GainDoubt()
    search = _Search(space, data.pi, final)
    if again:
        moved = search.beside(final)
        return GainDoubt(moved if moved is not None and search.inside(moved) and moved.moves(data.pi) else None)
    beside = search.beside(final) if search.promises(final) else None
    instead = {e: search.beside(space.known(space.without(final, e))) for e in final.effects}
    alone = search.beside(_bare(space, final)) if len(final.effects) > 1 else None
    found = [beside, *instead.values(), alone]
    known = [g for g in found if g is not None and search.inside(g)]
    best = min(known, key=lambda g: g.score, default=None)
    if best is not None and not search.better(best, is_more=best is beside):
        best = None
    rivals = {e for e, g in instead.items() if g is not None and g.bic - final.bic < space.margin}
    lacking = set() if best is None else set(final.effects) - set(best.fit.effects)
    return GainDoubt(best, frozenset(rivals | lacking))


def _bare(space: Moves, fit: Fit) -> Fit:
    """A model without all of its effects."""
    for effect in fit.effects[::-1]:
        fit = space.without(fit, effect)
    return fit


@dataclass(frozen=True, eq=False)
class _Search:
    """Fits under other gains, compared with one selected model."""

    space: Moves
    pi: PI
    final: Fit

    @property
    def freedom(self) -> int:
        """Gains that a record can show: the ratio, under limits both."""
        return 2 if self.pi.limited else 1

    @property
    def reach(self) -> float:
        """Largest logarithm of a gain over the given one."""
        d = POLICY.gain_doubt
        return float(np.log((1.0 + d) / (1.0 - d)) if self.freedom == 1 else np.log1p(d))

    def controller(self, z: Vector) -> PI:
        """The PI with ki, under limits kp as well, moved by these logarithms."""
        kp = self.pi.kp * float(np.exp(z[1])) if self.freedom > 1 else self.pi.kp
        return replace(self.pi, kp=kp, ki=self.pi.ki * float(np.exp(z[0])))

    @property
    def under(self) -> UnderController:
        """Models under the PI of these logarithms."""
        ends = np.full(self.freedom, self.reach)
        return UnderController(self.space.data, self.controller, -ends, ends)

    @cached_property
    def beyond(self) -> float:
        """Score from which on a model is not followed."""
        return out_of_reach(self.space, self.final)

    def inside(self, g: OtherGains) -> bool:
        """Whether the gains are not at the end of what is taken to be possible."""
        return not any(e.at_bound for e in g.estimates.values())

    def promises(self, fit: Fit) -> bool:
        """Whether gains that are off by a little promise as much beside a model as is worth a fit."""
        objective = replace(self.space.objective)
        z = np.zeros(self.freedom)
        for noise in {f.key: f for f in (fit.noise, WHITE)}.values():
            v, C = self.under.slopes(objective, fit.hypothesis, fit.x, noise, z)
            power = float(v @ v)
            rest = project_out(C, v[None, :])[0]
            fall = gained(power, float(rest @ rest), objective.information)
            if fall > POLICY.hope * self.space.penalty:
                return True
        return False

    def better(self, g: OtherGains, is_more: bool) -> bool:
        """Whether other gains take the place of the selected model, or of effects of it (`is_more` False)."""
        fall = self.space.score(self.final) - g.score
        if not is_more:
            return fall > self.space.margin
        if fall <= 0.0:
            return False
        if self.space.quiet(g.fit):
            return True
        objective, least = self.space.objective, self.space.objective.count * self.space.data.noise**2
        for cost, less in ((self.final.cost, g.fit.cost), (self._plain(objective, self.final), self._plain(objective, g.fit))):
            if cost - less > POLICY.material_share * (cost - least):
                return True
        return False

    def _plain(self, objective: Objective, fit: Fit) -> float:
        return ls.fit(objective, fit.hypothesis, fit.x, WHITE, POLICY.usual).cost

    def beside(self, fit: Fit) -> OtherGains | None:
        """The model under the gains that come closest; None where it diverges, or stays far behind the selected one."""
        if fit.cost >= WORST:
            return None
        objective = replace(self.space.objective)
        end = self.under.fitted(self.space, objective, fit, np.zeros(self.freedom), self.beyond)
        if end is None:
            return None
        z, found = end
        stds = self.under.deviations(objective, found, z)
        pi = self.controller(z)
        at_end = np.abs(z) > (1.0 - NUMBER_STEP) * self.reach
        rows = [("ki", pi.ki, "N m/rad"), ("kp", pi.kp, "N m s/rad")][: self.freedom]
        estimates = {
            name: Estimate(value, value * float(std), unit, bool(end))
            for (name, value, unit), std, end in zip(rows, stds, at_end, strict=True)
        }
        bic = found.bic + cost_of(self.freedom, objective.information)
        score = self.space.score(found) + cost_of(self.freedom, objective.information) + self.space.penalty
        return OtherGains(found, pi, estimates, score, bic, self.final.bic - bic, self.under.found(z))


def under_given(found: Selection, given: PI, gains: int) -> Selection | None:
    """A model found under other gains, so many of them, under the given ones; None where the criterion prefers the others.

    A search under gains that differ a little comes another way, and may find a cause that a search under the given ones missed.
    """
    space = found.space
    data = space.data.under(given)
    here = replace(space, objective=replace(space.objective, data=data))

    def moved(fit: Fit) -> Fit:
        return here.refitted(fit.hypothesis.over(data), fit.x)

    final = moved(found.final)
    if here.score(final) > space.score(found.final) + cost_of(gains, space.objective.information) + space.penalty:
        return None
    return replace(found, space=here, base=moved(found.base), final=final, rivals={}, whitened=None)
