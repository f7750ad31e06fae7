"""A sensor at the load: the search with it, how it reads the load, and what is said of that."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gaident.axis import Text, say
from gaident.diagnosis.selection.load_moves import LoadMoves
from gaident.diagnosis.selection.rivals import Classes
from gaident.diagnosis.selection.select import Selection, beside_load
from gaident.estimation.load_sensor.signals import LoadSensor
from gaident.results.estimate import Estimate

__all__ = ["explains_load", "load_numbers", "load_words", "with_load_sensor"]

UNITS = {"load_position": "rad", "load_velocity": "rad/s"}


def with_load_sensor(found: Selection, classes: Classes, note: Callable[[str], None]) -> Selection | None:
    """The search once more with what a sensor at the load shows; None without one."""
    objective = found.space.objective
    sensor = LoadSensor.of(objective.data, objective.counted)
    return None if sensor is None else beside_load(found, sensor, classes, note)


def explains_load(found: Selection) -> bool:
    """Whether the model leaves noise at the load, or no sensor is there."""
    return not isinstance(found.space, LoadMoves) or found.space.explains_load(found.final)


def load_numbers(found: Selection) -> dict[str, Estimate]:
    """Scale and offset of a sensor at the load, of the first record where there are several; {} without a sensor."""
    if not isinstance(found.space, LoadMoves):
        return {}
    sensor = found.space.joint.sensor
    read = sensor.reading(found.final.hypothesis, found.final.x)
    offset = Estimate(float(read.offsets[0]), float(read.offset_stds[0]), UNITS[sensor.channel])
    return {"scale": Estimate(read.scale, read.scale_std, "1"), "offset": offset}


def load_words(found: Selection) -> list[Text]:
    """What is said of the errors at the load."""
    if not isinstance(found.space, LoadMoves):
        return []
    sensor = found.space.joint.sensor
    left = float(np.sqrt(found.space.joint.at_load(found.final)))
    what = sensor.channel.replace("_", " ")
    if found.space.explains_load(found.final):
        return [say("The {} is explained to its noise, {:.3g} rms.", what, left)]
    text = "The {} is not explained: the model leaves {:.3g} rms, where its noise is {:.3g}, in the unit of the log."
    return [say(text, what, left, sensor.noise)]
