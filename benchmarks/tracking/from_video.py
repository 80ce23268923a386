"""What the tracker's error costs in each coefficient: a known swimmer filmed, tracked and fitted.

It is fitted on perfect tracks for comparison. The swimmer is the twin at a finer step, so what the twin leaves out of
real water costs nothing here.
"""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.cases import Progress
from benchmarks.scores import Table
from benchmarks.video.filmed import SessionVideo
from calib.options import Options
from calib.pipeline import Pipeline, open_session
from session import Session
from session.tracks import pixels_of
from swimmer import FluidCoefficients
from synthetic import PLAUSIBLE_COEFFICIENTS, SyntheticCamera, SyntheticPlan, SyntheticTrial, make_session
from tracking.records.tracked import counting
from tracking.tracker import TrackerName

SPEEDS_HZ, SECONDS = (0.6, 1.0, 1.4), 5.5
_SEED = 0  # of the crank phases and the pictures


def cost_table(folder: Path, crf: float, trackers: tuple[TrackerName, ...], progress: Progress) -> Table:
    """Films a swimmer at three speeds, and fits it from perfect tracks and from each tracker's.

    Args:
        folder: for the sessions; videos that are there are used again.
        crf: quality of the H.264 videos.
        trackers: to be compared.
        progress: called with a message and the share done.
    """
    filmed = folder / f"filmed-{crf:g}"
    if not filmed.exists():
        plan, video = _plan(), SessionVideo(crf=crf)
        make_session(filmed, plan, video, lambda name, done, of: progress(f"filming {name}", done / of))
    perfect = _with_true_tracks(filmed, folder / f"{filmed.name}-perfect")
    rows = [_fitted(perfect, None, progress), *(_fitted(filmed, tracker, progress) for tracker in trackers)]
    caption = f"A known swimmer, filmed at {', '.join(map(str, SPEEDS_HZ))} Hz and fitted: error of each coefficient"
    return Table(caption, ("fitted from", "rms px", "marker mm", *FluidCoefficients._fields), tuple(rows))


def _plan() -> SyntheticPlan:
    random = np.random.default_rng(_SEED)
    trials = tuple(
        SyntheticTrial(
            name=f"f{hz:.2f}".replace(".", "_"),
            frequency_hz=hz,
            commanded_hz=hz,
            seconds=SECONDS,
            phase_rad=round(float(2 * np.pi * random.random()), 3),
            heading_rad=round(float(np.pi + random.uniform(-0.2, 0.2)), 3),
        )
        for hz in SPEEDS_HZ
    )
    return SyntheticPlan(trials=trials, seed=_SEED, camera=SyntheticCamera(width_px=1920, height_px=1080))


def _with_true_tracks(filmed: Path, copy: Path) -> Path:
    """The same session with the truth's tracks in the place of its videos."""
    shutil.rmtree(copy, ignore_errors=True)
    copy.mkdir(parents=True)
    text = (filmed / "session.toml").read_text()
    lines = [line for line in text.splitlines() if not line.startswith("boxes")]
    for number, line in enumerate(lines):
        if line.startswith("video = "):
            trial = Path(line.split('"')[1]).stem
            lines[number] = f'tracks = "{trial}.csv"'
            shutil.copy(filmed / "truth" / f"{trial}.csv", copy)
    (copy / "session.toml").write_text("\n".join([*lines, ""]))
    return copy


def _fitted(folder: Path, tracker: TrackerName | None, progress: Progress) -> tuple[str, ...]:
    """Where the tracks came from, their error an axis, the mean marker distance, and the error of each coefficient."""
    name = tracker or "perfect tracks"

    def report(message: str, share: float | None) -> None:
        progress(f"{name}: {message}", share)

    pipeline = Pipeline(open_session(folder), replace(Options(tracker=tracker), progress=report))
    calibration = pipeline.calibrated()
    errors = (found / true - 1 for found, true in zip(calibration.coefficients, PLAUSIBLE_COEFFICIENTS, strict=True))
    summary = calibration.summary("fit")
    assert summary is not None
    marker_mm = summary.marker_error_mm
    track_px = _track_rms(pipeline) if tracker else 0.0
    return name, f"{track_px:.3f}", f"{marker_mm:.2f}", *(f"{error:+.1%}" for error in errors)


def _track_rms(pipeline: Pipeline) -> float:
    """Error an axis of the samples that count, over all trials, px."""
    session: Session = pipeline.session
    squares = []
    for spec in session.trials:
        seen = pipeline.recordings.videos.tracks(spec)
        truth = np.loadtxt(session.folder / "truth" / f"{spec.name}.csv", delimiter=",", skiprows=1)[:, 1:]
        true_px = truth.reshape(len(truth), -1, 3)[..., :2]
        counts = counting(seen).confidence.values > 0
        squares.append(((pixels_of(seen) - true_px) ** 2)[counts].ravel())
    return float(np.sqrt(np.concatenate(squares).mean()))
