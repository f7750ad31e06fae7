"""The commands around logs: columns, init, experiment, doctor, completion."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gaident import doctor
from gaident.cli.output import print_json, proposal_csv, target_of, write
from gaident.data.listing import columns, printable
from gaident.data.readers import read_columns
from gaident.diagnosis.experiments import first_experiment
from gaident.drive_file import Drive
from gaident.drive_init import draft
from gaident.errors import SettingsError

__all__ = ["log_commands"]

_LOOKED_INTO = 1 << 26  # bytes of a log whose values `init` compares, too


def log_commands(drive_of: Callable[[argparse.Namespace], Drive]) -> dict[str, Callable[[argparse.Namespace], int | None]]:
    """name -> what runs it; `drive_of`: the drive file with the options over it."""

    def experiment(args: argparse.Namespace) -> None:
        _experiment(args, drive_of(args))

    return {"columns": _columns, "init": _init, "experiment": experiment, "doctor": _doctor, "completion": _completion}


def _text_options(args: argparse.Namespace) -> dict[str, Any]:
    return {name: getattr(args, name) for name in ("delimiter", "decimal", "skip", "encoding")}


def _columns(args: argparse.Namespace) -> None:
    found = [columns(log, **_text_options(args)) for log in args.logs]
    if args.json:
        listed = [listing.to_dict() for listing in found]
        print_json(listed[0] if len(listed) == 1 else {"schema": "gaident/columns", "schema_version": 1, "logs": listed})
    else:
        print("\n\n".join(map(str, found)))


def _init(args: argparse.Namespace) -> None:
    target = target_of(args.out, [args.log])
    assert target is not None
    if target.exists() and not args.force:
        raise SettingsError(f"{target}: there is such a file already; name another one with --out, or overwrite it with --force")
    options = _text_options(args)
    listing = columns(args.log, **options)
    small = Path(args.log).stat().st_size <= _LOOKED_INTO
    found = draft(listing, read_columns(args.log, **options) if small else {})
    told = {key: value for key, value in options.items() if value is not None}
    text = found.text
    if told:
        lines = "\n".join(f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in told.items())
        text = text.replace("\n[columns]", f"\n{lines}\n\n[columns]", 1)
    write(target, text.encode())
    if args.json:
        print_json({
            "schema": "gaident/init", "schema_version": 1, "written": str(target), "channels": dict(found.channels),
            "fill_in": list(found.fill_in),
        })  # fmt: skip
        return
    print(f"written: {target}")
    for channel, name in found.channels.items():
        print(f"  {channel.ljust(9)}{printable(name)}")
    if found.fill_in:
        print("to be filled in, marked FILL IN (write the value, remove the # before it):")
        for line in found.fill_in:
            print(f"  {line}")
    then = "then, once that is done" if found.fill_in else "then"
    print(f"{then}: gaident identify {shlex.quote(str(args.log))} --drive {shlex.quote(str(target))}")


def _experiment(args: argparse.Namespace, drive: Drive) -> None:
    from gaident.show.wording import sentence

    target = target_of(args.out, [] if args.drive is None else [args.drive])
    dt = drive.general.get("dt")
    if dt is None:
        raise SettingsError("dt is missing: give --dt (or dt in the drive file), the sample time of the command in seconds")
    inertia = drive.space_values.get("inertia")
    heaviest = None if inertia is None else inertia[1]  # what its ramps ask for must not exceed the torque
    proposal = first_experiment(dt, drive.limits(), heaviest, drive.controller_values.get("kp"))
    if args.json:
        print_json({"schema": "gaident/experiment", "schema_version": 1, **proposal.to_dict()})
        return
    text = proposal_csv(proposal, drive.axis)
    said = sentence(proposal.reason, drive.axis)
    for missing, option in (("kp", "--kp"), ("the inertia", "--inertia LOW HIGH"), ("the mass", "--inertia LOW HIGH")):
        said = said.replace(f"give {missing} to", f"give {missing} ({option}, or in the drive file) to")
    said = f"{len(proposal.command)} samples, {len(proposal.command) * proposal.dt:.3g} s: {said}"
    if target is None:
        print(text, end="")
        if not args.quiet:
            print(said, file=sys.stderr)  # what it may ask of the axis, beside the CSV
        return
    write(target, text.encode())
    print(f"{said}\nwritten: {target}")


def _doctor(args: argparse.Namespace) -> int:
    found = doctor.examine()
    if args.json:
        print_json(found.to_dict())
    else:
        print(found)
    return 1 if found.flaws else 0


def _completion(args: argparse.Namespace) -> None:
    import shtab

    for parser in _parsers(args.whole_parser):
        for action in parser._actions:
            takes_file = action.metavar in ("FILE", "LOG", "PATH", "MODEL.json")
            takes_folder = action.metavar == "DIR"
            if takes_file or takes_folder:
                action.complete = shtab.FILE if takes_file else shtab.DIRECTORY  # type: ignore[attr-defined]
    print(shtab.complete(args.whole_parser, args.shell))


def _parsers(parser: argparse.ArgumentParser) -> list[argparse.ArgumentParser]:
    """The parser and those of its commands."""
    found = [parser]
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for short in action._choices_actions:  # shells show one line of a command
                action.choices[short.dest].description = short.help
            found += action.choices.values()
    return found
