"""The linear model that is compared with the extended one: identified on the same samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gaident.axis import Text, message_of, percent, say
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.identification.identify import identify
from gaident.models.drive_torque import torque_blocks
from gaident.models.model import Model
from gaident.policy.table import POLICY
from gaident.results.identification import Identification

__all__ = ["linear_of_part"]

SEEN = (
    "The first {} of each record identify no linear model by themselves ({}). The linear model of these figures is that of the "
    "whole record, the held-out part included, so its error is too small."
)


def linear_of_part(
    idn: Identification, records: Sequence[Record], pi: PI | None, part: tuple[int, ...] | None
) -> tuple[Model, tuple[Text, ...]]:
    """The model that `idn` found or, of the first `part` samples of each record, the one that the same search finds there.

    The search has the same ranges, settings and seed.
    Where these samples identify no model it is that of all samples, and the second value is a note that says so.
    """
    if part is None:
        return idn.model, ()
    first = [r[:count] for r, count in zip(records, part, strict=True)]
    if not any(np.any(u) for r in first for _, u, _ in torque_blocks(r, pi)):
        return idn.model, (say(SEEN, percent(POLICY.fitted_share), say("no {torque} drives them")),)
    try:
        return identify(first, pi, space=idn.space, settings=idn.settings, seed=idn.seed).model, ()
    except GaidentError as error:
        return idn.model, (say(SEEN, percent(POLICY.fitted_share), message_of(error)),)
