"""All parts of `calib benchmark tracking` in one run, and its tables."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.tracking.accuracy import (
    METHODS,
    SPEED_CLIP,
    Case,
    Tell,
    TrackingScore,
    cases,
    measure_tracking,
    render_cases,
    tracking_table,
)
from benchmarks.tracking.from_video import FittedFrom, measure_from_video
from benchmarks.tracking.speed import TrackingSpeed, measure_tracking_speed
from benchmarks.video import BENCHMARK_CLIPS, Encoding
from session import FaultCollector

COMPARED = Encoding("h264", 23)
"""All trackers are compared on videos of this quality; the tracker itself is measured on all."""
SPEED_ENCODINGS = (Encoding("h264", 23), Encoding("hevc", 23))
FIT_CRF = 23.0


@dataclass(frozen=True)
class TrackingOutcome:
    """What `calib benchmark tracking` measured.

    Attributes:
        scores: of every tracker on every clip.
        speeds: at 4K, in two codecs.
        fits: of a filmed swimmer.
    """

    scores: tuple[TrackingScore, ...] = ()
    speeds: tuple[TrackingSpeed, ...] = ()
    fits: tuple[FittedFrom, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return {name: [each.to_json() for each in getattr(self, name)] for name in ("scores", "speeds", "fits")}

    def text(self) -> str:
        """Tables for a terminal."""
        parts = []
        if self.scores:
            parts.append(tracking_table(self.scores))
        parts += [_speed_lines(speed) for speed in self.speeds]
        if self.fits:
            parts.append(_fit_table(self.fits))
        return "\n\n".join(parts)


def measure_all(folder: Path, part: str, clips: Sequence[str], tell: Tell) -> TrackingOutcome:
    """Measures accuracy, speed and the cost in the coefficients, or one part of that.

    Args:
        folder: where rendered videos go and are found again.
        part: "accuracy", "speed", "fit" or "all".
        clips: names of clips, none for all of them.
        tell: of the progress.

    Raises:
        InputError: no clip has such a name.
    """
    _check(clips)
    outcome = TrackingOutcome()
    if part in ("all", "accuracy"):
        todo = cases(clips)
        render_cases(todo, folder, tell)
        own = measure_tracking(todo, folder, METHODS[:1], tell)
        others = measure_tracking([case for case in todo if case.encoding == COMPARED], folder, METHODS[1:], tell)
        outcome = TrackingOutcome(scores=(*own, *others))
    if part in ("all", "speed"):
        videos = [Case(SPEED_CLIP, encoding) for encoding in SPEED_ENCODINGS]
        render_cases(videos, folder, tell)
        tell("timing the tracker at 4K", None)
        speeds = tuple(measure_tracking_speed(case.file(folder)) for case in videos)
        outcome = TrackingOutcome(outcome.scores, speeds)
    if part in ("all", "fit"):
        fits = measure_from_video(folder, FIT_CRF, ("hybrid", "csrt"), tell)
        outcome = TrackingOutcome(outcome.scores, outcome.speeds, tuple(fits))
    return outcome


def _check(clips: Sequence[str]) -> None:
    faults = FaultCollector("--clips")
    for name in clips:
        if name not in BENCHMARK_CLIPS:
            faults.add("", "no such clip", found=repr(name), choices=tuple(BENCHMARK_CLIPS))
    faults.raise_if_any()


def _speed_lines(speed: TrackingSpeed) -> str:
    rows = [
        (f"{speed.codec}, {speed.frames} frames, {speed.markers} markers", ""),
        ("  reading alone", f"{speed.decoding_fps:.1f} frames a second"),
        ("  tracking", f"{speed.tracking_fps:.1f} frames a second, {speed.ratio:.2f} of reading alone"),
        ("  plain CSRT", f"{speed.csrt_fps:.2f} frames a second"),
        ("  memory", f"{speed.memory_mb:.0f} MB at most, {speed.memory_growth_mb:+.0f} MB over the last two thirds"),
    ]
    return "\n".join(f"{name:16} {value}".rstrip() for name, value in rows)


def _fit_table(fits: Sequence[FittedFrom]) -> str:
    names = fits[0].error._fields
    head = f"{'fitted from':16} {'rms px':>7} {'marker mm':>10} " + " ".join(f"{name:>13}" for name in names)
    rows = [
        f"{fit.tracks:16} {fit.track_rms_px:7.3f} {fit.marker_error_mm:10.2f} "
        + " ".join(f"{error:+13.1%}" for error in fit.error)
        for fit in fits
    ]
    return "\n".join(["error of each coefficient of a swimmer that was filmed and tracked", head, *rows])
