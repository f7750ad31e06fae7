"""A classifier of records: gradient-boosted trees over features of each record, one for each effect, trained on the open rig.

Features: of every candidate of the library (`library.py`), behind both kinds of derivatives, how much of what the linear model
leaves it explains; moments of that rest; size of the linear model's error in the loop, its colour; one mass or two.
The records of training are drawn as the blind ones are, with other seeds: a quarter clean, half with one effect, a quarter with
two.
"""

from __future__ import annotations

import os
import time
import zlib
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from blind import NOISE_KINDS, Cell
from case import Answer, Case
from in_the_loop import prepared
from names import library_of, with_parameters, without_contained
from numpy.typing import NDArray

import gaident as ga
from drive_cases import EFFECTS, NOISE_EFFECTS, PAIRS, random_truth
from drive_cases import records as logs
from drive_rig import AT_LOAD

Vector = NDArray[np.float64]

LABELS = tuple(e for e in EFFECTS if e not in (*NOISE_EFFECTS, "integrator_clamp", "command_rate_limit"))
"""What is learnt; the two of the controller are shown by its replay."""
PROBABILITIES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)
FIRST_SEED = 770_000_000
KINDS = ("multi", "move")


def features(case: Case) -> Vector:
    """The numbers of one record; nan where a candidate does not exist there."""
    found: list[float] = []
    for kind in ("filter", "differences"):
        library = library_of(case, kind)
        power = float(library.rest @ library.rest)
        shares = dict.fromkeys(LABELS, np.nan)
        for c in library.candidates:
            Q = np.linalg.qr(library.beyond(library.matrix(c.atoms)))[0]
            shares[c.effect] = float(np.log10(max(1.0 - float(np.sum((Q.T @ library.rest) ** 2)) / power, 1e-6)))
        z = library.rest / np.sqrt(power / len(library.rest))
        size = float(np.log10(power / float(library.u @ library.u)))
        found += [*shares.values(), size, float(np.mean(z**3)), float(np.mean(z**4)), float(np.mean(z[1:] * z[:-1]))]
    error = case.record.velocity - _in_loop(case)
    scale = float(np.sqrt(np.mean(error**2))) + 1e-12
    noise = float(np.std(np.diff(case.record.velocity, 3)) / np.sqrt(20.0)) + 1e-12
    found += [np.log10(scale), np.log10(scale / noise), float(np.mean((error / scale) ** 4))]
    found += [float(np.mean(error[k:] * error[:-k])) / scale**2 for k in (1, 5, 25)]
    found += [float(len(case.identified.model.zeros)), float(np.log10(case.record.dt)), float(len(case.record))]
    return np.array(found)


def _in_loop(case: Case) -> Vector:
    """The free run of the linear model over the record itself."""
    try:
        return ga.simulate(case.identified.model, case.record, case.controller)
    except ga.GaidentError:
        return np.zeros(len(case.record))


def training_cell(number: int) -> Cell:
    """The cell of one record of training."""
    rng = np.random.default_rng([FIRST_SEED, number])
    kind, noise = str(rng.choice(KINDS)), str(rng.choice(NOISE_KINDS))
    group = ("clean", "effects", "effects", "pairs")[number % 4]
    single = [e for e in EFFECTS if e not in NOISE_EFFECTS]
    effects: tuple[str, ...] = ()
    if group == "effects":
        effects = (single[(number // 4 * 2 + number % 4) % len(single)],)
    elif group == "pairs":
        effects = PAIRS[int(rng.integers(len(PAIRS)))]
    return Cell(group, effects, kind, noise, True, FIRST_SEED + number)


def example(number: int) -> tuple[Vector, list[float]] | None:
    """(features, which labels are hidden) of one record of training; None where the effect does not act there."""
    cell = training_cell(number)
    try:
        truth = replace(random_truth(cell.seed, cell.effects, cell.kind, cell.noise), validation_command=None)
        case = Case(cell, *logs(truth), truth.plant.controller, truth)
        with np.errstate(all="ignore"):
            x = features(case)
    except (RuntimeError, ga.GaidentError, np.linalg.LinAlgError):
        return None
    hidden = {key.removesuffix(AT_LOAD) for key in cell.effects}
    return x, [float(e in hidden) for e in LABELS]


def train(path: Path, records: int, workers: int) -> None:
    """Draws records of training until so many are in the file, and says how long it took."""
    there = np.load(path) if path.exists() else None
    X, Y, first = ([], [], 0) if there is None else (list(there["X"]), list(there["Y"]), int(there["next"]))
    if len(X) >= records:
        return
    began = time.perf_counter()
    with ProcessPoolExecutor(workers) as pool:
        while len(X) < records:
            numbers = range(first, first + min(200, 2 * (records - len(X))))
            for found in pool.map(example, numbers, chunksize=10):
                if found is not None:
                    X.append(found[0])
                    Y.append(np.array(found[1]))
            first = numbers.stop
            np.savez(path.with_suffix(".part.npz"), X=np.array(X), Y=np.array(Y), next=first)
            os.replace(path.with_suffix(".part.npz"), path)
    print(f"{len(X)} records of training after {time.perf_counter() - began:.0f} s")


@lru_cache(maxsize=1)
def classifiers(path: str, stamp: float) -> tuple[NDArray[np.bool_], tuple[Any, ...]]:
    """(features that vary, a classifier for each label, None for a rare one), trained on the file; stamp: the file's time."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    there = np.load(path)
    Y = there["Y"]
    varies = np.array([len(np.unique(x[np.isfinite(x)])) > 2 for x in there["X"].T])
    X = there["X"][:, varies]
    found: list[Any] = []
    for y in Y.T:
        if y.sum() < 5:
            found.append(None)
            continue
        made = HistGradientBoostingClassifier(max_iter=120, max_leaf_nodes=12, min_samples_leaf=8, learning_rate=0.08,
                                              l2_regularization=1.0, random_state=zlib.crc32(b"naming") % 1000)  # fmt: skip
        found.append(made.fit(X, y > 0.5))
    return varies, tuple(found)


def boosted(case: Case, path: Path) -> dict[float, Answer]:
    """The answer at each probability."""
    varies, trees = classifiers(str(path), path.stat().st_mtime)
    with np.errstate(all="ignore"):
        x = features(case)[None, varies]
    chances = {e: 0.0 if t is None else float(t.predict_proba(x)[0, 1]) for e, t in zip(LABELS, trees, strict=True)}
    library = library_of(case, "filter")
    found = {}
    for probability in PROBABILITIES:
        effects = without_contained([e for e, p in chances.items() if p > probability])
        known = with_parameters(case, library, effects)
        found[probability] = Answer({**{e: {} for e in effects}, **known, **prepared(case).replayed})
    return found
