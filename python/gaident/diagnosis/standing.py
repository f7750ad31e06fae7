"""Is a finding a cause, or does it only describe what the library does not hold?

A finding is withdrawn where a free function of one signal in its place explains more, and where what is left, in the finding's
own domain, is of the finding's size. But whitened gains judge by what is fast, and in a record of next to no noise a small misfit
of the true cause is as significant as the cause itself. So a finding stands where it leaves next to nothing of the free-run error
that there is to explain. With V the sum of squared plain errors, all linear parts refitted: without the finding, with it, and
with any function of the driver beside it,

    share = (V_without - V_with) / (V_without - V_free)

Measured: square-root drag 0.77 to 0.87 by whatever friction comes closest, friction that varies with the angle 0.44 to 0.71; the
friction of a real ball-screw axis (EMPS) 0.997, beside a remainder that is significant all the same.
"""

from __future__ import annotations

import numpy as np

from gaident.diagnosis.candidates import CANDIDATES
from gaident.diagnosis.leftover import Leftover, leftover
from gaident.diagnosis.noise_filter import WHITE
from gaident.diagnosis.problem import Fit
from gaident.diagnosis.stepwise import MARGIN, Search

__all__ = ["only_describes", "share", "simplified"]

STANDS = 0.95
"""Share of what a free function of the driver could explain from which a finding stands as a cause."""

CLASS_STANDS = 0.5
"""The same for a class of effects that the record cannot split: it is no name, and nothing else in the library does as much."""

OF_ITS_SIZE = 0.25  # part of a finding's gain that a free function may still find beside it

DOMAINS: dict[str, str] = {
    **dict.fromkeys(("coulomb_friction", "stribeck_friction", "asymmetric_friction", "quadratic_drag"), "velocity"),
    "presliding_friction": "past",
    "friction_drift": "time",
    "load_torque": "time",
    **dict.fromkeys(("unbalance", "cogging", "velocity_ripple"), "position"),
    **dict.fromkeys(("torque_saturation", "torque_dead_band"), "torque"),
    **dict.fromkeys(("backlash", "hardening_stiffness"), "past"),
}
FRICTION_DOMAIN = {"velocity", "position", "past", "time"}


def only_describes(
    search: Search, final: Fit, effect: str, gain: float, driver: str | None, left: Leftover, of_class: bool
) -> bool:
    """Whether a finding of this gain [BIC units] describes something that is not in the library.

    of_class: the record cannot split it from other effects, whatever its noise, and it is reported with them.
    """
    without = search.without(final, effect)
    instead = leftover(search.problem, search.driven, without).gains
    doubtful = max(instead.values()) > gain + MARGIN
    if not doubtful and driver is not None and left.gains[driver] >= OF_ITS_SIZE * gain:
        domain = DOMAINS.get(effect)
        doubtful = domain == driver or (domain in FRICTION_DOMAIN and driver in FRICTION_DOMAIN)
    return doubtful and share(search, without, final, left) < (CLASS_STANDS if of_class else STANDS)


def simplified(search: Search, final: Fit, left: Leftover) -> Fit:
    """A generalisation back to the simpler effect, where as much is left as the detail explains: it describes the rest."""
    driver = left.driver
    if driver is None:
        return final
    for effect in final.effects:
        for parent in CANDIDATES[effect].parents:
            simpler = search.as_parent(final, effect, parent)
            of_its_size = left.gains[driver] > OF_ITS_SIZE * (simpler.bic - final.bic)
            if of_its_size and share(search, simpler, final, left) < STANDS:
                return simpler
    return final


def share(search: Search, without: Fit, final: Fit, left: Leftover) -> float:
    """The part that `final` explains of what it and a free function of the strongest driver explain together."""
    problem = search.problem
    less = problem.fit(without.layout, without.x, WHITE, 8)
    before, after = (problem.plain(J, e) for _, J, e in (problem.linearised(f.layout, f.x, WHITE) for f in (less, final)))
    free = min(left.least.values())
    return float((before - after) / np.maximum(before - free, 1e-300))
