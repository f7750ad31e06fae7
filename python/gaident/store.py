"""Saved results back from their files."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from gaident.diagnosis.result import SCHEMA as DIAGNOSIS
from gaident.diagnosis.result import Diagnosis
from gaident.errors import GaidentError
from gaident.identification.result import SCHEMA as IDENTIFICATION
from gaident.identification.result import Identification, decoded

__all__ = ["load"]

READERS: dict[str, Callable[[Mapping[str, Any]], Identification | Diagnosis]] = {
    IDENTIFICATION: Identification.from_dict,
    DIAGNOSIS: Diagnosis.from_dict,
}


def load(path: str | os.PathLike[str]) -> Identification | Diagnosis:
    """Reads what `Identification.save` or `Diagnosis.save` wrote.

    Raises GaidentError naming the file where it is missing, no JSON, or neither of them.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError, TypeError) as error:
        raise GaidentError(f"{path}: cannot be read ({error}); give a file that save() wrote") from error
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise GaidentError(f"{path}: line {error.lineno} is not JSON ({error.msg}); give a file that save() wrote") from error
    reader = READERS.get(str(data.get("schema"))) if isinstance(data, dict) else None
    if reader is None:
        raise GaidentError(f"{path}: holds neither a saved identification nor a saved diagnosis; give a file that save() wrote")
    try:
        return reader(decoded(data))
    except GaidentError as error:
        raise GaidentError(f"{path}: {error}") from error
