"""What to keep in mind about a result, in plain sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gaident.axis import Text, joined, say
from gaident.control.controller import Controller
from gaident.data.guess import slope_between
from gaident.data.record import Record
from gaident.models.mechanics import OneMass, TwoMass
from gaident.models.model import Model
from gaident.models.starts import doubtful_start
from gaident.policy.table import POLICY
from gaident.results.adequacy import Adequacy
from gaident.results.estimate import Estimate
from gaident.results.structures import Rival

__all__ = [
    "inertia_of",
    "open_loop_notes",
    "reading_notes",
    "record_notes",
    "seen_up_to",
    "slower_than_the_loop",
    "unseen_notes",
    "warnings_of",
]


def warnings_of(
    adequacy: Adequacy,
    parameters: dict[str, Estimate],
    mechanics: OneMass | TwoMass | None,
    rivals: Sequence[Rival],
    model: Model,
    larger_fits_better: bool,
    started: Sequence[str],
) -> tuple[str, ...]:
    """The sentences, those about the records (`started`) first."""
    notes = list(started)
    if adequacy.falsified or adequacy.undecided:
        notes.append(adequacy.sentence)
    if larger_fits_better:
        notes.append(
            "Larger structures come closer, but only by absorbing what no linear structure holds; the smallest mechanism "
            f"is reported, ({model.p},{model.q}). A diagnosis looks for what is missing: a lag, a delay, friction."
        )
    bound = [n for n, e in parameters.items() if e.at_bound]
    if bound:
        notes.append(f"At a bound of the search range: {', '.join(bound)}. Widen the space, or doubt the structure.")
    unknown = [n for n, e in parameters.items() if not e.at_bound and not e.identifiable]
    if unknown:
        notes.append(f"Not identifiable from this data (standard deviation as large as the value): {', '.join(unknown)}.")
    if rivals:
        names = ", ".join(f"({r.p},{r.q})" for r in rivals)
        notes.append(
            f"Structures within {POLICY.rival_margin:.0f} BIC units of ({model.p},{model.q}): {names}; the smallest is reported."
        )
    if mechanics is not None:
        notes.extend(_shaft_notes(mechanics))
        notes.extend(mechanics.notes)
    return tuple(notes)


def seen_up_to(dt: float) -> float:
    """Frequency [Hz] up to which the lines of a log, dt [s] apart, show a resonance."""
    return POLICY.seen_band * 0.5 / dt  # no decision: a formula: half the sampling frequency


def unseen_notes(mechanics: OneMass | TwoMass | None, dt: float) -> list[str]:
    """A sentence on a resonance above what the lines of the log show, dt [s] apart."""
    highest = seen_up_to(dt)
    if not isinstance(mechanics, TwoMass) or not mechanics.resonance / math.tau > highest:
        return []
    return [
        f"A resonance above {highest:.2g} Hz does not show in a log with a line every {1e3 * dt:.3g} ms: the one of "
        f"{mechanics.resonance / math.tau:.3g} Hz stands for something else that is fast; none of its numbers is the shaft's."
    ]


def inertia_of(mechanics: OneMass | TwoMass | None) -> float | None:
    """The inertia of a whole axis [kg m^2]."""
    return None if mechanics is None else mechanics.J if isinstance(mechanics, OneMass) else mechanics.JM + mechanics.JL


def slower_than_the_loop(inertia: float | None, controller: Controller | None, dt: float) -> list[Text]:
    """A sentence on a log whose lines, dt [s] apart, do not show how its velocity loop moves; inertia [kg m^2]: found.

    Such a loop crosses over at w = kp/J [rad/s], above `seen_band` of pi/dt.
    """
    kp = None if controller is None else controller.gains.kp
    if not inertia or not kp or not kp > POLICY.seen_band * (math.pi / dt) * abs(inertia):
        return []
    ms = 1e3  # no decision: a unit: in a second
    text = (
        "The velocity loop settles in {:.2g} ms ({inertia} over kp), and the log has a line every {:.3g} ms: how the axis moves "
        "between two speeds is not in it. {Inertia}, stiffness and times rest on what the controller is said to be. What such a "
        "log does show is the {torque} at held speeds: `gaident.friction_map`. Log every sample to see the rest."
    )
    return [say(text, ms * abs(inertia) / kp, ms * dt)]


def _shaft_notes(mechanics: OneMass | TwoMass) -> list[str]:
    """A sentence where the six numbers of a two-mass model contradict a shaft without damping by more than three deviations."""
    std = mechanics.std.get("inconsistency", 0.0)
    found = mechanics.inconsistency or 0.0
    if not isinstance(mechanics, TwoMass) or not std > 0.0 or found < POLICY.contradiction * std:
        return []
    damped = mechanics.with_shaft_damping
    remedy = "an effect that the model lacks biases them; trust neither"
    if damped is not None and damped.physical:
        remedy = (
            f"use mechanics.with_shaft_damping (JM = {damped.JM:.4g}, JL = {damped.JL:.4g}, KG = {damped.KG:.4g}, "
            f"DG = {damped.DG:.3g}), or look for an effect that the model lacks"
        )
    return [f"The mechanics without shaft damping contradict the model by {100 * found:.2g} +- {100 * std:.2g} %: {remedy}."]


def open_loop_notes(records: Sequence[Record], controller: Controller | None) -> list[Text]:
    """A sentence where a record's torque is that of a loop, u = C (r - w - noise): no input that is independent of the noise."""
    if controller is not None or all(rec.command is None for rec in records):
        return []
    return [
        say(
            "The log has a command, but no controller is simulated: its {torque} drives the model, and noise that goes through "
            "the loop biases the result; give the gains of the controller."
        )
    ]


def record_notes(records: Sequence[Record], controller: Controller | None, initial_state: str) -> list[Text]:
    """What is doubtful about the records themselves: their input, and how they begin."""
    begun = [n for r in records if (n := doubtful_start(r, controller))] if initial_state == "auto" else []
    return [*reading_notes(records), *open_loop_notes(records, controller), *begun]


def reading_notes(records: Sequence[Record]) -> list[Text]:
    """What was noticed when the logs were read, and position and velocity of another scale.

    Each sentence once, with the names of its records where not all have it.
    """
    told: dict[str, list[str]] = {}
    for rec in records:
        for note in dict.fromkeys((*rec.notes, *_scale_notes(rec))):
            told.setdefault(note, []).append(rec.name)
    return [
        joined("", (f"{', '.join(filter(None, names))}: " if len(names) < len(records) and any(names) else "", note))
        for note, names in told.items()
    ]


def _scale_notes(rec: Record) -> list[Text]:
    """A sentence where position and velocity are of one motion, but not in the same unit."""
    if rec.position is None:
        return []
    times, correlation = slope_between(rec.position, rec.velocity, rec.dt)
    if correlation < POLICY.derivative or abs(times - 1.0) < POLICY.other_scale:
        return []
    text = (
        "The logged position moves {:.3g} times as fast as the logged velocity says: a unit, a gear or pole pairs stand between "
        "the two. {Inertia} and friction are those of the velocity; check which of them is right."
    )
    return [say(text, times)]
