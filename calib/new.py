"""New sessions from one's own files: `new_from_files` writes a commented `session.toml` whose first lines list what is
missing.
"""

import json
import os
import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from calib.trial_names import in_a_line, trial_names, without_copies
from reports.page import environment
from swimcal.create_session import FISHSIM_MARKERS, new_folder
from swimcal.errors import Fault, FaultCollector, InputError, did_you_mean
from swimcal.results import write_whole
from swimcal.robot import RobotSpec, load_robot
from swimcal.session import SESSION_FILE, Session
from swimcal.session_file import FEWEST_MARKERS, HEAD_MARKERS, rate_is_off, usual_spacing_s
from swimcal.tracks import NO_NAMES, markers_of, pixels_of, save_tracks
from tracking.foreign import ForeignTracks, check_names
from tracking.formats import from_movement, read_foreign
from tracking.video import Video

FEWEST_FRAMES = 2
UNIT_OFF = 0.01
"""Places may not be pixels if nose to neck is as many as it is millimetres or centimetres, to this relative error."""
CAMERA_FILE = "camera.toml"
_HZ = (r"(?:^|_)f(\d+)[_.p](\d+)(?:_|$)", r"(\d+)[_.p](\d+) ?_?hz")  # commands in names: f1_25, 1.25hz


def new_from_files(  # noqa: PLR0913  the arguments of a command
    folder: Path,
    videos: Iterable[str | Path] = (),
    tracks: Iterable[str | Path] | Mapping[str, Any] = (),
    robot: str | Path | None = None,
    fps: float | None = None,
    commands_hz: Sequence[float] = (),
    fit: Sequence[str] = (),
    rename: Mapping[str, str] = NO_NAMES,
    like: Session | None = None,
) -> None:
    """Make a session folder of videos and tracks; the arguments are those of `calib.new_session`.

    Of a session that it is to be like it takes robot, frame rate, lens and names of markers where these are not given,
    and commands and roles of trials of the same name.

    Raises:
        InputError: every fault of the files at once; then there is no folder.
        ResultsNotWritable: the folder cannot be written.
    """
    lens = None
    if like is not None:
        robot, fps, rename = robot or like.robot_file, fps or like.camera.fps, {**like.rename, **rename}
        lens = like.camera.file
    spec = load_robot(None if robot is None else Path(robot))
    trials, notes = _trials(spec, [Path(video) for video in videos], tracks, fps, rename)
    _command(trials, commands_hz)
    if like is not None:
        fit, unlike = _repeat(trials, like, bool(commands_hz), fit)
        notes = [*notes, *unlike]
    faults = FaultCollector("--fit")
    for name in (name for name in fit if name not in trials):
        faults.add("", "no such trial to fit", found=repr(name), expected="trials that are there", choices=[*trials])
    faults.raise_if_any()
    rates = [_rate(trial.time_s) for trial in trials.values() if trial.time_s is not None]
    rate = fps or float(np.median(rates))
    _check_rates(trials, rate)
    markers, of_markers = _common_markers(trials, spec)
    ordered = sorted(trials.values(), key=lambda trial: (trial.kind, trial.commanded_hz or 0.0, trial.name))
    with new_folder(folder) as part:
        (part / "trials").mkdir()
        for trial in ordered:
            if trial.tracks is not None:
                save_tracks(part / "trials" / f"{trial.name}.csv", trial.tracks.sel(keypoint=list(markers)))
            if trial.video is not None:
                _put(trial.video, part / "trials" / f"{trial.name}{trial.video.suffix.lower()}")
        if robot is not None:
            shutil.copyfile(robot, part / "robot.toml")
        if lens is not None:
            shutil.copyfile(lens, part / CAMERA_FILE)
        swims = [trial.name for trial in ordered if trial.kind == "swim"]
        template = environment("calib", escaped=False).get_template("session.toml.j2")
        text = template.render(
            name=json.dumps(folder.absolute().name),
            trials=ordered,
            notes=[*notes, *of_markers],
            rate=rate,
            markers=json.dumps(list(markers)),
            robot=spec,
            robot_file=robot,
            lens=lens,
            roles_chosen=not fit,
            held_out=[swim for swim in swims if swim not in fit] if fit else _choose_held_out(swims),
        )
        write_whole(part / SESSION_FILE, text)


@dataclass
class _Trial:
    name: str
    video: Path | None = None
    tracks: xr.Dataset | None = None
    commanded_hz: float | None = None
    comments: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    questions: list[str] = field(default_factory=list)
    time_s: np.ndarray | None = None  # times of the frames; None where the file has none

    @property
    def kind(self) -> str:
        """The kind of the trial, by its name."""
        return "free_decay" if "decay" in self.name else "dry" if "dry" in self.name else "swim"


def _choose_held_out(swims: list[str]) -> list[str]:
    """Choose which of the swims, slowest first, are held out: every second, but neither the slowest nor the fastest."""
    return swims[1:-1:2] if len(swims) > 2 else swims[1:]


def _rate(time_s: np.ndarray) -> float:
    """Estimate the frames a second, by the median of the steps unless these are coarse or uneven."""
    median_s, mean_s = usual_spacing_s(time_s)
    return 1 / mean_s if abs(median_s / mean_s - 1) < 0.25 else 1 / median_s


def _check_rates(trials: Mapping[str, _Trial], rate: float) -> None:
    """Raise an `InputError` where the time stamps of tracks or videos are off this frame rate by more than 5 %."""
    off: dict[str, list[str]] = {}
    for name, trial in trials.items():
        if trial.time_s is not None:
            median_s, mean_s = usual_spacing_s(trial.time_s)
            if rate_is_off(rate, median_s, mean_s):
                off.setdefault(f"{1 / mean_s:.4g}", []).append(name)
    if off:
        step = (
            "Give the rate at which the camera filmed. Of trials of different rates, make a session of those of one; "
            "then add the others to its session.toml, each with its own fps. A film in slow motion is stamped with "
            "another rate than it was filmed at: stamp it anew (`ffmpeg -itsscale`), take the camera's original, or "
            "write its tracks with their true times."
        )
        what = "the time stamps of the files show another frame rate"
        found = f"{rate:g}; by their time stamps " + ", ".join(f"{hz} in {', '.join(n)}" for hz, n in off.items())
        raise InputError([Fault("--fps", "", what, found, "one frame rate within 5 %", next_step=step)])


def _trials(
    robot: RobotSpec,
    videos: Sequence[Path],
    tracks: Iterable[str | Path] | Mapping[str, Any],
    fps: float | None,
    rename: Mapping[str, str],
) -> tuple[dict[str, _Trial], list[str]]:
    """Collect the trials by name, with notes for the reader; a video and tracks of one name are one trial."""
    found: dict[str, _Trial] = {}
    films, notes = without_copies(videos)
    given = [*tracks.items()] if isinstance(tracks, Mapping) else [(str(path), path) for path in tracks]
    if odd := [type(path).__name__ for _, path in given if not (isinstance(path, str | Path) or is_dataset(path))]:
        expected = "paths of files, or datasets of movement by the names of their trials: tracks={'slow': dataset}"
        raise InputError([Fault("tracks", "", "neither files nor datasets", ", ".join(odd), expected)])
    if not isinstance(tracks, Mapping) and any(is_dataset(path) for _, path in given):
        expected = "a name of a trial for each: tracks={'slow': dataset}"
        raise InputError([Fault("tracks", "", "datasets have no names", f"{len(given)} in a list", expected)])
    film_names, track_names = trial_names(films, [Path(str(name)) for name, _ in given], isinstance(tracks, Mapping))
    faults = FaultCollector("the files")
    for name, path in zip(film_names, films, strict=True):
        with faults.nested():
            trial = found.setdefault(name, _Trial(name))
            _look_at(trial, path, fps)
    read: dict[str, ForeignTracks] = {}
    for name, (_, tracked) in zip(track_names, given, strict=True):
        found.setdefault(name, _Trial(name))
        with faults.nested():
            read[name] = _read_tracks(name, tracked, robot)
    if read and len(read) == len(given):
        _check_renamed(rename, [*read.values()], faults)
    for name, foreign in read.items():
        with faults.nested():
            _take_tracks(found[name], foreign, robot, fps, rename)
    if not found and not faults:
        faults.add("", "no video and no tracks", expected="at least one of --videos, --tracks")
    faults.raise_if_any()
    return found, notes


def _look_at(trial: _Trial, path: Path, fps: float | None) -> None:
    """Take in a video; an `InputError` where it is too short or has no clock that can be believed."""
    with Video(path, fps=fps) as video:
        info = video.info
    faults = FaultCollector(str(path))
    if info.frames < FEWEST_FRAMES:
        expected = f"a film of at least {FEWEST_FRAMES} frames"
        faults.add("", "too short", found=f"{info.frames} frame", expected=expected, next_step="Leave it out.")
    if not info.has_clock and not fps:
        what, step = "the file has no time", "Add `--fps 60`, with the rate at which the camera filmed."
        faults.add("", what, found=f"{info.frames} frames", expected="the frame rate of the camera", next_step=step)
    faults.raise_if_any()
    trial.video = path
    if info.has_clock:
        trial.time_s = info.time_s
    size = f"{info.width_px} x {info.height_px} px"
    usual = _rate(info.time_s) if info.has_clock and info.frames > 1 else info.fps
    rate = f"{usual:.4g} frames a second" if info.has_clock else f"{fps:g} frames a second, as given"
    trial.comments.append(f"{in_a_line(path)}: {info.frames} frames, {size}, {rate}")
    if not info.is_square:
        trial.comments.append(f"stored with pixels {info.pixel_aspect:.3f} times as wide as high, made square")


def is_dataset(given: object) -> bool:
    """Tell whether this is a dataset of xarray."""
    return hasattr(given, "data_vars")


def _read_tracks(trial: str, given: Any, robot: RobotSpec) -> ForeignTracks:
    """Read a file or a dataset of tracks, under its own names."""
    if is_dataset(given):
        return from_movement(given, f"dataset {trial}")
    return read_foreign(Path(given), _markers(robot))


def _check_renamed(rename: Mapping[str, str], read: Sequence[ForeignTracks], faults: FaultCollector) -> None:
    """Add a fault for the names to rename that none of the files has: each program has names of its own."""
    every = dict.fromkeys(name for each in read for name in each.names)
    if unused := [name for name in rename if name not in every]:
        theirs = "; ".join(f"{Path(each.file).name} has {', '.join(each.names)}" for each in read)
        what, step = "no file has this name to rename", did_you_mean(unused[0], every)
        faults.add("--rename", what, found=", ".join(unused), expected=f"a name of a file: {theirs}", next_step=step)


def _take_tracks(
    trial: _Trial, found: ForeignTracks, robot: RobotSpec, fps: float | None, rename: Mapping[str, str]
) -> None:
    """Take in tracks with the robot's markers in them; of the names to rename each file may lack some."""
    if not fps and trial.time_s is not None:
        fps = _rate(trial.time_s)  # tracks without time take the clock of their own video
    rename = {theirs: ours for theirs, ours in rename.items() if theirs in found.names}
    markers, others = _markers_in(found, robot, rename)
    own = found.tracks(markers, fps, FaultCollector(found.file), rename)
    trial.tracks, timed = own, found.time_s is not None
    if trial.time_s is None and timed:
        trial.time_s = own.time.values
    if trial.time_s is None and fps is None:
        trial.time_s = own.time.values
    frames = f"{own.sizes['time']} frames, {np.ptp(own.time.values):.1f} s"
    trial.comments.append(f"{in_a_line(Path(found.file))}: tracks, {frames}")
    if others:
        trial.notes.append(f"left out, as {robot.name} has no such markers: {', '.join(others)}")
    if question := _ask_unit(own, robot):
        trial.questions.append(question)


def _markers_in(found: ForeignTracks, robot: RobotSpec, rename: Mapping[str, str]) -> tuple[tuple[str, ...], list[str]]:
    """Find the robot's markers in a file, in its order, and what else it tracks.

    The markers are all usual ones where names differ.
    """
    names, usual = found.renamed(rename), _markers(robot)
    markers = tuple(name for name in names if name in robot.markers)
    others = [name for name in names if name not in robot.markers]
    lacking = [name for name in usual if name not in markers]
    too_few = len(markers) < FEWEST_MARKERS or not set(HEAD_MARKERS) <= set(markers)
    return (usual if too_few or (lacking and others) else markers), others


def _ask_unit(tracks: xr.Dataset, robot: RobotSpec) -> str:
    """Ask whether places are pixels where nose and neck are as many apart as units on the robot; else empty."""
    position = pixels_of(tracks)
    nose, neck = (markers_of(tracks).index(name) for name in HEAD_MARKERS)
    apart = np.linalg.norm(position[:, nose] - position[:, neck], axis=1)
    apart_px = float(np.median(apart[np.isfinite(apart)])) if np.isfinite(apart).any() else np.nan
    for unit, a_metre in (("mm", 1e3), ("cm", 1e2), ("inches", 1 / 0.0254)):
        if abs(apart_px / (a_metre * robot.scale_length_m) - 1) < UNIT_OFF:
            return f"nose to neck is {apart_px:.1f} px long, as many as {unit} on the robot: are these pixels?"
    if bool((position < -1).any()):
        return "some places are negative, outside any picture: are these pixels of the picture?"
    return ""


def _common_markers(trials: Mapping[str, _Trial], robot: RobotSpec) -> tuple[tuple[str, ...], list[str]]:
    """Find the markers that all tracks have, in the order of the first, and a note where some have more."""
    sets = {name: markers_of(trial.tracks) for name, trial in trials.items() if trial.tracks is not None}
    if not sets:
        return _markers(robot), []
    every = dict.fromkeys(marker for own in sets.values() for marker in own)
    common = tuple(marker for marker in every if all(marker in own for own in sets.values()))
    if len(common) < FEWEST_MARKERS or not set(HEAD_MARKERS) <= set(common):
        faults = FaultCollector("the tracks of all trials")
        check_names(tuple(every), common, "marker", faults)
        faults.raise_if_any()
    lost = [marker for marker in every if marker not in common]
    return common, [f"left out, as not all trials have them: {', '.join(lost)}"] if lost else []


def _markers(robot: RobotSpec) -> tuple[str, ...]:
    """Return the markers where no file names them: the published nine of a robot that has them, else all of
    the robot.
    """
    return FISHSIM_MARKERS if set(FISHSIM_MARKERS) <= set(robot.markers) else tuple(robot.markers)


def _command(trials: Mapping[str, _Trial], commands_hz: Sequence[float]) -> None:
    """Set the command of the motor in each trial, as given, else from the names."""
    driven = [trial for trial in trials.values() if trial.kind != "free_decay"]
    if commands_hz and len(commands_hz) != len(driven):
        given, names = f"{len(commands_hz)}", ", ".join(trial.name for trial in driven)
        raise InputError([Fault("--commands", "", "not one for each trial", given, f"{len(driven)}: of {names}")])
    for number, trial in enumerate(driven):
        found = next((match for pattern in _HZ if (match := re.search(pattern, trial.name.lower()))), None)
        if commands_hz:
            trial.commanded_hz = float(commands_hz[number])
            if not 0 < trial.commanded_hz < float("inf"):
                what, expected = "not a command", "crank turns a second above 0"
                raise InputError([Fault("--commands", "", what, f"{trial.commanded_hz:g}", expected)])
        elif found:
            trial.commanded_hz = float(f"{found[1]}.{found[2]}")


def _repeat(
    trials: Mapping[str, _Trial], like: Session, commanded: bool, fit: Sequence[str]
) -> tuple[Sequence[str], list[str]]:
    """Give trials the commands of another session's trials of the same name.

    Returns:
        The names of the trials to fit, and notes on trials without a counterpart.
    """
    known = {trial.name: trial for trial in like.trials}
    for name, trial in trials.items():
        if not commanded and name in known and known[name].kind == trial.kind:
            trial.commanded_hz = known[name].commanded_hz or trial.commanded_hz
    names = [name for name, trial in trials.items() if trial.kind == "swim"]
    alone = [name for name in names if name not in known]
    notes = [f"no trial of {like.name} has the name of {', '.join(alone)}: check commands and roles"] if alone else []
    lacking = [name for name, trial in known.items() if trial.kind == "swim" and name not in trials]
    if lacking:
        notes.append(f"{like.name} also has {', '.join(lacking)}: the same commands in both sessions compare best")
    return fit or [name for name in names if name not in known or known[name].role == "fit"], notes


def _put(source: Path, target: Path) -> None:
    """Put a video in its place: linked where the file system can, so that hours of it are not copied."""
    try:
        os.link(source.resolve(), target)  # resolved, so that it is no link to a link
    except OSError:
        shutil.copyfile(source, target)
