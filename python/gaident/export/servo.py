"""A controller as the tables of C that the runtime steps through: what it has beyond a bare PI (csrc/gaident/control/servo.hpp).

A step is a line of the log, r samples of the controller.
It reads the command at these samples, and where a feedforward has slopes over the coming period, at those that come after them:

    r + ahead numbers,   ahead = k of v*, 2 k with a* of a position command, 1 with a* of a velocity command, else 0

k: samples from one of the position controller's to the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gaident.axis import Text, say
from gaident.control.cascade import FEEDFORWARDS, FILTERS, Cascade, Filter, cascade_of
from gaident.control.controller import Controller
from gaident.control.pi import RULES
from gaident.export.c_text import array, number

__all__ = ["Servo"]

ANTI_WINDUP = {"none": "GAIDENT_NO_ANTI_WINDUP", "hold": "GAIDENT_HOLD", "tracking": "GAIDENT_TRACKING"}


@dataclass(frozen=True)
class Servo:
    """A controller with more than a bare PI, at its own clock; samples: of it in a step; period: from one to the next [s]."""

    cascade: Cascade
    samples: int
    period: float

    @classmethod
    def of(cls, controller: Controller | None, dt: float) -> Servo | None:
        """Of a controller in steps of dt [s]; None of a bare PI, and of none. Raises ControllerError."""
        if controller is None or controller.one_equation:
            return None
        every = controller.log_every(dt)
        return cls(cascade_of(controller), every, dt / every)

    @property
    def position_every(self) -> int:
        """Samples from one of the position controller's to the next; 1 without one."""
        return self.cascade.position_every(self.period)

    @property
    def ahead(self) -> int:
        """Samples of the command that are read after those of the step."""
        c = self.cascade
        if c.feedforward_over != "coming":
            return 0
        if c.position is None:
            return int(c.acceleration_feedforward != 0.0)
        slopes = 2 if c.acceleration_feedforward != 0.0 else int(self._feeds)
        return slopes * self.position_every

    @property
    def inputs(self) -> int:
        """Numbers that a step reads."""
        return self.samples + self.ahead

    @property
    def _feeds(self) -> bool:
        return any(getattr(self.cascade, name) != 0.0 for name in FEEDFORWARDS)

    @property
    def newest(self) -> float:
        """What the newest error adds to the integral [N m s/rad]."""
        pi = self.cascade.velocity
        return pi.ki * self.period * RULES[pi.rule]

    def table(self, name: str) -> list[str]:
        """The lines of C that say all that."""
        c, pi = self.cascade, self.cascade.velocity
        rows = [
            ("samples", str(self.samples)),
            ("before", number(pi.ki * self.period * (1.0 - RULES[pi.rule]))),
            ("command_weight", number(pi.command_weight)),
            ("anti_windup", ANTI_WINDUP[pi.anti_windup]),
            ("tracking", number(self.period / pi.tracking_time if pi.tracking_time else 0.0)),
            *((kind, self._filters(getattr(c, kind))) for kind in FILTERS if getattr(c, kind)),
            ("position_gain", number(0.0 if c.position is None else c.position.gain)),
            ("position_every", str(self.position_every)),
            ("feeds", str(int(self._feeds))),
            ("past", str(int(c.feedforward_over == "past"))),
            ("slope_time", number(self.position_every * self.period)),
            *((kind, number(getattr(c, kind))) for kind in FEEDFORWARDS),
        ]
        return [f"static const gaident_servo {name}_servo = {{", *(f"    .{key} = {value}," for key, value in rows), "};"]

    def _filters(self, filters: Sequence[Filter]) -> str:
        made = [one.digital(self.period) for one in filters]
        each = ",\n        ".join(array([*one.b, *one.a[1:]]) for one in made)
        return f"{{{len(made)}, {{\n        {each}}}}}"

    @property
    def driven_by(self) -> Text:
        """What drives it, with its unit."""
        return say("command [{rad/s}]" if self.cascade.position is None else "position command [{rad}]")

    def interface(self, name: str) -> list[str]:
        """What a step reads and gives, in sentences."""
        what = "velocity" if self.cascade.position is None else "position"
        every = f"{number(self.period)} s"
        lines = [f"input: the {what} command at this sample of the controller, which has one every {every}."]
        if self.inputs > 1:
            after = f", then {self.ahead} after them, of which a feedforward takes slopes" if self.ahead else ""
            lines = [
                f"input: {name.upper()}_INPUTS numbers, the {what} command at the controller's samples, one every {every}:",
                f"{self.samples} from this step on{after}.",
            ]
        if self.samples > 1:
            lines += ["What a step gives back, and s.torque, are those of its first sample."]
        return [*lines, f"s.angle is that at the next step; {name}_reset_at begins at another one than 0."]

    def said(self) -> list[Text]:
        """The controller in words and numbers, a line for each part."""
        c, pi = self.cascade, self.cascade.velocity
        limits = [
            f"{name.replace('_', ' ')} {v:.10g}" for name in ("torque_limit", "integrator_limit") if (v := getattr(pi, name))
        ]
        winding = [] if pi.anti_windup == "none" else [f"anti-windup by {pi.anti_windup}"]
        winding += [f"tracking time {pi.tracking_time:.10g} s"] if pi.tracking_time else []
        rule = [f"{pi.rule} rule", f"command weight {pi.command_weight:.10g}"]
        lines = [f"velocity controller: kp {pi.kp:.10g}, ki {pi.ki:.10g}, " + ", ".join([*rule, *limits, *winding])]
        if c.position is not None:
            lines += [f"position controller: gain {c.position.gain:.10g} 1/s, every {self.position_every * self.period:.10g} s"]
        over = f" (slopes over the {c.feedforward_over} period)"
        lines += [f"{n.replace('_', ' ')}: {v:.10g}{over}" for n in FEEDFORWARDS if (v := getattr(c, n))]
        for kind in FILTERS:
            lines += [f"{kind.replace('_', ' ').removesuffix('s')}: {_words(one)}" for one in getattr(c, kind)]
        late = [say("delay of the {torque}: {:.10g} s", c.delay)] if c.delay else []
        return [*(Text(line, line) for line in lines), *late]


def _words(one: Filter) -> str:
    told = one.to_dict()
    kind = told.pop("kind")
    return f"{kind}, " + ", ".join(f"{name.replace('_', ' ')} {value:.10g}" for name, value in told.items())
