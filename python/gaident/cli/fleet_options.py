"""Options and help of `gaident fleet` and `gaident trends`."""

from __future__ import annotations

import argparse

__all__ = ["FLEET_EXAMPLES", "FLEET_HELP", "TRENDS_EXAMPLES", "TRENDS_HELP", "add_fleet_options", "add_trends_options"]

FLEET_HELP = """\
Diagnoses many logs, each by itself, with all processors, and keeps what was found as a dataset (Parquet, or CSV
without pyarrow): a row for each log, a table of all parameters, and the JSON of each diagnosis.
A log that cannot be read or diagnosed is a row with the reason. What is there is not made again: call it every
night over all logs, or again after it was stopped. Exit code 1 where no log at all could be diagnosed.
"""
FLEET_EXAMPLES = """\
examples:
  gaident fleet 'logs/**/*.csv' --drive drive.toml --out fleet
  gaident fleet 'logs/**/*.csv' --drive drive.toml --out fleet --resume    a run that was stopped goes on
  gaident fleet 'logs/**/*.csv' --drive drive.toml --names '(?P<axis>x\\d+)_(?P<time>[\\dT-]+)'
"""
TRENDS_HELP = """\
Shows what changed on which axis of a fleet: the course of every parameter with its deviations, changes beyond the
scatter of the logs before, axes that differ from their siblings, and where the logs are too poor to say.
"""
TRENDS_EXAMPLES = """\
examples:
  gaident trends fleet
  gaident trends fleet --out trends.html         one page, and the reports that it opens beside it
"""


def add_fleet_options(parser: argparse.ArgumentParser) -> None:
    """What `gaident fleet` takes beside the options of logs and of the controller."""
    parser.add_argument("logs", nargs="+", metavar="LOG", help="log files, or patterns in quotes, such as 'logs/**/*.csv'")
    g = parser.add_argument_group("the fleet")
    g.add_argument("-o", "--out", metavar="DIR", default="fleet.parquet", help="folder of the dataset (default: fleet.parquet)")
    names = "regular expression that finds (?P<axis>...) and (?P<time>...) in a path (default: folder, and date in a name)"
    g.add_argument("--names", metavar="REGEX", help=names)
    g.add_argument("--temperature", metavar="NAME", help="column with the temperature, whose mean stands in the tables")
    g.add_argument("--method", choices=("diagnose", "identify"), default="diagnose", help="what is done (default: diagnose)")
    g.add_argument("--quick", action="store_true", help="name the first cause and stop")
    g.add_argument("--resume", action="store_true", help="go on where a run was stopped, and keep what is there (default)")
    g.add_argument("--again", action="store_true", help="make the results of these logs again, though they are there")
    g.add_argument("--seed", type=int, default=0, metavar="N", help="same seed, same result (default 0)")
    g.add_argument("--workers", type=int, metavar="N", help="processes (default: one for each processor)")
    g.add_argument("--json", action="store_true", help="print the counts as JSON")


def add_trends_options(parser: argparse.ArgumentParser) -> None:
    """What `gaident trends` takes."""
    parser.add_argument("fleet", metavar="FLEET", help="the folder that gaident fleet wrote")
    g = parser.add_argument_group("results")
    g.add_argument("-o", "--out", metavar="FILE", help="write it as one HTML page, which needs no network")
    g.add_argument("--no-reports", dest="reports", action="store_false", help="without the reports that the page opens")
    g.add_argument("--json", action="store_true", help="print JSON instead of text")
