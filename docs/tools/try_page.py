"""The page that identifies in a browser: one file of its template, its scripts, the policy's numbers and the core as WebAssembly.

    python docs/tools/try_page.py CORE.js OUT.html

CORE.js is what `make -f csrc/wasm/wasm.mk core` writes. Nothing in the page comes from elsewhere.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import gaident as ga
from gaident.data.record_checks import MINIMUM_SAMPLES
from gaident.data.signals.lattice import SAME
from gaident.policy.table import POLICY

HERE = Path(__file__).parent.parent / "try"
IN_WORKER = ("numbers.js", "core.js", "records.js", "mechanics.js", "identify.js", "worker.js")
IN_PAGE = ("table.js", "chart.js", "page.js")
USED = (
    *("above_noise", "another_mass", "cancellation", "contradiction", "final", "from_rest", "grid", "held_share", "input_lag"),
    *("most_samples", "near_rpm", "negligible", "no_direction", "one_course", "part_reach", "repeats", "rest_share"),
    *("rest_steps", "rival_margin", "same_unit", "samples_per_input_lag", "samples_per_white_lag", "searched_samples"),
    *("searched_share", "test_level", "undecided_ratio", "white_lags", "whitened_again", "whole_record"),
)
DRIVE = ga.TwoMass(JM=4e-4, DM=0.004, JL=1.2e-3, DL=0.006, KG=6.0)
GAINS = {"kp": 0.06, "ki": 0.9}
NOISE = 0.2  # rad/s


def numbers() -> dict[str, object]:
    """The constants that the scripts take from the package."""
    s, model = ga.Settings(), DRIVE.model()
    policy = {name: getattr(POLICY, name) for name in USED}
    policy |= {"same": SAME, "least_samples": MINIMUM_SAMPLES, "bits": ga.SearchSpace().bits}
    settings = [s.population, s.tournament, s.crossover, s.mutation, s.generations, s.round, s.quiet_rounds]
    settings += [s.code == "gray", s.scale == "logarithmic", s.error_weight, s.order_weight]
    roots = {name: [[r.real, r.imag] for r in getattr(model, name)] for name in ("poles", "zeros")}
    mechanics = {name: getattr(DRIVE, name) for name in ("JM", "DM", "JL", "DL", "KG")}
    example = {"drive": {"gain": model.gain, **roots}, "mechanics": mechanics, "controller": GAINS, "noise": NOISE}
    return {"POLICY": policy, "SETTINGS": [float(v) for v in settings], "EXAMPLE": example, "VERSION": ga.__version__}


def page(core: str) -> str:
    """The page's text."""
    constants = "".join(f"const {name} = {json.dumps(value)};\n" for name, value in numbers().items())
    scripts = {name: (HERE / name).read_text(encoding="utf-8").replace('"use strict";\n', "") for name in (*IN_WORKER, *IN_PAGE)}
    worker = '"use strict";\n' + constants + "".join(scripts[name] for name in IN_WORKER)
    shown = '"use strict";\n' + constants + "".join(scripts[name] for name in IN_PAGE)
    text = (HERE / "template.html").read_text(encoding="utf-8")
    for place, script in (("/* core */", core), ("/* worker */", worker), ("/* page */", shown)):
        if "</script" in script or text.count(place) != 1:
            raise ValueError(f"{place}: the script ends itself, or the template has no such place")
        text = text.replace(place, script)
    return text


if __name__ == "__main__":
    source, target = map(Path, sys.argv[1:])
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(page(source.read_text(encoding="utf-8")), encoding="utf-8")
