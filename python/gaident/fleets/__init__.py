"""Many logs of many axes: diagnosed by any number of processes, kept as a dataset, and what changed on which axis."""

from __future__ import annotations

import lazy_loader

# The names stand in __init__.pyi; a name's module is imported when the name is first used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
