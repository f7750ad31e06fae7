"""The files of a result: --out, --plot and --report of `identify` and `diagnose`."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaident.checks import check_installed
from gaident.cli.options import PICTURES
from gaident.cli.output import apart, naming, save_figure, target_of, write

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gaident.data.record import Record
    from gaident.drive.drive_file import Drive
    from gaident.results.diagnosis import Diagnosis
    from gaident.results.identification import Identification
    from gaident.results.what_if import Stability

__all__ = ["ResultFiles", "shown_block", "write_report"]


@dataclass(frozen=True)
class ResultFiles:
    """Where the result, its picture and its page go; None where one is not asked for."""

    result: Path | None
    picture: Path | None
    page: Path | None
    live: bool = True
    remedies: bool = True

    @classmethod
    def of(cls, args: Namespace, sources: Sequence[str], **others: Path | None) -> ResultFiles:
        """The files that the options name; raises where one is a source, or two, `others` among them, are the same."""
        if args.report is not None:
            check_report()
        files = cls(
            target_of(args.out, sources),
            target_of(args.plot, sources, PICTURES),
            target_of(args.report, sources),
            not args.pictures,
            not getattr(args, "no_remedies", False),
        )
        apart({"--out": files.result, "--plot": files.picture, "--report": files.page, **others})
        return files

    def write(
        self,
        result: Diagnosis | Identification,
        records: Sequence[Record],
        validation: Sequence[Record],
        drive: Drive,
        figure: Callable[[], Figure],
        doing: Callable[[str], None],
        stability: Stability | None = None,
    ) -> list[Path]:
        """Write those that were asked for and return them.

        figure: draws the picture; doing: told what is under way; stability: of a diagnosis, for its page.
        """
        if self.result is not None:
            with naming(self.result):
                result.save(self.result)
        if self.picture is not None:
            doing(f"drawing {self.picture}")
            from gaident.show.units import figure_in_units, scales_of

            save_figure(figure_in_units(figure(), scales_of(drive.units_shown, drive.axis)), self.picture)
        if self.page is not None:
            doing(f"writing {self.page}, with gains and pictures" if self.remedies else f"writing {self.page}")
            write_report(result, self.page, records, validation, drive, self.live, stability, self.remedies)
        return [path for path in (self.result, self.picture, self.page) if path is not None]


def check_report() -> None:
    """Raises where a report lacks a library, before the work that it is made of."""
    from gaident.reporting.report import NEEDED

    check_installed(NEEDED, "pictures", "a report")


def write_report(
    result: Diagnosis | Identification | Mapping[str, Diagnosis | Identification],
    target: Path,
    records: Sequence[Record],
    validation: Sequence[Record],
    drive: Drive,
    live: bool,
    stability: Stability | None = None,
    remedies: bool = True,
) -> int:
    """The page; returns its size [bytes]."""
    from gaident.reporting.report import report_page

    shown = drive.axis, drive.units_shown, drive.about, live, stability, remedies
    page = report_page(result, records, validation, *shown).encode()
    write(target, page)
    return len(page)


def shown_block(result: Diagnosis | Identification, drive: Drive) -> dict[str, Any]:
    """What --json adds where the drive file says in which units the user works."""
    from gaident.show.units import scales_of, shown_in

    found = shown_in(result, scales_of(drive.units_shown, drive.axis), drive.axis)
    return {"shown": found} if found else {}
