"""How well and how fast markers are tracked in rendered pool videos with known truth. Only tried on synthetic video."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.kept_scores import kept
from benchmarks.tracking.nearest_spot import NearestSpot
from benchmarks.video import BENCHMARK_CLIPS, ENCODINGS, ClipTruth, Encoding, load_truth, render_encodings, truth_file
from session import Flag, InputError, Tracks
from swimmer import load_robot
from tracking.boxes import Box, StartBoxes
from tracking.records import SampleState, TrackedTrial, fill_gaps
from tracking.tracker import follow_video, trusted
from tracking.video import Video

WRONG = 0.5  # diameters from its marker, from which on a measured sample is on something else
SPEED_CLIP = "speed_4k"
METHODS = ("hybrid", "spots", "csrt", "nearest")
"""The tracker, the tracker without CSRT, plain CSRT, and the nearest piece over a threshold."""
Tell = Callable[[str, float | None], None]


class Case(NamedTuple):
    """One clip in one encoding."""

    clip: str
    encoding: Encoding

    @property
    def name(self) -> str:
        """For a table and for the file."""
        codec, crf = self.encoding
        return codec if codec == "ffv1" else f"{codec} crf {crf:g}"

    def file(self, folder: Path) -> Path:
        """Where the clip is kept."""
        return folder / f"{self.clip}-{self.name.replace(' ', '')}.mp4"


@dataclass(frozen=True)
class TrackingScore:
    """How one tracker did on one clip.

    Attributes:
        clip, encoding, method: which.
        rms_px: error an axis of the samples that are measured and on their marker.
        counting_rms_px: error an axis of all samples that count in a fit, whole, half covered or astray.
        bias_px: the larger of the two mean errors of the same.
        lost: share of the visible samples that are not measured, or not on their marker.
        astray: share of the samples that are measured but not on their marker.
        silent: how many of those count in a fit all the same.
        lost_silent: how many of the lost do.
        flagged: share of the good samples that do not count.
        csrt: share of the samples that only CSRT saw.
        confidence_gap: mean confidence of good samples less that of astray ones; nan without either.
        seconds: of tracking, the decoding included.
    """

    clip: str
    encoding: str
    method: str
    rms_px: float
    counting_rms_px: float
    bias_px: float
    lost: float
    astray: float
    silent: int
    lost_silent: int
    flagged: float
    csrt: float
    confidence_gap: float
    seconds: float

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return asdict(self)


def cases(clips: Sequence[str] = (), encodings: Sequence[Encoding] = ENCODINGS) -> list[Case]:
    """All accuracy cases, or those of some clips."""
    names = [name for name in BENCHMARK_CLIPS if name != SPEED_CLIP]
    return [Case(name, encoding) for name in names if not clips or name in clips for encoding in encodings]


def render_cases(todo: Sequence[Case], folder: Path, tell: Tell) -> None:
    """Renders what is not in the folder yet, each clip once for all its encodings."""
    for clip in dict.fromkeys(case.clip for case in todo):
        missing = {case.file(folder): case.encoding for case in todo if case.clip == clip}
        missing = {path: encoding for path, encoding in missing.items() if not truth_file(path).exists()}
        if missing:
            _render(clip, missing, tell)


def _render(clip: str, videos: dict[Path, Encoding], tell: Tell) -> None:
    plan = BENCHMARK_CLIPS[clip]
    render_encodings(plan, videos, lambda done: tell(f"rendering {clip}", done / plan.frames))


def measure_tracking(todo: Sequence[Case], folder: Path, methods: Sequence[str], tell: Tell) -> Iterator[TrackingScore]:
    """Tracks every case with every method, from the same boxes.

    Args:
        todo: what to track; rendered before.
        folder: where the videos are; the scores are kept there as they come, and taken from there the next time.
        methods: of `METHODS`.
        tell: of the progress.
    """
    runs = [(case, method) for case in todo for method in methods]
    for number, (case, method) in enumerate(runs):
        tell(f"{case.clip}, {case.name}, {method}", number / len(runs))
        name, truth = f"{case.file(folder).stem}.{method}.score", truth_file(case.file(folder))
        yield kept(folder, name, truth, partial(score_case, case, folder, method), TrackingScore)


def score_case(case: Case, folder: Path, method: str) -> TrackingScore:
    """Tracks one case with one method and compares it with the truth."""
    path = case.file(folder)
    truth, robot = load_truth(truth_file(path)), BENCHMARK_CLIPS[case.clip].robot or load_robot()
    began = time.perf_counter()
    try:
        tracked = track_clip(path, truth, method)
    except InputError:
        return _refused(case, method, time.perf_counter() - began)
    seconds = time.perf_counter() - began
    return _score(case, method, truth, trusted(fill_gaps(tracked), robot), tracked, seconds)


def _refused(case: Case, method: str, seconds: float) -> TrackingScore:
    """A tracker that refuses its start boxes loses every sample, and says so."""
    unknown = float("nan")
    return TrackingScore(
        clip=case.clip,
        encoding=case.name,
        method=method,
        rms_px=unknown,
        counting_rms_px=unknown,
        bias_px=unknown,
        lost=1.0,
        astray=0.0,
        silent=0,
        lost_silent=0,
        flagged=unknown,
        csrt=0.0,
        confidence_gap=unknown,
        seconds=seconds,
    )


def track_clip(path: Path, truth: ClipTruth, method: str) -> TrackedTrial:
    """Tracks one clip from the boxes that a person would draw."""
    boxes = StartBoxes(0, {name: Box(*box) for name, box in truth.start_boxes().items()})
    with Video(path) as video:
        if method != "nearest":
            return follow_video(video, boxes, truth.markers, method)  # type: ignore[arg-type]
        return _track_nearest(video, boxes, truth.markers)


def _track_nearest(video: Video, boxes: StartBoxes, markers: tuple[str, ...]) -> TrackedTrial:
    shape = (video.info.frames, len(markers))
    position, confidence = np.full((*shape, 2), np.nan), np.zeros(shape)
    tracker: NearestSpot | None = None
    for frame in video.frames():
        if tracker is None:
            tracker = NearestSpot(frame.luma, boxes.centres_px(markers))
            seen = tracker.first
        else:
            seen = tracker.step(frame.luma)
        position[frame.number] = np.where(seen.seen[:, None], seen.position_px, np.nan)
        confidence[frame.number] = seen.confidence
    return TrackedTrial.of(Tracks(markers, video.info.time_s, position, confidence))


def _score(
    case: Case, method: str, truth: ClipTruth, judged: TrackedTrial, tracked: TrackedTrial, seconds: float
) -> TrackingScore:
    error = tracked.tracks.position_px - truth.shown_px  # (n, m, 2)
    measured = tracked.state == SampleState.MEASURED
    on_marker = np.linalg.norm(error, axis=2) < WRONG * truth.diameter_px
    good = measured & on_marker & truth.visible
    astray = measured & ~on_marker
    lost = truth.visible & ~good
    told = judged.weight == 0
    counts = measured & ~told & (truth.visible_share > 0)
    confidence = tracked.tracks.confidence
    both = good.any() and astray.any()
    only_csrt = _told([flag for flag in judged.flags if flag.kind == "only_csrt"], tracked)
    return TrackingScore(
        clip=case.clip,
        encoding=case.name,
        method=method,
        rms_px=float(np.sqrt(np.mean(error[good] ** 2))),
        counting_rms_px=float(np.sqrt(np.mean(error[counts] ** 2))) if counts.any() else np.nan,
        bias_px=float(np.abs(error[good].mean(axis=0)).max()),
        lost=float(lost.sum() / truth.visible.sum()),
        astray=float(astray.mean()),
        silent=int((astray & ~told).sum()),
        lost_silent=int((lost & measured & ~told).sum()),
        flagged=float((good & told).sum() / good.sum()),
        csrt=float(only_csrt.mean()),
        confidence_gap=float(confidence[good].mean() - confidence[astray].mean()) if both else np.nan,
        seconds=seconds,
    )


def _told(flags: Sequence[Flag], tracked: TrackedTrial) -> np.ndarray:
    """(n, m) whether a sample lies in a flag."""
    names = tracked.tracks.markers
    told = np.zeros(tracked.state.shape, bool)
    for flag in flags:
        if flag.frames is not None:
            columns = [names.index(name) for name in flag.markers] or list(range(len(names)))
            told[flag.frames[0] : flag.frames[1] + 1, columns] = True
    return told


def tracking_table(scores: Sequence[TrackingScore]) -> str:
    """The scores for a terminal."""
    head = f"{'clip':16} {'encoding':11} {'tracker':8} {'rms px':>7} {'counting':>8} {'bias px':>8} "
    head += f"{'lost':>8} {'astray':>8} {'silent':>7} {'flagged':>9} {'by CSRT':>8} {'s':>7}"
    rows = [
        f"{s.clip:16} {s.encoding:11} {s.method:8} {s.rms_px:7.3f} {s.counting_rms_px:8.3f} {s.bias_px:8.3f} "
        f"{s.lost:8.2%} {s.astray:8.2%} {s.silent:7d} {s.flagged:9.2%} {s.csrt:8.2%} {s.seconds:7.1f}"
        for s in scores
    ]
    return "\n".join([head, *rows])
