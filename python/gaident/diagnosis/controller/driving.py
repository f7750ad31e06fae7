"""The records as their controller drove them: what it is, by the log, and the torque that a model is driven by."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.control.cascade import cascade_of
from gaident.control.controller import Controller
from gaident.control.found import FoundNumbers
from gaident.control.pi import PI, bare_pi
from gaident.control.unknown import field_of
from gaident.data.record import Record
from gaident.data.torque_kind import MEASURED
from gaident.diagnosis.controller.controller_place import AsLogged, as_logged
from gaident.diagnosis.controller.form_findings import Driver, Loop, driver_of
from gaident.diagnosis.controller.limit_not_given import by_a_limit
from gaident.diagnosis.controller.log_shift import Aligned, aligned
from gaident.diagnosis.controller.measured_lag import Lag, behind_a_lag, commanded, lag_shown
from gaident.diagnosis.controller.other_form import other_form, other_scheme
from gaident.diagnosis.controller.wrong_number import OtherRule, closer_form, other_rules, with_findings, wrong_numbers
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records.hygiene import left_out
from gaident.diagnosis.unlogged.other_gains import OTHER_GAINS, OtherGains
from gaident.diagnosis.unlogged.unlogged_form import UnloggedForm
from gaident.identification.logged_torque import comparable, corrected, not_followed
from gaident.identification.replay.driven_records import Driven
from gaident.identification.replay.replay import replay
from gaident.models.drive_torque import driven_by, on_lines, straight_driven
from gaident.models.model import Model
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

__all__ = ["Driving", "driving_of"]

MEASURED_ACTS = say(
    "What acts on the shaft is the measured {torque}, behind the filters of it or the current loop: it drives the model, and no "
    "loop is simulated."
)

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Driving:
    """The records, without shifts of their logs and as their torque drives a model, and the controller as it is used.

    logged: the bare PI with the gains that the torques show. findings: of the controller's form. notes: what to keep in mind.
    doubts: notes on torques that do not follow from a controller that is no bare PI. numbers: those that were not given.
    limited: whether a limit of the controller, which was not given either, makes the torques follow.
    regained_from: the PI that was given, where records without a torque show other gains. lag: behind which a measured torque was
    logged; the records then contain the one before it. found: the controller's numbers that the records show.
    outliers: digest of a record as given -> lines whose velocity stands in the log alone, interpolated here.
    every_line: whether each line counts that the controller read, also where a linear model misses it as it would an outlier.
    clocked: whether the sample time of the controller was given. left_open: whether some of its numbers were not.
    simulated: whether a simulated loop can have the controller.
    ticks: samples to a line of a controller that is given and not used, as the measured torque drives the model; else 0.
    by_loop: where it does, the same with the torque that the controller makes in its place.
    """

    moved: Aligned
    controller: Controller | None
    logged: AsLogged
    findings: tuple[Finding, ...] = ()
    notes: tuple[Text, ...] = ()
    doubts: tuple[Text, ...] = ()
    numbers: Mapping[str, Estimate] = field(default_factory=dict)
    limited: bool = False
    regained_from: PI | None = None
    lag: Lag | None = None
    found: FoundNumbers | None = None
    outliers: Mapping[str, NDArray[np.intp]] = field(default_factory=dict)
    every_line: bool = False
    clocked: bool = False
    left_open: bool = False
    simulated: bool = True
    ticks: int = 0
    by_loop: Driving | None = None

    def regained(self, other: OtherGains) -> Driving:
        """The same under other gains, which command and velocity show where no torque is logged; a finding says so."""
        given = self.regained_from or self.logged.controller
        assert given is not None
        kept = tuple(f for f in self.findings if f.effect != OTHER_GAINS)
        return replace(
            self,
            controller=other.controller,
            logged=replace(self.logged, controller=other.controller),
            findings=(*kept, other.finding(given)),
            regained_from=given,
            found=other.found,
        )

    def formed(self, other: UnloggedForm) -> Driving:
        """The same under another form of controller, which makes the torque that drives a model; a finding says so."""
        pairs = [
            [(driven_by(here, other.controller), here) for here in part] for part in (self.moved.records, self.moved.validation)
        ]
        records, validation = (tuple(driven for driven, _ in part) for part in pairs)
        given = {driven.digest: self.moved.given[here.digest] for part in pairs for driven, here in part}
        moved = replace(self.moved, records=records, validation=validation, given=given)
        findings = (*self.findings, other.finding)
        logged = as_logged(records, None)
        return replace(self, moved=moved, controller=other.controller, logged=logged, findings=findings, found=other.found)

    def refound(self, found: FoundNumbers, covariance: Matrix) -> Driving:
        """The same with other numbers of the controller, which the model of the axis shows closer; covariance: of them."""
        controller = found.controller
        assert controller is not None
        named = {} if found.named is None else found.named(found.at, covariance)
        findings = tuple(replace(f, parameters=_closer(f.parameters, named.get(f.effect, {}))) for f in self.findings)
        numbers = _closer(self.numbers, named.get("", {}))
        return replace(self._driven_anew(controller), findings=findings, numbers=numbers, found=found)

    def other_rules(self) -> list[OtherRule]:
        """The controller of a slow log with each other rule of its integral from which the torques follow too."""
        told = any(f.effect == "integration_rule" for f in self.findings)
        if told or self.doubts or self.controller is None:
            return []
        return other_rules(self.read, self.controller, self.found)

    def ruled(self, other: OtherRule) -> Driving:
        """The same under another rule of the integral, which a model of the axis shows; a finding says so."""
        return replace(self._driven_anew(other.controller), findings=(*self.findings, other.finding), found=other.found)

    def _driven_anew(self, controller: Controller) -> Driving:
        """The same where another controller makes the torque between the lines."""
        moved = self.moved
        pairs = [[(driven_by(moved.given[r.digest], controller), r) for r in part] for part in (moved.records, moved.validation)]
        records, validation = (tuple(driven for driven, _ in part) for part in pairs)
        given = {driven.digest: moved.given[r.digest] for part in pairs for driven, r in part}
        return replace(self, moved=replace(moved, records=records, validation=validation, given=given), controller=controller)

    @property
    def driven(self) -> tuple[tuple[Record, ...], tuple[Record, ...]]:
        """The records and those for validation, as their torque drives a model."""
        return self.moved.records, self.moved.validation

    @property
    def told_by_the_current(self) -> frozenset[str]:
        """Effects that delay the velocity, where a measured torque shows the lag of the torque; else none."""
        return frozenset(t.name for t in LIBRARY.values() if t.late) if self.lag is not None else frozenset()

    @property
    def regained_by(self) -> int:
        """How many gains are not the given ones."""
        return sum(len(f.parameters) for f in self.findings if f.effect == OTHER_GAINS)

    @property
    def in_doubt(self) -> bool:
        """Whether the logged torque follows neither from the given controller nor from a form of it, nor from a limit more."""
        return bool(self.doubts) and not self.limited and not any(f.place == "controller" for f in self.findings)

    def outliers_in(self, rec: Record) -> NDArray[np.intp]:
        """Lines of one of the records that drive a model, whose velocity stood in the log alone."""
        lines = self.outliers.get(self.moved.given[rec.digest].digest, np.zeros(0, dtype=np.intp))
        return lines[lines < len(rec)]

    def missed_in(self, rec: Record, model: Model) -> NDArray[np.intp]:
        """Lines of a record that the controller read and a linear model misses as it would outliers: they are left out."""
        of_log = self.outliers_in(rec)
        return of_log[:0] if self.every_line else np.setdiff1d(left_out(rec, model, bare_pi(self.controller)), of_log)

    @property
    def read(self) -> tuple[Record, ...]:
        """The records with every signal that the controller read, beside the torque as logged."""
        if self.controller is None or self.controller.one_equation:
            return self.moved.records
        return tuple(self.moved.given[r.digest] for r in self.moved.records)


def driving_of(
    records: Sequence[Record], validation: Sequence[Record], asked: Loop, driven: Driven, origin: Mapping[str, Record]
) -> Driving:
    """records, validation: as `driven` has them, under the controller of `asked`; origin: digest of a record -> as it was given.

    Raises ControllerError where unknown numbers of the controller do not make the torque, and no other form of it does.
    """
    controller, pi, notes = driven.controller, driven.loop, driven.notes
    whole = [origin.get(r.digest, r) for r in records]
    doubts = (*driven.doubts, *not_followed(whole, controller))
    lag = lag_shown(records, pi)
    if lag is not None and pi is not None:
        notes = (*notes, lag.note)
        records, validation, origin = _again(records, validation, origin, partial(commanded, controller=pi))
    follows = controller is not None and not doubts and all(controller.replayable(r) or comparable(r, controller) for r in whole)
    moved = aligned(records, validation, pi, follows, bool(doubts))
    form = None if moved.shifts else _at_its_rate(records, validation, pi, asked)
    findings, numbers, limited, found = asked.findings, asked.estimates, False, asked.found
    if form is None:
        notes = (*(asked.notes or asked.numbers.trusted().notes), *notes)
        if doubts and pi is None and controller is not None and not numbers:
            later = [origin.get(r.digest, r) for r in validation]
            other = corrected(whole, controller)
            limited = other is None and by_a_limit(whole, controller)
            if limited:
                moved = aligned(records, validation, None, True)
            elif not asked.findings:  # a form that a bare PI lacked was found already
                form = closer_form(whole, other_form(whole, later, controller), other)
            if driven.slower and not limited and form is None and other is None:
                form = other_scheme(whole, later, controller, asked.findings)
            if other is not None and form is None:
                other = with_findings(other)
                findings = (*findings, *wrong_numbers(whole, controller, other))
                controller, numbers, notes, doubts = other.controller, other.estimates, (*notes, *doubts, other.note), ()
                found = other.found
                records, validation, origin = _again(records, validation, origin, partial(driven_by, controller=controller))
                moved = aligned(records, validation, None, True)
    slower = controller is not None and pi is None and driven.slower and not limited
    here, there = ([origin.get(r.digest, r) for r in part] for part in (records, validation))
    if slower and (not doubts if form is None else form.simulated):
        assert controller is not None
        formed = form or Driver((), (), cascade_of(controller), findings, (), numbers)
        law = other_scheme(here, there, formed.controller, formed.findings)
        form = form if law is None else replace(law, notes=(*formed.notes, *law.notes), estimates=formed.estimates)
    if slower and form is None and not asked.findings:
        assert controller is not None
        if (lagging := behind_a_lag(here, there, controller)) is not None:
            form = replace(lagging, findings=(*findings, *lagging.findings), estimates=numbers)
    if form is not None:
        controller, pi, notes, doubts = form.controller, None, (*notes, *form.notes), ()
        findings, numbers, found = form.findings, form.estimates, form.found
        pairs = zip((*form.records, *form.validation), (*records, *validation), strict=True)
        origin = {changed.digest: origin.get(given.digest, given) for changed, given in pairs}
        moved = aligned(form.records, form.validation, None, True)
    elif doubts and driven.slower and not limited:
        # What this controller would make between the lines is not what the drive's made there.
        assert driven.controller is not None
        records, validation, origin = _again(records, validation, origin, partial(straight_driven, controller=driven.controller))
        moved = aligned(records, validation, None, refuted=True)
    moved = replace(moved, given={here: origin.get(rec.digest, rec) for here, rec in moved.given.items()})
    logged = as_logged(moved.records, pi)
    used = controller if bare_pi(controller) is None else logged.controller
    # A torque that the law makes once channels are moved needs no other sample time.
    if pi is None or any(replay(r, pi).follows is False for r in records if r.digest not in moved.shifts):
        notes = (*asked.period_notes, *notes)
    simulated = form is None or form.simulated
    made = Driving(moved, used, logged, findings, notes, doubts, numbers, limited, lag=lag, found=found, simulated=simulated)
    if slower and used is not None and cascade_of(used).torque_filters and all(r.torque_is == MEASURED for r in made.read):
        return _by_what_was_measured(made, asked, driven.notes)
    return made


def _at_its_rate(records: Sequence[Record], validation: Sequence[Record], pi: PI | None, asked: Loop) -> Driver | None:
    """What a log at the rate of a bare PI shows in its place, where the torques do not follow from that; else None."""
    if pi is None:
        return None
    law = None if asked.estimates else other_scheme(records, validation, pi, asked.findings)
    return law or driver_of(records, validation, pi, tuple(n.removeprefix("velocity.") for n in asked.estimates))


def _by_what_was_measured(made: Driving, asked: Loop, not_said: Sequence[Text]) -> Driving:
    """Torques that were measured behind a filter of theirs, or the current loop, as they drive a model alone.

    made: the same records as the torque of their controller drives it. not_said: notes on that torque.
    """
    given = made.moved.given
    whole = [[given[r.digest] for r in part] for part in made.driven]
    here, there = (tuple(on_lines(r, None) for r in part) for part in whole)
    origin = {now.digest: r for now, r in zip((*here, *there), (*whole[0], *whole[1]), strict=True)}
    alone = driving_of(here, there, Loop(None, asked.numbers), Driven(here, None), origin)
    said = (*(n for n in made.notes if n not in not_said), MEASURED_ACTS, *alone.notes)
    assert made.controller is not None
    return replace(
        alone,
        findings=made.findings,
        notes=tuple(dict.fromkeys(said)),
        numbers=made.numbers,
        ticks=made.controller.log_every(here[0].dt),
        by_loop=None if made.doubts else made,
    )


def _again(
    records: Sequence[Record], validation: Sequence[Record], origin: Mapping[str, Record], drive: Callable[[Record], Record]
) -> tuple[tuple[Record, ...], tuple[Record, ...], dict[str, Record]]:
    """Records, those for validation and origin with another torque; drive: makes it of a record as given."""
    given = [[origin.get(r.digest, r) for r in part] for part in (records, validation)]
    changed = [tuple(map(drive, part)) for part in given]
    pairs = zip((*changed[0], *changed[1]), (*given[0], *given[1]), strict=True)
    return changed[0], changed[1], {now.digest: whole for now, whole in pairs}


def _closer(estimates: Mapping[str, Estimate], named: Mapping[str, tuple[float, float]]) -> dict[str, Estimate]:
    """Estimates with other values and deviations, where there are some by their names, or the last part of these."""
    found = {name: named.get(name) or named.get(field_of(name)) for name in estimates}
    return {
        name: e if (pair := found[name]) is None else replace(e, value=pair[0], std=pair[1], identifiable=pair[1] < abs(pair[0]))
        for name, e in estimates.items()
    }
