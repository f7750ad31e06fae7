"""The page: head, verdict, chapters, and the figures' data with the library that draws them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from importlib.resources import files

from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.show.chart import PALETTES
from gaident.show.html import Html, joined, tag, typeset
from gaident.show.report import diagnosis, identification
from gaident.show.report.live import figure, json_of
from gaident.show.report.packing import packed
from gaident.show.report.parts import Charts, Section, box, sentences, title_of
from gaident.show.report.several import Shown, several
from gaident.show.report.views import View

__all__ = ["page", "page_of_several"]

# Nothing is fetched, whatever a page contains.
POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:"


def page(result: Diagnosis | Identification, view: View, plotly_js: str) -> str:
    """The whole page of a Diagnosis or an Identification; plotly_js: the library's text, "" for pictures and no script."""
    drawn = Charts(view.scales, bool(plotly_js))
    if isinstance(result, Diagnosis):
        head_of, tiles, chapters = (
            diagnosis.head(result, view),
            diagnosis.tiles(result, view),
            diagnosis.chapters(result, view, drawn),
        )
    else:
        head_of, tiles = identification.head(result), identification.tiles(result, view)
        chapters = identification.chapters(result, view, drawn)
    names = title_of(view.fitted)
    title = f"{head_of.title}{f' of {names}' if names else ''}"
    verdict = tag(
        "section",
        tag("p", tag("span", f"{head_of.sign} {head_of.word}", class_="badge"), class_="badges"),
        tag("p", typeset(head_of.headline), class_="headline"),
        tag("div", tiles, class_="tiles"),
        box(tag("b", "Keep in mind"), sentences(head_of.notes, view.axis), kind="quiet") if head_of.notes else "",
        class_=f"verdict {head_of.kind}",
        id="verdict",
    )
    return _whole(title, view, verdict, chapters, drawn, plotly_js)


def page_of_several(results: Sequence[Shown], plotly_js: str) -> str:
    """The whole page of several results, see several.py."""
    view = results[0][2]
    drawn = Charts(view.scales, bool(plotly_js))
    title = f"{len(results)} results: {', '.join(name for name, _, _ in results)}"
    return _whole(title, view, Html(), several(results, drawn), drawn, plotly_js)


def _whole(title: str, view: View, verdict: Html, chapters: Sequence[Section], drawn: Charts, plotly_js: str) -> str:
    contents = tag("nav", tag("ol", *(tag("li", tag("a", c.title, href=f"#{c.key}")) for c in chapters)), aria_label="Contents")
    data = {"charts": {c.key: {**figure(c), "link": c.link} for c in drawn.all}, "palettes": PALETTES}
    head = (
        tag("meta", charset="utf-8"),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="color-scheme", content="light dark"),
        tag("title", f"gaident: {title}"),
        tag("style", _asset("page.css")),
        tag("script", Html('document.documentElement.classList.add("js");')) if plotly_js else "",
    )
    scripts = (
        _script("library", *_packed(plotly_js)) if drawn.all else "",
        _script("figures", *packed(json_of(data))),
        tag("script", _asset("unpack.js")),
        tag("script", _asset("page.js")),
    )
    licence = " Figures: plotly.js, MIT licence." if plotly_js else ""
    body = (
        tag(
            "header",
            tag("div", tag("p", "gaident report", class_="brand"), tag("h1", title), _about(view)),
            _switch() if plotly_js else "",
        ),
        tag("main", verdict, contents, *(tag("section", tag("h2", c.title), c.body, id=c.key) for c in chapters)),
        tag("footer", tag("p", "Everything in this page is in this file: it needs no network.", licence)),
        *(scripts if plotly_js else ()),
    )
    whole = tag("html", Html("\n"), tag("head", joined(head, "\n")), Html("\n"), tag("body", joined(body, "\n")), lang="en")
    return f"<!DOCTYPE html>\n{whole}\n"


_packed = lru_cache(maxsize=1)(packed)  # of the library, which is the same in every page


def _script(key: str, letters: Html, size: int) -> Html:
    """A script element that no browser runs: what page.js unpacks."""
    return tag("script", letters, type="application/x-packed", data_bytes=str(size), id=key)


def _about(view: View) -> Html:
    """Date, axis, customer, what the user says besides."""
    rows = [joined((tag("b", key), ": ", text)) for key, text in view.about.items() if key != "text"]
    free = tag("p", view.about["text"]) if view.about.get("text") else Html()
    return joined((tag("p", joined(rows, " · ")) if rows else Html(), free))


def _switch() -> Html:
    """Light, dark, or as the system says."""
    options = (("auto", "Auto"), ("light", "Light"), ("dark", "Dark"))
    buttons = (
        tag("button", text, type="button", data_set=key, aria_pressed="true" if key == "auto" else "false")
        for key, text in options
    )
    return tag("div", *buttons, class_="switch", role="group", aria_label="Colours of the page")


@lru_cache(maxsize=3)
def _asset(name: str) -> Html:
    return Html(files("gaident.show.report").joinpath(name).read_text(encoding="utf-8"))
