"""Rendering of a clip: a plan becomes a video, in one or more encodings, with its truth next to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

from benchmarks.video.plan import ClipPlan
from benchmarks.video.scene import PoolScene
from benchmarks.video.truth import ClipTruth, boxes_file, truth_file
from benchmarks.video.writer import Codec, VideoWriter
from tracking.boxes import save_boxes


class Encoding(NamedTuple):
    """Way to pack a video."""

    codec: Codec = "h264"  # "h264", "hevc" or "ffv1" (lossless)
    crf: float = 23  # quality of H.264 and HEVC, 0 (best) to 51; FFV1 takes none


ENCODINGS = (Encoding("ffv1"), Encoding("h264", 18), Encoding("h264", 23), Encoding("h264", 28), Encoding("hevc", 28))
"""Encodings that a tracker is measured at, lossless first."""


def render_encodings(plan: ClipPlan, videos: Mapping[Path, Encoding], progress: Callable[[int], None]) -> ClipTruth:
    """Render a clip once and pack it in several ways, each with its truth and start boxes next to it.

    Args:
        plan: plan of the clip.
        videos: encoding of each video, by its file.
        progress: called with the number of frames done.

    Raises:
        swimcal.errors.ResultsNotWritable: a file cannot be written.
        swimcal.errors.SimulationDiverged: the planned motion is unstable.
    """
    scene = PoolScene(plan)
    write_scene(scene, videos, progress)
    for path in videos:
        scene.truth.save(truth_file(path))
        save_boxes(boxes_file(path), scene.truth.start_boxes())
    return scene.truth


def write_scene(scene: PoolScene, videos: Mapping[Path, Encoding], progress: Callable[[int], None]) -> None:
    """Paint a scene once and write its videos, without truth; arguments as of `render_encodings`."""
    optics = scene.plan.optics
    fps = Fraction(optics.fps).limit_denominator(1001)
    with ExitStack() as files:
        writers = [
            files.enter_context(VideoWriter(path, optics.width_px, optics.height_px, fps, *encoding))
            for path, encoding in videos.items()
        ]
        for number, time_s in enumerate(scene.stage.time_s):
            data = scene.picture(number).data
            for writer in writers:
                writer.write(data, float(time_s))
            progress(number + 1)
