"""The command line: arguments -> the package's functions, exit codes, and nothing else.

Exit codes: 0 done, 1 the work failed, 2 wrong use, 130 Ctrl-C, each but 0 with exactly one line on stderr; 141, without a
message, where the reader of the output closes the pipe (as of a process that SIGPIPE ends: `gaident effects | head -2`).
"""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from typing import cast

from gaident.cli.options import parser_of
from gaident.cli.remedies import in_options
from gaident.errors import GaidentError

__all__ = ["COMMANDS", "main"]

# Command -> module of gaident.cli.commands:function that runs it.
# A module is imported when its command runs, so that --help answers at once.
COMMANDS = {
    "identify": "identify:identify_command",
    "diagnose": "diagnose:diagnose_command",
    "fleet": "fleet:fleet_command",
    "trends": "trends:trends_command",
    "simulate": "simulate:simulate_command",
    "report": "report:report_command",
    "export": "export:export_command",
    "retune": "remedies:retune_command",
    "feedforward": "remedies:feedforward_command",
    "map": "friction:map_command",
    "effects": "effects:effects_command",
    "demo": "demo:demo_command",
    "reproduce": "reproduce:reproduce_command",
    "columns": "logs:columns_command",
    "init": "logs:init_command",
    "experiment": "experiment:experiment_command",
    "doctor": "doctor:doctor_command",
    "completion": "completion:completion_command",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns its exit code."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a name of a record never stops the output
    try:
        code = _run(argv)
        if sys.stdout is not None:  # None where the caller closed it
            sys.stdout.flush()
        return code
    except GaidentError as error:
        return _failed(2, in_options(error))
    except KeyboardInterrupt:
        return _failed(130, "interrupted")
    except BrokenPipeError:
        _drop_output()
        return 141
    except OSError as error:
        _drop_output()
        what = f"{error.filename}: {error.strerror}" if error.filename is not None else error.strerror
        return _failed(1, what or str(error))
    except Exception as error:
        return _failed(1, f"internal error, please report it: {type(error).__name__}: {error}")


def _run(argv: Sequence[str] | None) -> int:
    parser = parser_of(COMMANDS)
    given = sys.argv[1:] if argv is None else argv
    if not given:
        parser.print_help()
        return 0
    try:
        args = parser.parse_args(given)
    except SystemExit as exit_:  # --help, --version, wrong options
        return int(exit_.code or 0)
    if args.quiet and not getattr(args, "json", False):
        with open(os.devnull, "w", encoding="utf-8") as nowhere, contextlib.redirect_stdout(nowhere):
            return _command(args.run)(args) or 0
    return _command(args.run)(args) or 0


def _command(where: str) -> Callable[[Namespace], int | None]:
    """What an entry of COMMANDS names."""
    module, function = where.split(":")
    return cast(Callable[[Namespace], int | None], getattr(importlib.import_module(f"gaident.cli.commands.{module}"), function))


def _drop_output() -> None:
    """Throws away what standard output still buffers where it cannot be written: the interpreter would try again at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _failed(code: int, message: str) -> int:
    if sys.stderr is not None:
        print("gaident:", " ".join(message.split()), file=sys.stderr)
    return code
