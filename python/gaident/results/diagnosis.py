"""The result of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from gaident.axis import linear_sentences, restored
from gaident.control.cascade import controller_of
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.errors import check_schema
from gaident.models.model import Model
from gaident.providers import picture, provided
from gaident.results.estimate import Estimate
from gaident.results.experiment import Proposal
from gaident.results.finding import Bound, Finding, finding_of, where
from gaident.results.fitness import IN_SAMPLE, Comparison, Fitness
from gaident.results.identification import Identification
from gaident.results.inverse_dynamics import InverseDynamics
from gaident.results.relevance import Relevance
from gaident.results.saved import rows_of, undamaged
from gaident.results.what_if import Stability, WhatIf

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Diagnosis"]

SCHEMA = "gaident/diagnosis"
SCHEMA_VERSION = 1  # no decision: a format: its version
WORK = ("seed", "seconds", "simulations", "samples")
PARTS = (
    *("model", "identification", "next_experiment", "controller", "given_controller"),
    *("regression", "linear_model", "relevance", "varied"),
)
SINCE_0_1: Mapping[str, Any] = {
    **{"noise": None, "bootstrap": 0, "torque_logged": False, "loop_follows": True, "velocity_age": 0.0},
    **{"regression_force_error": None, "left_needed": 0.0, "axis": "rotary"},
}
"""Plain fields that files of gaident 0.1.0 may lack -> what they are there."""


@dataclass(frozen=True, repr=False)
class Diagnosis(WhatIf):
    """What the simulation gets wrong, why, and what the extended model gains. Made by `diagnose`.

    Attributes
    ----------
    verdict : {"adequate", "explained", "partly explained", "unexplained"}
        Whether something significant was found, and whether something significant is left.
    findings : tuple of Finding
        What was found, in the order in which it was added.
    not_testable : mapping of str to str
        Effect -> why the records say nothing about it.
    model : Model
        The extended model; the identified linear one where it contains no effect.
    before, after : Fitness
        The linear and the extended model on held-out data.
    driver : str or None
        What the error still depends on: "velocity", "position", "torque", "command", "time", "past" or None.
        Where its gain in `left` is not above `left_needed`, no signal explains what is left, and this one comes closest.
    next_experiment : Proposal or None
        The experiment that would tell apart what these data cannot.
    gain_interval : tuple of float
        95 % interval of the fall of the error from `before` to `after`, as a fraction [1].
    held_out : str
        How the figures of `before` and `after` were held out (see `in_sample` where they could not be).
    base_shift : mapping of str to tuple of float
        Parameter of the linear part -> (before, after).
    linear_model : Model or None
        The linear model of `before`, fitted to all samples; None in files of gaident 0.1.0.
    left : mapping of str to float
        Gain of each driver of what is left [BIC units].
    left_needed : float
        The gain from which on a driver counts [BIC units].
    notes : tuple of str
        What to keep in mind, in plain sentences.
    identification : Identification
        The linear model that the diagnosis began with.
    controller : PI, Cascade or None
        The controller as it was used: with the gains, or of the form, that the logged torque shows.
    given_controller : PI, Cascade or None
        The controller as it was given to `diagnose`; in files of gaident 0.1.0 as it was used.
    seed : int
        The seed.
    seconds : float
        Time that the diagnosis took [s].
    simulations : int
        Simulations that the search made.
    samples : int
        Samples of all records.
    digests : tuple of str
        Digests of the records, see `Record.digest`.
    version : str
        Version of gaident.
    validation_digests : tuple of str
        Digests of the validation records.
    noise : float or None
        Standard deviation of the velocity noise as it was given [rad/s].
    bootstrap : int
        Simulated records of the bootstrap as they were asked for.
    torque_logged : bool
        Whether all records contain the torque.
    loop_follows : bool
        False where the torque does not follow from command and velocity through the simulated controller; its free runs are then
        not the drive's.
    line : tuple of float or None
        Where what is left depends on time and has one frequency: (frequency [Hz], amplitude of the torque [N m]).
    one_sided : mapping of str to str
        Effect that was tested and not found -> which sizes of it would not have shown in these records.
    mechanics : mapping of str to Estimate
        Mechanical parameters of the linear part, fitted together with the effects.
    load_sensor : mapping of str to Estimate
        How a sensor at the load reads it: "scale" of its signal over the load's motion, and "offset" in the record's unit.
        Of several records the offset is that of the first; {} without a sensor.
    not_there : mapping of str to Bound
        Effect that was tested and not found -> how large it may be at most; {} where something significant is left, in files of
        gaident 0.1.0, and of more than 65 536 samples.
    expected : mapping of str to tuple of float
        What was expected of the mechanism, as it was given to `diagnose`: name in `mechanics` -> (lowest, highest), in SI.
    velocity_age : float
        Lines of the log by which the measured velocity is older than the torque: 0.5 where it is an encoder's difference.
    log_shifts : mapping of str to mapping of str to int
        Digest of a record -> channel -> samples by which it was moved, as `Record.shifted` takes them, where the log wrote
        channels on different lines; `as_used` does it again.
    regression : InverseDynamics or None
        The inverse-dynamics regression of the same records, where a torque is logged.
    regression_force_error : float or None
        Its force error on the held-out data [N m].
    comparisons : tuple of Comparison
        What both methods say of the same quantity; a contradiction is one of the notes, too.
    force_reason : str
        Why the force error is the figure to go by here, in words; empty where the free run is as good a figure.
    relevance : Relevance or None
        How large what is left is, and which mechanical values it can have bent; None in files of gaident 0.1.0.
    controller_numbers : mapping of str to Estimate
        What was None of the controller, as the logged torque shows it; names as "kp" or "torque_filters[0].frequency".
    covariance : tuple of tuple of float, or None
        That of the natural parameters of `model`, then of its effects' parameters, in SI; None where the records leave one open.
    axis : {"rotary", "linear"}
        Kind of the axis, as it was given to `diagnose`.
    varied : Stability or None
        What `stability` gave, where it was kept with the result: `gaident diagnose --stability --out` does,
        `dataclasses.replace(dia, varied=dia.stability())` too.
    records, validation_records : tuple of Record
        The data; empty where the diagnosis was loaded from a file.

    See Also
    --------
    diagnose : Makes it, with an example.
    """

    KIND: ClassVar[str] = "diagnosis"

    verdict: str
    findings: tuple[Finding, ...]
    not_testable: Mapping[str, str] = field(hash=False)
    model: Model
    before: Fitness
    after: Fitness
    driver: str | None
    next_experiment: Proposal | None
    gain_interval: tuple[float, float]
    held_out: str
    base_shift: Mapping[str, tuple[float, float]] = field(hash=False)
    left: Mapping[str, float] = field(hash=False)
    notes: tuple[str, ...]
    identification: Identification
    controller: Controller | None
    seed: int
    seconds: float = field(compare=False)
    simulations: int
    samples: int
    digests: tuple[str, ...]
    version: str = ""
    validation_digests: tuple[str, ...] = ()
    noise: float | None = None
    bootstrap: int = 0
    torque_logged: bool = False
    loop_follows: bool = True
    line: tuple[float, float] | None = None
    one_sided: Mapping[str, str] = field(default_factory=dict, hash=False)
    mechanics: Mapping[str, Estimate] = field(default_factory=dict, hash=False)
    load_sensor: Mapping[str, Estimate] = field(default_factory=dict, hash=False)
    velocity_age: float = 0.0
    log_shifts: Mapping[str, Mapping[str, int]] = field(default_factory=dict, hash=False)
    regression: InverseDynamics | None = None
    regression_force_error: float | None = None
    comparisons: tuple[Comparison, ...] = ()
    force_reason: str = ""
    left_needed: float = 0.0
    axis: str = "rotary"
    controller_numbers: Mapping[str, Estimate] = field(default_factory=dict, hash=False)
    relevance: Relevance | None = None
    covariance: tuple[tuple[float, ...], ...] | None = None
    linear_model: Model | None = None
    not_there: Mapping[str, Bound] = field(default_factory=dict, hash=False)
    expected: Mapping[str, tuple[float, float]] = field(default_factory=dict, hash=False)
    varied: Stability | None = None
    given_controller: Controller | None = None
    records: tuple[Record, ...] = field(default=(), compare=False, repr=False)
    validation_records: tuple[Record, ...] = field(default=(), compare=False, repr=False)

    def __repr__(self) -> str:
        named = ", ".join(f"{f.effect} {where(f, self.model)}".rstrip() + ("" if f.named else "?") for f in self.causes)
        return f"<Diagnosis {self.verdict}{': ' + named if named else ''}; see summary()>"

    @property
    def causes(self) -> tuple[Finding, ...]:
        """The findings that describe the drive."""
        return tuple(f for f in self.findings if not f.is_noise)

    @property
    def in_sample(self) -> bool:
        """Whether the figures of `before` and `after` are of the samples that were fitted: none could be held out."""
        return self.held_out == IN_SAMPLE

    def summary(self, axis: str | None = None, units: Mapping[str, str | float] | None = None) -> str:
        """Return the result as text.

        Parameters
        ----------
        axis : {"rotary", "linear"}, optional
            "linear": words and units of m and N, "rotary": of rad and N m; None: those of the axis.
        units : mapping, optional
            Your units, which tables show beside SI, as `report` takes them.

        Returns
        -------
        str
            Verdict, causes, gain, what to measure next, and what could not be tested.
        """
        return str(provided("diagnosis_summary")(self, self.axis if axis is None else axis, units))

    def plot(self, records: Record | Sequence[Record] | None = None, axis: str | None = None) -> Figure:
        """Draw what is wrong and what is left.

        Parameters
        ----------
        records : Record or sequence of Record, optional
            What to draw; None: the records used.
        axis : {"rotary", "linear"}, optional
            "linear": units of m and N; None: those of the axis.

        Returns
        -------
        matplotlib.figure.Figure
            The picture; `savefig` writes it.

        Raises
        ------
        GaidentError
            Where a loaded diagnosis is given no records, or `records` contains something else.
        SettingsError
            For another axis.
        """
        given = self._drawn(records, "plot")
        return picture("plot_diagnosis", self, given, self.axis if axis is None else axis)

    def plot_bode(self, records: Record | Sequence[Record] | None = None, hz: bool = False, axis: str | None = None) -> Figure:
        """Draw the extended model against the frequency response of the longest record, with coherence.

        Friction and other effects change the record's response; the model, simulated and estimated the same way, has them too.

        Parameters
        ----------
        records : Record or sequence of Record, optional
            What the longest is taken of; None: the records used.
        hz : bool
            Frequencies in Hz instead of rad/s.
        axis : {"rotary", "linear"}, optional
            "linear": units of m and N; None: those of the axis.

        Returns
        -------
        matplotlib.figure.Figure
            The picture; see `Identification.plot_bode`.

        Raises
        ------
        GaidentError
            Where a loaded diagnosis is given no records, or `records` contains something else.
        RecordError
            Where they show no frequency response.
        """
        given = self._drawn(records, "plot_bode")
        shown = tuple(map(self.as_used, given))
        return picture("plot_bode", self.model, self.controller, shown, hz, self.axis if axis is None else axis)

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return str(provided("diagnosis_html")(self))

    def to_pandas(self) -> Any:
        """Return the findings as a pandas DataFrame: a row per (effect, parameter), with what speaks for it.

        Raises ImportError with the way to get pandas.
        """
        return provided("diagnosis_table")(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON, without the records."""
        return {
            "schema": SCHEMA,
            "schema_version": SCHEMA_VERSION,
            "gaident_version": self.version,
            "verdict": self.verdict,
            "findings": [
                {**asdict(f), "parameters": {n: asdict(e) for n, e in f.parameters.items()}, "alternatives": list(f.alternatives)}
                for f in self.findings
            ],
            "not_testable": dict(self.not_testable),
            "before": asdict(self.before),
            "after": asdict(self.after),
            "driver": self.driver,
            **{name: None if (part := getattr(self, name)) is None else part.to_dict() for name in PARTS},
            "gain_interval": list(self.gain_interval),
            "held_out": self.held_out,
            "base_shift": {n: list(v) for n, v in self.base_shift.items()},
            "left": dict(self.left),
            "notes": list(self.notes),
            **{name: getattr(self, name) for name in (*WORK, *SINCE_0_1)},
            **{name: list(getattr(self, name)) for name in ("digests", "validation_digests")},
            "line": None if self.line is None else list(self.line),
            "one_sided": dict(self.one_sided),
            "not_there": {effect: asdict(bound) for effect, bound in self.not_there.items()},
            "expected": {name: list(of) for name, of in self.expected.items()},
            "log_shifts": {digest: dict(moves) for digest, moves in self.log_shifts.items()},
            "mechanics": {n: asdict(e) for n, e in self.mechanics.items()},
            "load_sensor": {n: asdict(e) for n, e in self.load_sensor.items()},
            "comparisons": [asdict(c) for c in self.comparisons],
            "force_reason": self.force_reason,
            "controller_numbers": {name: asdict(e) for name, e in self.controller_numbers.items()},
            "covariance": None if self.covariance is None else [list(row) for row in self.covariance],
            "linear_axis": linear_sentences(self._sentences()),
        }

    def _sentences(self) -> list[str]:
        """Everything that is said in words."""
        told = [*self.notes, *(f.evidence for f in self.findings), *self.not_testable.values(), *self.one_sided.values()]
        return [*told, self.force_reason]

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Diagnosis:
        """Return the diagnosis of what `to_dict` gave.

        Raises GaidentError where the data are something else or of a newer schema.
        """
        check_schema(data, SCHEMA, SCHEMA_VERSION)
        with undamaged(cls.KIND):
            linear = data.get("linear_axis", {})  # files of gaident 0.1.0 lack it: their sentences are those of a rotary axis
            return cls(
                verdict=data["verdict"],
                findings=tuple(finding_of(f, linear) for f in data["findings"]),
                not_testable={effect: restored(why, linear) for effect, why in data["not_testable"].items()},
                model=Model.from_dict(data["model"]),
                before=Fitness(**data["before"]),
                after=Fitness(**data["after"]),
                driver=data["driver"],
                next_experiment=None if data["next_experiment"] is None else Proposal.from_dict(data["next_experiment"]),
                gain_interval=(data["gain_interval"][0], data["gain_interval"][1]),
                held_out=data["held_out"],
                base_shift={n: (v[0], v[1]) for n, v in data["base_shift"].items()},
                left=data["left"],
                notes=tuple(restored(note, linear) for note in data["notes"]),
                identification=Identification.from_dict(data["identification"]),
                controller=_controller(data["controller"]),
                given_controller=_controller(data.get("given_controller", data["controller"])),
                **{name: data[name] for name in WORK},
                **{name: data.get(name, lacking) for name, lacking in SINCE_0_1.items()},
                digests=tuple(data["digests"]),
                version=data["gaident_version"],
                # Files of gaident 0.1.0 may lack these.
                validation_digests=tuple(data.get("validation_digests", ())),
                line=None if data.get("line") is None else (data["line"][0], data["line"][1]),
                log_shifts=data.get("log_shifts", {}),
                one_sided={effect: restored(sizes, linear) for effect, sizes in data.get("one_sided", {}).items()},
                mechanics={n: Estimate(**e) for n, e in data.get("mechanics", {}).items()},
                load_sensor={n: Estimate(**e) for n, e in data.get("load_sensor", {}).items()},
                regression=None if data.get("regression") is None else InverseDynamics.from_dict(data["regression"]),
                comparisons=tuple(map(Comparison.from_dict, data.get("comparisons", ()))),
                force_reason=restored(data.get("force_reason", ""), linear),
                not_there={effect: Bound(**bound) for effect, bound in data.get("not_there", {}).items()},
                expected={name: (of[0], of[1]) for name, of in data.get("expected", {}).items()},
                relevance=None if data.get("relevance") is None else Relevance.from_dict(data["relevance"]),
                covariance=rows_of(data.get("covariance")),
                linear_model=None if data.get("linear_model") is None else Model.from_dict(data["linear_model"]),
                varied=None if data.get("varied") is None else Stability.from_dict(data["varied"]),
                controller_numbers={name: Estimate(**e) for name, e in data.get("controller_numbers", {}).items()},
            )


def _controller(data: Mapping[str, Any] | None) -> Controller | None:
    return None if data is None else controller_of(data)
