"""Is a model that loses on held-out data an explanation?

A name rests on the records that were fitted. Data that no parameter has seen speak against all names of a model where

    (1) its free run is worse than that of the linear model, and its force error no smaller,                          or
    (2) its free run is no better than that of the linear model, and its force error larger than that of the regression,   or
    (3) its force error is far larger than that of the regression, and that matters (`Check.loses`).

"Worse", "better" and "larger" are beyond the variation over blocks of the held-out data (95 % of a paired bootstrap): a lower
error alone decides nothing.
A force error is "larger" by what noise and filter do not make of it.
"Worse" also means by more than an effect may add to the error (`harm`):
of two models that leave little more than the noise, a significant difference may be too small to matter.
The linear model is identified on the same samples as the extended one.

A cause that the inverse-dynamics regression contains too, or that these records cannot tell from what it contains, stands:
a free run may miss where the data cannot show a motion, as speeds that are only held.
So do all causes where the free run is worse and the force error smaller: under gravity, or where an axis integrates, a free run
drifts by what is small in every sample.
Both are said in a note, and what stands so is not all that there is: the diagnosis is "partly explained" at best.
Figures of the samples that were fitted take no name, but where the free run is worse even there, the same holds.
A model whose inertia may be any explains nothing: no torque moves its axis, and what would be one cause looks like another.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence

from gaident.axis import Text, called, joined, say
from gaident.diagnosis.check import Check
from gaident.diagnosis.explain.wording import far_off, hidden_by_torque_noise
from gaident.diagnosis.gains import Gains
from gaident.diagnosis.library.sides import called_of, name_of
from gaident.diagnosis.library.terms import LIBRARY, of_inverse_dynamics
from gaident.diagnosis.selection.dependence import Dependence
from gaident.estimation.dataset import DataSet
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["shown_by_free_run", "standing"]


NOTHING_MOVES_IT = (
    "With {} in the model its {inertia} may be any: the records do not show what the {torque} does to this axis, and so no cause "
    "is named. Log the {torque}, and a motion that changes its speed."
)
IN_SAMPLE_WORSE = (
    "Even on the samples that were fitted the free run of the extended model is worse than that of the linear model ({:.3g} to "
    "{:.3g} {rad/s}, beyond its variation over the record): what it names is not all that there is."
)


def standing(
    causes: Sequence[str], gains: Gains, check: Check, same: Callable[[str], Collection[str]], inertia: Estimate | None = None
) -> tuple[list[str], tuple[Text, ...]]:
    """(the causes that the held-out data leave, what is said where they speak against the model or one of its figures).

    same: effect -> what these records cannot tell from it. inertia: of the model; None where it has none.
    """
    if not causes:
        return [], ()
    if inertia is not None and not math.isfinite(inertia.std):
        return [], (say(NOTHING_MOVES_IT, joined(" and ", map(called, causes))),)
    low, high = gains.interval
    worse = high < 0.0 and gains.before.rmse < (1.0 - POLICY.harm) * gains.after.rmse
    if gains.in_sample:
        return list(causes), (say(IN_SAMPLE_WORSE, check.before.rmse, check.after.rmse),) if worse else ()
    matters = (worse and not _force_falls(check)) or check.loses
    if matters or (low <= 0.0 and check.regression_better):
        kept = _witnessed(causes, check, same)
        return kept, (_lost(worse, low > 0.0, check, kept),) if matters or len(kept) < len(causes) else ()
    return list(causes), (_by_the_torque(causes, check),) if worse else ()


def shown_by_free_run(data: DataSet, gains: Gains, left: Dependence, adequate: bool) -> tuple[str | None, list[Text]]:
    """(what drives what a model leaves, None where nothing counts; what is said of its free run).

    A noise filter removes a slow misfit completely; the free run shows it.
    """
    driver, notes = left.driver if adequate else left.strongest, []
    adds_up = data.slower and not data.fits_in_loop  # what the torque lacks between the lines of the log
    beyond = gains.after.rmse / floor if (floor := gains.floor) > 0.0 else 0.0
    if driver is None and not adds_up and beyond > POLICY.free_run_ratio:
        driver = left.strongest or "time"
        notes.append(far_off(beyond))
    if driver is None and data.torque_measured and not gains.closed:
        notes.append(hidden_by_torque_noise(floor))
    return driver, notes


def _force_falls(check: Check) -> bool:
    """Whether the effects make the force error smaller; without them a model may diverge, which is no figure."""
    before, after = check.before.force_error, check.after.force_error
    return after is not None and (before is None or after < before)


def _lost(worse: bool, better: bool, check: Check, kept: Sequence[str]) -> Text:
    """Why the model explains nothing on the held-out data, and what stands for all that.

    worse, better: than the linear model, of the free run.
    """
    if worse:
        text = (
            "On the held-out data the free run of the extended model is worse than that of the linear model ({:.3g} to {:.3g} "
            "{rad/s}, beyond its variation over the record)"
        )
        why = say(text, check.before.rmse, check.after.rmse)
    else:
        text = (
            "On the held-out data the extended model is {}leaves more of the {torque} than the inverse-dynamics "
            "regression, beyond its variation over the record"
        )
        less = "better than the linear one in free run, but " if better else "no better than the linear one in free run, and "
        why = say(text, less)
    if not kept:
        return say("{}: what it names is no explanation.", why)
    stands = _names(kept, "stands", "stand")
    return say(
        "{}: what it names is no explanation by itself. {}: the regression finds the same without a simulation.", why, stands
    )


def _by_the_torque(causes: Sequence[str], check: Check) -> Text:
    """Why causes stand although the free run is worse: the force error is smaller."""
    text = (
        "On the held-out data the free run of the extended model is worse than that of the linear model ({:.3g} to {:.3g} "
        "{rad/s}, beyond its variation over the record). {} by the {torque}: "
    )
    before, after = check.before.force_error, check.after.force_error
    told = say(text, check.before.rmse, check.after.rmse, _names(causes, "stands", "stand"))
    if before is None:
        of_torque = say(
            "the model without effects diverges along the measured motion, the extended one misses it by {:.3g} {N m}", after
        )
    else:
        of_torque = say("the error of the {torque} falls from {:.3g} to {:.3g} {N m}", before, after)
    because = say(", and {}", check.reason) if check.reason else Text("")
    return joined("", (told, of_torque, because, Text(".")))


def _names(effects: Sequence[str], one: str, several: str) -> Text:
    named = joined(" and ", (called_of(e) for e in effects)).begun()
    return say("{} {}", named, one if len(effects) == 1 else several)


def _witnessed(effects: Sequence[str], check: Check, same: Callable[[str], Collection[str]]) -> list[str]:
    """Those that the regression contains too: itself, another of its family, or what is the same in these records."""
    if check.regression is None:
        return []
    terms = of_inverse_dynamics({name: e.value for name, e in check.regression.parameters.items()})
    names, families = {t.name for t in terms}, {t.family for t in terms if t.family}
    return [e for e in effects if LIBRARY[name_of(e)].family in families or names & {name_of(e), *same(e)}]
