"""Speed at which a 4K video is tracked, compared to decoding alone, and its memory. Ratios count."""

import resource
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from benchmarks.scores import Table
from benchmarks.video.truth import load_truth, truth_file
from swimcal.tracks import as_tracks
from tracking.follow_video import follow_video
from tracking.video import Video

ROUNDS = 5
_CSRT_FRAMES = 20  # Plain CSRT is given only this many frames.


def speed_table(videos: Sequence[Path]) -> Table:
    """Measure frames a second of rendered clips: reading alone and tracking by turns, each in a fresh process.

    Opening the file is included, but for plain CSRT, which is slow and given the first frames alone. The ratios are of
    the two in one round, which a machine that is slow for a while disturbs less: of the time by the clock, and of what
    all cores spent, which other programs disturb least. Memory is the most of a process that tracks. The truth of the
    videos is next to them.
    """
    columns = ("frames a second", "reading alone", "tracking", "ratio", "ratio of CPU time", "plain CSRT", "memory")
    return Table(f"Speed, the median of {ROUNDS} rounds", columns, tuple(_build_row(path) for path in videos))


def _build_row(path: Path) -> tuple[str, ...]:
    truth = load_truth(truth_file(path))
    rounds = [(_run_alone(_read, path), _run_alone(_track, path)) for _ in range(ROUNDS)]
    frames, markers = len(truth.time_s), len(truth.markers)
    with Video(path) as video:
        info = video.info
    return (
        f"{info.codec}, {info.width_px} x {info.height_px}, {frames} frames, {markers} markers",
        f"{frames / median(read.wall_s for read, _ in rounds):.0f}",
        f"{frames / median(tracked.wall_s for _, tracked in rounds):.0f}",
        f"{median(read.wall_s / tracked.wall_s for read, tracked in rounds):.2f}",
        f"{median(read.cpu_s / tracked.cpu_s for read, tracked in rounds):.2f}",
        f"{_run_alone(_track_csrt, path):.1f}",
        f"{max(tracked.most_mb for _, tracked in rounds):.0f} MB",
    )


def _run_alone(work: Callable[..., Any], *arguments: Any) -> Any:
    """Run in a process of its own, so that nothing is warm and memory is its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        pool.submit(_import_all).result()
        return pool.submit(work, *arguments).result()


def _import_all() -> None:
    """Import before the clock runs, for both; xarray puts some imports off until it is used."""
    as_tracks(("nose",), np.zeros(1), np.zeros((1, 1, 2)), np.zeros((1, 1)))


class _Cost(NamedTuple):
    """Cost of a piece of work: seconds by the clock, seconds of all cores, and the most memory of its process."""

    wall_s: float
    cpu_s: float
    most_mb: float


def _measure_cost(work: Callable[[], object]) -> _Cost:
    before, began = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
    work()
    wall_s, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return _Cost(wall_s, cpu_s, _most_memory_mb())


def _most_memory_mb() -> float:
    """Return the most memory that this process has held; what `getrusage` tells counts that of its parent, too."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return float(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024


def _read(path: Path) -> _Cost:
    def work() -> None:
        with Video(path) as video:
            for frame in video.frames():
                _ = frame.luma[0, 0]

    return _measure_cost(work)


def _track(path: Path) -> _Cost:
    truth = load_truth(truth_file(path))

    def work() -> None:
        with Video(path) as video:
            follow_video(video, truth.start_boxes(), truth.markers)

    return _measure_cost(work)


def _track_csrt(path: Path) -> float:
    """Return frames a second, from the first frame that is done on."""
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
