"""Records of drives: what they are, how they are read from logs, and how signals are prepared."""

from gaident.data.alignment import Alignment, align
from gaident.data.conditioning import differentiate
from gaident.data.listing import Listing, columns
from gaident.data.readers import read, read_columns
from gaident.data.record import Record

__all__ = ["Alignment", "Listing", "Record", "align", "columns", "differentiate", "read", "read_columns"]
