"""gaident map: the friction of an axis at the speeds that its logs hold."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.checks import check_installed
from gaident.cli.drive import drive_of
from gaident.cli.output import naming, print_json, save_figure, target_of
from gaident.data.record import Record
from gaident.drive.drive_file import Drive
from gaident.drive.temperature import temperature_of
from gaident.errors import SettingsError
from gaident.remedies.friction_map import friction_map
from gaident.results.json_text import on_axis
from gaident.show.progress_bar import Progress

__all__ = ["map_command"]

PARTS = ("from", "to", "pieces")
"""What makes a record of a part of a log."""


def map_command(args: argparse.Namespace) -> None:
    """`gaident map LOG...`."""
    drive = drive_of(args)
    targets = _targets(args)
    more: dict[str, Any] = {} if args.bins is None else {"bins": args.bins}
    with (bar := Progress(None if args.quiet else sys.stderr)):
        records, temperatures = [], []
        for log in args.logs:
            bar.doing(f"reading {log}")
            for rec in drive.records(log):
                if rec.torque is None:
                    remedy = "name its column (--columns torque=...)"
                    raise SettingsError(f"{log}: there is no torque, which shows the friction: {remedy}")
                records.append(rec)
                temperatures.append(None if args.temperature is None else _temperature(drive, log, args.temperature, rec))
        bar.doing("looking for held speeds")
        if args.temperature is not None:
            more["temperature"] = temperatures
        found = friction_map(records, inertia=args.inertia, axis=drive.axis, **more)
    if targets:
        table, bins, data, picture = targets
        with naming(table.parent):
            found.to_csv(table, "plateaus")
            found.to_csv(bins)
            found.save(data)
        save_figure(found.plot(), picture)
    if args.json:
        print_json(on_axis(found.to_dict(), drive.axis))
        return
    print(found.summary())
    for path in targets:
        print(f"written: {path}")


def _targets(args: argparse.Namespace) -> list[Path]:
    """The files of --out DIR, looked at before the work begins; the folder is made where there is none."""
    if args.out is None:
        return []
    check_installed(("matplotlib",), "pictures", "a picture")
    folder = Path(args.out)
    folder.mkdir(parents=True, exist_ok=True)
    names = ("friction_map.csv", "bins.csv", "friction_map.json", "friction_map.png")
    found = [target_of(str(folder / name), args.logs) for name in names]
    return [target for target in found if target is not None]


def _temperature(drive: Drive, log: str, name: str, rec: Record) -> NDArray[np.float64] | float | None:
    """The temperature over a record of a whole log, else its mean; None where the log has no value of it."""
    known = temperature_of(log, name, drive.general)
    if not known.size or any(drive.general.get(part) for part in PARTS):
        return float(known.mean()) if known.size else None
    return np.interp(np.linspace(0.0, 1.0, len(rec)), np.linspace(0.0, 1.0, len(known)), known)
