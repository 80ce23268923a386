"""Accuracy of tracked markers in rendered pool videos with known truth. Only tried on synthetic video."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.cases import Progress
from benchmarks.scores import Table
from benchmarks.video.clips import BENCHMARK_CLIPS
from benchmarks.video.render import ENCODINGS, Encoding, render_encodings
from benchmarks.video.truth import load_truth, truth_file
from swimcal.errors import InputError
from swimcal.tracks import pixels_of
from tracking.follow_video import follow_video
from tracking.tracked import SampleState
from tracking.video import Video

WRONG = 0.5  # A sample is on something else from this many diameters from its marker on.
SPEED_CLIP = "speed_4k"
METHODS = ("hybrid", "spots", "csrt")  # the tracker, the tracker without CSRT, plain CSRT
COMPARED = Encoding("h264", 23)
"""All trackers are compared on videos of this quality; the tracker itself is measured on all."""


class Clip(NamedTuple):
    """One clip in one encoding, tracked by one method."""

    clip: str
    encoding: Encoding
    method: str = "hybrid"

    @property
    def quality(self) -> str:
        """Quality of the encoding, for a table and for the file."""
        codec, crf = self.encoding
        return codec if codec == "ffv1" else f"{codec} crf {crf:g}"

    def file(self, folder: Path) -> Path:
        """Return the file in which the clip is kept."""
        return folder / f"{self.clip}-{self.quality.replace(' ', '')}.mp4"


class TrackingScore(NamedTuple):
    """Score of one tracker on one clip."""

    rms_px: float = float("nan")  # error an axis of the samples that are measured and on their marker
    bias_px: float = float("nan")  # larger of the two mean errors of the same
    lost: float = 1.0  # share of the visible samples that are not measured, or not on their marker


def clips_of(names: Sequence[str] = ()) -> list[Clip]:
    """List what accuracy is measured on, for all or some clips: the tracker on every encoding, the others on one."""
    chosen = [name for name in BENCHMARK_CLIPS if name != SPEED_CLIP and (not names or name in names)]
    own = [Clip(name, encoding) for name in chosen for encoding in ENCODINGS]
    return own + [Clip(name, COMPARED, method) for name in chosen for method in METHODS[1:]]


def render_clips(todo: Sequence[Clip], folder: Path, progress: Progress) -> None:
    """Render what is not in the folder yet, each clip once for all its encodings."""
    for name in dict.fromkeys(each.clip for each in todo):
        videos = {each.file(folder): each.encoding for each in todo if each.clip == name}
        missing = {path: encoding for path, encoding in videos.items() if not truth_file(path).exists()}
        if missing:
            frames = BENCHMARK_CLIPS[name].frames
            render_encodings(
                BENCHMARK_CLIPS[name],
                missing,
                lambda done, name=name, frames=frames: progress(f"rendering {name}", done / frames),  # type: ignore[misc]
            )


def measure_accuracy(todo: Sequence[Clip], folder: Path, progress: Progress) -> dict[Clip, TrackingScore]:
    """Track every clip, which is rendered in a folder, from the boxes that a person would draw."""
    found = {}
    for number, clip in enumerate(todo):
        progress(f"tracking {clip.clip}", number / len(todo))
        found[clip] = score_clip(clip, folder)
    return found


def score_clip(clip: Clip, folder: Path) -> TrackingScore:
    """Track one clip with one method and compare it with the truth; a tracker that refuses the boxes loses all."""
    path = clip.file(folder)
    truth = load_truth(truth_file(path))
    try:
        with Video(path) as video:
            tracked = follow_video(video, truth.start_boxes(), truth.markers, clip.method)  # type: ignore[arg-type]
    except InputError:
        return TrackingScore()
    error = pixels_of(tracked) - truth.shown_px  # (n, m, 2)
    measured = tracked.state.values == SampleState.MEASURED
    on_marker = np.linalg.norm(error, axis=2) < WRONG * truth.diameter_px
    good = measured & on_marker & truth.visible
    return TrackingScore(
        rms_px=float(np.sqrt(np.mean(error[good] ** 2))),
        bias_px=float(np.abs(error[good].mean(axis=0)).max()),
        lost=float((truth.visible & ~good).sum() / truth.visible.sum()),
    )


def accuracy_table(found: Mapping[Clip, TrackingScore]) -> Table:
    """Build a row a clip: the tracker in every encoding; each method's losses, and plain CSRT, in the compared one."""
    rows = []
    for name in dict.fromkeys(clip.clip for clip in found):
        tracker, spots, csrt = (found[Clip(name, COMPARED, method)] for method in METHODS)
        rms = (f"{found[Clip(name, encoding)].rms_px:.3f}" for encoding in ENCODINGS)
        lost = (f"{each.lost:.2%}" for each in (tracker, spots))
        rows.append((name, *rms, *lost, f"{csrt.rms_px:.3f}, {csrt.bias_px:.3f}, {csrt.lost:.2%}"))
    compared, *qualities = (Clip("", encoding).quality for encoding in (COMPARED, *ENCODINGS))
    caption = f"Rms error per axis, px, of samples on their marker; lost samples and plain CSRT at {compared}"
    return Table(caption, ("clip", *qualities, "lost", "lost, no CSRT", "CSRT: rms, bias, lost"), tuple(rows))
