"""A synthetic session: the twin swims, a camera and a faulty tracker look on, the truth is kept beside it."""

import gzip
from pathlib import Path

import numpy as np
import tomlkit

from session import Tracks, load_session, new_folder, save_tracks, write_session_toml, write_whole
from synthetic.faults import with_faults
from synthetic.noise import lasting_errors, on_grid, placement_offsets
from synthetic.plan import SyntheticPlan
from synthetic.swims import TrueSwim, simulate_swims
from synthetic.truth import TrialTruth, write_truth

ROBOT_FILE = "robot.toml"
_DECIMALS_PX, _DECIMALS_S = 2, 6


def make_session(folder: Path, plan: SyntheticPlan) -> Path:
    """Makes a session folder with known truth: `session.toml`, packed tracks, `truth.json`.

    The swims come from the twin at a finer time step than a fit uses, from the middle of a developed swim.
    Each trial draws from a stream of its own, so that changing one leaves the others as they are. The same
    plan gives the same bytes on the same engine.

    Args:
        folder: new or empty.
        plan: what to make.

    Returns:
        The folder.

    Raises:
        session.InputError: the folder is not empty, or a swim leaves the image.
        session.ResultsNotWritable: the folder cannot be written.
        session.SimulationDiverged: the planned motion is unstable.
    """
    swims = simulate_swims(plan)
    with new_folder(folder) as part:
        truths = {}
        for number, swim in enumerate(swims):
            tracks, offsets_px = _tracked(swim, plan, np.random.default_rng([plan.seed, number]))
            _save_packed(part / _track_file(swim.trial.name), tracks)
            truths[swim.trial.name] = _truth(swim, plan, offsets_px)
        _write_description(part, plan)
        write_truth(part, plan, truths)
        load_session(part)
    return folder


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


def _save_packed(path: Path, tracks: Tracks) -> None:
    """Writes tracks as .csv.gz without name or time of the file: the same tracks give the same bytes."""
    plain = path.with_suffix("")
    save_tracks(plain, tracks)
    write_whole(path, gzip.compress(plain.read_bytes(), mtime=0))
    plain.unlink()


def _write_description(folder: Path, plan: SyntheticPlan) -> None:
    if plan.robot is not None:
        write_whole(folder / ROBOT_FILE, tomlkit.dumps(plan.robot.model_dump()))
    write_session_toml(
        folder,
        name=plan.name,
        camera={"fps": plan.camera.fps, "scale_length_m": round(plan.swimmer.scale_length_m, 9)},
        markers=plan.markers,
        trials=[
            {
                "name": trial.name,
                "kind": "swim",
                "tracks": _track_file(trial.name),
                "commanded_hz": trial.commanded_hz,
                "role": trial.role,
            }
            for trial in plan.trials
        ],
        fit={"warmup_s": plan.warmup_s},
        robot_file=None if plan.robot is None else ROBOT_FILE,
    )
