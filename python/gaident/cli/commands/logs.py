"""gaident columns, and gaident init."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from typing import Any

from gaident.cli.output import print_json, program, target_of, write
from gaident.data.listing import columns, printable
from gaident.data.readers import read_columns
from gaident.drive.draft import draft
from gaident.errors import SettingsError

__all__ = ["columns_command", "init_command"]

_LOOKED_INTO = 1 << 26  # no decision: memory; bytes of a log whose values `init` compares, too


def columns_command(args: argparse.Namespace) -> None:
    found = [columns(log, **_text_options(args)) for log in args.logs]
    if args.json:
        listed = [listing.to_dict() for listing in found]
        print_json(listed[0] if len(listed) == 1 else {"schema": "gaident/columns", "schema_version": 1, "logs": listed})
    else:
        print("\n\n".join(map(str, found)))


def init_command(args: argparse.Namespace) -> None:
    target = target_of(args.out, [args.log])
    assert target is not None
    if target.exists() and not args.force:
        raise SettingsError(f"{target}: there is such a file already; name another one with --out, or overwrite it with --force")
    options = _text_options(args)
    listing = columns(args.log, **options)
    small = Path(args.log).stat().st_size <= _LOOKED_INTO
    told = {key: value for key, value in options.items() if value is not None}
    found = draft(listing, read_columns(args.log, **options) if small else {}, told)
    write(target, found.text.encode())
    if args.json:
        print_json({
            "schema": "gaident/init", "schema_version": 1, "written": str(target), "channels": dict(found.channels),
            "torque_is": found.torque_is, "fill_in": list(found.fill_in),
        })  # fmt: skip
        return
    print(f"written: {target}")
    width = 1 + max(map(len, found.channels), default=0)
    for channel, name in found.channels.items():
        kind = f" ({found.torque_is})" if channel == "torque" and found.torque_is is not None else ""
        print(f"  {channel.ljust(width)}{printable(name)}{kind}")
    if found.fill_in:
        print("to be filled in, marked FILL IN (write the value, remove the # before it):")
        for line in found.fill_in:
            print(f"  {line}")
    if any(line.startswith("controller.") for line in found.fill_in):
        print("also look at period, rule and torque_limit below [controller]: the torque follows from the drive's own alone")
    then = "then, once that is done" if found.fill_in else "then"
    print(f"{then}: {program()} diagnose {shlex.quote(str(args.log))} --drive {shlex.quote(str(target))}")


def _text_options(args: argparse.Namespace) -> dict[str, Any]:
    return {name: getattr(args, name) for name in ("delimiter", "decimal", "skip", "encoding")}
