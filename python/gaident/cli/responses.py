"""Frequency responses on the command line: the options of `gaident identify`, and what they read."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from gaident.cli.log_options import number
from gaident.data.frequency.columns import COLUMNS, KINDS, UNITS
from gaident.errors import SettingsError

if TYPE_CHECKING:
    from gaident.data.frequency.response import FrequencyResponse

__all__ = ["add_response_options", "responses_of"]


def add_response_options(parser: argparse.ArgumentParser) -> None:
    """How frequency responses are read."""
    g = parser.add_argument_group("frequency responses", "measured from torque, in text tables; alone or beside logs")
    g.add_argument(
        "--response", nargs="+", default=[], metavar="FILE", help="frequency, and magnitude and phase or real and imaginary"
    )
    names = ", ".join(COLUMNS)
    g.add_argument(
        "--response-columns", action="append", default=[], metavar="NAME=COLUMN,...", help=f"of {names} (default: by name)"
    )
    units = "; ".join(f"{key} {', '.join(known)}" for key, known in UNITS.items()).replace("%", "%%")  # of argparse
    g.add_argument("--response-units", action="append", default=[], metavar="NAME=UNIT,...", help=units)
    g.add_argument("--response-kind", choices=list(KINDS), default="torque to velocity", help="what was measured")
    g.add_argument("--response-dt", type=number, metavar="S", help="sample time of a drive that measured it [s]")
    g.add_argument("--response-scale", type=number, default=1.0, metavar="X", help="what 1 of the file is in SI units")


def responses_of(args: argparse.Namespace) -> list[FrequencyResponse]:
    """Those that the options name."""
    from gaident.data.frequency.read_response import read_response

    named = _assignments(args.response_columns, "--response-columns", list(COLUMNS))
    columns = {key: f"#{name}" if name.isdigit() else name for key, name in named.items()}
    units = _assignments(args.response_units, "--response-units", list(UNITS))
    return [
        read_response(file, columns, units, args.response_kind, args.response_dt, scale=args.response_scale)
        for file in args.response
    ]


def _assignments(texts: list[str], option: str, allowed: list[str]) -> dict[str, str]:
    """NAME=VALUE,... as a mapping. Raises SettingsError."""
    found = {}
    for part in (p for text in texts for p in text.split(",")):
        name, sign, value = part.partition("=")
        if not sign or name.strip() not in allowed:
            raise SettingsError(f"{option} {part!r}: write one of {', '.join(allowed)}, then = and its value")
        found[name.strip()] = value.strip()
    return found
