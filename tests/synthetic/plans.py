"""A small plan to make sessions of, and what the program measures in them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fitting import MeasuredTrial, measure_trial
from session import Session, Tracks, load_session, load_tracks
from swimmer import load_robot
from synthetic import SyntheticPlan, SyntheticTrial

SLOW: dict[str, Any] = {
    "name": "slow",
    "frequency_hz": 0.8,
    "commanded_hz": 0.82,
    "seconds": 4.0,
    "phase_rad": 1.0,
}
FAST: dict[str, Any] = {
    "name": "fast",
    "frequency_hz": 1.2,
    "commanded_hz": 1.25,
    "seconds": 3.0,
    "role": "holdout",
}


def small_plan(*, slow: dict[str, Any] | None = None, **changes: Any) -> SyntheticPlan:
    """Two short swims."""
    trials = (SyntheticTrial(**SLOW | (slow or {})), SyntheticTrial(**FAST))
    settings: dict[str, Any] = {"trials": trials, "run_in_s": 3.0} | changes
    return SyntheticPlan(**settings)


def tracks_of(session: Session, name: str) -> Tracks:
    path = session.trial(name).tracks
    assert path is not None
    return load_tracks(path, session.markers, session.camera.fps)


def measured(folder: Path) -> dict[str, MeasuredTrial]:
    """The trials of a session with tracks, as the fit gets them."""
    session = load_session(folder)
    robot = load_robot(session.robot_file)
    return {
        spec.name: measure_trial(spec, tracks_of(session, spec.name), session.camera, robot, session.warmup_s)
        for spec in session.trials
        if spec.tracks is not None
    }


def files_of(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
