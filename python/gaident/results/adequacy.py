"""Whether a linear model holds, and the sentence that says so."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gaident.policy.table import POLICY

__all__ = ["Adequacy"]


@dataclass(frozen=True)
class Adequacy:
    """What the residual says about a linear model.

    Attributes
    ----------
    white_p : float
        Ljung-Box p-value of the residual.
    ar_order : int
        Order of the autoregressive noise model.
    noise_std : float
        Standard deviation of the whitened residual [rad/s].
    predictable : float
        Share of the residual's power that its own past predicts [1]; 0: white.
    excess : float
        Root mean square of the residual over that of the noise, which the measured velocity's third differences show [1].
    independence_p : float
        p-value of the test that the residual does not depend on input and motion.
    falsified : bool
        Whether it does.
    undecided : bool
        Whether it does not, but is coloured and more than twice the noise, so that dynamics may be missing.
    of : {"record", "response"}
        What the model was held against.
        Of a frequency response the tests are over its frequencies: white_p and predictable of neighbouring ones, excess over the
        stated deviations, independence_p that errors are as large as stated, noise_std their size in those deviations.

    See Also
    --------
    identify : Makes it.
    """

    white_p: float
    ar_order: int
    noise_std: float
    predictable: float
    excess: float
    independence_p: float
    falsified: bool
    undecided: bool
    of: str = "record"

    @property
    def sentence(self) -> str:
        """What it means, in words."""
        if self.of == "response":
            return self._of_response
        if self.falsified:
            return (
                "The linear model is falsified: the residual still depends on the input or the motion "
                f"(p = {self.independence_p:.1g}), and its own past predicts {100 * self.predictable:.0f} % of its power. "
                "Do not trust the mechanical parameters; an effect that is not in the model biases them."
            )
        if self.undecided:
            if not math.isfinite(self.excess):
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
        if self.white_p < POLICY.test_level:
            return (
                "The residual is not white but does not depend on input or motion: coloured noise. The linear model stands; "
                "the standard deviations take the colour into account."
            )
        return "The residual is white: nothing left that this linear model could be blamed for."

    @property
    def _of_response(self) -> str:
        if self.falsified:
            large = f" and is {self.excess:.3g} times the stated deviations" if self.excess != 1.0 else ""
            return (
                "The linear model is falsified: what it leaves of the frequency response goes on from frequency to frequency "
                f"(p = {self.white_p:.1g}){large}. "
                "Do not trust the mechanical parameters; something is missing: another mass, a lag, a delay, an axis that is not "
                "linear, or a record beside it that is of another axis or in other units."
            )
        if self.white_p < POLICY.test_level:
            return (
                "What the model leaves goes on from frequency to frequency, but is not larger than the stated deviations: the "
                "measurement's neighbouring errors are alike. The linear model stands."
            )
        return (
            "What the model leaves of the frequency response is noise: nothing left that this linear model could be blamed for."
        )
