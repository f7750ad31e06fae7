"""feedforward(): tables of friction, gravity and cogging, and the inertia, of what a diagnosis found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gaident.arguments import arg
from gaident.axis import TURN, Text, joined, message_of, say
from gaident.axis import called as name_in_words
from gaident.checks import size_of_drive
from gaident.control.controller import Controller, checked_controller
from gaident.data.record import Record
from gaident.diagnosis.library.cause import Cause
from gaident.diagnosis.library.terms import LIBRARY
from gaident.errors import GaidentError, SettingsError
from gaident.models.effect_rows import SHAFT, by_wave
from gaident.models.effects import Effect
from gaident.remedies.doubts import doubts_of
from gaident.remedies.following.simulated import following_error
from gaident.remedies.rules import rigid_axis
from gaident.remedies.tables import FeedforwardTables, Wave
from gaident.results.diagnosis import Diagnosis

__all__ = ["feedforward"]

LOWEST = 1e-3  # no decision: a grid: of the highest speed of a table
POINTS = 32  # no decision: a grid: speeds of a direction, where nobody asks for others
ANGLES = 360  # no decision: a grid: angles of a turn, where nobody asks for others
FEWEST, MOST = 2, 10_000  # no decision: what an argument may be


def feedforward(
    result: Diagnosis,
    *,
    speed: float | None = None,
    points: int = POINTS,
    angles: int = ANGLES,
    rec: Record | None = None,
    controller: Controller | None = None,
) -> FeedforwardTables:
    """Return what a drive can add to the torque beforehand: friction by velocity, gravity and cogging by angle, inertia.

    The friction is the static curve of each effect that has one, for both directions; what depends on the past or on time has
    that of its steady motion at the record's start.
    Harmonics of the angle are given as a table and as coefficients of sine and cosine; angles count as in the record.
    Under a digital controller that the loop follows, a record's command is simulated without and with the tables.

    Parameters
    ----------
    result : Diagnosis
        What `diagnose` found.
    speed : float, optional
        Highest speed of the table [rad/s]; None: the highest of the records.
    points : int
        Speeds of each direction, from 2 to 10000; they lie closer at low speeds.
    angles : int
        Angles of a turn, of a linear axis of the longest period, from 2 to 10000.
    rec : Record, optional
        The record whose command is simulated; None: the longest of those of the result, which a loaded result does not have.
    controller : PI or Cascade, optional
        The loop in which it is simulated; None: that of the result.

    Returns
    -------
    FeedforwardTables
        The tables, with `to_csv` and `to_c`.

    Raises
    ------
    SettingsError
        For something else than a diagnosis, a record or a controller with known gains, numbers out of their range, and no speed
        where there is no record.

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
    >>> tables = ga.feedforward(ga.diagnose(rec, controller, seed=1))
    >>> tables.torque([10.0, -10.0]).round(1).tolist(), round(tables.inertia, 3)
    ([0.8, -0.8], 0.01)
    >>> round(tables.following.after.rms / tables.following.before.rms, 1)  # of the following error in the simulated loop
    0.3
    """
    if not isinstance(result, Diagnosis):
        raise SettingsError(f"result is {type(result).__name__}: give what gaident.diagnose found")
    mechanism = result.model.mechanism
    if mechanism.gain < 0.0 or mechanism.p < 1:
        raise SettingsError(
            f"the model of the result has gain {mechanism.gain:g} and p = {mechanism.p}: tables are made for a drive that a "
            "positive torque turns forwards, with more poles than zeros; change the sign of the torque, or identify again"
        )
    for name, count in (("points", points), ("angles", angles)):
        if isinstance(count, bool) or not isinstance(count, int) or not FEWEST <= count <= MOST:
            raise SettingsError(f"{name} is {count!r}: give a whole number from {FEWEST} to {MOST}")
    if rec is not None and not isinstance(rec, Record):
        raise SettingsError(f"rec is {type(rec).__name__}: give the gaident.Record whose command is to be simulated, or None")
    given = checked_controller(controller)
    if given is not None and given.unknown:
        raise SettingsError(f"controller has {given.unknown[0]}=None: give a number, for its loop is simulated")
    highest = _speed_of(result.records if rec is None else (*result.records, rec), speed)
    one_way = np.geomspace(LOWEST * highest, highest, points)
    velocity = np.concatenate([-one_way[::-1], one_way])
    friction, constant, waves, left = np.zeros(2 * points), 0.0, [], []
    for effect in result.model.effects:
        row = LIBRARY.get(effect.key)
        if row is None or not (row.curve is not None or row.harmonic == "torque"):
            left += [name_in_words(effect.name)] * (effect.row.place == SHAFT)
        elif row.harmonic == "torque":
            waves += _waves(effect, row)
        elif row.curve is not None and row.constant:
            constant -= float(row.curve(np.ones(1), effect.parameters)[0])
        elif row.curve is not None:
            friction = friction - row.curve(velocity, effect.parameters)
    inertia, viscous = rigid_axis(result.model)
    turn = TURN if result.axis == "rotary" or not waves else TURN / min(wave.order for wave in waves)
    angle = turn * np.arange(angles) / angles if waves else np.zeros(0)
    by_angle = sum((w.sine * np.sin(w.order * angle) + w.cosine * np.cos(w.order * angle) for w in waves), np.zeros(len(angle)))
    tables = FeedforwardTables(
        velocity=velocity,
        friction=friction,
        viscous=viscous,
        constant=constant,
        angle=angle,
        by_angle=np.asarray(by_angle),
        waves=tuple(waves),
        inertia=inertia,
        doubts=doubts_of(result),
        notes=tuple(_notes(result, left)),
        axis=result.axis,
    )
    try:
        return replace(tables, following=following_error(result, tables, rec, controller))
    except GaidentError as reason:
        return replace(tables, no_following=message_of(reason))


def _waves(effect: Effect, row: Cause) -> list[Wave]:
    """-A sin(n theta + phase) acts, or a sum of such waves; its opposite is added."""
    found = []
    for p in by_wave(effect.parameters):
        order, size, phase = float(p.get("order", row.orders[0])), p["amplitude"], p["phase"]
        found.append(Wave(effect.name, order, float(size * np.cos(phase)), float(size * np.sin(phase))))
    return found


def _notes(result: Diagnosis, left: list[Text]) -> list[Text]:
    contained = {effect.key for effect in result.model.effects}
    found = [
        say("The tables take {} for granted: these data do not tell it from {}.", name_in_words(f.effect), _or(f.alternatives))
        for f in result.findings
        if f.alternatives and f.effect in contained and LIBRARY[f.effect].place == SHAFT
    ]
    if left:
        found.append(say("The tables do not contain {}: it has no curve over the velocity.", joined(", ", left)))
    if any(effect.row.place == "mechanism" for effect in result.model.effects):
        found.append(say("The {inertia} changes with the {angle}: the table has its mean."))
    rows = [LIBRARY[e.key] for e in result.model.effects if e.key in LIBRARY]
    if any(row.harmonic == "friction" for row in rows):
        found.append(say("The friction changes with the {angle}: the table has its mean."))
    if any(row.beside for row in rows):
        found.append(say("The friction grows with the load that the gear carries: the table has that without load."))
    if any(row.time_varying for row in rows):
        found.append(say("The friction changes in the course of the record: the table has that of its start."))
    return found


def _or(names: Sequence[str]) -> Text:
    return joined(" or ", [name_in_words(name) for name in names])


def _speed_of(records: Sequence[Record], speed: float | None) -> float:
    if speed is not None:
        return size_of_drive(speed, "speed", SettingsError, "give the highest speed of the table, > 0")
    if not records:
        raise SettingsError(f"the highest speed is not known: a loaded result has no records; give {arg('speed')}")
    return max(float(np.max(np.abs(r.velocity))) for r in records) or 1.0
