"""Fits of one model: in the view that sees most, from all starts, and by a global search where stops and impacts make valleys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.candidates import CANDIDATES
from gaident.diagnosis.driven import Driven
from gaident.diagnosis.noise_filter import WHITE
from gaident.diagnosis.problem import Fit, Problem

__all__ = ["OF_ANGLE", "Fitter"]

Vector = NDArray[np.float64]

FREE_RUN = (
    2.0  # times the noise of the velocity that the free run of a right model may miss: a loop lets some torque noise through
)

OF_ANGLE = ("unbalance", "cogging", "velocity_ripple")


class Fitter:
    """How a model is fitted to one problem."""

    def __init__(self, problem: Problem, driven: Driven) -> None:
        self.problem, self.driven = problem, driven

    def only_noise(self, fit: Fit, slack: float = 1.1) -> bool:
        """Whether a fit leaves, whitened, no more than `slack` times the noise that the measured velocity itself shows."""
        return bool(np.sqrt(fit.cost / self.problem.count) < slack * self.driven.noise)

    def runs_free(self, fit: Fit, slack: float = 1.1) -> bool:
        """Whether the free run of the loop, too, misses the velocity by little more than its noise."""
        if not self.driven.loopable:
            return self.only_noise(fit, slack)
        looped = replace(fit.layout, looped=True)
        cost = float(self.problem.costs(looped, fit.x[None, :], WHITE)[0])
        return self.only_noise(fit, slack) and bool(np.sqrt(cost / self.problem.count) < FREE_RUN * self.driven.noise)

    def in_loop(self, fit: Fit) -> Fit:
        """The better of both views: where the best candidate was judged in the loop, all have to be."""
        if fit.layout.looped or not self.driven.loopable:
            return fit
        looped = replace(fit.layout, looped=True)
        return min((fit, self.problem.settled(self.problem.fit(looped, fit.x, WHITE, 8))), key=lambda f: f.bic)

    def as_filter(self, fit: Fit) -> Fit:
        """A torque lag as a velocity filter beside an effect of the angle, where that is better.

        Alone they are the same. But the angle of a filtered velocity is late, and so is not what the ripple turns with.
        """
        if "torque_lag" not in fit.effects or not set(fit.effects) & set(OF_ANGLE) or self.driven.angle_logged:
            return fit
        z = fit.x[fit.layout.slot("torque_lag")]
        short = fit.layout.without("torque_lag")
        x = short.inserted(fit.layout.removed(fit.x, "torque_lag"), z)
        return min(
            (fit, self.problem.settled(self.problem.fit(short.extended("velocity_filter"), x, WHITE, 12))), key=lambda f: f.bic
        )

    def finished(self, fit: Fit) -> Fit:
        """A short fit taken to the end, under the filter of what it leaves itself."""
        fit = self.problem.settled(fit if fit.converged else self.problem.fit(fit.layout, fit.x, fit.noise, 8))
        # Found in the loop's grip or with the measured angle, the parameters may be good enough for a view that sees more.
        views = [replace(fit.layout, looped=False)] if fit.layout.looped and not self.driven.loop_only else []
        if not fit.layout.own_angle and not self.driven.angle_logged and set(fit.effects) & set(OF_ANGLE):
            views.append(replace(fit.layout, own_angle=True))
        tries = [self.problem.settled(self.problem.fit(view, fit.x, WHITE, 8)) for view in views]
        return min((fit, *tries), key=lambda f: f.bic)

    def rescued(self, best: Fit, base: Fit, rough: Sequence[str], threshold: float) -> Fit:
        """Where more than noise is left at the end: a global search for each of these effects alone."""
        for effect in rough:
            layout = replace(base.layout.extended(effect), looped=self.driven.loopable)
            rows = np.array(CANDIDATES[effect].starts(layout.scales))
            if len(rows) == 0:
                continue
            X = np.vstack([base.layout.inserted(base.x, z) for z in rows])
            x = X[int(np.argmin(self.problem.costs(layout, X, WHITE)))]
            fit = self.searched(self.problem.judged(self.problem.fit(layout, x, WHITE, 5)))
            if best.bic - fit.bic > threshold:
                best = fit
        return best

    def polished(self, fit: Fit) -> Fit:
        """Where more than noise is left: every effect from all of its starts again, rough ones by a global search nearby."""
        for effect in fit.effects[::-1]:
            if self.only_noise(fit):
                break
            fit = min((fit, self.restarted(fit, effect)), key=lambda f: f.bic)
            if CANDIDATES[effect].rough and not self.only_noise(fit):
                fit = min((fit, self.searched(fit)), key=lambda f: f.bic)
        return fit

    def restarted(self, fit: Fit, effect: str) -> Fit:
        """The best fit from an effect's starts, with the rest as it stands: the first began far from the rest's final values."""
        rows = CANDIDATES[effect].starts(fit.layout.scales)
        if len(rows) == 0:
            return fit
        limits = np.array(CANDIDATES[effect].limits(fit.layout.scales)).T
        X = np.repeat(fit.x[None, :], len(rows), axis=0)
        X[:, fit.layout.slot(effect)] = np.clip(np.array(rows), *limits)
        order = np.argsort(self.problem.costs(fit.layout, X, fit.noise))[:3]
        tries = [self.problem.judged(self.problem.fit(fit.layout, X[i], WHITE, 8)) for i in order]
        best = min(tries, key=lambda f: f.bic)
        return self.problem.settled(self.problem.fit(best.layout, best.x, WHITE, 12))

    def searched(self, fit: Fit) -> Fit:
        """Differential evolution around a fit: a stop or an impact more or less makes valleys that no slope leads out of."""
        from scipy.optimize import differential_evolution

        layout = replace(fit.layout, looped=self.driven.loopable)
        limits, steps = layout.limits(), layout.steps()
        reach = np.where(np.arange(layout.size) < layout.base, 0.15 * np.maximum(np.abs(fit.x), 0.3), 0.7 * steps)
        reach[0] = 0.15
        moved = np.flatnonzero(steps > 0.0)
        low, high = np.maximum(fit.x - reach, limits[0])[moved], np.minimum(fit.x + reach, limits[1])[moved]
        if np.any(low >= high) or not np.all(np.isfinite(fit.x)):
            return fit
        start = low + (high - low) * np.clip((fit.x[moved] - low) / (high - low), 1e-6, 1.0 - 1e-6)

        def costs(columns: NDArray[np.float64]) -> Vector:
            X = np.repeat(fit.x[None, :], columns.shape[1], axis=0)
            X[:, moved] = columns.T
            return np.log(self.problem.costs(layout, X, WHITE))

        found = differential_evolution(
            costs, list(zip(low, high, strict=True)), popsize=6, maxiter=50, x0=start, rng=0, vectorized=True,
            updating="deferred", polish=False, tol=1e-4, mutation=(0.4, 0.9), recombination=0.9,
        )  # fmt: skip
        x = fit.x.copy()
        x[moved] = found.x
        return self.finished(self.problem.fit(layout, x, WHITE, 15))
