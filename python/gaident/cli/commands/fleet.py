"""gaident fleet."""

from __future__ import annotations

import sys
from argparse import Namespace
from dataclasses import asdict

from gaident.cli.drive import drive_of
from gaident.cli.output import print_json
from gaident.errors import SettingsError
from gaident.fleets.fleet import fleet
from gaident.show.progress_bar import Progress

__all__ = ["fleet_command"]


def fleet_command(args: Namespace) -> int:
    if args.resume and args.again:
        raise SettingsError("--resume keeps the results that are there, --again makes them again: leave one of them out")
    drive = drive_of(args)
    with Progress(None if args.quiet else sys.stderr) as progress:
        found = fleet(
            args.logs,
            out=args.out,
            resume=not args.again,
            drive=drive,
            names=args.names,
            method=args.method,
            quick=args.quick,
            temperature=args.temperature,
            seed=args.seed,
            workers=args.workers,
            progress=progress,
        )
    if args.json:
        print_json({"schema": "gaident/fleet", "schema_version": 1, **asdict(found)})
    else:
        print(found.summary())
        told = found.first_failed()
        for row in told:
            print(f"  failed: {row}")
        if found.failed > len(told) > 0:
            print(f"  and {found.failed - len(told)} more")
    return 0 if found.done else 1
