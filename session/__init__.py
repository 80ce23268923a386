"""The session folder: its description, recordings, flags, results and errors; it imports none of ours."""

from session.camera import CameraCalibration, CameraSpec, load_camera
from session.commands import COMMAND_COLUMNS, MotorCommands, load_commands
from session.create import FISHSIM_MARKERS, new_folder, new_from_fishsim, write_session_toml
from session.errors import (
    Fault,
    FaultCollector,
    InputError,
    ModelMismatch,
    NotConverged,
    NotEnoughData,
    ResultsNotWritable,
    SessionLocked,
    SimulationDiverged,
    SwimcalError,
    did_you_mean,
    shown,
)
from session.flags import FLAG_KINDS, Flag
from session.folder import SESSION_FILE, Session, TrialSpec, file_hashes, load_session
from session.lock import session_lock
from session.motor import MOTOR_COLUMNS, MotorLog, load_motor
from session.results import (
    Provenance,
    ResultFile,
    plain_json,
    program_version,
    read_provenance,
    sha256_of,
    write_whole,
    writing_whole,
)
from session.session_file import TrialKind
from session.stage import Stage, fingerprint_of
from session.toml_source import Table, TomlSource, key_error, load_toml, read_toml
from session.tracks import Tracks, load_tracks, save_tracks

__all__ = [
    "COMMAND_COLUMNS",
    "FISHSIM_MARKERS",
    "FLAG_KINDS",
    "MOTOR_COLUMNS",
    "SESSION_FILE",
    "CameraCalibration",
    "CameraSpec",
    "Fault",
    "FaultCollector",
    "Flag",
    "InputError",
    "ModelMismatch",
    "MotorCommands",
    "MotorLog",
    "NotConverged",
    "NotEnoughData",
    "Provenance",
    "ResultFile",
    "ResultsNotWritable",
    "Session",
    "SessionLocked",
    "SimulationDiverged",
    "Stage",
    "SwimcalError",
    "Table",
    "TomlSource",
    "Tracks",
    "TrialKind",
    "TrialSpec",
    "did_you_mean",
    "file_hashes",
    "fingerprint_of",
    "key_error",
    "load_camera",
    "load_commands",
    "load_motor",
    "load_session",
    "load_toml",
    "load_tracks",
    "new_folder",
    "new_from_fishsim",
    "plain_json",
    "program_version",
    "read_provenance",
    "read_toml",
    "save_tracks",
    "session_lock",
    "sha256_of",
    "shown",
    "write_session_toml",
    "write_whole",
    "writing_whole",
]
