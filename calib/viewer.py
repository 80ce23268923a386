"""The recording that `calib view` shows: videos, tracks, and once there is a fit, the twin and the missing forces."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import xarray as xr

from calib.pipeline import Pipeline
from calib.progress_bar import is_kernel
from diagnosis.result import MissingForces
from fitting.calibration import CalibratedTrial
from fitting.phase import residuals
from reports.recorded_trial import MissingOverTime, RecordedTrial
from reports.recording import APPLICATION, make_proxy, write_recording
from swimcal.errors import NotEnoughData, SwimcalError
from swimcal.session import TrialSpec
from swimcal.stage import Stage
from swimcal.tracks import load_tracks, pixels_of
from tracking.quality import check_tracks
from tracking.tracked import as_tracked
from tracking.video import Video


def make_recording(pipeline: Pipeline) -> Path:
    """Make ``results/session.rrd`` anew from the current tracks; a fit is shown if it is current.

    Raises:
        InputError: tracks or a video cannot be read.
        NotEnoughData: no trial has tracks.
    """
    session, path = pipeline.session, pipeline.session.results / "session.rrd"
    specs = [spec for spec in session.trials if spec.tracks is not None or spec.video is not None]
    if not specs:
        raise NotEnoughData(
            f"{session.name}: nothing to show. Expected at least one [[trial]] with a tracks file or a video; found "
            f"{len(session.trials)} trials. {' '.join(pipeline.recordings.notes)}"
        )
    untracked = [spec for spec in specs if spec.tracks is None and not pipeline.recordings.videos.are_current(spec)]
    renew = f"run `calib track {session.in_shell}`"
    if len(untracked) == len(specs):
        raise NotEnoughData(
            f"{session.name}: nothing to show. Expected tracks; found videos that are not tracked: {renew}."
        )
    if untracked:
        names = ", ".join(spec.name for spec in untracked)
        pipeline.notes.append(f"Not shown, for their tracks are missing or out of date: {names}; {renew}.")
    specs = [spec for spec in specs if spec not in untracked]
    fit = None if untracked else pipeline.current_fit
    calibration = None if fit is None else fit.read()
    if calibration is None and not untracked and pipeline.fits.file.is_file():
        pipeline.notes.append(
            f"{pipeline.fits.file} is out of date, not shown: it is {pipeline.outdated_fit}; "
            f"run `calib fit {session.in_shell}`."
        )
    fitted = {} if calibration is None else {trial.measured.name: trial for trial in calibration.trials}
    stage = pipeline.current_diagnosis()
    forces = None if stage is None else stage.read().missing_forces
    trials = [_record_trial(pipeline, spec, fitted.get(spec.name), forces) for spec in specs]
    pipeline.options.progress("writing the recording", None)
    write_recording(path, trials, session.name)
    pipeline.made.append(path)
    return path


def open_viewer(recording: Path) -> None:
    """Start the viewer that was installed with this program, else the one on the path, without waiting for it.

    Raises:
        SwimcalError: there is none, no display, or it cannot be started.
    """
    scripts = str(Path(sys.executable).parent)
    viewer = shutil.which("rerun", path=scripts) or shutil.which("rerun")
    if viewer is None:
        raise _not_opened(recording, f"no command `rerun` in {scripts} or on the path")
    if not _has_display():
        raise SwimcalError(
            f"no display here (DISPLAY and WAYLAND_DISPLAY are not set): copy {recording} to a computer with a screen "
            f"and run `rerun {recording.name}` there, or run `{viewer} --serve-web {recording}` here and open the "
            "address that it prints in a browser."
        )
    try:
        subprocess.Popen([viewer, str(recording)], start_new_session=True)
    except OSError as error:
        raise _not_opened(recording, f"{viewer}: {error.strerror or error}") from error


def _has_display() -> bool:
    """Return whether a window can be opened; other systems than Linux always have a desktop."""
    return not sys.platform.startswith("linux") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))


def show_inline(recording: Path) -> str:
    """Show a recording in the output of a notebook's cell; return a sentence that says why where it cannot, else ""."""
    from rerun import RecordingStream
    from rerun.notebook import HAS_NOTEBOOK, Viewer

    if not (HAS_NOTEBOOK and is_kernel()):
        needs = "a notebook" if HAS_NOTEBOOK else "the package rerun-notebook (`pip install 'rerun-sdk[notebook]'`)"
        return f"Not shown inline, which needs {needs}; open {recording} in the Rerun viewer."
    stream = RecordingStream(APPLICATION)
    Viewer(recording=stream, width="auto").display()
    stream.log_file_from_path(recording)
    stream.flush()
    return ""


def _record_trial(
    pipeline: Pipeline, spec: TrialSpec, fitted: CalibratedTrial | None, forces: MissingForces | None = None
) -> RecordedTrial:
    session = pipeline.session
    picture: tuple[int, int] | None = None
    proxy: Path | None = None
    if spec.tracks is not None:
        fps = session.camera_of(spec).fps
        tracks = load_tracks(spec.tracks, session.markers, fps, rename=session.rename, seen=False)
        tracked = as_tracked(tracks, check_tracks(tracks, pipeline.job.robot).flags)
    else:
        tracked = pipeline.recordings.videos.tracks(spec)
    if spec.video is not None:
        with Video(spec.video, pipeline.options.workers) as video:
            picture, frames = (video.info.width_px, video.info.height_px), video.info.frames
        proxy = _make_proxy(pipeline, spec.name, spec.video, frames)
    if fitted is None:
        return RecordedTrial(spec.name, tracked, proxy, picture)
    first = tracked.first_frame + fitted.measured.first_frame
    twin_px, residual_mm = _place_twin(fitted, tracked, first)
    missing = None if forces is None else MissingOverTime.of(forces, fitted, tracked.sizes["time"], first)
    more = tuple(flag for flag in fitted.flags if flag not in tracked.flags)
    tracked = tracked.assign_attrs(flags=(*tracked.flags, *more))
    metrics: dict[str, float | str] = {
        "role": fitted.measured.role,
        "frequency_hz": fitted.measured.frequency.hz,
        "marker_error_mm": 1000 * fitted.scores.marker_error_m,
        "speed_measured_m_s": fitted.measured.speed,
        "speed_twin_m_s": fitted.speed_twin,
    }
    return RecordedTrial(spec.name, tracked, proxy, picture, twin_px, residual_mm, metrics, missing)


def _make_proxy(pipeline: Pipeline, trial: str, video: Path, frames: int) -> Path:
    """Make a small copy of the video, again when the video changed."""
    path = pipeline.session.results / "tracking" / f"{trial}.proxy.mp4"
    proxy = Stage(path, {"video": pipeline.recordings.videos.sha256(video)}, {"proxy": 1})
    if not proxy.is_current:
        make_proxy(video, path, progress=lambda done: pipeline.job.progress(f"copying {trial} small", done / frames))
        proxy.mark()
    return path


def _place_twin(fitted: CalibratedTrial, tracked: xr.Dataset, first: int) -> tuple[np.ndarray, np.ndarray]:
    """Compute the twin's markers in the picture (n, m, 2), px, and their distance (n, m), mm.

    Nan before the kept frames.

    The difference from the measured marker in the head frame, turned by the measured heading, at the trial's scale.
    """
    trial = fitted.measured
    kept = np.zeros(tracked.sizes["time"], bool)
    kept[first : first + len(trial.kept)] = trial.kept
    difference_m = residuals(trial, fitted.simulated, trial.kept)  # (k, m, 2)
    heading = trial.head.heading_rad[trial.kept][:, None]
    cos, sin = np.cos(heading), np.sin(heading)
    x = cos * difference_m[..., 0] - sin * difference_m[..., 1]
    y = sin * difference_m[..., 0] + cos * difference_m[..., 1]
    twin_px = np.full(pixels_of(tracked).shape, np.nan)
    twin_px[kept] = pixels_of(tracked)[kept] + np.stack([x, -y], axis=-1) / trial.metres_per_px
    residual_mm = np.full(tracked.state.shape, np.nan)
    counts = trial.weight[trial.kept] > 0
    residual_mm[kept] = np.where(counts, 1000 * np.linalg.norm(difference_m, axis=-1), np.nan)
    return twin_px, residual_mm


def _not_opened(recording: Path, found: str) -> SwimcalError:
    return SwimcalError(
        f"the viewer cannot be opened; found: {found}; expected: the viewer of the package rerun-sdk. "
        f"Install it with `pip install rerun-sdk`, or open {recording} on another machine."
    )
