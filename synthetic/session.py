"""A synthetic session: the twin swims, a camera and a faulty tracker look on, the truth is kept beside it."""

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from session import Tracks, load_session, new_folder, save_tracks, write_session_toml, write_whole
from synthetic.faults import with_faults
from synthetic.filmed import Progress, SessionVideo, film_scene, true_tracks
from synthetic.noise import NOISELESS, lasting_errors, on_grid, placement_offsets
from synthetic.plan import SyntheticPlan, SyntheticTrial
from synthetic.swims import TrueSwim, simulate_swims
from synthetic.truth import TrialTruth, write_truth
from synthetic.video import boxes_file, save_boxes, write_scene

ROBOT_FILE, CAMERA_FILE = "robot.toml", "camera.toml"
_DECIMALS_PX, _DECIMALS_S = 2, 6


def make_session(
    folder: Path, plan: SyntheticPlan, video: SessionVideo | None = None, told: Progress = lambda *_: None
) -> Path:
    """Makes a session folder with known truth: `session.toml`, packed tracks or videos, `truth.json`.

    The swims come from the twin at a finer time step than a fit uses, from the middle of a developed swim.
    Each trial draws from a stream of its own, so that changing one leaves the others as they are. The same
    plan gives the same bytes on the same engine.

    A filmed trial has `trials/<name>.mp4`, start boxes beside it, and what a perfect tracker would find as
    `truth/<name>.csv`. The plan's noise and faults, which are a tracker's, do not apply to it.

    Args:
        folder: new or empty.
        plan: what to make.
        video: how to film, and which trials; None for tracks alone.
        told: of the progress of the videos.

    Returns:
        The folder.

    Raises:
        session.InputError: the folder is not empty, or a swim leaves the image.
        session.ResultsNotWritable: the folder cannot be written.
        session.SimulationDiverged: the planned motion is unstable.
        ValueError: a trial to be filmed is not in the plan.
    """
    if video is not None:
        plan = _without_tracker(plan, video)
    swims = simulate_swims(plan)
    with new_folder(folder) as part:
        truths = {}
        for number, swim in enumerate(swims):
            if video is not None and video.films(swim.trial.name):
                _film(part, swim, plan, video, number, told)
                offsets_px = np.zeros((len(plan.markers), 2))
            else:
                tracks, offsets_px = _tracked(swim, plan, np.random.default_rng([plan.seed, number]))
                _save_packed(part / _track_file(swim.trial.name), tracks)
            truths[swim.trial.name] = _truth(swim, plan, offsets_px)
        _write_description(part, plan, video)
        write_truth(part, plan, truths)
        load_session(part)
    return folder


def _without_tracker(plan: SyntheticPlan, video: SessionVideo) -> SyntheticPlan:
    """The plan without the errors of a tracker in the trials that are filmed."""
    names = [trial.name for trial in plan.trials]
    if unknown := sorted(set(video.trials or ()) - set(names)):
        raise ValueError(f"trials to film: found {', '.join(unknown)}, expected some of {', '.join(names)}")
    trials = tuple(t.model_copy(update={"faults": ()}) if video.films(t.name) else t for t in plan.trials)
    noise = NOISELESS if all(map(video.films, names)) else plan.noise
    return plan.model_copy(update={"trials": trials, "noise": noise})


def _film(folder: Path, swim: TrueSwim, plan: SyntheticPlan, video: SessionVideo, number: int, told: Progress) -> None:
    name, frames = swim.trial.name, len(swim.time_s)
    path = folder / _video_file(name)
    scene = film_scene(swim, plan, video, number)
    save_tracks(folder / "truth" / f"{name}.csv", true_tracks(scene.truth))
    save_boxes(boxes_file(path), scene.truth)
    write_scene(scene, {path: video.encoding}, lambda done: told(name, done, frames))


def _tracked(swim: TrueSwim, plan: SyntheticPlan, random: np.random.Generator) -> tuple[Tracks, np.ndarray]:
    """The tracks of a swim, and (m, 2) where its boxes sit on their markers, px."""
    noise = plan.noise
    offsets_px = placement_offsets(len(plan.markers), noise, random)
    errors_px = lasting_errors(swim.position_px.shape, 1 / plan.camera.fps, noise, random)
    boxes_px = with_faults(swim.position_px + offsets_px + errors_px, plan.markers, swim.trial.faults)
    position_px = np.round(on_grid(boxes_px, noise), _DECIMALS_PX)
    confidence = np.isfinite(position_px).all(axis=2).astype(float)
    return Tracks(plan.markers, np.round(swim.time_s, _DECIMALS_S), position_px, confidence), offsets_px


def _truth(swim: TrueSwim, plan: SyntheticPlan, offsets_px: np.ndarray) -> TrialTruth:
    offsets = [(round(float(x), 3), round(float(y), 3)) for x, y in offsets_px]
    return TrialTruth(
        frequency_hz=swim.frequency_hz,
        phase_rad=swim.phase_rad,
        speed_m_s=swim.speed_m_s,
        placement_px=dict(zip(plan.markers, offsets, strict=True)),
    )


def _track_file(trial: str) -> str:
    return f"trials/{trial}.csv.gz"


def _video_file(trial: str) -> str:
    return f"trials/{trial}.mp4"


def _save_packed(path: Path, tracks: Tracks) -> None:
    """Writes tracks as .csv.gz without name or time of the file: the same tracks give the same bytes."""
    plain = path.with_suffix("")
    save_tracks(plain, tracks)
    write_whole(path, gzip.compress(plain.read_bytes(), mtime=0))
    plain.unlink()


def _write_description(folder: Path, plan: SyntheticPlan, video: SessionVideo | None) -> None:
    if plan.robot is not None:
        write_whole(folder / ROBOT_FILE, tomlkit.dumps(plan.robot.model_dump()))
    lens = video.optics(plan).camera.lens if video is not None and video.calibrated else None
    if lens is not None:
        write_whole(folder / CAMERA_FILE, tomlkit.dumps({"camera": lens.model_dump(exclude_none=True)}))
    write_session_toml(
        folder,
        name=plan.name,
        camera={
            "fps": plan.camera.fps,
            "scale_length_m": round(plan.swimmer.scale_length_m, 9),
            "calibration": None if lens is None else CAMERA_FILE,
        },
        markers=plan.markers,
        trials=[_trial_table(trial, video) for trial in plan.trials],
        fit={"warmup_s": plan.warmup_s},
        robot_file=None if plan.robot is None else ROBOT_FILE,
    )


def _trial_table(trial: SyntheticTrial, video: SessionVideo | None) -> dict[str, Any]:
    """The keys of `[[trial]]`."""
    filmed = video is not None and video.films(trial.name)
    path = Path(_video_file(trial.name))
    recording = (
        {"video": path.as_posix(), "boxes": boxes_file(path).as_posix()}
        if filmed
        else {"tracks": _track_file(trial.name)}
    )
    return {
        "name": trial.name,
        "kind": "swim",
        **recording,
        "commanded_hz": trial.commanded_hz,
        "role": trial.role,
    }
