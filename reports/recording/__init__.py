"""The recording of a session for the Rerun viewer, written and read back without one."""

from reports.recording.contents import EntityContents, RecordingContents, read_recording
from reports.recording.missing import MissingOverTime
from reports.recording.proxy import make_proxy
from reports.recording.recorded_trial import RecordedTrial
from reports.recording.recording import check_recording, write_recording

__all__ = [
    "EntityContents",
    "MissingOverTime",
    "RecordedTrial",
    "RecordingContents",
    "check_recording",
    "make_proxy",
    "read_recording",
    "write_recording",
]
