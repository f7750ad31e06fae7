"""Which linear model holds: what identify() and inverse_dynamics() decide for themselves, with unit, source and command.

A diagnosis starts from the model that they find. The band is that of every regression, and of the force error.
"""

from __future__ import annotations

from dataclasses import dataclass

from gaident.policy.declared import DRIVES, PITCHES, REGRESSION, SHIFTED, SUCCESS, WINDING, linear

__all__ = ["LinearModels"]


@dataclass(frozen=True)
class LinearModels:
    """See the module; `gaident.policy.table.rows()` lists these rows among the others."""

    test_level: float = linear(
        1e-4, "probability", "of the tests that a linear model holds, that a replay leaves white noise", SUCCESS
    )
    input_lag: int = linear(
        32,
        "samples",
        "highest lag of the input that a residual is tested on: 0, 1, and from there on each twice the last",
        SUCCESS,
    )
    samples_per_input_lag: int = linear(
        4, "samples", "of the shortest record, for each sample of such a lag: a longer lag has too few of them", SUCCESS
    )
    white_lags: int = linear(
        20,
        "samples",
        "lags at most of a test that a residual is white; its power is spread over them (Ljung and Box 1978)",
        SUCCESS,
    )
    samples_per_white_lag: int = linear(5, "samples", "of all records, for each of these lags", SUCCESS)
    no_direction: float = linear(
        0.01,
        "1",
        "of the largest simulated velocity: below, its sign is 0 where a residual is tested on it, as rounding would give it one",
        SUCCESS,
    )
    undecided_ratio: float = linear(
        2.0, "1", "rms of a residual over the noise: above, what is not white may hide a misfit", SUCCESS
    )
    cancellation: float = linear(0.02, "1", "of a zero's magnitude: a pole so close cancels it", SUCCESS)
    contradiction: float = linear(
        3.0, "1", "standard deviations by which numbers of a mechanism contradict each other, or a lag is not 0", SUCCESS
    )
    material_column: float = linear(
        0.05, "1", "of the squared torque, that a spring or friction by direction explains", REGRESSION
    )
    lag_left: float = linear(
        0.05,
        "1",
        "most of the torque's variance, or squared velocity, that the regression behind a lag leaves: more tells none",
        SHIFTED,
    )
    lag_std: float = linear(
        0.2, "samples", "standard deviation of a lag that the motion shows, at most; above, it shows none", SHIFTED
    )
    winding_sure: float = linear(5.0, "1", "standard deviations from 0, from which a resistance or inductance is shown", WINDING)
    voltage_alike: float = linear(
        0.05,
        "1",
        "of the voltage that a winding leaves: below, a held voltage is not told from one that goes on between lines",
        WINDING,
    )
    least_rows: int = linear(20, "1", "rows of a regression at least, half of them each way for dry friction", REGRESSION)
    standing_noise: float = linear(
        3.0, "1", "standard deviations of the velocity's noise, below which an axis stands still in a regression", REGRESSION
    )
    standing_share: float = linear(0.005, "1", "of the velocity's rms, below which it stands still there", REGRESSION)
    both_ways: float = linear(0.02, "1", "of the rows in either direction at least, to tell dry friction from a load", REGRESSION)
    round_deviations: float = linear(
        2.0, "1", "standard deviations of a pitch: of the lengths within them the one with the fewest digits is taken", PITCHES
    )
    spring_turns: float = linear(10.0, "turns", "of travel: beyond, no spring is fixed to the ground", REGRESSION)
    another_mass: float = linear(
        2.0,
        "1",
        "factor by which a further mass reduces the whitened error sum at least, where no linear structure holds",
        DRIVES,
    )
    below_zero: float = linear(
        2.0, "1", "standard deviations below 0, from which a mass or damping is said to be negative; nearer has no sign", SUCCESS
    )
    at_bound: float = linear(
        0.999,
        "1",
        "of the highest damping of a resonance: a fit that comes so near ends at its bound, and is no resonance",
        DRIVES,
    )

    # The band of a regression and of the force error.
    acceleration_noise: float = linear(
        1e-3, "1", "most of the acceleration's power that may be noise: so much is the inertia too small by it", REGRESSION
    )
    highest_band: float = linear(
        0.1,
        "1",
        "of the sample rate, the highest cutoff: up to a third of it a difference is exact to 2 %; 100 Hz at 1 kHz is usual",
        REGRESSION,
    )
    lowest_band: float = linear(0.005, "1", "the same, the lowest, whatever the noise: below, little motion is left", REGRESSION)
    lags_per_root: float = linear(
        1.3,
        "1",
        "lags of the errors that deviations of a regression or a fit know, over the root of the rows (Lazarus et al. 2018)",
        REGRESSION,
    )
    noise_from: float = linear(
        0.35, "1", "of the sample rate, above which the sensor's noise is read: motion is slower", REGRESSION
    )
    noise_to: float = linear(
        0.475, "1", "the same, below which it is read: the last lines contain a log's own filter", REGRESSION
    )
    swing_band: float = linear(
        0.5,
        "1",
        "of the lowest antiresonance, the highest cutoff of a force error: beyond, the inversion follows a swing",
        DRIVES,
    )
    inversion_gain: float = linear(
        0.4, "1", "of the gain that leads an integrator in one step to its command: the stiff loop of a force error", DRIVES
    )
    inversion_integral: float = linear(
        0.02, "1", "of that gain, a step: what friction and gravity leave is gone within the filter's time", DRIVES
    )
    force_edge: float = linear(
        2.0,
        "1",
        "times 1/cutoff at both ends of a record that a force error leaves out: filters and stiff loop start there",
        DRIVES,
    )
