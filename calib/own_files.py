"""A session of one's own files: a commented `session.toml` whose first lines list what is missing."""

import json
import os
import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from reports.page import environment
from session import FaultCollector, InputError
from session.create import FISHSIM_MARKERS, new_folder
from session.errors import Fault
from session.folder import SESSION_FILE
from session.results import write_whole
from session.session_checks import rate_is_off
from session.tables import read_table
from session.tracks import SUFFIXES, TIME, as_tracks, markers_of, save_tracks
from swimmer import RobotSpec, load_robot
from tracking.records import import_tracks
from tracking.video import Video

_HZ = (r"(?:^|_)f(\d+)[_.p](\d+)(?:_|$)", r"(\d+)[_.p](\d+) ?_?hz")  # in names: f1_25, 1.25hz


@dataclass
class _Trial:
    name: str
    video: Path | None = None
    tracks: xr.Dataset | None = None
    commanded_hz: float | None = None
    comments: list[str] = field(default_factory=list)
    fps: float | None = None

    @property
    def kind(self) -> str:
        """From its name."""
        return "free_decay" if "decay" in self.name else "dry" if "dry" in self.name else "swim"


def new_from_files(
    folder: Path,
    videos: Iterable[str | Path] = (),
    tracks: Iterable[str | Path] | Mapping[str, Any] = (),
    robot: str | Path | None = None,
    fps: float | None = None,
    commands_hz: Sequence[float] = (),
    fit: Sequence[str] = (),
) -> None:
    """Makes a session folder of videos and tracks; the arguments are those of `calib.new_session`.

    Raises:
        InputError: every fault of the files at once; then there is no folder.
        ResultsNotWritable: the folder cannot be written.
    """
    spec = load_robot(None if robot is None else Path(robot))
    trials = _trials(spec, [Path(video) for video in videos], tracks, fps)
    _command(trials, commands_hz)
    faults = FaultCollector("--fit")
    for name in (name for name in fit if name not in trials):
        faults.add("", "no such trial to fit", found=repr(name), expected="trials that are there", choices=[*trials])
    faults.raise_if_any()
    rates = [trial.fps for trial in trials.values() if trial.fps]
    rate = fps or float(np.median(rates))
    _check_rates(trials, rate)
    markers = next((markers_of(trial.tracks) for trial in trials.values() if trial.tracks is not None), _markers(spec))
    ordered = sorted(trials.values(), key=lambda trial: (trial.kind, trial.commanded_hz or 0.0, trial.name))
    with new_folder(folder) as part:
        (part / "trials").mkdir()
        for trial in ordered:
            if trial.tracks is not None:
                save_tracks(part / "trials" / f"{trial.name}.csv", trial.tracks)
            if trial.video is not None:
                _put(trial.video, part / "trials" / f"{trial.name}{trial.video.suffix.lower()}")
        if robot is not None:
            shutil.copyfile(robot, part / "robot.toml")
        write_whole(part / SESSION_FILE, _text(folder.absolute().name, ordered, rate, markers, spec, robot, fit))


def _check_rates(trials: Mapping[str, _Trial], rate: float) -> None:
    """An `InputError` where the time stamps of tracks are off this frame rate by more than 5 %."""
    spacings = {n: np.diff(each.tracks.time.values) for n, each in trials.items() if each.tracks is not None}
    off = [
        f"{1 / float(np.mean(spacing)):.4g} in {name}"
        for name, spacing in spacings.items()
        if trials[name].kind != "free_decay" and rate_is_off(rate, float(np.median(spacing)), float(np.mean(spacing)))
    ]
    if off:
        step = "Give the rate of the camera; trials of different frame rates need a session each."
        what = "the time stamps of tracks show another frame rate"
        found = f"{rate:g}; by their time stamps {', '.join(off)}"
        raise InputError([Fault("--fps", "", what, found, "one frame rate within 5 %", next_step=step)])


def _trials(
    robot: RobotSpec, videos: Sequence[Path], tracks: Iterable[str | Path] | Mapping[str, Any], fps: float | None
) -> dict[str, _Trial]:
    """Trials by name; a video and tracks of one name are one trial."""
    found: dict[str, _Trial] = {}
    faults = FaultCollector("the files")
    for path in videos:
        with faults.nested(), Video(path) as video:
            info = video.info
            trial = found.setdefault(_name(path), _Trial(_name(path)))
            trial.video, trial.fps = path, info.fps
            size = f"{info.width_px} x {info.height_px} px"
            trial.comments.append(f"{info.frames} frames, {size}, {info.fps:.4g} frames a second")
    named = tracks.items() if isinstance(tracks, Mapping) else ((_name(Path(path)), path) for path in tracks)
    for name, given in named:
        with faults.nested():
            trial = found.setdefault(name, _Trial(name))
            rate = fps or trial.fps
            own = _of_dataset(given) if hasattr(given, "data_vars") else _of_file(Path(given), robot, rate)
            trial.tracks, trial.fps = own, trial.fps or own.fps
            trial.comments.append(f"tracks: {own.sizes['time']} frames, {np.ptp(own.time.values):.1f} s")
    if not found and not faults:
        faults.add("", "no video and no tracks", expected="at least one of --videos, --tracks")
    faults.raise_if_any()
    return found


def _of_file(path: Path, robot: RobotSpec, fps: float | None) -> xr.Dataset:
    """Tracks of a file in any form; a file with a header of ours names its markers."""
    markers, timed = _markers(robot), True
    if "".join(path.suffixes[-2:]) in (".csv", ".csv.gz") or path.suffix == ".csv":
        header = read_table(path).header or ()
        timed = TIME in header
        if timed:
            markers = tuple(name.removesuffix("_x") for name in header if name.endswith(SUFFIXES[0]))
    if not timed and not fps:
        expected = "the frame rate of the camera"
        raise InputError([Fault(str(path), "", "the file has no time", "", expected, next_step="Add `--fps 60`.")])
    return import_tracks(path, markers, fps or nan)


def _markers(robot: RobotSpec) -> tuple[str, ...]:
    """Where no file names them: the published nine of a robot that has them, else all of the robot."""
    return FISHSIM_MARKERS if set(FISHSIM_MARKERS) <= set(robot.markers) else tuple(robot.markers)


def _of_dataset(data: Any) -> xr.Dataset:
    """Tracks as another program may have them, in any order of dimensions."""
    position_px = data.position.transpose("time", "keypoint", "space").to_numpy()
    if "confidence" in data:
        confidence = data.confidence.transpose("time", "keypoint").to_numpy()
    else:
        confidence = np.isfinite(position_px).all(axis=-1).astype(float)
    return as_tracks(tuple(map(str, data.keypoint.to_numpy())), data.time.to_numpy(), position_px, confidence)


def _name(path: Path) -> str:
    stem = path.name.removesuffix(".gz")
    return re.sub(r"[^A-Za-z0-9_-]+", "_", stem[: stem.rfind(".")] if "." in stem else stem).strip("_-") or "trial"


def _command(trials: Mapping[str, _Trial], commands_hz: Sequence[float]) -> None:
    """The command of the motor in each trial, as given, else from the names."""
    driven = [trial for trial in trials.values() if trial.kind != "free_decay"]
    if commands_hz and len(commands_hz) != len(driven):
        given, names = f"{len(commands_hz)}", ", ".join(trial.name for trial in driven)
        raise InputError([Fault("--commands", "", "not one for each trial", given, f"{len(driven)}: of {names}")])
    for number, trial in enumerate(driven):
        found = next((match for pattern in _HZ if (match := re.search(pattern, trial.name.lower()))), None)
        if commands_hz:
            trial.commanded_hz = float(commands_hz[number])
        elif found:
            trial.commanded_hz = float(f"{found[1]}.{found[2]}")


def _put(source: Path, target: Path) -> None:
    """A video in its place: linked where the file system can, so that hours of it are not copied."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def _text(
    name: str,
    trials: Sequence[_Trial],
    rate: float,
    markers: Sequence[str],
    robot: RobotSpec,
    robot_file: str | Path | None,
    fit: Sequence[str],
) -> str:
    """`session.toml` with comments, and first what the user has to fill in."""
    swims = [trial.name for trial in trials if trial.kind == "swim"]
    template = environment("calib", escaped=False).get_template("session.toml.j2")
    return template.render(
        name=json.dumps(name),
        trials=trials,
        rate=rate,
        markers=json.dumps(list(markers)),
        robot=robot,
        robot_file=robot_file,
        held_out=[swim for swim in swims if swim not in fit] if fit else swims[1::2],
    )
