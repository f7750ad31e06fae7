"""A filter of the velocity or a lag of the torque? They act alike on a velocity; a logged angle tells how late that is.

    L(w)  by how much the logged velocity is late behind the angle (`regression/sensor_lag.py`)
    L(f)  by how much the angle's own velocity is, behind a filter with the time constant tau that was found

Where both differ by no more than `lag_said` samples, and L(w) is more than that, the filter of the velocity is all that is late.
A lag of the torque keeps its place beside a filter that is shorter than what was found.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np

from gaident.data.record import Record
from gaident.diagnosis.library.equivalences import equivalents
from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.select import Selection, compared
from gaident.estimation.regression.sensor_lag import velocity_lag
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["by_the_angle", "excluded_by_the_angle"]

TIME = "time_constant"


def by_the_angle(
    found: Selection, records: Sequence[Record], classes: Callable[[str], Collection[str]], note: Callable[[str], None]
) -> Selection:
    """A selection with the filter of the velocity in the place of what acts alike, where the logged angle shows it."""
    final = found.final
    for term in final.parameters.terms:
        late = [LIBRARY[name] for name in equivalents(term.name) if LIBRARY[name].late]
        if term.late or not late or term.size != late[0].size or {late[0].name, *late[0].excludes} & {*final.effects}:
            continue
        time = next(e for e in final.parameters.model(final.x).effects if e.name == term.name).parameters[TIME]
        if _all_of_it(records, time):
            short = final.hypothesis.without(term.name)
            x = short.parameters.inserted(final.parameters.removed(final.x, term.name), final.x[final.parameters.slot(term.name)])
            return compared(found, found.space.refitted(short.extended(late[0]), x), classes, note)
    return found


def excluded_by_the_angle(effect: str, parameters: Mapping[str, Estimate], records: Sequence[Record]) -> frozenset[str]:
    """What acts alike and is not there, where the logged angle shows that the effect is all that is late."""
    name = name_of(effect)
    if not LIBRARY[effect].late or TIME not in parameters or not _all_of_it(records, parameters[TIME].value):
        return frozenset()
    return frozenset(equivalents(name))


def _all_of_it(records: Sequence[Record], time: float) -> bool:
    """Whether the velocity of each record is as late behind its angle as a filter with this time constant [s] makes it."""
    for rec in records:
        lag = velocity_lag(rec)
        alone = None if lag is None else velocity_lag(_filtered(rec, time))
        if lag is None or alone is None or lag <= POLICY.lag_said or abs(lag - alone) > POLICY.lag_said:
            return False
    return True


def _filtered(rec: Record, time: float) -> Record:
    """The record with the angle's velocity behind a first-order filter, by the bilinear rule."""
    from scipy.signal import lfilter

    assert rec.position is not None
    k = rec.dt / (2.0 * time + rec.dt)
    velocity = np.gradient(rec.position, rec.dt)
    start = [velocity[0] * (1.0 - k)]  # the filter was there before the record: it begins at its input
    return rec.with_channels(velocity=lfilter([k, k], [1.0, 2.0 * k - 1.0], velocity, zi=start)[0])
