"""Trials as videos: a synthetic session whose swim trials are filmed instead of tracked."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from benchmarks.video.camera import Optics
from benchmarks.video.motion import Motion, RobotPoints
from benchmarks.video.plan import ClipPlan
from benchmarks.video.render import Encoding, write_scene
from benchmarks.video.scene import PoolScene
from benchmarks.video.stage import staged
from benchmarks.video.truth import boxes_file
from swimcal.robot import RobotSpec
from swimcal.toml import TomlTable
from swimcal.tracks import as_tracks, save_tracks
from swimsynth.plan import SyntheticPlan
from swimsynth.session import Progress
from swimsynth.simulate import TrueRun
from tracking.boxes import save_boxes


class SessionVideo(TomlTable):
    """Plan of how the swim trials of a session are filmed; its clock and scale are those of the plan's camera."""

    # names of the filmed swim trials; None for all of them. Dry runs and free decays, in air, are tracked.
    trials: tuple[str, ...] | None = None
    # width_px, height_px: size of the videos, multiples of 2 and 4, the middle of the camera's image; None for all
    width_px: int | None = None
    height_px: int | None = None
    crf: Annotated[float, Field(ge=0, le=51)] = 23.0  # quality of the files, H.264

    def films(self, trial: str) -> bool:
        """Return whether a trial is filmed."""
        return self.trials is None or trial in self.trials

    def film(self, folder: Path, number: int, swim: TrueRun, plan: SyntheticPlan, progress: Progress) -> dict[str, str]:
        """Write ``trials/<name>.mp4``, start boxes next to it, and ``truth/<name>.csv``, where the markers are."""
        name, frames = swim.trial.name, len(swim.time_s)
        video = Path("trials") / f"{name}.mp4"
        scene = film_scene(swim, plan, self, number)
        truth = scene.truth
        perfect = as_tracks(truth.markers, truth.time_s, truth.shown_px, np.ones(truth.shown_px.shape[:2]))
        save_tracks(folder / "truth" / f"{name}.csv", perfect)
        save_boxes(folder / boxes_file(video), truth.start_boxes())
        write_scene(scene, {folder / video: Encoding(crf=self.crf)}, lambda done: progress(name, done, frames))
        return {"video": video.as_posix(), "boxes": boxes_file(video).as_posix()}

    def optics(self, plan: SyntheticPlan) -> Optics:
        """Return the camera of the videos."""
        camera = plan.camera
        return Optics(
            width_px=self.width_px or camera.width_px,
            height_px=self.height_px or camera.height_px,
            fps=camera.fps,
            px_per_m=camera.px_per_m,
            height_m=None,
        )


def film_scene(swim: TrueRun, plan: SyntheticPlan, video: SessionVideo, number: int) -> PoolScene:
    """Return the scene of a swim, where the plan has it; the trial's number seeds waves, glints and noise."""
    optics, robot = video.optics(plan), plan.swimmer
    clip = ClipPlan(
        frames=len(swim.time_s),
        seed=1000 * plan.seed + number,
        markers=plan.markers,
        optics=optics,
        robot=plan.robot,
    )
    inset_px = (np.array([plan.camera.width_px - optics.width_px, plan.camera.height_px - optics.height_px])) / 2
    motion = _place(swim, robot, plan.markers, optics, swim.position_px[0] - inset_px)
    stage = staged(motion, robot, plan.markers, optics, swim.time_s)
    return PoolScene(clip, stage)


def _place(swim: TrueRun, robot: RobotSpec, markers: tuple[str, ...], optics: Optics, first_px: np.ndarray) -> Motion:
    """Return the swim in the camera's pool, from where its markers (m, 2) are in the first frame, px without lens."""
    raw = Motion(swim.time_s, swim.head, swim.hinges_rad)
    points = RobotPoints(robot, [robot.markers[name] for name in markers])
    before_m = points(raw.at(swim.time_s[:1]))[0, :, :2]  # (m, 2)
    middle_px = (np.array([optics.width_px, optics.height_px]) - 1) / 2
    after_m = (first_px - middle_px) / optics.px_per_m * [1, -1]
    nose, neck = markers.index("nose"), markers.index("neck")
    angles = [np.arctan2(*(place[nose] - place[neck])[::-1]) for place in (before_m, after_m)]
    turned = raw.moved(angles[1] - angles[0], (0.0, 0.0))
    return turned.moved(0.0, after_m[nose] - points(turned.at(swim.time_s[:1]))[0, nose, :2])
