"""Out to the field's other tools: scipy.signal, python-control, pandas, C. Reached by the methods of models and results."""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
