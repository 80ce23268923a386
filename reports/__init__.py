"""How results are shown: one self-contained HTML report a session, an index for several, and figures."""

from reports.context import ReportContext
from reports.index import write_index
from reports.report import gallery, render_report, write_report
from reports.sections.track_quality import picture_of_tracks

__all__ = [
    "ReportContext",
    "gallery",
    "picture_of_tracks",
    "render_report",
    "write_index",
    "write_report",
]
