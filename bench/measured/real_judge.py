"""What a diagnosis said about a measured record, as plain data, and its judgement. Only the public interface is used."""

from __future__ import annotations

from typing import Any

from real_records import FRICTION, GRAVITY, LOAD, Drive

FAMILIES = {name: "friction" for name in FRICTION} | {name: "gravity" for name in GRAVITY} | {name: "load" for name in LOAD}


def said(dia: Any) -> dict[str, Any]:
    """Verdict, driver and findings with their alternatives and parameters."""
    return {
        "verdict": dia.verdict,
        "driver": dia.driver,
        "findings": [
            {
                "effect": f.effect,
                "alternatives": list(f.alternatives),
                "is_noise": f.is_noise,
                "delta_bic": f.delta_bic,
                "parameters": {name: e.value for name, e in f.parameters.items()},
            }
            for f in dia.findings
        ],
        "gain": dia.model.gain,
        "poles": [[r.real, r.imag] for r in dia.model.poles],
        "zeros": [[r.real, r.imag] for r in dia.model.zeros],
        "before": dia.before.rmse,
        "after": dia.after.rmse,
        "notes": list(dia.notes),
    }


def judge(drive: Drive, what: dict[str, Any]) -> dict[str, Any]:
    """The outcome against the truth.

    right    every group of the truth is named, and nothing false is found
    in set   every group of the truth is in the set of a finding, and nothing false is found
    wrong    a finding contains nothing of the truth nor of what is allowed, or one name where the record decides nothing
    missed   else: a group of the truth is in no finding
    "wrong" outweighs "missed"; `missed` and `false` say both.
    """
    sets = [({f["effect"], *f["alternatives"]}, not f["alternatives"]) for f in what["findings"] if not f["is_noise"]]
    groups = drive.truth or ()
    good = frozenset().union(*groups) | drive.allowed
    if drive.truth is None:
        false = [sorted(names) for names, single in sets if single and not names & drive.allowed]
        return {"outcome": "wrong" if false else "right", "false": false, "missed": [], "name": name_of(sets)}
    false = [sorted(names) for names, _ in sets if not names & good]
    missed = [FAMILIES[min(group)] for group in groups if not any(names & group for names, _ in sets)]
    named = all(any(names <= group for names, _ in sets) for group in groups)
    outcome = "wrong" if false else "missed" if missed else "right" if named else "in set"
    return {"outcome": outcome, "false": false, "missed": missed, "name": name_of(sets)}


def name_of(sets: list[tuple[set[str], bool]]) -> str:
    """What was said, by families, for the comparison over variations: "friction + gravity", "nothing"."""
    families = {min({FAMILIES.get(n, n) for n in names}, key=lambda n: (n not in FAMILIES.values(), n)) for names, _ in sets}
    return " + ".join(sorted(families)) or "nothing"
