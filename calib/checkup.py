"""Checks whether an installation, a session and a motor are ready, and what to do where they are not."""

import os
import platform
import shutil
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import NamedTuple

import numpy as np
from packaging.requirements import Requirement

from calib.options import Options
from calib.pipeline import Pipeline, open_session
from calib.stages.recordings import AnyTrial, Recordings
from fitting.dry_run import DryTrial
from fitting.free_decay import DecayTrial
from fitting.left_out import MARKERS_OFF, STILL_M_S
from fitting.phase import speed_from_rest
from reports.words import counted
from swimcal.errors import SwimcalError
from swimcal.mjcf import PUBLISHED_COEFFICIENTS
from swimcal.results import program_version
from swimcal.robot import load_robot
from swimcal.robot_doubts import robot_doubts
from swimcal.runs import ENGINE
from swimcal.session import Session
from swimcal.twin import Twin
from tracking.video import Video

_LEAST_BYTES = 1e9  # free space needed for results with a recording
_FEWEST_FIT = 2  # recommended number of fit trials; a third allows cross-validation


class Check(NamedTuple):
    """One thing that was checked."""

    check: str
    state: str  # "ok", "advice" or "fault"
    found: str
    step: str = ""  # what to do


def check_installation() -> Iterator[Check]:
    """Check packages, engine, codecs, viewer and cores."""
    where = f"Python {platform.python_version()} on {platform.system()}"
    yield Check("program", "ok", f"{program_version()}, {where}, {os.cpu_count()} cores")
    wrong = [problem for line in requires("swimcal") or () if (problem := _unmet(Requirement(line)))]
    step = "Install again: `make demo`, or `pip install --force-reinstall` of these."
    yield Check("packages", "fault", "; ".join(wrong), step) if wrong else Check("packages", "ok", "as required")
    yield _engine()
    yield _codecs()
    viewer = shutil.which("rerun", path=str(Path(sys.executable).parent)) or shutil.which("rerun")
    step = "Install rerun-sdk, or open results/session.rrd on another machine."
    yield Check("viewer", "ok", viewer) if viewer else Check("viewer", "advice", "no command `rerun`", step)


def check_session(folder: Path) -> Iterator[Check]:
    """Check the description, recordings, results and disk of a session."""
    try:
        session = open_session(folder, needs_commands=False)
    except SwimcalError as problem:
        yield Check("session", "fault", str(problem), "Correct this, then run `calib doctor` again.")
        return
    yield Check("session", "ok", f"{session.name}, {counted(len(session.trials), 'trial')}")
    pipeline = Pipeline(session, Options())
    if doubts := robot_doubts(pipeline.job.robot):
        yield Check("robot", "advice", " ".join(doubts), "Look at it: `calib robot FILE`.")
    yield from _trials(session)
    yield from _films(session)
    yield _disk(session)
    yield from _recorded(pipeline.recordings)
    try:
        yield Check("results", "ok", pipeline.standing)
    except SwimcalError as problem:
        yield Check("results", "advice", str(problem))


def check_motor() -> Iterator[Check]:
    """Check for the motor on any serial port."""
    from calib.capture.trials import BAUD_ORDER, PORT_PATTERNS, ports, search

    names = ports()
    if not names:
        step = "Plug in the adapter (U2D2)."
        yield Check("motor", "fault", f"no serial port among {', '.join(PORT_PATTERNS)}", step)
        return
    warnings: list[str] = []
    found = search(names, BAUD_ORDER, lambda line: warnings.append(line) if line.startswith("warning") else None)
    ours = [motor.describe() for motor in found if motor.is_ours]
    step = "Has it power (12 V)? Is its cable plugged in at both ends? Are you in the group `dialout`?"
    seen = "; ".join([*(motor.describe() for motor in found), *warnings]) or f"no answer on {', '.join(names)}"
    yield Check("motor", "ok", "; ".join(ours)) if ours else Check("motor", "fault", seen, step)


def _unmet(needed: Requirement) -> str:
    if needed.marker is not None and not needed.marker.evaluate():
        return ""
    try:
        there = version(needed.name)
    except PackageNotFoundError:
        return f"{needed.name} is missing"
    fits = needed.specifier.contains(there, prereleases=True)
    return "" if fits else f"{needed.name} {there}, not {needed.specifier}"


def _engine() -> Check:
    try:
        hz, water = np.ones(1), np.array([PUBLISHED_COEFFICIENTS])
        speed = float(speed_from_rest(Twin(load_robot()), water, hz)[0, 0])
    except Exception as problem:  # the user has to know of any error
        return Check("engine", "fault", f"MuJoCo {ENGINE}: {problem}", "Install MuJoCo again.")
    return Check("engine", "ok", f"MuJoCo {ENGINE}, the twin swims at {speed:.3f} m/s")


def _codecs() -> Check:
    import av
    import cv2

    lacking = [name for name in ("h264", "hevc") if name not in av.codecs_available]
    if not hasattr(cv2, "TrackerCSRT_create") and not hasattr(cv2, "TrackerCSRT"):
        lacking.append("CSRT of OpenCV")
    step = "Install av and opencv-contrib-python-headless; remove other packages of OpenCV."
    found = f"lacks {', '.join(lacking)}"
    return Check("video", "fault", found, step) if lacking else Check("video", "ok", "H.264, HEVC, CSRT")


def _trials(session: Session) -> Iterator[Check]:
    swims = [trial for trial in session.trials if trial.kind == "swim"]
    fitted, held = ([trial for trial in swims if trial.role == role] for role in ("fit", "holdout"))
    found = f"{len(fitted)} to fit, {len(held)} held out"
    advice = []
    if len(fitted) < _FEWEST_FIT:
        advice.append("Two fit trials at different speeds determine far more than one; three cross-validate effects.")
    if not held:
        advice.append('Give a trial role = "holdout": without one the quality of forecasts is not known.')
    if swims and not fitted:
        yield Check("swim trials", "fault", found, 'Give the trials to be fitted role = "fit".')
    else:
        yield Check("swim trials", "advice" if advice else "ok", found, " ".join(advice))
    unsaid = [trial.name for trial in session.trials if trial.kind in ("swim", "dry") and trial.commanded_hz is None]
    if unsaid:
        step = (
            "Give commanded_hz, crank turns a second, in session.toml: without it these can be tracked, but not fitted."
        )
        yield Check("commands", "fault", f"no commanded_hz: {', '.join(unsaid)}", step)
    bare = [trial.name for trial in session.trials if trial.tracks is None and trial.video is None]
    if bare:
        yield Check("recordings", "advice", f"neither tracks nor video: {', '.join(bare)}", "These are left out.")
    kinds = {trial.kind for trial in session.trials}
    missing = [words for kind, words in (("free_decay", "free decay"), ("dry", "dry run")) if kind not in kinds]
    if missing:
        step = "Hinges or crank arm are assumed as described; film these in air (docs/bench.md)."
        yield Check("dry experiments", "advice", f"no {' and no '.join(missing)}", step)
    if session.camera.calibration is None:
        yield Check("lens", "advice", "not calibrated", "See `calib camera` and docs/tracking.md.")


def _films(session: Session) -> Iterator[Check]:
    """Check that each film whose trial has no tracks can be read."""
    for trial in session.trials:
        if trial.video is None or trial.tracks is not None:
            continue
        try:
            with Video(trial.video, fps=session.camera_of(trial).fps) as video:
                info = video.info
        except SwimcalError as problem:
            yield Check(f"film {trial.name}", "fault", str(problem), "Copy it from the camera again.")
            continue
        found = (
            f"{len(info.time_s)} frames, {info.fps:.4g} a second, {info.width_px} by {info.height_px} px, {info.codec}"
        )
        tracked = (session.results / "tracks" / f"{trial.name}.csv").is_file()
        step = "" if tracked else f"Its markers are not tracked: `calib track {session.in_shell}` shows them."
        found += f"; {info.damage}" if info.damage else ""
        yield Check(f"film {trial.name}", "ok" if tracked and not info.damage else "advice", found, step)


_IN_WORDS = {"swim": "swim", "dry": "dry run", "free_decay": "free decay"}


def _recorded(recordings: Recordings) -> Iterator[Check]:
    """Check what can be measured of each trial that is given by tracks; advice that many share comes once."""
    shared: dict[str, list[str]] = {}
    for spec, trial in recordings.look_at_trials():
        kind = _IN_WORDS[spec.kind]
        if isinstance(trial, str):
            step = f"A fit goes on without it, if it has others. Is it a {kind}, as session.toml says?"
            yield Check(f"{kind} {spec.name}", "fault", trial, step)
            continue
        yield Check(f"{kind} {spec.name}", *_describe(trial))
        of_all = [flag for flag in trial.flags if flag.kind == MARKERS_OFF or not (flag.markers or flag.frames)]
        for message in dict.fromkeys(flag.message for flag in of_all):
            shared.setdefault(message, []).append(spec.name)
    for message, names in shared.items():
        yield Check(f"flag of {', '.join(names)}", "advice", message, "See docs/reference/flags.md.")


def _describe(trial: AnyTrial) -> tuple[str, str, str]:
    """Return the state of a measured trial, what was found and what to do."""
    if isinstance(trial, DecayTrial):
        return "ok", f"{np.ptp(trial.time_s):.1f} s from the release on", ""
    if isinstance(trial, DryTrial):
        return "ok", f"{trial.frequency.hz:.3g} Hz in {np.ptp(trial.time_s):.1f} s", ""
    beat, speed = f"{trial.frequency.hz:.3g} Hz", f"{round(1000 * trial.speed)} mm/s"
    still = abs(trial.speed) < STILL_M_S
    step = 'It stays where it is. If its head is clamped in air, it is a dry run: kind = "dry".' if still else ""
    return "advice" if still else "ok", f"{beat}, {speed}, {100 * trial.used_fraction:.0f} % of samples used", step


def _disk(session: Session) -> Check:
    folder = session.results if session.results.is_dir() else session.folder
    if not os.access(folder, os.W_OK):
        return Check("disk", "fault", f"{folder} is not writable", "Make it writable, or work on a copy.")
    free = shutil.disk_usage(folder).free
    step = "" if free > _LEAST_BYTES else "Make room: results with a recording take up to 1 GB."
    return Check("disk", "advice" if step else "ok", f"{free / 1e9:.0f} GB free", step)
