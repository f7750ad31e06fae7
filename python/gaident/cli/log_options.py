"""Options that say how a log is read, and the commands around logs: columns, init, experiment, doctor, completion."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from typing import Any

from gaident.axis import AXES
from gaident.control.words import UNKNOWN
from gaident.data.torque_kind import TORQUE_KINDS, TORQUE_LOGS

__all__ = ["SHELLS", "add_log_commands", "add_log_options", "gain", "number"]

SHELLS = ("bash", "zsh", "fish", "tcsh")
COLUMNS_HELP = """\
Lists what a log contains: the names of its columns as --columns takes them, units, range, sample time, and
what stands in the way of their use. Formats: CSV and other text tables (of TwinCAT Scope, MR Configurator2,
EPOS Studio, NI or ROS as well), MAT, NPZ, HDF5, Parquet, TDMS, MDF, traces of SINUMERIK (XML).
"""
INIT_HELP = """\
Writes a drive.toml for the axis behind LOG: columns, units and sample time as the log shows them, each with
its reason, and a mark FILL IN where only a person knows (the controller's gains, a rated torque, ...).
"""
INIT_EXAMPLES = """\
examples:
  gaident init run1.csv                      writes drive.toml beside you
  gaident init run1.csv --out axis3.toml
  gaident identify run1.csv --drive drive.toml
"""
EXPERIMENT_HELP = """\
Proposes the command of a first record, before there is any: it excites every effect of the library within the
limits of the axis ([limits] of the drive file, or the options), as a CSV of time and velocity command.
A loop answers a jump of its command by X rad/s with kp times X: with kp known the command keeps to the torque
and leaves room for overshoot, without it the tool says what its jumps ask for.
"""
DOCTOR_HELP = """\
Prints versions, the processor's instruction set, threads and optional libraries, and identifies a small drive
as a self test. Exit code 1 where something that is needed is missing or broken.
"""
COMPLETION_HELP = """Prints the shell's completion of gaident's commands, options and files."""
COMPLETION_EXAMPLES = """\
bash:  gaident completion bash > ~/.local/share/bash-completion/completions/gaident
zsh:   gaident completion zsh > ~/.zfunc/_gaident            with fpath+=~/.zfunc before compinit in ~/.zshrc
fish:  gaident completion fish > ~/.config/fish/completions/gaident.fish
"""
CONSTANT_HELP = {
    "counts_per_turn": "encoder counts per turn of the motor, for units of counts",
    "torque_constant": "[N m/A], for a torque in A",
    "rated_torque": "what 100 %% means [N m], for a torque in %%",
    "reference_speed": "what 100 %% of a speed means [rad/s], for a velocity or command in %%",
    "torque_per_volt": "[N m/V], for a torque in V",
    "resistance": "of the winding [Ohm], with --torque-constant for a torque from a voltage",
    "inductance": "of the winding [H] (default: 0)",
    "back_emf_constant": "[V s/rad] (default: the torque constant)",
}
TEXT_TABLE_HELP = {
    "delimiter": "what separates columns, a character, tab or space (default: found out)",
    "decimal": "decimal mark, . or , (default: found out)",
    "skip": "lines to leave out at the top",
    "encoding": "as Python calls it (default: found out)",
}


def number(text: str) -> float:
    """argparse's number; a decimal comma gets its remedy."""
    try:
        return float(text)
    except ValueError:
        point = text.replace(",", ".")
        hint = f": write a decimal point, {point}" if "," in text and re.fullmatch(r"[-+\d.]+(e[-+]?\d+)?", point) else ""
        raise argparse.ArgumentTypeError(f"{text!r} is no number{hint}") from None


_WITH_UNIT = re.compile(r"\s*[-+\d.eE]+\s+\S")


def gain(text: str) -> float | str:
    """argparse's number of a controller: with its unit, or the word for one that is not known, as text."""
    return text if text == UNKNOWN else quantity(text)


def quantity(text: str) -> float | str:
    """argparse's number; with its unit, as text."""
    try:
        return float(text)
    except ValueError:
        return text if _WITH_UNIT.match(text) else number(text)


def add_log_options(parser: argparse.ArgumentParser) -> None:
    """How logs are read."""
    channels = "command, velocity, torque, position, position_command, load_position, load_velocity, time"
    g = parser.add_argument_group("the log", f"channels: {channels}")
    g.add_argument("--drive", metavar="FILE", help="drive.toml with what belongs to the axis; options override it")
    selected = "of a drive file with several axes, [axes.NAME], the one that is meant; gaident diagnose takes several"
    g.add_argument("--select", nargs="+", metavar="NAME", help=f"{selected} (default: all)")
    g.add_argument(
        "--columns",
        "--column",
        action="append",
        metavar="CH=NAME,...",
        help="column of each channel: its name, '#3' (number from 0), or data[:,3] of an array; "
        "CH= alone leaves a channel out. May be repeated",
    )
    g.add_argument(
        "--units",
        "--unit",
        action="append",
        metavar="CH=UNIT,...",
        help="unit of each channel (rpm, deg, counts, %%, A, V, ms, ...), or the factor to SI as a number",
    )
    g.add_argument("--dt", type=quantity, metavar="S", help="sample time [s], for logs without a time column")
    g.add_argument(
        "--velocity-cutoff",
        type=number,
        metavar="HZ",
        dest="velocity_cutoff_hz",
        help="a log without velocity gets it from position; with this, all its channels pass one zero-phase low-pass of this "
        "corner [Hz] first (default: none, which suits identification)",
    )
    g.add_argument(
        "--decimate", type=int, metavar="N", help="keep every N-th sample behind a linear-phase low-pass, as the log is read"
    )
    g.add_argument(
        "--resample",
        type=quantity,
        metavar="S",
        help="put irregular time stamps, or channels of several rates, on an even axis of this sample time [s]",
    )
    g.add_argument(
        "--from", type=quantity, metavar="S", help="leave out what lies before it [s], counted from the log's first line"
    )
    g.add_argument("--to", type=quantity, metavar="S", help="leave out what lies behind it [s]")
    pieces = "take what lies around the gaps of the time as records of their own, which are identified together"
    g.add_argument("--pieces", action="store_true", default=None, help=pieces)
    g.add_argument("--gear-ratio", type=number, metavar="X", help="turns of the motor per turn of the load, with --load-side")
    g.add_argument("--load-side", nargs="+", metavar="CH", help="channels that were measured behind the gear")
    shift = "move channels by samples, where the log wrote them on another line: torque=-1 for one that was logged a sample late"
    g.add_argument("--shift", action="append", metavar="CH=N,...", help=shift)
    kinds = "commanded: by the controller; measured: a current times a constant (default: as its column's name says)"
    g.add_argument("--torque-is", choices=TORQUE_KINDS, help=f"what the torque is: {kinds}")
    lines = "sample: its value at the line (default); mean: over the controller's samples since the line before; "
    lines += "held, smooth: its value at the line, held until the next, or low-passed and without steps"
    g.add_argument("--torque-log", choices=TORQUE_LOGS, help=f"what a line contains of the torque: {lines}")
    for name, text in CONSTANT_HELP.items():
        g.add_argument(f"--{name.replace('_', '-')}", type=quantity, metavar="X", help=text)
    _add_text_options(g)
    pitch = "of a linear axis, the length with which its cogging returns [m], or '10 mm': pitch of the screw or of the poles"
    g.add_argument("--pitch", type=quantity, metavar="M", help=pitch)
    screw = "of a motor on a screw, the length of a turn [m], or '10 mm': mm, mm/min and N of the log are then those of the motor"
    g.add_argument("--screw", type=quantity, metavar="M", help=screw)
    g.add_argument("--axis", choices=AXES, help="linear: print m, m/s, N, kg (default: rotary)")


def _add_text_options(group: Any) -> None:
    for name, text in TEXT_TABLE_HELP.items():
        kind, meta = (int, "LINES") if name == "skip" else (str, "TEXT")
        group.add_argument(f"--{name}", type=kind, metavar=meta, help=f"of a text table: {text}")


def add_log_commands(command: Callable[..., Any]) -> None:
    """The commands around logs; `command` makes one: (name, files, line, text, examples)."""
    sub = command("columns", "LOG... ", "what a log contains: names, units, range, sample time", COLUMNS_HELP)
    sub.add_argument("logs", nargs="+", metavar="LOG", help="log file")
    _add_text_options(sub)
    sub.add_argument("--json", action="store_true", help="print JSON instead of a table, a list where several logs are given")

    sub = command("init", "LOG ", "log -> a drive.toml to be completed", INIT_HELP, INIT_EXAMPLES)
    sub.add_argument("log", metavar="LOG", help="log file")
    sub.add_argument("-o", "--out", metavar="FILE", default="drive.toml", help="where to write (default: drive.toml)")
    sub.add_argument("--force", action="store_true", help="overwrite the file if there is one")
    _add_text_options(sub)
    sub.add_argument("--json", action="store_true", help="print what was found and what is to be filled in as JSON")

    sub = command("experiment", "", "limits of the axis -> the command of a first record", EXPERIMENT_HELP)
    sub.add_argument("--drive", metavar="FILE", help="drive.toml with dt, [limits], and kp and inertia as below")
    sub.add_argument("--dt", type=number, metavar="S", help="sample time [s]")
    for name, text in (
        ("speed", "highest speed [rad/s]"),
        ("torque", "highest torque [N m]"),
        ("travel", "highest minus lowest position [rad] (default: it may turn freely)"),
        ("duration", "longest record [s] (default 5)"),
    ):
        sub.add_argument(f"--{name}", type=number, metavar="X", help=text)
    sub.add_argument("--kp", type=number, metavar="X", help="the controller's gain [N m s/rad]: jumps then keep to the torque")
    inertia = "total inertia [kg m^2]: ramps then keep to the torque, that of HIGH"
    sub.add_argument("--inertia", nargs=2, type=number, metavar=("LOW", "HIGH"), help=inertia)
    sub.add_argument("-o", "--out", metavar="FILE", help="CSV file (default: standard output)")
    sub.add_argument("--json", action="store_true", help="print JSON instead of CSV")

    sub = command("doctor", "", "versions, instruction set, threads, optional libraries, self test", DOCTOR_HELP)
    sub.add_argument("--json", action="store_true", help="print JSON instead of text")

    sub = command("completion", "SHELL ", "completion for bash, zsh, fish or tcsh", COMPLETION_HELP, COMPLETION_EXAMPLES)
    sub.add_argument("shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS))
