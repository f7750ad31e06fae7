"""What a proposed command may ask of the axis: the margins of experiments, with unit, source and command.

A user runs these commands on his axis. They decide how near to its limits of speed, travel and torque it comes.
"""

from __future__ import annotations

from dataclasses import dataclass

from gaident.policy.declared import experiment

__all__ = ["Experiments"]


@dataclass(frozen=True)
class Experiments:
    """See the module; `gaident.policy.table.rows()` lists these rows among the others."""

    used_share: float = experiment(
        0.9, "1", "of a limit of speed or travel that a command uses, and of the torque to which one is made smaller"
    )
    overshoot_room: float = experiment(0.25, "1", "of the speed limit that is kept for the overshoot J a/kp where a ramp ends")
    ramp_torque: float = experiment(0.6, "1", "of the torque that ramps ask for: friction and the controller need the rest")
    jump_torque: float = experiment(0.8, "1", "of the torque that kp asks for at a jump: the integral needs the rest")
    stroke_samples: float = experiment(20.0, "samples", "of the shortest stroke: a higher speed would leave the travel sooner")
    ramped_stroke: float = experiment(
        0.8, "1", "of the speed sqrt(a s) at which a stroke s is two ramps of slope a: then there is a level between them"
    )
    ramp_hurry: float = experiment(
        150.0, "1", "ramps to the highest speed in the time of the experiment, where inertia and kp are not known"
    )
    ramp_hurry_kp: float = experiment(
        100.0, "1", "the same where kp is known: slower ramps overshoot less, and jumps excite more"
    )
    least_command: int = experiment(400, "samples", "of an experiment at least: its levels, stairs and rests need so many")
    shorter_again: float = experiment(0.85, "1", "of the time before, for which a pattern is made that was too long")
    slower_again: float = experiment(0.9, "1", "of the speed before, where shorter patterns are too long by their ramps alone")
    slower_after: int = experiment(10, "1", "times that a pattern is made for a shorter time before it is made slower")
