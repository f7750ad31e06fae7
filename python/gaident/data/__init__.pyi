from .alignment import Alignment, align
from .axes import read_axes
from .frequency.read_response import read_response
from .frequency.response import FrequencyResponse
from .listing import Listing, columns
from .pieces import read_pieces
from .readers import read, read_columns
from .record import Record
from .signals.conditioning import differentiate
from .winding import Winding

__all__ = [
    "Alignment",
    "FrequencyResponse",
    "Listing",
    "Record",
    "Winding",
    "align",
    "columns",
    "differentiate",
    "read",
    "read_axes",
    "read_columns",
    "read_pieces",
    "read_response",
]
