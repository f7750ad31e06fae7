"""The figures of a loop over the drives that the records leave possible."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Cascade
from gaident.policy.table import POLICY
from gaident.remedies.loops import Loops, overshoot, position_frequencies, settling
from gaident.remedies.margins import gain_margins, phase_margins
from gaident.remedies.plants import PlantResponses, Plants
from gaident.results.retuning import LoopFigures, Spread

__all__ = ["Judge"]

Vector = NDArray[np.float64]

PERCENT = (2.5, 97.5)  # no decision: a formula: the ends of 95 %


class Judge:
    """Drives, the identified one first, and what is told of each loop around them."""

    def __init__(self, plants: Plants, responses: PlantResponses, step: float, noise: float) -> None:
        self.plants, self.responses, self.step, self.noise = plants, responses, step, noise
        self.few = plants.chosen(slice(0, POLICY.stepped_drives + 1))

    def figures(self, cascade: Cascade) -> LoopFigures:
        """Of one controller."""
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return self._figures(cascade)

    def _figures(self, cascade: Cascade) -> LoopFigures:
        loops = Loops(self.plants, cascade, self.responses)
        stable, few = loops.stable, Loops(self.few, cascade, self.responses)
        sound = few.stable
        endless = np.full(self.few.count, np.inf)
        velocity, torque, dt = few.step() if sound.all() else (None, None, 0.0)
        torques = endless if torque is None else self.step * np.max(np.abs(torque), axis=1)
        if cascade.position is None:
            answer, stiffness = velocity, np.where(stable, loops.stiffness, 0.0)
            position: tuple[Spread | None, Spread | None] = (None, None)
        else:
            gain = cascade.position.gain
            placed = loops.placed(cascade.position_every(self.plants.period))
            held = placed.stable(gain)
            stable, omega = stable & held, position_frequencies(placed.period, POLICY.checked_points)
            stiffness = np.where(held, placed.stiffness(gain, omega), 0.0)
            L = gain * placed.response(omega)
            phase, size = (np.where(held, margin(L), 0.0) for margin in (phase_margins, gain_margins))
            position = _spread(phase, "deg"), _spread(size, "dB")
            near = few.placed(cascade.position_every(self.plants.period))
            sound, dt = near.stable(gain), near.period
            answer = near.step(gain) if sound.all() else None
        beyond = endless if answer is None else overshoot(answer)
        settled = endless if answer is None else settling(answer, dt)
        phase, size = (np.where(loops.stable, margin, 0.0) for margin in (loops.phase_margins, loops.gain_margins))
        share = float(np.mean(stable))
        return LoopFigures(
            stable=Spread(float(stable[0]), share, share, "1"),
            phase_margin=_spread(phase, "deg"),
            gain_margin=_spread(size, "dB"),
            sensitivity=_spread(np.where(loops.stable, loops.peaks, np.inf), "1"),
            bandwidth=_spread(np.where(loops.stable, loops.bandwidths, 0.0), "Hz"),
            overshoot=_spread(beyond, "%"),
            settling_time=_spread(settled, "s"),
            stiffness=_spread(stiffness, "N m/rad"),
            step_torque=_spread(torques, "N m"),
            torque_noise=_spread(np.where(loops.stable, self.noise * loops.noise_gain, np.inf), "N m"),
            position_phase_margin=position[0],
            position_gain_margin=position[1],
        )

    def loop(self, cascade: Cascade) -> tuple[Vector, NDArray[np.complex128]]:
        """(frequencies [Hz], the velocity loop of the identified drive at these, broken at the controller's output)."""
        loops = Loops(self.plants, cascade, self.responses)
        return loops.responses.omega[0] / (2.0 * np.pi), loops.L[0]

    def margins(self, cascade: Cascade) -> tuple[Vector, Vector]:
        """Phase [deg] and gain margin [dB] of the velocity loop around each drive (S,); below 0 where it is not stable."""
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            loops = Loops(self.plants, cascade, self.responses)
            phase, size = (np.where(loops.stable, m, -1.0) for m in (loops.phase_margins, loops.gain_margins))
            return phase, size


def _spread(values: Vector, unit: str) -> Spread:
    low, high = (float(np.percentile(values, p, method="nearest")) for p in PERCENT)
    return Spread(float(values[0]), low, high, unit)
