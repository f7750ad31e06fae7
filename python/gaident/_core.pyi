"""The core of gaident: recurrences, genetic search and local fit (csrc/bindings); SI units."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

_Real = NDArray[np.float64]
_Complex = NDArray[np.complex128]

class SearchRanges:
    """Where gain, roots and structural numbers are looked for: pairs (lowest, highest); roots in rad/s."""

    def __init__(
        self,
        gain: tuple[float, float],
        real: tuple[float, float],
        imaginary: tuple[float, float],
        p: tuple[int, int],
        q: tuple[int, int],
        bits: int,
        gain_scale: float = 1.0,
    ) -> None: ...

class EngineSettings:
    """Settings of the genetic engine; raises ValueError where one is out of its range."""

    def __init__(
        self,
        population: int,
        tournament: int,
        crossover: float,
        mutation: float,
        generations: int,
        elites: int,
        gray: bool,
        logarithmic: bool,
        error_weight: float,
        order_weight: float,
        species: bool,
        round: int,
        quiet_rounds: int,
        in_float: bool,
        mirror: str = "",
    ) -> None: ...

class Refined:
    """A local fit: model, start states of the records that move, plain or whitened error sum `cost`."""

    @property
    def gain(self) -> float: ...
    @property
    def poles(self) -> NDArray[np.complex128]: ...
    @property
    def zeros(self) -> NDArray[np.complex128]: ...
    @property
    def p(self) -> int: ...
    @property
    def q(self) -> int: ...
    @property
    def starts(self) -> NDArray[np.float64]: ...
    @property
    def cost(self) -> float: ...
    @property
    def iterations(self) -> int: ...
    @property
    def converged(self) -> bool: ...
    @property
    def at_bound(self) -> list[bool]: ...

class Trial:
    """One genetic run: best fitness per generation, the best chromosome's words, each species' local fit."""

    @property
    def history(self) -> NDArray[np.float64]: ...
    @property
    def best_fitness(self) -> float: ...
    @property
    def best_generation(self) -> int: ...
    @property
    def best(self) -> list[int]: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def overflows(self) -> int: ...
    @property
    def species(self) -> list[Refined]: ...

class Clock:
    """When the controller acts: period, its sample time [s], and how many of these one line of the log stands for."""

    def __init__(self, *, period: float, log_every: int = 1) -> None: ...

class Controller:
    """The PI velocity controller: kp [N m s/rad], ki [N m/rad], limits of |u| and of |I| [N m]."""

    def __init__(self, *, kp: float, ki: float, torque_limit: float = ..., integrator_limit: float = ...) -> None: ...

class DigitalFilter:
    """y(n) = b0 u(n) + b1 u(n-1) + b2 u(n-2) - a1 y(n-1) - a2 y(n-2)."""

    @property
    def b(self) -> list[float]: ...
    @property
    def a(self) -> list[float]: ...

def low_pass(time_constant: float, period: float) -> DigitalFilter:
    """Low pass of first order, exact for a held input; times [s]."""

def notch(*, frequency: float, numerator_damping: float, denominator_damping: float, period: float) -> DigitalFilter:
    """Notch at a frequency [Hz], bilinear with the frequency kept in its place; period [s]."""

class ServoSettings:
    """What a servo's controller has beyond a bare PI; times [s], position_gain [1/s], 0 without a position loop."""

    def __init__(
        self,
        *,
        newest: float,
        command_weight: float,
        anti_windup: str,
        tracking_time: float,
        command_filters: Sequence[DigitalFilter],
        velocity_filters: Sequence[DigitalFilter],
        torque_filters: Sequence[DigitalFilter],
        position_gain: float,
        position_every: int,
        delay: float = 0.0,
    ) -> None: ...

def servo_torque(
    *,
    clock: Clock,
    loop: Loop,
    source: NDArray[np.float64],
    velocity: NDArray[np.float64],
    position: NDArray[np.float64],
    velocity_feedforward: NDArray[np.float64],
    torque_feedforward: NDArray[np.float64],
    stored: float,
) -> NDArray[np.float64]:
    """Torque [N m] that a servo makes of measured signals at its own clock, from rest; stored: of its integrator, before."""

class Loop:
    """How the loop is closed, "continuous", "sampled", "servo" or "open", and over which controller; "open" has none."""

    def __init__(self, *, kind: str, controller: Controller = ..., servo: ServoSettings = ...) -> None: ...
    def differenced(self) -> Loop:
        """The loop of a servo whose velocity is the difference of an encoder's angle over its sample; ValueError of another."""

class Record:
    """Input (velocity command [rad/s], torque [N m] in the open loop) and measured velocity [rad/s] of an identification.

    start: "rest", "steady" (velocity0 [rad/s] under constant input) or "free" (unknown, estimated from "steady" on).
    clock: of the controller.
    In the loop of a servo the record starts at rest, and its command is "held",
    "straight" or "mixed" between the lines of the log; `straight` is the part of a mixed one that goes straight.
    """

    def __init__(
        self,
        *,
        clock: Clock,
        input: NDArray[np.float64],
        output: NDArray[np.float64],
        start: str,
        velocity0: float,
        between: str = "held",
        straight: NDArray[np.float64] | None = None,
        velocity_feedforward: float = 0.0,
        acceleration_feedforward: float = 0.0,
    ) -> None: ...

MOST_STATES: int  # of plant and controller in one difference equation

def servo_order(*, loop: Loop, clock: Clock) -> int:
    """States that a servo adds to those of the plant; ValueError where plant and servo make no linear equation."""

class Response:
    """A measured response (n,), its error sum that of (weight |value - plant|)^2; noise: of a perfect plant, 0: unknown.

    at: j omega [rad/s], behind a hold over sample_time T [s] e^(j omega T) - 1; band: lowest and highest omega [rad/s].
    """

    def __init__(
        self, *, at: _Complex, value: _Complex, weight: _Real, sample_time: float, band: tuple[float, float], noise: float
    ) -> None: ...
    def plant(self, gain: float, poles: NDArray[np.complex128], zeros: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """What a model shows at these frequencies."""

class Experiment:
    """Records and their loop, and frequency responses: what candidates are simulated against.

    kernels: an instruction set, "" for the machine's best; fused: whether it has an instruction for a b + c.
    Ctrl-C ends long work, and so does an exception that `progress` raises.
    It gets (generations done, best fitness, number of species, (p, q) of the one that leads or (-1, -1)).
    """

    def __init__(self, records: Sequence[Record], loop: Loop, kernels: str = "", responses: Sequence[Response] = []) -> None: ...
    @property
    def kernels(self) -> str: ...
    @property
    def fused(self) -> bool: ...
    def search(
        self,
        ranges: SearchRanges,
        settings: EngineSettings,
        trials: int,
        seed: int,
        workers: int,
        progress: Callable[[int, float, int, tuple[int, int]], None] | None = None,
    ) -> list[Trial]: ...
    def refine(
        self,
        models: Sequence[tuple[float, NDArray[np.complex128], NDArray[np.complex128], NDArray[np.float64]]],
        ranges: SearchRanges | None,
        whitening: Sequence[float],
        max_iterations: int,
        workers: int,
        tolerance: float = 1e-9,
    ) -> list[Refined]: ...
    def go_on(
        self,
        fits: Sequence[Refined],
        ranges: SearchRanges | None,
        whitening: Sequence[float] | NDArray[np.float64],
        max_iterations: int,
        tolerance: float,
        workers: int,
    ) -> list[Refined]:
        """Each fit some iterations further; with none, its cost and what stands at a bound."""
    def residual_sums(self, fit: Refined, lags: int) -> tuple[NDArray[np.float64], float]:
        """(sum over n and records of e(n) e(n+k) for k = 0..lags, largest absolute simulated velocity)."""
    def fit_sums(
        self, fit: Refined, phi: Sequence[float] | NDArray[np.float64], lags: Sequence[int], threshold: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """(J'J, J'SJ, X'X): J = de/dx with start states last; S the covariance of unit noise with the autoregression phi.

        X = F [e | J | regressors]: the input at lags[0] and its changes from lag to lag, 1, the sign of the simulated velocity
        where its size exceeds threshold, and its signed square; F = 1 - sum phi_i z^-i.
        """
    def sensitivities(
        self,
        gain: float,
        poles: NDArray[np.complex128],
        zeros: NDArray[np.complex128],
        starts: Sequence[float] | NDArray[np.float64],
        whitening: Sequence[float],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """(error, its derivatives: parameters x samples, the factors of the parameters)."""

def simulate(
    gain: float,
    poles: NDArray[np.complex128],
    zeros: NDArray[np.complex128],
    clock: Clock,
    input: NDArray[np.float64],
    loop: Loop,
    initial_state: NDArray[np.float64],
    arithmetic: str = "double",
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(velocity, torque) of the model in its loop; limits may be inf, an empty initial_state is rest."""

def mirrored(
    arithmetic: str,
    in_z: bool,
    gain: float,
    poles: NDArray[np.complex128],
    zeros: NDArray[np.complex128],
    clock: Clock,
    input: NDArray[np.float64],
    controller: Controller,
) -> tuple[NDArray[np.float64], bool]:
    """(velocity in the continuous loop in a drive's arithmetic, whether it left its range); in_z: not in delta form."""

def discrete(
    gain: float,
    poles: NDArray[np.complex128],
    zeros: NDArray[np.complex128],
    clock: Clock,
    loop: Loop,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(alpha, beta) of equation (7), powers of z^-1."""

def effect_table() -> list[
    tuple[str, str, str, tuple[tuple[str, str, float, float, float, bool], ...], bool, bool, str, str, bool, int]
]:
    """(name, place, meaning, parameters, simulated, needs two masses, relation, remark, turns, waves at most) of every effect."""

def broken_relation(name: str, values: Sequence[float]) -> str:
    """The relation between an effect's parameters that these values break, or ""."""

class EffectModel:
    """A linear drive and its effects: (name, parameters in the order of the table) each; with "@load" behind it at the load."""

    def __init__(
        self,
        gain: float,
        poles: NDArray[np.complex128],
        zeros: NDArray[np.complex128],
        effects: Sequence[tuple[str, Sequence[float]]],
    ) -> None: ...

class EffectRecord:
    """A record and its loop, as models with effects are run against them; an empty position is integrated."""

    def __init__(
        self,
        *,
        clock: Clock,
        input: NDArray[np.float64],
        position: NDArray[np.float64],
        velocity: NDArray[np.float64],
        start_angle: float,
        loop: Loop,
        velocity_feedforward: NDArray[np.float64] = ...,
        torque_feedforward: NDArray[np.float64] = ...,
        torque_before: float = 0.0,
    ) -> None: ...
    def simulate(
        self,
        models: Sequence[EffectModel],
        initial_states: NDArray[np.float64],
        substeps: int,
        workers: int,
        all: bool,
        kernel: str = "",
        lanes: bool = True,
        own: Sequence[tuple[str, Callable[..., Any], NDArray[np.float64]]] = [],
        load: bool = False,
    ) -> tuple[NDArray[np.float64], ...]:
        """(velocity, torque, angle, load's velocity, load's angle less the motor's), models x samples.

        The second and third are empty unless `all`, the last two unless `load`. substeps 0: as needed.

        own: effects that the core does not know, each (command, torque, friction, actuator or sensor, the two of the shaft at the
        load with @load behind; function(velocity, angle, torque, command, time, *parameters), arrays of one number per model side
        by side; parameters, models x parameters).
        """
    def simulate_values(
        self,
        values: NDArray[np.float64],
        structure: tuple[int, ...],
        effects: Sequence[str],
        initial_states: NDArray[np.float64],
        substeps: int,
        workers: int,
        own: Sequence[tuple[str, Callable[..., Any], NDArray[np.float64]]] = [],
        shown: str = "velocity",
    ) -> NDArray[np.float64]:
        """Velocities of models given as rows of natural parameters and effects' parameters.

        shown: "velocity", or of the load of two masses "angle", "lag" (the angle less the motor's) or "load velocity".
        """

def decode(
    words: Sequence[int], ranges: SearchRanges, gray: bool, logarithmic: bool
) -> tuple[float, NDArray[np.complex128], NDArray[np.complex128]]:
    """(gain, poles, zeros) of a chromosome."""

def filtered(b: _Real, a: _Real, rows: _Real, lengths: Sequence[int]) -> _Real:
    """v(n) = sum_i b_i e(n-i) - sum_{i>=1} a_i v(n-i) of rows of e, each cut into records of these lengths, from rest."""

def zero_phase(sections: _Real, rows: _Real, extension: int) -> _Real:
    """Rows forward and backward through sections of second order, each continued by its point reflection at both ends."""

def errors_of(measured: _Real, rows: _Real, lost: float) -> _Real:
    """measured - rows, written over the rows; `lost` everywhere in a row that comes to it or holds what is no number."""

def filtered_powers(b: _Real, a: _Real, e: _Real, weight: _Real, lengths: Sequence[int]) -> _Real:
    """Sum of (weight v)^2 of one row e under each filter, a row of b and of a."""

def state_recursion(A: _Complex, drive: _Complex, start: _Complex, newest: bool) -> _Complex: ...
def lagged_products(e: _Real, lags: int) -> _Real:
    """sum_n e(n) e(n-k), k = 0..lags."""

def held_torque(
    error: NDArray[np.float64],
    controller: Controller,
    newest: float,
    before: float,
    rule: str,
    integral: float,
) -> NDArray[np.float64]:
    """Torque of a PI whose integrator does not wind up at its torque limit; it adds newest e(n) + before e(n-1)."""

def clamped_sum(steps: NDArray[np.float64], limit: float, start: float) -> NDArray[np.float64]:
    """I(n) = I(n-1) + steps(n), clamped to +-limit after each update, from I(-1) = start."""

def rate_limited(command: NDArray[np.float64], step: float, start: float) -> NDArray[np.float64]:
    """The command followed by at most `step` a sample, from `start`."""

def recurrence(model: EffectModel, clock: Clock, loop: Loop, substeps: int, top_speed: float) -> dict[str, Any]:
    """The numbers of the recurrence that simulates a model, for writing it in another language.

    "substeps" 0 where no effect acts, "a" and "b" then in delta = z - 1 at dt; else "effects", "a" and "b" (or "phi", "motor",
    "coupling", "shaft" of two masses), "rise", "bend" and "bend_of" at the substep, and "tables", of effects that look back:
    (torques back, share) of each substep.
    """
