"""drive.toml: what belongs to the axis, checked key by key, and what follows from it."""

from __future__ import annotations

import dataclasses
import math
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gaident.checks import known_keys, one_of
from gaident.control.controller import Controller
from gaident.data.pieces import read_pieces
from gaident.data.readers import read
from gaident.data.record import CHANNELS, Record
from gaident.drive import kinds
from gaident.drive.controller_section import CONTROLLER_KEYS, controller_of, proportional_gain_of
from gaident.drive.quantities import INTEGRAL_TIMES
from gaident.errors import ReadError, SettingsError, SpaceError
from gaident.identification.closed_loop import looped_over, space_of
from gaident.models.search_space import SearchSpace
from gaident.results.experiment import Limits

__all__ = ["COLUMNS", "KEYS", "Drive", "axes_in", "read_drive_file", "unfilled_of"]


COLUMNS = (*CHANNELS, "voltage", "current", "time")
CONSTANTS = (
    *("counts_per_turn", "torque_constant", "rated_torque", "torque_per_volt"),
    *("resistance", "inductance", "back_emf_constant", "reference_speed"),
)
RANGES = ("inertia", "resonance_hz", "damping", "gain", "real", "imaginary", "p", "q")

# Sections of drive.toml ("" is its top), their keys and what a value must be.
KEYS: dict[str, dict[str, kinds.Check]] = {
    "": {
        "axis": kinds.axis,
        "pitch": kinds.length,
        "dt": kinds.quantity,
        "velocity_cutoff_hz": kinds.number,
        **dict.fromkeys(CONSTANTS, kinds.quantity),
        "counts_per_turn": kinds.number,
        "reference_speed": kinds.speed,
        "screw": kinds.length,
        "gear_ratio": kinds.positive,
        "load_side": kinds.channels,
        "torque_is": kinds.torque_is,
        "torque_log": kinds.torque_log,
        "decimate": kinds.whole,
        "resample": kinds.positive_quantity,
        "from": kinds.quantity,
        "to": kinds.quantity,
        "pieces": kinds.yes_or_no,
        "delimiter": kinds.text,
        "decimal": kinds.text,
        "skip": kinds.whole,
        "encoding": kinds.text,
    },
    "columns": dict.fromkeys(COLUMNS, kinds.column),
    "units": dict.fromkeys(COLUMNS, kinds.unit),
    "shift": dict.fromkeys(CHANNELS, kinds.whole),
    "controller": CONTROLLER_KEYS,
    "space": {
        **dict.fromkeys(RANGES, kinds.pair),
        "p": kinds.pair_or_one,
        "q": kinds.pair_or_one,
        "bits": kinds.whole,
    },
    "limits": {
        "speed": kinds.speed,
        **dict.fromkeys(("torque", "travel"), kinds.positive),
        "duration": kinds.positive_quantity,
    },
    "show": dict.fromkeys(("velocity", "torque", "position"), kinds.text),
    "report": dict.fromkeys(("date", "machine", "customer", "text"), kinds.text),
}


@dataclass(frozen=True)
class Drive:
    """What belongs to the axis: how its logs are read, its controller, where to look for its parameters."""

    general: Mapping[str, Any]
    columns: Mapping[str, Any]
    units: Mapping[str, Any]
    controller_values: Mapping[str, Any]
    space_values: Mapping[str, Any]
    limit_values: Mapping[str, Any] = field(default_factory=dict)
    shift: Mapping[str, int] = field(default_factory=dict)
    show: Mapping[str, str] = field(default_factory=dict)
    about: Mapping[str, str] = field(default_factory=dict)
    unfilled: Mapping[tuple[str, str], str] = field(default_factory=dict)  # (section, key) -> file and line, see `unfilled_of`

    @property
    def axis(self) -> str:
        """ "rotary" or "linear": which units are printed."""
        return str(self.general.get("axis", "rotary"))

    @property
    def units_shown(self) -> dict[str, Any]:
        """The units of [show] with the constants that they need; {} where none are asked for."""
        named = (*CONSTANTS, "screw")
        return {**self.show, **{key: self.general[key] for key in named if key in self.general}} if self.show else {}

    @property
    def pitch(self) -> float | None:
        """Of a linear axis, the length with which its cogging returns [m]; None: not known."""
        return self.general.get("pitch")

    def read(self, path: str, measured: bool = True) -> Record:
        """The log as one Record. Raises ReadError or RecordError, and SettingsError where its pieces are several."""
        found = self.records(path, measured)
        if len(found) > 1:
            raise SettingsError(
                f"{path}: --pieces makes {len(found)} records of it, where one is needed; name a part: --from, --to"
            )
        return found[0]

    def records(self, path: str, measured: bool = True) -> list[Record]:
        """The log as a Record, or the pieces around its gaps; measured: as `gaident.read` takes it.

        Raises ReadError or RecordError.

        A CSV that gaident wrote itself, of a proposed command, names its columns and units: the drive's are those of its logs.
        """
        if not measured and _is_proposal(path) and not {"command", "command [rad/s]", "command [m/s]"} & {*self.columns.values()}:
            return [read(path, measured=False)]
        if "screw" in self.general and self.axis == "linear":
            raise SettingsError(
                'screw makes a rotary axis of one that is logged in mm, and axis is "linear": leave the one or the other out'
            )
        columns = {k: None if v == "" else v for k, v in self.columns.items()}
        left_out = {k for k, v in columns.items() if v is None}
        of_torque = {"torque_is", "torque_log"} if "torque" in left_out else set()
        not_read = {"axis", "pitch", "dt", "from", "to", "pieces"} | of_torque
        more = {k: v for k, v in self.general.items() if k not in not_read}
        asked = [k for k in (*CHANNELS, *([] if "dt" in self.general else ["time"])) if k not in left_out]
        self._refuse_unfilled("units", asked, "or give it with --units CHANNEL=UNIT")
        units = {k: v for k, v in self.units.items() if k not in left_out}
        shift = {k: v for k, v in self.shift.items() if k not in left_out}
        asked_for = (columns or None, units or None, self.general.get("dt"))
        more |= {"measured": measured, "shift": shift}
        start, stop, pieces = (self.general.get(key) for key in ("from", "to", "pieces"))
        if pieces or start is not None or stop is not None:
            return read_pieces(path, *asked_for, start=start, stop=stop, pieces=bool(pieces), **more)
        return [read(path, *asked_for, **more)]

    def controller(self) -> Controller | None:
        """The controller; None: open loop. Raises ControllerError where half of it is missing."""
        values = self.controller_values
        if values.get("loop") == "open":
            return None
        if self.columns.get("command") != "" and "drive" not in values:
            remedy = 'or give --kp and --ki ("unknown" where a torque is logged), or --loop open to work from torque to velocity'
            integral = () if any(key in values for key in INTEGRAL_TIMES) else ("ki",)
            self._refuse_unfilled("controller", ("kp", *integral, "position_gain"), remedy)
        return controller_of(values, self.general) if values else None

    def proportional_gain(self) -> float | None:
        """kp [N m s/rad], where it is given; raises ControllerError."""
        return proportional_gain_of(self.controller_values, self.general)

    def _refuse_unfilled(self, section: str, keys: Sequence[str], remedy: str) -> None:
        """Raises SettingsError where the file marks keys of a section FILL IN that neither it nor an option gives."""
        given = {"units": self.units, "controller": self.controller_values}[section]
        missing = [key for key in keys if (section, key) in self.unfilled and key not in given]
        if missing:
            where = self.unfilled[section, missing[0]]
            raise SettingsError(
                f"{where}: {' and '.join(missing)} of [{section}], marked FILL IN, {'is' if len(missing) == 1 else 'are'} not "
                f"filled in: write the value and remove the # before it, {remedy}"
            )

    def limits(self) -> Limits:
        """What an experiment may do. Raises SettingsError where the speed or the torque is missing."""
        missing = [name for name in ("speed", "torque") if name not in self.limit_values]
        if missing:
            raise SettingsError(
                f"the limits lack {' and '.join(missing)}: give --{' and --'.join(missing)} (or [limits] in the drive file), "
                "what the axis may do in an experiment"
            )
        return Limits(**self.limit_values)

    @property
    def expected(self) -> dict[str, tuple[float, float]]:
        """The ranges of the mechanism that the drive file knows."""
        return {name: self.space_values[name] for name in ("inertia", "resonance_hz", "damping") if name in self.space_values}

    def space(self, records: Sequence[Record], controller: Controller | None) -> SearchSpace | None:
        """The search space: what is given, the rest derived from the data; None where nothing is given."""
        given = dict(self.space_values)
        if not given:
            return None
        source = ", ".join(given)
        for name, other in (("inertia", "gain"), ("resonance_hz", "imaginary")):
            if name in given and other in given:
                raise SpaceError(f"{name} and {other} both say where to look for the same thing: leave one out")
        if "damping" in given and "inertia" not in given:
            raise SpaceError("damping is given without inertia: give both, their ratio bounds the real parts")
        looped = looped_over(records, controller, None)
        derived = space_of(looped.records, looped.controller)
        mechanics = {k: given.pop(k) for k in ("inertia", "resonance_hz", "damping") if k in given}
        if mechanics:
            # What is not given stands in with any value; the ranges that come from it are not used.
            top = derived.imaginary[1] / math.tau
            whole = SearchSpace.from_mechanics(
                mechanics.get("inertia", (1.0, 2.0)),
                mechanics.get("resonance_hz", (0.5 * top, top)),
                mechanics.get("damping"),
            )
            if "inertia" in mechanics:
                given.setdefault("gain", whole.gain)
            if "resonance_hz" in mechanics:
                given.setdefault("imaginary", whole.imaginary)
            if "resonance_hz" in mechanics or "damping" in mechanics:
                given.setdefault("real", whole.real)
        return dataclasses.replace(derived, **given, source=f"given: {source}; what is not, {derived.source}")


_PROPOSAL = re.compile(rb"time \[s\],(command \[(rad|m)/s\]|position_command \[(rad|m)\])\r?\n")


def _is_proposal(path: str) -> bool:
    """Whether a file is a command as `gaident experiment`, --next-command or a report writes it."""
    try:
        with open(path, "rb") as stream:
            # no decision: a format: how such a file begins
            return _PROPOSAL.fullmatch(stream.readline(64)) is not None
    except OSError:
        return False


def axes_in(path: str) -> tuple[str, ...]:
    """The names of the axes that a drive file contains, `[axes.NAME]`; none in a file of one axis. Raises ReadError."""
    axes = _parsed(path).get("axes", {})
    if not isinstance(axes, Mapping) or not all(isinstance(own, Mapping) for own in axes.values()):
        raise ReadError(f"{path}: axes is no table of axes: write [axes.x], and below it what belongs to x alone")
    return tuple(axes)


def read_drive_file(path: str, axis: str | None = None) -> dict[str, dict[str, Any]]:
    """drive.toml as {section: {key: value}}, checked; raises ReadError with file, key, value and remedy.

    axis: of a file of several axes the one that is meant; what stands below `[axes.NAME]` counts before what is common to all.
    """
    data, names = _parsed(path), axes_in(path)
    own = data.pop("axes", {})
    if axis is None and names:
        raise ReadError(f"{path}: this drive file contains the axes {', '.join(names)}: say which with --select NAME")
    common = _checked(data, path, "")
    if axis is None:
        return common
    one_of(axis, f"{path}: the axis", names, ReadError)
    special = _checked(own[axis], path, f"axes.{axis}.")
    return {name: {**values, **special[name]} for name, values in common.items()}


def _parsed(path: str) -> dict[str, Any]:
    """What a TOML file contains. Raises ReadError."""
    if sys.version_info >= (3, 11):  # no decision: what an argument may be: a version of Python
        import tomllib
    else:
        import tomli as tomllib
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ReadError(f"{path}: there is no such drive file; check --drive") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ReadError(f"{path}: cannot be read ({error}); give a TOML file in UTF-8") from None
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        otherwise = _as_toml_has_it(text, str(error))
        raise ReadError(f"{path}: {otherwise or f'this is not TOML ({error}); see gaident identify --help'}") from None
    if not data:
        raise ReadError(
            f"{path}: this drive file is empty: it contains {_SECTIONS} and {', '.join(KEYS[''])}; leave it out otherwise"
        )
    return data


def _checked(data: Mapping[str, Any], path: str, prefix: str) -> dict[str, dict[str, Any]]:
    """{section: {key: value}} of a whole file, or of one axis in it, whose sections begin with `prefix`."""
    _misplaced(data, path, "")
    top = known_keys(data, f"{path}: [{prefix[:-1]}]" if prefix else path, [*KEYS[""], *(s for s in KEYS if s)], (), ReadError)
    sections: dict[str, dict[str, Any]] = {"": {k: v for k, v in top.items() if k not in KEYS or not k}}
    for name in (s for s in KEYS if s):
        _misplaced(top.get(name, {}), path, name)
        sections[name] = known_keys(top.get(name, {}), f"{path}: [{prefix}{name}]", KEYS[name], (), ReadError)
    for name, values in sections.items():
        where = f"{path}: [{prefix}{name}] " if name else f"{path}: [{prefix[:-1]}] " if prefix else f"{path}: "
        for key, value in values.items():
            try:
                values[key] = KEYS[name][key](value, key)
            except ReadError as error:
                raise ReadError(f"{where}{error.marked}") from None
    return sections


def unfilled_of(path: str, axis: str | None = None) -> dict[tuple[str, str], str]:
    """(section, key) -> "file: line n" of what `gaident init` marked FILL IN and is commented out still; axis: see above."""
    found, section = {}, ""
    for number, line in enumerate(Path(path).read_text(encoding="utf-8").splitlines(), 1):
        if (header := _SECTION.match(line)) is not None:
            section = "" if header[1] == f"axes.{axis}" else header[1]
        elif (mark := _MARK.match(line)) is not None:
            found[section.removeprefix(f"axes.{axis}."), mark[1]] = f"{path}: line {number}"
    return found


def _as_toml_has_it(text: str, error: str) -> str:
    """What to write where TOML stumbled over 0,5 or .5 or 5. or 05, or a text without quotes; "" where it was something else."""
    at = re.search(r"at line (\d+)", error)
    lines = text.splitlines()
    number = int(at[1]) if at is not None else len(lines)
    line = lines[number - 1] if 0 < number <= len(lines) else ""
    if (comma := _WITH_COMMA.match(line)) is not None:
        key, value = comma.groups()
        return f"line {number}: {key} is {value}, with a decimal comma: write {value.replace(',', '.')}"
    key, _, rest = line.partition("=")
    value = _TEXT.sub('""', rest).partition("#")[0].strip()
    if _WORD.fullmatch(value):
        meant = value.lower() if value.lower() in ("true", "false") else f'"{value}"'
        return f"line {number}: {key.strip()} is {value}, which is no value in TOML: write {meant}"
    for found in _NUMBER.finditer(value):
        sign, whole, part, power = found[1], found[2], found[3], found[4] or ""
        if not (whole or part):
            continue
        written = sign + (whole.lstrip("0") or "0") + ("" if part is None else f".{part or 0}") + power
        if written != found[0]:
            return f"line {number}: {key.strip()} contains {found[0]}, which is no number in TOML: write {written}"
    return ""


_SECTION = re.compile(r"\s*\[([\w.]+)\]")
_MARK = re.compile(r"\s*#\s*(\w+)\s*=.*#\s*FILL IN\b")
_WITH_COMMA = re.compile(r"\s*([\w.-]+)\s*=\s*([-+]?\d+,\d+(?:[eE][-+]?\d+)?)\s*(?:#|$)")
_TEXT = re.compile(r""" "[^"]*" | '[^']*' """, re.VERBOSE)
_WORD = re.compile(r"[^\W\d][^={}\"'\\]*")
_NUMBER = re.compile(r"(?<![\w.+-])([-+]?)(\d*)(?:\.(\d*))?([eE][-+]?\d+)?(?![\w.])")
_SECTIONS = ", ".join(f"[{name}]" for name in KEYS if name)


def _misplaced(data: object, path: str, section: str) -> None:
    """Raises ReadError for a key that another section knows."""
    for key in data if isinstance(data, Mapping) else ():
        homes = [name for name in KEYS if key in KEYS[name]]
        if homes and section not in homes:
            where = " or ".join(f"below the line [{name}]" if name else "at the top, above the first [section]" for name in homes)
            found = f"in [{section}]" if section else "at the top"
            raise ReadError(f"{path}: {key} stands {found}: put it {where}")
