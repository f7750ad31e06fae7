"""Attribution: is a finding a cause, or does it only describe what the library does not contain?

A finding is withdrawn where a free function of one signal in its place explains more, and where the remaining error, in the
finding's own domain, is of the finding's size.
But whitened gains depend on the fast part of the errors.
In a record with almost no noise a small misfit of the true cause is then as significant as the cause itself.
So a finding stands where it explains nearly all of the free-run error that a function of the driver can explain.
With V the sum of squared raw errors, all linear parts refitted: without the finding, with it, and with any function of the
driver beside it,

    share = (V_without - V_with) / (V_without - V_free)

Measured: square-root drag 0.77 to 0.87 by whatever friction comes closest, friction that varies with the angle 0.44 to 0.71; the
friction of a real ball-screw axis (EMPS) 0.997, beside a remainder that is significant all the same.

That share asks whether the finding is all there is.
An axis may have the cause and something else as large that is not in the library: a joint whose friction has a part that grows
with gravity's torque has dry friction, though it explains 0.45 of what a function of the position does.
So dry friction also stands where the records show it without any model of the rest: the torque jumps at the reversals,
beside the steepest drag, or the axis rests while its torque changes (`estimation/regression/reversal.py`).
It is then a cause, and what is left remains named by its driver.
The records also show where there is no dry friction: it explains a drag sqrt(w) to 0.95 where the motion is fast, but that
torque does not jump.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.dependence import Dependence, beside_torque_noise, dependence, without_torque
from gaident.diagnosis.selection.moves import Moves
from gaident.estimation.dataset import DataSet
from gaident.estimation.least_squares import fit as fitted
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit
from gaident.estimation.prediction import torque_noise_in
from gaident.estimation.regression.force_error import band_of
from gaident.estimation.regression.reversal import jump_at_reversal, steep_drag, torque_held_at_rest
from gaident.estimation.term import Term
from gaident.models.model import Model
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.inverse_dynamics import InverseDynamics

__all__ = [
    *("friction_shown", "only_describes", "share", "shown_by_the_records"),
    *("shown_without_model", "simplified", "what_is_left"),
]


def what_is_left(space: Moves, final: Fit) -> tuple[bool, Dependence]:
    """(whether a model leaves noise, what its error depends on).

    The variance-ratio test knows the velocity's noise alone.
    Under a measured torque two other conditions show noise:

    - Beside a noise model of the torque no driver explains more than in records without effects.
    - The free-run error is no larger than both noises make it.
      A noise model also describes a load that changes in time, but the free-run error of that is far larger.
    """
    if not space.data.torque_measured:
        return space.is_noise(final), dependence(space.objective, final)
    used = space.objective.weight > 0.0
    error = float(np.sqrt(np.mean(space.objective.error(final)[used] ** 2)))
    mechanism = final.parameters.linear(final.x)
    noise = float(np.hypot(space.noise_beside(final), torque_noise_in(mechanism, space.data.records)))
    beside = beside_torque_noise(space.objective, final)
    if beside.driver is None and error < space.policy.free_run_ratio * noise:
        return True, beside
    return False, without_torque(dependence(space.objective, final))


def only_describes(
    space: Moves, final: Fit, effect: str, gain: float, driver: str | None, left: Dependence, of_class: bool
) -> bool:
    """Whether a finding of this gain [BIC units] describes something that is not in the library.

    of_class: the record cannot split it from other effects, whatever its noise, and it is reported with them.
    """
    shown = shown_by_the_records(space, final, effect)
    if shown is not None:
        return not shown
    without = space.without(final, effect)
    instead = dependence(space.objective, without).gains
    doubtful = max(instead.values()) > gain + space.policy.rival_margin
    if not doubtful and driver is not None and left.gains[driver] >= space.policy.of_its_size * gain:
        doubtful = driver in final.parameters.term(effect).domains
    return doubtful and share(space, without, final, left) < (space.policy.class_stands if of_class else space.policy.stands)


def shown_by_the_records(space: Moves, final: Fit, effect: str) -> bool | None:
    """Whether the records show friction of the finding's size by themselves; None where they say nothing.

    False where they show that there is no dry friction: the torque hardly jumps at the reversals.
    Other effects are not tested: a function of the driver could show the same.
    """
    parameters = final.parameters
    term = parameters.term(effect)
    if not (term.levels or term.steep) or not space.data.torque_logged:
        return None
    if term.steep:
        return True if _steep_shown(space.data, parameters.model(final.x)) else None
    level = float(final.x[parameters.slot(effect)][0])
    jump, rest = _friction_in(space.data, parameters.model(final.x))
    if _sure(jump, rest, POLICY.of_its_level * level):
        return True
    refuted = jump is not None and jump.value + POLICY.jump_deviations * jump.std < POLICY.of_its_size * level
    return False if refuted else None


def shown_without_model(
    data: DataSet, model: Model, allowed: Sequence[Term], axis: InverseDynamics | None = None
) -> frozenset[str]:
    """Families and names of what the records show without a simulation: dry friction, and friction that bends over the speed."""
    shown = {t.family for t in allowed if t.levels} if friction_shown(data, model, axis) else set()
    if any(t.bends for t in allowed) and _steep_shown(data, model):
        shown |= {t.name for t in allowed if t.bends}
    return frozenset(shown)


def _steep_shown(data: DataSet, model: Model) -> bool:
    """Whether the torque rises more steeply from rest than dry and viscous friction do, and bends so at high speeds, too."""
    if not data.torque_logged:
        return False
    cutoff = band_of(model, data.records, below=POLICY.rigid_band)
    whole, fast = steep_drag(data.records, cutoff), steep_drag(data.records, cutoff, POLICY.steep_above)
    return whole is not None and _sure(whole, None, 0.0) and _sure(fast, None, POLICY.of_its_level * whole.value)


def friction_shown(data: DataSet, model: Model, axis: InverseDynamics | None = None) -> bool:
    """Whether the records show dry friction without any simulation: at the reversals, at rest, or by the regressed axis.

    Where no record turns back or rests, the part of the torque that does not depend on the speed counts as dry friction.
    In one direction no record can tell a load from it.
    """
    if not data.torque_logged:
        return False
    jump, rest = _friction_in(data, model)
    if jump is None and rest is None and axis is not None:
        jump = next((axis.parameters[name] for name in ("coulomb", "offset") if name in axis.parameters), None)
        jump = None if jump is None else replace(jump, value=abs(jump.value))
    return _sure(jump, rest, 0.0)


def _friction_in(data: DataSet, model: Model) -> tuple[Estimate | None, Estimate | None]:
    """(jump of the torque at the reversals, torque held at rest), below what resonates in the model.

    A small torque held at rest does not count: a controller at rest also answers to small torques that disturb the axis.
    """
    cutoff = band_of(model, data.records, below=POLICY.rigid_band)
    rest = torque_held_at_rest(data.records, cutoff)
    if rest is not None and rest.value < POLICY.slow * float(np.abs(data.torque).max()):
        rest = None
    return jump_at_reversal(data.records, cutoff), rest


def _sure(jump: Estimate | None, rest: Estimate | None, least: float) -> bool:
    """Whether either is beyond its noise, and at least so large [N m]."""
    beyond = ((jump, POLICY.jump_deviations), (rest, POLICY.above_noise))
    return any(e is not None and e.value > max(times * e.std, least) for e, times in beyond)


def simplified(space: Moves, final: Fit, left: Dependence) -> Fit:
    """A generalisation as the simpler effect again, where the error left is as large as what its detail explains."""
    driver = left.driver
    if driver is None:
        return final
    for term in final.parameters.terms:
        for name in term.nested:
            simpler = space.as_nested(final, term, LIBRARY[name])
            of_its_size = left.gains[driver] > space.policy.of_its_size * (simpler.bic - final.bic)
            if of_its_size and share(space, simpler, final, left) < space.policy.stands:
                return simpler
    return final


def of_known_size(space: Moves, final: Fit, unknown: Sequence[str]) -> Fit:
    """The model without one of the effects whose size the records do not tell, or with a simpler one in its place.

    Two effects that are the same torque take each other's size: without one of them the other one's is known.
    Of all these models it is the one that comes closest.
    """
    less = []
    for term in (t for t in final.parameters.terms if t.name in unknown):
        less.append(space.without(final, term.name))
        less += [space.as_nested(final, term, LIBRARY[name]) for name in term.nested]
    return min(less, key=lambda f: f.bic)


def share(space: Moves, without: Fit, final: Fit, left: Dependence) -> float:
    """The part that `final` explains of what it and a free function of the best driver explain together."""
    objective = space.objective
    less = fitted(objective, without.hypothesis, without.x, WHITE, space.policy.usual)
    before, after = (objective.raw_rest(*objective.sensitivities(f.hypothesis, f.x)) for f in (less, final))
    free = min(left.least.values())
    return float((before - after) / np.maximum(before - free, 1e-300))
