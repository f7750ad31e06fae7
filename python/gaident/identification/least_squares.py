"""The conventional identification (equation 7): linear regression in a difference equation of a given order.

    w(n) = sum_{i=0..N} alpha_i r(n-i) + sum_{i=1..N} beta_i w(n-i) + v(n) = phi(n)' theta + v(n)
    theta = (alpha_0..alpha_N, beta_1..beta_N),   D(z) = 1 - beta_1/z - ... - beta_N/z^N

Plain        sum_n phi(n) v(n) = 0, least squares.
             Noise on w is in phi too and biases theta (errors in variables), the more, the finer the sampling.
Instruments  sum_n z(n) v(n) = 0, z(n) = phi(n) of the noise-free answer of the last estimate: no bias from noise that is
             independent of r.
Whitening    white noise e on w makes v = D e, far from white: r and w are first filtered by 1/D of the last estimate
             (Steiglitz and McBride, IEEE Trans. Automatic Control 10, 1965).
Both         the refined instrumental variables of Young and Jakeman (Int. J. Control 29, 1979), for white noise on w as good as
             the fit of a free run.

Nothing here comes from the core, which it is compared with: numpy and scipy only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import A_CONTROLLER, NO_CONTROLLER
from gaident.checks import is_whole, yes_or_no
from gaident.control.pi import PI, checked_pi
from gaident.data.record import Record
from gaident.errors import RecordError, SettingsError
from gaident.identification.plant_of_discrete import plant_of_discrete
from gaident.models.discrete import Discrete
from gaident.models.factors import FactorCounts, factor_parameters
from gaident.models.held_torque import held_torque
from gaident.models.mechanics import Mechanics, mechanics_from_model
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["LeastSquares", "least_squares"]

Vector = NDArray[np.float64]
CONVERGED = 1e-9  # no decision: of a solver
# What is done at once, so that Ctrl-C comes through: rows times the square of the unknowns, and samples.
BLOCK = 1 << 23  # no decision: memory; some 0.1 s; records of one block have the bits of a whole regression
FILTERED = 1 << 20  # no decision: memory; the same bits in blocks of any size


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """What a regression in equation (7) found.

    Attributes
    ----------
    alpha : ndarray, shape (N+1,)
        Coefficients of the input, see `Discrete`.
    beta : ndarray, shape (N,)
        Coefficients of the earlier velocities.
    covariance : ndarray, shape (2N+1, 2N+1)
        Covariance of (alpha, beta) as the regression itself sees it: without the bias that noise brings to plain least squares.
    noise_std : float
        Standard deviation of the equation error v [rad/s]; with whitening, of the white noise e.
    rounds : int
        Rounds of the iteration (plain least squares needs one).
    converged : bool
        Whether the iteration converged.
    dt : float
        Sample time [s].
    controller : PI or None
        The loop that the command went through.
    model : Model or None
        The plant behind the polynomial, p = 1; None where there is none.
    note : str
        Why there is none.
    mechanics : OneMass, TwoMass or None
        Mechanism of the model with standard deviations.

    See Also
    --------
    least_squares : Makes it, with an example.
    """

    alpha: Vector
    beta: Vector
    covariance: Vector
    noise_std: float
    rounds: int
    converged: bool
    dt: float
    controller: PI | None
    model: Model | None
    note: str
    mechanics: Mechanics | None

    @property
    def order(self) -> int:
        """N of equation (7)."""
        return len(self.beta)

    @property
    def discrete(self) -> Discrete:
        """The same coefficients as `Model.discrete` gives them."""
        return Discrete(self.alpha, self.beta)

    @property
    def stable(self) -> bool:
        """Whether equation (7) is stable: all roots of its polynomial inside the unit circle."""
        return bool(np.all(np.abs(np.roots(np.r_[1.0, -self.beta])) < 1.0))

    def simulate(self, rec: Record) -> Vector:
        """Return the free run of equation (7) from rest on a record [rad/s], shape (n,).

        Its command is the input, without a controller its torque.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            return _from_rest(self.alpha, np.r_[1.0, -self.beta], _source(rec, self.controller))


def least_squares(
    rec: Record, order: int, controller: PI | None = None, *, instruments: bool = False, whitening: bool = False
) -> LeastSquares:
    """Fit equation (7) to one record by linear regression, and find the plant and mechanics behind it.

    The module's docstring has the equations.
    An iteration that does not settle and a polynomial without a plant behind it are data of the result.

    Parameters
    ----------
    rec : Record
        With a controller its command is the input r, without one its torque.
        The first equation is that of sample N: what lies before the record is not assumed to be rest, but instruments and
        whitening start there.
    order : int
        Order N: 2 for one mass and 4 for two in the velocity loop, one less from torque to velocity.
    controller : PI, optional
        The loop that r went through; only the way back to the plant uses its values (limits are left out).
    instruments : bool
        Noise-free answers of the last estimate as instruments, instead of the measured ones.
    whitening : bool
        Filter by the last estimate's 1/D.

    Returns
    -------
    LeastSquares
        Coefficients with covariance, plant and mechanics.

    Raises
    ------
    SettingsError
        For an order that is no whole number, or too low, and a controller that is no bare PI.
    RecordError
        Where the record lacks the input, or is too short or too poor for the order.

    References
    ----------
    K. Steiglitz, L. E. McBride, IEEE Transactions on Automatic Control 10, 1965 (whitening).
    P. C. Young, A. J. Jakeman, International Journal of Control 29, 1979 (refined instrumental variables: both).

    Examples
    --------
    >>> import gaident as ga
    >>> torque = ga.m_sequence(7, amplitude=1.0)
    >>> still = ga.Record(1e-3, torque=torque, velocity=0.0 * torque)
    >>> rec = ga.Record(1e-3, torque=torque, velocity=ga.simulate(ga.OneMass(J=0.01, D=0.05), still))
    >>> found = ga.least_squares(rec, order=1)
    >>> round(found.mechanics.J, 4), round(found.mechanics.D, 4)
    (0.01, 0.05)
    """
    if not isinstance(rec, Record):
        raise RecordError(f"rec is {type(rec).__name__}: give a gaident.Record")
    checked_pi(controller, "equation (7) is")
    yes_or_no(instruments, "instruments", SettingsError)
    yes_or_no(whitening, "whitening", SettingsError)
    lowest = 1 if controller is None else 2
    if not is_whole(order) or order < lowest:
        more = "" if controller is None else " + 1"
        raise SettingsError(f"order is {order!r}: give a whole number N >= {lowest}, p + q{more} of the drive")
    N = int(order)
    enough = 2 * (2 * N + 1) + N
    if len(rec) < enough:
        raise RecordError(f"rec has {len(rec)} samples, too few for order {N}: give at least {enough}")
    source = _source(rec, controller)
    if np.ptp(source) == 0.0:
        raise RecordError(f"rec has a constant input of {source[0]:g}: a regression needs one that changes, see ga.m_sequence")
    theta, covariance, noise_std, rounds, converged = _iterate(source, rec.velocity, N, instruments, whitening)
    alpha, beta = theta[: N + 1], theta[N + 1 :]
    found = plant_of_discrete(alpha, beta, rec.dt, controller, covariance)
    mechanics = None
    if found.model is not None:
        mechanics = mechanics_from_model(found.model, _model_covariance(found.model, theta, covariance, rec.dt, controller))
    return LeastSquares(
        alpha, beta, covariance, noise_std, rounds, converged, rec.dt, controller, found.model, found.note, mechanics
    )


def regressors(source: Vector, velocity: Vector, N: int, rows: slice | None = None) -> Vector:
    """phi(n)' = (r(n)..r(n-N), w(n-1)..w(n-N)) as rows, n = N..S-1: shape (S - N, 2N + 1), or of these the ones asked for."""
    start, stop, _ = (rows or slice(None)).indices(len(source) - N)
    columns = [source[N - i + start : N - i + stop] for i in range(N + 1)]
    columns += [velocity[N - i + start : N - i + stop] for i in range(1, N + 1)]
    return np.column_stack(columns)


def _parts(rows: int, unknowns: int) -> list[slice]:
    """The rows of a regression, block by block."""
    size = max(BLOCK // unknowns**2, 8 * unknowns)  # no decision: memory
    return [slice(start, min(start + size, rows)) for start in range(0, rows, size)]


def _iterate(source: Vector, y: Vector, N: int, instruments: bool, whitening: bool) -> tuple[Vector, Vector, float, int, bool]:
    """(theta, covariance, deviation of v, rounds, converged)."""
    theta, covariance, noise_std = _solve(source, y, y, N)
    if not (instruments or whitening):
        return theta, covariance, noise_std, 1, True
    for rounds in range(2, POLICY.regressions + 1):
        before, polynomial = theta, _stabilised(theta[N + 1 :])
        one = np.ones(1)
        r, w = (_from_rest(one, polynomial, x) for x in (source, y)) if whitening else (source, y)
        answer = _from_rest(before[: N + 1], polynomial, r) if instruments else w
        theta, covariance, noise_std = _solve(r, w, answer, N)
        if np.linalg.norm(theta - before) <= CONVERGED * np.linalg.norm(theta):
            return theta, covariance, noise_std, rounds, True
    return theta, covariance, noise_std, POLICY.regressions, False


def _solve(r: Vector, w: Vector, instrument: Vector, N: int) -> tuple[Vector, Vector, float]:
    """theta with z'(y - phi theta) = 0, its covariance s^2 (Q'phi)^-1 (Q'phi)^-T with Q R = z, and s.

    phi: the regressors of r and w, y: w, z: the regressors of r and the instrument.
    Block by block: of [R; z of the next rows] the new Q and R, and Q' times what was found so far and comes next.
    """
    parts, y = _parts(len(r) - N, 2 * N + 1), w[N:]
    power = np.zeros(2 * N + 1)
    for part in parts:
        phi = regressors(r, w, N, part)
        power += np.einsum("ij,ij->j", phi, phi)
    size: Vector = np.sqrt(power)
    size[size == 0.0] = 1.0
    R, seen, answer = np.zeros((0, 2 * N + 1)), np.zeros((0, 2 * N + 1)), np.zeros(0)
    for part in parts:
        phi = regressors(r, w, N, part)
        z = phi if instrument is w else regressors(r, instrument, N, part)
        Q, R = np.linalg.qr(np.vstack([R, z]))
        seen, answer = Q.T @ np.vstack([seen, phi / size]), Q.T @ np.concatenate([answer, y[part]])
    inverse = np.linalg.pinv(seen, rcond=1e-13) / size[:, None]
    theta = inverse @ answer
    squares = 0.0
    for part in parts:
        error = y[part] - regressors(r, w, N, part) @ theta
        squares += float(error @ error)
    variance = squares / (len(y) - len(theta))
    return theta, variance * inverse @ inverse.T, variance**0.5


def _from_rest(alpha: Vector, polynomial: Vector, source: Vector) -> Vector:
    from scipy.signal import lfilter

    answer: Vector = np.empty(len(source))
    state = np.zeros(max(len(alpha), len(polynomial)) - 1)
    for start in range(0, len(source), FILTERED):
        part = slice(start, start + FILTERED)
        answer[part], state = lfilter(alpha, polynomial, source[part], zi=state)
    return answer


def _stabilised(beta: Vector) -> Vector:
    """The polynomial 1 - beta_1/z - ..., roots outside the unit circle mirrored into it: instruments must not grow."""
    roots = np.roots(np.r_[1.0, -beta])
    size = np.abs(roots)
    inside = np.where(size > 1.0, roots / np.maximum(size, 1.0) ** 2, roots)
    polynomial: Vector = np.poly(inside).real.astype(np.float64)
    return polynomial


def _model_covariance(model: Model, theta: Vector, covariance: Vector, dt: float, controller: PI | None) -> Vector | None:
    """Of the model's natural parameters x: sum_k d_k d_k', d_k the change of x with theta along cov^(1/2)_k.

    None where x does not follow smoothly, and where no noise is left to speak of.
    """
    N, structure = len(theta) // 2, FactorCounts.of(model)
    variance, directions = np.linalg.eigh(covariance)
    if variance[-1] < 1e-16 * float(theta @ theta):
        return None
    columns = []
    for step in (directions * np.sqrt(np.maximum(variance, 0.0))).T:
        ends = []
        for moved in (theta + 0.1 * step, theta - 0.1 * step):
            near = plant_of_discrete(moved[: N + 1], moved[N + 1 :], dt, controller, covariance).model
            if near is None or FactorCounts.of(near) != structure:
                return None
            ends.append(factor_parameters(near)[1])
        columns.append((ends[0] - ends[1]) / 0.2)
    found = np.column_stack(columns) @ np.array(columns)
    symmetric: Vector = 0.5 * (found + found.T)
    return symmetric if np.all(np.isfinite(symmetric)) else None


def _source(rec: Record, controller: PI | None) -> Vector:
    if not isinstance(rec, Record):
        raise RecordError(f"rec is {type(rec).__name__}: give a gaident.Record")
    torque = None if rec.torque is None else held_torque(rec)
    source, name = (torque, "torque") if controller is None else (rec.command, "command")
    if source is None:
        other = f"{A_CONTROLLER} to use the command" if controller is None else f"{NO_CONTROLLER} to use the torque"
        raise RecordError(f"the record has no {name}, the input of the regression: give Record({name}=...), or {other}")
    return source
