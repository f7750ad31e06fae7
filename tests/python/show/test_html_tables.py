"""Records and effects as a notebook shows them, without a notebook."""

from __future__ import annotations

import html.parser
from typing import Any

import numpy as np

import gaident as ga
from gaident.show.record_html import sparkline


class _Tags(html.parser.HTMLParser):
    """The tags of a page, and its texts."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.texts: list[str] = []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def test_a_record_in_a_notebook() -> None:
    velocity = np.zeros(5000)
    velocity[1234] = 7.0
    rec = ga.Record(1e-3, velocity=velocity, torque=np.ones(5000), name="<script>alert(1)</script>")
    page = _Tags()
    page.feed(rec._repr_html_())
    assert "script" not in page.tags and page.tags.count("svg") == 2
    assert "<script>alert(1)</script>" in page.texts and "velocity" in page.texts and "command" not in page.texts
    assert "rad/s" in page.texts and "N m" in page.texts and "on a linear axis m/s, N, m" in page.texts
    points = sparkline(velocity).split('points="')[1].split('"')[0].split()
    heights = [float(point.split(",")[1]) for point in points]
    assert len(points) == 480 and min(heights) == 1.0 and max(heights) == 27.0  # the one peak is not lost
    for odd in (np.full(20, 1e308), np.tile([-1.7e308, 1.7e308], 10)):
        assert "nan" not in sparkline(odd) and "inf" not in sparkline(odd)


def test_the_effects_in_a_notebook() -> None:
    page = _Tags()
    page.feed(ga.effects.table()._repr_html_())
    assert page.tags.count("tr") == len(ga.effects.table()) + 1
    assert {"coulomb_friction", "torque [N m]", "meaning"} <= set(page.texts)
