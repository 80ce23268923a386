"""The file `session.toml`: its tables and keys, with the camera, and its checks.

`SessionFile` and the tables in it give every key with the range of its value. The camera is a `CameraSpec`, its clock
and scale, with the `CameraCalibration` of its lens where there is one.

The functions `check_…` are about more than one value: names, files and what belongs together. Each works on the values
as read and passes over values of the wrong type, so that all faults of the file are reported together.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, StringConstraints

from swimcal.errors import FaultCollector, did_you_mean, shown
from swimcal.toml import Key, TomlSource, TomlTable, key_error, load_toml

if TYPE_CHECKING:
    from swimcal.robot import RobotSpec

# The camera.
Positive = Annotated[float, Field(gt=0)]
Distortion = tuple[float, float, float, float, float]

# The tables of `session.toml`.
TrialKind = Literal["free_decay", "dry", "swim"]
TrialRole = Literal["fit", "holdout"]

HEAD_MARKERS = ("nose", "neck")
"""The markers that make the head frame; every session needs them."""

FEWEST_MARKERS = 3
FASTEST_HZ = 15.0
"""Fastest crank, turns a second, as fast as Tunabot beats (Zhu et al., Sci. Robot. 4, 2019).

Larger numbers are taken for turns a minute.
"""

FileName = Annotated[str, StringConstraints(min_length=1)]

# The checks.
RECORDINGS = ("tracks", "video", "motor")
TRIAL_FILES = (*RECORDINGS, "boxes")
# A scale that is off by this factor is a mistake of unit.
OTHER_UNIT = 2.5
# Largest relative difference of frame rates. A coarse clock moves the median spacing, uneven frames the mean.
RATE_OFF = 0.05
# Largest distance of a step in time from a whole number of median steps, in median steps, for frames to be missing.
_EVEN = 0.25
# Least share of such steps: with fewer the clock is coarse or uneven.
_MOST = 0.9


class CameraCalibration(TomlTable):
    """A pinhole camera with OpenCV's lens distortion (`calibrateCamera`), looking down on the pool.

    Focal lengths and principal point are in px, the centre of the top left pixel at (0, 0); `distortion` is k1, k2, p1,
    p2, k3. The height is that of the lens above the water; without it no parallax is assumed.
    """

    width_px: int = Field(gt=0)
    height_px: int = Field(gt=0)
    fx_px: Positive
    fy_px: Positive
    cx_px: float
    cy_px: float
    distortion: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)
    height_above_water_m: Positive | None = None


@dataclass(frozen=True)
class CameraSpec:
    """The camera of a session, as its `session.toml` states it.

    Attributes:
        fps: nominal frames a second; a video's own time stamps win over it.
        scale_length_m: distance from nose to neck, the length that gives the scale.
        calibration: calibration of the lens; None where it was not calibrated.
        file: the file that the calibration came from.
    """

    fps: float
    scale_length_m: float
    calibration: CameraCalibration | None = None
    file: Path | None = None


def load_camera(path: Path) -> CameraCalibration:
    """Read a camera file: one table ``[camera]`` with the keys of `CameraCalibration`.

    Raises:
        InputError: every fault of the file at once.
    """
    return load_toml(path, _CameraFile).camera


class _CameraFile(TomlTable):
    camera: CameraCalibration


# The tables.


def _safe_name(name: str) -> str:
    """Check that a name can be part of a file's name on any system, and return it."""
    if len(name) > 100 or not re.fullmatch(r"[A-Za-z0-9_]([A-Za-z0-9_.-]*[A-Za-z0-9_-])?", name):
        raise key_error("not a usable name", expected="up to 100 letters, digits, _, - and . within, such as f1_00")
    return name


def _turns_a_second(hz: float) -> float:
    if hz > FASTEST_HZ:
        expected = f"crank turns a second, at most {FASTEST_HZ:g}"
        step = f"Turns a minute? Divide by 60: {hz / 60:.4g}."
        raise key_error("faster than a tail is driven", expected=expected, next_step=step)
    return hz


Name = Annotated[str, AfterValidator(_safe_name)]


class SessionTable(TomlTable):
    """The table ``[session]``."""

    name: Annotated[str, StringConstraints(min_length=1, max_length=200)]


class RobotTable(TomlTable):
    """The table ``[robot]``."""

    file: FileName


class CameraTable(TomlTable):
    """The table ``[camera]``."""

    fps: Positive
    scale_length_m: Positive
    calibration: FileName | None = None


class MarkersTable(TomlTable):
    """The table ``[markers]``."""

    names: Annotated[tuple[Name, ...], Field(min_length=FEWEST_MARKERS)]
    rename: Annotated[dict[str, str], Field(default_factory=dict)]


class FitTable(TomlTable):
    """The table ``[fit]``."""

    warmup_s: Annotated[float, Field(ge=0)] = 1.0
    seed: Annotated[int, Field(ge=0)] = 0


class TrialTable(TomlTable):
    """One table ``[[trial]]``."""

    name: Name
    kind: TrialKind
    tracks: FileName | None = None
    video: FileName | None = None
    boxes: FileName | None = None
    motor: FileName | None = None
    motor_offset_s: float = 0.0
    fps: Positive | None = None
    commanded_hz: Annotated[Positive, AfterValidator(_turns_a_second)] | None = None
    role: TrialRole = "fit"


class SessionFile(TomlTable):
    """All tables of ``session.toml``."""

    session: SessionTable
    robot: RobotTable | None = None
    camera: CameraTable
    markers: MarkersTable
    fit: FitTable = FitTable()
    trial: Annotated[tuple[TrialTable, ...], Field(min_length=1)]


# The checks.


def markers_in(source: TomlSource) -> tuple[str, ...]:
    """Return the marker names of the file that are text."""
    names = _table(source.data, "markers").get("names")
    return tuple(name for name in names if isinstance(name, str)) if isinstance(names, list) else ()


def trials_in(source: TomlSource) -> Iterator[tuple[Key, dict[str, Any]]]:
    """Yield the key and the content of each trial that is a table."""
    trials = source.data.get("trial")
    for number, trial in enumerate(trials if isinstance(trials, list) else ()):
        if isinstance(trial, dict):
            yield ("trial", number), trial


def check_files(source: TomlSource, folder: Path, faults: FaultCollector) -> None:
    """Check that every file that the session names is there."""
    named: list[tuple[Key, Any]] = [
        (("robot", "file"), _table(source.data, "robot").get("file")),
        (("camera", "calibration"), _table(source.data, "camera").get("calibration")),
    ]
    named += [((*key, kind), trial.get(kind)) for key, trial in trials_in(source) for kind in TRIAL_FILES]
    for key, name in named:
        if isinstance(name, str) and name and not is_file(folder / name):
            what, expected, hint = "the file is not there", "a file, its path relative to the session folder", ""
            if "\\" in name or any(ord(letter) < 32 for letter in name):
                hint = 'A backslash begins an escape in TOML: write the path with forward slashes, "trials/f1_30.csv".'
            if (folder / name).is_dir():
                what = "a folder, not a file"
            faults.add(source.where(key), what, found=shown(name), expected=expected, next_step=hint)


def check_trials(source: TomlSource, faults: FaultCollector, needs_commands: bool = True) -> None:
    """Check that trial names differ, that each trial has a recording, and that what belongs together is there together.

    Args:
        source: the file as read.
        faults: receives what is wrong.
        needs_commands: whether a driven trial needs its command, without which it can be tracked but not fitted.
    """
    trials = list(trials_in(source))
    names = [(key, trial["name"]) for key, trial in trials if isinstance(trial.get("name"), str)]
    _check_differ(source, [((*key, "name"), name) for key, name in names], "trial", faults)
    for key, trial in trials:
        if not any(kind in trial for kind in RECORDINGS):
            what, expected = "the trial has no recording", "at least one of them"
            faults.add(source.where(key), what, expected=expected, choices=RECORDINGS)
        if "boxes" in trial and "video" not in trial:
            faults.add(source.where((*key, "boxes")), "boxes without a video", expected='video = "…" next to them')
        if needs_commands and trial.get("kind") in ("swim", "dry") and "commanded_hz" not in trial:
            expected = f"crank turns a second, for a trial of kind {trial['kind']!r}"
            faults.add(source.where((*key, "commanded_hz")), "key is missing", expected=expected)


def check_scale(source: TomlSource, robot: RobotSpec | None, faults: FaultCollector) -> None:
    """Check that the scale length is about that of the robot; smaller differences become flags of the trials."""
    scale = _table(source.data, "camera").get("scale_length_m")
    if robot is None or not isinstance(scale, (int, float)) or not 0 < scale < float("inf"):
        return
    if not robot.scale_length_m / OTHER_UNIT < scale < robot.scale_length_m * OTHER_UNIT:
        what, step = "not the scale length of the robot", "Is it in metres, and is the robot right?"
        expected = f"about {robot.scale_length_m:.4g} m, from nose to neck of {robot.name}"
        where = source.where(("camera", "scale_length_m"))
        faults.add(where, what, found=f"{scale:g}", expected=expected, next_step=step)


def check_rates(
    source: TomlSource,
    fps: Mapping[str, float],
    stamps: Mapping[str, tuple[float, float]],
    faults: FaultCollector,
) -> None:
    """Check that the time stamps of tracks are in seconds, and within 5 % of their frame rate.

    Args:
        source: the file as read.
        fps: frames a second, as the session states it, by trial.
        stamps: median and mean spacing of the time stamps, s, by trial. Errors of a coarse clock show in the mean,
            missing frames in the median.
        faults: receives what is wrong.
    """
    off: dict[str, list[str]] = {}
    for name, (median_s, mean_s) in stamps.items():
        if rate_is_off(fps[name], median_s, mean_s):
            off.setdefault(f"{1 / mean_s:.4g}", []).append(name)
    if off:
        stated = ", ".join(dict.fromkeys(f"{fps[name]:g}" for names in off.values() for name in names))
        step = "Which of them is right? Correct the other: frequencies and speeds go by it."
        if sum(map(len, off.values())) < len(stamps):
            rate, names = next(iter(off.items()))
            step += f" If both are, write fps = {rate} into the [[trial]] of {', '.join(names)}."
        rates = "; ".join(f"{rate} in {', '.join(names)}" for rate, names in off.items())
        faults.add(
            source.where(("camera", "fps")),
            "the time stamps of tracks show another frame rate",
            found=f"{stated}; by their time_s {rates}",
            expected="1 / the spacing of time_s, within 5 %",
            next_step=step,
        )


def usual_spacing_s(time_s: np.ndarray) -> tuple[float, float]:
    """Compute the median and the mean spacing of time stamps (n,), s; frames that are missing between two count."""
    spacing_s = np.diff(time_s)
    median_s = float(np.median(spacing_s))
    if median_s <= 0:
        return median_s, float(np.mean(spacing_s))
    frames = np.rint(spacing_s / median_s)
    even = (frames >= 1) & (np.abs(spacing_s / median_s - frames) <= _EVEN)
    return median_s, float(spacing_s.sum() / (frames.sum() if even.mean() >= _MOST else len(frames)))


def rate_is_off(fps: float, median_s: float, mean_s: float) -> bool:
    """Tell whether both the median and the mean spacing of time stamps show another frame rate.

    Args:
        fps: frames a second of the camera, as stated.
        median_s: median spacing of the time stamps, s.
        mean_s: mean spacing of the time stamps, s.
    """
    return min(abs(1 / (each * fps) - 1) for each in (median_s, mean_s)) > RATE_OFF


def check_markers(source: TomlSource, robot: RobotSpec | None, faults: FaultCollector) -> None:
    """Check that marker names differ, include the head markers, and belong to the robot, where it is known."""
    names = markers_in(source)
    if not names:
        return  # the validation of the file already reports this
    keys: list[Key] = [("markers", "names", number) for number in range(len(names))]
    _check_differ(source, list(zip(keys, names, strict=True)), "marker", faults)
    for marker in (marker for marker in HEAD_MARKERS if marker not in names):
        expected = "nose and neck among the markers: they make the head frame"
        faults.add(source.where(("markers", "names")), f"marker {marker!r} is missing", expected=expected)
    for key, name in zip(keys, names, strict=True):
        if robot is not None and name not in robot.markers:
            what, expected, known = "a marker that the robot does not have", "markers of the robot", robot.markers
            hint = did_you_mean(name, known)
            faults.add(source.where(key), what, found=shown(name), expected=expected, choices=known, next_step=hint)


def check_heads(source: TomlSource, exchanged: Mapping[str, bool], faults: FaultCollector) -> None:
    """Check that nose and neck are not exchanged in all trials; a single trial of several is left out later.

    Args:
        source: the file as read.
        exchanged: whether nose and neck are exchanged, by trial.
        faults: receives what is wrong.
    """
    if not exchanged or not all(exchanged.values()):
        return
    expected = "the markers of the tail on the neck's side, as on the robot"
    if len(exchanged) > 1:
        found = f"in every trial ({', '.join(exchanged)}) the markers of the tail on the nose's side"
        step = "Exchange the two names: here for tracks without a header, else in the headers of the tracks."
        what = "nose and neck are exchanged"
        faults.add(source.where(("markers", "names")), what, found=found, expected=expected, next_step=step)
        return
    for key, trial in trials_in(source):
        if trial.get("name") in exchanged:
            what = f"nose and neck are exchanged in trial {trial['name']}"
            step = "Exchange the two names in the header of its tracks, or without a header their columns."
            found = "the markers of the tail on the nose's side"
            faults.add(source.where((*key, "tracks")), what, found=found, expected=expected, next_step=step)


def is_file(path: Path) -> bool:
    """Return whether there is a file; False too for a text that cannot be a path at all."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _check_differ(source: TomlSource, named: Iterable[tuple[Key, str]], noun: str, faults: FaultCollector) -> None:
    """Check that no name is used twice; names that differ in case only would share a file on some systems."""
    first: dict[str, Key] = {}
    for key, name in named:
        earlier = first.setdefault(name.casefold(), key)
        if earlier != key:
            found, expected = f"{shown(name)}, as in {source.where(earlier)}", f"a name of its own for each {noun}"
            faults.add(source.where(key), f"two {noun}s of one name", found=found, expected=expected)


def _table(data: dict[str, Any], name: str) -> dict[str, Any]:
    table = data.get(name)
    return table if isinstance(table, dict) else {}
