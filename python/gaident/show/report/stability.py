"""The chapter "Is it beyond doubt?": how often the causes are named again when the records are varied."""

from __future__ import annotations

from collections.abc import Sequence

from gaident.axis import called
from gaident.results.estimate import of_axis
from gaident.results.what_if import Stability, Variation
from gaident.show.html import Html, Row, table, tag, typeset
from gaident.show.report.parts import Section, sentences
from gaident.show.report.views import View
from gaident.show.wording import with_std

__all__ = ["stability_section"]

WHAT = (
    "Each variation of the records was diagnosed like the records themselves. One that cannot show a cause does not count for "
    "it. A cause that is in the drive is named in nearly all of them; one that is named in half of them or fewer may be what one "
    "stretch of the record looks like."
)


def stability_section(view: View) -> list[Section]:
    """The chapter, where that was worked out."""
    found = view.stability
    if found is None:
        return []
    said = [sentence.replace("_", " ") for sentence in found.sentences]
    return [
        Section("stability", "Is it beyond doubt?", tag("p", WHAT), sentences(said, view.axis), _variations(found, view.axis))
    ]


def _of_cause(v: Variation, names: Sequence[str], axis: str) -> Html:
    """Whether a variation names a cause, and with which size."""
    e, said = v.sizes.get(names[0]), v.says(names)
    if e is None:
        return typeset(said)
    shown = of_axis("", e, axis)
    return typeset(f"{said}, {with_std(shown.value, shown.std)} {'' if shown.unit == '1' else shown.unit}".rstrip())


def _variations(found: Stability, axis: str) -> str:
    """A row for each: what was varied, what came of it, and whether each cause is named again."""
    causes = [str(called(names[0])) for names in found.causes]
    rows: list[Row] = [
        (v.what, typeset(v.refused or v.verdict), *(_of_cause(v, names, axis) for names in found.causes))
        for v in found.variations
    ]
    return table(("variation", "verdict", *causes), [rows], left=range(2 + len(causes)))
