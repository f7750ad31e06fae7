"""A drive with effects, integrated finely: what the core is compared with. It shares no code with the package.

The equations are in tests/cpp/fine_integrator.cpp, which is compiled when it is first needed.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from compiled import fields, library
from places import ROOT

Array = NDArray[np.float64]
SOURCE = ROOT / "tests" / "cpp" / "fine_integrator.cpp"


@dataclass
class FineCase:
    """One drive, loop and set of effects (name -> parameters), those of the shaft at the motor unless they are `at_load`.

    motor, load: (inertia, damping); shaft: (stiffness, damping); without a load one mass.
    """

    dt: float
    loop: str  # open, sampled, continuous
    source: Array  # torque in open loop, else command
    motor: tuple[float, float]
    load: tuple[float, float] | None = None
    shaft: tuple[float, float] = (0.0, 0.0)
    kp: float = 0.0
    ki: float = 0.0
    effects: dict[str, dict[str, float]] = field(default_factory=dict)
    at_load: dict[str, dict[str, float]] = field(default_factory=dict)


@dataclass
class FineRun:
    """What came out: columns of samples x cases; velocity as the sensor shows it."""

    velocity: Array
    torque: Array
    angle: Array


def values(case: FineCase) -> Array:
    """The case as fields of the C++."""
    shaft = fields(SOURCE, "shaft ")
    found = fields(SOURCE) | shaft | {f"load_{name}": value for name, value in shaft.items()}
    names = ("dt", "closed", "analog", "kp", "ki", "JM", "DM", "K", "D")
    loop = (float(case.loop != "open"), float(case.loop == "continuous"))
    given = dict(zip(names, (case.dt, *loop, case.kp, case.ki, *case.motor, *case.shaft), strict=True))
    if case.load is not None:
        given.update(zip(("JL", "DL"), case.load, strict=True))
    for side, effects in (("", case.effects), ("load_", case.at_load)):
        for effect, parameters in effects.items():
            given.update({f"{side}{effect}_{name}": value for name, value in parameters.items()})
    assert set(given) <= set(found), set(given) - set(found)
    return np.array(list((found | given).values()))


def integrate(cases: list[FineCase], fine: int = 100) -> FineRun:
    """All cases, which have the same number of samples, in steps of dt/fine. Raises RuntimeError without a compiler."""
    run = library(SOURCE).fine_integrator
    pointer = ctypes.POINTER(ctypes.c_double)
    run.argtypes = [pointer, ctypes.c_int, ctypes.c_int, *[pointer] * 4]
    run.restype = None
    samples = len(cases[0].source)
    out = np.zeros((3, len(cases), samples))
    for i, case in enumerate(cases):
        source = np.ascontiguousarray(case.source, dtype=np.float64)
        assert len(source) == samples
        arrays = (values(case), source, *out[:, i])
        given, *rest = (a.ctypes.data_as(pointer) for a in arrays)
        run(given, samples, fine, *rest)
    return FineRun(*(quantity.T for quantity in out))
