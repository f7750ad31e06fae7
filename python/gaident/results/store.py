"""Saved results, read from their files."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from gaident.checks import checked_path
from gaident.data.record import SCHEMA as RECORD
from gaident.data.record import Record
from gaident.errors import GaidentError, check_schema
from gaident.results.diagnosis import SCHEMA as DIAGNOSIS
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import SCHEMA as IDENTIFICATION
from gaident.results.identification import SCHEMA_VERSION, Identification
from gaident.results.json_text import decoded
from gaident.results.retuning import SCHEMA as RETUNING
from gaident.results.retuning import Retuning
from gaident.results.schema_check import check_saved

__all__ = ["load", "schema"]

Saved = Identification | Diagnosis | Record | Retuning

READERS: dict[str, Callable[[Mapping[str, Any]], Saved]] = {
    IDENTIFICATION: Identification.from_dict,
    DIAGNOSIS: Diagnosis.from_dict,
    RECORD: Record.from_dict,
    RETUNING: Retuning.from_dict,
}


def load(path: str | os.PathLike[str]) -> Saved:
    """Read what `Identification.save`, `Diagnosis.save`, `Retuning.save` or `Record.save` wrote.

    Parameters
    ----------
    path : str or path-like
        The JSON file.

    Returns
    -------
    Identification, Diagnosis, Retuning or Record
        What was saved; an identification and a diagnosis without their records.

    Raises
    ------
    GaidentError
        Where the file is missing, no JSON, none of them, of a newer schema, or names a user-defined effect that is not
        registered.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> rec = ga.Record(1e-3, torque=np.ones(20), velocity=np.zeros(20))
    >>> rec.save("run.json")
    >>> ga.load("run.json") == rec
    True
    """
    file = checked_path(path)
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise GaidentError(f"{path}: there is no such file; check the path (now in {Path.cwd()})") from error
    except UnicodeDecodeError as error:
        raise GaidentError(f"{path}: is no text; give a file that save() wrote, or read a log with gaident.read") from error
    except OSError as error:
        raise GaidentError(f"{path}: cannot be read ({error.strerror}); give a file that save() wrote") from error
    try:
        data = json.loads(text, parse_constant=_no_number)
    except json.JSONDecodeError as error:
        raise GaidentError(f"{path}: line {error.lineno} is not JSON ({error.msg}); give a file that save() wrote") from error
    except (ValueError, RecursionError) as error:  # NaN, a whole number of thousands of digits, brackets without end
        raise GaidentError(f"{path}: is not JSON as save() writes it ({error}); give a file that save() wrote") from error
    reader = READERS.get(str(data.get("schema"))) if isinstance(data, dict) else None
    if reader is None:
        raise GaidentError(
            f"{path}: contains no saved identification, diagnosis, retuning or record; give a file that save() wrote"
        )
    try:
        check_schema(data, data["schema"], SCHEMA_VERSION)
        check_saved(data, schema())
        return reader(decoded(data))
    except GaidentError as error:
        raise GaidentError(f"{path}: {error.marked}") from error
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise GaidentError(
            f"{path}: its parts contradict each other ({type(error).__name__}: {error}); the file is damaged; save it again"
        ) from error


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is no number of JSON")


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the files that `load` reads; it stands in the package as results.schema.json.

    Returns
    -------
    dict
        The schema.

    Examples
    --------
    >>> from gaident.results import schema
    >>> schema()["$schema"]
    'https://json-schema.org/draft/2020-12/schema'
    """
    data: dict[str, Any] = json.loads(Path(__file__).with_name("results.schema.json").read_text(encoding="utf-8"))
    return data
