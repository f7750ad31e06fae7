"""gaident: from a drive's log to a model, its structure and parameters, and what they are worth.

import gaident as ga

rec = ga.read("run1.csv", columns={"command": "w_ref", "velocity": "w"}, units={"velocity": "rpm"})
idn = ga.identify(rec, controller=ga.PI(kp=0.0232, ki=1.367))
print(idn.summary())
"""

from __future__ import annotations

import lazy_loader

# The public names stand in __init__.pyi; a name's module is imported when the name is first used.
_of_stub, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    if name == "__version__":
        from gaident.version import version

        return version()
    return _of_stub(name)
