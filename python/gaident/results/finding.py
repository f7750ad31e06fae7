"""One thing that a diagnosis found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gaident.axis import restored
from gaident.models.effect_rows import end_words
from gaident.models.effects import table
from gaident.models.model import Model
from gaident.results.estimate import Estimate

__all__ = ["Bound", "Finding", "finding_of", "where"]


@dataclass(frozen=True)
class Finding:
    """One thing that a diagnosis found.

    Attributes
    ----------
    effect : str
        Name of the effect in `gaident.effects.table()`.
    parameters : mapping of str to Estimate
        Its parameters; of several waves the strongest has the plain names, the next one amplitude_2, order_2, phase_2 and so on.
    alternatives : tuple of str
        Effects that these data cannot tell from it, by statistics or by nature; empty: the cause is named.
    gain : float
        Fall of the held-out error that it brought, as a fraction of the error before [1].
    delta_bic : float
        BIC units on whitened errors by which the model without it is worse.
    p_value : float or None
        p-value of the bootstrap; None where none was asked for.
    evidence : str
        What speaks for it, one sentence.
    is_noise : bool
        Whether it describes the record rather than the drive.
    place : {"controller", "actuator", "shaft", "mechanism", "coupling", "plant", "sensor", "record"}
        Where it is: the effect's place in `gaident.effects.table()`.
        It is "controller" for all that the logged torque shows to differ from the given controller.
    sides : tuple of {"motor", "load"}
        Where on the shaft the data allow it, one or both; () where an effect has no side.
        In a model of one mass both ends are the same place, and no output says either.

    Examples
    --------
    >>> import gaident as ga
    >>> torque = ga.Estimate(0.04, 0.001, "N m")
    >>> friction = ga.Finding("coulomb_friction", {"torque": torque}, alternatives=("load_torque",))
    >>> friction.named
    False
    """

    effect: str
    parameters: Mapping[str, Estimate] = field(hash=False)
    alternatives: tuple[str, ...] = ()
    gain: float = 0.0
    delta_bic: float = 0.0
    p_value: float | None = None
    evidence: str = ""
    is_noise: bool = False
    place: str = ""
    sides: tuple[str, ...] = ()

    @property
    def named(self) -> bool:
        """Whether the cause is named, without an alternative."""
        return not self.alternatives


@dataclass(frozen=True)
class Bound:
    """How large an effect may be that was not found.

    Attributes
    ----------
    parameter : str
        The parameter that is its size, as in `gaident.effects.table()`.
    at_most : float
        Its estimate plus two standard deviations, beside all other parameters.
    unit : str
        Its unit, on a rotary axis.

    See Also
    --------
    Diagnosis.not_there : Where they stand.
    """

    parameter: str
    at_most: float
    unit: str


def where(finding: Finding, model: Model) -> str:
    """At which end of the shaft of the model a finding is, for behind its name; "" without a side, and in a model of one mass."""
    return end_words(finding.sides) if (model.p, model.q) == (1, 2) else ""


def finding_of(data: Mapping[str, Any], linear: Mapping[str, str]) -> Finding:
    """The finding of plain data; linear: the sentences of a linear axis, see `linear_sentences`."""
    parameters = {name: Estimate(**e) for name, e in data["parameters"].items()}
    listed = {"alternatives": tuple(data["alternatives"]), "sides": tuple(data.get("sides", ()))}
    said = {"parameters": parameters, "evidence": restored(data["evidence"], linear)}
    return Finding(**{**data, **listed, **said, "place": data.get("place") or _place_of(data["effect"])})


def _place_of(effect: str) -> str:
    """The place of a finding in a file of gaident 0.1.0, which lacks it: what is no effect is a form of the controller."""
    return next((row.place for row in table() if row.name == effect), "controller")
