"""Options and help of `gaident report`."""

from __future__ import annotations

import argparse

__all__ = ["REPORT_EXAMPLES", "REPORT_HELP", "add_report_option", "add_report_options"]

REPORT_HELP = """\
Writes a saved diagnosis or identification as one HTML page that can be sent to a colleague: verdict, measured
against simulated, what is wrong, cause and evidence, parameters, before and after, what could not be tested, the
next experiment with its command, how it was computed. The page needs no network and no other file (about 1.7 MB,
with --pictures 0.3).
A saved result contains no samples: give the logs it was made from, and the page has its curves.
Of several results, before and after a repair or the axes of a machine, it is one page: an overview, what differs,
and what each says. Which log belongs to which result, its samples tell.
"""
REPORT_EXAMPLES = """\
examples:
  gaident report run.json run1.csv --validation run2.csv --drive drive.toml --out report.html
  gaident report run.json                        text and tables only, says what needs the log
  gaident report before.json after.json monday.csv friday.csv --drive drive.toml --out repair.html
  gaident diagnose run1.csv --drive drive.toml --report report.html      at once
"""


def add_report_options(parser: argparse.ArgumentParser) -> None:
    """What `gaident report` takes beside the options of logs."""
    parser.add_argument("result", metavar="RESULT.json", help="what diagnose --out or identify --out saved; several for one page")
    parser.add_argument("logs", nargs="*", metavar="LOG", help="further results (.json), and the logs they were made from")
    parser.add_argument("--validation", nargs="+", metavar="LOG", help="the logs that were held out")
    g = parser.add_argument_group("results")
    g.add_argument("-o", "--out", metavar="FILE", default="report.html", help="where the page goes (default: report.html)")
    _add_pictures(g)
    _add_remedies(g)
    g.add_argument("--json", action="store_true", help="print what was written as JSON")


def add_report_option(group: argparse._ArgumentGroup, remedies: bool) -> None:
    """--report of identify and diagnose; remedies: whether its page proposes some."""
    group.add_argument("--report", metavar="FILE", help="write everything as one HTML page, to be sent to a colleague")
    _add_pictures(group)
    if remedies:
        _add_remedies(group)


def _add_pictures(group: argparse._ArgumentGroup) -> None:
    text = "in the page, pictures in place of figures that zoom: some 0.3 MB, to be mailed or printed"
    group.add_argument("--pictures", action="store_true", help=text)


def _add_remedies(group: argparse._ArgumentGroup) -> None:
    text = "a page of a diagnosis without the chapter that proposes gains and feedforward, which takes some seconds"
    group.add_argument("--no-remedies", action="store_true", help=text)
