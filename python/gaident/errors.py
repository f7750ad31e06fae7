"""Exceptions of gaident.

Wrong use raises one of these; all are subclasses of ValueError.
Every message names the argument (or the file and the line), the offending value and the remedy.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from gaident.arguments import Argument, parts_of

__all__ = [
    "ControllerError",
    "GaidentError",
    "ModelError",
    "ReadError",
    "RecordError",
    "SettingsError",
    "SpaceError",
    "check_schema",
]

# Of an array that is shown, or of a text in a log: what str.splitlines takes for one.
_LINE_ENDS = re.compile(r"\s*[\n\r\v\f\x1c-\x1e\x85\u2028\u2029]+\s*")


class GaidentError(ValueError):
    """Base of everything gaident raises on wrong use; a ValueError.

    Parameters
    ----------
    message : object
        The message; it may contain references to arguments, see gaident/arguments.py.

    Attributes
    ----------
    message : object
        The message as it was given.
    marked : str
        The message in one line, with its references to arguments, to be built into another one.

    Examples
    --------
    >>> import gaident as ga
    >>> try:
    ...     ga.PI(kp=-1.0, ki=5.0)
    ... except ga.GaidentError as error:
    ...     print(str(error)[:24])
    kp is -1: give a gain >=
    """

    def __init__(self, message: object = "") -> None:
        self.message = message
        self.marked = _LINE_ENDS.sub(" ", str(message))
        super().__init__("".join(map(str, self.parts)))

    @property
    def parts(self) -> tuple[str | Argument, ...]:
        """The message as texts and `Argument`s."""
        return parts_of(self.marked)

    def __reduce__(self) -> tuple[type[GaidentError], tuple[str]]:
        return type(self), (self.marked,)


def check_schema(data: Mapping[str, object], schema: str, version: int) -> None:
    """Raise GaidentError where saved data are not of this schema and version; says which they are."""
    if not isinstance(data, Mapping):
        raise GaidentError(f"data is {data!r:.80}: give the dictionary that to_dict gave")
    if data.get("schema") != schema:
        raise GaidentError(f"schema is {data.get('schema')!r}: this is not a saved {schema.removeprefix('gaident/')}")
    found = data.get("schema_version")
    if isinstance(found, int) and found > version:
        raise GaidentError(f"schema_version is {found}: this gaident reads {version}; load it with a newer gaident")
    if found != version:
        raise GaidentError(f"schema_version is {found!r}: this gaident reads {version}; save it again as that")


class RecordError(GaidentError):
    """A record's arrays or its sample time cannot be used."""


class ReadError(GaidentError):
    """A log file cannot be read as asked.

    Attributes
    ----------
    fault : str
        What is wrong, without the place and the remedy, where the error was made by `at`; else "".

    Examples
    --------
    >>> import gaident as ga
    >>> error = ga.errors.ReadError.at("a.csv, line 3", "time column 't' does not increase", "sort the log")
    >>> print(error)
    a.csv, line 3: time column 't' does not increase; sort the log
    >>> error.fault
    "time column 't' does not increase"
    """

    fault = ""

    @classmethod
    def at(cls, place: str, fault: str, remedy: str) -> ReadError:
        """Make the error from its parts.

        Parameters
        ----------
        place : str
            File and line.
        fault : str
            What is wrong there.
        remedy : str
            What to do.

        Returns
        -------
        ReadError
            The error, to be raised.
        """
        error = cls(f"{place}: {fault}; {remedy}")
        error.fault = fault
        return error


class ControllerError(GaidentError):
    """A controller's parameters make no controller."""


class ModelError(GaidentError):
    """A model's parameters make no model, or it does not suit the loop it is put in."""


class SpaceError(GaidentError):
    """A search space is empty or contradicts itself."""


class SettingsError(GaidentError):
    """Settings of a method are out of their range."""
