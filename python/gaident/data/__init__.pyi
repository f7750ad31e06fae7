from .alignment import Alignment, align
from .conditioning import differentiate
from .listing import Listing, columns
from .readers import read, read_columns
from .record import Record

__all__ = ["Alignment", "Listing", "Record", "align", "columns", "differentiate", "read", "read_columns"]
