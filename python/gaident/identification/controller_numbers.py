"""The numbers of a controller that are given as None, from the logged torque.

The controller runs at its own clock on the logged command and velocity; what it makes at the lines of the log is compared with
the logged torque, and the numbers are those with the least squares of what is left. No plant is involved.

    d(k) = u_logged(k) - u(k; numbers),   k where no limit acts;   c(k) = d(k) - rho d(k-1),   sum (c - mean c)^2 -> min

The mean is taken of each stretch between two limits: what the integrator stored before it is free.
Between the lines of a slower log the velocity follows a cubic spline.
What it really did there is lost and adds up in the integrator: d is then a random walk, and rho,
its correlation from line to line, says how far (Cochrane and Orcutt 1949).
The gains are linear in u: for given filters and position gain they start from a linear least squares (`_linear_start`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text
from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.control.found import FoundNumbers, loosened
from gaident.control.pi import PI
from gaident.control.unknown import UNITS, field_of
from gaident.data.record import Record
from gaident.errors import ControllerError, RecordError
from gaident.estimation.criterion import effective_samples, gained
from gaident.identification import number_words
from gaident.identification.logged_stretches import centred, correlation, log_of, numbered, unlimited, whitened
from gaident.identification.number_ranges import EXCHANGEABLE, SMALLEST, exchanged, grid_of, inverse, off_bound, range_of, slopes
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["Numbers", "with_estimates"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

BOUNDED = ("kp", "ki", "command_weight")  # no controller has one below 0
GAINS = (*BOUNDED, "acceleration_feedforward", "friction_feedforward")
"""Linear in the torque; the others are searched by their logarithm, but a numerator's damping and a share."""
LOGARITHMIC = ("gain", "time_constant", "frequency", "denominator_damping")
DEVIATION_ROUNDING = 1e-12  # no decision: of the torque's deviation, what a sum is exact to


@dataclass(frozen=True)
class Numbers:
    """A controller with all its numbers, those that were estimated by their names (`Controller.unknown`), and a note on them.

    doubt: why these are no numbers of it, as an error; empty where they are. found: they vary together so. Others: see `_Solved`.
    """

    controller: Controller | None
    estimates: Mapping[str, Estimate]
    notes: tuple[Text, ...] = ()
    doubt: str = ""
    rms: float = 0.0
    size: float = 0.0
    samples: float = 1.0
    found: FoundNumbers | None = None

    def trusted(self) -> Numbers:
        """These; raises ControllerError where they are not to be trusted."""
        if self.doubt:
            raise ControllerError(self.doubt)
        return self


def with_estimates(records: Sequence[Record], controller: Controller | None) -> Numbers:
    """The controller with numbers for what is None, estimated from the records.

    Where its command may be read in several ways, the given one, but where the torque follows only, or clearly
    better, with another: a note says so.
    Raises RecordError where a record lacks the torque or what the controller reads.
    """
    if controller is None or not controller.unknown:
        return Numbers(controller, {})
    for rec in records:
        if why := number_words.lacking(rec, controller):
            raise RecordError(why)
    if not (given := _estimated(records, controller)).doubt and given.rms <= POLICY.negligible * given.size:
        return given
    others = [_estimated(records, one) for one in controller.readings(records[0].dt)[1:]]
    best = min((n for n in others if not n.doubt), key=lambda n: n.rms, default=given)
    gain = gained(given.rms**2, best.rms**2, min(given.samples, best.samples))
    if best is given or best.controller is None or (not given.doubt and gain <= POLICY.rival_margin):
        return given
    return replace(best, notes=(*best.notes, number_words.other_reading(best.controller, controller)))


def _estimated(records: Sequence[Record], controller: Controller) -> Numbers:
    """The same of one of these controllers."""
    unknown = controller.unknown
    records = sorted(records, key=lambda r: (r.digest, r.name))  # no sum depends on the order in which they were given
    numbers, shift = _shifted(controller, unknown, records, _solved(controller, unknown, records))
    values = {name: float(x) for name, x in zip(unknown, numbers.values, strict=True)}
    twin = numbers.twin
    apart = np.zeros(len(unknown)) if twin is None else np.where(np.isin(unknown, EXCHANGEABLE), twin - numbers.values, 0.0)
    stds = np.hypot(numbers.stds, apart).tolist()
    estimates = {
        name: Estimate(value, std, UNITS[field_of(name)], at_bound, std < abs(value))
        for (name, value), std, at_bound in zip(values.items(), stds, numbers.at_bound, strict=True)
    }
    doubt = ""
    hidden = [name for name, seen in zip(unknown, numbers.seen, strict=True) if not seen or estimates[name].at_bound]
    if not numbers.rms < POLICY.replay_noise * numbers.size:
        doubt = number_words.not_followed(unknown, numbers.rms, numbers.size) + _remedy(controller, records)
    elif negative := [(name, free) for name, free in zip(unknown, numbers.free, strict=True) if free < 0.0]:
        doubt = number_words.negative(*negative[0], estimates[negative[0][0]].unit)
    elif hidden:
        doubt = number_words.not_shown(hidden[0], estimates[hidden[0]])
    notes = [number_words.found(estimates, numbers.rms, numbers.size)]
    notes += [] if twin is None else [number_words.exchangeable(dict(zip(unknown, twin.tolist(), strict=True)))]
    notes += [number_words.moved(shift)] if shift else []

    def made(x: Vector) -> Controller:
        return controller.with_numbers(dict(zip(unknown, map(float, x), strict=True)))

    def named(x: Vector, spread: Matrix) -> dict[str, dict[str, tuple[float, float]]]:
        pairs = zip(unknown, x, np.hypot(np.sqrt(np.diag(spread)), apart), strict=True)
        return {"": {n: (float(v), float(s)) for n, v, s in pairs}}

    low = np.array([0.0 if field_of(name) in (*BOUNDED, *LOGARITHMIC, "numerator_damping") else -np.inf for name in unknown])
    spread = loosened(numbers.covariance) if any(controller.log_every(r.dt) > 1 for r in records) else numbers.covariance
    found = FoundNumbers(made, numbers.values, spread, low, named=named)
    solved = numbers.rms, numbers.size, numbers.samples
    return Numbers(controller.with_numbers(values), estimates, tuple(notes), doubt, *solved, found)


def _remedy(controller: Controller, records: Sequence[Record]) -> str:
    """What makes the torque follow: its other sign, or other gains where a gain was given; else what to look for."""
    reversed_torque = [r.with_channels(torque=-r.torque) for r in records if r.torque is not None]
    if _follows(controller, reversed_torque):
        return "It follows with the other sign: reverse the sign of the torque, or of command and velocity"
    pi = cascade_of(controller).velocity
    given = [name for name in ("kp", "ki") if getattr(pi, name) is not None]
    none: dict[str, Any] = {"kp": None, "ki": None}
    one = controller if isinstance(controller, PI) else cascade_of(controller)
    free = replace(one, **none) if isinstance(one, PI) else replace(one, velocity=replace(pi, **none))
    if given and _follows(free, records):
        return f"It follows with another {' and '.join(given)}: give {' and '.join(f'{name}=None' for name in given)}"
    return number_words.OTHER_FORM


def _follows(controller: Controller, records: Sequence[Record]) -> bool:
    solved = _solved(controller, controller.unknown, records)
    return solved.rms < POLICY.replay_noise * solved.size and all(solved.seen)


def _shifted(
    controller: Controller, unknown: tuple[str, ...], records: Sequence[Record], numbers: _Solved
) -> tuple[_Solved, int]:
    """The numbers, and by how many lines the torque was moved: 0, or where only so next to nothing is left of it, -1 or 1."""
    every = max(controller.log_every(r.dt) for r in records)
    if every > 1 or controller.driven_by != "command" or numbers.rms <= POLICY.negligible * numbers.size:
        return numbers, 0
    found = [(_solved(controller, unknown, [r.shifted(torque=k) for r in records]), k) for k in (-1, 1)]
    best, shift = min(found, key=lambda one: one[0].rms)
    return (best, shift) if best.rms**2 < POLICY.replay_left * numbers.rms**2 else (numbers, 0)


def _solved(controller: Controller, unknown: tuple[str, ...], records: Sequence[Record]) -> _Solved:
    """The numbers by the stretches between two limits, and where a limit is given by the controller with it, from rest: what
    leaves less. A limit inside of filters, or of the integral, cannot be cut out."""
    cascade = cascade_of(controller)
    pi, filtered = cascade.velocity, len(cascade.torque_filters) > 0
    inside = pi.integrator_limit is not None or (pi.torque_limit is not None and filtered)
    cut = None if inside else _Fit(controller, unknown, records, whole=False).solved()
    if pi.torque_limit is None and cut is not None:
        return cut
    run = _Fit(controller, unknown, records, whole=True).solved(None if cut is None else cut.x)
    return run if cut is None or run.rms < cut.rms else cut


@dataclass(frozen=True, eq=False)
class _Solved:
    """x, values, stds, at_bound, seen, free: one of each unknown; x as the search moves it.

    free: of a gain that stands at 0, what it would be without that bound where it is beyond its deviations; else 0.
    rms, size: of what is left, and of the torque where no limit acts [N m]. samples: how many independent ones are left.
    twin: other values that the torque does not tell from these (`number_ranges.exchanged`); None where there are none.
    """

    x: Vector
    values: Vector
    stds: list[float]
    at_bound: list[bool]
    seen: list[bool]
    free: list[float]
    rms: float
    size: float
    samples: float
    covariance: Matrix
    twin: Vector | None = None


class _Fit:
    """One estimation: the numbers x, one of each unknown, as the search moves them (`values`).

    whole: the controller runs with its limits; else without, on the stretches between them.
    """

    def __init__(self, controller: Controller, unknown: tuple[str, ...], records: Sequence[Record], whole: bool) -> None:
        self.given = controller
        self.unknown = unknown
        self.fields = [field_of(name) for name in unknown]
        share = max(POLICY.searched_samples // len(records), 1)
        cascade = cascade_of(controller)
        self.period = records[0].dt / cascade.log_every(records[0].dt)
        self.whole = whole
        self.logs = [log_of(rec, share, cascade, self.whole) for rec in records]
        self.from_rest = whole and not any(log.moving for log in self.logs)
        self.logged = np.concatenate([log.torque for log in self.logs])
        self.stretch = numbered([log.stretch for log in self.logs])
        self.used = self.stretch >= 0
        if np.sum(self.used) < POLICY.least_samples:
            raise RecordError(
                f"{unknown[0]} of the controller is None, not known, and the torque is at its limit, or the record only "
                f"begins, in all but {int(np.sum(self.used))} lines: log a longer motion, which asks for less, or give the number"
            )

    def solved(self, start: Vector | None = None) -> _Solved:
        """Grid, or a start; local searches, deviations."""
        low, high = np.array([range_of(field, self.period) for field in self.fields]).T
        free = self.free(0.0)
        points = self._starts() if start is None else [start]
        grid = sorted((float(np.sum(free(x) ** 2)), tuple(x)) for x in (np.clip(x, low, high) for x in points))
        off = self.free(0.0)
        enough = DEVIATION_ROUNDING * float(np.sum(self.logged[self.used] ** 2))
        tried: list[tuple[float, tuple[float, ...]]] = []
        for _, point in grid[: POLICY.best_points]:
            tried.append(self.searched(off, np.array(point), low, high, POLICY.usual))
            if min(tried)[0] <= enough:
                break
        found = self._finished(np.array(min(tried)[1]), low, high)
        if not all(found.seen) or (other := exchanged(self.unknown, found.x, cascade_of(self.given))) is None:
            return found
        twin = self._finished(np.clip(other, low, high), low, high)
        best, twin = (found, twin) if found.rms <= twin.rms else (twin, found)
        told = gained(twin.rms**2, best.rms**2, min(best.samples, twin.samples)) > POLICY.rival_margin
        pair = [self.unknown.index(name) for name in EXCHANGEABLE]
        apart = bool(np.any(np.abs(twin.values - best.values)[pair] > np.array(best.stds)[pair]))
        return best if told or not apart or any(twin.at_bound) else replace(best, twin=twin.values)

    def _finished(self, best: Vector, low: Vector, high: Vector) -> _Solved:
        rho = 0.0
        for _ in range(POLICY.rounds):
            best = np.array(self.searched(self.free(rho), best, low, high, POLICY.final)[1])
            rho = correlation(self.left(best), self.stretch)
        return self._judged(best, rho, low, high)

    def searched(
        self, off: Callable[[Vector], Vector], start: Vector, low: Vector, high: Vector, evaluations: int
    ) -> tuple[float, tuple[float, ...]]:
        """(sum of squares, x) of a local search."""
        from scipy.optimize import least_squares

        inside = off_bound(start, low, high)
        size = max(float(np.sqrt(np.mean(off(inside) ** 2))), DEVIATION_ROUNDING * float(np.std(self.logged)), SMALLEST)
        found = least_squares(
            lambda x: off(x) / size, inside, bounds=(low, high), x_scale="jac", xtol=1e-12, ftol=1e-10, gtol=1e-14,
            max_nfev=evaluations,
        )  # fmt: skip
        return float(np.sum(off(found.x) ** 2)), tuple(found.x)

    def values(self, x: Vector) -> Vector:
        """The numbers of what the search moves."""
        return np.array([np.exp(v) if field in LOGARITHMIC else v for v, field in zip(x, self.fields, strict=True)])

    def controller(self, x: Vector) -> Cascade:
        """The controller with these numbers; without limits where the stretches between them are fitted."""
        numbers = {
            name: max(float(v), 0.0) if field != "friction_feedforward" and not field.endswith("feedforward") else float(v)
            for name, field, v in zip(self.unknown, self.fields, self.values(x), strict=True)
        }
        cascade = cascade_of(self.given.with_numbers(numbers))
        return cascade if self.whole else replace(cascade, velocity=unlimited(cascade.velocity))

    def left(self, x: Vector, straight: bool = False) -> Vector:
        """Logged minus made torque [N m] at every line; straight: the velocity goes straight between the lines.

        In a log of means the torque shows how the velocity turns between the lines, where the command jumps.
        """
        cascade = self.controller(x)
        logs = [log.pushed(cascade) if log.mean else log for log in self.logs]
        left: Vector = self.logged - np.concatenate([log.made(cascade, straight) for log in logs])
        return left

    def free(self, rho: float, straight: bool = False) -> Callable[[Vector], Vector]:
        """x -> c without the mean of each stretch."""
        return lambda x: centred(*whitened(self.left(x, straight), self.stretch, rho), self.from_rest)

    def _starts(self) -> list[Vector]:
        """Points of the grid of what is not linear, each with the gains of a linear least squares."""
        lists = [grid_of(field, self.period) if field not in GAINS else [np.nan] for field in self.fields]
        points = list(product(*lists))
        if len(points) > POLICY.grid_points:
            points = [points[i] for i in np.random.default_rng(0).permutation(len(points))[: POLICY.grid_points]]
        return [self._linear_start(np.array(point)) for point in points]

    def _linear_start(self, x: Vector) -> Vector:
        """The gains that are nan, by linear least squares of the torque on what each makes alone."""
        gains = [i for i, field in enumerate(self.fields) if field in GAINS]
        if not gains:
            return x
        fields = [self.fields[i] for i in gains]
        rest = {n: float(v) for n, f, v in zip(self.unknown, self.fields, self.values(x), strict=True) if f not in GAINS}
        cascade = cascade_of(self.given.with_numbers({**rest, **{self.unknown[i]: 1.0 for i in gains}}))
        fed, given = cascade_of(self.given), cascade_of(self.given).velocity

        def made(**numbers: float) -> Vector:
            known: dict[str, Any] = {"kp": 0.0, "ki": 0.0, "command_weight": 0.0, **numbers}
            feeds: dict[str, Any] = {name: known.pop(name) for name in list(known) if name in GAINS[3:]}
            pi = replace(unlimited(cascade.velocity), **known)
            one = replace(cascade, velocity=pi, **{"acceleration_feedforward": 0.0, "friction_feedforward": 0.0, **feeds})
            return np.concatenate([log.made(one) for log in self.logs])

        minus_w = made(kp=1.0)
        parts = {
            "kp": minus_w,
            "command_weight": made(kp=1.0, command_weight=1.0) - minus_w,
            "ki": made(ki=1.0),
            **{name: made(kp=1.0, **{name: 1.0}) - minus_w for name in GAINS[3:]},
        }
        fixed = np.zeros(len(self.logged))
        columns: list[Vector] = []
        kp, weight = given.kp, 0.0 if given.command_weight is None else given.command_weight
        proportional = parts["kp"] + weight * parts["command_weight"]
        if "kp" in fields:
            columns.append(proportional)
        else:
            fixed += kp * proportional
        if "ki" in fields:
            columns.append(parts["ki"])
        else:
            fixed += given.ki * parts["ki"]
        if "command_weight" in fields:
            columns.append(parts["command_weight"])
        for name in GAINS[3:]:
            if name in fields:
                columns.append(parts[name])
            else:
                fixed += getattr(fed, name) * parts[name]
        order = [f for f in GAINS if f in fields]
        table = np.array([centred(*whitened(c, self.stretch, 0.0), False) for c in columns]).T
        wanted = centred(*whitened(self.logged - fixed, self.stretch, 0.0), False)
        sizes = np.linalg.norm(table, axis=0)
        sizes[sizes == 0.0] = 1.0
        solved = dict(zip(order, np.linalg.lstsq(table / sizes, wanted, rcond=1e-12)[0] / sizes, strict=True))
        if "command_weight" in solved:
            by = solved.get("kp", kp)
            solved["command_weight"] = solved["command_weight"] / by if by > 0.0 else 1.0
        started = x.copy()
        for i in gains:
            started[i] = solved[self.fields[i]]
        if "kp" in solved and "ki" in solved and solved["kp"] <= 0.0 and solved["ki"] <= 0.0:
            started[self.fields.index("kp")] = 1e-3 * float(np.std(self.logged))  # no decision: a start
        return started

    def _judged(self, x: Vector, rho: float, low: Vector, high: Vector) -> _Solved:
        off = self.free(rho)
        at = off(x)
        J = slopes(off, x, low)
        count = int(len(at) - len(x) - len(np.unique(self.stretch[self.used])))
        free_left = self.free(0.0)(x)
        size = float(np.std(self.logged[self.used]))
        sigma = max(float(np.sqrt(np.sum(at**2) / max(count, 1))), DEVIATION_ROUNDING * size)
        spread, back = inverse(J)
        # Where linear interpolation of the velocity, or another correlation, would have put the numbers.
        linear = back @ (self.free(rho, straight=True)(x) - at)
        uncorrelated = inverse(slopes(self.free(0.0), x, low))[1] @ free_left
        covariance = sigma**2 * spread + np.outer(linear, linear) + np.outer(uncorrelated, uncorrelated)
        stds, values = np.sqrt(np.diag(covariance)), self.values(x)
        units = np.array([v if f in LOGARITHMIC else 1.0 for v, f in zip(values, self.fields, strict=True)])
        natural = [float(s) for s in stds * units]
        own = [float(np.sqrt(np.mean(column**2))) for column in J.T]
        seen = [
            bool(np.isfinite(std)) and (std < abs(v) or std_x * rms < POLICY.negligible * size)
            for std, std_x, v, rms in zip(natural, stds, values, own, strict=True)
        ]
        near = 1e-6  # no decision: of a range, within which a search stands at its end
        wide = near * (high - low)
        at_end = np.isfinite(wide) & ((x - low < wide) | (high - x < wide))
        bound = [bool(end) and f not in (*GAINS, "numerator_damping") for end, f in zip(at_end, self.fields, strict=True)]
        beyond = x - back @ at
        rest = max(float(np.sqrt(np.sum((at + J @ (beyond - x)) ** 2) / max(count, 1))), DEVIATION_ROUNDING * size)
        own_std = rest * np.sqrt(np.diag(spread))
        free = [
            float(b) if f in BOUNDED and v <= near * abs(b) and b < -POLICY.check_deviations * s else 0.0
            for b, f, v, s in zip(beyond, self.fields, values, own_std, strict=True)
        ]
        rms = float(np.sqrt(np.mean(free_left**2)))
        samples = effective_samples(free_left)
        return _Solved(x, values, natural, bound, seen, free, rms, size, samples, covariance * np.outer(units, units))
