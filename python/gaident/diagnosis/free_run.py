"""A second way through the effects: what the free run of the whole loop misses, judged without any noise filter.

Two effects at once may pass for noise: what a limit inside the controller leaves of a torque-driven model adds up like a random
torque, and dry friction on top of it gains nothing before the limit is known, nor the limit before the friction. A filter that
swallows both leaves no first step. The free run cannot be swallowed: the loop holds the model, so that its plain error

    e(n) = w(n) - w_loop(n; x),   V = sum of e^2

stays small where the model is right, whatever torques nobody commanded. Here V alone decides, and several models are carried
on side by side, because of two effects either one may explain less than some third does. Whether the end is worth anything is
for the BIC to say, each hypothesis with its own filter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from gaident.diagnosis.candidates import FRICTION
from gaident.diagnosis.fitter import Fitter
from gaident.diagnosis.layout import Layout, as_two_masses, swings
from gaident.diagnosis.noise_filter import WHITE
from gaident.diagnosis.problem import WORST, Fit
from gaident.diagnosis.screening import Screening

__all__ = ["by_free_run"]

BEAM = 4  # models that are carried on
FITTED = 6  # candidates beside each that get a short fit
QUIET = 1.3  # times the noise of the measured velocity: nothing is left to explain
TWIN = {"velocity_filter": "torque_lag"}  # one of the two is enough
FALL = 0.1  # part of V beyond the noise that a step has to explain


def by_free_run(fitter: Fitter, starts: Sequence[Fit], candidates: Callable[[Layout], Sequence[str]], most: int) -> list[Fit]:
    """Models of at most `most` effects, from the one on that misses the free run least; starts: linear, in the loop."""
    floor = fitter.problem.count * fitter.driven.noise**2
    beam, seen = list(starts), []
    best = min(beam, key=lambda f: f.bic)
    while len(best.effects) < most and QUIET**2 * floor < best.cost < WORST:
        grown: dict[tuple[int, frozenset[str]], Fit] = {}
        for fit in (f for now in beam for f in _extensions(fitter, now, candidates(now.layout))):
            key = (fit.layout.masses, frozenset(fit.effects))
            if key not in grown or fit.bic < grown[key].bic:
                grown[key] = fit
        short = sorted(grown.values(), key=lambda f: f.bic)
        # Two masses that do not swing stand for something else; what they lead to counts, not they.
        ends = (g for f in short[:BEAM] for g in _finished(fitter, f) if swings(g.layout, g.x))
        beam = sorted(ends, key=lambda f: f.bic)
        seen += [*beam, *(f for f in short[BEAM:] if swings(f.layout, f.x))]
        if not beam or best.cost - beam[0].cost < FALL * (best.cost - floor):
            break
        best = beam[0]
    return sorted(seen, key=lambda f: f.bic)


def _finished(fitter: Fitter, fit: Fit) -> list[Fit]:
    """Fitted to the end; an extra resonance as that of the shaft, too.

    On one mass it is a second mass, which may have a gap or a hard coupling then. On two masses whose own pair swings no more, as
    it stands for a filter or a delay, it is the true one.
    """
    layout, x = fit.layout, fit.x
    fits = []
    if "extra_resonance" in layout.effects:
        own, y = as_two_masses(layout, x)
        fits.append(fitter.problem.fit(own, y, WHITE, 12))
    if layout.masses == 2 or not fits:
        fits.append(fitter.problem.fit(layout, x, WHITE, 12))
    return fits


def _extensions(fitter: Fitter, now: Fit, effects: Sequence[str]) -> list[Fit]:
    """Short fits with one effect more; of the friction family only the first, the others take its place later."""
    screening = Screening(fitter.problem, fitter.driven)
    screening.add(now.layout, now.x, [e for e in effects if e not in FRICTION[1:] and TWIN.get(e) not in effects])
    fits = []
    for s in screening.ranked(WHITE)[:FITTED]:
        tries = [fitter.problem.fit(s.layout, x, WHITE, 4) for x in s.starts[:2]]
        fits.append(min(tries, key=lambda f: f.bic))
    return [f for f in fits if np.isfinite(f.bic)]
