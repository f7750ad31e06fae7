"""The structures that an identification compared, and the genetic runs that found them."""

from __future__ import annotations

from dataclasses import dataclass

from gaident.models.model import Model

__all__ = ["Rival", "Structure", "TrialOutcome"]


@dataclass(frozen=True)
class Rival:
    """A structure whose whitened BIC is within 10 units of the winner's.

    Attributes
    ----------
    p : int
        Poles in excess of zeros.
    q : int
        Zeros.
    delta_bic : float
        Whitened BIC minus the winner's; negative: it fits better but is larger.
    model : Model
        The model of this structure that fits best.

    See Also
    --------
    identify : Makes it.
    """

    p: int
    q: int
    delta_bic: float
    model: Model


@dataclass(frozen=True)
class TrialOutcome:
    """One independent genetic run.

    Attributes
    ----------
    p : int
        Poles in excess of zeros of its best candidate.
    q : int
        Zeros of its best candidate.
    fitness : float
        Its best fitness, equation (6).
    generations : int
        How many generations it ran.
    best_generation : int
        The generation that found the best candidate.
    evaluations : int
        Candidates that were simulated.
    history : tuple of float
        Best fitness per generation.

    See Also
    --------
    identify : Makes it.
    """

    p: int
    q: int
    fitness: float
    generations: int
    best_generation: int
    evaluations: int
    history: tuple[float, ...]


@dataclass(frozen=True)
class Structure:
    """One row of the structure comparison.

    Attributes
    ----------
    p : int
        Poles in excess of zeros.
    q : int
        Zeros.
    error_sum : float
        Sum of squared errors of the fit to the measured velocity [rad^2/s^2].
    delta_bic : float
        Whitened BIC minus the lowest.

    See Also
    --------
    identify : Makes it.
    """

    p: int
    q: int
    error_sum: float
    delta_bic: float
