"""Options and help of `gaident retune`, `gaident feedforward` and `gaident map`."""

from __future__ import annotations

import argparse

from gaident.axis import AXES
from gaident.cli.log_options import number
from gaident.policy.table import POLICY

__all__ = [
    "FEEDFORWARD_EXAMPLES",
    "FEEDFORWARD_HELP",
    "MAP_EXAMPLES",
    "MAP_HELP",
    "RETUNE_EXAMPLES",
    "RETUNE_HELP",
    "add_feedforward_options",
    "add_map_options",
    "add_retune_options",
]

RETUNE_HELP = """\
Proposes gains for the drive of a saved diagnosis or identification: as stiff as margins, torque and the
uncertainty of the model allow, and says what they change. Where the data contradict the model, the first line
says so. A saved result has no samples: give the controller's sample time with --dt, and the step that the
torque limit is meant for with --step.
"""
RETUNE_EXAMPLES = """\
examples:
  gaident diagnose run1.csv --drive drive.toml --out run.json
  gaident retune run.json --dt 0.444e-3 --phase-margin 50 --torque-limit 2.4 --step 80 --plot loop.png
  gaident retune run.json --dt 125e-6 --out gains.json
"""
FEEDFORWARD_HELP = """\
Writes what a drive can add to the torque beforehand, from a saved diagnosis: friction by velocity in both
directions, gravity and cogging by angle, and the inertia, as CSV or as one C99 file.
With the log of the diagnosis, or another one of the same loop, it simulates the following error without and
with the tables.
"""
FEEDFORWARD_EXAMPLES = """\
examples:
  gaident feedforward run.json --speed 80                    prints a summary
  gaident feedforward run.json --speed 80 --csv axis.csv --c axis.c
  gaident feedforward run.json run1.csv --drive drive.toml --speed 80        and what the tables bring
"""
MAP_HELP = """\
Maps the friction of an axis: torque against velocity at the speeds that its logs hold, both directions, with
deviations, and the law of friction that fits it best with its rivals. It needs velocity and torque, no controller,
and no log as fast as the loop: a line every 20 ms will do.
"""
MAP_EXAMPLES = """\
examples:
  gaident map speeds.csv --drive drive.toml
  gaident map cold.csv warm.csv --drive drive.toml --temperature motor_temp --out friction
      writes friction/friction_map.csv (held speeds), bins.csv, friction_map.json and friction_map.png
"""


def add_retune_options(parser: argparse.ArgumentParser) -> None:
    """What `gaident retune` takes."""
    parser.add_argument("result", metavar="RESULT.json", help="what diagnose --out or identify --out saved")
    g = parser.add_argument_group("what is asked for")
    text = f"least phase margin [deg] (default {POLICY.phase_margin:g})"
    g.add_argument("--phase-margin", type=number, default=POLICY.phase_margin, metavar="X", help=text)
    text = f"least gain margin [dB] (default {POLICY.gain_margin:g})"
    g.add_argument("--gain-margin", type=number, default=POLICY.gain_margin, metavar="X", help=text)
    text = "largest torque of a step of the command [N m] (default: that of the controller)"
    g.add_argument("--torque-limit", type=number, metavar="X", help=text)
    g.add_argument("--torque-noise", type=number, metavar="X", help="largest rms of the torque that noise makes [N m]")
    g.add_argument("--step", type=number, metavar="X", help="size of that step [rad/s] (default 1)")
    g.add_argument("--dt", type=number, metavar="S", help="sample time of the controller [s]")
    g.add_argument("--most-times", type=number, metavar="X", help="times the given gains, which the proposed ones are at most")
    g.add_argument("--no-filters", action="store_true", help="add no low pass and no notch to a cascade")
    g.add_argument("--seed", type=int, default=0, metavar="N", help="same seed, same result (default 0)")
    g = parser.add_argument_group("results")
    g.add_argument("-o", "--out", metavar="FILE", help="save the retuning (JSON)")
    g.add_argument("--plot", metavar="FILE", help="draw the loop and its step before and after (.png, .pdf, .svg)")
    g.add_argument("--axis", choices=AXES, help="words and units (default: those of the result)")
    g.add_argument("--json", action="store_true", help="print what --out saves instead of the summary")


def add_feedforward_options(parser: argparse.ArgumentParser) -> None:
    """What `gaident feedforward` takes."""
    parser.add_argument("result", metavar="RESULT.json", help="what diagnose --out saved")
    parser.add_argument("log", nargs="?", metavar="LOG", help="log whose command is simulated without and with the tables")
    parser.add_argument("--speed", type=number, required=True, metavar="X", help="highest speed of the table [rad/s]")
    parser.add_argument("--points", type=int, metavar="N", help="speeds of each direction (default 32)")
    parser.add_argument("--angles", type=int, metavar="N", help="angles of a turn (default 360)")
    parser.add_argument("--csv", metavar="FILE", help="write all tables as CSV")
    parser.add_argument("--c", metavar="FILE", help="write one C99 file with a function of the motion")
    parser.add_argument("--json", action="store_true", help="print the tables as JSON instead of the summary")


def add_map_options(parser: argparse.ArgumentParser) -> None:
    """What `gaident map` takes beside how a log is read."""
    parser.add_argument("logs", nargs="+", metavar="LOG", help="log file; several are of one axis")
    g = parser.add_argument_group("the map")
    g.add_argument("--inertia", type=number, metavar="X", help="inertia of the axis [kg m^2] (default: what the logs show)")
    g.add_argument("--temperature", metavar="NAME", help="column with the temperature")
    g.add_argument("--bins", type=int, metavar="N", help="bins of each direction between the held speeds (default 12)")
    g = parser.add_argument_group("results")
    g.add_argument("-o", "--out", metavar="DIR", help="folder for the tables (CSV, JSON) and the picture")
    g.add_argument("--json", action="store_true", help="print what friction_map.json has instead of the summary")
