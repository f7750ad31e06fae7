"""Options and help of `gaident export`."""

from __future__ import annotations

import argparse

from gaident.axis import AXES
from gaident.cli.log_options import number

__all__ = ["EXPORT_EXAMPLES", "EXPORT_HELP", "FORMS", "add_export_options"]

FORMS = {"c": ".c", "scipy": ".py", "control": ".py", "csv": ".csv"}
"""What --to takes -> how such a file ends."""

EXPORT_HELP = """\
Writes a saved result for another tool: its model as one C99 file (effects included), as a Python file for scipy.signal or
python-control that needs no gaident, or all its numbers with deviations and units as CSV.
"""
EXPORT_EXAMPLES = """\
examples:
  gaident export run.json --to c --dt 1e-3           torque to velocity, run.c
  gaident export run.json --to control --linear      without the effects that no transfer function can have
  gaident export run.json --to csv --out numbers.csv
"""


def add_export_options(parser: argparse.ArgumentParser) -> None:
    """What `gaident export` takes."""
    parser.add_argument("result", metavar="RESULT.json", help="what diagnose --out or identify --out saved")
    parser.add_argument("--to", required=True, choices=tuple(FORMS), help="for which tool")
    parser.add_argument("--out", metavar="FILE", help="where to write (default: RESULT.c, .py or .csv here)")
    parser.add_argument("--dt", type=number, metavar="S", help="of C: sample time of its steps [s]")
    parser.add_argument("--closed", action="store_true", help="of C: with the controller of the result, command to velocity")
    parser.add_argument("--linear", action="store_true", help="the linear part of the model alone")
    parser.add_argument("--axis", choices=AXES, help="units of CSV (default: those of the result)")
    parser.add_argument("--json", action="store_true", help="print what was written as JSON")
