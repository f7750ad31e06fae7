"""What diagnose() is given, checked: each error names the argument, its value and the remedy."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from gaident.arguments import NO_CONTROLLER
from gaident.axis import period_of
from gaident.checks import above_zero, is_whole, real_number
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.errors import RecordError, SettingsError
from gaident.policy.table import POLICY
from gaident.results.identification import Identification

__all__ = ["ProgressCallback", "accuracy_of", "checked", "expected_of", "in_order", "noise_std_of", "records_of"]

ProgressCallback = Callable[[float, str], None]


def records_of(rec: Record | Sequence[Record], name: str) -> tuple[Record, ...]:
    """The records as a tuple; raises RecordError."""
    given = (rec,) if isinstance(rec, Record) else tuple(rec) if isinstance(rec, Sequence) else ()
    if not given or not all(isinstance(r, Record) for r in given):
        raise RecordError(f"{name} is {type(rec).__name__}: give a gaident.Record or a list of them, at least one")
    return given


def checked(
    records: tuple[Record, ...],
    validation: tuple[Record, ...],
    controller: PI | None,
    idn: Identification | None,
    bootstrap: int,
    seed: int,
    progress: ProgressCallback | None,
    axis: str,
    pitch: float | None,
) -> None:
    """Raises RecordError or SettingsError for what cannot be diagnosed."""
    period_of(axis, pitch)
    if idn is not None and not isinstance(idn, Identification):
        raise SettingsError(f"identification is {type(idn).__name__}: give what identify() returned, or None")
    for r in (*records, *validation):
        if controller is not None and r.command is None:
            raise RecordError(f"record {r.name or '(without a name)'} has no command: give one, or {NO_CONTROLLER} for open loop")
        if controller is None and r.torque is None:
            raise RecordError(f"record {r.name or '(without a name)'} has no torque: give one, or the controller that makes it")
    if len({r.dt for r in (*records, *validation)}) > 1:
        raise RecordError("records have different sample times: a diagnosis needs one; diagnose them apart")
    for i, r in enumerate(records):
        if len(r) < POLICY.least_samples:
            raise RecordError(
                f"record {r.name or i + 1} has {len(r)} samples: a diagnosis needs {POLICY.least_samples} or more, thousands are "
                "good; record a longer motion"
            )
    known = {r.digest for r in records}
    for i, r in enumerate(validation):
        if r.digest in known:
            raise RecordError(
                f"validation record {r.name or i + 1} is one that the model is fitted to: give another run, or leave validation "
                "out, then a part of each record is held out"
            )
    if progress is not None and not callable(progress):
        raise SettingsError(f"progress is {progress!r}: give a function of (fraction, message), or None")
    for name, value, low, high in (("bootstrap", bootstrap, 0, 100_000), ("seed", seed, 0, 2**63 - 1)):
        if not is_whole(value) or not low <= value <= high:
            raise SettingsError(f"{name} is {value!r}: it must be a whole number from {low} to {high}")


def accuracy_of(accuracy: float | Mapping[str, float] | None) -> dict[str, float]:
    """{"velocity": [rad/s], "torque": [N m]} of what was asked for; a number alone is of the velocity."""
    given = {} if accuracy is None else accuracy if isinstance(accuracy, Mapping) else {"velocity": accuracy}
    for name, value in given.items():
        if name not in ("velocity", "torque"):
            raise SettingsError(f"accuracy has {name!r}: give a velocity in rad/s, or 'velocity' and 'torque' [N m] with numbers")
        above_zero(value, f"accuracy of the {name}", SettingsError, "give a number above 0, in rad/s or N m")
    return {name: float(value) for name, value in given.items()}


def expected_of(expected: Mapping[str, tuple[float, float]] | None) -> dict[str, tuple[float, float]]:
    """Name -> (lowest, highest) of what is expected of the mechanism."""
    remedy = "give a mapping with inertia, resonance_hz or damping, each a pair (lowest, highest)"
    if expected is not None and not isinstance(expected, Mapping):
        raise SettingsError(f"expected is {expected!r}: {remedy}")
    found = {}
    for name, value in (expected or {}).items():
        if name not in ("inertia", "resonance_hz", "damping"):
            raise SettingsError(f"expected has {name!r}: {remedy}")
        try:
            low, high = (real_number(v, f"expected {name}", SettingsError, remedy) for v in value)
        except (TypeError, ValueError):  # of another count; a SettingsError is a ValueError, too
            raise SettingsError(f"expected {name} is {value!r}: {remedy}") from None
        if not 0.0 <= low < high:
            raise SettingsError(f"expected {name} is {value!r}: {remedy}, with 0 <= lowest < highest")
        found[name] = low, high
    return found


def in_order(records: tuple[Record, ...]) -> tuple[Record, ...]:
    """The records in an order of their content, so that no sum and no sentence depends on the one in which they were given."""
    return tuple(sorted(records, key=lambda r: (r.digest, r.name)))


def noise_std_of(noise: float | Record | None) -> float | None:
    """Standard deviation of the noise [rad/s], None where it has to come from the record."""
    if noise is None:
        return None
    if isinstance(noise, Record):
        if not float(np.std(noise.velocity)) > 0.0:
            raise SettingsError("noise is a record whose velocity never changes: give its standard deviation in rad/s, or None")
        return float(np.std(noise.velocity))
    return above_zero(noise, "noise", SettingsError, "give its standard deviation in rad/s, above 0, or a Record at standstill")
