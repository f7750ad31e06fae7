"""Effort: budgets that bound the work of a search or a fit, with unit and what each is for. The last group of the policy.

More of these may find more, and changes no decision about what was found. So no command measures a row of its own.
`hope`, `part_reach` and `slow_fall` prune: what they leave out is never fitted to the end, and may be what would have been found.
Searches and fits that need the same effort share a row.
"""

from __future__ import annotations

from dataclasses import dataclass

from gaident.policy.declared import effort

__all__ = ["Effort"]


@dataclass(frozen=True)
class Effort:
    """See the module; `gaident.policy.table.rows()` lists these rows behind those that decide."""

    # How many models are carried on, and how far behind the best.
    beam_width: int = effort(3, "1", "models that are carried on side by side")
    beam_reach: float = effort(4.0, "penalties", "how far behind the best a model is carried on")
    part_reach: float = effort(
        2.0, "1", "times the error power of the best structure on a part of the records, up to which one is fitted to all of them"
    )
    hope: float = effort(0.5, "1", "of what is asked for, that a linearised gain has to promise to be worth a fit")
    slow_fall: float = effort(0.1, "1", "of the cost: a fit that is far behind is left where a step brings less than this")
    screened: int = effort(6, "1", "candidates that each ranking of the score test sends into a short fit")
    finished: int = effort(5, "1", "of these, how many are fitted to the end")
    swaps: int = effort(2, "1", "times that a better rival may take an effect's place")
    rounds: int = effort(3, "1", "times that a search is made again under what the one before has shown: gains, a correlation")
    commands: int = effort(4, "1", "of the menu of experiments, on which rivals are fitted, not only linearised")
    smaller_commands: int = effort(4, "1", "times that a proposed command is made smaller, until it keeps the torque limit")
    quickened: int = effort(60, "1", "times that a proposed command is made shorter, until it fits the time asked for")
    tasks_for_each: int = effort(4, "1", "logs of a fleet that are sent ahead to each process, so that none waits")
    tasks_under_way: int = effort(256, "1", "logs of a fleet that are sent ahead to an executor, whose size nobody knows")
    paired_columns: int = effort(30, "1", "columns of a log at most, whose pairs are tried as position and velocity")

    # Iterations of a fit.
    glance: int = effort(3, "iterations", "of a fit that only ranks candidates")
    short: int = effort(6, "iterations", "of a fit whose neighbourhood is known, or that is one of many")
    whitened_again: int = effort(8, "iterations", "of a fit of a linear structure that is whitened again, to compare structures")
    usual: int = effort(12, "iterations", "of a fit of a model, or of a controller's numbers, that is a step away")
    long: int = effort(20, "iterations", "of a fit from a start that may be far away")
    whole_record: int = effort(30, "iterations", "of a fit to all samples that starts from the fit to a part of them")
    filter_fit: int = effort(40, "iterations", "of a fit of a controller's filters from a point of a grid")
    final: int = effort(60, "iterations", "of the last fit, of the model or of the controller, whose numbers are told")
    led: int = effort(
        3, "runs", "of the loop that leads a model along a motion; what one misses is added to the command of the next"
    )
    led_steps: int = effort(200, "steps", "of that loop in 1/cutoff: its bandwidth is 0.4 * 200/(2 pi) = 13 times the cutoff")
    regressions: int = effort(50, "regressions", "of a discrete model, each filtered by the noise model of the one before")
    noise_draws: int = effort(32, "draws", "of the noise of a measured torque, of which an effect gains by chance")
    level_draws: int = effort(4, "draws", "of that noise, whose level is all that is asked for")
    rival_reach: float = effort(
        0.5, "1", "of an effect's gain in BIC units, by which another in its place is behind at most to be searched globally"
    )
    evolution: int = effort(50, "generations", "of a global search beside stops and impacts")
    deepenings: int = effort(12, "searches", "of that kind near the model that was selected, until they gain no more")
    draws_of_impacts: int = effort(
        3, "searches", "of that kind from the fit of a model with impacts, each time that another one leads"
    )
    draws_in_vain: int = effort(2, "searches", "of these that gain nothing, one after the other, before they end")
    population: int = effort(6, "1", "members of that search for each number that it moves")

    # Starts and points of a grid.
    starts_each: int = effort(2, "1", "best starts of an effect that the score test sends into a short fit; of a resonance all")
    starts: int = effort(3, "1", "best ones of a list (starts, candidates, frequencies, rivals) that are followed up")
    promising: int = effort(2, "1", "frequencies of a resonance that are simulated, for each noise filter")
    lag_peaks: int = effort(4, "1", "peaks of the correlation of two logs, from which their offset is fitted")
    best_points: int = effort(8, "1", "points of the grid of a controller's numbers, from which a fit starts")
    grid: int = effort(8, "1", "values of a filter's time constant or a position gain; blocks of a window, which is moved by one")
    form_starts: int = effort(10, "1", "values of a number of an unlogged controller, of a notch's frequency one more")
    notches: int = effort(14, "1", "values of a notch's frequency")
    tracking_times: int = effort(16, "1", "values of an anti-windup's tracking time")
    limits: int = effort(25, "1", "values of a limit in the given controller, tried on its logged torque")
    limits_not_given: int = effort(40, "1", "values of an integral's limit, or of a command's slope, that was not given")
    resonances: int = effort(48, "1", "frequencies of a resonance, 8 % apart: at most 4 % off, within half the width of a peak")
    clock_rates: int = effort(31, "1", "rates of one log's clock against another's")
    grid_points: int = effort(500, "1", "points of a grid of a controller's numbers, drawn from it where it has more")
    own_values: int = effort(5, "1", "values of a parameter of a user-defined effect")
    own_starts: int = effort(64, "1", "starts of a user-defined effect, as many as built-in effects have at most")
    lengths: int = effort(1 << 14, "1", "tried, with which a force of a linear axis may return, where no pitch is given")
    finer: float = effort(4.0, "1", "lengths that are tried for each that the travel tells apart")
    pitch_parts: int = effort(6, "1", "of a pitch at most, of which the strongest wave of a force may be one")
    draws: int = effort(200, "1", "of the bootstrap of an interval")

    tuned_drives: int = effort(24, "1", "drives drawn from the covariance, for which the gains of a loop are searched")
    checked_drives: int = effort(200, "1", "the same, for which what was found is checked; their figures are told")
    stepped_drives: int = effort(40, "1", "of these, whose answers to a step are simulated")
    tuned_points: int = effort(160, "1", "frequencies of a loop in that search")
    tuned_near: int = effort(31, "1", "of these near each resonance")
    checked_points: int = effort(300, "1", "frequencies of the loop that is checked")
    checked_near: int = effort(81, "1", "of these near each resonance")
    tuning_steps: int = effort(120, "1", "loops that a search of gains tries for each of its starts")
    step_samples: int = effort(1 << 14, "samples", "of a step's answer at most")

    # Samples that are looked at.
    spectrum_samples: int = effort(64, "samples", "of a record at least, in whose error's spectrum peaks are looked for")
    spectrum_mean: int = effort(31, "lines", "of that spectrum, whose running mean is the level that a peak stands above")
    peak_half_width: int = effort(4, "lines", "on either side of a peak of that spectrum, in which no other is looked for")
    searched_samples: int = effort(
        1 << 13, "samples", "of all records in which a model, or a controller's numbers, are searched; a window has half of them"
    )
    from_rest: float = effort(
        0.5, "1", "of the excitation of the best window, from which one that starts at rest is searched in its place"
    )
    searched_share: int = effort(64, "1", "samples of long records, of which a model is searched in one")
    most_samples: int = effort(
        1 << 16, "samples", "in which a model is searched at most, a law of the torque fitted, or what was not found bounded"
    )
    whole_samples: int = effort(
        200_000, "samples", "of records together, of all of which a diagnosis searches a model: 1.5 minutes and 3 GB"
    )
    diagnosed_samples: int = effort(1 << 15, "samples", "of longer records, in windows of which a diagnosis searches a model")
    windows: int = effort(5, "windows", "of long records about, each of which has a start state of its own that is fitted")
    missed_lines: int = effort(1024, "lines", "of a piece, whose errors are compared with those of the windows")
    aligned_samples: int = effort(1 << 15, "samples", "of two logs, by which their offset is looked for at first")
    lag_samples: int = effort(1 << 17, "samples", "of a record, from which the lag of its torque is estimated")
    replayed_samples: int = effort(1 << 18, "samples", "of a record, on which an identification replays the controller")
    tuned_samples: int = effort(30_000, "samples", "of a record, to which noise and walk of a missing torque are fitted")
    enough_samples: int = effort(3500, "samples", "of a search on a coarser grid")
    proposed_samples: int = effort(4000, "samples", "of a proposed record at least, where the diagnosed one is shorter")
    sampled_lines: int = effort(200, "lines", "of a log about, by which delimiter and decimal mark are found")
    sampled_bytes: int = effort(400, "bytes", "of a log, in which letters of 16 bits are looked for")
    head: int = effort(200, "samples", "from whose velocity the start of a model in motion is fitted")
