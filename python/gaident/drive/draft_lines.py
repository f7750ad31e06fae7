"""The lines of a drive.toml that `init` writes: its head, and what stands beside a key."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gaident.data.timeaxis import even_step
from gaident.policy.table import POLICY

__all__ = ["any_scale", "head_of", "line_of", "plain", "quoted", "resampling_of"]

_COMMENT = 26  # no decision: printed: where comments begin


def head_of(log: str) -> str:
    """What the file says of itself; log: path of the log that it was written from."""
    name = quoted(Path(log).name)
    return f"""\
# What belongs to this axis, for `gaident diagnose LOG --drive drive.toml`. Written by `gaident init` from {name}.
# FILL IN marks what the log cannot say: write the value and remove the # before it. All other lines are what it shows.
# Every key: `gaident identify --help`.
"""


def line_of(text: str, comment: str) -> str:
    """A line with its comment behind it."""
    return f"{text.ljust(_COMMENT - 2)}  # {comment}" if comment else text


def any_scale(channel: str, unit: str | None) -> str:
    """The unit of a sensor at the load that the log does not say, or that is not known."""
    says = "the log does not say it" if unit is None else f"the log says {quoted(unit)}, which is not known"
    return line_of(f"{channel} = 1", f"{says}; any scale, as it is estimated")


def quoted(value: str | int) -> str:
    """A text or a number as TOML and its comments take it, on one line."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def plain(text: str) -> str:
    """A text without line breaks."""
    return " ".join(text.split())


def resampling_of(steps: NDArray[np.float64]) -> tuple[str, str, str]:
    """The line that puts irregular stamps on an even axis, its key, and which values are good; steps: between stamps [s] (n,)."""
    usual = float(np.median(steps)) if len(steps) else 0.0
    if not usual > 0.0:
        return "# resample = 1e-3", "resample", "s from line to line of an even time axis, a number above 0"
    own = f"{even_step(steps)[0]:.6g}"
    good = f"s from line to line of an even time axis, from the log's own {own} to {usual * POLICY.resample_coarser:.3g}"
    return f"# resample = {own}", "resample", good
