"""How fast a 4K video is tracked, beside decoding alone, and how much memory that takes. Ratios count."""

import resource
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.scores import Table
from benchmarks.video.truth import load_truth, truth_file
from tracking.boxes import Box, StartBoxes
from tracking.tracker import TrackerName, follow_video
from tracking.video import Video

ROUNDS = 5


@dataclass(frozen=True)
class TrackingSpeed:
    """What a video costs, start-up included, the median of a few rounds that alternate.

    Attributes:
        codec: and size of the video.
        frames, markers: how many.
        decoding_fps: frames a second of reading alone.
        tracking_fps: the same with tracking.
        ratio: of the two in one round, which a machine that is slow for a while disturbs less.
        csrt_fps: with plain CSRT, over the first frames of the same video, opening and starting not included.
        memory_mb: most memory of a process that tracks it.
        memory_growth_mb: by how much that rose over the last two thirds of the frames.
    """

    codec: str
    frames: int
    markers: int
    decoding_fps: float
    tracking_fps: float
    ratio: float
    csrt_fps: float
    memory_mb: float
    memory_growth_mb: float


def measure_tracking_speed(path: Path, csrt_frames: int = 20) -> TrackingSpeed:
    """Times a rendered clip: reading alone and tracking by turns, each in a fresh process.

    Args:
        path: of the clip, with its truth beside it.
        csrt_frames: how many frames plain CSRT is given: it is slow.
    """
    truth = load_truth(truth_file(path))
    reading, tracking, memory = [], [], []
    for _ in range(ROUNDS):
        reading.append(_alone(_read, path))
        seconds, most, growth = _alone(_track, path)
        tracking.append(seconds)
        memory.append((most, growth))
    frames = len(truth.time_s)
    with Video(path) as video:
        info = video.info
    return TrackingSpeed(
        codec=f"{info.codec}, {info.width_px} x {info.height_px}",
        frames=frames,
        markers=len(truth.markers),
        decoding_fps=frames / median(reading),
        tracking_fps=frames / median(tracking),
        ratio=median(read / tracked for read, tracked in zip(reading, tracking, strict=True)),
        csrt_fps=_alone(_track_csrt, path, csrt_frames),
        memory_mb=max(most for most, _ in memory),
        memory_growth_mb=max(growth for _, growth in memory),
    )


def _alone(work: Callable[..., Any], *arguments: Any) -> Any:
    """Runs in a process of its own, so that nothing is warm and memory is its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        pool.submit(_ready).result()
        return pool.submit(work, *arguments).result()


def _ready() -> None:
    """The imports are paid for before the clock runs, for both alike."""


def _read(path: Path) -> float:
    began, total = time.perf_counter(), 0
    with Video(path) as video:
        for frame in video.frames():
            total += int(frame.luma[0, 0])
    return time.perf_counter() - began


def _track(path: Path) -> tuple[float, float, float]:
    truth, memory = load_truth(truth_file(path)), []
    began = time.perf_counter()
    with Video(path) as video:
        follow_video(video, _boxes(path), truth.markers, progress=lambda *_: memory.append(_most_mb()))
    seconds = time.perf_counter() - began
    return seconds, _most_mb(), _most_mb() - memory[len(memory) // 3]


def _track_csrt(path: Path, frames: int) -> float:
    """Frames a second, from the first frame that is done on."""
    truth = load_truth(truth_file(path))
    method: TrackerName = "csrt"
    ticks: list[tuple[int, float]] = []

    def enough(done: int, _frames: int, _fps: float) -> None:
        ticks.append((done, time.perf_counter()))
        if done > frames:
            raise KeyboardInterrupt

    with suppress(KeyboardInterrupt), Video(path) as video:
        follow_video(video, _boxes(path), truth.markers, method, progress=enough)
    (first, began), (last, ended) = ticks[0], ticks[-1]
    return (last - first) / (ended - began)


def _boxes(path: Path) -> StartBoxes:
    truth = load_truth(truth_file(path))
    return StartBoxes(0, {name: Box(*box) for name, box in truth.start_boxes().items()})


def _most_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def speed_table(speeds: Sequence[TrackingSpeed]) -> Table:
    """Frames a second."""
    rows = tuple(
        (
            f"{speed.codec}, {speed.frames} frames, {speed.markers} markers",
            f"{speed.decoding_fps:.0f}",
            f"{speed.tracking_fps:.0f}",
            f"{speed.ratio:.2f}",
            f"{speed.csrt_fps:.1f}",
            f"{speed.memory_mb:.0f} MB ({speed.memory_growth_mb:+.0f})",
        )
        for speed in speeds
    )
    columns = ("frames a second", "reading alone", "tracking", "ratio", "plain CSRT", "memory (growth at the end)")
    return Table(f"Speed, the median of {ROUNDS} rounds", columns, rows)
