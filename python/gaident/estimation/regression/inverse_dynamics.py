"""Inverse-dynamics regression: the torque that a motion needs, by least squares. No search and no simulation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import TURN, Text, checked_axis, percent, say, turns
from gaident.checks import LONGEST, is_whole, real_number
from gaident.data.record import Record
from gaident.data.signals.arrays import is_number
from gaident.errors import RecordError, SettingsError
from gaident.estimation.criterion import bic, effective_samples
from gaident.estimation.regression.motion import ORDER, cutoff_of, noise_share
from gaident.estimation.regression.regression import covariance, solve
from gaident.estimation.regression.rows import Rows, decimation_of, rows_of
from gaident.estimation.regression.torque_terms import CHOICES, TERMS, estimates_of
from gaident.policy.table import POLICY
from gaident.results.inverse_dynamics import InverseDynamics

__all__ = ["inverse_dynamics"]

Vector = NDArray[np.float64]


def inverse_dynamics(
    rec: Record | Sequence[Record],
    *,
    terms: Sequence[str] | None = None,
    cutoff_hz: float | None = None,
    order: int = ORDER,
    decimation: int | None = None,
    standstill: float | None = None,
    validation: Record | Sequence[Record] | None = None,
    axis: str = "rotary",
) -> InverseDynamics:
    """Write the torque of an axis as a sum of inertia, friction, load, gravity and spring, by least squares.

        u = J a + B w + C sign(w) + T + D w|w| + A sin(theta + phase) + K theta

    All channels pass the same zero-phase filter; velocity and acceleration are central differences of the position, or, where
    none is logged, the velocity and its differences. The columns and the torque are then low-passed alike and decimated.
    Samples with a velocity below three deviations of its noise, or below 0.5 % of its rms, and those within 1/cutoff of
    them, are left out: dry friction at standstill is whatever the other torques are.
    The terms are those with the smallest BIC over the number of independent samples;
    gravity, a spring, a drag and friction by direction also have to take 5 % of the sum of squares.
    Gravity is tried from a sixth of a turn of travel on, a spring to ground in its place.
    Theory: docs/theory/inverse-dynamics.md.

    Parameters
    ----------
    rec : Record or sequence of Record
        One Record or several of one sample time; one set of parameters for all. Each needs its torque.
    terms : sequence of str, optional
        Names of terms, or None to let the criterion choose: "inertia", "viscous" or "viscous_by_direction", "coulomb" or
        "coulomb_by_direction", "offset", "drag", "gravity", "spring".
    cutoff_hz : float, optional
        Corner of the filter [Hz].
        None: the highest at which noise is at most 0.1 % of the acceleration's power, at most a tenth of the sample rate.
    order : int
        Order of the Butterworth filter, 1 to 10; it runs forward and backward.
    decimation : int, optional
        Every so many samples one row. None: one row for each 1/cutoff_hz.
    standstill : float, optional
        Velocity up to which the axis stands [rad/s]. None: the rule above. 0.0: nothing is left out, as in the literature.
    validation : Record or sequence of Record, optional
        Records that are not fitted, for the held-out force error.
        None: the last samples in motion of each record are held out from a second fit of the same terms, see `held_out`.
    axis : {"rotary", "linear"}
        "rotary" or "linear" (m, m/s, N). Gravity depends on the angle of a rotary axis only.

    Returns
    -------
    InverseDynamics
        Frozen: `parameters`, `terms`, the filter as it was used, `force_error`, `torque(record)`, `summary()`.

    Raises
    ------
    RecordError
        No torque, unequal sample times, too little motion, or a term that the motion does not show.
    SettingsError
        A setting out of its range.

    References
    ----------
    M. Gautier, "Dynamic identification of robots with power model", ICRA 1997.
    A. Janot, P.-O. Vandanjon, M. Gautier, "A generic instrumental variable approach for industrial robot identification",
    IEEE Transactions on Control Systems Technology 22(1):132-145, 2014.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> t = 1e-3 * np.arange(4000)
    >>> angle, w, a = 1 - np.cos(5 * t), 5 * np.sin(5 * t), 25 * np.cos(5 * t)
    >>> rec = ga.Record(1e-3, velocity=w, position=angle, torque=2e-3 * a + 0.01 * w + 0.1 * np.sign(w))
    >>> found = ga.inverse_dynamics(rec, terms=("inertia", "viscous", "coulomb"))
    >>> {name: round(e.value, 3) for name, e in found.parameters.items()}
    {'inertia': 0.002, 'viscous': 0.01, 'coulomb': 0.1}
    """
    records = _checked(rec, "rec")
    checked_axis(axis)
    # no decision: what an argument may be
    if not is_whole(order) or not 1 <= order <= 10:
        raise SettingsError(f"order={order!r}: give a whole number from 1 to 10, the filter's order in each direction")
    nyquist = 0.5 / records[0].dt  # no decision: a formula: the Nyquist frequency
    cutoff = (
        min(cutoff_of(r, order) for r in records) if cutoff_hz is None else _number(cutoff_hz, "cutoff_hz", "the corner in Hz")
    )
    if not 1.0 / LONGEST <= cutoff < nyquist:
        remedy = f"give a corner between {1.0 / LONGEST:g} and {nyquist:g} Hz, half the sample rate, or None"
        raise SettingsError(f"cutoff_hz={cutoff_hz!r}: {remedy}")
    if standstill is not None and not _number(standstill, "standstill", "a velocity in rad/s") >= 0.0:
        raise SettingsError(f"standstill={standstill!r}: give a velocity from 0 on in rad/s, or None")
    factor = decimation_of(decimation, cutoff, records[0].dt)

    asked = None if terms is None else _known_terms(terms)
    everything = tuple(TERMS)
    rows = [rows_of(r, everything, cutoff, int(order), factor, standstill) for r in records]
    count = sum(len(r.torque) for r in rows)
    if count < POLICY.least_rows:
        raise RecordError(
            f"only {count} rows are left in motion of {sum(map(len, records))} samples (cutoff {cutoff:g} Hz, every "
            f"{factor}th sample), but at least {POLICY.least_rows} are needed; give a record that moves more, or a higher "
            "cutoff_hz"
        )
    refused = _refused(records, rows, axis)
    if asked is not None:
        for name in asked:
            if name in refused:
                raise RecordError(f"terms has {name!r}, but {refused[name]}; leave it out, or give a record that shows it")
    possible = [asked] if asked is not None else [c for c in CHOICES if not set(c) & set(refused)]
    fits = {c: _fitted(rows, c) for c in possible}
    lefts = {c: [r.torque - r.of(c) @ theta for r in rows] for c, (theta, _) in fits.items()}
    squares = {c: sum(float(np.sum(x**2)) for x in left) for c, left in lefts.items()}
    if asked is None:
        possible = [c for c in possible if _exists(c, fits[c][0])] or possible
    n_eff = _effective({c: lefts[c] for c in possible}, fits)
    squares = {c: squares[c] for c in possible}
    scores = {c: bic(squares[c] / count, n_eff, _count(c)) for c in possible}
    chosen = _material(min(possible, key=lambda c: (scores[c], len(c))), squares)
    (theta, rank), left = fits[chosen], lefts[chosen]
    X = [r.of(chosen) for r in rows]
    cov = covariance(X, left)
    result = InverseDynamics(
        parameters=estimates_of(chosen, theta, cov, axis),
        terms=chosen,
        coefficients=tuple(float(x) for x in theta),
        cutoff_hz=cutoff,
        order=int(order),
        decimation=factor,
        axis=axis,
        dt=records[0].dt,
        standstill=standstill,
        slowest=max(r.threshold for r in rows),
        samples=count,
        effective_samples=n_eff,
        noise_share=max(noise_share(r, cutoff, int(order)) for r in records),
        force_error=_relative(left, rows),
        force_error_held_out=float("nan"),
        held_out="",
        rivals=_rivals(scores, chosen),
        not_tried=() if asked is not None else tuple(say("{}: {}", name, reason) for name, reason in refused.items()),
        digests=tuple(r.digest for r in records),
        terms_not_tried=() if asked is not None else tuple(refused),
    )
    if rank < len(theta):
        result = replace(result, not_tried=(*result.not_tried, "the motion does not tell all terms apart: deviations of inf"))
    error, held_out = _held_out(rows, result, validation)
    return replace(result, force_error_held_out=error, held_out=held_out)


def _checked(rec: Record | Sequence[Record], argument: str) -> list[Record]:
    records = [rec] if isinstance(rec, Record) else list(rec) if isinstance(rec, Iterable) else []
    if not records or not all(isinstance(r, Record) for r in records):
        raise RecordError(f"{argument} is {rec!r}: give a Record or a list of Records")
    for i, r in enumerate(records):
        if r.torque is None:
            raise RecordError(
                f"{argument}[{i}] {r.name!r} has no torque, which this regression explains; log it, or use identify"
            )
        if r.dt != records[0].dt:
            raise RecordError(
                f"{argument}[{i}] has dt={r.dt:g} s, the first record {records[0].dt:g} s; bring them to one sample time, "
                "for example with decimate"
            )
    return records


def _number(value: object, argument: str, what: str) -> float:
    if not is_number(value):
        raise SettingsError(f"{argument}={value!r} is no number; give {what}, or None")
    return real_number(value, argument, SettingsError, f"give {what}, or None")


def _known_terms(terms: Sequence[str]) -> tuple[str, ...]:
    names = (terms,) if isinstance(terms, str) else tuple(terms) if isinstance(terms, Iterable) else ()
    unknown = [name for name in names if not isinstance(name, str) or name not in TERMS]
    if unknown or not names:
        raise SettingsError(f"terms={terms!r}: give names of {', '.join(TERMS)}")
    for one, other in (
        ("viscous", "viscous_by_direction"),
        ("coulomb", "coulomb_by_direction"),
        ("offset", "coulomb_by_direction"),
    ):
        if one in names and other in names:
            raise SettingsError(f"terms={terms!r}: {one} and {other} are the same columns; give one of them")
    return tuple(name for name in TERMS if name in names)


def _refused(records: Sequence[Record], rows: Sequence[Rows], axis: str) -> dict[str, Text]:
    """Term -> why these records cannot show it."""
    velocity = np.concatenate([r.of(("viscous",))[:, 0] for r in rows])
    travel = max(r.travel for r in rows)
    refused: dict[str, Text] = {}
    slower = min(np.count_nonzero(velocity > 0.0), np.count_nonzero(velocity < 0.0))
    if slower < max(POLICY.least_rows // 2, POLICY.both_ways * len(velocity)):
        why = say(
            "the velocity hardly changes its sign: dry friction and a constant {torque} cannot be told apart, offset is both"
        )
        refused |= dict.fromkeys(("viscous_by_direction", "coulomb", "coulomb_by_direction"), why)
    if axis == "linear":
        refused["gravity"] = Text("on a linear axis gravity is the same everywhere, and part of the offset")
    elif travel < POLICY.gravity_turn * TURN:
        refused["gravity"] = Text(
            f"the travel is {travel:.2g} rad, and gravity shows from a sixth of a turn on, {POLICY.gravity_turn * TURN:.3g} rad"
        )
    if axis == "rotary" and travel > POLICY.spring_turns * TURN:
        refused["spring"] = say("the travel is {}, and a spring to ground ends after ten", turns(travel, 3))
    return refused


def _fitted(rows: Sequence[Rows], terms: tuple[str, ...]) -> tuple[Vector, int]:
    return solve(np.vstack([r.of(terms) for r in rows]), np.concatenate([r.torque for r in rows]))


def _exists(terms: tuple[str, ...], theta: Vector) -> bool:
    """Whether an axis can be so: inertia, dry friction, drag and the stiffness of a spring are positive.

    Viscous friction is, too, but beside dry friction alone, which may fall with the speed.
    """
    values = dict(zip((p.name for t in terms for p in TERMS[t].parameters), theta, strict=True))
    falls = "coulomb" in terms and "drag" not in terms
    positive = ("inertia", "coulomb", "drag", "spring", *(() if falls else ("viscous",)))
    return all(values.get(name, 1.0) > 0.0 for name in positive)


def _count(terms: tuple[str, ...]) -> int:
    return sum(len(TERMS[name].parameters) for name in terms)


def _material(best: tuple[str, ...], squares: dict[tuple[str, ...], float]) -> tuple[str, ...]:
    """The best choice without the generalisations that take less than 5 % of the sum of squares.

    A misfit that returns with every stroke looks like many independent samples of a small spring; the criterion does not know.
    """
    for simpler in (_without_angle, _without_drag, _common):
        other = simpler(best)
        if other in squares and squares[best] > (1.0 - POLICY.material_column) * squares[other]:
            best = other
    return best


def _without_angle(terms: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for name in terms if name not in ("gravity", "spring"))


def _without_drag(terms: tuple[str, ...]) -> tuple[str, ...]:
    """With viscous friction alone in the place of a drag."""
    return tuple(name for name in TERMS if name in {*terms, "viscous"} - {"drag"}) if "drag" in terms else terms


def _common(terms: tuple[str, ...]) -> tuple[str, ...]:
    """Friction of both directions alike, with a constant."""
    if "viscous_by_direction" not in terms:
        return terms
    return ("inertia", "viscous", "coulomb", "offset", *(name for name in terms if name in ("gravity", "spring")))


def _rivals(scores: dict[tuple[str, ...], float], chosen: tuple[str, ...]) -> tuple[tuple[tuple[str, ...], float], ...]:
    worse = {c: score - scores[chosen] for c, score in scores.items() if c != chosen}
    return tuple(sorted(((c, d) for c, d in worse.items() if d < POLICY.rival_margin), key=lambda item: item[1]))


def _effective(lefts: dict[tuple[str, ...], list[Vector]], fits: dict[tuple[str, ...], tuple[Vector, int]]) -> float:
    """Independent samples of the residuals of the choice that leaves least, at least two for each column."""
    best = min(lefts, key=lambda c: sum(float(x @ x) for x in lefts[c]))
    # no decision: a formula: no fewer than the fit has numbers twice
    return max(effective_samples(*lefts[best]), 2.0 * len(fits[best][0]))


def _relative(left: Sequence[Vector], rows: Sequence[Rows]) -> float:
    whole = float(np.sqrt(sum(float(r.torque @ r.torque) for r in rows)))
    return float(np.sqrt(sum(float(x @ x) for x in left))) / whole if whole > 0.0 else float("nan")


def _held_out(rows: Sequence[Rows], result: InverseDynamics, validation: Record | Sequence[Record] | None) -> tuple[float, str]:
    """(relative force error on data that were not fitted, which data)."""
    if validation is not None:
        others = _checked(validation, "validation")
        if {r.digest for r in others} & set(result.digests):
            raise RecordError("a validation record is one that is fitted; give another record, or None")
        return result.error(others), "validation records"
    first, last = zip(*(r.split(POLICY.fitted_share) for r in rows), strict=True)
    theta, rank = _fitted(first, result.terms)
    if rank < len(theta):
        part = percent(POLICY.fitted_share)
        return float("nan"), f"no part: the first {part} of the samples in motion do not determine the terms"
    which = f"the last {percent(1.0 - POLICY.fitted_share)} of the samples in motion"
    return _relative([r.torque - r.of(result.terms) @ theta for r in last], last), which
