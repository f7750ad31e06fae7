"""What a record's sample time, channels and kind of torque have to be."""

from __future__ import annotations

import hashlib
import math
import re
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text
from gaident.checks import is_whole, one_of
from gaident.data.signals.arrays import MINIMUM_SAMPLES, channel, is_number, sample_time
from gaident.data.signals.decimation import decimated
from gaident.data.signals.wraps import continued, overflow, wrapped_words
from gaident.data.torque_kind import COMMANDED, HELD, MEAN, SAMPLE, TORQUE_KINDS, TORQUE_LOGS
from gaident.errors import RecordError

__all__ = [
    "at_its_lines",
    "check_bounds",
    "check_part",
    "complete",
    "decimated_channels",
    "digest_of",
    "equally_long",
    "is_held",
    "moved_channels",
    "ranges_of",
    "saved_fields",
    "sample_at",
    "sample_time",
    "slice_bounds",
    "still_driven",
    "texts",
    "torque_kind",
    "torque_line",
    "unwrapped",
]

# A time given as 0.3 s falls on sample 3 of dt = 0.1 s although 0.3 / 0.1 is 2.9999999999999996.
TIME_SLACK = 1e-6  # no decision: rounding of two decimal numbers
HASH_BLOCK = 1 << 18  # no decision: memory; values of a block


_BYTES = re.compile("[\ud800-\udfff]")  # as Python reads bytes of a name: U+DC80 to U+DCFF


def torque_kind(torque_is: object, torque: NDArray[np.float64] | None) -> str:
    """What the torque is, once it is one of the two and there is a torque. Raises RecordError."""
    kind = one_of(torque_is, "torque_is", TORQUE_KINDS, RecordError)
    if kind != COMMANDED and torque is None:
        raise RecordError(f"torque_is={kind!r}, but the record has no torque; give torque=, or leave torque_is out")
    return kind


def torque_line(torque_log: object, torque: NDArray[np.float64] | None) -> str:
    """What a line contains of the torque, once it is one of the two and there is a torque. Raises RecordError."""
    line = one_of(torque_log, "torque_log", TORQUE_LOGS, RecordError)
    if line != SAMPLE and torque is None:
        raise RecordError(f"torque_log={line!r}, but the record has no torque; give torque=, or leave torque_log out")
    return line


def equally_long(channels: dict[str, NDArray[np.float64] | None]) -> dict[str, NDArray[np.float64] | None]:
    """The channels, once they are. Raises RecordError."""
    lengths = {key: len(values) for key, values in channels.items() if values is not None}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{key} {length}" for key, length in lengths.items())
        raise RecordError(
            f"the channels have unequal lengths ({listed} samples); cut them to the same samples, "
            "or, where they come from two clocks, bring two records together with align"
        )
    return channels


def unwrapped(
    channels: dict[str, NDArray[np.float64] | None], dt: float, changed: Collection[str] | None = None
) -> tuple[str, ...]:
    """What is said of positions that wrap, which are continued in their place among the channels; () where none does.

    A position's command goes with it: continued over its own jumps, and within half a range of the position at the first sample.
    changed: the channels that are new, None: all; a position of a record was looked at when that was made.
    Raises RecordError where an integer overflowed in another channel.
    """
    new = {key for key in channels if changed is None or key in changed}
    for key in ("command", "velocity", "torque") if "position" in new else ():
        not_overflown(channels[key], key)
    if "load_velocity" in new:
        not_overflown(channels["load_velocity"], "load_velocity")
    return (*_unwrapped_motor(channels, dt, "position" in new), *_unwrapped_load(channels, dt, "load_position" in new))


def _unwrapped_motor(channels: dict[str, NDArray[np.float64] | None], dt: float, new: bool) -> tuple[str, ...]:
    """See `unwrapped`, of the motor's position and its command."""
    position, command, velocity = (channels[key] for key in ("position", "position_command", "velocity"))
    made = None if position is None or velocity is None or not new else continued(position, velocity, dt)
    if made is None:
        return ()
    found, period, wraps = made
    channels["position"] = channel(found, "position")
    if command is not None:
        channels["position_command"] = channel(_beside(np.unwrap(command, period=period), found, period), "position_command")
    return (wrapped_words(wraps, period, Text(" rad", " m")),)


def _unwrapped_load(channels: dict[str, NDArray[np.float64] | None], dt: float, new: bool) -> tuple[str, ...]:
    """See `unwrapped`, of the load's position, whose unit nobody knows."""
    position, velocity = channels["load_position"], channels["velocity"]
    made = None if position is None or velocity is None or not new else continued(position, velocity, dt, scaled=True)
    if made is None:
        return ()
    found, period, wraps = made
    channels["load_position"] = channel(found, "load_position")
    return (wrapped_words(wraps, period, "", "load position"),)


def not_overflown(values: NDArray[np.float64] | None, key: str) -> None:
    """Raises RecordError where a channel jumps as an integer does that overflowed."""
    if values is None or (found := overflow(values)) is None:
        return
    n, period = found
    raise RecordError(
        f"{key}: it jumps from {values[n]:g} to {values[n + 1]:g} at sample {n + 1} between steady values: an integer overflowed "
        f"there, whose range is {period:g}; log it with more bits or in a coarser unit, or make the Record of "
        f"numpy.unwrap({key}, period={period:g})"
    )


def _beside(command: NDArray[np.float64], position: NDArray[np.float64], period: float) -> NDArray[np.float64]:
    """The command moved by whole ranges to the position, at the first sample."""
    return command + period * float(np.round((position[0] - command[0]) / period))


def readable(name: object) -> str:
    """The name as text that can be written: bytes of a file's name that are no UTF-8 as the letters that they are in Latin-1."""
    if not isinstance(name, str):
        raise RecordError(f"name={name!r} is no text; give a str")
    return _BYTES.sub(lambda found: chr(ord(found[0]) - 0xDC00) if "\udc80" <= found[0] <= "\udcff" else "\ufffd", name)


def texts(notes: Sequence[str]) -> tuple[str, ...]:
    """The notes, once they are texts. Raises RecordError."""
    if isinstance(notes, str) or not isinstance(notes, Iterable) or not all(isinstance(note, str) for note in notes):
        raise RecordError(f"notes={notes!r:.80} is no list of texts; give notes=[...] or leave it out")
    return tuple(notes)


def moved_channels(channels: Mapping[str, NDArray[np.float64]], samples: Mapping[str, int]) -> dict[str, NDArray[np.float64]]:
    """The channels, each k samples later (negative: earlier), cut to what all cover. Raises RecordError."""
    for key, k in samples.items():
        if not is_whole(k):
            raise RecordError(f"shifted({key}={k!r}): give a whole number of samples, negative for earlier")
        if key not in channels:
            raise RecordError(f"shifted({key}={k!r}): the record has no {key}; it has {', '.join(channels)}")
    moves = {key: int(samples.get(key, 0)) for key in channels}
    length = len(channels["velocity"])
    start, stop = max(0, *moves.values()), length + min(0, *moves.values())
    if stop - start < MINIMUM_SAMPLES:
        listed = ", ".join(f"{key}={k}" for key, k in samples.items())
        raise RecordError(
            f"shifted({listed}) leaves {max(stop - start, 0)} of {length} samples, but at least {MINIMUM_SAMPLES} are needed; "
            "move by fewer samples"
        )
    return {key: values[start - moves[key] : stop - moves[key]] for key, values in channels.items()}


def check_bounds(t0: object, t1: object) -> None:
    """Raises RecordError for bounds that are not two times [s], the earlier first."""
    for key, value in (("t0", t0), ("t1", t1)):
        if not is_number(value):
            raise RecordError(f"between({t0!r}, {t1!r}): {key} is no number; give seconds")
        if value != value:  # NaN; math.isnan fails for whole numbers beyond 1e308
            raise RecordError(f"between({t0!r}, {t1!r}): {key} is NaN; give seconds")
    for key, value in (("t0", t0), ("t1", t1)):
        if isinstance(value, int) and abs(value) > sys.float_info.max:
            raise RecordError(f"between(...): {key} is a whole number beyond all times; give seconds")
    if not t0 < t1:  # type: ignore[operator]  # both are numbers
        raise RecordError(f"between({t0!r}, {t1!r}): t0 must be before t1; exchange them")


def check_part(start: int, stop: int, text: str, length: int, duration: float) -> None:
    """Raises RecordError where a part of a record, cut by the call `text`, has too few samples."""
    count = max(stop - start, 0)
    if count < MINIMUM_SAMPLES:
        raise RecordError(
            f"{text} leaves {count} samples, but at least {MINIMUM_SAMPLES} are needed; the record has "
            f"{length} samples and lasts {duration:g} s, choose wider bounds"
        )


def complete(velocity: object, command: object, torque: object, position_command: object) -> None:
    """Raises RecordError where a record would lack its velocity, or what drove the motor."""
    if velocity is None:
        raise RecordError(
            "velocity=None, but a record needs the measured velocity; give velocity=, "
            "or derive it with differentiate(position, dt, cutoff_hz)"
        )
    if command is None and torque is None and position_command is None:
        raise RecordError(
            "command=None and torque=None, but a record needs what drove the motor; give one of them, or position_command="
        )


def slice_bounds(samples: object, length: int) -> tuple[int, int, str]:
    """(first sample, the one behind the last, the text `rec[a:b]`) of a slice of a record. Raises RecordError."""
    if not isinstance(samples, slice):
        raise RecordError(f"rec[{samples!r}]: a record is cut by a slice, rec[a:b]; one value is rec.velocity[n]")
    first, last = ("" if bound is None else repr(bound) for bound in (samples.start, samples.stop))
    text = f"rec[{first}:{last}]"
    if samples.step is not None and samples.step != 1:
        raise RecordError(
            f"{text[:-1]}:{samples.step!r}]: the step must be 1, because leaving out samples folds high "
            f"frequencies down; cut with rec[a:b], and decimate behind a low-pass with rec.decimate({samples.step!r})"
        )
    try:
        start, stop, _ = samples.indices(length)
    except TypeError:
        raise RecordError(f"{text}: bounds are sample numbers, whole; cut by seconds with rec.between(t0, t1)") from None
    return start, stop, text


def sample_at(time: float, dt: float, n: int) -> int:
    """First of n samples not before `time` [s], within 0..n."""
    return math.ceil(min(max(time / dt - TIME_SLACK, 0.0), float(n)))


def still_driven(channels: Mapping[str, object], changed: Mapping[str, object]) -> None:
    """Raise RecordError where changed channels leave a record without its velocity, or without what drove it."""
    if channels["velocity"] is None or all(channels[key] is None for key in ("command", "torque", "position_command")):
        listed = ", ".join(f"{key}=None" for key, values in changed.items() if values is None)
        raise RecordError(
            f"with_channels({listed}) leaves a record without its velocity, or without command and torque; keep what "
            "the motor did and what drove it"
        )


def decimated_channels(
    channels: Mapping[str, NDArray[np.float64]], factor: int, torque_is: str, torque_log: str
) -> dict[str, NDArray[np.float64]]:
    """Every `factor`-th sample behind a low-pass, see `Record.decimate`. Raises RecordError where too few are left."""
    count = -(-len(channels["velocity"]) // factor)
    if count < MINIMUM_SAMPLES:
        raise RecordError(f"decimate({factor}) leaves {count} samples, but at least {MINIMUM_SAMPLES} are needed")
    late = {"torque": at_its_lines(channels["torque"])} if torque_log == MEAN and factor > 1 else {}
    held = {"torque"} if is_held(torque_is, torque_log) else {}
    return {key: decimated(values, factor, key in held) for key, values in (dict(channels) | late).items()}


def is_held(torque_is: str, torque_log: str) -> bool:
    """Whether a torque jumps at each line and is held until the next: a commanded one, unless the record says another thing."""
    return torque_log == HELD or (torque_log == SAMPLE and torque_is == COMMANDED)


def at_its_lines(means: NDArray[np.float64]) -> NDArray[np.float64]:
    """A signal at the lines (n,), of its means since the line before, which are half a line old: the mean of two neighbours."""
    return np.append(0.5 * (means[1:] + means[:-1]), means[-1])  # no decision: a formula: a mean of two


def saved_fields(data: Mapping[str, Any], channels: Sequence[str]) -> dict[str, Any]:
    """What the constructor takes, of a saved record with these channels. Raises RecordError where a key is missing."""
    early, more = channels[:4], channels[4:]  # no decision: a format: its first version
    first = ("dt", "name", *early)
    missing = [key for key in first if key not in data]
    if missing:
        raise RecordError(f"the saved record lacks {', '.join(missing)}; save it again")
    # Early files contain none of these, nor a position command or a load's channels.
    later = {"torque_is": COMMANDED, "torque_log": SAMPLE, "notes": (), **dict.fromkeys(more)}
    return {key: data[key] for key in first} | {k: data.get(k, default) for k, default in later.items()}


def digest_of(dt: float, channels: Mapping[str, NDArray[np.float64]], torque_is: str, torque_log: str) -> str:
    """SHA-256 of the data of a record, see `Record.digest`."""
    sha = hashlib.sha256(f"gaident record 1 {dt.hex()} {len(channels['velocity'])}".encode())
    for key, values in channels.items():
        sha.update(f" {key} ".encode())
        for start in range(0, len(values), HASH_BLOCK):
            # + 0.0 makes -0.0 the 0.0 that it equals
            block = values[start : start + HASH_BLOCK] + 0.0
            sha.update(block.astype("<f8", copy=False).tobytes())
    if torque_is != COMMANDED:
        sha.update(f" torque is {torque_is}".encode())
    if torque_log != SAMPLE:
        sha.update(f" torque log {torque_log}".encode())
    return sha.hexdigest()


def ranges_of(channels: Mapping[str, NDArray[np.float64]], torque_is: str, torque_log: str) -> str:
    """Each channel with its lowest and its highest value, and what the torque is, on one line."""
    said = [word for word in (torque_is, torque_log) if word not in (COMMANDED, SAMPLE)]
    kind = {"torque": f" ({', '.join(said)})"} if said else {}
    return ", ".join(f"{key} {v.min() + 0.0:.4g}..{v.max() + 0.0:.4g}{kind.get(key, '')}" for key, v in channels.items())
