"""ga.report(): a result and its records as one HTML page. What it draws is worked out here, how in `gaident.show.report`."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import checked_axis, message_of
from gaident.checks import check_installed, yes_or_no
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.diagnosis.explain.evidence import velocity_curve
from gaident.diagnosis.stability import causes_of
from gaident.errors import GaidentError
from gaident.files import check_writable, write_whole
from gaident.identification.response.averaged import response_of, responses_of
from gaident.reporting.remedies import remedies_of
from gaident.reporting.runs import run_of
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.results.what_if import Stability
from gaident.show.report.page import page, page_of_several
from gaident.show.report.views import View
from gaident.show.units import scales_of
from gaident.version import version

__all__ = ["NEEDED", "report", "report_page"]

NEEDED = ("matplotlib", "plotly")  # libraries, of the extra "pictures"

Vector = NDArray[np.float64]
Records = Record | Sequence[Record] | None
Results = Sequence[Diagnosis | Identification] | Mapping[str, Diagnosis | Identification]


def report(
    result: Diagnosis | Identification | Results,
    path: str | os.PathLike[str],
    records: Records = None,
    validation: Records = None,
    axis: str | None = None,
    units: Mapping[str, str | float] | None = None,
    about: Mapping[str, str] | None = None,
    live: bool = True,
    stability: Stability | None = None,
    remedies: bool = True,
) -> None:
    """Write a result as one HTML page that needs nothing else: no network, no other file, no Python.

    From top to bottom: the verdict, measured against simulated, what is wrong, cause and evidence, parameters, before and after,
    what to do (of one diagnosis: other gains, feedforward, what mending each cause would bring), what could not be tested, the
    next experiment with its command as CSV, how it was computed.
    About 1.7 MB, 1.4 of it plotly.js, packed.
    The file appears whole or not at all.

    Parameters
    ----------
    result : Diagnosis, Identification, or a sequence or mapping of them
        The result.
        Of several, before and after a repair or the axes of a machine, the page has an overview, what differs,
        and what each says; a mapping names them, ``{"before": dia, "after": dia2}``.
    path : str or path-like
        The file to write.
    records : Record or sequence of Record, optional
        None: as used. A loaded result contains none, and its page says what is left out for that.
        Of several results each takes those that it was made of.
    validation : Record or sequence of Record, optional
        The records that were held out, likewise.
    axis : {"rotary", "linear"}, optional
        "linear": units of m and N; None: those of a diagnosis' axis, else rotary.
    units : mapping, optional
        Units in which you work, beside SI in tables and in place of it in figures, and the constants that they need:
        ``{"velocity": "rpm", "torque": "%", "position": "deg", "rated_torque": 2.4}``.
    about : mapping of str to str, optional
        What stands below the title: ``{"date": "2026-11-22", "machine": "X1", "customer": "...", "text": "..."}``, any keys.
    live : bool
        False: pictures in place of figures that zoom; a page of some 0.3 MB, to be mailed or printed.
    stability : Stability, optional
        Of one diagnosis: what `Diagnosis.stability` gave; None: what is kept with it, `Diagnosis.varied`.
        The page then says how often each cause is named again.
    remedies : bool
        Of one diagnosis: whether the page says what to do, with other gains and feedforward, which takes some seconds.

    Raises
    ------
    GaidentError
        Where result or records are something else, or where a library of the extra "pictures" is missing.
    SettingsError
        For another axis.
    OSError
        Where the file cannot be written.

    Examples
    --------
    >>> import pathlib
    >>> import numpy as np
    >>> import gaident as ga
    >>> torque = np.repeat([1.0, -1.0, 0.5, -0.5], 100)
    >>> noise = 0.02 * np.random.default_rng(1).standard_normal(400)
    >>> still = ga.Record(1e-3, torque=torque, velocity=0.0 * torque)
    >>> velocity = ga.simulate(ga.OneMass(J=0.01, D=0.05), still) + noise
    >>> ga.report(ga.identify(ga.Record(1e-3, torque=torque, velocity=velocity)), "report.html")
    >>> "<html" in pathlib.Path("report.html").read_text(encoding="utf-8")
    True
    """
    check_writable(path)
    write_whole(path, report_page(result, records, validation, axis, units, about, live, stability, remedies).encode())


def report_page(
    result: Diagnosis | Identification | Results,
    records: Records = None,
    validation: Records = None,
    axis: str | None = None,
    units: Mapping[str, str | float] | None = None,
    about: Mapping[str, str] | None = None,
    live: bool = True,
    stability: Stability | None = None,
    remedies: bool = True,
) -> str:
    """The text of what `report` writes."""
    check_installed(NEEDED, "pictures", "a report")
    if about is not None and not isinstance(about, Mapping):
        raise GaidentError(f"about is {about!r:.80}: give a dictionary of texts, for example {{'machine': 'press 4'}}")
    yes_or_no(live, "live", GaidentError)
    yes_or_no(remedies, "remedies", GaidentError)
    if stability is None and isinstance(result, Diagnosis):
        stability = result.varied
    if stability is not None:
        if not isinstance(stability, Stability) or not isinstance(result, Diagnosis):
            raise GaidentError(f"stability is {stability!r:.80}: give what dia.stability() gave of the one diagnosis, or None")
        if stability.causes != causes_of(result):
            raise GaidentError(
                "stability is of a diagnosis with other causes: give what dia.stability() of this one gave, or None"
            )
    for key, value in (about or {}).items():
        if not isinstance(value, str):
            raise GaidentError(f"about: {key} is {value!r}: give text")

    from plotly.offline import get_plotlyjs

    plotly_js = get_plotlyjs() if live else ""

    def whole(view: View) -> View:
        return replace(view, scales=scales_of(units, view.axis), about=dict(about or {}))

    if isinstance(result, Diagnosis | Identification):
        view = view_of(result, records, validation, axis)
        if isinstance(result, Diagnosis):
            made_of = _fitted(result, _records(records, result.records, "records"))
            to_do = remedies_of(result, made_of) if remedies else None
            view = replace(view, remedies=to_do, to_do=remedies, stability=stability)
        return page(result, whole(view), plotly_js)
    named = _named(result)
    given = {rec.digest: rec for rec in (*_records(records, (), "records"), *_records(validation, (), "validation"))}
    shown = []
    for name, one in named.items():
        validation_digests = one.validation_digests if isinstance(one, Diagnosis) else ()
        own, kept = ([given[d] for d in digests if d in given] or None for digests in (one.digests, validation_digests))
        shown.append((name, one, whole(view_of(one, own, kept, axis))))
    return page_of_several(shown, plotly_js)


def _named(results: object) -> dict[str, Diagnosis | Identification]:
    """Several results by their names in the page: those of a mapping, or else of their records, or their numbers."""
    if not isinstance(results, Mapping) and (not isinstance(results, Sequence) or isinstance(results, str)):
        raise GaidentError(f"result is {type(results).__name__}: give a Diagnosis or an Identification, or several of them")
    listed = list(results.values()) if isinstance(results, Mapping) else list(results)
    if not listed or not all(isinstance(one, Diagnosis | Identification) for one in listed):
        raise GaidentError("result contains other things than results: give each a Diagnosis or an Identification, at least one")
    if isinstance(results, Mapping):
        return {str(name): one for name, one in results.items()}
    found: dict[str, Diagnosis | Identification] = {}
    for i, one in enumerate(listed, 1):
        name = ", ".join(rec.name for rec in one.records if rec.name) or f"result {i}"
        found[name if name not in found else f"{name} ({i})"] = one
    return found


def view_of(result: Diagnosis | Identification, records: Records, validation: Records, axis: str | None) -> View:
    """What a page shows beside the result: the records with what the models make of them."""
    if axis is not None:
        checked_axis(axis)
    if not isinstance(result, Diagnosis | Identification):
        raise GaidentError(f"result is {type(result).__name__}: give a Diagnosis or an Identification")
    given = _records(records, result.records, "records")
    held_out = _records(validation, result.validation_records if isinstance(result, Diagnosis) else (), "validation")
    known = {r.digest for r in given}
    runs = [run_of(result, rec) for rec in (*given, *(r for r in held_out if r.digest not in known))]
    fitted = _fitted(result, given)
    longest = max(fitted, key=len, default=None)
    curve = response = None
    missing: str = ""
    if longest is not None:
        if isinstance(result, Diagnosis):
            curve = velocity_curve(result, float(longest.velocity.min()), float(longest.velocity.max()))
            if curve is not None and any(f.alternatives for f in result.causes):
                curve = (*curve[:2], f"{curve[2]} (not told apart from others)")
        try:
            used = result.as_used(longest) if isinstance(result, Diagnosis) else longest
            response = response_of(used, result.model, bare_pi(result.controller))
        except GaidentError as error:
            missing = message_of(error)
    elif isinstance(result, Identification) and result.responses:
        response = responses_of(result.responses, result.model)
    own = result.axis if isinstance(result, Diagnosis) else "rotary"
    return View(tuple(runs), curve, response, missing, axis or own, _made_with())


def _records(given: Records, own: Sequence[Record], name: str) -> tuple[Record, ...]:
    chosen = own if given is None else (given,) if isinstance(given, Record) else given
    if not isinstance(chosen, Sequence) or not all(isinstance(r, Record) for r in chosen):
        raise GaidentError(f"{name} is {type(given).__name__}: give a gaident.Record or a list of them")
    return tuple(chosen)


def _fitted(result: Diagnosis | Identification, given: Sequence[Record]) -> list[Record]:
    """The records that a result was made of; where none of them is given, those that are."""
    return [rec for rec in given if rec.digest in result.digests] or list(given)


def _made_with() -> dict[str, str]:
    from importlib.metadata import version as installed

    python = ".".join(map(str, sys.version_info[:3]))  # no decision: printed: a version
    return {"gaident": version(), "Python": python, **{n: installed(n) for n in ("numpy", "scipy", *NEEDED)}}
