"""The arguments that messages of the library name, as options of the command line."""

from __future__ import annotations

import shlex

from gaident.arguments import Argument
from gaident.errors import GaidentError

__all__ = ["in_options"]

# Options with the name of the argument.
SAME_NAME = {
    *("dt", "delimiter", "decimal", "skip", "encoding", "decimate", "resample", "pieces", "loop", "ki", "kp"),
    *(
        "counts_per_turn",
        "torque_constant",
        "rated_torque",
        "torque_per_volt",
        "reference_speed",
        "resistance",
        "inductance",
        "gear_ratio",
        "load_side",
        "torque_is",
        "torque_log",
        "phase_margin",
        "gain_margin",
        "torque_noise",
        "speed",
        "compiler",
    ),
}
_OTHER_NAME = {"start": "from", "stop": "to"}
WHOLE = {
    ("controller", "None"): "--loop open",
    ("controller", "PI(...)"): "--kp and --ki",
    ("controller", "PI(kp=..., ki=...)"): "--kp and --ki",
    ("loop", "'continuous'"): "--loop continuous",
    ("binary", "False"): "--sources",
}


def in_options(error: GaidentError) -> str:
    """The message of an error for the command line: `columns={'velocity': ...}` is `--columns velocity=...` there."""
    return "".join(part if isinstance(part, str) else _option(part) for part in error.parts)


def _option(a: Argument) -> str:
    if (a.name, a.value) in WHOLE:
        return WHOLE[a.name, a.value]
    if a.name in ("columns", "units", "shift", "response_columns", "response_units") and a.key:
        value = "" if a.value == "None" else a.value.strip("'")
        return f"--{a.name.replace('_', '-')} {shlex.quote(f'{a.key}={value}')}"
    if a.name in ("p", "q"):
        return f"--{a.name} {a.value.strip('()').replace(', ', '..')}"
    if a.name in _OTHER_NAME:
        return f"--{_OTHER_NAME[a.name]} {a.value}"
    name = "velocity-cutoff" if a.name == "velocity_cutoff_hz" else a.name.replace("_", "-") if a.name in SAME_NAME else ""
    return f"--{name} {a.value}".rstrip() if name else str(a)
