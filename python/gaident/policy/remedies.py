"""Which gains are proposed: margins that nobody gave, what makes a filter pay, and what is reported; with unit and source."""

from __future__ import annotations

from dataclasses import dataclass

from gaident.policy.declared import remedy

__all__ = ["RetunedGains"]


@dataclass(frozen=True)
class RetunedGains:
    """See the module; `gaident.policy.table.rows()` lists these rows among the others."""

    phase_margin: float = remedy(45.0, "deg", "of a proposed loop at least, where nobody asks for another: usual for servo axes")
    gain_margin: float = remedy(8.0, "dB", "the same: a factor of 2.5, by which an inertia or a torque constant may be wrong")
    robust_share: float = remedy(0.95, "1", "of the drives drawn from the covariance, in which the margins hold")
    margin_room: float = remedy(
        1.01, "1", "times the margins asked for, that the search keeps: a covariance is one to first order"
    )
    most_sensitivity: float = remedy(
        2.0, "1", "largest sensitivity of a proposed loop (Astrom and Hagglund: 1.4 to 2), or what the margins asked for imply"
    )
    raised: float = remedy(
        3.0, "1", "times the given gains, that a page proposes at most: one step, behind which the drive is recorded again"
    )
    filter_pays: float = remedy(1.1, "1", "times the stiffness of the loop without it, from which on a filter is proposed")
    position_overshoot: float = remedy(4.0, "%", "of a step of the position loop at most, without feedforward")
    swings_on: float = remedy(
        0.05, "1", "of the step of the command, by which the velocity still swings at rest: a limit cycle that is reported"
    )
    near_limit: float = remedy(
        0.9, "1", "of the largest torque asked for, from which a step that comes near it is said to hold the gains low"
    )
    dies_out: float = remedy(
        0.9,
        "1",
        "of the swing in the first half of a rest: where less is left in the second half, it dies out and is no limit cycle",
    )
    winds_up: float = remedy(
        0.1, "1", "of the step of the command, by which the velocity goes beyond it behind a limit: a held integral is tried"
    )
    sticks: float = remedy(0.1, "1", "of the time at a slow command, in which the axis stands: stick-slip that is reported")
    slow_command: float = remedy(0.02, "1", "of the step of the command, the slow speed at which stick-slip is looked for")
