"""The policy: every number by which a diagnosis decides, with its unit, where it comes from, and the command that measures it.

A decision is never made by a number that stands elsewhere. Effort (iterations, starts, how many models are carried on) is the
last group: more of it may find more, and changes no decision about what was found.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

__all__ = ["POLICY", "Policy", "Row", "rows"]


def _row(value: float, unit: str, source: str, command: str = "") -> Any:
    return field(default=value, metadata={"unit": unit, "source": source, "command": command})


CLEAN = "python bench/blind.py --only clean --cases 20"
SIZES = "python bench/blind.py --only effects sizes"
PAIRS = "python bench/blind.py --only pairs outside"
REAL = "python bench/real.py"


@dataclass(frozen=True)
class Policy:
    """See the module; `rows()` lists all with unit, source and command."""

    # Is the gain enough? One criterion: BIC and a penalty for each effect, which stands for the number of candidates tried.
    effect_penalty: float = _row(
        25.0, "BIC units", "twice the largest gain among 306 records without effects: 12; real noise is less tidy", CLEAN
    )
    short_record: float = _row(
        200.0, "samples", "a record this short doubles the penalty: its noise filter is uncertain itself", CLEAN
    )
    material_share: float = _row(
        0.1,
        "1",
        "of the error beyond the noise, whitened or plain, that an effect explains at least",
        PAIRS,
    )
    material_beside_impacts: float = _row(
        0.5, "1", "the same beside a gap or a hard coupling: no model foresees an impact", PAIRS
    )
    most_of_a_spring: float = _row(62.8, "rad", "of travel: what turns more than ten times no spring holds to the ground", REAL)
    overrules: float = _row(0.5, "1", "of the plain error that a cause which whitening hid may leave at most", REAL)
    rival_margin: float = _row(10.0, "BIC units", "closer explanations are not told apart (Kass and Raftery 1995)", SIZES)
    rival_short: float = _row(400.0, "samples", "a record this short doubles the margin", SIZES)
    hint: float = _row(8.0, "BIC units", "of likelihood, from which a generalisation is not ruled out by what it contains", SIZES)
    log_shift: float = _row(
        50.0, "BIC units", "by which the controller's law holds better before a channel is moved by samples: odds of e^25", CLEAN
    )
    swap: float = _row(2.0, "BIC units", "by which a rival has to be better to take a place", SIZES)
    harm: float = _row(0.02, "1", "of the held-out error that an effect may add before it is refused", REAL)
    held_motion: float = _row(0.33, "1", "rms speed of a held-out part over that before: below, it is cut by path", REAL)

    # Do two methods contradict each other? The diagnosis and the inverse-dynamics regression of the same records.
    check_deviations: float = _row(3.0, "deviations of both", "of a normal distribution 0.3 % are beyond", CLEAN)
    check_share: float = _row(0.1, "1", "of the larger value: a smaller difference does not matter", CLEAN)
    check_torque: float = _row(0.05, "1", "of the torque's rms: the same, of friction and gravity", CLEAN)
    rigid_band: float = _row(0.25, "1", "of the antiresonance: below, a load is rigid within 1/16 (1/(1 - 1/16))", SIZES)
    loses: float = _row(2.0, "1", "force error of the diagnosed model over that of the regression: above, it is a note", REAL)

    # Is this noise? One variance ratio, one specification test, one test for dependence.
    noise_ratio: float = _row(1.5, "1", "rms of whitened errors over the noise of the velocity, coloured torques included", CLEAN)
    free_run_ratio: float = _row(5.0, "1", "rms of the free run over the noise: more is a misfit that a noise filter took", CLEAN)
    specification_level: float = _row(1e-6, "1", "of the chi-square test of plain against whitened estimates", CLEAN)
    dependence_gain: float = _row(
        40.0, "BIC units", "of a free function of one signal; of 156 clean steps one in 300 is above", CLEAN
    )
    immaterial: float = _row(
        0.02, "1", "of the linear mechanism's rms error: counts as noise, however little noise there is", CLEAN
    )
    of_its_size: float = _row(0.25, "1", "of a finding's gain that a free function may still find beside it", PAIRS)
    stands: float = _row(
        0.9,
        "1",
        "share of what a free function explains: drag by friction 0.87, friction of a robot joint 0.946",
        PAIRS,
    )
    class_stands: float = _row(0.5, "1", "the same for a class that the record cannot split", PAIRS)
    grid_loss: float = _row(0.02, "1", "share of the linear model's squared error that a coarser grid of time may lose", REAL)

    # Effort: budgets.
    effort_ratio: float = _row(1.1, "1", "rms of whitened errors over the noise: below, no more effort is spent")
    misfit_ratio: float = _row(
        2.0, "1", "rms of the whitened errors of the linear model over the noise: above, plain errors first"
    )
    loop_ratio: float = _row(2.0, "1", "rms of the free run over the noise: above, output errors are searched as well")
    most_effects: int = _row(4, "1", "effects in one model")
    beam_width: int = _row(3, "1", "models that are carried on side by side")
    beam_reach: float = _row(4.0, "penalties", "how far behind the best a model is carried on")
    screened: int = _row(6, "1", "candidates that each ranking of the score test sends into a short fit")
    finished: int = _row(5, "1", "of these, how many are fitted to the end")
    hopeless: float = _row(0.5, "BIC units per sample", "by which a short fit may be behind the model that it extends")
    enough_samples: int = _row(3500, "samples", "of a search on a coarser grid")
    near_mass: float = _row(0.05, "BIC units per sample", "by which one mass with an effect may be behind two, to be looked at")
    seen_resonance: float = _row(0.8, "1", "of half the sampling frequency: how far up a coarser grid shows a resonance")
    head: int = _row(200, "samples", "from whose velocity the start of a model in motion is fitted")
    evolution: int = _row(50, "generations", "of a global search beside stops and impacts")


class Row(NamedTuple):
    """One number of the policy."""

    name: str
    value: float
    unit: str
    source: str
    command: str


def rows() -> tuple[Row, ...]:
    """The whole table."""
    return tuple(
        Row(f.name, f.default, f.metadata["unit"], f.metadata["source"], f.metadata["command"])  # type: ignore[arg-type]
        for f in fields(Policy)
    )


POLICY = Policy()
"""The one policy of all diagnoses."""
