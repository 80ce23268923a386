"""How fast a 4K video is tracked, compared to decoding alone, and how much memory that takes. Ratios count."""

import resource
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.scores import Table
from benchmarks.video.truth import load_truth, truth_file
from tracking.tracker import follow_video
from tracking.video import Video

ROUNDS = 5
_CSRT_FRAMES = 20  # that plain CSRT is given


def speed_table(videos: Sequence[Path]) -> Table:
    """Frames a second of rendered clips: reading alone and tracking by turns, each in a fresh process.

    Start-up is included, but for plain CSRT, which is slow and given the first frames alone. The ratio is of the two in
    one round, which a machine that is slow for a while disturbs less. Memory is the most of a process that tracks. The
    truth of the videos is next to them.
    """
    columns = ("frames a second", "reading alone", "tracking", "ratio", "plain CSRT", "memory")
    return Table(f"Speed, the median of {ROUNDS} rounds", columns, tuple(_row(path) for path in videos))


def _row(path: Path) -> tuple[str, ...]:
    truth = load_truth(truth_file(path))
    rounds = [(_alone(_read, path), *_alone(_track, path)) for _ in range(ROUNDS)]
    reading, tracking, most = zip(*rounds, strict=True)
    frames, markers = len(truth.time_s), len(truth.markers)
    with Video(path) as video:
        info = video.info
    return (
        f"{info.codec}, {info.width_px} x {info.height_px}, {frames} frames, {markers} markers",
        f"{frames / median(reading):.0f}",
        f"{frames / median(tracking):.0f}",
        f"{median(read / tracked for read, tracked in zip(reading, tracking, strict=True)):.2f}",
        f"{_alone(_track_csrt, path):.1f}",
        f"{max(most):.0f} MB",
    )


def _alone(work: Callable[..., Any], *arguments: Any) -> Any:
    """Runs in a process of its own, so that nothing is warm and memory is its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        pool.submit(_ready).result()
        return pool.submit(work, *arguments).result()


def _ready() -> None:
    """The imports are paid for before the clock runs, for both."""


def _read(path: Path) -> float:
    began, total = time.perf_counter(), 0
    with Video(path) as video:
        for frame in video.frames():
            total += int(frame.luma[0, 0])
    return time.perf_counter() - began


def _track(path: Path) -> tuple[float, float]:
    truth = load_truth(truth_file(path))
    began = time.perf_counter()
    with Video(path) as video:
        follow_video(video, truth.start_boxes(), truth.markers)
    return time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _track_csrt(path: Path) -> float:
    """Frames a second, from the first frame that is done on."""
    truth = load_truth(truth_file(path))
    ticks: list[tuple[int, float]] = []

    def enough(done: int, _frames: int, _fps: float) -> None:
        ticks.append((done, time.perf_counter()))
        if done > _CSRT_FRAMES:
            raise KeyboardInterrupt

    with suppress(KeyboardInterrupt), Video(path) as video:
        follow_video(video, truth.start_boxes(), truth.markers, "csrt", progress=enough)
    (first, began), (last, ended) = ticks[0], ticks[-1]
    return (last - first) / (ended - began)
