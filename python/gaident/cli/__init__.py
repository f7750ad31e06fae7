"""The command line: arguments -> the package's functions, exit codes, and nothing else.

Exit codes: 0 done, 1 the work failed, 2 wrong use, 130 Ctrl-C, each but 0 with exactly one line on stderr; 141, without a word,
where the reader of the output goes away (as of a process that SIGPIPE ends: `gaident effects | head -2`).
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gaident.cli.demo import demo_command
from gaident.cli.logs import log_commands
from gaident.cli.options import PICTURES, drive_of, in_options, parser_of
from gaident.cli.output import (
    csv_targets,
    csv_text,
    draw,
    naming,
    print_json,
    proposal_csv,
    save_figure,
    summary_of,
    target_of,
    write,
)
from gaident.cli.report import report_command, write_report
from gaident.data.record import Record
from gaident.diagnosis.diagnose import diagnose
from gaident.diagnosis.replay import Replay, replay
from gaident.drive_file import Drive
from gaident.errors import GaidentError, SettingsError
from gaident.identification.identify import identify
from gaident.identification.result import Identification
from gaident.identification.settings import Settings
from gaident.identification.space import derive_space
from gaident.identification.starts import starts_moving
from gaident.models import effects
from gaident.models.controller import PI
from gaident.models.mechanics import mechanics_from_dict
from gaident.models.model import Model
from gaident.models.simulate import AnyModel, Run, initial_state, run
from gaident.progress_bar import Progress
from gaident.store import load

__all__ = ["main"]

_REPLAYED = 1 << 18  # samples of a log on which the controller is run again


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns its exit code."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a name of a record never stops the output
    try:
        code = _run(argv)
        if sys.stdout is not None:  # None where the caller closed it
            sys.stdout.flush()
        return code
    except GaidentError as error:
        return _failed(2, in_options(str(error)))
    except KeyboardInterrupt:
        return _failed(130, "interrupted")
    except BrokenPipeError:
        _drop_output()
        return 141
    except OSError as error:
        _drop_output()
        what = f"{error.filename}: {error.strerror}" if error.filename is not None else error.strerror
        return _failed(1, what or str(error))
    except Exception as error:
        return _failed(1, f"internal error, please report it: {type(error).__name__}: {error}")


def _run(argv: Sequence[str] | None) -> int:
    parser = parser_of(COMMANDS)
    given = sys.argv[1:] if argv is None else argv
    if not given:
        parser.print_help()
        return 0
    try:
        args = parser.parse_args(given)
    except SystemExit as exit_:  # --help, --version, wrong options
        return int(exit_.code or 0)
    if args.quiet and not getattr(args, "json", False):
        with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
            return args.run(args) or 0
    return args.run(args) or 0


def _drop_output() -> None:
    """Throws away what standard output still buffers where it cannot be written: the interpreter would try again at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _failed(code: int, message: str) -> int:
    if sys.stderr is not None:
        print("gaident:", " ".join(message.split()), file=sys.stderr)
    return code


def _identify(args: argparse.Namespace) -> None:
    drive = drive_of(args)
    out = target_of(args.out, args.logs)
    plot = target_of(args.plot, args.logs, PICTURES)
    page = target_of(args.report, args.logs)
    _apart({"--out": out, "--plot": plot, "--report": page})
    controller = drive.controller()
    records = _read_all(drive, args.logs, controller)
    settings = Settings.paper() if args.paper else Settings()
    settings = replace(settings, initial_state=args.initial_state)
    with Progress(None if args.quiet else sys.stderr) as progress:
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
    off = [f"{name}: {said.sentence}" if len(records) > 1 else said.sentence for name, said in _replayed(records, controller)]
    idn = replace(idn, warnings=(*off, *idn.warnings))
    written = []
    if out is not None:
        with naming(out):
            idn.save(out)
        written.append(out)
    if plot is not None:
        draw(idn, records, drive.axis, plot)
        written.append(plot)
    if page is not None:
        write_report(idn, page, records, (), drive.axis)
        written.append(page)
    if args.json:
        print_json(idn.to_dict())
        return
    print(summary_of(idn, drive.axis))
    if written:
        print(f"\nwritten: {', '.join(map(str, written))}")


def _replayed(records: Sequence[Record], controller: PI | None) -> list[tuple[str, Replay]]:
    """(name, what its replay says) of the records, long ones by their start, whose torque does not follow from the loop."""
    if controller is None:
        return []
    said = [(rec.name, replay(rec[:_REPLAYED], controller)) for rec in records if rec.torque is not None]
    return [(name, r) for name, r in said if r.follows is False]


def _apart(targets: Mapping[str, Path | None]) -> None:
    """Raises where two options name the same file."""
    seen: dict[Path, str] = {}
    for option, target in targets.items():
        if target is not None and (first := seen.setdefault(target.resolve(), option)) != option:
            raise SettingsError(f"{first} and {option} both name {target}: the second would overwrite the first; give two files")


def _simulate(args: argparse.Namespace) -> None:
    from gaident.show.wording import velocity_unit

    drive = drive_of(args)
    model, controller, states = _load_model(args.model)
    if drive.controller_values and drive.controller() != controller:
        controller, states = drive.controller(), {}  # the saved states are of the loop they were found in
    records = _read_all(drive, args.logs, controller, measured=False)
    several = len(records) > 1
    if several and args.out is None and not args.json:
        raise SettingsError(f"{len(records)} logs are given: name a folder for their CSV files with --out, or use --json")
    targets = csv_targets(args.out, args.logs, several)
    results = []
    for rec in records:
        state: Any = states.get(rec.digest) if args.initial_state == "auto" else None
        limited = controller is not None and controller.limited
        moving = bool(np.any(rec.velocity)) and starts_moving(rec, controller)
        if state is None and args.initial_state == "auto" and not limited and moving:
            state = initial_state(model, rec, controller)
        results.append(run(model, rec, controller, state))
    texts = [csv_text(rec, result, drive.axis) for rec, result in zip(records, results, strict=True)]
    for target, text in zip(targets, texts, strict=False):
        write(target, text.encode())
    if args.json:
        plant = model if isinstance(model, Model) else model.model()
        runs = [_run_dict(rec, result) for rec, result in zip(records, results, strict=True)]
        print_json({
            "schema": "gaident/simulation", "schema_version": 1, "model": plant.to_dict(),
            "controller": None if controller is None else controller.to_dict(), "runs": runs,
        })  # fmt: skip
    elif not targets:
        sys.stdout.write(texts[0])
    else:
        for target, rec, result in zip(targets, records, results, strict=True):
            rmse, fit = _fit(rec, result)
            measured = f"fit {fit:.2f} %, rmse {rmse:.4g} {velocity_unit(drive.axis)}"
            against = measured if np.any(rec.velocity) else "no measured velocity to compare with"
            print(f"{rec.name}: {against}; written: {target}")


def _effects(args: argparse.Namespace) -> None:
    if args.json:
        print_json({
            "schema": "gaident/effects", "schema_version": 1, "effects": [row.to_dict() for row in effects.table()],
        })  # fmt: skip
    else:
        print(effects.table())


def _read_all(drive: Drive, logs: Sequence[str], controller: PI | None, measured: bool = True) -> list[Record]:
    records = [drive.read(log, measured) for log in logs]
    for log, rec in zip(logs, records, strict=True):
        if controller is not None and rec.command is None:
            raise SettingsError(
                f"{log}: there is no command, which drives the loop with a controller: name its column "
                "(--columns command=...), or use --loop open to work from torque to velocity"
            )
        if controller is None and rec.torque is None:
            raise SettingsError(
                f"{log}: there is no torque, which drives the model in open loop: name its column "
                "(--columns torque=...), or give the controller (--kp, --ki)"
            )
    return records


def _load_model(path: str) -> tuple[AnyModel, PI | None, dict[str, tuple[float, ...]]]:
    """(model, controller, start state of each record known by its digest)."""
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise SettingsError(f"{path}: there is no such file; give a saved identification or a model") from None
    except (OSError, ValueError) as error:
        raise SettingsError(f"{path}: cannot be read as JSON ({error}); give what identify --out saved") from None
    if isinstance(data, dict) and "schema" in data:
        idn = load(path)
        if isinstance(idn, Record):
            raise SettingsError(f"{path}: is a saved record; give a saved identification or a model")
        if not isinstance(idn, Identification):
            return idn.model, idn.controller, {}
        return idn.model, idn.controller, dict(idn.initial_states)
    try:
        known = mechanics_from_dict(data) if isinstance(data, dict) and "structure" in data else Model.from_dict(data)
    except GaidentError as error:
        raise SettingsError(f"{path}: {error}") from None
    return known, None, {}


def _fit(rec: Record, result: Run) -> tuple[float, float]:
    """(rmse, fit_percent) of one simulated run."""
    with np.errstate(over="ignore", invalid="ignore"):
        error = rec.velocity - result.velocity
        spread = float(np.linalg.norm(rec.velocity - rec.velocity.mean()))
        fit = 100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread > 0.0 else float("nan")
        return float(np.sqrt(np.mean(error**2))), fit


def _run_dict(rec: Record, result: Run) -> dict[str, Any]:
    rmse, fit = _fit(rec, result) if np.any(rec.velocity) else (None, None)
    return {"name": rec.name, "dt": rec.dt, "samples": len(rec), "rmse": rmse, "fit_percent": fit,
            "velocity": result.velocity.tolist(), "torque": result.torque.tolist()}  # fmt: skip


def _diagnose(args: argparse.Namespace) -> None:
    drive = drive_of(args)
    sources = [*args.logs, *(args.validation or []), *([] if args.model is None else [args.model])]
    out = target_of(args.out, sources)
    plot = target_of(args.plot, sources, PICTURES)
    following = target_of(args.next_command, sources)
    page = target_of(args.report, sources)
    _apart({"--out": out, "--plot": plot, "--report": page, "--next-command": following})
    controller = drive.controller()
    records = _read_all(drive, args.logs, controller)
    validation = _read_all(drive, args.validation, controller) if args.validation else None
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
    print(in_options(dia.summary(drive.axis)))
    if following is not None and following not in written:
        print(f"\nnot written: {following}, as there is no next experiment to propose")
    if written:
        print(f"\nwritten: {', '.join(map(str, written))}")


def _reproduce(args: argparse.Namespace) -> None:
    from gaident import paper

    folder = Path(args.out)
    folder.mkdir(parents=True, exist_ok=True)
    with Progress(None if args.quiet else sys.stderr) as progress:
        result = paper.reproduce(args.trials, args.seeds, args.seed, args.workers, progress)
    pictures = paper.figures(result)
    for name, png in pictures.items():
        write(folder / f"{name}.png", png)
    target = folder / "paper.html"
    write(target, paper.page(result, pictures).encode())
    if args.json:
        print_json(result.to_dict())
        return
    print(paper.summary(result))
    print(f"\nwritten: {target}, and its pictures beside it: {', '.join(f'{name}.png' for name in pictures)}")


COMMANDS: dict[str, Callable[[argparse.Namespace], int | None]] = {
    "identify": _identify,
    "diagnose": _diagnose,
    "simulate": _simulate,
    "report": report_command,
    "effects": _effects,
    "demo": demo_command,
    "reproduce": _reproduce,
    **log_commands(drive_of),
}
