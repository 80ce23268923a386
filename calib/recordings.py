"""The trials of a session, measured: from their tracks, or from their videos."""

from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from calib.options import Options
from calib.videos import VideoStage
from fitting import MeasuredTrial, measure_trial
from session import (
    FaultCollector,
    NotEnoughData,
    Provenance,
    Session,
    Tracks,
    TrialSpec,
    fingerprint_of,
    is_current,
    load_tracks,
    mark_current,
    save_tracks,
)
from swimmer import RobotSpec
from tracking.lens import lens_flags


class Recordings:
    """The recordings of a session.

    Args:
        session: as read.
        robot: that was recorded.
        options: tracker, threads, progress.
        stamp: what results are stamped with.
    """

    def __init__(self, session: Session, robot: RobotSpec, options: Options, stamp: Provenance) -> None:
        self._session, self._robot, self._options, self._stamp = session, robot, options, stamp
        self.videos = VideoStage(session, robot, options)

    @cached_property
    def fingerprint(self) -> str:
        """Of the recordings and how their videos are tracked, the robot, the engine and the program.

        Raises:
            InputError: what is wrong with the videos and boxes of all trials.
        """
        stamp = self._stamp
        filmed = [spec for spec in self._session.trials if is_usable(spec) and spec.tracks is None]
        self.videos.all_boxes(filmed)
        trackers = {spec.name: self.videos.tracker_of(spec) for spec in filmed}
        model = {"mujoco": stamp.mujoco, "model": stamp.model_sha256}
        return fingerprint_of(stamp.inputs, model | ({"trackers": trackers} if trackers else {}))

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What the reader should know about the trials that were left out."""
        left_out = [spec for spec in self._session.trials if not is_usable(spec)]
        return tuple(f"Trial {spec.name} was left out: {_why_left_out(spec)}." for spec in left_out)

    @cached_property
    def swims(self) -> list[MeasuredTrial]:
        """All swims of the session that have tracks or a video, measured; their tracks stand in ``results/tracks``.

        Raises:
            InputError: videos or boxes cannot be used; all of them at once.
            NotEnoughData: no usable swim, or swims that are too short; all of them at once.
        """
        specs = [spec for spec in self._session.trials if is_usable(spec)]
        if not specs:
            raise NotEnoughData(
                f'{self._session.name}: no swim with tracks. Expected at least one [[trial]] with kind = "swim" and a '
                f"tracks file or a video; found {len(self._session.trials)} trials. {' '.join(self.notes)}"
            )
        measured, problems, faults = [], [], FaultCollector()
        for spec in specs:
            self._options.tell(f"reading {spec.name}", None)
            try:
                with faults.nested():
                    measured.append(self._measured(spec))
            except NotEnoughData as problem:
                problems.append(str(problem) if spec.name in str(problem) else f"trial {spec.name}: {problem}")
        faults.raise_if_any()
        if problems:
            raise NotEnoughData("\n".join(problems))
        return measured

    def tracks(self) -> tuple[Path, ...]:
        """``results/tracks/<trial>.csv`` of every usable swim, up to date."""
        usable = [spec for spec in self._session.trials if is_usable(spec)]
        files = {spec.name: self._file(spec.name) for spec in usable}
        filmed = [spec for spec in usable if spec.tracks is None]
        self.videos.all_boxes(filmed)  # what is wrong with any of them, before the first is tracked
        for spec in filmed:
            self.videos.tracks(spec)
        if not all(is_current(files[spec.name], self.fingerprint) for spec in usable if spec.tracks is not None):
            _ = self.swims
        return tuple(files.values())

    def _measured(self, spec: TrialSpec) -> MeasuredTrial:
        if spec.tracks is not None:
            tracks = load_tracks(spec.tracks, self._session.markers, self._session.camera.fps)
            trial = self._measured_from(spec, tracks)
            self._save(tracks, trial)
            return trial
        seen = self.videos.tracks(spec)
        first = seen.boxes.frame
        trial = self._measured_from(spec, seen.counting.since(first))
        lens = lens_flags(self._session.camera, picture_px=seen.picture_px, metres_per_px=trial.metres_per_px)
        flags = (*seen.flags, *(flag.later(first) for flag in trial.flags), *lens)
        return replace(trial, flags=tuple(dict.fromkeys(flags)))

    def _measured_from(self, spec: TrialSpec, tracks: Tracks) -> MeasuredTrial:
        return measure_trial(spec, tracks, self._session.camera, self._robot, self._session.warmup_s)

    def _file(self, trial: str) -> Path:
        return self._session.results / "tracks" / f"{trial}.csv"

    def _save(self, tracks: Tracks, trial: MeasuredTrial) -> None:
        """The tracks as used: what does not count keeps its place, with confidence 0."""
        path = self._file(trial.name)
        if is_current(path, self.fingerprint):
            return
        confidence = np.where(trial.weight > 0, tracks.confidence, 0.0)
        save_tracks(path, Tracks(tracks.markers, tracks.time_s, tracks.position_px, confidence))
        mark_current(path, self.fingerprint)


def is_usable(spec: TrialSpec) -> bool:
    """Whether this version uses the trial."""
    return spec.kind == "swim" and (spec.tracks is not None or spec.video is not None)


def _why_left_out(spec: TrialSpec) -> str:
    if spec.kind != "swim":
        return f"this version does not use {spec.kind} trials yet"
    return "it has neither tracks nor a video"
