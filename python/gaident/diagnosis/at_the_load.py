"""A sensor at the load: the search with it, how it reads the load, and what is said of that."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gaident.axis import Text, say
from gaident.diagnosis.records.hygiene import cleaned_signal, outliers
from gaident.diagnosis.selection.load_moves import LoadMoves
from gaident.diagnosis.selection.rivals import Classes
from gaident.diagnosis.selection.select import Selection, grown, with_rivals
from gaident.estimation.load_sensor.signals import CHANNELS, LoadSensor
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["explains_load", "load_numbers", "load_words", "with_load_sensor"]

NO_P_VALUE = say("The bootstrap draws signals of the motor alone: beside a sensor at the load there is no p-value.")


def with_load_sensor(found: Selection, classes: Classes, note: Callable[[str], None]) -> Selection | None:
    """The search once more with what a sensor at the load shows; None without one. Outliers of the sensor are left out."""
    objective = found.space.objective
    records = objective.data.records
    channel = next((c for c in CHANNELS if all(_moves(getattr(r, c)) for r in records)), None)
    if channel is None:
        return None
    signals = [getattr(r, channel) for r in records]
    hit = [outliers(s) for s in signals]
    used = objective.counted.copy()
    used[np.concatenate([np.isin(np.arange(len(s)), h) for s, h in zip(signals, hit, strict=True)])] = 0.0
    cleaned = [cleaned_signal(s, h) for s, h in zip(signals, hit, strict=True)]
    return _beside_load(found, LoadSensor.of(objective.data, channel, cleaned, used), classes, note)


def _beside_load(selection: Selection, sensor: LoadSensor, classes: Classes, note: Callable[[str], None]) -> Selection:
    """The selection once more from its model, with a sensor of the load, weighed by what the model before left there."""
    note("looking at the load's sensor")
    final = selection.final
    for _ in range(POLICY.rounds):
        space = LoadMoves.beside(selection.space, sensor, final)
        found = grown(space, space.refitted(final.hypothesis, final.x))
        same, final = space.key(found) == space.key(final), found
        if same:
            break
    space = LoadMoves.beside(selection.space, sensor, final)
    final = space.refitted(final.hypothesis, final.x)
    return with_rivals(space, selection, final, classes, note)


def _moves(signal: np.ndarray | None) -> bool:
    return signal is not None and bool(np.ptp(signal) > 0.0)


def explains_load(found: Selection) -> bool:
    """Whether the model leaves noise at the load, or no sensor is there."""
    return not isinstance(found.space, LoadMoves) or found.space.explains_load(found.final)


def load_numbers(found: Selection) -> dict[str, Estimate]:
    """Scale and offset of a sensor at the load, of the first record where there are several; {} without a sensor."""
    if not isinstance(found.space, LoadMoves):
        return {}
    read = found.space.joint.sensor.reading(found.final.hypothesis, found.final.x)
    # The unit of the channel is not known: a record has numbers.
    offset = Estimate(float(read.offsets[0]), float(read.offset_stds[0]), "1")
    return {"scale": Estimate(read.scale, read.scale_std, "1"), "offset": offset}


def load_words(found: Selection) -> list[Text]:
    """What is said of the errors at the load, or of channels that do not count."""
    if not isinstance(found.space, LoadMoves):
        records = found.space.data.records
        there = [c for c in CHANNELS if any(getattr(r, c) is not None for r in records)]
        text = "The {} does not count: not every record has it, or it is constant in one."
        return [say(text, there[0].replace("_", " "))] if there else []
    what = found.space.joint.sensor.channel.replace("_", " ")
    if found.space.explains_load(found.final):
        return [say("The {} is explained to its noise.", what)]
    text = (
        "The {} is not explained: the model leaves {:.2g} times its noise. Its sensor may be late, filtered or eccentric, or a "
        "part between motor and load moves in a way that no model here has."
    )
    return [say(text, what, found.space.load_ratio(found.final))]
