"""What shows friction without a simulation: the torque close to a reversal, and a rest under a torque that changes.

    u = J a + B w + C sign(w) + D cbrt(w) + T (+ gravity or a spring)

Dry friction is the one torque that jumps where the velocity changes its sign.
A regression without D finds a jump in every drag that rises steeply from zero, as of a root,
and with many samples a very significant one.
The column cbrt(w) rises more steeply than such a drag: with it C is what remains of the torque close to the reversal,
or has a wide deviation where the motion shows too little of that.
D beyond its deviation is a drag that rises more steeply from rest than viscous friction does, with or without a jump:
where it is as large at the higher speeds alone. A friction that is smaller close to rest has a D of all speeds, and none there.
What else the axis has, a friction that depends on load, angle or time, stays in the residuals, and in the deviations,
which know that neighbouring residuals are alike.

An axis that rests while its torque changes by 2 H is held by dry friction of at least H: a drag needs a velocity, a load and
gravity are constant at one angle. No model, and no motion, is needed for that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.estimation.regression.inverse_dynamics import inverse_dynamics
from gaident.estimation.regression.motion import ORDER, cutoff_of, motion_of, torque_noise
from gaident.estimation.regression.regression import covariance, solve
from gaident.estimation.regression.rows import rows_of
from gaident.estimation.regression.torque_terms import STEEP_DRAG, estimates_of
from gaident.results.estimate import Estimate

__all__ = ["jump_at_reversal", "steep_drag", "torque_held_at_rest"]


DIRECTED = ("coulomb_by_direction", "offset")  # the same columns as dry friction and a constant


def jump_at_reversal(records: Sequence[Record], cutoff_hz: float | None = None) -> Estimate | None:
    """Half the jump of the torque where the velocity changes its sign, beside the steepest drag [N m].

    None where no regression of these records can show it: no torque, too little motion, or motion in one direction only.

    Parameters
    ----------
    records : sequence of Record
        Of one axis, with torque.
    cutoff_hz : float, optional
        Corner of the filter [Hz]; None: that of `inverse_dynamics`.

    Returns
    -------
    Estimate or None
        C with its standard deviation.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> t = 1e-3 * np.arange(8000)
    >>> angle, w, a = 1 - np.cos(5 * t), 5 * np.sin(5 * t), 25 * np.cos(5 * t)
    >>> dry, root = 0.1 * np.sign(w), 0.1 * np.sign(w) * np.sqrt(np.abs(w))
    >>> for drag in (dry, root):
    ...     e = jump_at_reversal([ga.Record(1e-3, velocity=w, position=angle, torque=2e-3 * a + 0.01 * w + drag)])
    ...     print(round(e.value, 2))
    0.1
    0.02
    """
    found = _close_to_reversal(records, cutoff_hz)
    return None if found is None else found["coulomb"]


def steep_drag(records: Sequence[Record], cutoff_hz: float | None = None, above: float = 0.0) -> Estimate | None:
    """The drag that rises more steeply from rest than viscous friction, beside a jump: D [N m (s/rad)^(1/3)].

    It is no physical number: a root of the speed shows in it as well as cbrt(w) does. Its deviation says whether there is one.
    above: share of the largest speed, below which no row counts. None, and the other arguments: as of `jump_at_reversal`.
    """
    found = _close_to_reversal(records, cutoff_hz, above)
    return None if found is None else found[STEEP_DRAG]


def _close_to_reversal(records: Sequence[Record], cutoff_hz: float | None, above: float = 0.0) -> dict[str, Estimate] | None:
    """The terms of a regression with dry friction and a steep drag; None where these records cannot show them."""
    try:
        found = inverse_dynamics(list(records), cutoff_hz=cutoff_hz)
    except GaidentError:
        return None
    if "coulomb" in found.terms_not_tried:
        return None
    kept = tuple(t for t in found.terms if t not in (*DIRECTED, "coulomb"))
    viscous = () if any(t.startswith("viscous") for t in kept) else ("viscous",)
    terms = (*kept, *viscous, "coulomb", "offset", STEEP_DRAG)
    rows = [rows_of(r, terms, found.cutoff_hz, found.order, found.decimation, None) for r in records]
    speeds = [np.abs(r.of((STEEP_DRAG,))[:, 0]) ** 3 for r in rows]
    least = above * max((float(w.max()) for w in speeds if len(w)), default=0.0)
    X = [r.columns[w >= least] for r, w in zip(rows, speeds, strict=True)]
    torque = [r.torque[w >= least] for r, w in zip(rows, speeds, strict=True)]
    theta, rank = solve(np.vstack(X), np.concatenate(torque))
    if rank < len(theta):
        return None
    left = [u - x @ theta for u, x in zip(torque, X, strict=True)]
    estimates = estimates_of(terms, theta, covariance(X, left), found.axis)
    return {name: replace(e, identifiable=bool(e.std < abs(e.value))) for name, e in estimates.items()}


def torque_held_at_rest(records: Sequence[Record], cutoff_hz: float | None = None) -> Estimate | None:
    """Half the range of the torque within one rest, the largest of all rests: dry friction is no smaller [N m].

    A rest is where the velocity stays below the regression's threshold of standstill, for two periods of the cutoff at least.
    None where the axis never rests, or the records have no torque.

    Parameters
    ----------
    records : sequence of Record
        Of one axis, with torque.
    cutoff_hz : float, optional
        Corner of the filter [Hz]; None: that of `inverse_dynamics`.

    Returns
    -------
    Estimate or None
        With the standard deviation that the noise of the torque leaves behind the filter.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> torque = np.linspace(-0.3, 0.5, 4000)  # dry friction of 0.4 N m holds the axis until it breaks away
    >>> velocity = np.concatenate([np.zeros(4000), np.linspace(0.0, 20.0, 1000)])
    >>> rec = ga.Record(1e-3, velocity=velocity, torque=np.concatenate([torque, np.full(1000, 0.5)]))
    >>> round(torque_held_at_rest([rec]).value, 2)
    0.4
    """
    best: Estimate | None = None
    for rec in records:
        if rec.torque is None:
            return None
        cutoff = cutoff_of(rec, ORDER) if cutoff_hz is None else cutoff_hz
        motion = motion_of(rec, cutoff, ORDER)
        assert motion.torque is not None
        resting = np.abs(motion.velocity) <= motion.threshold
        edges = np.flatnonzero(np.diff(np.concatenate([[False], resting, [False]])))
        # Within a period of the cutoff of the motion the filtered torque is not that of the rest.
        margin = max(1, round(1.0 / (cutoff * rec.dt)))
        for first, last in zip(edges[::2] + margin, edges[1::2] - margin, strict=True):
            if last - first < 2 * margin:
                continue
            level = 0.5 * float(np.ptp(motion.torque[first:last]))  # no decision: a formula: H is half the range
            if best is None or level > best.value:
                best = Estimate(level, torque_noise(rec, cutoff, ORDER), "N m")
    return best
