"""Options and help of `gaident export`."""

from __future__ import annotations

import argparse

from gaident.axis import AXES
from gaident.cli.log_options import number

__all__ = ["EXPORT_EXAMPLES", "EXPORT_HELP", "FORMS", "add_export_options"]

FORMS = {
    "c": ".c",
    "fmu": ".fmu",
    "scipy": ".py",
    "control": ".py",
    "csv": ".csv",
    "mujoco": ".xml",
    "urdf": ".urdf",
    "sdf": ".sdf",
    "wpilib": ".wpilib.json",
    "simscape": "_simscape.csv",
}
"""What --to takes -> how such a file ends."""

EXPORT_HELP = """\
Writes a saved result for another tool: its model as one C99 file or as an FMU 3.0 for co-simulation (effects included), as a
Python file for scipy.signal or python-control that needs no gaident, or all its numbers with deviations and units as CSV;
its joint for MuJoCo, URDF and SDF, the feedforward gains of WPILib, and the parameters of Simscape's blocks.
"""
EXPORT_EXAMPLES = """\
examples:
  gaident export run.json --to c --dt 1e-3           torque to velocity, run.c
  gaident export run.json --to control --linear      without the effects that no transfer function can have
  gaident export run.json --to csv --out numbers.csv
  gaident export run.json --to fmu --dt 1e-3 --closed    command to velocity, run.fmu, with the C compiler of this machine
  gaident export run.json --to mujoco                    armature, damping, frictionloss and the actuator, run.xml
"""


def add_export_options(parser: argparse.ArgumentParser) -> None:
    """What `gaident export` takes."""
    parser.add_argument("result", metavar="RESULT.json", help="what diagnose --out or identify --out saved")
    parser.add_argument("--to", required=True, choices=tuple(FORMS), help="for which tool")
    parser.add_argument("-o", "--out", metavar="FILE", help="where to write (default: RESULT.c, .fmu, .py, ... here)")
    parser.add_argument("--dt", type=number, metavar="S", help="of C and FMU: sample time of the steps [s]")
    parser.add_argument(
        "--closed", action="store_true", help="of C and FMU: with the controller of the result, its command to velocity"
    )
    parser.add_argument("--linear", action="store_true", help="the linear part of the model alone")
    parser.add_argument("--sources", action="store_true", help="of an FMU: sources alone, no library for this machine")
    parser.add_argument("--compiler", metavar="COMMAND", help="of an FMU: C compiler (default: $CC, cc, gcc or clang)")
    parser.add_argument("--speed", type=number, metavar="X", help="of a joint: speed up to which friction counts [rad/s]")
    parser.add_argument("--torque-constant", type=number, metavar="X", help="of wpilib: [N m/A], for gains in amperes")
    parser.add_argument("--axis", choices=AXES, help="units of CSV and FMU (default: those of the result)")
    parser.add_argument("--json", action="store_true", help="print what was written as JSON")
