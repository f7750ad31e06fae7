"""The commands' options and their help. Every call parses, so nothing heavy is imported here."""

from __future__ import annotations

import argparse
import difflib
import re
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

from gaident.axis import percent
from gaident.cli.export_options import EXPORT_EXAMPLES, EXPORT_HELP, add_export_options
from gaident.cli.fleet_options import (
    FLEET_EXAMPLES,
    FLEET_HELP,
    TRENDS_EXAMPLES,
    TRENDS_HELP,
    add_fleet_options,
    add_trends_options,
)
from gaident.cli.log_options import add_log_commands, add_log_options, gain, number
from gaident.cli.remedy_options import (
    FEEDFORWARD_EXAMPLES,
    FEEDFORWARD_HELP,
    MAP_EXAMPLES,
    MAP_HELP,
    RETUNE_EXAMPLES,
    RETUNE_HELP,
    add_feedforward_options,
    add_map_options,
    add_retune_options,
)
from gaident.cli.report_options import REPORT_EXAMPLES, REPORT_HELP, add_report_option, add_report_options
from gaident.cli.responses import add_response_options
from gaident.control.words import LOOPS
from gaident.errors import SettingsError
from gaident.policy.table import POLICY
from gaident.results.settings import INITIAL_STATES

__all__ = ["PICTURES", "parser_of"]

PICTURES = (".png", ".pdf", ".svg")
IDENTIFY_HELP = """\
Finds structure (p,q), poles, zeros and mechanical parameters of the drive behind one log or several
(one model for all), with their uncertainty, and says whether a linear model holds at all.

With a controller, the log's velocity command drives the simulated loop; without one, its torque drives
the model. Formats: CSV and other text tables, MAT, NPZ; with the extra gaident[formats] also HDF5, Parquet,
TDMS and MDF. `gaident columns LOG` lists what a log contains, `gaident init LOG` writes its drive.toml.
"""
IDENTIFY_EXAMPLES = """\
examples:
  a CSV with the columns w_ref and w [rpm], and the controller's gains:
    gaident identify run1.csv --columns command=w_ref,velocity=w --unit velocity=rpm,command=rpm \\
        --kp 0.0232 --ki 1.367 --out run1.json --plot run1.png
  the same, with everything that belongs to the axis in a file:
    gaident identify run*.csv --drive drive.toml
  open loop, velocity from a position, force from the drive's voltage:
    gaident identify DATA_EMPS.mat --columns torque=vir,position=qm,time=t --unit torque=35.15 \\
        --axis linear
  a measured frequency response, alone or beside logs of the same axis:
    gaident identify --response bode.csv --response-dt 125e-6
    gaident identify run1.csv --drive drive.toml --response bode.csv
  as in the paper (Table II), in the paper's ranges:
    gaident identify step.csv --kp 0.0232 --ki 1.367 --loop continuous --paper \\
        --gain 1e3 2e4 --real 0 60 --imaginary 0 250 --trials 20

drive.toml, every part optional:
  axis = "rotary"                 # or "linear"
  screw = "10 mm"                 # of a motor on a screw whose log is in mm
  dt = 0.444e-3                   # s; also velocity_cutoff_hz, counts_per_turn, torque_constant,
                                  # rated_torque, torque_per_volt, gear_ratio, load_side, torque_is,
                                  # torque_log, decimate, resample, delimiter, decimal, skip, encoding
  [columns]
  command = "w_ref"
  velocity = "w"
  [units]
  velocity = "rpm"                # or the factor to SI, as a number
  [shift]
  torque = -1                     # samples, for a channel that the log wrote on another line than the rest
  [controller]
  kp = 0.0232                     # N m s/rad, "0.12 A s/rad" or "unknown"
  ki = 1.367                      # N m/rad, or tn = "10 ms"; also loop, torque_limit, integrator_limit; drive
                                  # with its own gains, rule, command_weight, anti_windup, tracking_time,
                                  # period, delay, torque_filters, velocity_filters, command_filters, ...
  [space]
  inertia = [1e-4, 5e-3]          # kg m^2; also resonance_hz, damping, or gain, real, imaginary, p, q, bits
  [limits]
  speed = 100                     # rad/s; also torque, travel, duration, for `gaident experiment`

exit codes: 0 done, 1 the work failed, 2 wrong use, 130 interrupted
"""
SIMULATE_HELP = """\
Drives a model with each log's command (through the controller) or torque (open loop) and writes the
velocity and torque that come out. MODEL.json: what `identify --out` saved (its controller is used unless
another one is given), {"gain": ..., "poles": ..., "zeros": ...}, or {"structure": "two masses", "JM": ...}.
"""
SIMULATE_EXAMPLES = """\
examples:
  gaident simulate run1.json run2.csv --drive drive.toml > simulated.csv
  gaident simulate run1.json run*.csv --drive drive.toml --out simulated/     one CSV per log
  gaident simulate motor.json run2.csv --kp 0.0232 --ki 1.367 --json
"""
EFFECTS_HELP = (
    """Lists the effects: place in the loop, parameters with units, one line of meaning; of named ones the bounds too."""
)

DIAGNOSE_HELP = """\
Shows what the simulation of an axis gets wrong, names the physical cause where the data allow it (dry
friction, backlash, saturation, delay, cogging, ...), extends the model with it and measures the gain on data
that no parameter was fitted to. Where two causes cannot be told apart it says so, and proposes the next
experiment. Identifies the linear model first, unless --model brings one.
"""
DIAGNOSE_EXAMPLES = """\
examples:
  gaident diagnose run1.csv --drive drive.toml
  gaident diagnose run1.csv run2.csv --validation run3.csv --drive drive.toml --plot run.png --out run.json
  gaident diagnose run1.csv --kp 0.0232 --ki 1.367 --bootstrap 99 --next-command next.csv
  gaident diagnose run1.csv --drive drive.toml --quick --accuracy '1 rpm'

A log of several axes: [axes.x.columns], [axes.x.controller], ... in drive.toml beside what is common; each is
diagnosed, one row each, or those that --select names.

exit codes: 0 done (whatever the verdict), 1 the work failed, 2 wrong use, 130 interrupted
"""
DEMO_HELP = """\
The main job: identifies a two-mass drive (the paper's robot arm, Table III) from a noisy velocity step
through its PI loop, and compares the result with the truth. Where the environment variable GAIDENT_DATA
names a folder with emps/DATA_EMPS.mat, it then identifies that measured ball-screw axis too. At the end it
diagnoses the drive with a dry friction that the linear model does not know of: what is wrong, why, the gain.
"""
REPRODUCE_HELP = """\
Re-creates the tables and figures of the paper behind the method: what follows from its own numbers (Tables III
to V), and on a simulated rig with dry friction, in place of the original one, Figs. 6 to 8, the comparison with
least squares, the times, and the diagnosis that names the friction. Says what is reproduced, what is simulated,
and where the paper disagrees with itself. Writes paper.html, which contains its pictures, and the pictures as PNG.
"""


ACCURACY = (
    "how accurate the simulation has to be, rms of the velocity or of the torque: '1 rpm', '2 %%' or both; what is left below it "
    "is called negligible. A number alone is in the velocity's unit of [show], or in rad/s"
)


def parser_of(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The parser; commands: name -> where the function that runs it stands, set as `run`."""
    parser = _Parser(
        prog="gaident",
        description="From a servo drive's log to a model of its mechanics, and what it is worth.",
        epilog="gaident COMMAND --help explains a command, with examples.",
    )
    parser.add_argument("--version", action=_Version)
    parser.set_defaults(whole_parser=parser)
    subparsers = parser.add_subparsers(metavar="COMMAND", required=True)

    def command(name: str, files: str, line: str, text: str, epilog: str = "") -> _Parser:
        usage = f"gaident {name} {files}[options]"
        sub: _Parser = subparsers.add_parser(name, usage=usage, help=line, description=text, epilog=epilog)
        sub.set_defaults(run=commands[name])
        sub.add_argument("--quiet", action="store_true", help="print nothing but errors (and what --json asks for)")
        return sub

    sub = command("identify", "LOG... ", "log -> structure, parameters, uncertainty", IDENTIFY_HELP, IDENTIFY_EXAMPLES)
    sub.add_argument("logs", nargs="*", metavar="LOG", help="log file; several give one model for all")
    add_log_options(sub)
    add_response_options(sub)
    _add_controller_options(sub)
    _add_space_options(sub)
    g = sub.add_argument_group("the search")
    g.add_argument("--paper", action="store_true", help="exactly the paper's genetic algorithm (Table II)")
    g.add_argument("--trials", type=int, default=1, metavar="N", help="independent genetic runs (default 1)")
    _add_run_options(g)
    g.add_argument(
        "--initial-state",
        choices=INITIAL_STATES,
        default="auto",
        help="auto: estimated for records that do not start at rest (default)",
    )
    g = sub.add_argument_group("results")
    g.add_argument("-o", "--out", metavar="FILE", help="save the identification (JSON)")
    g.add_argument("--plot", metavar="FILE", help=f"draw measured against simulated ({', '.join(PICTURES)})")
    add_report_option(g, remedies=False)
    g.add_argument("--json", action="store_true", help="print what --out saves instead of the summary")

    sub = command(
        "diagnose", "LOG... ", "log -> what the model gets wrong, its cause, the gain", DIAGNOSE_HELP, DIAGNOSE_EXAMPLES
    )
    sub.add_argument("logs", nargs="+", metavar="LOG", help="log file; several are judged together")
    end = f"the last {percent(1.0 - POLICY.fitted_share)}% of each log"  # argparse prints %% as %
    sub.add_argument("--validation", nargs="+", metavar="LOG", help=f"logs that no parameter is fitted to (default: {end})")
    sub.add_argument("--model", metavar="FILE", help="the identification to diagnose, as identify --out saved it")
    add_log_options(sub)
    _add_controller_options(sub)
    g = sub.add_argument_group("the diagnosis")
    g.add_argument("--noise", type=number, metavar="X", help="standard deviation of the velocity noise, where known [rad/s]")
    g.add_argument(
        "--bootstrap",
        type=int,
        default=0,
        metavar="N",
        help="simulated records for the p-value of the first finding (default 0: none)",
    )
    g.add_argument("--accuracy", nargs="+", metavar="X", help=ACCURACY)
    g.add_argument("--quick", action="store_true", help="name the first cause and stop: to look at a log, or at many")
    text = "diagnose variations of the logs too, and count how often the same causes are named; some eight times as long"
    g.add_argument("--stability", action="store_true", help=text)
    g.add_argument("--seed", type=int, default=0, metavar="N", help="same seed, same result (default 0)")
    g = sub.add_argument_group("results")
    g.add_argument("-o", "--out", metavar="FILE", help="save the diagnosis (JSON)")
    g.add_argument("--plot", metavar="FILE", help=f"draw what is wrong and what is left ({', '.join(PICTURES)})")
    add_report_option(g, remedies=True)
    g.add_argument("--next-command", metavar="FILE", help="write the proposed experiment's command (CSV)")
    g.add_argument("--json", action="store_true", help="print what --out saves instead of the summary")

    sub = command("fleet", "LOG... ", "many logs -> a dataset of diagnoses", FLEET_HELP, FLEET_EXAMPLES)
    add_fleet_options(sub)
    add_log_options(sub)
    _add_controller_options(sub)

    sub = command("trends", "FLEET ", "what changed on which axis of a fleet", TRENDS_HELP, TRENDS_EXAMPLES)
    add_trends_options(sub)

    sub = command(
        "simulate",
        "MODEL.json LOG... ",
        "model + log -> velocity and torque",
        SIMULATE_HELP,
        SIMULATE_EXAMPLES,
    )
    sub.add_argument("model", metavar="MODEL.json", help="a saved identification, or a model")
    sub.add_argument("logs", nargs="+", metavar="LOG", help="log file")
    add_log_options(sub)
    _add_controller_options(sub)
    sub.add_argument(
        "--initial-state",
        choices=("auto", "rest"),
        default="auto",
        help="auto: estimated for records that do not start at rest (default)",
    )
    g = sub.add_argument_group("results")
    g.add_argument("-o", "--out", metavar="PATH", help="CSV file; a folder where several logs are given")
    g.add_argument("--json", action="store_true", help="print everything as JSON instead of CSV")

    add_log_commands(command)

    line = "saved results, and their logs -> one HTML page"
    sub = command("report", "RESULT.json... [LOG...] ", line, REPORT_HELP, REPORT_EXAMPLES)
    add_report_options(sub)
    add_log_options(sub)

    sub = command("export", "RESULT.json ", "saved result -> C, SciPy, python-control, CSV", EXPORT_HELP, EXPORT_EXAMPLES)
    add_export_options(sub)

    sub = command("retune", "RESULT.json ", "saved result -> gains, the loop before and after", RETUNE_HELP, RETUNE_EXAMPLES)
    add_retune_options(sub)

    line = "saved diagnosis -> tables of friction, gravity, inertia"
    sub = command("feedforward", "RESULT.json [LOG] ", line, FEEDFORWARD_HELP, FEEDFORWARD_EXAMPLES)
    add_feedforward_options(sub)
    add_log_options(sub)

    sub = command("map", "LOG... ", "log -> friction at held speeds, and its law", MAP_HELP, MAP_EXAMPLES)
    add_map_options(sub)
    add_log_options(sub)

    sub = command("effects", "[NAME ...] ", "what a model can carry beyond its linear part", EFFECTS_HELP)
    sub.add_argument("names", nargs="*", metavar="NAME", help="only these effects, each with the bounds of its parameters")
    sub.add_argument("--json", action="store_true", help="print JSON instead of a table")

    sub = command("demo", "", "the main job, on data of its own", DEMO_HELP)
    sub.add_argument("-o", "--out", metavar="DIR", default=".", help="where pictures go (default: the current folder)")
    _add_run_options(sub)
    sub.add_argument("--json", action="store_true", help="print JSON instead of text")

    sub = command("reproduce", "", "the paper's tables and figures, reproduced and checked", REPRODUCE_HELP)
    sub.add_argument("-o", "--out", metavar="DIR", default=".", help="where paper.html and its pictures go (default: here)")
    sub.add_argument("--trials", type=int, default=20, metavar="N", help="genetic runs per engine and mechanism (default 20)")
    sub.add_argument("--seeds", type=int, default=100, metavar="N", help="noise seeds against least squares (default 100)")
    _add_run_options(sub)
    sub.add_argument("--json", action="store_true", help="print JSON instead of text; the files are written all the same")
    return parser


def _add_run_options(group: Any) -> None:
    group.add_argument("--seed", type=int, default=0, metavar="N", help="same seed, same result (default 0)")
    group.add_argument("--workers", type=int, metavar="N", help="threads (default: all processors)")


def _whole_range(text: str) -> tuple[int, int]:
    """(1, 1) of "1", (0, 3) of "0..3"."""
    match = re.fullmatch(r"(\d+)(?:\.\.(\d+))?", text.strip())
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is neither a whole number nor a range like 0..3")
    return int(match[1]), int(match[2] or match[1])


def _add_controller_options(parser: argparse.ArgumentParser) -> None:
    """The velocity loop."""
    g = parser.add_argument_group("the velocity controller", "without one: open loop, torque to velocity")
    g.add_argument("--kp", type=gain, metavar="X", help="proportional gain [N m s/rad], 'X UNIT', or unknown")
    g.add_argument("--ki", type=gain, metavar="X", help="integral gain [N m/rad], 'X UNIT', or unknown")
    g.add_argument(
        "--loop",
        choices=(*LOOPS, "open"),
        help="sampled: a digital drive (default); continuous: everything bilinear, as in the paper; open: "
        "leave the controller out",
    )
    g.add_argument("--torque-limit", type=gain, metavar="X", help="the controller's torque limit [N m], or 'X UNIT'")
    g.add_argument("--integrator-limit", type=number, metavar="X", help="limit of its integral part [N m]")


def _add_space_options(parser: argparse.ArgumentParser) -> None:
    """Where parameters are looked for."""
    g = parser.add_argument_group("where to look", "what is not given is derived from the data")
    for name, text in (
        ("--inertia", "total inertia [kg m^2] or mass [kg]"),
        ("--resonance-hz", "where the mechanism may resonate [Hz]"),
        ("--damping", "total viscous damping [N m s/rad], with --inertia"),
        ("--gain", "K at p = 1, that is 1/J_M [1/(kg m^2)]"),
        ("--real", "negated real parts of poles and zeros [rad/s]"),
        ("--imaginary", "imaginary parts [rad/s]"),
    ):
        g.add_argument(name, nargs=2, type=number, metavar=("LOW", "HIGH"), help=text)
    for name, text in (("--p", "poles in excess of zeros"), ("--q", "zeros")):
        g.add_argument(name, type=_whole_range, metavar="N|A..B", help=f"{text}: 1, or 0..3")
    g.add_argument("--bits", type=int, metavar="N", help="bits per number of the genetic code (default 10)")


class _Parser(argparse.ArgumentParser):
    """argparse that raises for wrong use; no abbreviations, as they change when options are added."""

    def __init__(self, **kwargs: Any) -> None:
        more = {"formatter_class": argparse.RawDescriptionHelpFormatter, "allow_abbrev": False}
        super().__init__(**{**more, **kwargs})

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Arguments that nothing takes are an error of the command's own parser, which knows its options and its help."""
        namespace, rest = super().parse_known_args(args, namespace)
        if rest:
            self.error(f"unrecognized arguments: {' '.join(rest)}{self._meant(rest[0])}")
        return namespace, rest

    def _meant(self, argument: str) -> str:
        """What may have been meant by an argument that nothing takes."""
        if not argument.startswith("-"):
            return " (name all files in one place, without options between them)"
        near = difflib.get_close_matches(argument.partition("=")[0], self._option_string_actions, n=1)
        return f" (did you mean {near[0]}?)" if near else ""

    def error(self, message: str) -> NoReturn:
        if (wrong := re.search(r"invalid choice: '([^']*)' \(choose from (.*)\)", message)) is not None:
            near = difflib.get_close_matches(wrong[1], re.findall(r"[\w-]+", wrong[2]), n=1)
            message = f"{message[: wrong.end(1)]}' (did you mean {near[0]!r}?)" if near else message
        raise SettingsError(f"{message}; see {self.prog} --help")


class _Version(argparse._VersionAction):
    """--version, which is looked up only when it is asked for."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        from gaident.version import version

        self.version = f"gaident {version()}"
        super().__call__(parser, namespace, values, option_string)
