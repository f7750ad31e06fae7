"""The policy: every number by which gaident decides about a model, with unit, source, and the command that measures it.

A decision is never made by a number that stands elsewhere: `tests/python/project/test_policy.py` looks for such numbers.

Numbers that follow from records without effects are calibrated: `python bench/blind.py --calibrate` writes them into
`calibrated.json`, which is read here. The others are set by hand, for the reason that their row gives.

Seven groups stand in modules of their own: how a log is read (`readings.py`), what a record shows (`records.py`), which linear
model holds and in which band a regression looks (`linear.py`), which controllers are looked for (`controllers.py`), what a
proposed experiment may ask of the axis (`experiments.py`), which gains are proposed (`remedies.py`), what the course of a
parameter over months shows (`fleets.py`).

Effort is the last group (`effort.py`): what bounds the work of a search or a fit, such as iterations, starts, points of a grid,
samples that are looked at. More of it may find more, and changes no decision about what was found.

Other modules keep numbers that decide nothing and bound no search, each with a name in capitals or a comment
`# no decision: why`. Each looks like a number that decides to somebody, and says why it does not in these words or a sentence:

- "a start": a value from which one fit begins, or the ends of a grid of them; how many there are is effort.
  The bounds and starts of an effect's parameters stand in its row of the library.
- "of a solver", "the step of a difference", "rounding": what makes an equation's solution exact.
  A solver ends by its tolerance, and more steps of it change nothing.
- "memory": the size of a block in which something is read or computed. Any other size gives the same result.
- "a grid", orders and lags: the models, or frequencies of a test, among which a criterion chooses.
- "a formula", "a unit", "a format" of files, "what an argument may be", "how many" there are, what is "printed" or "drawn".
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

from gaident.policy.controllers import ControllerRanges
from gaident.policy.declared import (
    AHEAD,
    DRIVES,
    FORMS,
    GAIN,
    LAGS,
    NOISE,
    PERIODS,
    PROFILES,
    REAL,
    RESPONSES,
    SHIFTED,
    SHORT,
    SHORT_MOVES,
    SLOWER,
    UNLOGGED,
    calibrated,
    cause,
    check,
    gain,
    loop,
    noise,
)
from gaident.policy.effort import Effort
from gaident.policy.experiments import Experiments
from gaident.policy.fleets import Courses
from gaident.policy.linear import LinearModels
from gaident.policy.readings import Readings
from gaident.policy.records import Records
from gaident.policy.remedies import RetunedGains

__all__ = ["POLICY", "Decisions", "Policy", "PolicyRow", "rows"]


@dataclass(frozen=True)
class Decisions:
    """The numbers that decide, in the order of the questions that they answer.

    Others have modules of their own: `controllers.py`, `records.py`, `linear.py`, `experiments.py`.
    """

    # Is the gain enough? One criterion: BIC and a penalty for each effect, which stands for the number of candidates tried.
    effect_penalty: float = calibrated(
        GAIN, "effect_penalty", "BIC units", "what each effect costs beside its parameters, for the number of candidates tried"
    )
    short_record: int = gain(
        200, "samples", "length at which that penalty is twice that of a long record: the noise filter is uncertain there", SHORT
    )
    material_share: float = gain(
        0.1, "1", "least part of the error beyond the noise, whitened or before whitening, that an effect explains", DRIVES
    )
    material_beside_impacts: float = gain(0.5, "1", "the same beside a gap or hard coupling: no model foresees an impact", DRIVES)
    overrules: float = gain(0.5, "1", "most that a cause which whitening hid leaves of the squared error before whitening", REAL)
    rival_margin: float = gain(
        10.0, "BIC units", "explanations closer than odds of e^5 are not told apart (Kass and Raftery 1995)", DRIVES
    )
    rival_short: int = gain(400, "samples", "length at which that margin is twice that of a long record", SHORT)
    detail_level: float = gain(
        0.005, "probability", "level of the likelihood-ratio test of an effect against a simpler one in it (Wilks 1938)", DRIVES
    )
    simulation_exact: float = gain(
        2e-4,
        "1",
        "of what all effects change in the velocity: a generalisation or a spring that changes less is not seen through the "
        "simulation's own error, which is 0.02 to 0.65 % of it (docs/effects.md)",
        DRIVES,
    )
    swap: float = gain(2.0, "BIC units", "by which a rival has to be better to take an effect's place", DRIVES)
    most_effects: int = gain(4, "1", "effects in one model at most", DRIVES)
    harm: float = gain(0.02, "1", "part of the held-out error that an effect may add before it is refused", REAL)
    fitted_share: float = gain(0.7, "1", "part of a record to which parameters are fitted where the rest is held out", REAL)
    least_fitted: float = gain(0.25, "1", "the same at least where the path is cut; else nothing is held out", REAL)
    least_held_out: int = gain(600, "samples", "length of a record from which a part of it is held out", REAL)
    interval_level: float = gain(
        0.05, "probability", "outside the interval of a fall of the error: below 0 as a whole, it is harm", REAL
    )
    block_memory: float = gain(
        2.5, "1", "length of the blocks of a bootstrap, in correlation times of the error; shorter ones hide how slow it is", REAL
    )
    least_blocks: int = gain(8, "1", "blocks that a bootstrap has at least: fewer tell no interval", REAL)
    held_out_motion: float = gain(0.33, "1", "rms speed of the held-out end over that before: below, the path is cut", REAL)
    told_apart: float = gain(
        25.0, "chi2", "from which a proposed experiment tells two explanations apart: 5 standard deviations of one number", DRIVES
    )

    # Is this noise? One variance ratio, one specification test, one test for dependence.
    noise_ratio: float = calibrated(
        NOISE, "noise_ratio", "1", "rms of whitened errors over the noise of the velocity: above, the model is not adequate"
    )
    free_run_ratio: float = calibrated(
        NOISE, "free_run_ratio", "1", "rms of the free run over that noise: above, whitening took a misfit for noise"
    )
    noise_level: float = noise(
        1e-6,
        "probability",
        "share of records without effects that one test may mistake, whether its bound is that of chi-square or the measured "
        "tail of a calibrated number: to the user the mistake is the same",
        DRIVES,
    )
    dependence_gain: float = calibrated(
        NOISE, "dependence_gain", "BIC units", "of a free function of one signal: above, the errors depend on that signal"
    )
    driver_share: float = noise(
        0.005, "1", "of the squared error before whitening, that a function of a signal takes away at least, to be told", DRIVES
    )
    effort_ratio: float = noise(1.1, "1", "rms of whitened errors over the noise: below, no further effect is looked for", DRIVES)
    immaterial: float = noise(0.02, "1", "part of the linear mechanism's rms error that always counts as noise", DRIVES)
    grid_loss: float = noise(
        0.02, "1", "part of the linear model's squared error beyond the noise that lies between the lines of a coarser grid", REAL
    )
    spectrum_lines: int = noise(8, "1", "frequencies whose mean is a spectrum at 0, which is uncertain by 1/sqrt(8)", REAL)
    samples_per_lag: int = noise(
        10, "samples", "for each lag at which rho^2 is taken; at more lags it is mostly its own error", REAL
    )
    swings: float = noise(0.5, "1", "sum of rho^2 of errors, from which they swing where it is above the sum of rho", REAL)

    direction_samples: int = noise(
        8,
        "samples",
        "of a record, for each direction that is taken out of its error before the score test fits a noise filter",
        DRIVES,
    )

    # The free functions of each driver in the test for dependence: how fine they are decides which driver explains most.
    function_samples: int = noise(16, "samples", "of a record, for each function of a driver's family", SHORT)
    least_functions: int = noise(4, "1", "functions of a driver's family at least, for which any record has room", SHORT)
    function_knots: int = noise(8, "1", "knots of a free function of torque or command, at quantiles", DRIVES)
    angle_knots: int = noise(6, "1", "the same of the angle, beside which harmonics of a turn stand", DRIVES)
    time_knots: int = noise(7, "1", "the same of time, for dry friction that changes in the course of a record", DRIVES)
    slow_knot: float = noise(
        0.01,
        "1",
        "of the highest speed, the first knot of a function of the velocity; the others are multiples: 4, 12, 30, 60",
        DRIVES,
    )
    path_widths: int = noise(6, "1", "widths at which elements that depend on the past path yield", DRIVES)
    least_width: float = noise(3e-4, "1", "of the travel, the least of these widths: presliding and the play of a drive", DRIVES)
    most_width: float = noise(0.3, "1", "the same, the greatest: a wider one yields in few strokes", DRIVES)
    coherence_level: float = noise(
        0.05, "probability", "with which a coherence is reached by chance: points below that coherence are not shown", RESPONSES
    )

    # Is a finding a cause, or does it only describe what the library does not contain?
    of_its_size: float = cause(0.25, "1", "part of a finding's gain that a free function beside it may still find", DRIVES)
    stands: float = cause(
        0.9,
        "1",
        "least part that a cause explains of what a free function does; drag by friction 0.87, a joint's friction 0.946",
        DRIVES,
    )
    class_stands: float = cause(
        0.5, "1", "the same for effects that no record tells apart, of which each alone explains less", SHORT_MOVES
    )
    jump_deviations: float = cause(
        4.0,
        "1",
        "standard deviations of the torque's jump at reversals, or a steep drag, from which it counts; 237 records without: 3.4",
        REAL,
    )
    of_its_level: float = cause(
        0.5,
        "1",
        "part of a friction's level that jump or held torque has at least, and of a steep drag fast motion has",
        REAL,
    )
    steep_above: float = cause(
        0.3,
        "1",
        "of the largest speed, above which a drag is as steep as of all speeds; friction that dips near rest is not",
        REAL,
    )

    # Does a second method agree? The inverse-dynamics regression beside the result.
    check_deviations: float = check(
        3.0, "1", "standard deviations of the two values together: 0.3 % of a normal distribution are beyond", DRIVES
    )
    check_share: float = check(0.1, "1", "part of the larger value: a smaller difference does not matter", DRIVES)
    check_torque: float = check(
        0.05,
        "1",
        "of the torque's rms: a smaller difference of friction, gravity, spring at half the travel or force error is immaterial",
        REAL,
    )
    opened: float = check(
        5.0, "1", "times the inertia's deviation with gravity left open: above, a note says on what the inertia rests", REAL
    )
    not_there: float = check(
        2.0, "1", "standard deviations: an effect not found is at most so many above its estimate, one found more than 0", REAL
    )
    velocity_part: float = check(
        0.95,
        "1",
        "of the error's power is the velocity's, the rest the torque's, when parameters are estimated from output errors",
        REAL,
    )
    heavier: float = check(
        2.0, "1", "standard deviations above the regressed inertia, from which an axis counts as heavier: 98 % one-sided", REAL
    )
    rigid_band: float = check(
        0.25, "1", "of the antiresonance: below it a load moves as if the shaft were rigid, within 1/(1 - 1/16), 7 %", DRIVES
    )
    rigid_left: float = check(
        0.05, "1", "most that the regression of a rigid axis leaves of the squared torque; then its band shows no shaft", REAL
    )
    loses: float = check(2.0, "1", "force error of the diagnosed model over that of the regression: above, a note says so", REAL)

    # Does the logged torque follow from command and velocity through the controller?
    replay_steps: float = loop(3.0, "steps", "of the torque's rounding, by which a torque that follows is off at most")
    replay_rms: float = loop(2.0, "steps", "the same for the rms")
    sum_of_roundings: float = loop(3.0, "1", "standard deviations of a sum of roundings, which it exceeds by chance alone")
    replay_left: float = loop(
        1e-3, "1", "most that an effect leaves of the replay's squared error, and of the torque's, where it explains it"
    )
    replay_noise: float = loop(0.1, "1", "part of the torque's standard deviation: more is no noise of a measured torque")
    rare_errors: float = loop(
        0.5, "1", "of the squares, in the largest hundredth of samples: more is no noise; normal noise has 0.09"
    )
    same_gains: float = loop(1e-2, "1", "relative difference of the gains of several logs, up to which they are the same")
    gain_doubt: float = loop(
        0.2, "1", "of a given gain, by which it may be off where no torque is logged that would show it", DRIVES
    )
    same_value: float = loop(2e-3, "1", "relative difference up to which two limits are one, or a gain is the configured one")
    at_limit: float = loop(0.999, "1", "of a limit, from which a torque or an integral is at it")
    plateau: int = loop(5, "samples", "at a limit, from which a torque or an integral is held there")
    noisy_plateau: float = loop(0.95, "1", "of the highest torque: the median of what is above is the limit of a noisy log")
    same_slope: float = loop(0.2, "1", "relative difference from a command's median slope, within which its rate is limited")
    better_reason: float = loop(0.99, "1", "of the rms that a simpler reason leaves: a more complicated one has to leave less")
    rounded_command: float = loop(5e-5, "1", "of the largest command: two commands of a log of few decimals differ by no more")
    log_late: int = loop(3, "samples", "by which a log writes a channel late or early, at most; farther off is another log", LAGS)
    log_shift: float = loop(
        50.0,
        "BIC units",
        "by which the controller's law holds better before a channel is moved by samples: odds of e^25",
        SHIFTED,
    )
    lag_seen: float = loop(0.5, "samples", "of the torque behind the motion, from which a lag is seen", SHIFTED)
    ramp: float = loop(
        2.0,
        "1",
        "times the change to the line before or after: a command that changes more between two lines jumps there",
        SLOWER,
    )
    jumped_early: float = loop(
        0.75,
        "samples",
        "by which a jump between two lines comes before the later one at least; half a one is other things",
        SLOWER,
    )
    jump_misread: float = loop(
        0.05, "1", "of the jumps on the lines, which look as if they came early: 11 of 335 in a log of a fast resonance", SLOWER
    )
    jumps_usual: float = loop(
        0.05, "1", "probability of as many jumps that look early as there are, below which they are no misread ones", SLOWER
    )
    told_time: float = loop(
        0.25, "samples", "deviation of a jump's time that the torque alone tells; else the velocity has to", SLOWER
    )
    same_clock: float = loop(
        0.5, "1", "of the least error from line to line: two sample times whose errors differ by less are not told apart", PERIODS
    )
    near_age: float = loop(
        0.25,
        "samples",
        "of a controller: largest difference between lag and T/2 at which the velocity counts as differenced",
        PERIODS,
    )
    corner_square: float = loop(
        0.1,
        "1",
        "of its curvature, by which a change of a position command may miss a square: a corner to 0.06, a cubic 0.42",
        PROFILES,
    )
    corner_seen: float = loop(20.0, "1", "times the other third differences of it: less is no corner of its slope", PROFILES)
    interpolation: float = loop(
        4.0, "1", "times what another interpolation of the velocity changes in the torque of a slow log: less is not seen", SLOWER
    )
    each_number: float = loop(
        0.8,
        "1",
        "each further number must reduce the rms of a slow log to this share; its errors are no noise, as a BIC supposes",
        SLOWER,
    )
    ahead_seen: float = loop(
        0.125,
        "lines",
        "of a torque that drives a model ahead of its line, from which it is seen: half of what two samples make",
        AHEAD,
    )
    ahead_exact: float = loop(
        0.02, "lines", "to which the regression knows by how much a torque is ahead; else the model that is found shows it", AHEAD
    )
    peak_lines: int = loop(
        3, "lines", "of a log slower than its controller, that the largest torques last at least to show a limit of them", AHEAD
    )
    slowest_lag: float = loop(
        100.0, "samples", "time constant at most of a lag behind the controller's torque; a current loop is faster", LAGS
    )
    fastest_lag: float = loop(0.05, "samples", "time constant at least of that lag: no log tells a shorter one from none", LAGS)
    lag_said: float = loop(0.75, "samples", "from which a lag of an open loop's log is said; a sampled torque's is 0.5", SHIFTED)
    lag_whole: float = loop(0.25, "samples", "from whole samples, of a motion before its torque: then the log is wrong", SHIFTED)
    observer_share: float = loop(0.3, "1", "of the controller that holds a model with a gap near its record", DRIVES)
    kept_correlation: float = loop(0.5, "1", "of the correlations of a controller's numbers from a slow log", SLOWER)
    slope_reach: float = loop(
        0.3,
        "1",
        "of a filter's number, by which a form may move it along its slope; beyond, the filter is fitted by itself",
        FORMS,
    )
    quiet_torque: float = loop(0.5, "1", "of the largest torque: below, no limit acts, whatever it limits", FORMS)
    filter_memory: int = loop(
        200,
        "samples",
        "after which no filter remembers a limit; a quarter of it where few are left, and at a start in motion",
        FORMS,
    )
    form_choice: float = loop(2.0 * math.log(3.0), "BIC units", "of a setting chosen of three that has no number: 2 ln 3", FORMS)
    near_rounding: float = loop(
        1.1, "1", "of what rounding makes of a replay: filters that leave no more need no other filter beside them", FORMS
    )
    notch_highest: float = loop(
        0.95, "1", "of half the sampling frequency: at a higher one a notch of an unlogged controller is not looked for", UNLOGGED
    )
    form_fastest: float = loop(
        0.1, "samples", "of the log: a shorter time constant of an unlogged controller's filter shows in none", UNLOGGED
    )
    form_weight: float = loop(1.0, "1", "highest command weight of an unlogged controller: 0 is an IP, 1 a PI one", UNLOGGED)
    form_slowest: float = loop(
        0.1,
        "1",
        "of a record's duration: a longer time constant, or period of a notch, of an unlogged controller shows too rarely",
        UNLOGGED,
    )
    notch_least_damping: float = loop(0.05, "1", "of the denominator of a drive's notch, where no torque is logged", UNLOGGED)
    notch_most_damping: float = loop(2.0, "1", "the same at most: beyond, a notch is two low passes far apart", UNLOGGED)
    negligible: float = loop(1e-3, "1", "of a signal's largest value or range: less is 0, or the rounding of a log")


@dataclass(frozen=True)
class Policy(Effort, RetunedGains, Courses, Experiments, LinearModels, Records, Readings, ControllerRanges, Decisions):
    """The whole table: first what decides, then effort. `rows()` lists all with unit, source and command."""


class PolicyRow(NamedTuple):
    """One number of the policy."""

    name: str
    value: float
    unit: str
    source: str
    cases: str
    command: str
    group: str


def rows() -> tuple[PolicyRow, ...]:
    """The whole table. What decides is measured by a command: its calibration, or else `python bench/policy.py` and its name."""
    found = []
    for f in fields(Policy):
        told = f.metadata
        command = told["command"] or (f"python bench/policy.py {f.name}" if told["cases"] else "")
        found.append(PolicyRow(f.name, f.default, told["unit"], told["source"], told["cases"], command, told["group"]))  # type: ignore[arg-type]
    return tuple(found)


POLICY = Policy()
"""The one policy of all diagnoses."""
