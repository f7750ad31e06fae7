"""The command line: arguments -> the package's functions, exit codes, and nothing else."""

from __future__ import annotations

import lazy_loader

# The names stand in __init__.pyi; a name's module is imported when the name is first used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
