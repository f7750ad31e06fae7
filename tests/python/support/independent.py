"""The simulator computed a second and a third time, from the specification alone and without gaident.

    G(s) = K * prod (s - zero_j) / prod (s - pole_i)          plant, torque [N m] -> motor velocity [rad/s]
    I(n) = I(n-1) + ki*dt/2*(e(n) + e(n-1)),  e = r - w        PI, clamped to +-integrator_limit
    u(n) = kp*e(n) + I(n)                                      clamped to +-torque_limit

`exact`  works with polynomials in z, which need many more digits than a double has: 120.
         The zero-order hold is a power series of the step response. Slow, short, obvious; the referee for all the rest.
         (Its samples are computed in the standard library's decimals, which are written in C.)
`scipy_` works in state space: a cascade of sections in normalised time, scipy.signal.cont2discrete (bilinear,
         or the hold by its matrix exponential), the algebraic loop solved for the error, or by a bracketing
         root finder where something may be clamped. Fast enough for long records; good to some 1e-12.

They share no line, but for an initial state: its free response is defined on the exact denominator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from decimal import Context, Decimal, localcontext
from math import factorial
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.signal import cont2discrete, dlsim

Array = NDArray[np.float64]
State = Array | Sequence[float]
INF = float("inf")
DIGITS = 120
SLACK = Decimal(10) ** -80
mp = mpmath.mp.clone()
mp.dps = DIGITS


@dataclass(frozen=True)
class Case:
    """One simulation: plant, loop, controller. Roots are complete (conjugates included) and in rad/s."""

    gain: float
    poles: NDArray[np.complex128]
    zeros: NDArray[np.complex128]
    dt: float
    loop: str
    kp: float = 0.0
    ki: float = 0.0
    torque_limit: float = INF
    integrator_limit: float = INF

    @property
    def p(self) -> int:
        """Poles in excess of zeros."""
        return len(self.poles) - len(self.zeros)

    @property
    def order(self) -> int:
        """Order N of equation (7)."""
        return len(self.poles) + (self.loop != "open")

    @property
    def limited(self) -> bool:
        return self.torque_limit < INF or self.integrator_limit < INF


# ------------------------------------------------------- exact: polynomials in z, highest power first


def _multiply(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    out = [mp.zero] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def _product(factors: Sequence[Sequence[Any]]) -> list[Any]:
    """Real polynomial from factors that may be complex in conjugate pairs."""
    out: list[Any] = [mp.mpc(1)]
    for f in factors:
        out = _multiply(out, f)
    return [mp.re(v) for v in out]


def exact_plant(case: Case) -> tuple[list[Any], list[Any]]:
    """Numerator and monic denominator in z of the discrete plant, both of p+q+1 numbers."""
    return _exact_bilinear(case) if case.loop == "continuous" else _exact_held(case)


def _exact_bilinear(case: Case) -> tuple[list[Any], list[Any]]:
    """s = (2/dt)*(z-1)/(z+1): factor s - a -> (c-a)*z - (c+a), each missing zero -> z + 1."""
    c = 2 / mp.mpf(case.dt)
    num = _product([[c - mp.mpc(z), -c - mp.mpc(z)] for z in case.zeros] + [[1, 1]] * case.p)
    den = _product([[c - mp.mpc(a), -c - mp.mpc(a)] for a in case.poles])
    return [mp.mpf(case.gain) * v / den[0] for v in num], [v / den[0] for v in den]


def _exact_held(case: Case) -> tuple[list[Any], list[Any]]:
    """Denominator prod(z - exp(a*dt)); numerator from the step response at 0 .. N*dt, a power series."""
    order, dt = len(case.poles), mp.mpf(case.dt)
    den_s = _product([[1, -mp.mpc(a) * dt] for a in case.poles])
    num_s = [mp.mpf(case.gain) * dt**case.p * v for v in _product([[1, -mp.mpc(z) * dt] for z in case.zeros])]
    num_s = [mp.zero] * case.p + num_s
    # G(s) = sum M_m s^-m, so a unit step gives y(t) = sum M_m t^m / m!
    terms = 60 + int(12 * order * (1 + max((abs(a) for a in case.poles), default=0.0) * case.dt))
    markov: list[Any] = []
    for m in range(terms):
        feed = num_s[m] if m <= order else mp.zero
        markov.append(feed - mp.fsum(den_s[i] * markov[m - i] for i in range(1, min(m, order) + 1)))
    series = [v / factorial(m) for m, v in enumerate(markov)]
    step = [mp.fsum(v * k**m for m, v in enumerate(series)) for k in range(order + 1)]
    pulse = [step[0]] + [step[k] - step[k - 1] for k in range(1, order + 1)]
    den = _product([[1, -mp.exp(mp.mpc(a) * dt)] for a in case.poles])
    return [mp.fsum(den[j] * pulse[k - j] for j in range(k + 1)) for k in range(order + 1)], den


def exact_loop(case: Case) -> tuple[list[Any], list[Any]]:
    """Numerator and monic denominator in z, input to velocity: N/(D+N) if closed, N/D if open."""
    num, den = exact_plant(case)
    if case.loop != "open":
        half = mp.mpf(case.ki) * mp.mpf(case.dt) / 2
        num = _multiply(num, [mp.mpf(case.kp) + half, half - mp.mpf(case.kp)])
        den = [x + y for x, y in zip(_multiply(den, [1, -1]), num, strict=True)]
    return [v / den[0] for v in num], [v / den[0] for v in den]


def exact_equation7(case: Case) -> tuple[Array, Array]:
    """alpha (N+1), beta (N) of w(n) = sum alpha_i r(n-i) + sum beta_i w(n-i)."""
    num, den = exact_loop(case)
    return np.array([float(v) for v in num]), np.array([float(-v) for v in den[1:]])


def taylor_shift(poly: Sequence[Any]) -> list[Any]:
    """Coefficients in delta = z - 1 of a polynomial in z, by repeated synthetic division."""
    out = list(poly)
    for last in range(len(out), 1, -1):
        for i in range(1, last):
            out[i] += out[i - 1]
    return out


def _state_in_z(den: Sequence[Any], state: State) -> list[Any]:
    """Observer-form state in z whose free response is that of the observer-form state in delta.

    delta: x_i(n+1) = x_i + x_(i+1) - a_(i+1)*y, y = x_0.
    Its first p+q outputs fix the state in z, s_k(0) = y(k) + sum_(i=1..k) den_i*y(k-i).
    """
    a = taylor_shift(den)
    order = len(den) - 1
    x, y = [mp.mpf(v) for v in state], list[Any]()
    while len(y) < order:
        y.append(x[0])
        x = [x[i] + (x[i + 1] if i + 1 < order else 0) - a[i + 1] * y[-1] for i in range(order)]
    return [y[k] + mp.fsum(den[i] * y[k - i] for i in range(1, k + 1)) for k in range(order)]


def _clamp(value: Any, limit: Any) -> Any:
    return max(-limit, min(limit, value))


def _decimal(value: Any) -> Decimal:
    """The same number, to all the digits that it has."""
    return Decimal(mp.nstr(mp.mpf(value), DIGITS + 5))


def _exact_torque(case: Case, command: Decimal, free: Decimal, feed: Decimal, stored: Decimal) -> tuple[Decimal, Decimal]:
    """u(n) and e(n), e = r - free - feed*u: all combinations of clamps are tried, one is consistent."""
    kp, half = Decimal(case.kp), Decimal(case.ki) * Decimal(case.dt) / 2
    big_i, big_u = Decimal(case.integrator_limit), Decimal(case.torque_limit)
    pieces = [(kp + half, stored)] + ([(kp, big_i), (kp, -big_i)] if big_i.is_finite() else [])
    pieces += [(Decimal(0), big_u), (Decimal(0), -big_u)] if big_u.is_finite() else []
    for slope, offset in pieces:
        error = (command - free - feed * offset) / (1 + feed * slope)
        torque = slope * error + offset
        wanted = _clamp(kp * error + _clamp(stored + half * error, big_i), big_u)
        if abs(torque - wanted) <= SLACK * (1 + abs(torque) + abs(stored)):
            return torque, error
    raise AssertionError("no consistent combination of clamps")


def exact_simulate(case: Case, signal: Array, state: State = ()) -> tuple[Array, Array]:
    """Velocity and torque, sample by sample in 120 digits; `state` as gaident._core.simulate takes it."""
    with localcontext(Context(prec=DIGITS)):
        return _exact_samples(case, signal, state)


def _exact_samples(case: Case, signal: Array, state: State) -> tuple[Array, Array]:
    in_z = exact_plant(case)
    num, den = ([_decimal(v) for v in polynomial] for polynomial in in_z)
    order, closed = len(den) - 1, case.loop != "open"
    x = [_decimal(v) for v in _state_in_z(in_z[1], state[:order])] if len(state) else [Decimal(0)] * order
    stored = Decimal(float(state[order])) if len(state) and closed else Decimal(0)
    half = Decimal(case.ki) * Decimal(case.dt) / 2
    limit = Decimal(case.integrator_limit)
    velocity, torque = [], []
    for value in map(float, signal):
        free = x[0] if order else Decimal(0)
        if closed:
            u, e = _exact_torque(case, Decimal(value), free, num[0], stored)
            stored = _clamp(stored + half * e, limit) + half * e
        else:
            u = Decimal(value)
        y = free + num[0] * u
        x = [(x[i + 1] if i + 1 < order else 0) + num[i + 1] * u - den[i + 1] * y for i in range(order)]
        velocity.append(float(y))
        torque.append(float(u))
    return np.array(velocity), np.array(torque)


# ------------------------------------------------------- SciPy: a cascade of sections in state space


def _pairs(roots: NDArray[np.complex128]) -> list[tuple[complex, ...]]:
    """Conjugate pairs first, then real roots two by two, then a single one."""
    upper = sorted((complex(r) for r in roots if r.imag > 0), key=abs)
    real = sorted((complex(r) for r in roots if r.imag == 0), key=abs)
    out: list[tuple[complex, ...]] = [(r, r.conjugate()) for r in upper]
    out += [tuple(real[i : i + 2]) for i in range(0, len(real), 2)]
    return out


def _section(poles: Sequence[complex], zeros: Sequence[complex]) -> tuple[Array, Array, Array, float]:
    """State space of prod(s - zero)/prod(s - pole), one or two poles, not more zeros; roots times dt."""
    if len(poles) == 1:
        a = poles[0].real
        return np.array([[a]]), np.ones(1), np.array([a - zeros[0].real if zeros else 1.0]), float(len(zeros))
    mean = (poles[0] + poles[1]).real / 2
    square = (((poles[0] - poles[1]) / 2) ** 2).real  # negative for a complex pair
    scale = max(1.0, abs(square) ** 0.5)
    # (s - a2)^-1 [0, 1] = [scale, s - mean] / ((s - mean)^2 - square)
    a2 = np.array([[mean, scale], [square / scale, mean]])
    if len(zeros) < 2:  # 1 or (s - mean) + (mean - zero)
        c0, c1, feed = (1.0, 0.0, 0.0) if not zeros else (mean - zeros[0].real, 1.0, 0.0)
    else:  # ((s-mean) + m - z1)((s-mean) + m - z2) = (s-mean)^2 - square + c1*(s-mean) + c0
        z1, z2 = mean - zeros[0], mean - zeros[1]
        c0, c1, feed = (z1 * z2).real + square, (z1 + z2).real, 1.0
    return a2, np.array([0.0, 1.0]), np.array([c0 / scale, c1]), feed


def _cascade(case: Case) -> tuple[Array, Array, Array, float]:
    """The plant in normalised time t/dt: slow roots become small numbers, couplings stay near one."""
    poles, zeros = _pairs(case.poles * case.dt), _pairs(case.zeros * case.dt)
    poles.sort(key=lambda group: -len(group))
    zeros.sort(key=lambda group: -len(group))
    a, b, c, d = np.zeros((0, 0)), np.zeros(0), np.zeros(0), case.gain * case.dt**case.p
    for i, group in enumerate(poles):
        a2, b2, c2, d2 = _section(group, zeros[i] if i < len(zeros) else ())
        a = np.block([[a, np.zeros((len(a), len(a2)))], [np.outer(b2, c), a2]])
        b, c, d = np.concatenate([b, b2 * d]), np.concatenate([d2 * c, c2]), d2 * d
    return a, b, c, d


def scipy_plant(case: Case) -> tuple[Array, Array, Array, float]:
    """x(n+1) = a x + b u, y = c x + d u."""
    a, b, c, d = _cascade(case)
    if not len(a):  # a gain alone
        return a, b, c, d
    method = "bilinear" if case.loop == "continuous" else "zoh"
    ad, bd, cd, dd, _ = cont2discrete((a, b[:, None], c[None, :], np.array([[d]])), 1.0, method=method)
    return ad, bd[:, 0], cd[0], float(dd[0, 0])


def scipy_loop(case: Case) -> tuple[Array, Array, Array, Array]:
    """Command to [velocity, torque] without limits: PI (cont2discrete too) and plant, solved for e."""
    a, b, c, d = scipy_plant(case)
    n, one = len(b), np.ones((1, 1))
    pi = cont2discrete((0 * one, one, case.ki * case.dt * one, case.kp * one), 1.0, method="bilinear")
    bi, ci, di = (float(m[0, 0]) for m in pi[1:4])
    gain = 1 / (1 + d * di)
    error = -gain * np.append(c, d * ci)  # e = gain*r + error @ states
    torque = np.append(np.zeros(n), ci) + di * error
    closed = np.zeros((n + 1, n + 1))
    closed[:n, :n], closed[n, n] = a, 1.0
    closed += np.append(np.outer(b, torque), bi * error[None, :], axis=0)
    rows = np.array([np.append(c, 0.0) + d * torque, torque])
    return closed, np.append(b * di, bi)[:, None] * gain, rows, np.array([[d], [1.0]]) * di * gain


def scipy_simulate(case: Case, signal: Array, state: State = ()) -> tuple[Array, Array]:
    """Velocity and torque in double precision; the plant's initial state enters by its free response."""
    order = len(case.poles)
    free = free_response(case, state[:order], len(signal)) if len(state) else np.zeros(len(signal))
    if case.loop == "open":
        a, b, c, d = scipy_plant(case)
        _, out, _ = dlsim((a, b[:, None], c[None, :], np.array([[d]]), 1.0), signal)
        return out[:, 0] + free, np.array(signal, dtype=float)
    if case.limited or len(state):
        return _sample_by_sample(case, signal, free, float(state[order]) if len(state) else 0.0)
    _, out, _ = dlsim((*scipy_loop(case), 1.0), signal)
    return out[:, 0], out[:, 1]


def _sample_by_sample(case: Case, signal: Array, disturbance: Array, stored: float) -> tuple[Array, Array]:
    a, b, c, d = scipy_plant(case)
    half = case.ki * case.dt / 2

    def excess(u: float, undriven_error: float, stored: float) -> float:
        """u less the controller's answer to it; rises with u wherever d*(kp + half) > -1."""
        e = undriven_error - d * u
        integral = _clamp(stored + half * e, case.integrator_limit)
        return u - float(_clamp(case.kp * e + integral, case.torque_limit))

    velocity, torque = np.zeros(len(signal)), np.zeros(len(signal))
    x = np.zeros(len(b))
    for n, r in enumerate(signal):
        free = float(c @ x) + disturbance[n]
        u = -excess(0.0, r - free, stored)
        if d != 0.0 and u != 0.0:
            low, high = min(0.0, u), max(0.0, u)
            while excess(low, r - free, stored) > 0.0:
                low = 2 * low - high
            while excess(high, r - free, stored) < 0.0:
                high = 2 * high - low
            u = brentq(excess, low, high, args=(r - free, stored), xtol=1e-300, rtol=4 * np.finfo(float).eps)
        velocity[n], torque[n] = free + d * u, u
        e = r - velocity[n]
        stored = _clamp(stored + half * e, case.integrator_limit) + half * e
        x = a @ x + b * u
    return velocity, torque


def free_response(case: Case, state: State, samples: int) -> Array:
    """The plant's velocity without any torque, from the state of its observer form in delta."""
    _, den = exact_plant(case)
    a = np.array([float(v) for v in taylor_shift(den)[1:]])
    x, out = np.array(state, dtype=float), np.zeros(samples)
    for n in range(samples if len(x) else 0):
        out[n] = x[0]
        x = x + np.append(x[1:], 0.0) - a * x[0]
    return out


def deviation(value: Array, reference: Array) -> float:
    """Largest absolute deviation, relative to the largest absolute reference."""
    scale = float(np.max(np.abs(reference)))
    return float(np.max(np.abs(np.asarray(value) - reference))) / (scale if scale > 0 else 1.0)


# ------------------------------------------------------- random cases

FAMILIES = ("mixed", "slow", "fast", "unstable")


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _random_roots(rng: np.random.Generator, count: int, low: float, high: float) -> NDArray[np.complex128]:
    """Real roots and pairs (damping 0.01 .. 1) in the left half plane, logarithmic in [low, high] rad/s."""
    roots: list[complex] = []
    while len(roots) < count:
        size, pair = _log_uniform(rng, low, high), count - len(roots) >= 2 and rng.random() < 0.6
        damping = _log_uniform(rng, 0.01, 1.0) if pair else 1.0
        root = complex(-damping, np.sqrt(1 - damping**2)) * size
        roots += [root, root.conjugate()] if pair else [root]
    return np.array(roots, dtype=complex)


def random_case(rng: np.random.Generator, loop: str, p: int, q: int, family: str, samples: int, growth: float = 1e6) -> Case:
    """A plant of the family and a PI around it; neither grows by more than `growth` within `samples`.

    slow: every root within 2 % of one slow one, or exactly on it; fast: sizes up to 0.98 of Nyquist;
    unstable: roots moved into the right half plane as far as the growth allows, zeros too.
    """
    dt, base = _log_uniform(rng, 1e-4, 2e-3), _log_uniform(rng, 0.2, 5.0)
    nyquist = np.pi / dt
    ranges = {"slow": (base, 1.02 * base), "fast": (0.1 * nyquist, 0.98 * nyquist)}
    low, high = ranges.get(family, (2.0, 0.3 * nyquist))
    if family == "slow" and rng.random() < 0.3:
        high = low
    poles, zeros = _random_roots(rng, p + q, low, high), _random_roots(rng, q, low, high)
    if family == "unstable":
        rate = np.log(growth) / (samples * dt) / max(1, len(poles))
        chosen = (poles.imag != 0.0) | (rng.random() < 0.5)  # all of them, or the complex ones only
        real = np.minimum(np.abs(poles.real), rate * rng.uniform(0.1, 1.0))
        poles = np.where(chosen, real + 1j * poles.imag, poles)
        zeros = zeros if rng.random() < 0.5 else -zeros.conjugate()
    crossover, kp = _log_uniform(rng, 20.0, 0.3 / dt), _log_uniform(rng, 1e-3, 10.0)
    ki = kp * crossover * float(rng.uniform(0.02, 0.5))
    shape = np.prod(1j * crossover - zeros) / np.prod(1j * crossover - poles)
    case = Case(float(1 / (kp * abs(shape))), poles, zeros, dt, loop, kp, ki)
    for _ in range(60):
        if loop == "open" or _growth(case, samples) <= growth:
            break
        case = replace(case, kp=case.kp / 1.5, ki=case.ki / 2)
    return case


def _growth(case: Case, samples: int) -> float:
    """Growth of the fastest mode of the unlimited loop; infinite where d*C is next to -1."""
    if abs(1 + scipy_plant(case)[3] * (case.kp + case.ki * case.dt / 2)) < 0.2:
        return INF
    with np.errstate(over="ignore"):
        return float(np.max(np.abs(np.linalg.eigvals(scipy_loop(case)[0]))) ** samples)


def random_signal(rng: np.random.Generator, samples: int) -> Array:
    """A step, white noise, a staircase or a random walk of some 40 rad/s."""
    kind = rng.integers(4)
    if kind == 0:
        return np.full(samples, 43.6)
    if kind == 1:
        return rng.normal(0.0, 20.0, samples)
    if kind == 2:
        return np.repeat(rng.normal(0.0, 30.0, samples), 25)[:samples]
    return np.cumsum(rng.normal(0.0, 3.0, samples))
