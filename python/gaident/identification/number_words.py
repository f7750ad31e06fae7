"""What is said of a controller's numbers that were given as None: how the torque follows from them, and why it does not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gaident.arguments import TORQUE, arg
from gaident.axis import Text, joined, say, unit_text
from gaident.control.cascade import WAYS, cascade_of
from gaident.control.controller import Controller
from gaident.control.unknown import UNITS, field_of
from gaident.data.record import Record
from gaident.identification.number_ranges import EXCHANGEABLE
from gaident.results.estimate import Estimate

__all__ = [
    *("OTHER_FORM", "exchangeable", "found", "lacking", "moved", "negative"),
    *("not_followed", "not_shown", "other_reading", "read_as"),
]


OTHER_FORM = (
    "The drive's has another form: give its filters, command_weight, feedforward and limits, with None ('unknown' in a drive "
    "file) for numbers that you do not know, or leave the controller out and let the torque drive the model"
)


def found(estimates: Mapping[str, Estimate], rms: float, size: float) -> Text:
    numbers = (
        say("{} = {:.5g} +- {:.2g}{}", name, e.value, e.std, "" if e.unit == "1" else joined("", (" ", unit_text(e.unit))))
        for name, e in estimates.items()
    )
    text = (
        "Of the controller, {}: as the logged {torque} shows, which follows from command and velocity to {:.2g} {N m} rms, "
        "of {:.2g} {N m} rms."
    )
    return say(text, joined(", ", numbers), rms, size)


def read_as(controller: Controller, given: Controller) -> str:
    """How it reads its command, as far as that is not what was given; "" where it is."""
    own, other = cascade_of(controller), cascade_of(given)
    way, over = own.interpolation, own.feedforward_over
    ways = []
    if way != other.interpolation:
        ways.append(f"a position command that goes {way} between the lines of the log (interpolation {way!r})")
    if over != other.feedforward_over:
        ways.append(f"a feedforward of the command's slope over the {over} period (feedforward_over {over!r})")
    return " and ".join(ways)


def other_reading(controller: Controller, given: Controller) -> Text:
    text = "The {torque} follows clearly better with {} (given: {}): all simulations use this."
    was = (getattr(cascade_of(given), name) for name in WAYS if getattr(cascade_of(given), name) != getattr(controller, name))
    return say(text, read_as(controller, given), ", ".join(map(repr, was)))


def exchangeable(twin: Mapping[str, float]) -> Text:
    """twin: the other values of all unknown numbers."""
    pair = {name: twin[name] for name in EXCHANGEABLE}
    numbers = joined(
        " and ", [say("{} = {:.4g} {}", name, value, unit_text(UNITS[field_of(name)])) for name, value in pair.items()]
    )
    text = (
        "The {torque} does not tell these numbers from {}: where all of the command's slope is fed forward, position gain and "
        "ki/kp can change places. Give the one that the drive shows."
    )
    return say(text, numbers)


def moved(shift: int) -> Text:
    text = "The log wrote the {torque} a line {} against command and velocity: only so do these numbers make it."
    return say(text, "late" if shift < 0 else "early")


def not_followed(unknown: Sequence[str], rms: float, size: float) -> str:
    return (
        f"{unknown[0]} of the controller is None, not known, and whatever it is, the logged torque does not follow from command "
        f"and velocity through this controller (by {rms:.2g} of {size:.2g} rms). "
    )


def not_shown(name: str, estimate: Estimate) -> str:
    return (
        f"{name} of the controller is None, not known, and the records do not show it ({estimate.value:.3g} "
        f"+- {estimate.std:.2g} {estimate.unit}): give its number, leave out what has no effect, or log a motion in which it acts"
    )


def negative(name: str, value: float, unit: str) -> str:
    return (
        f"{name} of the controller is None, not known, and the torque follows best with {value:.3g} {unit}, "
        f"but no such controller has a number below 0: give {name.rsplit('.', 1)[-1]}=0 where it has no such "
        "part, else its filters and feedforward too, or check the sign of the torque"
    )


def lacking(rec: Record, controller: Controller) -> str:
    """Which signal a record lacks that would show the first unknown number, as an error; empty where it lacks none."""
    name, name_of = controller.unknown[0], f"record {rec.name or '(without a name)'}"
    if rec.torque is None:
        return (
            f"{name} of the controller is None, not known, and {name_of} has no torque that would show it: give {TORQUE}, or "
            f"the number of {name}"
        )
    for channel in controller.reads:
        if getattr(rec, channel) is None:
            return (
                f"{name} of the controller is None, not known, and {name_of} has no {channel}, from which it follows: give "
                f"{arg(channel)}, or the number of {name}"
            )
    return ""
