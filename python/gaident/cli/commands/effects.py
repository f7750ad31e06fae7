"""gaident effects."""

from __future__ import annotations

import argparse

from gaident.checks import one_of
from gaident.cli.output import print_json
from gaident.errors import ModelError
from gaident.models import effects
from gaident.models.effect_rows import Row, Table

__all__ = ["effects_command"]


def effects_command(args: argparse.Namespace) -> None:
    rows = effects.table()
    if args.names:
        by_name = {row.name: row for row in rows}
        rows = Table(by_name[one_of(name.replace(" ", "_"), "the effect", by_name, ModelError)] for name in args.names)
    if args.json:
        print_json({"schema": "gaident/effects", "schema_version": 1, "effects": [row.to_dict() for row in rows]})
    else:
        print("\n\n".join(map(_told, rows)) if args.names else rows)


def _told(row: Row) -> str:
    """One effect with a line for each parameter."""
    ends = f", at {' or '.join(row.sides)}" if row.sides else ""
    lines = [f"{row.name}: {row.meaning}"]
    lines.append(f"  place: {row.place}{ends}")
    lines += [f"  {p.name} [{p.unit}]{f', {p.bounds}' if p.bounds else ''}" for p in row.parameters]
    return "\n".join([*lines, f"  {row.relation}"] if row.relation else lines)
