"""No name that a script, a call in a shell or a drive file of the version before uses went away.

A name that goes away works for one more version and warns with the new name, as CHANGELOG.md promises.
`PYTHONPATH=tests/python/support python tests/python/project/test_kept_names.py` prints the names of the installed version.
Those of 0.1 are of the Python sources of commit f00f6e34, without the four effects that its core had not.
"""

from __future__ import annotations

import argparse
import dataclasses
import inspect
from collections.abc import Iterator

import pytest

import gaident as ga
from gaident.cli import COMMANDS
from gaident.cli.options import parser_of
from gaident.control.controller import Controller
from gaident.drive.drive_file import KEYS
from places import GOLDEN


def arguments(of: str, call: object) -> Iterator[str]:
    """Each argument of a function or method, as in `ga.read(dt)`."""
    if callable(call):
        yield from (f"{of}({name})" for name in inspect.signature(call).parameters if name not in ("self", "cls"))


def members(of: str, kind: type) -> Iterator[str]:
    """Fields, properties and methods of a class, and their arguments; not what `Controller` asks of every controller."""
    yield from (f"{of}.{field.name}" for field in (dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ()))
    for base in set(kind.__mro__) - {*Controller.__mro__, *tuple.__mro__, *BaseException.__mro__}:
        for name, member in vars(base).items():
            function = getattr(member, "__func__", member)
            if not name.startswith("_") and not (issubclass(kind, Controller) and hasattr(Controller, name)):
                yield f"{of}.{name}"
                yield from arguments(f"{of}.{name}", function if inspect.isfunction(function) else None)


def in_python() -> Iterator[str]:
    for name in ga.__all__:
        thing = getattr(ga, name)
        yield f"ga.{name}"
        yield from arguments(f"ga.{name}", thing)
        if inspect.isclass(thing):
            yield from members(f"ga.{name}", thing)
    yield from (f"ga.errors.{name}" for name in ga.errors.__all__)
    for row in ga.effects.table():
        yield from (f"effect {row.name} {parameter.name}" for parameter in row.parameters)


def in_a_shell() -> Iterator[str]:
    (commands,) = (a for a in parser_of(dict.fromkeys(COMMANDS, print))._actions if isinstance(a, argparse._SubParsersAction))
    for command, parser in commands.choices.items():
        for action in parser._actions:
            yield from (f"gaident {command} {option}" for option in action.option_strings)
            yield from (
                f"gaident {command} {action.option_strings[-1]} {choice}"
                for choice in action.choices or ()
                if action.option_strings
            )


def in_a_drive_file() -> Iterator[str]:
    for section, keys in KEYS.items():
        yield from (f"drive file [{section}] {key}" for key in keys)


def names() -> set[str]:
    return {*in_python(), *in_a_shell(), *in_a_drive_file()}


@pytest.mark.long
def test_every_name_of_0_1_is_there() -> None:
    before = set((GOLDEN / "names_0_1.txt").read_text(encoding="utf-8").splitlines())
    assert len(before) > 1000
    gone = sorted(before - names())
    assert not gone, f"these went away; let them work for one more version, with a warning that says the new name: {gone}"


if __name__ == "__main__":
    print("\n".join(sorted(names())))
