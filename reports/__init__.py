"""Reports: one self-contained HTML page a session, an index for several, and the figures of both."""

from reports.context import ReportContext
from reports.index import IndexEntry, write_index
from reports.report import gallery, render_report, write_report

__all__ = [
    "IndexEntry",
    "ReportContext",
    "gallery",
    "render_report",
    "write_index",
    "write_report",
]
