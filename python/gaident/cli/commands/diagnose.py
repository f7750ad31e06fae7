"""gaident diagnose."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

from gaident.cli.commands.report import write_report
from gaident.cli.drive import drive_of, read_all, reading_notes
from gaident.cli.options import PICTURES
from gaident.cli.output import apart, naming, print_json, proposal_csv, save_figure, target_of, write
from gaident.diagnosis.diagnose import diagnose
from gaident.errors import SettingsError
from gaident.identification.space import derive_space
from gaident.results.identification import Identification
from gaident.results.store import load
from gaident.show.progress_bar import Progress

__all__ = ["diagnose_command"]


def diagnose_command(args: argparse.Namespace) -> None:
    drive = drive_of(args)
    sources = [*args.logs, *(args.validation or []), *([] if args.model is None else [args.model])]
    out = target_of(args.out, sources)
    plot = target_of(args.plot, sources, PICTURES)
    following = target_of(args.next_command, sources)
    page = target_of(args.report, sources)
    apart({"--out": out, "--plot": plot, "--report": page, "--next-command": following})
    controller = drive.controller()
    records = read_all(drive, args.logs, controller)
    validation = read_all(drive, args.validation, controller) if args.validation else None
    idn = None
    if args.model is not None:
        loaded = load(args.model)
        if not isinstance(loaded, Identification):
            raise SettingsError(f"--model {args.model} holds no identification: give what gaident identify --out saved")
        idn = loaded
    if idn is None:
        derive_space(records, controller)  # wrong signs and units are found before anything is searched for
    with Progress(None if args.quiet else sys.stderr) as progress:
        dia = diagnose(
            records,
            controller,
            identification=idn,
            validation=validation,
            noise=args.noise,
            bootstrap=args.bootstrap,
            seed=args.seed,
            progress=progress,
        )
    dia = replace(dia, notes=(*reading_notes(drive, [*records, *(validation or ())]), *dia.notes))
    written = []
    if out is not None:
        with naming(out):
            dia.save(out)
        written.append(out)
    if plot is not None:
        save_figure(dia.plot(axis=drive.axis), plot)
        written.append(plot)
    if page is not None:
        write_report(dia, page, records, validation or (), drive.axis)
        written.append(page)
    if following is not None and dia.next_experiment is not None:
        write(following, proposal_csv(dia.next_experiment, drive.axis).encode())
        written.append(following)
    if args.json:
        print_json(dia.to_dict())
        return
    print(dia.summary(drive.axis))
    if following is not None and following not in written:
        print(f"\nnot written: {following}, as there is no next experiment to propose")
    if written:
        print(f"\nwritten: {', '.join(map(str, written))}")
