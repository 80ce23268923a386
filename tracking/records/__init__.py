"""Tracked trials: what the tracker says of every sample, filled gaps, a person's edits, and other programs' files."""

from tracking.records.deeplabcut import load_deeplabcut, save_deeplabcut
from tracking.records.edit import Drop, Edit, Relabel, SetBox, Swap, Undo
from tracking.records.edit_log import EditLog, LoggedEdit
from tracking.records.edits import (
    ONLY_CSRT,
    Retrack,
    Retracker,
    apply_edits,
    only_csrt_flags,
    retracks,
    seen_only_by_csrt,
)
from tracking.records.foreign import save_fishsim
from tracking.records.formats import FORMATS, export_tracks, import_tracks
from tracking.records.gaps import GapLimits, fill_gaps
from tracking.records.movement import load_movement, save_movement, to_movement
from tracking.records.storage import TrackedFiles, load_tracked, save_tracked
from tracking.records.tracked import SEEN, STATE_WORDS, UNTRUSTED, SampleState, TrackedTrial

__all__ = [
    "FORMATS",
    "ONLY_CSRT",
    "SEEN",
    "STATE_WORDS",
    "UNTRUSTED",
    "Drop",
    "Edit",
    "EditLog",
    "GapLimits",
    "LoggedEdit",
    "Relabel",
    "Retrack",
    "Retracker",
    "SampleState",
    "SetBox",
    "Swap",
    "TrackedFiles",
    "TrackedTrial",
    "Undo",
    "apply_edits",
    "export_tracks",
    "fill_gaps",
    "import_tracks",
    "load_deeplabcut",
    "load_movement",
    "load_tracked",
    "only_csrt_flags",
    "retracks",
    "save_deeplabcut",
    "save_fishsim",
    "save_movement",
    "save_tracked",
    "seen_only_by_csrt",
    "to_movement",
]
