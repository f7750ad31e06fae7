"""gaident demo."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from shlex import quote
from typing import Any

from gaident.cli import demonstration
from gaident.cli.output import csv_text, print_json, program, save_figure, summary_of, write
from gaident.show.progress_bar import Progress

__all__ = ["demo_command"]


def demo_command(args: argparse.Namespace) -> None:
    """Simulated drives, and the measured one where its data are there; text, pictures and logs."""
    from gaident.show.summary import mechanics_comparison

    folder = Path(args.out)
    folder.mkdir(parents=True, exist_ok=True)
    say: Callable[[str], None] = (lambda text: None) if args.json else partial(print, flush=True)
    drawn = find_spec("matplotlib") is not None
    truth, controller = demonstration.TRUTH, demonstration.CONTROLLER
    say(demonstration.STORY)
    with Progress(None if args.quiet else sys.stderr) as progress:
        rec, idn = demonstration.identify_two_masses(args.seed, progress, args.workers)
    say(summary_of(idn, "rotary"))
    if isinstance(idn.mechanics, type(truth)):
        say(f"\nCompared with the truth\n{mechanics_comparison(idn.mechanics, truth)}")
    log, picture = folder / "demo_two_mass.csv", folder / "demo_two_mass.png"
    write(log, csv_text(rec, None, "rotary").encode())
    if drawn:
        save_figure(idn.plot(rec), picture)
    say(f"\nwritten: {f'{picture}, ' if drawn else ''}{log}; the same from the log:")
    say(f"  {program()} identify {quote(str(log))} --kp {controller.kp} --ki {controller.ki} --loop {controller.loop}")
    report: dict[str, Any] = {
        "schema": "gaident/demo",
        "schema_version": 1,
        "two_masses": {"truth": truth.to_dict(), "identification": idn.to_dict()},
        "emps": None,
        "friction": None,
    }
    path = demonstration.emps_path()
    if path is None:
        say("\nThe measured EMPS axis is left out: GAIDENT_DATA names no folder with emps/DATA_EMPS.mat")
    else:
        say(f"\n{'-' * 100}\n{demonstration.EMPS_STORY}: {path}\n")
        with Progress(None if args.quiet else sys.stderr) as progress:
            rec, idn = demonstration.identify_emps(path, args.seed, progress, args.workers)
        say(summary_of(idn, "linear"))
        picture = folder / "demo_emps.png"
        say(f"\n{demonstration.EMPS_TRUTH}")
        if drawn:
            save_figure(idn.plot(rec, "linear"), picture)
            say(f"written: {picture}")
        report["emps"] = {"identification": idn.to_dict()}
    say(f"\n{'-' * 100}\n{demonstration.FRICTION_STORY}")
    with Progress(None if args.quiet else sys.stderr) as progress:
        rec, dia = demonstration.diagnose_friction(args.seed, progress)
    say(dia.summary())
    log, picture = folder / "demo_friction.csv", folder / "demo_friction.png"
    write(log, csv_text(rec, None, "rotary").encode())
    if drawn:
        save_figure(dia.plot(), picture)
    controller = demonstration.DIGITAL
    say(f"\n{demonstration.FRICTION_TRUTH}\nwritten: {f'{picture}, ' if drawn else ''}{log}; the same from the log:")
    say(f"  {program()} diagnose {quote(str(log))} --kp {controller.kp} --ki {controller.ki}")
    if not drawn:
        say('No pictures, which need matplotlib: pip install "gaident[pictures]"')
    report["friction"] = {"truth": demonstration.HIDDEN, "diagnosis": dia.to_dict()}
    if args.json:
        print_json(report)
