"""The session folder: its trials, recordings and camera as `session.toml` describes them.

`load_session` reads and checks `session.toml` and the recordings that it names; the folder ``results`` next to them
belongs to the program.

`is_exchanged` tells whether nose and neck were exchanged: the other markers then lie on the wrong side of the head.
Only distances are compared, so that neither a mirrored image nor a bent tail plays a part.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swimcal.errors import Fault, FaultCollector, InputError, did_you_mean
from swimcal.motor_log import load_commands, load_motor
from swimcal.results import sha256_of
from swimcal.session_file import (
    HEAD_MARKERS,
    TRIAL_FILES,
    CameraSpec,
    SessionFile,
    TrialKind,
    TrialRole,
    TrialTable,
    check_files,
    check_heads,
    check_markers,
    check_rates,
    check_scale,
    check_trials,
    is_file,
    load_camera,
    markers_in,
    trials_in,
    usual_spacing_s,
)
from swimcal.toml import TomlSource
from swimcal.tracks import NO_NAMES, load_tracks, markers_of, pixels_of

if TYPE_CHECKING:
    import xarray as xr

    from swimcal.robot import RobotSpec

SESSION_FILE = "session.toml"
MOTOR_SUFFIX = ".motor.csv"
COMMANDS_SUFFIX = ".commands.csv"

# A marker counts if it is nearer to one of nose and neck than to the other by this share of the distance between them.
_CLEAR = 0.5
# Nose and neck count as exchanged from this share of samples on the wrong side.
_MOSTLY = 0.8


@dataclass(frozen=True)
class TrialSpec:
    """One recording of the robot, as `session.toml` describes it.

    Attributes:
        name: unique in the session, fit for a file name.
        kind: ``"free_decay"`` (tail let go), ``"dry"`` (head clamped, in air) or ``"swim"``.
        tracks: marker tracks; they win over a video.
        boxes: first boxes of the markers in the video; where the file names none, ``<trial>.boxes.json`` next to the
            video if that is there.
        motor_offset_s: motor clock minus video clock, seconds.
        fps: frames a second of this recording, where they are not the camera's.
        commanded_hz: crank turns a second; None for a free decay, and where it is not stated yet.
        role: ``"fit"`` or ``"holdout"``.
    """

    name: str
    kind: TrialKind
    tracks: Path | None = None
    video: Path | None = None
    boxes: Path | None = None
    motor: Path | None = None
    motor_offset_s: float = 0.0
    fps: float | None = None
    commanded_hz: float | None = None
    role: TrialRole = "fit"

    def __repr__(self) -> str:
        command = "" if self.commanded_hz is None else f", commanded {self.commanded_hz:g} Hz"
        recording = self.tracks or self.video
        return (
            f"<TrialSpec {self.name}: {self.kind}, {self.role}{command}; {recording.name if recording else 'no file'}>"
        )

    @property
    def edits(self) -> Path | None:
        """The file of a person's corrections of the tracks, ``<trial>.edits.jsonl`` next to the video.

        It need not be there.
        """
        return None if self.video is None else self.video.with_name(f"{self.name}.edits.jsonl")

    @property
    def commands(self) -> Path | None:
        """The file of commands to the motor, ``<x>.commands.csv`` next to a log ``<x>.motor.csv``.

        None where it is not there.
        """
        return None if self.motor is None else commands_of(self.motor)


def commands_of(motor: Path) -> Path | None:
    """Find the file of commands that belongs to a motor log; None where there is none."""
    path = _commands_beside(motor)
    return path if motor.name.endswith(MOTOR_SUFFIX) and is_file(path) else None


def usual_boxes(video: Path, trial: str) -> Path:
    """Return the path of the start boxes of a trial that names none; the file need not be there."""
    return video.with_name(f"{trial}.boxes.json")


def _commands_beside(motor: Path) -> Path:
    return motor.with_name(motor.name.removesuffix(MOTOR_SUFFIX) + COMMANDS_SUFFIX)


@dataclass(frozen=True)
class Session:
    """A session whose files were checked.

    Attributes:
        folder: the session folder.
        name: the session's name.
        robot_file: the robot's description; None for the built-in robot.
        camera: clock, scale and lens.
        markers: names of the tracked markers, in the order of files without a header.
        rename: names in the headers of tracks, and which markers they are.
        warmup_s: seconds at the start of each trial left out of every comparison.
        seed: the seed of every random draw.
        trials: in the order of the file.

    Example:
        >>> session = calib.open_session("pool")
        >>> session.name, session.camera.fps, session.markers[0]
        ('synthetic', 60.0, 'nose')
        >>> session.trial("fast").commanded_hz, session.trial("fast").role
        (1.35, 'holdout')
    """

    folder: Path
    name: str
    robot_file: Path | None
    camera: CameraSpec
    markers: tuple[str, ...]
    warmup_s: float
    seed: int
    trials: tuple[TrialSpec, ...]
    rename: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        trials = f"{len(self.trials)} trials ({sum(trial.role == 'fit' for trial in self.trials)} to fit)"
        return f"<Session {self.name}: {trials}, {len(self.markers)} markers, {self.camera.fps:g} frames/s>"

    @property
    def in_shell(self) -> str:
        """The folder as a command line needs it, quoted where its name requires that."""
        return shlex.quote(str(self.folder))

    @property
    def results(self) -> Path:
        """The folder of the results; it need not be there yet."""
        return self.folder / "results"

    def trial(self, name: str) -> TrialSpec:
        """Find the trial of this name.

        Raises:
            InputError: there is none; the error lists the choices.
        """
        names = [trial.name for trial in self.trials]
        if name not in names:
            file, found, hint = str(self.folder / SESSION_FILE), repr(name), did_you_mean(name, names)
            expected, choices = "a trial of the session", tuple(names)
            raise InputError([Fault(file, "", "no such trial", found, expected, choices, hint)])
        return self.trials[names.index(name)]

    def camera_of(self, trial: TrialSpec) -> CameraSpec:
        """Return the camera at the frame rate of a trial."""
        return self.camera if trial.fps is None else replace(self.camera, fps=trial.fps)

    def inputs(self) -> tuple[Path, ...]:
        """List every input file once, `session.toml` first."""
        files = [self.folder / SESSION_FILE, self.robot_file, self.camera.file]
        for trial in self.trials:
            files += [trial.tracks, trial.video, trial.boxes, trial.motor, trial.commands]
            files += [trial.edits] if trial.edits is not None and is_file(trial.edits) else []
        return tuple(dict.fromkeys(file for file in files if file is not None))

    def absent_inputs(self) -> tuple[Path, ...]:
        """List absent files that would be inputs if they were there: boxes, edits and commands of a recording."""
        files: list[Path] = []
        for trial in self.trials:
            if trial.video is not None:
                files += [path for path in (trial.edits, usual_boxes(trial.video, trial.name)) if path is not None]
            if trial.motor is not None and trial.commands is None:
                files.append(_commands_beside(trial.motor))
        return tuple(dict.fromkeys(file for file in files if not is_file(file)))


def load_session(
    folder: Path,
    robot_of: Callable[[Path | None], RobotSpec] | None = None,
    *,
    check_tracks: bool = True,
    needs_commands: bool = True,
) -> Session:
    """Read and check a session folder; nothing is written.

    Args:
        folder: the folder with the `session.toml`.
        robot_of: reads the robot in a file, or the built-in robot for None, and may raise `InputError`; the robot's
            markers and scale length are compared with those of the session.
        check_tracks: also read every track file and motor log.
        needs_commands: whether a driven trial must have its `commanded_hz`, which tracking does not need.

    Raises:
        InputError: every fault of `session.toml` and of the files it names, the robot's too, at once.
    """
    source = _read_session_file(folder)
    faults = FaultCollector(source.file)
    content = source.validate(SessionFile, faults)
    check_files(source, folder, faults)
    check_trials(source, faults, needs_commands)
    robot = _robot(source, folder, robot_of, faults) if robot_of else None
    check_markers(source, robot, faults)
    check_scale(source, robot, faults)
    camera = _camera(content, folder, faults) if content else None
    if check_tracks:
        _check_recordings(source, content, folder, robot, faults)
    faults.raise_if_any()
    assert content is not None
    assert camera is not None
    return _session(content, folder, camera)


def file_hashes(session: Session) -> dict[str, str]:
    """Compute the sha256 of every input file by its name relative to the session folder, with forward slashes."""
    return {Path(os.path.relpath(file, session.folder)).as_posix(): sha256_of(file) for file in session.inputs()}


def _read_session_file(folder: Path) -> TomlSource:
    path = folder / SESSION_FILE
    if not is_file(path):
        expected, step = f"a session folder with a {SESSION_FILE}", "Make one with `calib new`."
        above = next((each for each in folder.absolute().parents[:2] if is_file(each / SESSION_FILE)), None)
        if above is not None:
            step = f"Give {above}, which has one."
        raise InputError([Fault(str(folder), "", f"no {SESSION_FILE} here", "", expected, next_step=step)])
    return TomlSource(path)


def _robot(
    source: TomlSource, folder: Path, robot_of: Callable[[Path | None], RobotSpec], faults: FaultCollector
) -> RobotSpec | None:
    robot = source.data.get("robot", {})
    file = _find_file(folder, robot.get("file")) if isinstance(robot, dict) else None
    if "robot" in source.data and file is None:
        return None
    with faults.nested():
        return robot_of(file)
    return None


def _camera(content: SessionFile, folder: Path, faults: FaultCollector) -> CameraSpec:
    camera = content.camera
    file = None if camera.calibration is None else folder / camera.calibration
    calibration = None
    if file is not None and is_file(file):
        with faults.nested():
            calibration = load_camera(file)
    return CameraSpec(camera.fps, camera.scale_length_m, calibration, file)


def _check_recordings(
    source: TomlSource, content: SessionFile | None, folder: Path, robot: RobotSpec | None, faults: FaultCollector
) -> None:
    """Read the tracks and motor logs that are there, also when `session.toml` has faults of its own.

    Tracks wait where it names markers that differ from the robot's: every file would be told to have wrong columns.
    """
    markers, stamps = markers_in(source), {}
    rates = {trial.name: trial.fps or content.camera.fps for trial in content.trial} if content else {}
    known = len(set(markers)) == len(markers) > 0 and (robot is None or set(markers) <= set(robot.markers))
    exchanged: dict[str, bool] = {}  # whether nose and neck are exchanged, by trial
    if robot is None or not set(HEAD_MARKERS) <= set(markers) <= set(robot.markers):
        robot = None
    for _, trial in trials_in(source):
        if path := _find_file(folder, trial.get("motor")):
            with faults.nested():
                load_motor(path)
            if commands := commands_of(path):
                with faults.nested():
                    load_commands(commands)
        path = _find_file(folder, trial.get("tracks"))
        if path and known:
            with faults.nested():
                name, rename = str(trial.get("name")), content.markers.rename if content else NO_NAMES
                tracks = load_tracks(path, markers, rates.get(name, 1.0), rename=rename, seen=False)
                if robot is not None:
                    exchanged[name] = is_exchanged(tracks, robot.marker_positions_m(markers_of(tracks)))
                if content:
                    stamps[name] = usual_spacing_s(tracks.time.values)
    if content:
        check_rates(source, rates, stamps, faults)
    check_heads(source, exchanged, faults)


def _find_file(folder: Path, name: object) -> Path | None:
    """Find the file of this name in the session folder; None where the name is faulty, which other checks report."""
    return folder / name if isinstance(name, str) and name and is_file(folder / name) else None


def _session(content: SessionFile, folder: Path, camera: CameraSpec) -> Session:
    return Session(
        folder=folder,
        name=content.session.name,
        robot_file=folder / content.robot.file if content.robot else None,
        camera=camera,
        markers=content.markers.names,
        warmup_s=content.fit.warmup_s,
        seed=content.fit.seed,
        trials=tuple(_trial(trial, folder) for trial in content.trial),
        rename=content.markers.rename,
    )


def _trial(trial: TrialTable, folder: Path) -> TrialSpec:
    files = {kind: getattr(trial, kind) for kind in TRIAL_FILES}
    paths = {kind: None if name is None else folder / name for kind, name in files.items()}
    if paths["video"] is not None and paths["boxes"] is None:
        usual = usual_boxes(paths["video"], trial.name)
        paths["boxes"] = usual if is_file(usual) else None
    return TrialSpec(**{**trial.model_dump(), **paths})


# The check whether nose and neck were exchanged.


def wrong_side_share(tracks: xr.Dataset, place_m: np.ndarray) -> float | None:
    """Compute the share of samples that are nearer to the wrong end of the head, nose or neck.

    None where no marker tells, or none is seen together with nose and neck.

    Args:
        tracks: n frames of m markers.
        place_m: (m, 2 or 3) places of the markers on the straight robot, m.
    """
    markers = markers_of(tracks)
    nose, neck = (markers.index(name) for name in HEAD_MARKERS)
    belongs = _nearer_nose(place_m[None, :, :2], nose, neck)[0]  # (m,) m
    tells = np.abs(belongs) > _CLEAR * np.linalg.norm(place_m[nose, :2] - place_m[neck, :2])
    tells[[nose, neck]] = False
    found = _nearer_nose(pixels_of(tracks), nose, neck)[:, tells]
    wrong = (found * belongs[tells] < 0)[np.isfinite(found)]
    return float(wrong.mean()) if wrong.size else None


def is_exchanged(tracks: xr.Dataset, place_m: np.ndarray) -> bool:
    """Return whether nose and neck are exchanged in most frames; arguments as for `wrong_side_share`."""
    return (wrong_side_share(tracks, place_m) or 0.0) > _MOSTLY


def _nearer_nose(place: np.ndarray, nose: int, neck: int) -> np.ndarray:
    """Compute (n, m) by how much each marker at (n, m, 2) is nearer to the nose than to the neck."""
    from_nose, from_neck = (np.linalg.norm(place - place[:, [head]], axis=2) for head in (nose, neck))
    return from_neck - from_nose
