"""The report: one self-contained HTML page, a pure function of a result and of what was worked out of its records."""

from gaident.show.report.page import page
from gaident.show.report.views import Run, View

__all__ = ["Run", "View", "page"]
