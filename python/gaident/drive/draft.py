"""A drive.toml for the axis behind a log: what the log shows is written down, what it cannot show is marked FILL IN."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, said, say, unit, word
from gaident.data.column_score import LOAD_QUANTITY
from gaident.data.formats.units import factor, needed_constant
from gaident.data.guess import Guess, guess_channels, unit_from_position, unit_from_velocity
from gaident.data.listing import Listing
from gaident.data.timeaxis import SLOW_STEP, stamp_unit
from gaident.data.torque_kind import kind_of_torque
from gaident.drive.draft_lines import any_scale, head_of, line_of, plain, quoted, resampling_of
from gaident.drive.log_content import axes_of, factor_of, gaps_of, kind_of_axis, with_content
from gaident.errors import ReadError

__all__ = ["DriveDraft", "draft"]

_SI = {"command": "rad/s", "velocity": "rad/s", "torque": "N m", "position": "rad", "position_command": "rad"}
_CONSTANTS = {
    "rated_torque": ("2.4", say("{N m} at 100 %")),
    "torque_constant": ("0.05", say("{N m/A}")),
    "reference_speed": ("314.16", say("{rad/s} at 100 %")),
    "torque_per_volt": ("0.24", say("{N m/V}")),
    "counts_per_turn": ("4096", Text("encoder counts per turn of the motor")),
}
SPACE = "what you expect: said beside what is found; identify looks only there"
NONE: Mapping[str, str | int] = {}
LIMITS = "what an experiment may do, for `gaident experiment`"
SHOW = "units of the summary and the page, beside SI"


@dataclass(frozen=True)
class DriveDraft:
    """text: the drive.toml; fill_in: what a person must add, one line each; channels: channel -> column.

    torque_is: what the torque is, as its column's name says; None where it does not, or there is none, or there are several axes.
    axes: their names where the log contains several; channels are called "NAME.velocity" then.
    """

    text: str
    fill_in: tuple[str, ...]
    channels: Mapping[str, str]
    torque_is: str | None
    axes: tuple[str, ...] = ()


def draft(listing: Listing, values: Mapping[str, NDArray[np.float64]], options: Mapping[str, str | int] = NONE) -> DriveDraft:
    """The drive.toml for a log; values: its columns in the file's units, {} where it is too long to be looked into.

    options: with which the log is read, keys of the file and their values.
    Raises ReadError where the log contains nothing that could be a channel.
    """
    given = [f"{key} = {quoted(value)}" for key, value in options.items()]
    several = axes_of(listing)
    if several:
        drafts = {name: _Draft(own, with_content(own, guess, values), values, name) for name, (own, guess) in several.items()}
        return _together(drafts, given)
    guess = with_content(listing, guess_channels(listing), values)
    if not guess.channels and not any(c.samples > 1 for c in listing.columns):
        raise ReadError(f"{listing.path}: the log contains no column of more than one number; give a log of a run")
    return _Draft(listing, guess, values).done(given)


def _together(drafts: Mapping[str, _Draft], given: Sequence[str]) -> DriveDraft:
    """One file for several axes: the time above, what belongs to one axis below [axes.NAME]."""
    first = next(iter(drafts.values()))
    parts = [head_of(first.listing.path), *first.clock(), *given, "", "[columns]", *first.time(), ""]
    parts += ["[units]", *first.unit_of_time(), ""]
    fill = list(first.fill)
    channels: dict[str, str] = {}
    for name, d in drafts.items():
        above = len(d.fill)  # what stands in the part of all axes was written by the first
        parts += [f"[axes.{name}]", *d.of_axis(), "", *d.sections(), ""]
        fill += [f"axes.{name}: {line}" for line in d.fill[above:]]
        channels |= {f"{name}.{channel}": column.name for channel, column in d.guess.channels.items()}
    return DriveDraft("\n".join(parts), tuple(fill), channels, None, tuple(drafts))


class _Draft:
    """The lines, as they are put together."""

    def __init__(self, listing: Listing, guess: Guess, values: Mapping[str, NDArray[np.float64]], name: str = "") -> None:
        self.listing, self.guess, self.values = listing, guess, values
        self.prefix = f"axes.{name}." if name else ""  # of the sections of one axis of several
        self.fill: list[str] = []
        self.units = {channel: column.unit for channel, column in guess.channels.items()}
        self.axis = kind_of_axis(self.units)
        torque = guess.channels.get("torque")
        self.torque_is = None if torque is None else kind_of_torque((torque.name, *torque.names))
        self.gaps, usual = gaps_of(values.get(guess.time.name) if guess.time else None)
        self.dt = (
            next((c.sample_time for c in guess.channels.values() if c.sample_time is not None), None)
            or (float(f"{usual * self._second():.9g}") if self.gaps else None)
            or self._step_of_time()
        )
        self.compared: dict[str, tuple[str, str]] = {}  # channel -> (unit, what it was compared with)
        self._compare_velocity()
        self._compare_command()

    def _step_of_time(self) -> float | None:
        """dt of a time column that was known by its values."""
        time = self.guess.time
        if time is None or not time.rises_evenly or time.lowest is None or time.highest is None or time.samples < 2:
            return time.sample_time if time is not None else None
        return float(f"{(time.highest - time.lowest) / (time.samples - 1) * self._second():.9g}")

    def _second(self) -> float:
        """One unit of the time column in s."""
        time = self.guess.time
        if time is None or time.lowest is None:
            return 1.0
        return factor("time", time.unit) if time.unit else stamp_unit(time.lowest)

    def _compare_velocity(self) -> None:
        """The unit of the velocity by comparison with the position, where the log does not say it."""
        channels = self.guess.channels
        if self.dt is None or not {"velocity", "position"} <= channels.keys() or self.units["velocity"] is not None:
            return
        size = factor_of("position", self.units["position"])
        position, velocity = (self.values.get(channels[channel].name) for channel in ("position", "velocity"))
        if size is None or position is None or velocity is None or len(position) != len(velocity):
            return
        found = unit_from_position(velocity, position * size, self.dt, self.axis == "linear")
        if found is not None:
            self.compared["velocity"] = found, "position"

    def _compare_command(self) -> None:
        """The unit of the command by comparison with the velocity, which follows it."""
        channels = self.guess.channels
        if not {"velocity", "command"} <= channels.keys() or self.units["command"] is not None:
            return
        size = factor_of("velocity", self.units["velocity"] or self.compared.get("velocity", (None, ""))[0])
        command, velocity = (self.values.get(channels[channel].name) for channel in ("command", "velocity"))
        if size is None or command is None or velocity is None or len(command) != len(velocity):
            return
        if not (np.isfinite(command).all() and np.isfinite(velocity).all()):
            return
        found = unit_from_velocity(command, velocity * size, self.axis == "linear")
        if found is not None:
            self.compared["command"] = found, "velocity"

    def done(self, given: Sequence[str]) -> DriveDraft:
        parts = [head_of(self.listing.path), *self.of_axis(), *self.clock(), *given, "", *self.sections(), ""]
        names = {channel: column.name for channel, column in self.guess.channels.items()}
        return DriveDraft("\n".join(parts), tuple(self.fill), names, self.torque_is)

    def sections(self) -> list[str]:
        """All sections of the axis."""
        time = ([], []) if self.prefix else (self.time(), self.unit_of_time())
        parts = [*self._section("columns", [*time[0], *self._columns()]), "", *self._section("units", [*self._units(), *time[1]])]
        parts += ["", *self._section("controller", self._controller()), "", *self._section("space", self._space(), SPACE)]
        parts += ["", *self._section("show", self._shown(), SHOW)]
        return [*parts, "", *self._section("limits", self._limits(), LIMITS)]

    def _section(self, name: str, lines: list[str], comment: str = "") -> list[str]:
        return [line_of(f"[{self.prefix}{name}]", comment), *lines]

    def of_axis(self) -> list[str]:
        """What stands at the top and belongs to the axis."""
        lines = [
            line_of(
                f'axis = "{self.axis}"',
                'or "linear": m, m/s, N, kg' if self.axis == "rotary" else 'or "rotary"',
            )
        ]
        if self.axis == "linear":
            lines.append(line_of('# pitch = "24 mm"', "with which a cogging returns: pitch of the screw, or of the poles"))
            lines.append(line_of('# screw = "10 mm"', 'of a turn of the motor, for gains in N m s/rad: then axis = "rotary"'))
        for name in dict.fromkeys(needed_constant(channel, stated) for channel, stated in self.units.items() if stated):
            if name is not None:
                value, meaning = _CONSTANTS[name]
                which = next(c for c, stated in self.units.items() if stated and needed_constant(c, stated) == name)
                lines.append(
                    self._todo(
                        f"# {name} = {value}", name, f"{said(meaning, self.axis)}; the {which} is logged in {self.units[which]}"
                    )
                )
        if "torque" in self.guess.channels or self._asked("torque", "command"):
            kinds = '"commanded": by the controller; "measured": a current times a constant'
            if self.torque_is is not None:
                lines.append(line_of(f"torque_is = {quoted(self.torque_is)}", f"as its column's name says; {kinds}"))
            elif self._driven:
                lines.append(self._todo('# torque_is = "measured"', "torque_is", f"{kinds}; commanded is taken"))
            else:
                taken = "measured is taken, as no command is logged"
                lines.append(self._todo('torque_is = "measured"', "torque_is", f"{kinds}; {taken}"))
        lines.append(
            line_of("# gear_ratio = 10.0", 'turns of the motor per turn of the load, with load_side = ["position"], what was')
        )
        lines.append(line_of("", "measured behind the gear"))
        return lines

    def clock(self) -> list[str]:
        """What stands at the top and says how lines follow each other."""
        lines = []
        time = self.guess.time
        if time is None and self.dt is None:
            lines.append(self._todo("# dt = 1e-3", "dt", "s; no column looks like time"))
        elif self.gaps:
            some = "a gap" if self.gaps == 1 else f"{self.gaps} gaps"
            lines.append(line_of("pieces = true", f"the time has {some}: what lies around them are records of their own"))
            lines.append(line_of(f"# dt = {self.dt:.9g}", "s, between the gaps; needed for gaident experiment"))
        elif self.dt is None:
            stamps = self.values.get(time.name) if time is not None else None
            axis = resampling_of(np.zeros(0) if stamps is None else np.diff(stamps) * self._second())
            lines.append(self._todo(*axis, f"the time stamps are irregular: {plain(time.note if time else '')}"))
        else:
            source = f"from the column {quoted(time.name)}" if time is not None else "as the file states"
            lines.append(line_of(f"# dt = {self.dt:.9g}", f"s, {source}; needed for logs without it, and for gaident experiment"))
        lines.append(line_of("# decimate = 10", "keep every tenth sample behind a low-pass, for very long logs"))
        return lines

    def time(self) -> list[str]:
        """The column of the time."""
        found = self.guess.time
        return [] if found is None else [line_of(f"time = {quoted(found.name)}", "" if found.is_time else "rises evenly")]

    def _columns(self) -> list[str]:
        lines = []
        for channel, column in self.guess.channels.items():
            lines.append(line_of(f"{channel} = {quoted(column.name)}", self.guess.reasons.get(channel, "")))
        rest = [
            c.name
            for c in self.listing.columns
            if c not in (*self.guess.channels.values(), self.guess.time)
            and not c.is_time
            and c.samples > 1
            and c.lowest != c.highest
        ]
        # no decision: how many columns a remark names
        others = f"; the log also contains {', '.join(map(quoted, rest[:8]))}" if rest else ""
        if not self.guess.channels.keys() & {"velocity", "position"}:
            either = self._either("velocity", "position")
            text = f", not its command: {either}" if either else f" (or position){others}"
            lines.append(self._todo('# velocity = "..."', "velocity", f"the measured velocity{text}"))
        for channel, other, text in (
            ("command", "torque", "the velocity command, for closed loop"),
            ("torque", "command", f"the controller's {word('torque', self.axis)} (or current), for open loop"),
        ):
            if channel not in self.guess.channels:
                either = self._either(channel)
                told = f"{text}: {either}" if either else f"{text}{others}"
                line = f'# {channel} = "..."'
                lines.append(self._todo(line, channel, told) if self._asked(channel, other) else line_of(line, told))
        if self.axis == "rotary" and needed_constant("torque", self.units.get("torque") or "") == "torque_constant":
            supplies = [c.name for c in self.listing.columns if c.name in rest and factor_of("voltage", c.unit) is not None]
            if supplies:
                what = "of the motor, beside current = ... in place of the torque: winding and torque constant are estimated"
                lines.append(line_of(f"# voltage = {quoted(supplies[0])}", what))
        for channel in ("position", "position_command"):
            if channel not in self.guess.channels and (either := self._either(channel)):
                lines.append(line_of(f'# {channel} = "..."', either))
        return lines

    def _asked(self, channel: str, other: str) -> bool:
        """Whether a channel that is not found is asked for: some columns may be it, or neither it nor the other one is there."""
        found = self.guess.channels
        return channel not in found and (bool(self._either(channel)) or (other not in found and not self._placed))

    @property
    def _placed(self) -> bool:
        """Whether a position controller drives the axis: what it is given and what it reads are logged."""
        return {"position", "position_command"} <= self.guess.channels.keys()

    @property
    def _driven(self) -> bool:
        """Whether a command is logged, so that a controller can be simulated."""
        return bool({"position_command", "command"} & self.guess.channels.keys())

    def _either(self, *channels: str) -> str:
        """The columns of which one may be the channel, where only the user knows; "" where there are none."""
        names = dict.fromkeys(c.name for channel in channels for c in self.guess.undecided.get(channel, ()))
        free = [name for name in names if name not in {c.name for c in self.guess.channels.values()}]
        return f"{' or '.join(map(quoted, free))}?" if free else ""

    def _units(self) -> list[str]:
        lines = []
        si = {channel: unit(rotary, self.axis) for channel, rotary in _SI.items()}
        for channel in self.guess.channels:
            stated = self.units[channel]
            if channel in LOAD_QUANTITY and (stated is None or factor_of(channel, stated) is None):
                lines.append(any_scale(channel, stated))
            elif stated is not None and factor_of(channel, stated) is None:
                text = f"the log says {quoted(stated)}, which is not known"
                lines.append(self._todo(f'# {channel} = "{si[channel]}"', f"units.{channel}", text))
            elif stated is not None:
                lines.append(line_of(f"{channel} = {quoted(stated)}", "as the log says"))
            elif channel in self.compared:
                known, other = self.compared[channel]
                lines.append(line_of(f"{channel} = {quoted(known)}", f"by comparison with the {other}"))
            else:
                lines.append(
                    self._todo(
                        f'# {channel} = "{si[channel]}"', f"units.{channel}", f"the log does not say it; {si[channel]} is taken"
                    )
                )
        return lines

    def unit_of_time(self) -> list[str]:
        """The unit of the time, where the log does not say it."""
        lines: list[str] = []
        time = self.guess.time
        if time is not None and time.unit is None and (time.lowest is None or stamp_unit(time.lowest) == 1.0):
            if self.dt is not None and self.dt >= SLOW_STEP:
                text = f"the log does not say it; with s its lines would be {self.dt:g} s apart"
                lines.append(self._todo('# time = "ms"', "units.time", text))
            else:
                lines.append(line_of('# time = "s"', "the log does not say it; s is taken"))
        return lines

    def _controller(self) -> list[str]:
        text = "as set in the drive"
        if "torque" in self.guess.channels:
            text += ', "unknown", or loop = "open"'
        positioned, driven = "position_command" in self.guess.channels, self._driven
        mark = self._todo if driven else lambda line, _, comment: line_of(line, comment)
        torque = word("torque", self.axis)
        open_loop = f"without a command the {torque} drives the model"
        if driven:
            loop = line_of('# loop = "sampled"', f'a digital drive; or "continuous"; or "open": the {torque} drives the model')
        elif self._asked("command", "torque"):
            loop = self._todo('# loop = "open"', "controller.loop", f"{open_loop}; with a command give kp and ki in its place")
        else:
            loop = line_of('loop = "open"', open_loop)
        return [
            mark("# kp = 0.0232", "controller.kp", f"{unit('N m s/rad', self.axis)}; proportional gain {text}"),
            mark(
                "# ki = 1.367",
                "controller.ki",
                f'{unit("N m/rad", self.axis)}; integral gain, or in its place tn = "17 ms", its time',
            ),
            line_of('# period = "125 us"', "of a controller that is faster than the log; also delay, ..."),
            line_of('# torque_filters = [{ kind = "low pass", frequency = "250 Hz" }]', "also velocity_filters, command_filters"),
            line_of('# rule = "backward"', 'of the integral, or "forward"; left out: "trapezoidal"'),
            line_of("# torque_limit = 2.4", "a known limit of the controller, and integrator_limit"),
            *(self._position_controller() if positioned else []),
            loop,
            line_of('# anti_windup = "hold"', 'at a torque_limit; or "tracking" with tracking_time'),
            line_of('# drive = "sinamics"', "with p1460 and p1462 in place of kp and ki: gains as the drive shows them"),
        ]

    def _position_controller(self) -> list[str]:
        place = "# position_gain = 40.0"
        if "command" in self.guess.channels:
            gain = line_of(place, "1/s; without it the velocity command drives the loop")
        else:
            gain = self._todo(place, "controller.position_gain", "1/s; position command and position drive the loop")
        return [gain, line_of('# velocity_feedforward = "100 %"', "also acceleration_feedforward, feedforward_over, ...")]

    def _space(self) -> list[str]:
        return [
            line_of("# inertia = [1e-4, 5e-3]", said(Text("total inertia at the motor, kg m^2", "total mass, kg"), self.axis)),
            line_of("# damping = [1e-3, 3e-3]", said(say("viscous friction, {N m s/rad}"), self.axis)),
            line_of("# resonance_hz = [5, 200]", "where the mechanism may resonate"),
        ]

    def _shown(self) -> list[str]:
        units = {name: self.units.get(name) for name in ("velocity", "torque", "position") if name in self.guess.channels}
        return [line_of(f"# {name} = {quoted(stated)}", "as the log says") for name, stated in units.items() if stated]

    def _limits(self) -> list[str]:
        lines = []
        for name, channels, rotary in (("speed", ("velocity", "command"), "rad/s"), ("torque", ("torque",), "N m")):
            largest = self._largest(channels)
            if largest is None:
                lines.append(line_of(f"# {name} = 1.0", unit(rotary, self.axis)))
            else:
                lines.append(line_of(f"# {name} = {largest:.3g}", f"{unit(rotary, self.axis)}; the largest of this log"))
        lines.append(line_of("# travel = 100.0", said(Text("rad; left out: it may turn freely", "m"), self.axis)))
        lines.append(line_of("# duration = 5.0", "s"))
        return lines

    def _largest(self, channels: tuple[str, ...]) -> float | None:
        """The largest absolute value of these channels in SI, where units are known; to three digits, rounded up."""
        found = []
        for channel in channels:
            column = self.guess.channels.get(channel)
            unit = self.units.get(channel) or self.compared.get(channel, (None, ""))[0]
            size = factor_of(channel, unit)
            if column is None or size is None or (unit and needed_constant(channel, unit)):
                continue
            if column.lowest is not None and column.highest is not None:
                found.append(size * max(abs(column.lowest), abs(column.highest)))
        if not found or max(found) == 0.0:
            return None
        digits = 2 - math.floor(math.log10(max(found)))
        return float(math.ceil(max(found) * 10.0**digits) / 10.0**digits)

    def _todo(self, line: str, what: str, *comments: str) -> str:
        comment = "; ".join(comments)
        self.fill.append(f"{what}: {comment}")
        return line_of(line, f"FILL IN: {comment}")
