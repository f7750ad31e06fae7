"""Does the linear model hold? Tests on the residual that are valid under feedback.

Whiteness says whether anything predictable is left; noise of a colour of its own leaves that too. What falsifies the *model*
is a residual
that still depends on the input or on the motion: whitened, and with what a change of the model's own parameters could explain
taken
out, it is regressed on the input at several lags, a constant, and sign(w), w|w| of the simulated velocity. F-test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.identification.noise import Autoregression, chi2_tail, ljung_box, whiten
from gaident.identification.starts import noise_std

__all__ = ["Adequacy", "assess", "independence_p", "orthonormal_rows"]

Vector = NDArray[np.float64]

LAGS = (0, 1, 2, 4, 8, 16, 32)
LEVEL = 1e-4  # p-value below which the linear model counts as falsified


@dataclass(frozen=True)
class Adequacy:
    """What the residual says about the model.

    white_p: Ljung-Box p-value of the residual; ar_order: order of the noise model; noise_std: standard deviation of the whitened
    residual [rad/s]; predictable: share of the residual's power that its own past predicts (0: white); excess: rms of the
    residual over
    the noise as the measured velocity's own third differences show it;
    independence_p: p-value of the test that the residual no longer depends on input and motion; falsified: it does;
    undecided: it does not, but the residual is coloured and more than twice the noise, so that dynamics may be missing.
    """

    white_p: float
    ar_order: int
    noise_std: float
    predictable: float
    excess: float
    independence_p: float
    falsified: bool
    undecided: bool

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        if self.falsified:
            return (
                "The linear model is falsified: the residual still depends on the input or the motion "
                f"(p = {self.independence_p:.1g}), and its own past predicts {100 * self.predictable:.0f} % of its power. "
                "Do not trust the mechanical parameters; an effect that is not in the model bends them."
            )
        if self.undecided:
            if not np.isfinite(self.excess):
                return (
                    "Undecided: the residual is coloured, and the measured velocity shows no noise at all. Is it a measurement, "
                    "or a command or a simulation? Missing dynamics cannot be told from coloured noise here."
                )
            return (
                f"Undecided: the residual is coloured and {self.excess:.1f} times the noise on the measured velocity. "
                "Coloured noise "
                "or missing dynamics; this record cannot tell which, and parameters and standard deviations hold only "
                "if it is noise."
            )
        if self.white_p < LEVEL:
            return (
                "The residual is not white but does not depend on input or motion: coloured noise. The linear model stands; "
                "the standard deviations take the colour into account."
            )
        return "The residual is white: nothing left that this linear model could be blamed for."


def assess(
    residuals: Sequence[Vector],
    J: NDArray[np.float64],
    inputs: Sequence[Vector],
    outputs: Sequence[Vector],
    noise: Autoregression,
    open_loop: bool,
) -> Adequacy:
    """residuals, inputs and simulated outputs per record; J: sensitivities, parameters x all samples.

    open_loop: the input is a torque. It acts from the next sample on, and if a controller made it, it carries the noise of its
    own
    sample: lag 0 would then be correlated with the residual by construction and is left out.
    """
    lengths = [len(e) for e in residuals]
    total = sum(lengths)
    power = sum(float(e @ e) for e in residuals) / total
    white_p = ljung_box(residuals, lags=min(20, total // 5))
    predictable = 1.0 - noise.std**2 / power if power > 0.0 else 0.0
    lags = [k for k in LAGS if k < min(lengths) // 4 and not (open_loop and k == 0)]
    columns = [_joined([_lagged(u, k) for u in inputs], noise.phi) for k in lags]
    columns.append(_joined([np.ones(n) for n in lengths], noise.phi))
    threshold = 0.01 * max(float(np.abs(y).max()) for y in outputs)
    columns.append(_joined([np.where(np.abs(y) > threshold, np.sign(y), 0.0) for y in outputs], noise.phi))
    columns.append(_joined([y * np.abs(y) for y in outputs], noise.phi))
    own = [_joined(_split(row, lengths), noise.phi) for row in J]
    v = _joined(residuals, noise.phi)
    p = independence_p(v, np.array(own), np.array(columns), total - noise.order * len(lengths))
    measured = [y + e for y, e in zip(outputs, residuals, strict=True)]
    quiet = float(np.sqrt(sum(len(w) * noise_std(w) ** 2 for w in measured) / total))
    excess = float(np.sqrt(power)) / quiet if quiet > 0.0 else (0.0 if power == 0.0 else float("inf"))
    falsified = p < LEVEL
    undecided = not falsified and white_p < LEVEL and excess > 2.0
    return Adequacy(white_p, noise.order, noise.std, float(max(predictable, 0.0)), excess, p, falsified, undecided)


def independence_p(v: Vector, own: NDArray[np.float64], extra: NDArray[np.float64], samples: int) -> float:
    """p-value of the F-test that `extra` explains nothing of v beyond `own`."""
    basis = orthonormal_rows(own)
    rest = v - basis.T @ (basis @ v)
    more = extra - (extra @ basis.T) @ basis
    sizes = np.linalg.norm(extra, axis=1)
    keep = np.linalg.norm(more, axis=1) > 1e-6 * np.where(sizes > 0.0, sizes, 1.0)
    if not np.any(keep):
        return 1.0
    directions = orthonormal_rows(more[keep])
    m = len(directions)
    explained = float(np.sum((directions @ rest) ** 2))
    left = float(rest @ rest) - explained
    dof = samples - len(basis) - m
    if dof < 1 or not left > 0.0:
        return 1.0 if not explained > 0.0 else 0.0
    # F(m, dof) by its chi2 limit with the finite-sample correction dof ln(1 + m F / dof).
    return chi2_tail((dof + 0.5 * m) * float(np.log1p(explained / left)), m)


def orthonormal_rows(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """An orthonormal basis of the row space, as rows."""
    sizes = np.linalg.norm(rows, axis=1)
    rows = rows[(sizes > 0.0) & np.isfinite(sizes)]
    if len(rows) == 0:
        return np.zeros((0, rows.shape[1]))
    rows = rows / np.linalg.norm(rows, axis=1)[:, None]
    values, vectors = np.linalg.eigh(rows @ rows.T)
    known = values > 1e-10 * values[-1]
    basis: NDArray[np.float64] = (vectors[:, known] / np.sqrt(values[known])).T @ rows
    return basis


def _lagged(x: Vector, k: int) -> Vector:
    out = np.zeros_like(x)
    out[k:] = x[: len(x) - k]
    return out


def _joined(parts: Sequence[Vector], phi: Vector) -> Vector:
    return np.concatenate([whiten(x, phi) for x in parts])


def _split(row: Vector, lengths: Sequence[int]) -> list[Vector]:
    return np.split(row, np.cumsum(lengths)[:-1])
