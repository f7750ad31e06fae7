"""What is installed and whether it works: versions, instruction set, threads, libraries, a small identification."""

from __future__ import annotations

import importlib
import importlib.metadata as metadata
import os
import platform
import re
import sys
import time
from dataclasses import asdict, dataclass
from typing import Any

from gaident.version import version as own_version

__all__ = ["Examination", "UsedLibrary", "examine"]

_REQUIREMENT = re.compile(r"^([\w.-]+)\s*(?:\[[^\]]*\])?\s*\(?([^;)]*)\)?\s*(?:;(.*))?$")
_LOWEST = re.compile(r"(?:>=|~=|===?|>)\s*([^\s,]+?)(?:\.\*)?\s*(?:,|$)")
# A version as packages write it: numbers, then what makes it earlier (a, b, rc, dev) or later (post, a local part) than these.
_VERSION = re.compile(r"v?(?:\d+!)?(\d+(?:\.\d+)*)(.*)", re.IGNORECASE)
_EARLIER = re.compile(r"[._-]?(?:a|alpha|b|beta|c|rc|pre|preview|dev)[._-]?\d*", re.IGNORECASE)
_EXTRA = re.compile(r"extra\s*==\s*['\"]([\w.-]+)['\"]")
_MODULES = {"pillow": "PIL"}  # what is imported, where it is not the distribution's name
_FOR_DEVELOPERS = {"test", "peers", "compare", "naming", "tidy", "docs", "release"}


@dataclass(frozen=True)
class UsedLibrary:
    """A library that this package uses; version None: it is not there. extra: what installs it, "" if it is required.

    lowest: the version that it must have at least, "" for any.
    """

    name: str
    version: str | None
    extra: str
    flaw: str = ""
    lowest: str = ""


@dataclass(frozen=True)
class Examination:
    """What was found; flaws: what is missing or broken, each with its remedy."""

    version: str
    python: str
    system: str
    processor: str
    instruction_set: str
    threads: int
    libraries: tuple[UsedLibrary, ...]
    self_test: str
    flaws: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return {"schema": "gaident/doctor", "schema_version": 1, **asdict(self)}

    def __str__(self) -> str:
        rows = [
            ("gaident", self.version),
            ("Python", self.python),
            ("system", self.system),
            ("instruction set", self.instruction_set),
            ("threads", str(self.threads)),
        ]
        width = max(len(name) for name, _ in [*rows, *((x.name, "") for x in self.libraries)])
        lines = [f"{name.ljust(width)}  {value}" for name, value in rows]
        needed = [x for x in self.libraries if not x.extra]
        optional = [x for x in self.libraries if x.extra]
        lines += ["", "needed"] + [f"  {x.name.ljust(width)}{x.flaw or x.version}" for x in needed] if needed else []
        if optional:
            missing = 'not installed: pip install "gaident[{}]"'
            lines += ["", "optional"] + [
                f"  {x.name.ljust(width)}{x.flaw or x.version or missing.format(x.extra)}" for x in optional
            ]
        return "\n".join([*lines, "", f"self test: {self.self_test}", *(f"WRONG: {flaw}" for flaw in self.flaws)])


def examine() -> Examination:
    """Looks at this installation; never raises."""
    libraries = tuple(_libraries())
    flaws = [f'{x.name} {x.flaw}: pip install --upgrade "{x.name}{x.lowest and f">={x.lowest}"}"' for x in libraries if x.flaw]
    try:
        instructions, verdict, right = _self_test()
    except Exception as error:  # whatever is broken, this is what is asked here
        instructions, verdict, right = "unknown", f"failed: {type(error).__name__}: {error}", False
    if not right:
        flaws.append("the self test failed: install gaident again, and report this output if that does not help")
    return Examination(
        own_version(), f"{platform.python_version()} ({sys.executable})", platform.platform(), platform.machine(), instructions,
        _threads(), libraries, verdict, tuple(flaws),
    )  # fmt: skip


def instructions(kernels: str, fused: bool) -> str:
    """The instruction set in words."""
    return kernels if fused else f"{kernels}, without fused multiply-add: the same results, several times slower"


def _threads() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _libraries() -> list[UsedLibrary]:
    """What the package's own metadata names; nothing where it runs from its sources."""
    try:
        requirements = metadata.requires("gaident") or []
    except metadata.PackageNotFoundError:
        return []
    found: dict[str, UsedLibrary] = {}
    for requirement in requirements:
        match = _REQUIREMENT.match(requirement)
        if match is None:
            continue
        name, marker = match[1], match[3] or ""
        extra = _EXTRA.search(marker)
        if (extra is not None and extra[1] in _FOR_DEVELOPERS) or "python_version" in marker or name == "gaident":
            continue
        if name in found:
            if extra is not None and found[name].version is None:
                found[name] = UsedLibrary(name, None, extra[1])  # what draws may be taken out: it is in an extra of its own, too
            continue
        lowest = _LOWEST.search(match[2])
        found[name] = _library(name, "" if extra is None else extra[1], "" if lowest is None else lowest[1])
    return sorted(found.values(), key=lambda x: (bool(x.extra), x.extra, x.name))


def _library(name: str, extra: str, lowest: str) -> UsedLibrary:
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return UsedLibrary(name, None, extra, "" if extra else "is not installed", lowest)
    if below(version, lowest):
        return UsedLibrary(name, version, extra, f"is {version}, and {lowest} is the oldest that gaident works with", lowest)
    if extra:
        return UsedLibrary(name, version, extra, lowest=lowest)
    try:
        importlib.import_module(_MODULES.get(name.lower(), name.replace("-", "_")))
    except Exception as error:
        return UsedLibrary(name, version, extra, f"cannot be imported ({type(error).__name__}: {error})", lowest)
    return UsedLibrary(name, version, extra, lowest=lowest)


def below(version: str, lowest: str) -> bool:
    """Whether a version is an earlier one than the lowest that is asked for; False where one of them is no version."""
    ours, asked = _VERSION.match(version), _VERSION.match(lowest)
    if ours is None or asked is None:
        return False
    numbers = [[int(part) for part in found[1].split(".")] for found in (ours, asked)]
    longest = max(map(len, numbers))
    have, need = (part + [0] * (longest - len(part)) for part in numbers)
    # 2.0rc1 comes before 2.0; of two that come before it, either will do: nobody asks for a certain one of these.
    early = _EARLIER.match(ours[2]) is not None and _EARLIER.match(asked[2]) is None
    return have < need or (have == need and early)


def _self_test() -> tuple[str, str, bool]:
    """(instruction set, what was found, whether that is right): the two masses of the demonstration."""
    import numpy as np

    from gaident.cli import demonstration as demo
    from gaident.control import core
    from gaident.identification.identify import identify

    rest = np.zeros(20)
    experiment = core.experiment([core.record(1e-3, rest, rest, "rest", 0.0)], None, 1e-3)
    chosen = instructions(experiment.kernels, experiment.fused)
    rec = demo.two_mass_record(0)
    began = time.perf_counter()
    idn = identify(rec, controller=demo.CONTROLLER, seed=0)
    seconds = time.perf_counter() - began
    right = (idn.p, idn.q) == (1, 2)
    found = "two masses found, as they should be" if right else f"(p,q) = ({idn.p},{idn.q}) found where (1,2) is right"
    return chosen, f"{found}, in {1e3 * seconds:.0f} ms", right
