"""Results for the report's tests: a small drive with hidden friction, and the same with everything a file may bring in."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import gaident as ga
from friction_drive import CONTROLLER, DT, drive_record

__all__ = ["HOSTILE", "ambiguous", "diagnosed", "hostile", "retuned_once"]

HOSTILE = "</script><script>window.hacked=1</script><img src=x onerror=window.hacked=2> \"'&$x$ \u2028"


@cache
def diagnosed() -> ga.Diagnosis:
    """Friction found, judged on a second record."""
    return ga.diagnose(drive_record(), CONTROLLER, validation=drive_record(1))


def retuned_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages of one drive take its other gains from the first that was made: the search for them takes a second."""

    def retuned(dia: ga.Diagnosis, **named: bool) -> ga.Retuning:
        key = (dia.model, dia.controller, tuple(r.digest for r in dia.records), tuple(named.items()))
        if key not in _RETUNED:
            _RETUNED[key] = ga.retune(dia, **named)
        return _RETUNED[key]

    monkeypatch.setattr("gaident.reporting.remedies.retune", retuned)


_RETUNED: dict[object, ga.Retuning] = {}


def ambiguous(dia: ga.Diagnosis) -> ga.Diagnosis:
    """The same as if the data told friction from nothing near it, with a proposal."""
    (found,) = dia.findings
    rest = {"backlash": "the torque never changes its sign: the coupling stays on one flank"}
    proposal = replace(
        ga.first_experiment(DT, ga.Limits(50.0, 1.0, np.inf, 2.0)), separates=("coulomb_friction", "load_torque"), margin=64.0
    )
    open_ = replace(found, alternatives=("load_torque", "stribeck_friction"), p_value=0.01)
    return replace(dia, findings=(open_,), not_testable=rest, next_experiment=proposal, bootstrap=99)


def hostile(dia: ga.Diagnosis) -> ga.Diagnosis:
    """Every text that comes from a file tries to leave its place; names of records too."""
    (found,) = ambiguous(dia).findings
    evil = replace(found, evidence=HOSTILE, alternatives=(HOSTILE,), parameters={HOSTILE: ga.Estimate(1.0, 0.1, HOSTILE)})
    return replace(
        ambiguous(dia),
        findings=(evil, replace(found, effect=HOSTILE, is_noise=True, evidence=HOSTILE)),
        notes=(HOSTILE,),
        not_testable={HOSTILE: HOSTILE},
        one_sided={HOSTILE: HOSTILE},
        held_out=HOSTILE,
        version=HOSTILE,
        digests=(*dia.digests, HOSTILE),
        records=tuple(named(r) for r in dia.records),
        validation_records=tuple(named(r) for r in dia.validation_records),
    )


def named(rec: ga.Record) -> ga.Record:
    """The same data under a bad name."""
    return ga.Record(rec.dt, rec.command, rec.velocity, rec.torque, rec.position, name=HOSTILE)
