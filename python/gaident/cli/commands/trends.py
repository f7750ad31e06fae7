"""gaident trends."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import asdict

from gaident.cli.output import print_json
from gaident.fleets.trends import trends

__all__ = ["trends_command"]


def trends_command(args: Namespace) -> None:
    found = trends(args.fleet, args.out, args.reports)
    if args.json:
        changes, siblings, axes = ([asdict(row) for row in rows] for rows in (found.changes, found.siblings, found.axes))
        poor = [{"axis": c.axis, "quantity": c.quantity, "why": c.poor} for c in found.poor]
        said = {"axes": axes, "changes": changes, "siblings": siblings, "poor": poor}
        print_json({"schema": "gaident/trends", "schema_version": 1, **said})
        return
    print(found.summary())
    if args.out is not None:
        print(f"\nwritten: {args.out}")
