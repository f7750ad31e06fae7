"""gaident effects."""

from __future__ import annotations

import argparse

from gaident.cli.output import print_json
from gaident.models import effects

__all__ = ["effects_command"]


def effects_command(args: argparse.Namespace) -> None:
    if args.json:
        print_json({
            "schema": "gaident/effects", "schema_version": 1, "effects": [row.to_dict() for row in effects.table()],
        })  # fmt: skip
    else:
        print(effects.table())
