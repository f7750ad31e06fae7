"""What a record shows: what is spoiled in it, and what it could not have shown, with unit, source and command."""

from __future__ import annotations

from dataclasses import dataclass

from gaident.policy.declared import (
    DRIVES,
    ENCODER,
    INSTRUMENTS,
    LOOP,
    REAL,
    REGRESSION,
    SAMPLED,
    SHORT,
    SLOWER,
    SUCCESS,
    WINDING,
    record,
)

__all__ = ["Records"]


@dataclass(frozen=True)
class Records:
    """See the module; `gaident.policy.table.rows()` lists these rows among the others."""

    least_samples: int = record(
        100, "samples", "length of a record at least: below, noise filter and linear model use up what it knows", SHORT
    )
    diverged: float = record(
        1e3, "1", "of the measured rms or largest value: a simulation that is further off has diverged and is no figure", DRIVES
    )
    one_course: float = record(0.9, "1", "correlation of command and velocity, from which one follows the other", SUCCESS)
    same_unit: float = record(3.0, "1", "factor between the two then, up to which they have the same unit", SUCCESS)
    near_rpm: float = record(1.25, "1", "factor within which their ratio is that of rpm to rad/s: one of them is in rpm", SUCCESS)
    repeats: float = record(0.9, "1", "share of differences that are not 0: below, a velocity is quantised", DRIVES)
    rest_steps: float = record(1.5, "steps", "of that quantisation: a first velocity above is no rest", DRIVES)
    rest_emf: float = record(0.01, "1", "of the largest voltage: a motor whose first back-EMF is less starts at rest", WINDING)
    rest_share: float = record(0.6, "1", "of the first command: a first velocity up to it is the response from rest", SUCCESS)
    held_share: float = record(0.6, "1", "of the median speed under one input: above, the first velocity is no response", SUCCESS)
    outlier_far: float = record(9.0, "1", "standard deviations from its neighbours, from which a sample may be an outlier", LOOP)
    outlier_missed: float = record(0.4, "1", "of that distance, by which the lines from either side, and a model, miss it", LOOP)
    outlier_alone: float = record(0.5, "1", "of that distance: where two samples near by are as far off, the axis rings", LOOP)
    sensor_step: float = record(1e-4, "1", "of the velocity's range: a finer quantisation is that of a text log", DRIVES)
    on_lattice: float = record(0.1, "steps", "from the places of a lattice, within which all values lie on it", DRIVES)
    whole_lines: float = record(0.01, "1", "lines of a turn, within which an encoder's number of lines is whole", DRIVES)
    fewest_lines: int = record(100, "1", "lines of a turn that an encoder of a drive has at least", ENCODER)
    binary_lines: float = record(1e-4, "1", "share of a power of two, within which an encoder's lines are that", ENCODER)
    outlier_reach: int = record(8, "samples", "on either side that an outlier stands out of: so far a filter rings", LOOP)
    lattice_values: int = record(4, "1", "distinct values at least, by which a lattice is told from chance", ENCODER)
    usual_slope: float = record(0.95, "1", "quantile of a record's slopes that stands for its usual motion", REAL)
    folded_steep: float = record(0.15, "1", "of the 95 % quantile of slopes: a turning point with less is a rest", REAL)
    folded_smoother: float = record(
        0.8, "1", "of the curvature at a turning point: below, the signal is smoother with its sign turned there", REAL
    )
    folded_points: int = record(3, "1", "such points, from which a speed has lost its sign; one or two may be chance", REAL)
    above_noise: float = record(6.0, "1", "standard deviations of a signal's noise, beyond which it is not 0", DRIVES)
    smoothed_samples: int = record(5, "samples", "of the mean behind which a velocity is above its noise, at least", DRIVES)
    smoothed_parts: int = record(400, "1", "the same: of a long record one part in so many", DRIVES)
    still: float = record(0.02, "1", "of a signal's largest value or range: within, it holds a value, or is 0", DRIVES)
    apart: float = record(0.05, "1", "of the highest speed, by which two speeds or jumps differ", DRIVES)
    slow: float = record(0.1, "1", "of the highest speed or torque: below, it is a slow or a small one", DRIVES)
    held_samples: int = record(20, "samples", "for which a speed is held at least", DRIVES)
    ramp_straight: float = record(
        0.1, "1", "of the bend between two ramps of a slow log's command, by which either may miss a straight line", SLOWER
    )
    corner_unsure: float = record(
        0.25,
        "1",
        "of how much a slow log's command bends otherwise: deviation of its mean between two lines; a corner makes 1/8",
        SLOWER,
    )
    no_ramp: float = record(0.35, "1", "of the band of a held speed, by which its halves differ at most; on a ramp 0.5", DRIVES)
    seen_turn: float = record(0.75, "1", "of a period, that a record turns at least to show what returns once in it", DRIVES)
    seen_periods: float = record(2.0, "periods", "in the travel, of what returns more often; less is any curve", DRIVES)
    seen_path: float = record(3.0, "periods", "that a record travels at least, there and back, to show an order", DRIVES)
    seen_band: float = record(0.8, "1", "of half the sampling frequency: what is faster does not show", DRIVES)
    seen_measured: float = record(
        0.35,
        "1",
        "the same of a shaft under a measured torque: 1 - sinc(f dt)^2, what is unknown between its samples, is 10 %",
        SAMPLED,
    )
    gravity_turn: float = record(1 / 6, "turns", "of travel: below, a torque once per turn is a constant or a spring", REGRESSION)
    inertia_share: float = record(
        1e-3,
        "1",
        "least change of an inertia with its angle that is a cause: other waves are simulated no more exactly (docs/effects.md)",
        DRIVES,
    )
    swing_damping: float = record(0.5, "1", "damping ratio below which two masses swing as on a shaft", DRIVES)
    driven_damping: float = record(
        0.1,
        "1",
        "damping ratio by which an antiresonance may be damped more than resonance and motor, as that of no shaft is",
        DRIVES,
    )

    # The instrument of a frequency response: the command, or in open loop the torque.
    repeats_within: float = record(1e-4, "1", "of a command's rms: what differs between periods of it at most", INSTRUMENTS)
    instrument_line: float = record(
        1e-3, "1", "of the largest line of a command: a smaller one is none of a multisine", INSTRUMENTS
    )
    instrument_empty: float = record(1e-6, "1", "the same, below which a line is rounding and excites nothing", INSTRUMENTS)
    instrument_apart: float = record(
        0.1, "1", "of its power in a window, that is left beside what the start and the end of a record make", INSTRUMENTS
    )
    instrument_covered: float = record(
        2.0, "1", "times what polynomials miss in a window shows in its errors: so much it may change the estimate", INSTRUMENTS
    )
    instrument_strong: float = record(
        30.0,
        "1",
        "times its variance, that neighbouring windows have the torque's answer squared; weaker shows noise",
        INSTRUMENTS,
    )
    instrument_alone: float = record(10.0, "1", "the same of a window alone (Staiger and Stock 1997)", INSTRUMENTS)
    noise_alone: float = record(
        2.5, "1", "times the noise of neighbouring windows: above, the noise of a window is its own", INSTRUMENTS
    )
