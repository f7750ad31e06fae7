"""The linear model that is compared with the extended one: identified on the same samples."""

from __future__ import annotations

from collections.abc import Sequence

from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.identification.identify import identify
from gaident.models.model import Model
from gaident.results.identification import Identification

__all__ = ["linear_of_part"]


def linear_of_part(idn: Identification, records: Sequence[Record], pi: PI | None, part: tuple[int, ...] | None) -> Model:
    """The model that `idn` found or, of the first `part` samples of each record, the one that the same search finds there.

    The search has the same ranges, settings and seed. Where these samples identify nothing it is the model of all.
    """
    if part is None:
        return idn.model
    try:
        first = [r[:count] for r, count in zip(records, part, strict=True)]
        return identify(first, pi, space=idn.space, settings=idn.settings, seed=idn.seed).model
    except GaidentError:
        return idn.model
