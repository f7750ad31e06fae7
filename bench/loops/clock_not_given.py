"""Logs slower than a controller that nobody gave: is anything named that only the torque between the lines makes?

    python bench/loops/clock_not_given.py [--cases 9] [--seed 0] [--every 1 4 10 20]

Each case is one mass with dry friction under a 1 kHz controller, half of them under gravity, in turn on a sum of sines, steps and
ramps, with white noise of 0.2 % of the velocity's range, half of them with a logged angle.
The log has every 1st, 4th, 10th and 20th sample, velocity and commanded torque, 4000 lines; no controller is given.
The mean of the torque over a line is (r - 1)/(2r) lines ahead of the line.

Each row says by how many lines the regression and the diagnosis take it for ahead, what is named, and the error of the inertia.
It fails where a finding contains nothing of what is there.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

# ruff: noqa: E402
sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "tests" / "python" / "support")]

import numpy as np
from numpy.typing import NDArray

import gaident as ga
from blind_judge import judge
from drive_rig import Noise, Plant, log_of
from gaident.estimation.regression.torque_lag import torque_lag

PERIOD, LINES, INERTIA = 1e-3, 4000, 0.02
AHEAD = "The motion comes "


def command_of(kind: str, n: int, top: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Of a controller's samples [rad/s] (n,)."""
    t = np.arange(n) * PERIOD
    if kind == "sines":
        tones = zip(np.geomspace(0.1, 1.0, 5) * rng.uniform(0.9, 1.1, 5), rng.uniform(0.0, 2.0 * np.pi, 5), strict=True)
        return np.asarray(0.34 * top * sum(np.sin(2.0 * np.pi * f * t + phase) for f, phase in tones))
    levels = rng.uniform(-top, top, n // 300)
    asked = np.repeat(levels, rng.integers(300, 1500, len(levels)))[:n]
    if kind == "steps":
        return asked
    made, slope = np.zeros(n), top / 0.3 * PERIOD
    for k in range(1, n):
        made[k] = made[k - 1] + np.clip(asked[k] - made[k - 1], -slope, slope)
    return made


def case(i: int, seed: int, every: int) -> tuple[str, ga.Record, dict[str, dict[str, float]]]:
    rng = np.random.default_rng([seed, i])
    kind, gravity = ("sines", "steps", "ramps")[i % 3], bool(rng.integers(2))
    kp = INERTIA * 2.0 * np.pi * rng.uniform(4.0, 15.0)
    gains = ga.PI(kp, kp * rng.uniform(5.0, 20.0))
    plant = Plant(J=INERTIA, D=0.05, kp=gains.kp, ki=gains.ki, dt=every * PERIOD, cascade=ga.Cascade(gains, period=PERIOD))
    hidden = {"coulomb_friction": {"torque": 0.3}}
    hidden |= {"unbalance": {"amplitude": 1.0, "phase": 0.0}} if gravity else {}
    command = command_of(kind, LINES * every, rng.uniform(3.0, 20.0), rng)
    quiet = log_of(plant, command, hidden, Noise(white=0.0), i, position_logged=bool(i % 2))
    noise = 2e-3 * float(np.ptp(quiet.velocity)) * rng.standard_normal(LINES)
    return f"{kind}{', gravity' * gravity}", quiet.with_channels(command=None, velocity=quiet.velocity + noise), hidden


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=9)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", type=int, nargs="+", default=[1, 4, 10, 20])
    given = parser.parse_args()
    wrong = total = 0
    for every in given.every:
        for i in range(given.cases):
            what, rec, hidden = case(i, given.seed, every)
            lag, began = torque_lag(rec), time.process_time()
            dia = ga.diagnose(rec)
            judged, spent = judge(dia, hidden), time.process_time() - began
            ahead = next((note.split()[3] for note in dia.notes if note.startswith(AHEAD)), "0")
            expected = 1e3 * rec.dt * (every - 1) / (2 * every)
            seen = "-" if lag is None else f"{1e3 * rec.dt * lag.lag:.2f}"
            off = 100.0 * (dia.mechanics["inertia"].value / INERTIA - 1.0)
            found = ", ".join("|".join(one) for one in judged.sets) or "nothing"
            print(f"every {every:2d}  {what:16s} ahead {expected:.2f} ms, regression {seen}, taken {ahead};  "
                  f"{judged.verdict}: {found};  inertia {off:+.1f} %;  {spent:.1f} s", flush=True)  # fmt: skip
            wrong += judged.extra
            total += 1
    print(f"{total} logs, {wrong} findings that contain nothing of what is there")
    assert not wrong, "a cause is named that is not there"


if __name__ == "__main__":
    main()
