"""gaident report, and --report of the other commands."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from gaident.cli.drive import drive_of
from gaident.cli.output import print_json, target_of
from gaident.cli.result_files import check_report, write_report
from gaident.data.record import Record
from gaident.drive.drive_file import Drive, axes_in
from gaident.errors import GaidentError
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.results.store import load

__all__ = ["report_command"]


def report_command(args: argparse.Namespace) -> None:
    """`gaident report RESULT.json... [LOG...]`."""
    named = [args.result, *(path for path in args.logs if path.endswith(".json"))]
    logs, validation_logs = [path for path in args.logs if not path.endswith(".json")], args.validation or []
    target = target_of(args.out, [*named, *logs, *validation_logs])
    assert target is not None
    check_report()
    results = {path: _loaded(path) for path in named}
    drives = _drives(args, len(results) > 1)
    records, validation = ([rec for log in listed for rec in _read(log, drives)] for listed in (logs, validation_logs))
    known = {digest for result in results.values() for digest in _known(result)}
    if len(results) == 1:
        shown: Diagnosis | Identification | dict[str, Diagnosis | Identification] = results[named[0]]
    else:
        stems = [Path(path).stem for path in results]
        shown = {stem if stems.count(stem) == 1 else path: results[path] for stem, path in zip(stems, results, strict=True)}
        records = [rec for rec in records if rec.digest in known or len(drives) == 1]
    size = write_report(shown, target, records, validation, drives[0], not args.pictures, remedies=not args.no_remedies)
    if args.json:
        print_json({"schema": "gaident/report", "schema_version": 1, "path": str(target), "bytes": size})
        return
    unknown = [r.name for r in (*records, *validation) if r.digest not in known]
    if unknown:
        said = "the page says so" if len(results) == 1 else "they are left out"
        which = "this result" if len(results) == 1 else "any of these results"
        print(f"not the data of {which}, by their hash: {', '.join(unknown)}; {said}")
    # no decision: printed: a size
    print(f"written: {target} ({f'{size / 1e6:.1f} MB' if size > 1e6 else f'{size / 1e3:.0f} kB'})")


def _loaded(path: str) -> Diagnosis | Identification:
    result = load(path)
    if not isinstance(result, (Diagnosis, Identification)):
        raise GaidentError(f"{path}: a record, no result; give what `gaident identify` or `diagnose` wrote with --out")
    return result


def _drives(args: argparse.Namespace, several: bool) -> list[Drive]:
    """The drive; of a file with several axes, for several results, each axis that --select names, or all."""
    names = axes_in(args.drive) if several and args.drive is not None else ()
    chosen = args.select or names
    if not names:
        return [drive_of(args)]
    return [drive_of(argparse.Namespace(**{**vars(args), "select": [name]})) for name in chosen]


def _read(log: str, drives: Sequence[Drive]) -> list[Record]:
    """The records of a log, as each of the axes has them; raises where none of them can read it."""
    found: list[Record] = []
    failed: GaidentError | None = None
    for drive in drives:
        try:
            found += drive.records(log)
        except GaidentError as error:
            failed = failed or error
    if failed is not None and not found:
        raise failed
    return found


def _known(result: Diagnosis | Identification) -> set[str]:
    more = result.validation_digests if isinstance(result, Diagnosis) else ()
    return {*result.digests, *more}
