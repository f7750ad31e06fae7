"""gaident report, and --report of the other commands."""

from __future__ import annotations

import argparse

from gaident.cli.drive import drive_of
from gaident.cli.output import print_json, target_of
from gaident.cli.result_files import write_report
from gaident.errors import GaidentError
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.results.store import load

__all__ = ["report_command"]


def report_command(args: argparse.Namespace) -> None:
    """`gaident report RESULT.json [LOG...]`."""
    drive = drive_of(args)
    held = args.validation or []
    target = target_of(args.out, [args.result, *args.logs, *held])
    assert target is not None
    result = load(args.result)
    if not isinstance(result, (Diagnosis, Identification)):
        raise GaidentError(f"{args.result}: a record, no result; give what `gaident identify` or `diagnose` wrote with --out")
    records, validation = ([rec for log in logs for rec in drive.records(log)] for logs in (args.logs, held))
    size = write_report(result, target, records, validation, drive, not args.pictures)
    if args.json:
        print_json({"schema": "gaident/report", "schema_version": 1, "path": str(target), "bytes": size})
        return
    unknown = [r.name for r in (*records, *validation) if r.digest not in _known(result)]
    if unknown:
        print(f"not the data of this result, by their hash: {', '.join(unknown)}; the page says so")
    # no decision: how a size is printed
    print(f"written: {target} ({f'{size / 1e6:.1f} MB' if size > 1e6 else f'{size / 1e3:.0f} kB'})")


def _known(result: Diagnosis | Identification) -> set[str]:
    more = result.validation_digests if isinstance(result, Diagnosis) else ()
    return {*result.digests, *more}
