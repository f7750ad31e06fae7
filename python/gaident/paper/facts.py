"""What the paper prints: the numbers of its tables, as copied facts; and the two loop-gain factors of Table V.

GA-Based Evolutionary Identification Algorithm for Unknown Structured Mechatronic Systems, IEEE Transactions on Industrial
Electronics (presented at IECON 2000).
"""

from __future__ import annotations

from dataclasses import dataclass

from gaident.control.pi import PI
from gaident.models.mechanics import OneMass, TwoMass
from gaident.models.model import Model

DT = 0.444e-3  # Ts [s], Table III
SAMPLES = 250  # S of equation (6)
STEP = 43.6  # velocity command [rad/s]
KP, KI = 0.0232, 1.367  # K_PV [N m s/rad], K_IV [N m/rad], Table III
ERROR_WEIGHT, ORDER_WEIGHT = 1.0, 2.0  # Wf1, Wf2
TRIALS = 20  # of Fig. 7
GENERATIONS = 1000
SECONDS_PER_GENERATION, SECONDS = 30e-3, 30.0  # on a TMS320C30 at 33 MHz: "within"

# Not printed: the factors on the loop gain with which Table IV's identified models give Table V. Least squares over the alphas;
# over all coefficients it would be 1.6734 and 5.5620, with deviations of at most 3e-5 instead of 8e-5 of the largest.
LOOP_GAIN_FACTORS = {"one": 1.6744, "two": 5.5637}


def pair(re: float, im: float) -> list[complex]:
    """A conjugate pair of roots -A as the paper prints A = re +- i im."""
    return [complex(-re, im), complex(-re, -im)]


@dataclass(frozen=True)
class Mechanism:
    """One of the paper's two drives: what Tables III, IV and V say of it."""

    key: str  # "one" or "two"
    title: str
    sheet: OneMass | TwoMass  # Table III
    nominal: Model  # Table IV, nominal column
    identified: Model  # Table IV, identified column
    nominal_mechanics: dict[str, str]  # Table IV, as printed
    identified_mechanics: dict[str, str]
    fitness: tuple[float, float]  # nominal, identified
    proposed: tuple[tuple[float, ...], tuple[float, ...]]  # Table V: alpha, beta
    conventional: tuple[tuple[float, ...], tuple[float, ...]]

    @property
    def order(self) -> int:
        """N of equation (7)."""
        return len(self.proposed[1])

    @property
    def words(self) -> str:
        """What tables call it."""
        return {"one": "one mass", "two": "two masses"}[self.key]

    @property
    def names(self) -> tuple[str, ...]:
        """The mechanical parameters' names in the package."""
        return ("J", "D") if isinstance(self.sheet, OneMass) else ("JM", "DM", "JL", "DL", "KG")

    def controller(self, loop: str = "continuous") -> PI:
        """The PI with the printed gains."""
        return PI(kp=KP, ki=KI, loop=loop)

    def scaled_controller(self, loop: str = "continuous") -> PI:
        """The PI with which Table V follows from Table IV."""
        factor = LOOP_GAIN_FACTORS[self.key]
        return PI(kp=KP * factor, ki=KI * factor, loop=loop)


ONE_MASS = Mechanism(
    "one",
    "one-mass rigid system",
    OneMass(J=1.02e-4, D=0.003),
    Model(9813.54, [-29.44]),
    Model(6278.26, [-34.13]),
    {"J": "1.02e-4", "D": "0.30e-2"},
    {"J": "1.59e-4", "D": "0.54e-2"},
    (124.6, 58.7),
    ((0.051627, 0.001330, -0.050297), (1.881221, -0.883881)),
    ((0.056245, 0.001449, -0.054796), (1.868881, -0.871779)),
)
TWO_MASSES = Mechanism(
    "two",
    "two-mass resonant system",
    TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59),
    Model(9813.54, [-16.11, *pair(13.54, 172.2)], pair(6.88, 66.35)),
    Model(6545.29, [-15.41, *pair(10.30, 150.9)], pair(4.26, 93.98)),
    {"JM": "1.02e-4", "DM": "0.30e-2", "JL": "5.82e-4", "DL": "0.80e-2", "KG": "2.59"},
    {"JM": "1.53e-4", "DM": "0.42e-2", "JL": "2.21e-4", "DL": "0.19e-2", "KG": "1.96"},
    (215.2, 102.8),
    ((0.158765, -0.312558, -0.004672, 0.312565, -0.154086), (3.660535, -4.995487, 3.008738, -0.673800)),
    ((0.166901, -0.328939, -0.004631, 0.328945, -0.162264), (3.644657, -4.947453, 2.960446, -0.657661)),
)
MECHANISMS = (ONE_MASS, TWO_MASSES)
