"""Writes docs/theory/policy.md, the numbers by which gaident decides: `python docs/tools/policy.py`."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from gaident.policy.table import CALIBRATED, EFFORT, Row, rows

PAGE = Path(__file__).resolve().parents[1] / "theory" / "policy.md"

HEAD = """\
# The policy: every number that decides

This page is written by `python docs/tools/policy.py` from `gaident.policy.table.rows()`, and a test compares the two.
A number that decides about a model stands in the policy and nowhere else, and another test looks for such numbers in the code.
What each one is for, the pages [estimation](estimation.md), [search](search.md), [identification](../identification.md) and
[diagnosis](../diagnosis.md) say.

Other numbers decide nothing: the tolerance of a solver, the step of a difference, the start of a fit.
They stand where they are used, with a name and the remark `no decision`, which says why.
The bounds and starts of each effect's parameters stand in the effect's row of `diagnosis/library/terms.py`.

"Measured by" names the bench whose tables change where the number is wrong.

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

| statistic | value | largest measured |
|---|---|---|
{measured}
"""

DECIDING = """\
## {group}

| number | value | unit | where it comes from | measured by |
|---|---|---|---|---|
"""

EFFORTS = """\
## Effort

Budgets: more of these may find more, and changes no decision about what was found.

| number | value | unit | what it is |
|---|---|---|---|
"""


def page() -> str:
    """The page's text."""
    parts = []
    for group, found in groupby(rows(), key=lambda r: r.group):
        if group == EFFORT:
            parts.append(EFFORTS + "".join(map(_line, found)))
        else:
            parts.append(DECIDING.format(group=group) + "".join(_line(r, f"`{r.command}`") for r in found))
    return _head() + "\n".join(parts)


def _head() -> str:
    numbers = CALIBRATED["numbers"].items()
    lines = [f"| `{name}` | {found['value']:g} | {found['largest']:.3g} |\n" for name, found in numbers]
    return HEAD.format(command=CALIBRATED["command"], records=CALIBRATED["records"], measured="".join(lines))


def _line(row: Row, *more: str) -> str:
    cells = (f"`{row.name}`", f"{row.value:g}", row.unit, row.source, *more)
    return "| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
