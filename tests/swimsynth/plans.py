"""A small plan to make sessions of, and what the program measures in them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import xarray as xr

from fitting.measure_trial import measure_trial
from fitting.trial import MeasuredTrial
from swimcal.robot import load_robot
from swimcal.session import Session, load_session
from swimcal.tracks import load_tracks
from swimsynth.disturbances import SyntheticMotor
from swimsynth.plan import SyntheticDecay, SyntheticPlan, SyntheticTrial

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


MOTOR = SyntheticMotor(drive_s=3.0, starts_s=0.7, clock_offset_s=3210.9, clock_rate=1.00006)
DRY: dict[str, Any] = {
    "name": "dry",
    "frequency_hz": 0.88,
    "commanded_hz": 0.9,
    "seconds": 14.5,
    "phase_rad": 2.0,
    "heading_rad": 1.0,
    "motor": MOTOR,
}


DECAY: dict[str, Any] = {"name": "decay", "heading_rad": 1.0}


def dry_plan(*, dry: dict[str, Any] | None = None, decay: dict[str, Any] | None = None, **more: Any) -> SyntheticPlan:
    """A dry run with a motor log, and a free decay."""
    runs, decays = (SyntheticTrial(**DRY | (dry or {})),), (SyntheticDecay(**DECAY | (decay or {})),)
    settings: dict[str, Any] = {"dry_runs": runs, "free_decays": decays, "run_in_s": 1.0} | more
    return SyntheticPlan(**settings)


def small_plan(*, slow: dict[str, Any] | None = None, **changes: Any) -> SyntheticPlan:
    """Two short swims."""
    trials = (SyntheticTrial(**SLOW | (slow or {})), SyntheticTrial(**FAST))
    settings: dict[str, Any] = {"trials": trials, "run_in_s": 3.0} | changes
    return SyntheticPlan(**settings)


def tracks_of(session: Session, name: str) -> xr.Dataset:
    path = session.trial(name).tracks
    assert path is not None
    return load_tracks(path, session.markers, session.camera.fps)


def measured(folder: Path) -> dict[str, MeasuredTrial]:
    """The swims of a session with tracks, as the fit gets them."""
    session = load_session(folder)
    robot = load_robot(session.robot_file)
    return {
        spec.name: measure_trial(spec, tracks_of(session, spec.name), session.camera, robot, session.warmup_s)
        for spec in session.trials
        if spec.tracks is not None and spec.kind == "swim"
    }


def files_of(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
