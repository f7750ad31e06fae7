"""What the options say of the axis, over its drive file, and its logs read that way."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence
from typing import Any

from gaident.checks import one_of
from gaident.control.controller import Controller
from gaident.control.words import LOOPS
from gaident.data.record import Record
from gaident.drive.drive_file import COLUMNS, KEYS, Drive, read_drive_file, unfilled_of
from gaident.errors import ControllerError, SettingsError
from gaident.show.units import scales_of

__all__ = ["drive_of", "read_all"]


def drive_of(args: argparse.Namespace) -> Drive:
    """The drive file, if one is named, with the options over it."""
    sections: dict[str, dict[str, Any]] = {name: {} for name in KEYS}
    unfilled: dict[tuple[str, str], str] = {}
    if getattr(args, "drive", None) is not None:
        axis = _selected(args)
        sections, unfilled = read_drive_file(args.drive, axis), unfilled_of(args.drive, axis)
    for name, keys in KEYS.items():
        if name in ("columns", "units", "shift"):
            sections[name].update(_assignments(getattr(args, name, None) or [], f"--{name}"))
            continue
        if name in ("show", "report"):  # of the file alone: --torque is a limit of `gaident experiment`, no unit
            continue
        for key in keys:
            if (name, key) == ("controller", "drive"):  # --drive names the file
                continue
            value = getattr(args, key, None)
            if value is not None:  # a number with its unit is read as the drive file's
                sections[name][key] = keys[key](value, key) if not name and isinstance(value, str) else value
    if sections["controller"].get("loop") is not None:
        one_of(sections["controller"]["loop"], "loop", (*LOOPS, "open"), ControllerError)
    sections["units"] = {k: _as_number(v) for k, v in sections["units"].items()}
    sections["shift"] = {k: _as_whole(v, f"--shift {k}") for k, v in sections["shift"].items()}
    drive = Drive(
        sections[""],
        sections["columns"],
        sections["units"],
        sections["controller"],
        sections["space"],
        sections["limits"],
        sections["shift"],
        sections["show"],
        {key: value for key, value in sections["report"].items() if value},
        unfilled,
    )
    scales_of(drive.units_shown, drive.axis)  # a unit that is none of this axis is said before anything is computed
    return drive


def _selected(args: argparse.Namespace) -> str | None:
    """The axis that --select names. Raises SettingsError for several."""
    names = getattr(args, "select", None) or []
    if len(names) > 1:
        raise SettingsError(f"--select {' '.join(names)}: only gaident diagnose takes several axes at once; name one")
    return names[0] if names else None


def read_all(
    drive: Drive,
    logs: Sequence[str],
    controller: Controller | None,
    measured: bool = True,
    doing: Callable[[str], None] = lambda message: None,
) -> list[Record]:
    """The logs, each with what drives its simulation; raises SettingsError where that is missing.

    doing: told which log is being read.
    """
    named = []
    for log in logs:
        doing(f"reading {log}")
        named += [(log, rec) for rec in drive.records(log, measured)]
    for log, rec in named:
        if controller is not None and controller.driven_by == "position_command":
            if rec.position_command is None:
                raise SettingsError(
                    f"{log}: there is no position_command, which drives the loop with a position controller: name its column "
                    "(--columns position_command=...), or leave the position controller out"
                )
        elif controller is not None and rec.command is None:
            raise SettingsError(
                f"{log}: there is no command, which drives the loop with a controller: name its column "
                "(--columns command=...), or use --loop open to work from torque to velocity"
            )
        if controller is None and rec.torque is None:
            raise SettingsError(
                f"{log}: there is no torque, which drives the model in open loop: name its column "
                "(--columns torque=...), or give the controller (--kp, --ki)"
            )
    return [rec for _, rec in named]


def _assignments(texts: Sequence[str], option: str) -> dict[str, str]:
    """{"velocity": "w", "torque": "data[:,4]"} of ["velocity=w,torque=data[:,4]"]."""
    found = {}
    for text in texts:
        for part in re.split(r",(?=\s*\w+\s*=)", text):
            name, sign, value = part.partition("=")
            if not sign:
                raise SettingsError(f"{option} {text!r}: write channel=value, for example {option} velocity=w")
            found[one_of(name.strip(), f"{option}: channel", COLUMNS, SettingsError)] = value.strip()
    return found


def _as_number(text: str | float) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text


def _as_whole(text: str | int, option: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise SettingsError(f"{option}={text}: give a whole number of samples, negative for earlier") from None
