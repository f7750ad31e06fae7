"""One diagnosis while it runs: records, search, and what is reported of them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.diagnosis.at_the_load import explains_load, load_numbers, load_words, with_load_sensor
from gaident.diagnosis.check import checked as by_second_method
from gaident.diagnosis.controller.as_read import as_read
from gaident.diagnosis.controller.controller_place import controller_findings, under_shown
from gaident.diagnosis.controller.driving import Driving
from gaident.diagnosis.controller.joint_numbers import joint_numbers
from gaident.diagnosis.experiments.candidates import candidates, loop_notes, unresolved
from gaident.diagnosis.experiments.excitation import excitation
from gaident.diagnosis.explain.alternatives import LOG_SHIFT, alike_here, alternatives_of, impossible_here, integrator_start
from gaident.diagnosis.explain.bending import relevance_of
from gaident.diagnosis.explain.beside import friction_beside, late_together
from gaident.diagnosis.explain.beyond import beyond_windows
from gaident.diagnosis.explain.determined import determined, not_determined
from gaident.diagnosis.explain.ends import ends_of
from gaident.diagnosis.explain.held_out import shown_by_free_run, standing
from gaident.diagnosis.explain.late_inside import late_inside
from gaident.diagnosis.explain.late_sensor import by_the_angle, excluded_by_the_angle
from gaident.diagnosis.explain.not_there import bounds_of
from gaident.diagnosis.explain.verdict import verdict_of
from gaident.diagnosis.explain.wording import (
    ON_A_SPRING,
    basis_of,
    closer_numbers,
    closest,
    evidence_of,
    like_filters,
    of_the_mechanics,
    or_other_form,
    or_other_gains,
    period_seen,
    torque_unlogged,
    two_resonances,
)
from gaident.diagnosis.gains import Gains, measured_gains, with_effects
from gaident.diagnosis.judged import Judged
from gaident.diagnosis.library.record import findings_of_the_record
from gaident.diagnosis.library.sides import called_of, name_of
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.linear_part import linear_of_part
from gaident.diagnosis.mechanics import base_shift, mechanics_of, moved, of_no_axis, of_the_age
from gaident.diagnosis.note import Note
from gaident.diagnosis.records.folded import ADVICE, folded
from gaident.diagnosis.records.hygiene import cleaned, left_unexplained, quantisation
from gaident.diagnosis.records.sizes import scales_of
from gaident.diagnosis.records.windows import searched_in
from gaident.diagnosis.selection import attribution
from gaident.diagnosis.selection.offset import Offset, offset_of
from gaident.diagnosis.selection.rivals import Replacement
from gaident.diagnosis.selection.select import Selection, by_whitened_errors, compared, selected
from gaident.diagnosis.selection.sensor_age import searched
from gaident.diagnosis.unlogged.other_gains import OTHER_GAINS, OtherGains, gain_doubt, under_given
from gaident.diagnosis.unlogged.unlogged_form import UnloggedForm, in_series, leaves_noise, unlogged_form
from gaident.estimation.dataset import DataSet
from gaident.estimation.found_numbers import covariance_of_numbers, whole_of
from gaident.estimation.objective import Fit, Objective
from gaident.estimation.uncertainty import estimates_of, model_covariance
from gaident.identification.notes import open_loop_notes
from gaident.models.model import Model
from gaident.policy.table import POLICY
from gaident.results.diagnosis import Diagnosis
from gaident.results.finding import Finding
from gaident.results.identification import Identification
from gaident.version import version

__all__ = ["Work"]


@dataclass
class Work:
    """One diagnosis on its way."""

    records: tuple[Record, ...]
    validation: tuple[Record, ...]
    driving: Driving
    idn: Identification
    noise: float | None
    note: Note
    axis: str
    pitch: float | None
    most: int = POLICY.most_effects  # effects in one model
    form_refused: bool = field(init=False, default=False)  # whether a search under another form did not confirm it

    def __post_init__(self) -> None:
        self.controller = self.driving.controller
        self.pi = bare_pi(self.controller)
        self.notes: list[Text] = list(self.driving.logged.notes)
        if (self.controller is None or self.pi is not None) and not self.driving.ticks:
            self.notes += open_loop_notes(self.records, self.pi)
        of_log = [self.driving.outliers_in(r) for r in self.records]  # the records have what the controller read there
        others = [self.driving.missed_in(r, self.idn.model) for r in self.records]
        self.hit = hit = [np.union1d(h, more) for h, more in zip(of_log, others, strict=True)]
        self.clean = clean = tuple(cleaned(r, h) for r, h in zip(self.records, others, strict=True))
        self.step = quantisation(self.records)
        read = as_read(whole := self.driving.read, list(map(cleaned, whole, others)), self.controller)
        self.left_out = any(map(len, others))
        data = DataSet.of(clean, self.controller, self.left_out, read, self.step, self.axis, self.pitch)
        data = replace(data.with_its_period(), clocked=self.driving.clocked)
        self.notes += period_seen(data)
        self.scales = scales_of(data)
        self.controller_steps, self.at_controller, notes = controller_findings(data, self.scales, not self.driving.simulated)
        self.notes += notes
        self.controller_steps += (*self.driving.logged.findings, *self.driving.findings)
        closed = self.driving.simulated and not (data.slower and self.driving.in_doubt)
        data = replace(data, known_noise=self.noise, found=self.driving.found)
        self.whole = under_shown(data, self.at_controller, closed)
        self.follows = self.whole.loop_follows
        self.excited = excitation(
            self.clean, self.whole.loop, axis=self.axis, pitch=data.period if data.period_seen else self.pitch
        )
        self.kept = [~np.isin(np.arange(n), h) for h, n in zip(hit, self.whole.lengths, strict=True)]
        self.objective = searched_in(self.whole, self.kept)
        self.data = self.objective.data
        self.notes += torque_unlogged(self.data)

    def search(self) -> None:
        """The selected model, its rivals, what is left; of long records once more with the lines that the model misses."""
        said = list(self.notes)
        self._search()
        missed = beyond_windows(self.objective, self.final, self.whole, self.kept).missed
        again = searched_in(self.whole, self.kept, [p for p, _ in missed]) if missed else self.objective
        if again.data.places != self.data.places:
            self.note(0.03, "once more, with lines that the model misses")
            self.notes, self.objective, self.data = said, again, again.data
            self._search()

    def _search(self) -> None:
        allowed, self.not_testable = candidates(self.records, self.clean, self.data, self.excited, self.at_controller)
        self.notes += [*[ADVICE] * any(folded(r) for r in self.records), *loop_notes(self.data)]

        def search(objective: Objective, most: int, beside: Fit | None) -> Selection:
            shown = [t for t in allowed if t.name not in unresolved(objective.data)], self._equivalent_here, self._say
            found = selected(objective, self.scales, self.idn.model, *shown, min(most, self.most), beside)
            return by_the_angle(found, self.clean, self._equivalent_here, self._say)

        found, older = searched(self.objective, self.scales, self.idn.model, allowed, search, self.driving.ticks, joint_numbers)
        self.notes += older
        self.not_testable |= unresolved(found.space.data)
        self.note(0.85, "looking for what is left")
        self.take(found)
        simpler = attribution.simplified(found.space, found.final, self.left)
        if simpler is not found.final:
            self._take_shorter(simpler)
        self._doubt_controller()

    def accept(self, found: Selection) -> None:
        """Take this as the result of the search, and look whether another controller would explain the records better."""
        self.take(found)
        self._doubt_controller()

    def _doubt_controller(self) -> None:
        again = self.driving.regained_from is not None
        self.gain_doubt = gain_doubt(self.found.space, self.final, again)
        self.doubtful = self.gain_doubt.better is not None or of_no_axis(mechanics_of(self.under, self.estimate)) is not None
        asked = not (again or self.form_refused)
        self.form = unlogged_form(self.found.space, self.final, self.gain_doubt.better, self.doubtful) if asked else None

    def with_joint_numbers(self) -> None:
        """The numbers of the controller that its torque showed, where the model of the axis shows them closer."""
        old = self.driving.found
        if old is None or self.pi is not None:
            return
        self.note(0.88, "the controller's numbers once more")
        found = joint_numbers(self.found, lambda found, final: compared(found, final, self._equivalent_here, self._say))
        if found is None or (numbers := found.space.data.found) is None:
            return
        self.take(found)
        self.driving = self.driving.refound(numbers, covariance_of_numbers(self.under, self.estimate))
        self.controller, (self.records, self.validation) = self.driving.controller, self.driving.driven
        self.clean = tuple(cleaned(r, h) for r, h in zip(self.records, self.hit, strict=True))
        others = [f for f in self.controller_steps if f.effect not in {g.effect for g in self.driving.findings}]
        self.controller_steps = [*others, *self.driving.findings]
        self.notes.append(closer_numbers(old, numbers))

    def beside_load(self) -> None:
        """The model with what a sensor at the load shows, where there is one."""
        found = with_load_sensor(self.found, self._equivalent_here, self._say)
        if found is not None:
            self.take(found)

    def other_form(self) -> UnloggedForm | None:
        """A form of controller that explains these records better than the given one and than other gains, or None."""
        return self.form if self.form is not None and self.form.better(self.found.space.margin) else None

    @property
    def leaves_noise(self) -> bool:
        return leaves_noise(self.found.space, self.final)

    def refused(self, form: UnloggedForm) -> None:
        """Note that another form comes closer, although a search under it does not end in noise."""
        self.form, self.form_refused = None, True
        self.notes.append(or_other_form(form.words))

    def other_gains(self, first: Work | None = None) -> OtherGains | None:
        """Gains that explain these records better than the given ones, which no logged torque shows; None without such gains.

        first: the work under the given gains, where this work is under other gains already; the gain is counted from its model.
        """
        better, given = self.gain_doubt.better, first or self
        if better is not None and given.form is not None:
            better = replace(better, rivals=given.form.rivals_of_gains(given.found.space.margin, moved))
        if better is None or first is None or first is self:
            return better
        same = first.found.space.whitens == self.found.space.whitens  # else the two are no BIC of the same errors
        worse = first.final.bic - better.bic if same or not first.gain_doubt.better else first.gain_doubt.better.gain
        return replace(better, gain=worse)

    def under_given(self) -> Selection | None:
        """The model found under other gains, fitted under the given ones; None where it explains the records worse there."""
        given = self.driving.regained_from
        assert given is not None
        moved = under_given(self.found, given, self.driving.regained_by)
        return None if moved is None else compared(moved, moved.final, self._equivalent_here, self._say)

    def _say(self, message: str) -> None:
        self.note(None, message)

    def take(self, found: Selection) -> None:
        """The result of a search, and what it leaves."""
        self.found, self.base, self.rivals = found, found.base, found.rivals
        self.data, self.objective = found.space.data, found.space.objective
        self.whole = whole_of(self.data, self.whole)
        self._set_final(found.final)

    def _set_final(self, final: Fit) -> None:
        self.final = final
        self.adequate, self.left = attribution.what_is_left(self.found.space, final)
        self.under, self.estimate = self.found.estimated()

    def judged(self) -> Judged:
        """The effects that stand, and their gains. Where none stands, those of the search by whitened errors are judged."""
        while True:
            said = list(self.notes)
            gains = self._accepted_gains()
            driver, shown = shown_by_free_run(self.data, gains, self.left, self.adequate)
            self.notes += shown
            causes = [e for e in self.final.effects if not self._only_describes(e, driver)]
            estimates = estimates_of(self.under, self.estimate)
            if unknown := [e for e in causes if not determined(estimates[e])]:
                self.notes = [*said, *map(not_determined, unknown)]
                self._take_shorter(attribution.of_known_size(self.found.space, self.final, unknown))
                continue
            mechanics = mechanics_of(self.under, self.estimate)
            model = self._made(self.estimate.x)
            check = by_second_method(self.data, gains, model, mechanics, estimates)
            unnamed = len(causes) < len(self.final.effects)  # an effect describes what has no name
            causes, why = standing(causes, gains, check, self._equivalent_here, mechanics.get("inertia"))
            if why or check.loses or unnamed:
                driver = driver or self.left.strongest or "time"
                self.notes += why
            self.notes += basis_of(self.found, driver is not None) + two_resonances(self.final)
            instead = None if causes else by_whitened_errors(self.found, self._equivalent_here, self._say)
            if instead is None:
                self.notes += gains.notes
                return Judged(gains, driver, causes, estimates, offset_of(self.found.space, self.final), mechanics, model, check)
            self.notes = said
            self.take(instead)

    def _made(self, x: NDArray[np.float64]) -> Model:
        return with_effects(self.estimate.parameters.model(x), self.at_controller.effects)

    def report(self, seed: int) -> Diagnosis:
        """Everything the user sees."""
        self.note(0.9, "measuring the gain")
        gains, driver, causes, estimates, offset, mechanics, model, check = self.judged()
        beyond = beyond_windows(self.objective, self.final, self.whole, self.kept)
        of_log = list(map(self.driving.outliers_in, self.records))
        spoiled = left_unexplained(self.records, of_log, self.clean, beyond.error, self.kept)
        findings = findings_of_the_record(spoiled, sum(len(r) for r in self.records), self.step)
        findings += [replace(f, gain=gains.of(f.effect)) for f in self.controller_steps]
        estimates, together = late_together(self.under, self.estimate, self.found.space.allowed, estimates)
        more, notes = friction_beside(self.under, self.estimate)
        self.doubts = like_filters(self.data, in_series(self.final)) or late_inside(self.under, self.estimate)
        for effect in causes:
            gain, rivals = self.rivals[effect]
            never = impossible_here(effect, {e: estimates[e] for e in causes}) | self.driving.told_by_the_current
            alone = excluded_by_the_angle(effect, estimates[effect], self.clean)
            alternatives = tuple(n for n in self._alternatives(effect, rivals, offset, never) if n not in alone)
            self.notes += [or_other_gains(effect)] * (effect in self.gain_doubt.rivals)
            ends = ends_of(self.found.space, self.final, effect, [r.effect for r in rivals])
            known = estimates[effect], self.data.velocity
            said_by, sides = evidence_of(effect, gain, alternatives, offset, ends, known, driver is not None), ends.sides
            what = name_of(effect), estimates[effect], alternatives, gains.of(effect), gain, None, said_by, False
            findings.append(Finding(*what, LIBRARY[effect].place, sides))
        if (impossible := of_no_axis(mechanics)) is not None:
            driver = driver or ("velocity" if impossible == "viscous_friction" else "past")
        real = [f for f in findings if not f.is_noise]
        answered = {*self.not_testable, *(name for f in findings for name in (f.effect, *f.alternatives))}
        self.notes += (*together, *notes, *self.doubts, *load_words(self.found), *beyond.words)
        left = driver is not None or not explains_load(self.found) or bool(beyond.missed)
        verdict = verdict_of(bool(real), left, bool(self.doubts) or (self.data.slower and self.driving.in_doubt))
        if driver is not None and (dropped := [e for e in self.final.effects if e not in causes]):
            shown = driver if self.left.gains[driver] > self.left.needed else None
            self.notes.append(closest(dropped, shown, bool(real)))
        ages, left_open = of_the_age(self.under, self.estimate), self.driving.left_open
        self.notes += (*of_the_mechanics(mechanics, ages, self.data, left_open), *check.notes)
        self.notes += [ON_A_SPRING] * (self.final.parameters.on_a_spring and any(LIBRARY[e].constant for e in self.final.effects))
        proposal = None
        if ambiguous := [f for f in real if f.alternatives]:
            self.note(0.95, "proposing the next experiment")
            from gaident.diagnosis.experiments.next_experiment import propose

            other = self.objective.count, self.at_controller.effects
            proposal, notes = propose(ambiguous, self.rivals, self.final, self.whole, *other)
            self.notes += notes
        extended = bool(self.final.effects or self.at_controller.effects or self.data.slower)
        return Diagnosis(
            verdict=verdict,
            findings=tuple(findings),
            not_testable=self.not_testable,
            model=model if extended else self.idn.model,
            before=check.before,
            after=check.after,
            driver=driver,
            next_experiment=proposal,
            gain_interval=gains.interval,
            held_out=gains.held_out,
            base_shift=base_shift(self.base, self.estimate),
            covariance=model_covariance(self.under, self.estimate, self._made, more) if extended else self.idn.covariance,
            left=self.left.gains,
            left_needed=self.left.needed,
            line=self.left.line if driver == "time" else None,
            one_sided={e: sizes for e, sizes in self.excited.one_sided.items() if e not in answered},
            mechanics=mechanics_of(self.under, self.estimate, more),
            load_sensor=load_numbers(self.found),
            regression=check.regression,
            regression_force_error=check.force_error,
            comparisons=check.comparisons,
            relevance=relevance_of(check.after, gains.floor, driver, self.left, self.under, self.estimate, mechanics),
            force_reason=check.reason,
            not_there=bounds_of(self.found.space, self.final, answered) if driver is None and not beyond.missed else {},
            notes=tuple(self.notes),
            identification=self.idn,
            controller=self.controller,
            seed=seed,
            seconds=0.0,
            simulations=self.objective.counter.simulations,
            samples=sum(map(len, self.records)),
            digests=tuple(r.digest for r in self.records),
            validation_digests=tuple(r.digest for r in self.validation),
            torque_logged=self.data.torque_logged,
            loop_follows=self.follows,
            version=version(),
            axis=self.axis,
            records=self.records,
            validation_records=self.validation,
        )

    def _accepted_gains(self) -> Gains:
        """The gains, once every effect that makes held-out data worse is out of the model."""
        while True:
            in_time = any(t.in_time for t in self.final.parameters.terms)  # elsewhere in its period in another record
            given = self.clean, () if in_time else self.validation, self.controller, self._linear_of_part
            gains = measured_gains(*given, self.estimate, self.under, self.noise, self.at_controller.effects)
            if not gains.harmful:
                return gains
            effect = gains.harmful[-1]
            text = "{} would come closer to these records, but makes the held-out data worse: it is not accepted."
            self.notes.append(say(text, called_of(effect).begun()))
            self._take_shorter(self.found.space.without(self.final, effect))

    def _take_shorter(self, final: Fit) -> None:
        self.take(compared(self.found, final, self._equivalent_here, self._say))

    def _linear_of_part(self, part: tuple[int, ...] | None) -> tuple[Model, tuple[Text, ...]]:
        """The linear model of so many first samples of each record; identified once, whatever effects are judged beside it."""
        return self.objective.once(("linear model", part), lambda: linear_of_part(self.idn, self.records, self.pi, part))

    def _alternatives(
        self, effect: str, rivals: Sequence[Replacement], offset: Offset | None, never: Collection[str]
    ) -> tuple[str, ...]:
        """Rivals, equivalent effects and, where the loop is not that of the drive, the controller; without untestable ones."""
        shown = attribution.shown_by_the_records(self.found.space, self.final, effect)
        follows = not (self.data.slower and (self.driving.in_doubt or self.doubts))
        names = alternatives_of(effect, rivals, sorted(self._equivalent_here(effect)), bool(shown), offset, follows, never)
        names += integrator_start(effect, self.whole) + [OTHER_GAINS] * (effect in self.gain_doubt.rivals)
        names += [LOG_SHIFT] * (LIBRARY[effect].in_series and not LIBRARY[effect].resonates and self.driving.moved.may_be_early)
        if self.form is not None and self.form.as_good(self.found.space.margin) and effect in in_series(self.final):
            names.append(self.form.finding.effect)
        return tuple(n for n in dict.fromkeys(map(name_of, names)) if n != name_of(effect) and n not in self.not_testable)

    def _only_describes(self, effect: str, driver: str | None) -> bool:
        gain, of_class = self.rivals[effect][0], bool(self._equivalent_here(effect))
        return attribution.only_describes(self.found.space, self.final, effect, gain, driver, self.left, of_class)

    def _equivalent_here(self, effect: str) -> set[str]:
        return alike_here(effect, self.excited, self.data.torque_logged) - set(self.not_testable)
