"""How results are shown: one self-contained HTML report a session, an index for several, and figures."""

from reports.index import IndexEntry, render_index, write_index
from reports.report import render_report, write_report

__all__ = ["IndexEntry", "render_index", "render_report", "write_index", "write_report"]
