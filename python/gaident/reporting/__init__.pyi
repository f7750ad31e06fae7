from .report import report, report_page

__all__ = [
    "report",
    "report_page",
]
