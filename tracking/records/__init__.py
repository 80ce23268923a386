"""Tracked trials: what the tracker measures at every sample, filled gaps, a person's edits, other programs' files."""

from tracking.records.edit_log import EditLog
from tracking.records.edits import apply_edits
from tracking.records.formats import export_tracks, import_tracks
from tracking.records.gaps import fill_gaps
from tracking.records.movement import to_movement
from tracking.records.storage import load_tracked, save_tracked
from tracking.records.tracked import SampleState, as_tracked

__all__ = [
    "EditLog",
    "SampleState",
    "apply_edits",
    "as_tracked",
    "export_tracks",
    "fill_gaps",
    "import_tracks",
    "load_tracked",
    "save_tracked",
    "to_movement",
]
