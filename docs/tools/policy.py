"""Writes docs/theory/policy.md, the numbers by which gaident decides: `python docs/tools/policy.py`."""

from __future__ import annotations

import json
import math
import re
import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from gaident.policy.declared import CALIBRATED, EFFORT, SHOWN_BY
from gaident.policy.table import PolicyRow, rows

DOCS = Path(__file__).resolve().parents[1]
PAGE = DOCS / "theory" / "policy.md"
CORE_SOURCE = DOCS.parent / "csrc" / "gaident"
CORE_BUDGETS = ("search/species.hpp", "identification/neighbours.hpp", "identification/velocity_objective.hpp")
HARD = "how hard an optimum is looked for: starts from each smaller structure, first iterations, starts that get more; iterations"
MEASURED = DOCS.parent / "bench" / "rows" / "measured.json"

HEAD = """\
# The policy: every number that decides

This page is written by `python docs/tools/policy.py` from `gaident.policy.table.rows()`, and a test compares the two.
A number that decides about a model stands in the policy and nowhere else, and another test looks for such numbers in the code.
What each one is for, the pages [estimation](estimation.md), [search](search.md), [identification](../identification.md) and
[diagnosis](../diagnosis.md) say.

What bounds the work of a search or a fit (iterations, starts, points of a grid, samples that are looked at) is its last group,
[effort](#effort).

Other numbers decide nothing and bound no search: the tolerance of a solver, the step of a difference, the start of a fit, the
size of a block in memory.
They stand where they are used, with a name or the remark `no decision`, which says why.
The bounds and starts of each effect's parameters stand in the effect's row of `diagnosis/library/`.
The genetic search of the core has [budgets of its own](#effort-of-the-cores-search).
The core (`csrc/gaident`) decides about no model, but into how many substeps it cuts a sample (`substeps_for` in
`nonlinear/effect_prepare.cpp`) sets how exact a simulation is: [what was measured](../effects.md#how-exact-it-is).

"Measured by" names the command that measures this one number: a calibration, or the same cases with the number at its value, at
half of it and at twice.
[What was measured](#what-changes-at-half-and-at-twice) stands at the end of this page.

## Calibrated numbers

    {command}

diagnoses {records} simulated records that hide nothing (steps, levels with reversals and moves; white noise, an encoder, coloured
torques; with and without a logged torque), and writes `python/gaident/policy/calibrated.json`, from which the policy takes the
calibrated numbers. Of each record it keeps four statistics:

| statistic | what it is |
|---|---|
| `effect_penalty` | the penalty at which the best effect would just be added to the linear model, over 1 + 200/N |
| `dependence_gain` | the largest gain of a free function of one signal, over 1 + 200/N |
| `noise_ratio` | rms of the selected model's whitened errors over the noise of the velocity |
| `free_run_ratio` | rms of the free run over that noise |

The value is the level that the share p = `noise_level` of such records exceeds. With x_1 >= x_2 >= ... the n values,

    value = x_m + b ln(m/(n p)),   m = n/10,   b = mean(x_1 .. x_m) - x_m

an exponential tail through the upper tenth (peaks over a threshold; Pickands, J. (1975): Statistical inference using extreme
order statistics. Annals of Statistics 3, 119-131). Its uncertainty is that of b, 1/sqrt(m) of it.

**These values are extrapolated.** Of {records} records the largest statistic is exceeded by one in {records}, and the level asks
for one in {chance}: {decades:.1f} decades beyond all that was measured, along a tail that is supposed to stay exponential.
No bench of this project could show such a level.
The factor ln(m/(n p)) = {factor:.1f} multiplies the uncertainty of b, {uncertain:.0f} %, too; so a value is known to about that
share of what it stands above x_m.
What was measured is the third column: at that value none of the {records} records would have been mistaken.

| statistic | value | largest measured | value over largest |
|---|---|---|---|
{measured}
## Is this noise: one test, and what stands beside it

The test is a variance ratio: the rms of errors over the noise sigma that the measured velocity itself shows, against the level
that records without effects pass (`estimation/criterion.py`).
It is asked of two errors, because they contain different things.

- `noise_ratio`, of whitened errors: what a model leaves that its own past does not foretell.
  It decides whether a model is adequate, and, of the linear model, whether output errors are searched first.
- `free_run_ratio`, of errors before whitening, in the loop where it is the drive's: what a free run misses.
  A noise model takes a slow misfit for noise, and then it shows here alone.
  It decides whether output errors are searched beside, whether a cause was hidden, and whether the free run is noted as far off.
  Behind a measured torque, whose noise the free run adds up, the noise of both counts, and it decides whether a model is
  adequate.

Four numbers ask something else, and no level of that test answers it:

- `effort_ratio` is about power, not size: the test may pass and an effect still be there that is a fraction of the noise.
  Below this ratio what is left beside the noise is less than half of it (sqrt(1.1^2 - 1) = 0.46), and nothing is looked for.
- `immaterial` has another scale, that of the motion: with a noise near 0 every simulation is off by more than noise,
  and no user asks for the difference.
- `grid_loss` compares two grids of time, and no noise with an error.
- `undecided_ratio` stands in identify(), which searches no effects: above it the answer is "undecided", a wish for more data,
  and not a finding. So it may be stricter than a level that one record in a million passes.

"""

DECIDING = """\
## {group}

| number | value | unit | what it is, and why this value | measured by |
|---|---|---|---|---|
"""

EFFORTS = """\
## Effort

Budgets of a search or a fit: more of these may find more, and changes no decision about what was found.
So no command measures one of them.
`hope`, `part_reach` and `slow_fall` are shares by which candidates are pruned: what they leave out is never fitted to the end.
Such a candidate may be what would have been found, so these three are nearer to a decision than the others.

| number | value | unit | what it is |
|---|---|---|---|
"""


CORE = """\
## Effort of the core's search

Constants of `search/species.hpp`, `identification/neighbours.hpp` and `identification/velocity_objective.hpp` in `csrc/gaident`,
from which this table is made: how hard the optimum of a structure is looked for, and which structures are fitted to the end.
What the search hands over is decided about by the numbers above.
`python bench/success.py` measures what they find: the structure and the parameters of its drives, all of them.

| number | value | what it is |
|---|---|---|
"""

CHANGES = """\
## What changes at half and at twice

    python bench/policy.py NAME

runs cases with the number as it is, at half and at twice.
Of a share between one half and 1, what is missing to 1 is doubled and halved; a probability is moved by ten.
Its row says which cases show it: {cases}.
What each kind contains stands in `bench/rows/cases.py`.

A case runs once while every number is watched: it is carried through the arithmetic together with what it would be if it were
moved, and where a comparison or a rounding would come out otherwise, that is noted.
"No decision changes" is the range within which every comparison of all cases comes out the same, in steps of a quarter octave and
up to two octaves either way: a range that ends at a quarter or at four times the value may be wider.
Outside of it some comparison changes, which need not change what is said: the cases are run again.
"Nothing" means that every case said the same, down to parameters of three digits, notes and the next experiment.
"Said otherwise" is another verdict, finding, structure or term, "the rest" what else differs.
"Not run" are cases in which a comparison changes and that were not run again: they are open.

"Read in" counts the cases that used the number at all; what no case reads is not measured by them.

| number | cases | seed | on | read in | no decision changes | below | above |
|---|---|---|---|---|---|---|---|
{changes}
Moved either way, these {count} change nothing that is said in these cases, as they are no finer than a factor of two, or these
cases do not show them:
{free}.

{left}{open}"""

MOVED = """\
Every number that decides was moved to half and to twice in cases of the kind that its row names.
Of the {all} numbers {shown} change something that is said there: these cases show that the value matters.
Of the other {free}, listed above, they show only that half and twice of it would do as well in these cases; whether another case
needs the value is open.
"""

LEFT = """\
Not run again are {count} runs, for the time that they take: about {minutes} minutes of one processor.
They belong to
{names}.
Most of these numbers enter a bound, a probability or a fit of nearly every case, so that some comparison changes in nearly every
one. Where some of its cases were run, these are the first ones, and what they show stands before "not run".

"""


def page() -> str:
    """The page's text."""
    parts = []
    for group, found in groupby(rows(), key=lambda r: r.group):
        if group == EFFORT:
            parts.append(EFFORTS + "".join(map(_line, found)))
        else:
            parts.append(DECIDING.format(group=group) + "".join(_line(r, f"`{r.command}`") for r in found))
    return _head() + "\n".join([*parts, CORE + "".join(_of_core()), _changes()])


def _of_core() -> list[str]:
    """The rows of the core's search: each number with its comment."""
    lines, comment = [], ""
    source = "".join((CORE_SOURCE / name).read_text(encoding="utf-8") for name in CORE_BUDGETS)
    for line in source.splitlines():
        text = line.strip()
        if text.startswith("//"):
            comment = f"{comment} {text[2:].strip()}".strip()
            continue
        if text.startswith(("static constexpr", "inline constexpr")):
            declared, comment = text.split("constexpr")[1].split("//")[0], comment or HARD
            for name, value in re.findall(r"(\w+)(?: = |(?=\{))([^,;{]+|\{[^}]*\})", declared):
                lines.append(f"| `{name}` | {value.strip('{}')} | {comment} |\n")
        comment = ""
    return lines


def _changes() -> str:
    """What was measured of each number, from the file that `bench/policy.py --write` makes."""
    deciding = {r.name: r for r in rows() if r.cases}
    found = json.loads(MEASURED.read_text(encoding="utf-8"))
    valid = [m for name, row in deciding.items() for m in found if m["name"] == name and m["value"] == row.value and m["used"]]
    names = {m["name"] for m in valid}
    moving = {m["name"] for m in valid if not all(map(_nothing, m["at"]))}
    kinds = [f"`{kind}`" for kind in SHOWN_BY]
    free = [name for name in deciding if name in names - moving]
    return CHANGES.format(
        count=len(free),
        cases=f"{', '.join(kinds[:-1])} or {kinds[-1]}",
        changes="".join(map(_changed, valid)),
        free=_names(free),
        left=_left(valid),
        open=_open([name for name in deciding if name not in names], len(names), len(free)),
    )


def _left(valid: Sequence[Mapping[str, Any]]) -> str:
    """What was not run again, and what it would take."""
    missing = [(m["name"], m["kind"], n) for m in valid if (n := sum(at["missing"] for at in m["at"]))]
    if not missing:
        return ""
    seconds = sum(n * _seconds([m for m in valid if m["kind"] == kind] or valid) for _, kind, n in missing)
    return LEFT.format(
        count=sum(n for _, _, n in missing),
        minutes=max(round(seconds / 60.0), 1),
        names=_names(list(dict.fromkeys(name for name, _, _ in missing))),
    )


def _seconds(found: Sequence[Mapping[str, Any]]) -> float:
    """Processor time of a run at another value, on average [s]."""
    runs = [at for m in found for at in m["at"]]
    return sum(at["seconds"][1] for at in runs) / max(sum(at["again"] for at in runs), 1)


def _changed(m: Mapping[str, Any]) -> str:
    low, high = m["unchanged"]
    cells = (f"`{m['name']}` = {m['value']:g}", f"{m['cases']} {m['kind']}{_only(m)}", str(m["seed"]), m["date"], str(m["used"]))
    return "| " + " | ".join([*cells, f"{low:.3g} to {high:.3g}", *map(_at, m["at"])]) + " |\n"


def _only(m: Mapping[str, Any]) -> str:
    """Texts in the keys of the cases, where only some were run."""
    return f" ({', '.join(m['only'])})" if "only" in m else ""


def _nothing(at: Mapping[str, Any]) -> bool:
    return not at["missing"] and not at["said"]


def _at(at: Mapping[str, Any]) -> str:
    outcomes = Counter(text.replace("->", "to") for text in at["changed"].values())
    told = [f"{n} {text}" for text, n in outcomes.items()]
    other = at["said"] - len(at["changed"])
    told += [f"{other} said otherwise"] if other > 0 else []
    told += [f"the rest of {at['other']}"] if at["other"] else []
    text = f"{at['value']:.3g}: {', '.join(told) or 'nothing'}"
    if not at["missing"]:
        return text
    return f"{text} in {at['again']}, {at['missing']} not run" if at["again"] else f"{at['value']:.3g}: {at['missing']} not run"


def _names(names: Sequence[str]) -> str:
    listed = ", ".join(f"`{name}`" for name in names) or "none"
    return textwrap.fill(listed, 130, break_long_words=False)


def _open(missing: Sequence[str], count: int, free: int) -> str:
    if missing:
        return f"Not measured, or at another value:\n{_names(missing)}.\n"
    return MOVED.format(all=count, shown=count - free, free=free)


def _head() -> str:
    numbers = CALIBRATED["numbers"].items()
    lines = [
        f"| `{name}` | {found['value']:g} | {found['largest']:.3g} | {found['value'] / found['largest']:.1f} |\n"
        for name, found in numbers
    ]
    n, level, share = CALIBRATED["records"], CALIBRATED["level"], 0.1
    return HEAD.format(
        command=CALIBRATED["command"],
        records=n,
        chance=f"{round(1.0 / level):,}".replace(",", " "),
        decades=math.log10(1.0 / n / level),
        factor=math.log(share / level),
        uncertain=100.0 / math.sqrt(share * n),
        measured="".join(lines),
    )


def _line(row: PolicyRow, *more: str) -> str:
    cells = (f"`{row.name}`", f"{row.value:g}", row.unit, row.source, *more)
    return "| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
