"""Messages of the library, which name arguments of Python, in the options of the command line."""

from __future__ import annotations

import re
from collections.abc import Callable

__all__ = ["in_options"]

# What messages of the library say in Python -> the options that do it.
_IN_OPTIONS: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    (r"columns=\{'(\w+)': None\}", r"--columns \1="),
    (r"(columns|units)=\{'(\w+)': '([^']*)'\}", r"--\1 \2=\3"),
    (r"(columns|units)=\{'(\w+)': ([^}]*)\}", r"--\1 \2=\3"),
    (r"space=SearchSpace\(gain=\.\.\.\)", "--gain LOW HIGH"),
    (r"space=SearchSpace\(\.\.\.\)", "--inertia LOW HIGH or --gain LOW HIGH"),
    (r"PI\(\.\.\., loop=['\"]continuous['\"]\)", "--loop continuous"),
    (r"\bloop='(\w+)'", r"--loop \1"),
    (r"controller=None", "--loop open"),
    (r"controller=PI\(\.\.\.\)", "--kp and --ki"),
    (r"PI\(kp=\.\.\., ki=\.\.\.\)", "--kp and --ki"),
    (r"Record\((\w+)=\.\.\.\)", r"--columns \1=..."),
    (r"\b([pq])=\((\d+), (\d+)\)", r"--\1 \2..\3"),
    (r"\bki=0\b", "--ki 0"),
    (r"\bkp=0\b", "--kp 0"),
    (
        r"\b(dt|delimiter|decimal|skip|encoding|counts_per_turn|torque_constant|rated_torque|torque_per_volt|gear_ratio|load_side"
        r"|decimate|resample|loop|trials|seed|workers)=(?=[^=]|$)",
        r"--\1 ",
    ),
    (r"\bvelocity_cutoff_hz=", "--velocity-cutoff "),
    (r"(?<!\S)--(counts|torque|rated|gear|load)_(\w+)", lambda found: f"--{found[1]}-{found[2].replace('_', '-')}"),
    (r" +(?=[,;)](?:\s|$)|$)", ""),
)


def in_options(message: str) -> str:
    """A message of the library for the command line: `columns={'velocity': ...}` becomes `--columns velocity=...`."""
    for pattern, words in _IN_OPTIONS:
        message = re.sub(pattern, words, message)
    return message
