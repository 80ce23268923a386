"""The recording of a session for the Rerun viewer, and the small copies of its videos."""

from reports.recording.missing import MissingOverTime
from reports.recording.proxy import make_proxy
from reports.recording.recorded_trial import RecordedTrial
from reports.recording.recording import APPLICATION, write_recording

__all__ = ["APPLICATION", "MissingOverTime", "RecordedTrial", "make_proxy", "write_recording"]
