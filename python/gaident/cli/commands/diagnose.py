"""gaident diagnose."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import replace
from itertools import starmap
from pathlib import Path
from typing import Any

from gaident.axis import velocity_unit
from gaident.cli.accuracy import accuracy_of
from gaident.cli.drive import drive_of, read_all
from gaident.cli.output import print_json, proposal_csv, target_of, write
from gaident.cli.remedies import in_options
from gaident.cli.result_files import ResultFiles, shown_block
from gaident.diagnosis.diagnose import diagnose
from gaident.drive.drive_file import Drive, axes_in
from gaident.errors import GaidentError, SettingsError
from gaident.identification.replay.driven_records import torque_driven
from gaident.identification.space import derive_space
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.results.json_text import on_axis
from gaident.results.store import load
from gaident.results.what_if import Stability
from gaident.show.progress_bar import Progress
from gaident.show.wording import cause_words, either, number, table

__all__ = ["diagnose_command"]

Result = tuple[Drive, Diagnosis, Stability | None]


def diagnose_command(args: Namespace) -> int | None:
    names = () if args.drive is None else axes_in(args.drive)
    if names and (args.select is None or len(args.select) > 1):
        return _several(args, args.select or names)
    drive, dia, shown, written = _diagnosed(args)
    if args.json:
        print_json(_data(drive, dia, shown))
        return None
    print(dia.summary(drive.axis, drive.units_shown))
    if shown is not None:
        print(f"\n{shown.summary()}")
    if args.next_command is not None and dia.next_experiment is None:
        print(f"\nnot written: {args.next_command}, as there is no next experiment to propose")
    if written:
        print(f"\nwritten: {', '.join(map(str, written))}")
    return None


def _data(drive: Drive, dia: Diagnosis, shown: Stability | None) -> dict[str, Any]:
    """A diagnosis as --json prints it: in the words and units of its axis, and in those of [show]."""
    varied = {} if shown is None else {"stability": shown.to_dict()}
    return {**on_axis(dia.to_dict(), drive.axis), **shown_block(dia, drive), **varied}


def _several(args: Namespace, names: Sequence[str]) -> int | None:
    """Every axis by itself: a table with a row for each, then their summaries. An axis that cannot be diagnosed is a row too."""
    if args.model is not None:
        raise SettingsError("--model is the identification of one axis: name the axis with --select, or leave it out")
    found: dict[str, Result | GaidentError] = {}
    written: list[Path] = []
    for name in names:
        paths = {option: getattr(args, option) for option in ("out", "plot", "report", "next_command")}
        of_axis = {o: str(Path(path).with_stem(f"{Path(path).stem}_{name}")) for o, path in paths.items() if path is not None}
        own = Namespace(**{**vars(args), **of_axis, "select": [name]})
        try:
            drive, dia, shown, more = _diagnosed(own)
        except GaidentError as error:
            found[name] = error
        else:
            found[name] = drive, dia, shown
            written += more
    failed = sum(isinstance(result, GaidentError) for result in found.values())
    if args.json:
        said = {n: {"error": in_options(r)} if isinstance(r, GaidentError) else _data(*r) for n, r in found.items()}
        print_json({"schema": "gaident/axes", "schema_version": 1, "axes": said})
        return 1 if failed else None
    print("\n".join(table([("axis", "verdict", "cause", "rmse, linear", "extended", ""), *starmap(_row, found.items())], "")))
    for name, result in found.items():
        if not isinstance(result, GaidentError):
            drive, dia, shown = result
            varied = "" if shown is None else f"\n\n{shown.summary()}"
            print(f"\n--- {name}\n\n{dia.summary(drive.axis, drive.units_shown)}{varied}")
    if written:
        print(f"\nwritten: {', '.join(map(str, written))}")
    return 1 if failed else None


def _row(name: str, result: Result | GaidentError) -> tuple[str, ...]:
    if isinstance(result, GaidentError):
        return name, "not diagnosed", in_options(result), "", "", ""
    drive, dia, _ = result
    found = (either(f, dia, drive.axis) if f.alternatives else cause_words(f, dia, drive.axis) for f in dia.causes)
    causes = ", ".join(found) or "none"
    return name, dia.verdict, causes, number(dia.before.rmse), number(dia.after.rmse), velocity_unit(drive.axis)


def _diagnosed(args: Namespace) -> tuple[Drive, Diagnosis, Stability | None, list[Path]]:
    """(the drive, its diagnosis, what variations of its records say where that is asked for, the files that were written)."""
    drive = drive_of(args)
    sources = [*args.logs, *(args.validation or []), *([] if args.model is None else [args.model])]
    following = target_of(args.next_command, sources)
    files = ResultFiles.of(args, sources, **{"--next-command": following})
    accuracy, drive = accuracy_of(args.accuracy, drive)
    controller = drive.controller()
    with (bar := Progress(None if args.quiet else sys.stderr)) as progress:
        records = read_all(drive, args.logs, controller, doing=bar.doing)
        validation = read_all(drive, args.validation, controller, doing=bar.doing) if args.validation else None
        idn = None
        if args.model is not None:
            loaded = load(args.model)
            if not isinstance(loaded, Identification):
                raise SettingsError(f"--model {args.model} contains no identification: give what gaident identify --out saved")
            idn = loaded
        bar.doing("looking at the records")
        if idn is None:
            # Numbers that are not known are estimated from a logged torque, which drives the model here.
            driven = torque_driven(records, controller if controller is None or not controller.unknown else None)
            derive_space(driven.records, driven.loop)  # wrong signs and units are found before anything is searched for
        dia = diagnose(
            records,
            controller,
            identification=idn,
            validation=validation,
            noise=args.noise,
            bootstrap=args.bootstrap,
            seed=args.seed,
            progress=progress,
            axis=drive.axis,
            pitch=drive.pitch,
            accuracy=accuracy,
            quick=args.quick,
            expected=drive.expected,
        )
        shown = dia.stability(records, drive.pitch, progress) if args.stability else None
        dia = replace(dia, varied=shown)
        written = files.write(dia, records, validation or (), drive, lambda: dia.plot(axis=drive.axis), bar.doing, shown)
    if following is not None and dia.next_experiment is not None:
        write(following, proposal_csv(dia.next_experiment, drive.axis).encode())
        written.append(following)
    return drive, dia, shown, written
