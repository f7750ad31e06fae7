"""What records have to contain for an effect to show: conditions, plain physics with the record's own figures.

Each condition takes the records and says why it is not met, or None. The rows of the library name the conditions of an effect.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.axis import TURN, Text, joined, order, say, turns
from gaident.control.controller import Controller
from gaident.data.signals.lattice import lattice_step
from gaident.diagnosis.library.coordinates import HIGHEST_LOBE, HIGHEST_ORDER
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["SeenMotion", "Motions"]

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SeenMotion:
    """One record as the triggers see it; arrays of shape (n,).

    velocity as measured and smooth [rad/s], torque [N m], position [rad], command [rad/s] or None; floors: what is taken for
    noise around zero; moving: |smooth| above its floor; held: speeds held; jumps: sizes of command jumps; repeated: a speed held
    in the first third is held again in the last; logged: whether the torque is that of the log;
    measured: whether it was measured.
    """

    dt: float
    velocity: Vector
    smooth: Vector
    torque: Vector
    position: Vector
    command: Vector | None
    velocity_floor: float
    torque_floor: float
    moving: NDArray[np.bool_]
    held: tuple[float, ...]
    jumps: tuple[float, ...]
    repeated: bool
    logged: bool = True
    measured: bool = False


@dataclass(frozen=True, eq=False)
class Motions:
    """The records of a diagnosis; controller, model: None where not known; axis: rotary or linear.

    period: with which returns what is tied to the place [rad, m]; None: not known.
    """

    records: tuple[SeenMotion, ...]
    controller: Controller | None = None
    model: Model | None = None
    axis: str = "rotary"
    period: float | None = TURN

    @cached_property
    def top(self) -> float:
        """Highest smooth speed [rad/s]."""
        return max(float(np.abs(m.smooth).max()) for m in self.records)

    @cached_property
    def slowest(self) -> float:
        """Lowest speed measured [rad/s]."""
        return min(float(np.abs(m.velocity).min()) for m in self.records)

    @cached_property
    def travel(self) -> float:
        """Largest travel of a record [rad]."""
        return max(float(np.ptp(m.position)) for m in self.records)

    @cached_property
    def highest_torque(self) -> float:
        """[N m]"""
        return max(float(np.abs(m.torque).max()) for m in self.records)

    @cached_property
    def torque_changes_sign(self) -> bool:
        """Whether the torque of a record is beyond its noise in either direction."""
        return any(np.any(m.torque > m.torque_floor) and np.any(m.torque < -m.torque_floor) for m in self.records)


# Conditions.


def rotary(s: Motions) -> Text | None:
    """Of what returns with every turn: the position of a linear axis is a length, which does not say what one turn is."""
    if s.axis == "rotary":
        return None
    return Text("positions are lengths on a linear axis: which length is one turn, they do not say")


def periodic(s: Motions) -> Text | None:
    """Of what returns with every turn, or on a linear axis with every pitch: it is known how long that is."""
    if s.period is not None:
        return None
    return Text("positions are lengths on a linear axis: with which length it returns, they do not say; give its pitch")


def one_record(s: Motions) -> Text | None:
    """Of what goes on whatever the axis does: in another record it is anywhere in its period."""
    return None if len(s.records) == 1 else Text("its phase is another one in each record: give one record alone")


def torque_commanded(s: Motions) -> Text | None:
    """No torque was measured: its noise, and the friction that a model lacks, make a free run drift in waves of any frequency."""
    measured = any(m.measured for m in s.records)
    return say("the {torque} was measured: a free run under it drifts in waves of any frequency") if measured else None


def moves(s: Motions) -> Text | None:
    """The axis moves."""
    return None if any(np.any(m.moving) for m in s.records) else Text("the axis does not move")


def every_sample(s: Motions) -> Text | None:
    """The log has a line for each sample of a digital controller."""
    if s.controller is None:
        return None
    if s.controller.loop == "continuous":
        return Text("the controller has no samples")
    one = all(s.controller.log_every(m.dt) == 1 for m in s.records)
    return None if one else Text("the log has fewer lines than the controller has samples")


def torque_logged(s: Motions) -> Text | None:
    """The torque is logged: without it a limit in the controller makes a motion late, too."""
    logged = all(m.logged for m in s.records)
    return None if logged else say("no {torque} is logged: what is late in the controller looks the same")


def on_a_lattice(s: Motions) -> Text | None:
    """The velocities are whole numbers of a step, as the differences of an encoder's counts are."""
    if all(lattice_step(m.velocity) > 0.0 for m in s.records):
        return None
    return Text("the velocities are no multiples of one step, as differences of an encoder's counts are")


def both_directions(s: Motions) -> Text | None:
    """It moves forwards and backwards."""
    forward = any(np.any(m.moving & (m.smooth > 0.0)) for m in s.records)
    backward = any(np.any(m.moving & (m.smooth < 0.0)) for m in s.records)
    return None if forward and backward else say("the axis {turns} {} only", "forwards" if forward else "backwards")


def creeps(s: Motions) -> Text | None:
    """It moves slowly, or reverses."""
    return say("the axis never {turns} slower than {:.3g} {rad/s}", s.slowest) if s.slowest > POLICY.slow * s.top else None


def stands_or_reverses(s: Motions) -> Text | None:
    """It stands still, or reverses."""
    reverses = any(np.any(m.moving & (m.smooth > 0.0)) and np.any(m.moving & (m.smooth < 0.0)) for m in s.records)
    if not reverses and s.slowest > max(m.velocity_floor for m in s.records):
        return say("the axis neither stands nor reverses (slowest {:.3g} {rad/s})", s.slowest)
    return None


def several_speeds(s: Motions) -> Text | None:
    """Speeds of different size are held, or swept through."""
    speeds = sorted({round(abs(v) / (POLICY.slow * s.top)) for m in s.records for v in m.held if v})
    near = sum(int(np.sum(np.abs(np.abs(m.smooth[m.moving]) - s.top) < POLICY.slow * s.top)) for m in s.records)
    if len(speeds) < 2 and 2 * near > sum(int(np.sum(m.moving)) for m in s.records):
        return say("one speed only ({:.3g} {rad/s}): its drag is viscous friction there", s.top)
    return None


def speeds_mixed_in_time(s: Motions) -> Text | None:
    """The speed does not only rise or only fall in the course of the record."""
    if all(_monotone(m, POLICY.apart * s.top) for m in s.records):
        return Text("no speed is held early and late, nor are speeds mixed in time: a drift would be drag")
    return None


def _monotone(m: SeenMotion, apart: float) -> bool:
    """Nothing is repeated, and the speeds held while moving only rise or only fall with time."""
    steps = np.diff([abs(v) for v in m.held if v])
    return not m.repeated and bool(np.all(steps > -apart) or np.all(steps < apart))


def part_of_a_turn(s: Motions) -> Text | None:
    """A torque once per turn changes over the travel."""
    if s.travel < POLICY.gravity_turn * TURN:
        return say("{}: over so little it is a constant load", _reach(s))
    return None


def period_of_an_order(s: Motions) -> Text | None:
    """The travel contains a period of the highest order that a drive is expected to have."""
    return _period_of(HIGHEST_ORDER, s)


def period_of_a_lobe(s: Motions) -> Text | None:
    """The travel contains a period of the highest order that the inertia of a mechanism is expected to have."""
    return _period_of(HIGHEST_LOBE, s)


def _period_of(last: int, s: Motions) -> Text | None:
    highest = last * _per_turn(s)
    if s.travel < TURN / highest:
        return say("{} contain no period of order {} or less", _reach(s), order(highest))
    return None


def period_both_ways(s: Motions) -> Text | None:
    """It passes most of a period forwards and backwards: what opposes the motion there is told from what acts either way."""
    wanted = POLICY.seen_turn * (s.period or TURN)
    ways = [sum(float(np.sum(np.maximum(sign * m.smooth, 0.0))) * m.dt for m in s.records) for sign in (1.0, -1.0)]
    if min(ways) < wanted:
        way = "forwards" if ways[0] < ways[1] else "backwards"
        return say("the axis {turns} less than {:.2g} of a period {}", POLICY.seen_turn, way)
    return None


def _per_turn(s: Motions) -> float:
    """Order 1 of what returns with every period [1/turn]."""
    return TURN / (s.period or TURN)


def _reach(s: Motions) -> Text:
    size = Text(f"{math.degrees(s.travel):.2g} degrees", f"{s.travel:.2g} m")
    return say("{} between the lowest and the highest {angle}", size)


def torque_reverses(s: Motions) -> Text | None:
    """The torque changes its sign, so that a coupling leaves its flank."""
    return None if s.torque_changes_sign else say("the {torque} never changes its sign: the coupling stays on one flank")


def torque_near_zero(s: Motions) -> Text | None:
    """The torque passes through zero, or comes near it."""
    if s.torque_changes_sign:
        return None
    least = min(float(np.abs(m.torque).min()) for m in s.records)
    if least > POLICY.slow * s.highest_torque:
        return say("the {torque} never comes near zero (least {:.2g} {N m}): a dead band is a constant load", least)
    return None


def torque_changes(s: Motions) -> Text | None:
    """The torque is not one number throughout."""
    return say("the {torque} never changes") if all(float(np.ptp(m.torque)) == 0.0 for m in s.records) else None


def in_a_loop(s: Motions) -> Text | None:
    """A command drives the model through a controller."""
    if s.controller is None or (_unseen(s) and s.controller.one_equation):
        return say("the {torque} drives the model: no controller is simulated from a command")
    return None


def _unseen(s: Motions) -> bool:
    """Whether no velocity command is logged."""
    return all(m.command is None for m in s.records)


def integrates(s: Motions) -> Text | None:
    """The controller has an integral part."""
    none = s.controller is not None and s.controller.gains.ki == 0.0
    return Text("the controller has no integral part") if none else None


def command_changes(s: Motions) -> Text | None:
    """The velocity command is logged, and not one number throughout."""
    if _unseen(s):
        return say("the velocity command is not logged")
    if any(m.jumps or (m.command is not None and np.any(np.diff(m.command) != 0.0)) for m in s.records):
        return None
    return Text("the command never changes")


def shaft_resonates(s: Motions) -> Text | None:
    """The identified model has a resonance, or there is none yet."""
    if s.model is None or any(pole.imag > 0.0 for pole in s.model.poles):
        return None
    return Text(f"the model ({s.model.p},{s.model.q}) shows no shaft resonance, so that there is no coupling to have it")


# Sizes that could not have shown.


def torque_beyond(s: Motions) -> Text | None:
    """Limits of the torque above what the records contain."""
    limit = math.inf if s.controller is None else s.controller.limits[0]
    own = s.highest_torque > POLICY.at_limit * limit
    why = Text("the controller's own limit lets no more through") if own else say("no more {torque} was asked for")
    return say("a limit above {:.3g} {N m} would not have shown: {}", s.highest_torque, why)


def loaded_before(s: Motions) -> Text | None:
    """A constant load that the integrator of the controller stored when a record without a torque began."""
    if s.controller is None or s.controller.gains.ki == 0.0 or all(m.logged for m in s.records):
        return None
    text = "no {torque} is logged: a load that the integrator stored when the record began shows in no other signal"
    return say(text)


def integral_beyond(s: Motions) -> Text | None:
    """Clamps of the controller's integral above what the records contain."""
    if s.controller is None:
        return None
    integral = max((_integral(m, s.controller) for m in s.records), default=0.0)
    if not integral > 0.0:
        return None
    own = integral > POLICY.at_limit * s.controller.limits[1]
    why = Text("the controller's own clamp lets it go no higher" if own else "the integral went no higher")
    return say("a clamp above {:.3g} {N m} would not have shown: {}", integral, why)


def _integral(m: SeenMotion, controller: Controller) -> float:
    """Highest |u - kp (r - w)| [N m] of a bare PI while its limit does not cut its torque u; 0 without a command."""
    if m.command is None or not controller.one_equation:
        return 0.0
    free = np.abs(m.torque) <= POLICY.at_limit * controller.limits[0]
    integral = np.abs(m.torque - controller.gains.kp * (m.command - m.velocity))[free]
    return float(integral.max(initial=0.0))


def slope_beyond(s: Motions) -> Text | None:
    """Limits of the command's slope above the steepest one."""
    if s.controller is None:
        return None
    slope = max((float(np.abs(np.diff(m.command)).max()) / m.dt for m in s.records if m.command is not None), default=0.0)
    return say("a limit above {:.3g} {rad/s^2} would not have shown: no command rises faster", slope) if slope > 0.0 else None


def resonance_beyond(s: Motions) -> Text:
    """Resonances that are too fast for the sampling, of a shaft or another one."""
    dt = max(m.dt for m in s.records)
    highest = 0.5 / dt  # no decision: a formula: half the sampling frequency
    if any(m.measured for m in s.records):
        text = (
            "one of a shaft above {:.3g} Hz would not have been named, as a measured {torque} is not known between the lines of "
            "the log, {:.3g} ms apart; none above {:.3g} Hz would have shown"
        )
        return say(text, POLICY.seen_measured * highest, 1e3 * dt, POLICY.seen_band * highest)
    text = "one above {:.3g} Hz would not have shown, of a shaft or another: the log has a line every {:.3g} ms"
    return say(text, POLICY.seen_band * highest, 1e3 * dt)


def frequencies_beyond(s: Motions) -> Text:
    """Frequencies in time that are too high for the sampling."""
    highest = POLICY.seen_band * 0.5 / max(m.dt for m in s.records)  # no decision: a formula: of half the sampling frequency
    return Text(f"one above {highest:.3g} Hz would not have shown: the log has too few lines")


def orders_beyond(s: Motions) -> Text | None:
    """Orders of the angle too low for the travel, or too high for the sampling."""
    return _beyond(HIGHEST_ORDER, s)


def lobes_beyond(s: Motions) -> Text | None:
    """Such orders of an inertia."""
    return _beyond(HIGHEST_LOBE, s)


def _beyond(last: int, s: Motions) -> Text | None:
    one = _per_turn(s)
    reached = s.travel * one / TURN  # periods of the first order
    least = math.ceil(POLICY.seen_periods / reached) if reached > 0.0 else last
    if least == 2 and reached > POLICY.seen_turn:  # no decision: a formula: the second order, below which the first one shows
        least = 1
    per_sample = max(_slowest_held(m) * m.dt for m in s.records)
    fastest = math.floor(POLICY.seen_band * math.pi / per_sample / one) if per_sample > 0.0 else None
    text = "orders below {} need more than the {} between the lowest and the highest {angle} of a record"
    below = say(text, order(least * one), turns(s.travel))
    parts = [below] if least > (1 if s.period else 2) else []  # of a turn, order 1 is an unbalance
    if fastest is not None and fastest < last:
        parts.append(say("orders above {} are faster than the sampling even at the slowest speed held", order(fastest * one)))
    return joined("; ", parts) if parts and least <= last else None


def _slowest_held(m: SeenMotion) -> float:
    """Least speed held while moving [rad/s]; 0 where none is held."""
    return min((abs(v) for v in m.held if v), default=0.0)
