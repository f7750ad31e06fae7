"""The pictures and the page of a result: what they show is worked out here, how it is drawn stands in `gaident.show`."""

from __future__ import annotations

import lazy_loader

# The names stand in __init__.pyi; a name's module is imported when the name is first used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
