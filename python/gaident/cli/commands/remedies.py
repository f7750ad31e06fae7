"""gaident retune and gaident feedforward: what to change in the drive."""

from __future__ import annotations

import argparse

from gaident.cli.drive import drive_of
from gaident.cli.options import PICTURES
from gaident.cli.output import apart, naming, print_json, save_figure, target_of
from gaident.errors import SettingsError
from gaident.remedies.feedforward import feedforward
from gaident.remedies.retune import retune
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.results.json_text import on_axis
from gaident.results.store import load

__all__ = ["feedforward_command", "retune_command"]


def retune_command(args: argparse.Namespace) -> None:
    """`gaident retune RESULT.json`."""
    result = load(args.result)
    if not isinstance(result, Diagnosis | Identification):
        raise SettingsError(f"{args.result} contains no model: give what gaident identify or diagnose wrote with --out")
    out, picture = target_of(args.out, [args.result]), target_of(args.plot, [args.result], PICTURES)
    apart({"--out": out, "--plot": picture})
    tuned = retune(
        result,
        phase_margin=args.phase_margin,
        gain_margin=args.gain_margin,
        torque_limit=args.torque_limit,
        torque_noise=args.torque_noise,
        step=args.step,
        dt=args.dt,
        filters=not args.no_filters,
        seed=args.seed,
        most_times=args.most_times,
    )
    axis = args.axis or tuned.axis
    if out is not None:
        with naming(out):
            tuned.save(out)
    if picture is not None:
        save_figure(tuned.plot(axis), picture)
    if args.json:
        print_json(on_axis(tuned.to_dict(), axis))
        return
    print(tuned.summary(axis))
    for path in (out, picture):
        if path is not None:
            print(f"written: {path}")


def feedforward_command(args: argparse.Namespace) -> None:
    """`gaident feedforward RESULT.json [LOG]`."""
    result = load(args.result)
    if not isinstance(result, Diagnosis):
        raise SettingsError(f"{args.result} contains no diagnosis: give what gaident diagnose wrote with --out")
    given = [args.result, *([args.log] if args.log else [])]
    table, source = target_of(args.csv, given), target_of(args.c, given)
    apart({"--csv": table, "--c": source})
    sizes = {name: getattr(args, name) for name in ("points", "angles") if getattr(args, name) is not None}
    rec = max(drive_of(args).records(args.log), key=len) if args.log else None
    tables = feedforward(result, speed=args.speed, **sizes, rec=None if rec is None else result.as_used(rec))
    if table is not None:
        with naming(table):
            tables.to_csv(table)
    if source is not None:
        with naming(source):
            tables.to_c(source)
    if args.json:
        print_json(on_axis(tables.to_dict(), args.axis or tables.axis))
        return
    print(tables.summary(args.axis))
    for path in (table, source):
        if path is not None:
            print(f"written: {path}")
