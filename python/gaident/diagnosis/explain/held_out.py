"""Is a model that loses on held-out data an explanation?

A name rests on the records that were fitted. Data that no parameter has seen speak against all names of a model where

    its free run is worse than that of the linear model, and its force error no smaller,                             or
    its free run is no better than that of the linear model, and its force error larger than that of the regression.

"Worse", "better" and "larger" are beyond the variation over blocks of the held-out data (95 % of a paired bootstrap): a lower
error alone decides nothing.
"Worse" also means by more than an effect may add to the error (`harm`):
of two models that leave little more than the noise, a significant difference may be too small to matter.
A cause that the inverse-dynamics regression contains too, or that these records cannot tell from what it contains, stands:
a free run may miss where the data cannot show a motion, as speeds that are only held.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

from gaident.axis import Text, say
from gaident.diagnosis.check import Check
from gaident.diagnosis.gains import IN_SAMPLE, Gains
from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.library.terms import LIBRARY, of_inverse_dynamics
from gaident.policy.table import POLICY

__all__ = ["standing"]


def standing(
    causes: Sequence[str], gains: Gains, check: Check, same: Callable[[str], Collection[str]]
) -> tuple[list[str], tuple[Text, ...]]:
    """(the causes that the held-out data leave, why others went); same: effect -> what these records cannot tell from it."""
    kept = _witnessed(causes, check, same)
    why = _lost(gains, check) if len(kept) < len(causes) else None
    return (list(causes), ()) if why is None else (kept, (why,))


def _lost(gains: Gains, check: Check) -> Text | None:
    """Why the model explains nothing on the held-out data, in words; None where it does not lose, or nothing was held out."""
    if gains.held_out == IN_SAMPLE:
        return None
    low, high = gains.interval
    before, after = check.before.force_error, check.after.force_error
    worse = high < 0.0 and gains.before.rmse < (1.0 - POLICY.harm) * gains.after.rmse
    if worse and not (before is not None and after is not None and after < before):
        return say(
            "On the held-out data the free run of the extended model is worse than that of the linear model ({:.3g} to {:.3g} "
            "{rad/s}, beyond its variation over the record): what it names is no explanation.",
            check.before.rmse,
            check.after.rmse,
        )
    if low <= 0.0 and check.regression_better:
        return say(
            "On the held-out data the extended model is no better than the linear one in free run, and leaves more of the "
            "{torque} than the inverse-dynamics regression, beyond its variation over the record: "
            "what it names is no explanation."
        )
    return None


def _witnessed(effects: Sequence[str], check: Check, same: Callable[[str], Collection[str]]) -> list[str]:
    """Those that the regression contains too: itself, another of its family, or what is the same in these records."""
    if check.regression is None:
        return []
    terms = of_inverse_dynamics({name: e.value for name, e in check.regression.parameters.items()})
    names, families = {t.name for t in terms}, {t.family for t in terms if t.family}
    return [e for e in effects if LIBRARY[name_of(e)].family in families or names & {name_of(e), *same(e)}]
