"""What an identification and a diagnosis have in common: the records they were made from, and their JSON."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar

from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.files import write_whole
from gaident.results.json_text import json_text

__all__ = ["SavedResult", "given_record", "rows_of", "undamaged"]


def given_record(rec: object) -> Record:
    """`rec`, where it is a record; raises GaidentError."""
    if not isinstance(rec, Record):
        raise GaidentError(f"rec is {type(rec).__name__}: give a gaident.Record")
    return rec


class SavedResult(ABC):
    """A result that is saved as JSON without its records, and drawn with them."""

    KIND: ClassVar[str]
    """What messages call it."""
    records: tuple[Record, ...]

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON, without the records."""

    def to_json(self) -> str:
        """Return what `save` writes."""
        return json_text(self.to_dict())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write JSON for `gaident.load`; the file appears whole or not at all."""
        write_whole(path, self.to_json().encode())

    def _chosen(self, records: Record | Sequence[Record] | None) -> tuple[Record, ...]:
        """The records given, or the result's own; of a loaded result none. Raises GaidentError."""
        given = self.records if records is None else (records,) if isinstance(records, Record) else records
        if not isinstance(given, Sequence) or not all(isinstance(r, Record) for r in given):
            raise GaidentError(f"records is {type(records).__name__}: give a gaident.Record or a list of them")
        return tuple(given)

    def _drawn(self, records: Record | Sequence[Record] | None, method: str) -> tuple[Record, ...]:
        """As `_chosen`, at least one. Raises GaidentError with the call that has one."""
        chosen = self._chosen(records)
        if not chosen:
            raise GaidentError(f"records: a loaded {self.KIND} contains no data; give {method}(records)")
        return chosen


def rows_of(matrix: Sequence[Sequence[float]] | None) -> tuple[tuple[float, ...], ...] | None:
    """A saved matrix; files of gaident 0.1.0 have none."""
    return None if matrix is None else tuple(tuple(map(float, row)) for row in matrix)


@contextmanager
def undamaged(kind: str) -> Iterator[None]:
    """Around the making of a result from saved data: what they lack becomes a GaidentError."""
    try:
        yield
    except GaidentError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise GaidentError(f"the saved {kind} is damaged: {error!r}; save it again") from error
