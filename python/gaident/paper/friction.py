"""Beyond the paper: its step hides the friction that it suspects; a command that reverses shows it, and diagnose names it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaident.data.record import Record
from gaident.diagnosis.diagnose import diagnose
from gaident.models.mechanics import Mechanics, mechanics_from_model
from gaident.paper.experiment import rig_of
from gaident.paper.facts import SAMPLES, STEP, Mechanism
from gaident.paper.rig import Friction, RigRun, side_by_side
from gaident.results.diagnosis import Diagnosis

__all__ = ["FrictionTest", "friction_test"]

# rad/s, SAMPLES each
LEVELS = (STEP, -STEP, 20.0, -20.0, 0.0, 10.0, -10.0, 30.0)
OTHER_LEVELS = (-30.0, 15.0, -5.0, 40.0, -40.0, 5.0, 25.0, 0.0)


@dataclass(frozen=True)
class FrictionTest:
    """Diagnoses of one mechanism: on the paper's step alone, and with a record of reversals beside it.

    The second is judged on another record of reversals, which no fit sees.

    linear, extended: mechanics of the linear identification of these records and of the extended model's linear part, or None
    """

    mechanism: Mechanism
    truth: Friction
    reversals: Record
    step_only: Diagnosis
    diagnosis: Diagnosis
    linear_step: Mechanics | None
    linear: Mechanics | None
    extended: Mechanics | None


def friction_test(mechanism: Mechanism, step: Record, seed: int) -> FrictionTest:
    """step: the record of the paper's experiment on the same rig."""
    rig = rig_of(mechanism)
    reversals, others = side_by_side(
        [
            RigRun(rig, np.repeat(LEVELS, SAMPLES), seed + 1, f"reversals, {mechanism.title}"),
            RigRun(rig, np.repeat(OTHER_LEVELS, SAMPLES), seed + 2, f"other reversals, {mechanism.title}"),
        ]
    )
    alone = diagnose(step, rig.controller, seed=seed)
    found = diagnose([step, reversals], rig.controller, validation=others, seed=seed)
    return FrictionTest(
        mechanism,
        rig.friction,
        reversals,
        alone,
        found,
        alone.identification.mechanics,
        found.identification.mechanics,
        mechanics_from_model(found.model.linear),
    )
