"""What a frequency response is of, and how its table names and measures it; without the libraries that read one."""

from __future__ import annotations

import math

__all__ = ["COLUMNS", "KINDS", "SI", "UNITS"]

KINDS = {"torque to velocity": 0, "torque to position": 1, "torque to acceleration": -1}
"""Kinds of response, and how often they are differentiated in time to be one of the velocity."""

COLUMNS = {
    "frequency": r"f|freq\w*|fr[eé]q\w*|frec\w*|omega|w",
    "magnitude": r"mag\w*|amplitud\w*|gain|betrag|verst\w*|modul\w*|abs|\|?[gh]\|?|\|[gh]\(.*\)\||ampl\w*",
    "phase": r"phas\w*|fase|arg(\(.*\))?|angle|winkel",
    "real": r"re|real\w*|re\(.*\)",
    "imaginary": r"im|imag\w*|im\(.*\)",
    "coherence": r"coh\w*|koh\w*|gamma\w*",
    "std": r"std|sigma|stddev",
}
"""What a column's first word is, for each quantity."""

_DEGREE = math.pi / 180.0  # no decision: a unit; rad
UNITS: dict[str, dict[str, float]] = {
    "frequency": {"hz": 1.0, "khz": 1e3, "rad/s": 0.5 / math.pi},  # no decision: a unit
    "magnitude": {"db": math.nan, "1": 1.0},
    "phase": {"deg": _DEGREE, "°": _DEGREE, "grad": _DEGREE, "rad": 1.0},
    "coherence": {"1": 1.0, "%": 0.01},  # no decision: a unit
}
"""Factor to Hz, 1, rad and 1; nan: decibels."""

SI = ("", "1", "rad/s/nm", "rad/snm", "m/s/n", "m/sn", "rad/nm", "m/n", "rad/s^2/nm", "rad/s2/nm", "m/s^2/n", "m/s2/n")
"""Units of a response that need no scale, without spaces and brackets."""
