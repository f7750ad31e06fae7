"""Stepwise extension: one effect after the other, everything refitted with each.

A candidate is worth the fall of the BIC that it brings, each hypothesis with a noise filter of its own; the best is taken
while it is worth more than a threshold. The friction family is one seat: a generalisation takes the place of dry friction,
and only where it is worth more than the simpler one by the threshold again. After each step every member has to show that it
is still needed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.candidates import CANDIDATES, FRICTION
from gaident.diagnosis.driven import Driven
from gaident.diagnosis.fitter import Fitter
from gaident.diagnosis.free_run import by_free_run
from gaident.diagnosis.layout import Layout, as_two_masses, is_mechanism, two_masses
from gaident.diagnosis.noise_filter import WHITE
from gaident.diagnosis.problem import WORST, Fit, Problem
from gaident.diagnosis.screening import Screening

__all__ = ["MARGIN", "THRESHOLD", "Search", "with_second_mass"]

Vector = NDArray[np.float64]

THRESHOLD, SHORT = 25.0, 200.0
"""Gain in BIC units from which an extension counts in a long record; samples of a record that needs twice that, as its noise
filter is uncertain itself. A filter that fits the noise less than perfectly brings gains up to 25, too: beside friction, which
lets no disturbance through at rest, and under a coarse encoder."""

BESIDE_GAP = 0.05
"""BIC units per sample that an effect beside a gap has to bring: impacts a little earlier or later bring up to 0.04, on held-out
data, too, where torques that nobody commanded keep the shaft in motion."""

MARGIN, MARGIN_SHORT = 10.0, 400.0
"""Rivals closer than this many BIC units cannot be told apart in a long record; samples of a record that needs twice that."""

MOST = 4  # effects in one model
SHARE, BACKLASH_SHARE = 0.1, 0.5
"""Part of what a model leaves beyond the noise that an extension has to explain; the second beside a gap."""

NEEDLESS = 4.0  # times the threshold, by which an extension that makes an older effect needless may be behind the best one
FITTED = 6  # candidates that each of the two rankings sends into a short fit
FINISHED = 5  # of these, how many are fitted to the end
FAR = 0.5  # BIC units per sample by which a short fit may be behind the model that it extends, to be fitted to the end


class Search:
    """The stepwise search over one problem."""

    def __init__(self, problem: Problem, driven: Driven, allowed: Sequence[str], note: Callable[[str], None]) -> None:
        self.problem, self.driven, self.allowed, self.note = problem, driven, tuple(allowed), note
        self.threshold = THRESHOLD * (1.0 + SHORT / problem.count)
        self.margin = MARGIN * (1.0 + MARGIN_SHORT / problem.count)
        self.fitter = Fitter(problem, driven)
        self.known: dict[tuple[int, frozenset[str]], list[Fit]] = {}

    def run(self, base: Fit) -> Fit:
        """The extended model; its effects stand in the order in which they were found."""
        best = self.stepped(base)
        if self.driven.loopable or self.fitter.only_noise(best):
            return best
        rough = [e for e in self.candidates(base.layout) if CANDIDATES[e].rough and e not in best.effects]
        return self.fitter.rescued(best, base, rough, self.threshold)

    def freed(self, best: Fit, starts: Sequence[Fit]) -> Fit:
        """Where the free run of a model misses more than noise: what the plain error of the loop leads to from linear starts."""
        self.note("looking at the free run of the loop")
        seen = by_free_run(self.fitter, starts, self.candidates, MOST)
        for fit in seen[:1]:
            best = self.better(best, self.fitter.polished(self.problem.settled(with_second_mass(self.problem, fit))))
        for effect in [e for e in self.allowed if CANDIDATES[e].rough]:
            if self.fitter.runs_free(best):
                break
            start = next((f for f in seen if effect in f.effects), None)
            if start is not None:
                best = self.better(best, self.fitter.searched(start))
        return best

    def leanest(self, best: Fit) -> Fit:
        """Beside a gap: without the effects, or with the simpler ones, that do as well after a search of their own.

        An impact more or less makes valleys. What an effect beside a gap brings may be no more than a better valley, which the
        model without it reaches, too, once it is looked for; or it stands for the disturbances that no model foresees, and
        explains a part of what they leave.
        """
        if "backlash" not in best.effects or len(best.effects) == 1 or not self.driven.loopable:
            return best

        def searched(fit: Fit) -> Fit:
            return min((fit, self.fitter.searched(fit)), key=lambda f: f.bic)

        best = searched(best)
        for effect in [e for e in best.effects if e != "backlash"]:
            simpler = [self.without(best, effect), *(self.as_parent(best, effect, p) for p in CANDIDATES[effect].parents)]
            for fit in simpler:
                found = searched(fit)
                if found.bic - best.bic < self.needed(best, effect) or not self.explains(found, best):
                    best = found
                    break
        return best

    def as_parent(self, fit: Fit, effect: str, parent: str) -> Fit:
        """The model refitted with a simpler effect in the place of one that contains it, at its level."""
        level = fit.x[fit.layout.slot(effect)][:1]
        layout = fit.layout.without(effect).extended(parent)
        x = layout.without(parent).inserted(fit.layout.removed(fit.x, effect), level)
        return self.problem.settled(self.problem.fit(layout, x, fit.noise, 12))

    def better(self, best: Fit, other: Fit) -> Fit:
        """Another model, thinned and extended, if it is worth the threshold more."""
        if other.bic > best.bic + self.threshold:
            return best
        other = self.stepped(self.thinned(other, every=True))
        return other if best.bic - other.bic > self.threshold else best

    def stepped(self, best: Fit) -> Fit:
        """A model and the effects that are found beyond it, one by one."""
        while len(best.effects) < MOST:
            beyond = ", ".join(e.replace("_", " ") for e in best.effects)
            self.note(f"looking beyond {beyond or 'the linear model'}")
            found = self.best_extension(best)
            if found is not None and (other := self.resettled(found, best)) is not None:
                best = other
                continue
            if found is not None and found.layout.looped:
                best = self.fitter.in_loop(best)
            if found is None or best.bic - found.bic < self.needed(found, found.effects[-1]) or not self.material(best, found):
                break
            if set(best.effects) & set(FRICTION) and (inside := self.fitter.in_loop(best)) is not best:
                # Driven by the torque, what nobody commanded adds up between the stops, for other effects to describe; the loop
                # does not let it.
                self.known.pop(self.key(best), None)
                best = inside
                continue
            best = self.fitter.as_filter(self.fitter.polished(self.shortest(best, found)))
            if set(best.effects) & set(FRICTION) and not self.fitter.only_noise(best):
                best = self.fitter.in_loop(best)
        return best

    def shortest(self, best: Fit, found: Fit) -> Fit:
        """The extension that was found, thinned, or a close one that makes an older effect needless and is then better.

        A lag is a delay at first and a delay with a resonance next, as long as the delay stands in its seat.
        """
        taken = self.thinned(with_second_mass(self.problem, found))
        for f in self.extensions(best):
            if f is not found and f.bic - found.bic < NEEDLESS * self.threshold:
                less = self.thinned(with_second_mass(self.problem, f))
                if len(less.effects) < len(taken.effects) and less.bic < taken.bic:
                    taken = less
        return taken

    def needed(self, fit: Fit, effect: str) -> float:
        """BIC units that an effect of this model has to bring."""
        beside_gap = effect != "backlash" and "backlash" in fit.effects
        return max(self.threshold, BESIDE_GAP * self.problem.count) if beside_gap else self.threshold

    def material(self, best: Fit, found: Fit) -> bool:
        """Whether an extension explains a fair part of what the model leaves beyond the noise, or all of it.

        Significant alone is not enough where a model is wrong: anything that moves a little helps a little. After an impact in a
        gap more or less the simulation of the true drive leaves something, too.
        """
        if set(CANDIDATES[found.effects[-1]].parents) & set(best.effects) and not self.in_both_views(best, found):
            return False
        return self.explains(best, found)

    def explains(self, best: Fit, found: Fit) -> bool:
        """Whether a model with an effect more explains its share of what `best` leaves beyond the noise."""
        if self.fitter.only_noise(found, 1.15):
            return True
        floor = self.problem.count * self.driven.noise**2
        share = BACKLASH_SHARE if "backlash" in best.effects else SHARE
        return best.cost - found.cost > share * (best.cost - floor)

    def resettled(self, found: Fit, best: Fit) -> Fit | None:
        """The two masses with the resonance that was found as their own, where that or a simple effect on it does as well.

        What delays the torque or blocks the shaft pulls the resonance of two masses out of its place, where a fit finds no way
        back, and the true one is then found as an extra.
        """
        layout, x = found.layout, found.x
        if layout.masses == 1 or found.effects[-1] != "extra_resonance":
            return None
        shorter = replace(layout.without("extra_resonance"), looped=False)
        y = layout.removed(x, "extra_resonance")
        y[: shorter.base] = shorter.base_vector(two_masses(layout, x))
        own = self.problem.settled(self.problem.fit(shorter, y, WHITE, 20))
        tries = [own]
        for effect in self.candidates(shorter):
            candidate = CANDIDATES[effect]
            if candidate.size > 1 or candidate.place == "shaft":
                continue
            longer = replace(shorter.extended(effect), looped=candidate.rough and self.driven.loopable)
            X = np.array([shorter.inserted(y, np.array(row)) for row in candidate.starts(longer.scales)])
            if len(X):
                start = X[int(np.argmin(self.problem.costs(longer, X, WHITE)))]
                tries.append(self.problem.settled(self.problem.fit(longer, start, WHITE, 20)))
        fit = min(tries, key=lambda f: f.bic)
        if fit.bic > found.bic + self.margin:
            return None
        fit = self.thinned(fit, every=True)
        if best.bic - fit.bic < self.threshold:  # thinned as well: each round is better than the last, and there is an end
            return None
        self.known.clear()
        return fit

    def best_gain(self, now: Fit) -> float:
        """What the best extension is worth, in BIC units."""
        found = self.best_extension(now)
        return -np.inf if found is None else now.bic - found.bic

    def best_extension(self, now: Fit) -> Fit | None:
        """The best model with one effect more (or one of the friction family in place of another)."""
        fits = self.extensions(now)
        if not fits:
            return None
        return self.simplest(fits[0], fits)

    def extensions(self, now: Fit) -> list[Fit]:
        """Settled fits of the promising extensions, best first; what was worked out once is remembered."""
        key = self.key(now)
        if key not in self.known:
            self.known[key] = self.worked_out(now)
        return self.known[key]

    @staticmethod
    def key(fit: Fit) -> tuple[int, frozenset[str]]:
        """Under which the extensions of a model are remembered."""
        return fit.layout.masses, frozenset(fit.effects)

    def worked_out(self, now: Fit) -> list[Fit]:
        """The extensions of one model.

        All promising candidates get a short fit; the best of these under filters of their own are fitted to the end.
        """
        screening = Screening(self.problem, self.driven)
        layout, x = now.layout, now.x
        screening.add(layout, x, [e for e in self.candidates(layout) if e not in FRICTION[1:]])
        if not screening.trials:
            return []
        seat = next((e for e in layout.effects if e in FRICTION), None)
        fits: list[Fit] = []
        if seat is not None:
            self.add_generalisations(screening, now, seat)
        elif "coulomb_friction" in self.candidates(layout):
            # Dry friction first: its generalisations are tried at its level.
            start = next(s for s in screening.ranked(WHITE) if s.effect == "coulomb_friction")
            fits.append(self.problem.settled(self.problem.fit(start.layout, start.starts[0], WHITE, 8)))
            self.add_generalisations(screening, fits[0], "coulomb_friction")
        if self.fitter.only_noise(now):
            # Where nothing but noise is left the linearised gains are near enough.
            hopes = [s.hope for noise in (now.noise, None) for s in screening.ranked(noise)]
            if max(hopes, default=0.0) < 0.5 * self.threshold:
                return fits
        # Two views: plainly, and through a filter of what the library cannot explain; each misses what the other one sees.
        short: dict[str, Fit] = {}
        for noise in (WHITE, None):
            for s in [s for s in screening.ranked(noise) if s.effect != "coulomb_friction" or not fits][:FITTED]:
                for x0 in s.starts[:2]:
                    fit = self.problem.judged(self.problem.fit(s.layout, x0, s.noise, 3))
                    if s.effect not in short or fit.bic < short[s.effect].bic:
                        short[s.effect] = fit
        near = [f for f in short.values() if f.bic < now.bic + FAR * self.problem.count]
        best = sorted(near, key=lambda f: f.bic)[:FINISHED]
        fits += [self.fitter.finished(f) for f in best]
        fits = sorted((f for f in fits if f.cost < WORST and self.is_mechanism(f)), key=lambda f: f.bic)
        if fits and fits[0].layout.looped:
            fits = sorted((self.fitter.in_loop(f) for f in fits[:FITTED]), key=lambda f: f.bic)
        return fits

    def is_mechanism(self, fit: Fit) -> bool:
        """Whether an extra resonance on one mass is a second mass; else it only absorbs what no mechanism does."""
        two = with_second_mass(self.problem, fit)
        return is_mechanism(two.layout, two.x)

    def add_generalisations(self, screening: Screening, source: Fit, seat: str) -> None:
        """The rest of the friction family in the seat's place, at its level."""
        level = abs(float(source.x[source.layout.slot(seat)][0]))
        layout = source.layout.without(seat)
        layout = replace(layout, scales=replace(layout.scales, friction=max(level, 1e-4 * layout.scales.torque)))
        x = source.layout.removed(source.x, seat)
        wanted = [e for e in FRICTION[1:] if e in self.allowed and e != seat]
        if seat != "coulomb_friction":
            wanted = [e for e in wanted if seat in CANDIDATES[e].parents]
        screening.add(layout, x, wanted)

    def candidates(self, layout: Layout) -> list[str]:
        """What may be added to a model."""
        blocked = set(layout.effects)
        if blocked & set(FRICTION):
            blocked |= set(FRICTION)
        if "extra_resonance" in layout.effects:
            blocked |= {"backlash", "hardening_stiffness"}
        if {"backlash", "hardening_stiffness"} & set(layout.effects):
            blocked.add("extra_resonance")
        return [e for e in self.allowed if e not in blocked and (layout.masses == 2 or CANDIDATES[e].place != "coupling")]

    def simplest(self, best: Fit, fits: Sequence[Fit]) -> Fit:
        """A parent of the winner's newest effect, where the winner is not worth the threshold more than it.

        The parent is also taken as the winner's own neutral case, in the same view and with the same substeps: what only the
        accuracy of the simulation brings does not count.
        """
        newest = best.effects[-1]
        for parent in CANDIDATES[newest].parents:
            for f in fits:
                if f.effects[-1] != parent:
                    continue
                if min(f.bic, self.as_neutral(f, best)) - best.bic < self.needed(best, newest):
                    return f
                # What led the generalisation to a better place may lead the simpler one there, too.
                x = best.layout.removed(best.x, newest)
                again = f.layout.inserted(x, f.x[f.layout.slot(parent)])
                again_fit = self.problem.settled(self.problem.fit(f.layout, again, best.noise, 12))
                if again_fit.bic - best.bic < self.needed(best, newest):
                    return again_fit
                if not self.in_both_views(min(f, again_fit, key=lambda g: g.bic), best):
                    return again_fit
        return best

    def in_both_views(self, parent: Fit, child: Fit) -> bool:
        """Whether a generalisation is worth the threshold in its loop, too.

        Driven by the torque, a model with dry friction comes to rest a little before or after the drive wherever a torque that
        nobody commanded has turned the shaft, and two levels of friction may describe that better than one. Where a model leaves
        white noise there was no such torque.
        """
        if child.layout.looped or not self.driven.loopable or child.noise.size == 0:
            return True
        fits = [self.problem.fit(replace(f.layout, looped=True), f.x, WHITE, 8) for f in (parent, child)]
        inside = [self.problem.settled(f) for f in fits]
        return inside[0].bic - inside[1].bic > self.threshold

    def as_neutral(self, parent: Fit, child: Fit) -> float:
        """BIC of a parent's parameters simulated as the neutral case of its generalisation."""
        neutral = CANDIDATES[child.effects[-1]].neutral
        if neutral is None:
            return np.inf
        layout, scales = child.layout, child.layout.scales
        z = np.array(neutral(float(parent.x[parent.layout.slot(parent.effects[-1])][0]), scales))
        x = layout.without(child.effects[-1])
        base = parent.layout.removed(parent.x, parent.effects[-1])
        if base.shape != (x.size,):
            return np.inf
        as_child = Fit(layout, x.inserted(base, z), child.noise, 0.0, np.inf)
        freedom = CANDIDATES[child.effects[-1]].size - CANDIDATES[parent.effects[-1]].size
        return float(self.problem.judged(as_child).bic - freedom * np.log(self.problem.count))

    def thinned(self, best: Fit, every: bool = False) -> Fit:
        """Without the members (of all, or of all but the newest) whose removal costs less than the threshold."""
        for effect in best.effects if every else best.effects[:-1]:
            less = self.without(best, effect)
            if less.bic - best.bic < self.needed(best, effect):
                best = less
        return best

    def without(self, fit: Fit, effect: str) -> Fit:
        """The model refitted without one of its effects."""
        layout = fit.layout.without(effect)
        return self.problem.settled(self.problem.fit(layout, fit.layout.removed(fit.x, effect), fit.noise, 8))


def with_second_mass(problem: Problem, fit: Fit) -> Fit:
    """One mass with an extra resonance is a drive of two masses: part of the linear model, not an effect."""
    layout, x = fit.layout, fit.x
    if layout.masses == 2 or "extra_resonance" not in layout.effects:
        return fit
    return problem.settled(problem.fit(*as_two_masses(layout, x), fit.noise, 8))
