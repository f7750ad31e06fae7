"""The result of `retune`: other gains for a drive, and what they change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar

from gaident.axis import linear_sentences, restored
from gaident.control.cascade import controller_of
from gaident.control.controller import Controller
from gaident.errors import check_schema
from gaident.models.model import Model
from gaident.providers import picture, provided
from gaident.results.saved import SavedResult, undamaged

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["LoopFigures", "Retuning", "RuleStart", "Spread"]

SCHEMA = "gaident/retuning"
SCHEMA_VERSION = 1  # no decision: a format: its version


@dataclass(frozen=True)
class Spread:
    """One figure of a loop, and how far it spreads over the drives that the records leave possible.

    Attributes
    ----------
    value : float
        Of the drive as it was identified, in `unit`.
    low, high : float
        95 % of the drives lie between these, in `unit`.
    unit : str
        The unit; "1" for none.

    Examples
    --------
    >>> import gaident as ga
    >>> ga.Spread(52.1, 50.3, 54.0, "deg").value
    52.1
    """

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class LoopFigures:
    """What a loop does: margins, speed, stiffness, noise.

    Under a position controller overshoot, settling time and stiffness are those of the position loop, without feedforward.
    Limits of the controller take no part.

    Attributes
    ----------
    stable : Spread
        Share of the drives with which the loop is stable [1].
    phase_margin : Spread
        Least one of all crossings of the velocity loop [deg], broken at the torque.
    gain_margin : Spread
        Least factor, upwards or downwards, that makes the velocity loop unstable [dB].
    sensitivity : Spread
        Largest sensitivity of the velocity loop [1].
    bandwidth : Spread
        Velocity command to measured velocity, -3 dB [Hz].
    overshoot : Spread
        Of a step of the command [%].
    settling_time : Spread
        From a step of the command until the answer stays within 5 % [s].
    stiffness : Spread
        Least torque at the shaft that turns it by a radian, of all frequencies [N m/rad].
    step_torque : Spread
        Largest torque of a step of the velocity command of the size `Retuning.step` [N m].
    torque_noise : Spread
        Rms of the torque that the noise of the velocity makes [N m].
    position_phase_margin, position_gain_margin : Spread or None
        Of the position loop [deg], [dB]; None without one.

    See Also
    --------
    retune : Makes them.
    """

    stable: Spread
    phase_margin: Spread
    gain_margin: Spread
    sensitivity: Spread
    bandwidth: Spread
    overshoot: Spread
    settling_time: Spread
    stiffness: Spread
    step_torque: Spread
    torque_noise: Spread
    position_phase_margin: Spread | None = None
    position_gain_margin: Spread | None = None

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> LoopFigures:
        """Return the figures of what `dataclasses.asdict` gave; raises GaidentError where the data are something else."""
        with undamaged("figures of a loop"):
            found: dict[str, Any] = {f.name: None if data[f.name] is None else Spread(**data[f.name]) for f in fields(cls)}
            return cls(**found)


@dataclass(frozen=True)
class RuleStart:
    """Gains of a classical rule, from which the search may begin.

    Attributes
    ----------
    name : str
        The rule.
    kp : float
        Proportional gain [N m s/rad].
    ki : float
        Integral gain [N m/rad].
    keeps : bool
        Whether these gains keep what was asked for.
    stiffness : float
        Of the loop with these gains [N m/rad]; 0 where it is unstable.

    See Also
    --------
    retune : Makes them.
    """

    name: str
    kp: float
    ki: float
    keeps: bool
    stiffness: float


@dataclass(frozen=True, repr=False)
class Retuning(SavedResult):
    """Other gains for an identified drive, and what they change. Made by `retune`.

    Attributes
    ----------
    controller : PI or Cascade
        The proposal, of the same kind as `given`.
    given : PI or Cascade
        The controller before.
    before, after : LoopFigures
        The drive under `given` and under `controller`.
    doubts : tuple of str
        Why the model behind the proposal is not to be trusted; the first lines of the summary.
    phase_margin, gain_margin : float
        What was asked for [deg], [dB].
    torque_limit : float or None
        Largest torque that a step of the command may ask for [N m].
    torque_noise : float or None
        Largest rms of the torque that the noise of the velocity may make [N m].
    step : float
        Size of that step [rad/s].
    holds : float
        Share of the drives in which the proposal keeps the margins [1].
    drives : int
        Number of drives drawn from the covariance; 0 where the result has none, so that nothing is known of the spread.
    rule : str
        Where the search of the proposal began.
    starts : tuple of RuleStart
        The rules that were tried.
    simulated : tuple of str
        What a simulation with all effects found under the proposal, in sentences.
    mended : tuple of tuple
        Cause -> what the loop gains where it is mended: (cause, error of the velocity with it, without it [rad/s]), rms.
    notes : tuple of str
        What to keep in mind, in plain sentences.
    model : Model
        The model behind it.
    period : float
        Sample time of the controller [s].
    velocity_age : float
        See `Diagnosis.velocity_age`.
    noise : float
        Standard deviation of the measured velocity's noise [rad/s].
    seed : int
        The seed.
    axis : {"rotary", "linear"}
        Kind of the axis.
    digests : tuple of str
        Digests of the records behind the model.
    version : str
        Version of gaident.
    records : tuple
        Empty: a retuning has none.

    See Also
    --------
    retune : Makes it, with an example.
    """

    KIND: ClassVar[str] = "retuning"

    controller: Controller
    given: Controller
    before: LoopFigures
    after: LoopFigures
    doubts: tuple[str, ...]
    phase_margin: float
    gain_margin: float
    torque_limit: float | None
    step: float
    holds: float
    drives: int
    rule: str
    starts: tuple[RuleStart, ...]
    simulated: tuple[str, ...]
    mended: tuple[tuple[str, float, float], ...]
    notes: tuple[str, ...]
    model: Model
    period: float
    velocity_age: float
    noise: float
    seed: int
    axis: str = "rotary"
    torque_noise: float | None = None
    digests: tuple[str, ...] = ()
    version: str = ""
    records: tuple[()] = field(default=(), compare=False, repr=False)

    def __repr__(self) -> str:
        kp, ki = self.controller.gains.kp, self.controller.gains.ki
        doubt = "the model is in doubt, " if self.doubts else ""
        return f"<Retuning {doubt}kp {kp:.4g}, ki {ki:.4g}; see summary()>"

    @property
    def keeps(self) -> bool:
        """Whether the proposal keeps all that was asked for."""
        return not self.missed

    @property
    def missed(self) -> tuple[str, ...]:
        """Names of the figures that the identified drive has worse than was asked for."""
        after, found = self.after, []
        if after.stable.value < 1.0:
            found.append("stable")
        found += ["phase_margin"] * (after.phase_margin.value < self.phase_margin)
        found += ["gain_margin"] * (after.gain_margin.value < self.gain_margin)
        if self.torque_limit is not None and after.step_torque.value > self.torque_limit:
            found.append("step_torque")
        if self.torque_noise is not None and after.torque_noise.value > self.torque_noise:
            found.append("torque_noise")
        for name in ("phase_margin", "gain_margin"):
            placed = getattr(after, f"position_{name}")
            found += [f"position_{name}"] * (placed is not None and placed.value < getattr(self, name))
        return tuple(found)

    def summary(self, axis: str | None = None) -> str:
        """Return the result as text: doubts first, then the gains, before and after, and what a simulation found.

        `axis`: "linear" for words and units of m and N, None for those of the axis.
        """
        return str(provided("retuning_summary")(self, self.axis if axis is None else axis))

    def plot(self, axis: str | None = None) -> Figure:
        """Draw the loops and their answers to a step, before and after; `axis`: as `summary` takes it."""
        return picture("plot_retuning", self, self.axis if axis is None else axis)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        sentences = [*self.doubts, *self.simulated, *self.notes]
        return {
            "schema": SCHEMA,
            "schema_version": SCHEMA_VERSION,
            "gaident_version": self.version,
            "controller": self.controller.to_dict(),
            "given": self.given.to_dict(),
            "before": asdict(self.before),
            "after": asdict(self.after),
            **{name: list(getattr(self, name)) for name in ("doubts", "simulated", "notes", "digests")},
            **{name: getattr(self, name) for name in (*ASKED, *FOUND)},
            "starts": [asdict(start) for start in self.starts],
            "mended": [list(row) for row in self.mended],
            "model": self.model.to_dict(),
            "linear_axis": linear_sentences(sentences),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Retuning:
        """Return the retuning of what `to_dict` gave.

        Raises GaidentError where the data are something else or of a newer schema.
        """
        check_schema(data, SCHEMA, SCHEMA_VERSION)
        with undamaged(cls.KIND):
            said: dict[str, Any] = {
                n: tuple(restored(s, data["linear_axis"]) for s in data[n]) for n in ("doubts", "simulated", "notes")
            }
            return cls(
                controller=controller_of(data["controller"]),
                given=controller_of(data["given"]),
                before=LoopFigures.from_dict(data["before"]),
                after=LoopFigures.from_dict(data["after"]),
                starts=tuple(RuleStart(**start) for start in data["starts"]),
                mended=tuple((row[0], row[1], row[2]) for row in data["mended"]),
                model=Model.from_dict(data["model"]),
                digests=tuple(data["digests"]),
                version=data["gaident_version"],
                **{name: data[name] for name in (*ASKED, *FOUND) if name in data},
                **said,
            )


ASKED = ("phase_margin", "gain_margin", "torque_limit", "torque_noise", "step", "seed")
FOUND = ("holds", "drives", "rule", "period", "velocity_age", "noise", "axis")
