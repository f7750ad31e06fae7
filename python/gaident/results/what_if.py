"""What a diagnosis can be asked: what the drive would do without an effect, and whether its causes are named again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.errors import GaidentError, SettingsError
from gaident.models.drive_torque import as_read, driven_by
from gaident.models.model import Model
from gaident.models.simulate import Run
from gaident.providers import provided
from gaident.results.estimate import Estimate
from gaident.results.saved import SavedResult, given_record, undamaged

__all__ = ["Stability", "Variation", "WhatIf"]

NAMED, POSSIBLE, NOT_NAMED, HIDDEN = "named", "possible", "not named", "could not show"


@dataclass(frozen=True)
class Variation:
    """What a diagnosis of varied records says.

    Attributes
    ----------
    what : str
        What was varied.
    verdict : str
        Verdict; "" where it could not be diagnosed.
    causes : tuple of tuple of str
        Of each cause its name, then those from which it is not told apart.
    hidden : tuple of str
        Effects that these records cannot show.
    refused : str
        Why it could not be diagnosed, else "".
    sizes : mapping of str to Estimate
        Cause -> its first parameter, the size of most of them.
    """

    what: str
    verdict: str
    causes: tuple[tuple[str, ...], ...] = ()
    hidden: tuple[str, ...] = ()
    refused: str = ""
    sizes: Mapping[str, Estimate] = field(default_factory=dict, hash=False)

    def says(self, causes: Sequence[str]) -> str:
        """ "named", "possible" (among others), "not named" or "could not show".

        causes: one, or several that are not told apart.
        """
        wanted = set(causes)
        found = [set(names) for names in self.causes]
        if any(names <= wanted for names in found):
            return NAMED
        if any(names & wanted for names in found):
            return POSSIBLE
        return HIDDEN if self.refused or wanted <= set(self.hidden) else NOT_NAMED


@dataclass(frozen=True)
class Stability:
    """How often the causes of a diagnosis are named when its records are varied, see `Diagnosis.stability`.

    Attributes
    ----------
    verdict : str
        Of the diagnosis.
    causes : tuple of tuple of str
        Of each cause of the diagnosis its name, then those from which it is not told apart.
    variations : tuple of Variation
        What was varied, and what was found.
    axis : {"rotary", "linear"}
        Kind of the axis.
    """

    verdict: str
    causes: tuple[tuple[str, ...], ...]
    variations: tuple[Variation, ...]
    axis: str = "rotary"

    def named(self, cause: str) -> tuple[int, int]:
        """(how many variations name a cause of the diagnosis again, how many could show it).

        Raises SettingsError for what is no cause of the diagnosis.
        """
        names = next((names for names in self.causes if names[0] == cause), None)
        if names is None:
            known = ", ".join(names[0] for names in self.causes) or "none"
            raise SettingsError(f"cause is {cause!r}: the causes of this diagnosis are {known}")
        said = [v.says(names) for v in self.variations]
        return said.count(NAMED), len(said) - said.count(HIDDEN)

    @property
    def others(self) -> dict[str, int]:
        """Causes of variations that the diagnosis has not -> in how many variations they are named."""
        own = {name for names in self.causes for name in names}
        found = [set().union(*(names[:1] for names in v.causes)) - own for v in self.variations]
        return {name: sum(name in names for names in found) for name in sorted(set().union(*found))}

    @property
    def sentences(self) -> tuple[str, ...]:
        """What it says, a sentence for each cause."""
        done = sum(not v.refused for v in self.variations)
        same = sum(v.verdict == self.verdict for v in self.variations)
        text = [f"Verdict {self.verdict} in {same} of {done} variations of the records."]
        for names in self.causes:
            again, of = self.named(names[0])
            possible = [v.says(names) for v in self.variations].count(POSSIBLE)
            more = f", in {possible} more not told apart from others" if possible else ""
            doubt = ": a hint, and no cause to act on" if of and 2 * again <= of else ""
            text.append(f"{' or '.join(names)}: named in {again} of {of} variations that could show it{more}{doubt}.")
        text += [f"{name}: named in {count} of them, and not in the records as they are." for name, count in self.others.items()]
        return tuple(text)

    @property
    def rows(self) -> tuple[tuple[str, str, str], ...]:
        """(what was varied, verdict, causes), a row for each variation."""
        return tuple(
            (v.what, v.verdict or "not diagnosed", v.refused or ", ".join(" or ".join(names) for names in v.causes) or "none")
            for v in self.variations
        )

    def summary(self) -> str:
        """Return it as text."""
        text: str = provided("stability_summary")(self)
        return text

    def __str__(self) -> str:
        return self.summary()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        variations = [{**asdict(v), "causes": list(map(list, v.causes)), "hidden": list(v.hidden)} for v in self.variations]
        return {"verdict": self.verdict, "causes": list(map(list, self.causes)), "variations": variations, "axis": self.axis}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Stability:
        """The inverse of `to_dict`. Raises GaidentError where the data are something else."""
        with undamaged("stability"):
            return cls(
                data["verdict"],
                tuple(map(tuple, data["causes"])),
                tuple(
                    Variation(
                        v["what"],
                        v["verdict"],
                        tuple(map(tuple, v["causes"])),
                        tuple(v["hidden"]),
                        v["refused"],
                        {name: Estimate(**e) for name, e in v["sizes"].items()},
                    )
                    for v in data["variations"]
                ),
                data["axis"],
            )


class WhatIf(SavedResult):
    """A result with a model whose effects can be taken out."""

    model: Model
    controller: Controller | None
    velocity_age: float
    log_shifts: Mapping[str, Mapping[str, int]]

    def as_used(self, rec: Record) -> Record:
        """Return a record as the diagnosis used it.

        That is without the shifts of its log, see `log_shifts`, and with the times at which its command jumped between its lines.
        Without a bare PI its torque is then the one that drove the motor over each line, see docs/controllers.md.

        Parameters
        ----------
        rec : Record
            A record that was given to `diagnose`, or another one of the same loop.

        Returns
        -------
        Record
            The same, or one with its channels moved and its torque and velocity changed.

        Raises
        ------
        RecordError
            Where no torque is logged and this controller makes none of what is.
        """
        rec = provided("timed_record")(as_read(given_record(rec), self.controller, self.log_shifts), self.controller)
        return rec if self.controller is None or self.controller.one_equation else driven_by(rec, self.controller)

    def simulate_without(self, effect: str, rec: Record | None = None, *, side: str | None = None) -> Run:
        """Simulate the drive as it would be with one cause mended.

        Parameters
        ----------
        effect : str
            Name of the effect that is taken out of `model`.
        rec : Record, optional
            Record whose command, or torque in the open loop, drives it; None: the first of the records used.
        side : {"motor", "load"}, optional
            The side where it is taken out; None: wherever it is.

        Returns
        -------
        Run
            Velocity, torque and position under `controller`, from rest; the velocity as the sensor shows it, `velocity_age` old.

        Raises
        ------
        GaidentError
            Where the model has no such effect, and where a loaded result is given no record.
        """
        if rec is not None and not isinstance(rec, Record):
            raise GaidentError(f"rec is {type(rec).__name__}: give a gaident.Record")
        if rec is None and not self.records:
            raise GaidentError(f"records: a loaded {self.KIND} contains no data; give simulate_without({effect!r}, rec)")
        mended, rec = self.model.without_effect(effect, side=side), self.records[0] if rec is None else rec
        found: Run = provided("run_as_seen")(mended, rec, self.controller, self.velocity_age)
        return found

    def stability(
        self,
        records: Record | Sequence[Record] | None = None,
        pitch: float | None = None,
        progress: Callable[[float, str], None] | None = None,
    ) -> Stability:
        """Diagnose variations of the records, and count how often the same causes are named.

        The variations are the first, the middle and the second half of each record, half as many lines, one per cent of noise on
        the velocity (where no logged torque would have to follow from it), and two other seeds.
        It takes some eight times as long as the diagnosis.

        Parameters
        ----------
        records : Record or sequence of Record, optional
            The records of the diagnosis; None: those that it has.
        pitch : float, optional
            As it was given to `diagnose` [m].
        progress : callable, optional
            Called now and then with (fraction done, message), see `gaident.progress`.

        Returns
        -------
        Stability
            What each variation says; `summary()` is text.

        Raises
        ------
        GaidentError
            Where a loaded diagnosis is given no records, or `records` contains something else.
        SettingsError
            For a pitch that is no length, and a progress that cannot be called.
        """
        found: Stability = provided("stability")(self, self._drawn(records, "stability"), pitch, progress)
        return found
