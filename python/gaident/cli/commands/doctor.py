"""gaident doctor."""

from __future__ import annotations

import argparse

from gaident.cli.examination import examine
from gaident.cli.output import print_json

__all__ = ["doctor_command"]


def doctor_command(args: argparse.Namespace) -> int:
    found = examine()
    if args.json:
        print_json(found.to_dict())
    else:
        print(found)
    return 1 if found.flaws else 0
