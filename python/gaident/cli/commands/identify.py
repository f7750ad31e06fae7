"""gaident identify."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace

from gaident.axis import say
from gaident.cli.drive import drive_of, read_all
from gaident.cli.output import print_json, summary_of
from gaident.cli.result_files import ResultFiles, shown_block
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.diagnosis.controller.replay import Replay, replay
from gaident.identification.identify import identify
from gaident.results.json_text import on_axis
from gaident.results.settings import Settings
from gaident.show.progress_bar import Progress

__all__ = ["identify_command"]

_REPLAYED = 1 << 18  # no decision: samples of a log on which the controller is run again; work


def identify_command(args: argparse.Namespace) -> None:
    drive = drive_of(args)
    files = ResultFiles.of(args, args.logs)
    controller = drive.controller()
    settings = Settings.paper() if args.paper else Settings()
    settings = replace(settings, initial_state=args.initial_state)
    with (bar := Progress(None if args.quiet else sys.stderr)) as progress:
        records = read_all(drive, args.logs, controller, doing=bar.doing)
        bar.doing("deriving where to look from the data")
        idn = identify(
            records,
            controller,
            drive.space(records, controller),
            settings,
            trials=args.trials,
            seed=args.seed,
            workers=args.workers,
            progress=progress,
        )
        # What the logs say of the controller, which the search takes as given.
        off = [
            say("{}{}{}", f"{name}: " if len(records) > 1 else "", said.sentence, _instead(said, controller))
            for name, said in _replayed(records, controller)
        ]
        idn = replace(idn, warnings=(*off, *idn.warnings))
        written = files.write(idn, records, (), drive, lambda: idn.plot(records, drive.axis), bar.doing)
    if args.json:
        print_json({**on_axis(idn.to_dict(), drive.axis), **shown_block(idn, drive)})
        return
    print(summary_of(idn, drive.axis, drive.units_shown))
    if written:
        print(f"\nwritten: {', '.join(map(str, written))}")


def _replayed(records: Sequence[Record], controller: Controller | None) -> list[tuple[str, Replay]]:
    """(name, what its replay says) of the records, long ones by their start, whose torque does not follow from the loop."""
    loop = bare_pi(controller)
    if loop is None:  # of any other, identify says itself whether the torque follows
        return []
    said = [(rec.name, replay(rec[:_REPLAYED], loop)) for rec in records if rec.torque is not None]
    return [(name, r) for name, r in said if r.follows is False]


def _instead(said: Replay, given: Controller | None) -> str:
    """The options of the controller that the log shows, where a PI with a trapezoidal integral has what differs."""
    found, loop = said.controller, bare_pi(given)
    if found is None or loop is None or said.cause == "scale":  # a wrong unit is not to be mended by gains
        return ""
    options = (("kp", found.kp, loop.kp), ("ki", found.ki, loop.ki), ("torque-limit", found.torque_limit, loop.torque_limit))
    return f" Give {' '.join(f'--{name} {value:.6g}' for name, value, old in options if value is not None and value != old)}."
