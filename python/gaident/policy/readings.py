"""How a log is read: what a file does not say is refused or asked, and these numbers say where it is clear."""

from __future__ import annotations

from dataclasses import dataclass

from gaident.policy.declared import HEADERS, SAMPLED, reading

__all__ = ["Readings"]


@dataclass(frozen=True)
class Readings:
    """See the module; `gaident.policy.table.rows()` lists these rows among the others."""

    clock_jitter: float = reading(0.01, "1", "of a sample time, by which a step, or the given dt, may differ")
    coarse_stamps: float = reading(0.25, "1", "of a sample time: stamps printed more coarsely hide a lost sample")
    few_unequal: float = reading(0.1, "1", "of the steps: so few unequal ones are real; more come from printed stamps")
    even_rise: float = reading(0.02, "1", "of a step, by which the steps of a column differ that is a time")
    pause: float = reading(5.0, "1", "of the usual step: a longer one is a pause, through which no line is drawn")
    resample_coarser: float = reading(1.5, "1", "of a log's step: a coarser grid would alias what is fast")
    resample_finer: float = reading(100.0, "1", "of a log's step over the given one: finer, the given step is in another unit")
    unit_shown: float = reading(0.02, "1", "relative difference up to which a slope shows a unit, a jump an integer's range")
    derivative: float = reading(0.98, "1", "correlation of a column with the slope of another, from which it is its derivative")
    other_scale: float = reading(
        0.05, "1", "share by which a velocity is off the slope of its position, from which the two have different units"
    )
    derivative_samples: int = reading(
        20, "samples", "that a column has more than, to be looked at for it: few samples follow each other by chance"
    )
    wrap_jump: float = reading(0.75, "1", "of a position's range: a jump as long may be a counter that wraps")
    wrap_beside: float = reading(0.25, "1", "of that jump: the steps beside it are shorter")
    wrap_alike: float = reading(0.05, "1", "of that jump, by which the steps before and behind it differ at most")
    wrap_steady: float = reading(0.5, "1", "least ratio of the steps before and after a wrap, the shorter one to the longer one")
    wrap_reach: int = reading(8, "samples", "on either side of a jump, in which a slow motion shows its direction")
    wrap_spared: float = reading(0.999, "1", "of the steps are no jumps then; the rest may be lost samples")
    overlap: float = reading(0.3, "1", "of the shorter of two logs, that both have at least")
    aligned: float = reading(0.5, "1", "correlation of two logs of one motion at least")
    longest_hold: float = reading(
        4e-3, "s", "sample time of a controller at most: a torque measured less often is no held one", SAMPLED
    )
    rate_seen: float = reading(3.0, "1", "standard deviations from 0, from which two clocks run at different rates")

    words_needed: int = reading(
        2, "points", "that have to speak for a column by its name and unit, to take it for a channel", HEADERS
    )
    name_points: int = reading(4, "points", "of a word that names the channel's quantity (velocity, torque, position)", HEADERS)
    related_points: int = reading(
        3, "points", "of a word for what comes with it (a current with a torque, an encoder with a position)", HEADERS
    )
    unit_points: int = reading(3, "points", "of a unit that is one of the channel's quantity", HEADERS)
    command_points: int = reading(3, "points", "of a word for a command, as much as of a unit: a command is called so", HEADERS)
    letter_points: int = reading(
        2, "points", "of a letter or two (n, M, i, qm); behind a path's other words it says nothing", HEADERS
    )
    least_letters: int = reading(
        3, "letters", "of a known word that is looked for inside a longer one: shorter ones are in any", HEADERS
    )
    whole_rows: float = reading(0.9, "1", "of the lines made of digits: so many may have commas of both meanings", HEADERS)
    odd_rows: float = reading(0.1, "1", "of these, of another width: so many, and the user is asked what the commas are", HEADERS)
    wide_letters: float = reading(0.8, "1", "of every second byte that is 0: a text of 16 bits a letter (UTF-16)", HEADERS)
