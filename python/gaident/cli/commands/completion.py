"""gaident completion."""

from __future__ import annotations

import argparse

import shtab

__all__ = ["completion_command"]


def completion_command(args: argparse.Namespace) -> None:
    for parser in _parsers(args.whole_parser):
        for action in parser._actions:
            takes_file = action.metavar in ("FILE", "LOG", "PATH", "MODEL.json")
            takes_folder = action.metavar == "DIR"
            if takes_file or takes_folder:
                action.complete = shtab.FILE if takes_file else shtab.DIRECTORY  # type: ignore[attr-defined]
    print(shtab.complete(args.whole_parser, args.shell))


def _parsers(parser: argparse.ArgumentParser) -> list[argparse.ArgumentParser]:
    """The parser and those of its commands."""
    found = [parser]
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for short in action._choices_actions:  # shells show one line of a command
                action.choices[short.dest].description = short.help
            found += action.choices.values()
    return found
