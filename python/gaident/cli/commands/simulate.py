"""gaident simulate."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from gaident.axis import velocity_unit
from gaident.cli.drive import drive_of, read_all
from gaident.cli.output import csv_targets, csv_text, print_json, write
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.errors import GaidentError, SettingsError
from gaident.models.mechanics import mechanics_from_dict
from gaident.models.model import Model
from gaident.models.simulate import Run, initial_state, run
from gaident.models.simulation_input import AnyModel
from gaident.models.starts import starts_moving
from gaident.results.identification import Identification
from gaident.results.store import load

__all__ = ["simulate_command"]


def simulate_command(args: argparse.Namespace) -> None:
    drive = drive_of(args)
    model, controller, states = _load_model(args.model)
    given = drive.controller() if drive.controller_values else controller
    if given is not None and given.unknown and controller is not None:
        said = "the controller that was found with the model closes the loop: the given one has numbers that are not known"
        print(said, file=sys.stderr)
    elif given != controller:
        controller, states = given, {}  # the saved states are of the loop they were found in
    records = read_all(drive, args.logs, controller, measured=False)
    if len(records) != len(args.logs):
        raise SettingsError("--pieces: gaident simulate takes a log as one record; name a part of it with --from and --to")
    several = len(records) > 1
    if several and args.out is None and not args.json:
        raise SettingsError(f"{len(records)} logs are given: name a folder for their CSV files with --out, or use --json")
    targets = csv_targets(args.out, args.logs, several)
    results = []
    for rec in records:
        state: Any = states.get(rec.digest) if args.initial_state == "auto" else None
        limited = controller is not None and controller.limited
        moving = bool(np.any(rec.velocity)) and starts_moving(rec, bare_pi(controller))
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


def _load_model(path: str) -> tuple[AnyModel, Controller | None, dict[str, tuple[float, ...]]]:
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
        raise SettingsError(f"{path}: {error.marked}") from None
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
