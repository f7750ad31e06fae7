"""gaident experiment."""

from __future__ import annotations

import argparse
import sys

from gaident.axis import said
from gaident.cli.drive import drive_of
from gaident.cli.output import print_json, proposal_csv, target_of, write
from gaident.diagnosis.experiments.first_experiment import first_experiment
from gaident.errors import SettingsError

__all__ = ["experiment_command"]


def experiment_command(args: argparse.Namespace) -> None:
    drive = drive_of(args)
    target = target_of(args.out, [] if args.drive is None else [args.drive])
    dt = drive.general.get("dt")
    if dt is None:
        raise SettingsError("dt is missing: give --dt (or dt in the drive file), the sample time of the command in seconds")
    inertia = drive.space_values.get("inertia")
    heaviest = None if inertia is None else inertia[1]  # what its ramps ask for must not exceed the torque
    kp = drive.proportional_gain()
    proposal = first_experiment(dt, drive.limits(), heaviest, kp, drive.axis)
    if args.json:
        print_json({"schema": "gaident/experiment", "schema_version": 1, **proposal.to_dict()})
        return
    text = proposal_csv(proposal, drive.axis)
    options = [option for value, option in ((kp, "--kp"), (inertia, "--inertia LOW HIGH")) if value is None]
    remedy = f" To give {'them' if len(options) > 1 else 'it'}: {' and '.join(options)}, or the drive file." if options else ""
    reason = f"{said(proposal.reason, drive.axis)}{remedy}"
    told = f"{len(proposal.command)} samples, {len(proposal.command) * proposal.dt:.3g} s: {reason}"
    if target is None:
        print(text, end="")
        if not args.quiet:
            print(told, file=sys.stderr)  # what it may ask of the axis, beside the CSV
        return
    write(target, text.encode())
    print(f"{told}\nwritten: {target}")
