"""The result of an identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gaident.axis import linear_sentences, restored
from gaident.control.cascade import controller_of
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.data.frequency.response import FrequencyResponse
from gaident.data.record import Record
from gaident.errors import GaidentError, check_schema
from gaident.models.drive_torque import as_differenced, as_old_as_its_velocity, without_age
from gaident.models.mechanics import Mechanics, mechanics_from_dict
from gaident.models.model import Model
from gaident.models.search_space import SearchSpace
from gaident.models.simulate import initial_state, simulate
from gaident.models.starts import starts_moving
from gaident.providers import picture, provided
from gaident.results.adequacy import Adequacy
from gaident.results.estimate import Estimate, check_complete
from gaident.results.saved import SavedResult, given_record, rows_of, undamaged
from gaident.results.settings import Settings
from gaident.results.structures import Rival, Structure, TrialOutcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Identification"]

SCHEMA = "gaident/identification"
SCHEMA_VERSION = 1  # no decision: a format: its version


@dataclass(frozen=True, repr=False)
class Identification(SavedResult):
    """Structure, parameters and what they are worth. Made by `identify`.

    Attributes
    ----------
    model : Model
        The model that was found.
    controller : PI, Cascade or None
        The loop that was simulated; None: open loop, where the torque drives the model.
    parameters : mapping of str to Estimate
        Natural parameters of the model by name, see `factor_parameters`.
    mechanics : OneMass, TwoMass or None
        The mechanism, where the structure is that of one.
    fitness : float
        Fitness of the model, equation (6).
    rmse : float
        Root mean square of the error of the free-run simulation of all records used [rad/s].
    fit_percent : float
        100 (1 - norm(error)/norm(velocity - mean velocity)) of the same simulation [%].
    rivals : tuple of Rival
        Structures within 10 BIC units.
    structures : tuple of Structure
        Every structure that was fitted, compared.
    trials : tuple of TrialOutcome
        The independent genetic runs.
    adequacy : Adequacy
        Whether the linear model holds.
    warnings : tuple of str
        What to keep in mind, in plain sentences.
    space : SearchSpace
        The search ranges as they were used.
    settings : Settings
        The settings of the search.
    seed : int
        The seed.
    seconds : float
        Time that the identification took [s].
    samples : int
        Samples of all records.
    digests : tuple of str
        Digests of the records, see `Record.digest`.
    initial_states : mapping of str to tuple of float
        Digest -> initial state of a record that did not start at rest.
    controller_numbers : mapping of str to Estimate
        What was None of the controller, as the logged torque shows it; names as "kp" or "torque_filters[0].frequency".
    covariance : tuple of tuple of float, or None
        Covariance of the natural parameters, in the order and units of `factor_parameters(model)`, then of the parameters of its
        effects in SI; None where the data leave one open.
    version : str
        Version of gaident.
    records : tuple of Record
        The data; empty where the identification was loaded from a file.
    frequencies : int
        Frequencies of all responses. Of responses alone `samples` is 0 and `rmse` that of the relative error [1].
    delay, lag : Estimate or None
        Of the torque's path [s], which frequency responses contain; None: none was needed. They are effects of `model`, too.
    unseen_above : float or None
        Frequency [Hz] above which a resonance would not have shown: where log or responses end; None: an older result.
    response_digests : tuple of str
        Digests of the frequency responses, see `FrequencyResponse.digest`.
    responses : tuple of FrequencyResponse
        The frequency responses; empty where the identification was loaded from a file.

    See Also
    --------
    identify : Makes it, with an example.
    """

    KIND: ClassVar[str] = "identification"

    model: Model
    controller: Controller | None
    parameters: Mapping[str, Estimate] = field(hash=False)
    mechanics: Mechanics | None
    fitness: float
    rmse: float
    fit_percent: float
    rivals: tuple[Rival, ...]
    structures: tuple[Structure, ...]
    trials: tuple[TrialOutcome, ...]
    adequacy: Adequacy
    warnings: tuple[str, ...]
    space: SearchSpace
    settings: Settings
    seed: int
    seconds: float = field(compare=False)
    samples: int
    digests: tuple[str, ...]
    initial_states: Mapping[str, tuple[float, ...]] = field(hash=False)
    version: str = ""
    controller_numbers: Mapping[str, Estimate] = field(default_factory=dict, hash=False)
    covariance: tuple[tuple[float, ...], ...] | None = None
    records: tuple[Record, ...] = field(default=(), compare=False, repr=False)
    frequencies: int = 0
    delay: Estimate | None = None
    lag: Estimate | None = None
    unseen_above: float | None = None
    response_digests: tuple[str, ...] = ()
    responses: tuple[FrequencyResponse, ...] = field(default=(), compare=False, repr=False)

    def __repr__(self) -> str:
        verdict = "falsified" if self.falsified else "undecided" if self.adequacy.undecided else "stands"
        return f"<Identification ({self.p},{self.q}), fit {self.fit_percent:.2f} %, linear model {verdict}; see summary()>"

    @property
    def p(self) -> int:
        """Poles in excess of zeros."""
        return self.model.p

    @property
    def q(self) -> int:
        """Zeros."""
        return self.model.q

    @property
    def path(self) -> dict[str, Estimate]:
        """`delay` and `lag`, of those that were found."""
        return {name: e for name, e in (("delay", self.delay), ("lag", self.lag)) if e is not None}

    @property
    def history(self) -> tuple[float, ...]:
        """Best fitness per generation of the genetic search, equation (6), of the best trial."""
        return min(self.trials, key=lambda t: t.fitness).history

    @property
    def of_responses(self) -> bool:
        """Whether it was made from frequency responses alone, without a record."""
        return bool(self.response_digests) and not self.digests

    @property
    def falsified(self) -> bool:
        """Whether the data contradict the linear model; its mechanics are then not to be trusted."""
        return self.adequacy.falsified

    def as_used(self, rec: Record) -> Record:
        """Return a record as an identification under this controller takes it.

        It is another one where the velocity is a plain difference of the logged positions: in a simulated loop the velocity is
        then the difference over two lines; else it is that of the last two, and the torque is as late.
        `records` and `digests` are of the records as they were used.

        Parameters
        ----------
        rec : Record
            Any record as it was logged, or one of `records`.

        Returns
        -------
        Record
            The same, or one with another velocity and torque.
        """
        if given_record(rec).digest in self.digests:
            return rec
        if bare_pi(self.controller) is not None:
            return without_age(rec)
        every = 1 if self.controller is None else self.controller.log_every(rec.dt)
        return as_old_as_its_velocity(as_differenced(rec, self.controller), every)

    def simulate(self, rec: Record) -> NDArray[np.float64]:
        """Return the free-run velocity of the model on a record [rad/s], shape (n,), beside that of `as_used`.

        A record that was used in the identification starts from the state found there.
        Another one that does not start at rest gets its initial state estimated.
        Raises GaidentError where that is impossible, because the controller has limits.
        """
        rec = self.as_used(rec)
        state: Sequence[float] | NDArray[np.float64] | None = self.initial_states.get(rec.digest)
        unseen = rec.digest not in self.digests and self.settings.initial_state != "rest"
        if state is None and unseen and starts_moving(rec, self.controller):
            if self.controller is not None and not self.controller.one_equation:
                raise GaidentError(
                    "rec starts in motion, and the initial state of a cascade cannot be estimated; use a record from rest"
                )
            if self.controller is not None and self.controller.limited:
                raise GaidentError(
                    "rec starts in motion and the controller has limits: its initial state cannot be estimated; use a record "
                    "from rest, or gaident.simulate(idn.model, rec, controller, initial_state=...)"
                )
            state = initial_state(self.model, rec, self.controller)
        return simulate(self.model, rec, self.controller, state)

    def residual(self, rec: Record) -> NDArray[np.float64]:
        """Return measured minus simulated velocity [rad/s], shape (n,)."""
        simulated = self.simulate(rec)  # which looks at `rec`
        return self.as_used(rec).velocity - simulated

    def summary(self, axis: str = "rotary", units: Mapping[str, str | float] | None = None) -> str:
        """Return the result as text.

        Parameters
        ----------
        axis : {"rotary", "linear"}
            "linear": units of m and N.
        units : mapping, optional
            Your units, which are shown beside SI, as `report` takes them.

        Returns
        -------
        str
            What was found, and what it is worth.
        """
        text: str = provided("identification_summary")(self, axis, units)
        return text

    def plot(self, records: Record | Sequence[Record] | None = None, axis: str = "rotary") -> Figure:
        """Draw measured against simulated velocity and the residual; of frequency responses alone as `plot_bode`.

        Parameters
        ----------
        records : Record or sequence of Record, optional
            What to draw; None: the records used.
        axis : {"rotary", "linear"}
            "linear": units of m and N.

        Returns
        -------
        matplotlib.figure.Figure
            The picture; `savefig` writes it.

        Raises
        ------
        GaidentError
            Where a loaded identification is given no records, or `records` contains something else.
        """
        if records is None and self.responses and not self.records:
            return self.plot_bode(hz=True, axis=axis)
        return picture("plot_identification", self, self._drawn(records, "plot"), axis=axis)

    def plot_bode(self, records: Record | Sequence[Record] | None = None, hz: bool = False, axis: str = "rotary") -> Figure:
        """Draw the model against the frequency response of the longest record, with coherence.

        In a loop with a command it is estimated by the command (joint input-output), else from torque to velocity (H1).
        An identification of frequency responses shows these.
        A loaded identification without records shows the model alone.

        Parameters
        ----------
        records : Record or sequence of Record, optional
            What the longest is taken of; None: the records used.
        hz : bool
            Frequencies in Hz instead of rad/s.
        axis : {"rotary", "linear"}
            "linear": units of m and N.

        Returns
        -------
        matplotlib.figure.Figure
            The picture.

        Raises
        ------
        GaidentError
            Where `records` contains something else than records.
        RecordError
            Where the record shows no frequency response.
        """
        if records is None and self.responses:
            return picture("plot_frequency_response", self.responses, self.model, hz, axis)
        return picture("plot_bode", self.model, self.controller, self._chosen(records), hz, axis)

    def plot_poles(self, hz: bool = False) -> Figure:
        """Draw poles and zeros in the s-plane with bars of 2 standard deviations [rad/s]; hz: divided by 2 pi [Hz]."""
        return picture("plot_poles_zeros", self, hz)

    def plot_convergence(self) -> Figure:
        """Draw the best fitness per generation of every trial, equation (6)."""
        return picture("plot_convergence", self)

    def plot_structures(self) -> Figure:
        """Draw the BIC of every structure (p, q) above the lowest."""
        return picture("plot_structures", self)

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        html: str = provided("identification_html")(self)
        return html

    def to_pandas(self) -> Any:
        """Return the parameters as a pandas DataFrame: rows (model, path or mechanics, parameter), columns value, std, unit, ...

        Raises ImportError with the way to get pandas.
        """
        return provided("identification_table")(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON, without the records."""
        return {
            "schema": SCHEMA,
            "schema_version": SCHEMA_VERSION,
            "gaident_version": self.version,
            "p": self.p,
            "q": self.q,
            "falsified": self.falsified,
            "model": self.model.to_dict(),
            "controller": None if self.controller is None else self.controller.to_dict(),
            "parameters": {name: asdict(e) for name, e in self.parameters.items()},
            "mechanics": None if self.mechanics is None else self.mechanics.to_dict(),
            "fitness": self.fitness,
            "rmse": self.rmse,
            "fit_percent": self.fit_percent,
            "rivals": [{"p": r.p, "q": r.q, "delta_bic": r.delta_bic, "model": r.model.to_dict()} for r in self.rivals],
            "structures": [asdict(s) for s in self.structures],
            "trials": [asdict(t) for t in self.trials],
            "adequacy": asdict(self.adequacy),
            "warnings": list(self.warnings),
            "space": self.space.to_dict(),
            "settings": self.settings.to_dict(),
            "seed": self.seed,
            "seconds": self.seconds,
            "samples": self.samples,
            "digests": list(self.digests),
            "frequencies": self.frequencies,
            "unseen_above": self.unseen_above,
            **{name: None if e is None else asdict(e) for name, e in (("delay", self.delay), ("lag", self.lag))},
            "response_digests": list(self.response_digests),
            "initial_states": {d: list(s) for d, s in self.initial_states.items()},
            "controller_numbers": {name: asdict(e) for name, e in self.controller_numbers.items()},
            "covariance": None if self.covariance is None else [list(row) for row in self.covariance],
            "linear_axis": linear_sentences(self.warnings),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Identification:
        """Return the identification of what `to_dict` gave.

        Raises GaidentError where the data are something else or of a newer schema.
        """
        check_schema(data, SCHEMA, SCHEMA_VERSION)
        with undamaged(cls.KIND):
            check_complete(data["parameters"])
            return cls(
                model=Model.from_dict(data["model"]),
                controller=None if data["controller"] is None else controller_of(data["controller"]),
                parameters={name: Estimate(**e) for name, e in data["parameters"].items()},
                mechanics=None if data["mechanics"] is None else mechanics_from_dict(data["mechanics"]),
                fitness=data["fitness"],
                rmse=data["rmse"],
                fit_percent=data["fit_percent"],
                rivals=tuple(Rival(r["p"], r["q"], r["delta_bic"], Model.from_dict(r["model"])) for r in data["rivals"]),
                structures=tuple(Structure(**s) for s in data["structures"]),
                trials=tuple(TrialOutcome(**{**t, "history": tuple(t["history"])}) for t in data["trials"]),
                adequacy=Adequacy(**data["adequacy"]),
                warnings=tuple(restored(w, data.get("linear_axis", {})) for w in data["warnings"]),
                space=SearchSpace.from_dict(data["space"]),
                settings=Settings.from_dict(data["settings"]),
                seed=data["seed"],
                seconds=data["seconds"],
                samples=data["samples"],
                digests=tuple(data["digests"]),
                initial_states={d: tuple(s) for d, s in data["initial_states"].items()},
                version=data["gaident_version"],
                controller_numbers={name: Estimate(**e) for name, e in data.get("controller_numbers", {}).items()},
                covariance=rows_of(data.get("covariance")),
                frequencies=data.get("frequencies", 0),
                unseen_above=data.get("unseen_above"),
                delay=Estimate(**data["delay"]) if data.get("delay") else None,
                lag=Estimate(**data["lag"]) if data.get("lag") else None,
                response_digests=tuple(data.get("response_digests", ())),
            )
