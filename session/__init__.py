"""The session folder: its description, recordings, flags, results and errors; it imports none of ours."""

from session.camera import CameraSpec
from session.errors import FaultCollector, InputError, NotEnoughData, SwimcalError
from session.flags import Flag
from session.folder import Session, TrialSpec, load_session

__all__ = [
    "CameraSpec",
    "FaultCollector",
    "Flag",
    "InputError",
    "NotEnoughData",
    "Session",
    "SwimcalError",
    "TrialSpec",
    "load_session",
]
