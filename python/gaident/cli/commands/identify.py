"""gaident identify."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

from gaident.cli.drive import drive_of, read_all
from gaident.cli.output import print_json, summary_of
from gaident.cli.responses import responses_of
from gaident.cli.result_files import ResultFiles, shown_block
from gaident.errors import SettingsError
from gaident.identification.identify import identify
from gaident.results.json_text import on_axis
from gaident.results.settings import Settings
from gaident.show.progress_bar import Progress

__all__ = ["identify_command"]


def identify_command(args: argparse.Namespace) -> None:
    drive = drive_of(args)
    if not args.logs and not args.response:
        raise SettingsError("there is no LOG: give a log file, or a measured frequency response with --response FILE")
    if not args.logs and args.kp is not None:
        raise SettingsError("--kp: a frequency response is that of the axis from its torque, in any loop; leave it out")
    files = ResultFiles.of(args, [*args.logs, *args.response])
    controller = drive.controller() if args.logs else None  # a response is that of the axis, whatever the loop
    settings = Settings.paper() if args.paper else Settings()
    settings = replace(settings, initial_state=args.initial_state)
    with (bar := Progress(None if args.quiet else sys.stderr)) as progress:
        records = read_all(drive, args.logs, controller, doing=bar.doing)
        responses = responses_of(args)
        bar.doing("deriving where to look from the data")
        idn = identify(
            [*records, *responses],
            controller,
            drive.space(records, controller) if records else None,
            settings,
            trials=args.trials,
            seed=args.seed,
            workers=args.workers,
            progress=progress,
        )
        written = files.write(idn, records, (), drive, lambda: idn.plot(records or None, drive.axis), bar.doing)
    if args.json:
        print_json({**on_axis(idn.to_dict(), drive.axis), **shown_block(idn, drive)})
        return
    print(summary_of(idn, drive.axis, drive.units_shown))
    if written:
        print(f"\nwritten: {', '.join(map(str, written))}")
