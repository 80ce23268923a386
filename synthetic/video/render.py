"""Rendering: a plan becomes a video with its truth beside it."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

from synthetic.video.plan import ClipPlan
from synthetic.video.scene import PoolScene
from synthetic.video.truth import ClipTruth, boxes_file, save_boxes, truth_file
from synthetic.video.writer import Codec, VideoWriter


def render_clip(plan: ClipPlan, path: Path, codec: Codec = "h264", crf: float = 23) -> ClipTruth:
    """Renders a clip, with `<name>.truth.npz` and `<name>.boxes.json` beside it.

    Args:
        plan: of the clip.
        path: of the video, for instance `clean.mp4`.
        codec: "h264", "hevc" or "ffv1" (lossless).
        crf: quality of H.264 and HEVC, 0 (best) to 51.

    Raises:
        session.ResultsNotWritable: a file cannot be written.
        session.SimulationDiverged: the planned motion is unstable.
    """
    scene = PoolScene(plan)
    write_scene(scene, path, codec, crf)
    scene.truth.save(truth_file(path))
    save_boxes(boxes_file(path), scene.truth)
    return scene.truth


def write_scene(
    scene: PoolScene,
    path: Path,
    codec: Codec = "h264",
    crf: float = 23,
    told: Callable[[int], None] = lambda _: None,
) -> None:
    """Writes the video of a scene.

    Args:
        scene: to be painted.
        path: of the video.
        codec, crf: as for `VideoWriter`.
        told: called with the number of frames written so far.

    Raises:
        session.ResultsNotWritable: the file cannot be written.
    """
    optics = scene.plan.optics
    fps = Fraction(optics.fps).limit_denominator(1001)
    with VideoWriter(path, optics.width_px, optics.height_px, fps, codec, crf) as writer:
        for number, time_s in enumerate(scene.stage.time_s):
            writer.write(scene.picture(number).data, float(time_s))
            told(number + 1)
