"""diagnose(): what the simulation gets wrong, the cause, the extended model, the gain."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gaident.axis import Text, say
from gaident.control.controller import Controller, checked_controller
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.diagnosis.at_the_load import NO_P_VALUE
from gaident.diagnosis.blas import one_thread
from gaident.diagnosis.controller.as_read import in_terms_of_the_log, outliers_of_the_log
from gaident.diagnosis.controller.driving import Driving, driving_of
from gaident.diagnosis.controller.form_findings import Loop, loop_of
from gaident.diagnosis.controller.joint_numbers import better_under
from gaident.diagnosis.explain.expected import FOUND_AS, outside_of
from gaident.diagnosis.explain.wording import not_borne_out
from gaident.diagnosis.gains import judges_selected
from gaident.diagnosis.note import Note
from gaident.diagnosis.records.arguments import (
    ProgressCallback,
    accuracy_of,
    checked,
    expected_of,
    in_order,
    noise_std_of,
    records_of,
)
from gaident.diagnosis.selection.load_moves import LoadMoves
from gaident.diagnosis.unlogged.unlogged_form import in_series
from gaident.diagnosis.work import Work
from gaident.errors import SettingsError
from gaident.identification.identify import identify
from gaident.identification.replay.command_timing import timed
from gaident.identification.replay.driven_records import Driven, torque_driven
from gaident.identification.replay.notes import jump_notes
from gaident.models.drive_torque import on_lines
from gaident.policy.table import POLICY
from gaident.results.diagnosis import Diagnosis
from gaident.results.finding import Finding
from gaident.results.identification import Identification

__all__ = ["Diagnosis", "Finding", "diagnose"]

IDENTIFIED_AGAIN = say(
    "The given identification is not of the controller that explains these records: another one, under that controller, is in "
    "its place."
)
LOOP_MAKES = say(
    "The measured {torque}, which is not known between the lines of the log, leaves something where it drives the model alone; "
    "that which the controller makes behind its filter leaves nothing: it drives the model."
)
FIRST_CAUSE = Text(
    "This was the quick search, which stops at the first cause: whether there is another one was not looked for, and another one "
    "would change these values. The whole search tells."
)


def diagnose(
    rec: Record | Sequence[Record],
    controller: Controller | None = None,
    identification: Identification | None = None,
    validation: Record | Sequence[Record] | None = None,
    noise: float | Record | None = None,
    bootstrap: int = 0,
    seed: int = 0,
    progress: ProgressCallback | None = None,
    axis: str = "rotary",
    pitch: float | None = None,
    accuracy: float | Mapping[str, float] | None = None,
    quick: bool = False,
    expected: Mapping[str, tuple[float, float]] | None = None,
) -> Diagnosis:
    """Show what the model of an axis gets wrong, name the physical cause where the data allow it, and measure the gain.

    A beam search over mechanisms with effects of `gaident.effects.table()`, all refitted together and decided by BIC, of whitened
    errors of a torque-driven simulation, or of plain ones where these are no stationary noise. See docs/diagnosis.md.
    Rivals within 10 units and equivalent effects make a finding ambiguous; what no effect explains is reported by its driver.

    Parameters
    ----------
    rec : Record or sequence of Record
        The data.
    controller : PI or Cascade, optional
        The velocity loop; None: open loop, the record's torque drives the model. Numbers that are None are estimated.
        Under what is no bare PI at the log's rate the torque drives the model: as logged, or as this controller makes it.
    identification : Identification, optional
        What `identify` found; None: it is run first.
    validation : Record or sequence of Record, optional
        Records that no fit sees; None: the end of each long record is held out, see `Diagnosis.held_out`.
    noise : float or Record, optional
        Standard deviation of the velocity noise [rad/s], or a Record at standstill; None: from the record itself.
    bootstrap : int
        Simulated records without any effect that calibrate the p-value of the first finding; 0: none.
    seed : int
        Seed of the random numbers; the same seed gives the same result.
    progress : callable, optional
        Called now and then with (fraction done, message), see `gaident.progress`.
    axis : {"rotary", "linear"}
        "linear" (m, m/s, N): positions are lengths, and what returns with every turn is tried with every `pitch`.
    pitch : float, optional
        Of a linear axis, the length with which its cogging returns: pitch of the screw or of the poles [m].
        None: what the records show, if they do; a note says so.
    accuracy : float or mapping, optional
        How accurate the simulation has to be: rms of the velocity [rad/s], or {"velocity": [rad/s], "torque": [N m]}.
        It decides nothing that is found; what is left below it is called negligible, see `Diagnosis.relevance`.
    quick : bool
        Stop at the first cause: the search takes one effect at most, or the fewest with which a cause is named.
        What else is there is left, and a note says so.
    expected : mapping, optional
        Ranges of the whole mechanism as you know it: "inertia" [kg m^2], "resonance_hz" [Hz], "damping" [N m s/rad].
        They bound no search; a note says what was found outside.

    Returns
    -------
    Diagnosis
        Verdict, findings, extended model, gain, and the experiment to make next.

    Raises
    ------
    GaidentError
        Names the argument, its value and the remedy.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> controller = ga.PI(kp=0.5, ki=5.0)
    >>> command = np.repeat([20.0, -30.0, 10.0, -5.0], 100)
    >>> noise = 0.02 * np.random.default_rng(1).standard_normal(400)
    >>> drive = ga.OneMass(J=0.01, D=0.05).model().with_effect("coulomb_friction", torque=0.3)
    >>> run = ga.run(drive, ga.Record(1e-3, command=command - noise, velocity=noise), controller)
    >>> rec = ga.Record(1e-3, command=command, velocity=run.velocity + noise, torque=run.torque)
    >>> dia = ga.diagnose(rec, controller, seed=1)
    >>> dia.verdict, [(f.effect, round(f.parameters["torque"].value, 2)) for f in dia.causes]
    ('explained', [('coulomb_friction', 0.3)])
    """
    began = time.perf_counter()
    note = Note(progress)
    recorded = records_of(rec, "rec")
    apart = () if validation is None else records_of(validation, "validation")
    with one_thread(), np.errstate(over="ignore", invalid="ignore"):
        given, lines = outliers_of_the_log(recorded, checked_controller(controller))
        asked = loop_of(given, checked_controller(controller))
        prepared = [_Prepared.of(asked, given, apart)]
    checked(
        prepared[0].records,
        prepared[0].validating,
        prepared[0].driven.loop,
        identification,
        bootstrap,
        seed,
        progress,
        axis,
        pitch,
    )
    noise_std, asked_accuracy, ranges = noise_std_of(noise), accuracy_of(accuracy), expected_of(expected)
    if not isinstance(quick, bool):
        raise SettingsError(f"quick is {quick!r}: give True or False")
    with one_thread(), np.errstate(over="ignore", invalid="ignore"):
        note(0.01, "replaying the controller, and looking for its form where it does not fit")
        hit = {r.digest: outliers for r, outliers in zip(prepared[0].given, lines, strict=True)}

        def driven_under(one: _Prepared) -> Driving:
            clocked = one.loop.at_rate or (controller is not None and controller.clock is not None)
            left_open = controller is not None and bool(controller.unknown)
            found = one.driving()
            known: dict[str, Any] = dict(outliers=hit, clocked=clocked, left_open=left_open)
            return replace(found, **known, by_loop=found.by_loop and replace(found.by_loop, **known))

        driving = driven_under(prepared[0])
        note(0.02, "identifying the linear model")

        linear_under: dict[int, tuple[Driving, Identification]] = {}

        def identified(driving: Driving) -> Identification:
            """The linear model under a controller, identified once."""
            if id(driving) not in linear_under:
                idn = identify(list(driving.moved.records), bare_pi(driving.controller), seed=seed)
                linear_under[id(driving)] = driving, idn
            return linear_under[id(driving)][1]

        def searched(driving: Driving, most: int, idn: Identification | None = None) -> Work:
            here = driving.moved
            note.searching()
            if idn is None:
                idn = identified(driving)
                note.identified()
            work = Work(here.records, here.validation, driving, idn, noise_std, note, axis, pitch, most)
            work.search()
            if work.leaves_noise or driving.found is None:
                return work
            work.with_joint_numbers()
            if work.driving is driving:
                return work
            note(0.03, "once more, with these numbers of the controller")
            again = Work(work.records, work.validation, work.driving, idn, noise_std, note, axis, pitch, most)
            again.search()
            return again if _explains_more(again, work) else work

        def with_rule(work: Work, most: int) -> Work:
            """The work, or that with another rule of the integral with which it leaves noise."""
            settled = work.leaves_noise and not in_series(work.final)
            for rule in () if settled else work.driving.other_rules():
                if not better_under(work.found, rule.controller, rule.found):
                    continue
                note(0.03, "once more, with another rule of the integral")
                ruled = searched(work.driving.ruled(rule), most)
                if _confirms(ruled, work) or _explains_more(ruled, work):
                    return ruled
            return work

        def under_best_controller(driving: Driving, most: int, idn: Identification | None) -> _Ended:
            """The work with at most so many effects, under the controller with which it explains the records."""
            discarded: list[Text] = []
            work = searched(driving, most, idn)
            if (form := work.other_form()) is not None:
                note(0.03, "once more, under another form of controller")
                formed = searched(driving.formed(form), most)
                if _confirms(formed, work):
                    work = formed
                else:
                    work.refused(form)
            work = with_rule(work, most)
            for simpler in asked.simpler:
                prepared.append(_Prepared.of(simpler, given, apart))
                beside = replace(driven_under(prepared[-1]), every_line=driving.every_line)
                here, there = (identified(one) for one in (driving, beside))
                if POLICY.each_number * there.rmse < here.rmse:
                    note(0.03, "once more, under a simpler controller")
                    plain = with_rule(searched(beside, most, there), most)
                    if plain.leaves_noise and (not work.leaves_noise or _explains_more(plain, work)):
                        discarded.append(not_borne_out(asked.findings, simpler.findings))
                        work = plain
                        break
            given_work = work
            for _ in range(POLICY.rounds):
                other = work.other_gains(given_work)
                if other is None:
                    break
                note(0.03, "once more, under other gains")
                work = searched(work.driving.regained(other), most)
            if work is not given_work and (stands := work.under_given()) is not None:
                # What was found under other gains explains the records under the given ones as well.
                work = given_work
                work.accept(stands)
            work.with_joint_numbers()
            work.beside_load()
            return _Ended(work, work.report(seed), discarded)

        linear = identification
        for most in range(1 if quick else POLICY.most_effects, POLICY.most_effects + 1):
            work, found, discarded = under_best_controller(driving, most, linear)
            if found.driver is not None and driving.by_loop is not None:
                note(0.03, "once more, driven by what the controller makes")
                looped = under_best_controller(driving.by_loop, most, None)
                if looped.found.driver is None:
                    work, found, discarded = looped
                    discarded.append(LOOP_MAKES)
            if found.driver is not None and work.left_out:
                note(0.03, "once more, with the lines that looked like outliers")
                whole = under_best_controller(replace(driving, every_line=True), most, linear or identified(driving))
                if whole.found.driver is None:
                    work, found, discarded = whole
            if found.causes or found.driver is None:
                break
            linear = linear if work.driving.regained_from is not None else work.idn  # a name needs more than one effect here
        driving = work.driving
        own = judges_selected(work.found.space.objective, work.final, work.at_controller.effects)
        result = replace(
            found,
            noise=noise_std,
            bootstrap=bootstrap,
            controller_numbers=driving.numbers,
            given_controller=controller,
            velocity_age=work.data.age,
            linear_model=work.base.parameters.model(work.base.x) if own else work.idn.model,
        )
        result = driving.moved.noted(result)
        pairs = ((one.read, (*recorded, *apart)) for one in prepared)
        result = in_terms_of_the_log(result, {read.digest: logged for pair in pairs for read, logged in zip(*pair, strict=True)})
        if result.relevance is not None:
            velocity, torque = (asked_accuracy.get(name) for name in ("velocity", "torque"))
            wanted = replace(result.relevance, velocity_accuracy=velocity, torque_accuracy=torque)
            result = replace(result, relevance=wanted)
        result = replace(result, notes=(*result.notes, *outside_of(ranges, result.mechanics), *((FIRST_CAUSE,) * quick)))
        result = replace(result, expected={FOUND_AS[name]: limits for name, limits in ranges.items()})
        if identification is not None and work.idn is not identification:
            result = replace(result, notes=(IDENTIFIED_AGAIN, *result.notes))
        answered = work.at_controller.decided or any(f.place == "controller" for f in result.findings)
        times = jump_notes(prepared[0].given)
        result = replace(result, notes=(*driving.notes, *times, *discarded, *(() if answered else driving.doubts), *result.notes))
        if bootstrap and isinstance(work.found.space, LoadMoves):
            result = replace(result, notes=(*result.notes, NO_P_VALUE))
        elif bootstrap:
            from gaident.diagnosis.selection.bootstrap import with_p_value

            space = work.found.space
            result = with_p_value(result, space, work.base, work.final, bootstrap, seed, lambda message: note(None, message))
    return replace(result, seconds=time.perf_counter() - began)


class _Ended(NamedTuple):
    """A search that has ended, its report, and what the torque alone shows of the controller, and the model does not."""

    work: Work
    found: Diagnosis
    discarded: list[Text]


class _Prepared(NamedTuple):
    """The records to fit and to validate, as a loop's torque drives a model; given, kept: as its controller read them."""

    loop: Loop
    given: tuple[Record, ...]
    kept: tuple[Record, ...]
    driven: Driven
    records: tuple[Record, ...]
    validating: tuple[Record, ...]

    @classmethod
    def of(cls, asked: Loop, records: Sequence[Record], apart: Sequence[Record]) -> _Prepared:
        given = tuple(timed(records, asked.controller))
        kept = tuple(timed(outliers_of_the_log(apart, asked.controller)[0], asked.controller))
        driven = torque_driven(given, asked.controller)
        later = torque_driven(kept, asked.controller).records if kept else ()
        fitted = tuple(on_lines(r, driven.controller) for r in driven.records)
        return cls(asked, given, kept, driven, fitted, tuple(on_lines(r, asked.controller) for r in later))

    @property
    def read(self) -> tuple[Record, ...]:
        return (*self.given, *self.kept)

    def driving(self) -> Driving:
        origin = {r.digest: whole for r, whole in zip((*self.records, *self.validating), self.read, strict=True)}
        return driving_of(in_order(self.records), in_order(self.validating), self.loop, self.driven, origin)


def _confirms(formed: Work, given: Work) -> bool:
    """Whether a search under another form of controller leaves noise, and fewer effects, less or a better mechanism."""
    fewer = given.doubtful or len(formed.final.effects) < len(given.final.effects)
    return formed.leaves_noise and (fewer or not given.leaves_noise)


def _explains_more(one: Work, given: Work) -> bool:
    """Whether a search under another controller of no more numbers leaves noise, with no more effects, and is clearly better.

    Whitened errors that are noise are better than output errors, by which a model is judged where whitened ones are none.
    """
    if len(one.final.effects) > len(given.final.effects) or not one.leaves_noise:
        return False
    here, there = one.found.space, given.found.space
    if here.whitens != there.whitens:
        return here.whitens
    return here.score(one.final) < there.score(given.final) - here.margin
