"""The recorder of a synthetic session: it writes what camera, tracker and motor record of each trial."""

import gzip
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np
import xarray as xr

from session.results import write_whole
from session.tracks import as_tracks, save_tracks
from synthetic.decays import TrueDecay
from synthetic.motor_log import save_commands, save_motor_log
from synthetic.noise import lasting_errors, on_grid, placement_offsets
from synthetic.plan import SyntheticPlan
from synthetic.streams import Stream
from synthetic.swims import TrueRun
from synthetic.trials import Pixels, PlannedTrial, SyntheticTrial
from synthetic.truth import DecayTruth, DryTruth, TrialTruth

Progress = Callable[[str, int, int], None]
"""A function that is called with a trial's name, the number of frames done, and the number of all."""
_DECIMALS_PX = 2
_DECIMALS_S = 6


class Filming(Protocol):
    """An object that films swim trials instead of tracking them; a renderer is in `benchmarks.video`."""

    def films(self, trial: str) -> bool:
        """Return whether a trial is filmed."""

    def film(self, folder: Path, number: int, swim: TrueRun, plan: SyntheticPlan, progress: Progress) -> dict[str, str]:
        """Write the video of a swim.

        Args:
            folder: the session folder.
            number: number of the swim among the swims.
            swim: the simulated swim.
            plan: the plan of the session.
            progress: called after each frame.

        Returns:
            The keys of its ``[[trial]]``, files relative to the folder.
        """


class Recorder:
    """A recorder of trials into a session folder, which returns the truth of each.

    Without `video` it writes tracks alone.
    """

    def __init__(self, folder: Path, plan: SyntheticPlan, video: Filming | None, progress: Progress) -> None:
        self._folder, self._plan, self._video, self._progress = folder, plan, video, progress
        self.recordings: dict[str, dict[str, str]] = {}

    def swim(self, number: int, swim: TrueRun) -> TrialTruth:
        """Record the swim of this number, and return its truth."""
        if self._video is not None and self._video.films(swim.trial.name):
            recording = self._video.film(self._folder, number, swim, self._plan, self._progress)
            self.recordings[swim.trial.name] = recording
            placement = _by_marker(self._plan, np.zeros((len(self._plan.markers), 2)))
        else:
            placement = self._track(swim.trial, swim.position_px, Stream.SWIM_TRACKER.of(self._plan.seed, number))
        return TrialTruth(**self._record_driven(swim, placement).model_dump(), speed_m_s=swim.speed_m_s)

    def dry_run(self, number: int, run: TrueRun) -> DryTruth:
        """Record the dry run of this number, and return its truth."""
        placement = self._track(run.trial, run.position_px, Stream.DRY_TRACKER.of(self._plan.seed, number))
        return self._record_driven(run, placement)

    def free_decay(self, number: int, decay: TrueDecay) -> DecayTruth:
        """Record the free decay of this number, and return its truth."""
        random = Stream.DECAY_TRACKER.of(self._plan.seed, number)
        return DecayTruth(placement_px=self._track(decay.trial, decay.position_px, random))

    def _record_driven(self, run: TrueRun, placement: dict[str, Pixels]) -> DryTruth:
        if run.motor is not None:
            save_motor_log(self._folder / motor_file(run.trial), run.motor.log)
            save_commands(self._folder / f"trials/{run.trial.name}.commands.csv", run.motor.commands)
        return DryTruth(
            frequency_hz=run.frequency_hz,
            phase_rad=run.phase_rad,
            placement_px=placement,
            steady_s=None if run.motor is None else run.motor.steady_s,
        )

    def _track(self, trial: PlannedTrial, position_px: np.ndarray, random: np.random.Generator) -> dict[str, Pixels]:
        tracks, offsets_px = tracked(trial, position_px, self._plan, random)
        file = f"trials/{trial.name}.csv.gz"
        save_packed_tracks(self._folder / file, tracks)
        self.recordings[trial.name] = {"tracks": file}
        return _by_marker(self._plan, offsets_px)


def tracked(
    trial: PlannedTrial, position_px: np.ndarray, plan: SyntheticPlan, random: np.random.Generator
) -> tuple[xr.Dataset, np.ndarray]:
    """Track a trial as a faulty tracker would.

    Args:
        trial: the planned trial, with its track faults.
        position_px: (n, m, 2) true markers in the image.
        plan: the plan of the session.
        random: draws the errors.

    Returns:
        The tracks, and the (m, 2) offsets of the boxes from their markers, px.
    """
    noise = plan.noise
    offsets_px = placement_offsets(len(plan.markers), noise, random)
    place_m = plan.swimmer.marker_positions_m(plan.markers)[:, 0]
    errors_px = lasting_errors(position_px.shape, 1 / plan.camera.fps, noise, random, place_m)
    boxes_px = position_px + offsets_px + errors_px
    for fault in trial.faults:
        fault.apply(boxes_px, plan.markers)
    found_px = np.round(on_grid(boxes_px, noise), _DECIMALS_PX)
    confidence = np.isfinite(found_px).all(axis=2).astype(float)
    return as_tracks(plan.markers, np.round(trial.time_s(plan.camera), _DECIMALS_S), found_px, confidence), offsets_px


def motor_file(trial: SyntheticTrial) -> str:
    """Return the name of a trial's motor log in the session folder."""
    return f"trials/{trial.name}.motor.csv"


def _by_marker(plan: SyntheticPlan, offsets_px: np.ndarray) -> dict[str, Pixels]:
    offsets = [(round(float(x), 3), round(float(y), 3)) for x, y in offsets_px]
    return dict(zip(plan.markers, offsets, strict=True))


def save_packed_tracks(path: Path, tracks: xr.Dataset) -> None:
    """Write tracks as .csv.gz without name or time of the file, so that the same tracks give the same bytes."""
    plain = path.with_suffix("")
    save_tracks(plain, tracks)
    write_whole(path, gzip.compress(plain.read_bytes(), mtime=0))
    plain.unlink()
