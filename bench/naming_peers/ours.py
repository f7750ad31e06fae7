"""What a user of gaident writes, and its answer in the form of the others."""

from __future__ import annotations

from case import Answer, Case

import gaident as ga

ONLY = 0.0
"""The one threshold of a method that has none to choose."""


def asked(record: ga.Record, controller: ga.PI | ga.Cascade | None) -> ga.Diagnosis:
    return ga.diagnose(record, controller)


def gaident(case: Case) -> dict[float, Answer]:
    """The diagnosis of the record alone: like the others it sees no held-out record."""
    dia = asked(case.record, case.controller)
    real = [f for f in dia.findings if not f.is_noise]
    rmse = None if case.cell.loop else case.free_run(dia.model) if real else case.before
    sets = tuple((f.effect, *f.alternatives) for f in dia.findings)
    return {ONLY: Answer({}, sets, rmse, findings=dia.findings, verdict=dia.verdict, driver=dia.driver)}
