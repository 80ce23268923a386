"""Cost of the tracker's error in each coefficient: a known swimmer filmed, tracked and fitted.

It is fitted on perfect tracks for comparison. The swimmer is the twin at a finer step, so what the twin leaves out of
real water costs nothing here.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.cases import Progress
from benchmarks.scores import Table
from benchmarks.video.filmed import SessionVideo
from calib.options import Options
from calib.pipeline import Pipeline, open_session
from swimcal.mjcf import FluidCoefficients
from swimcal.tracks import pixels_of
from swimsynth.disturbances import NOISELESS
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS, SyntheticCamera, SyntheticPlan, SyntheticTrial, trial_name
from swimsynth.session import make_session
from tracking.follow_video import TrackerName
from tracking.tracked import mask_untrusted

SPEEDS_HZ = (0.6, 1.0, 1.4)
SECONDS = 5.5  # duration of each swim
_SEED = 0  # It draws the crank phases and the pictures.


def cost_table(folder: Path, crf: float, trackers: tuple[TrackerName, ...], progress: Progress) -> Table:
    """Film a swimmer at three speeds, and fit it from perfect tracks and from each tracker's.

    Sessions that are in the folder are used again. The videos are H.264 of quality `crf`.
    """
    plan, filmed, perfect = _plan(), folder / f"filmed-{crf:g}", folder / "perfect"
    if not filmed.exists():
        make_session(filmed, plan, SessionVideo(crf=crf), lambda name, i, of: progress(f"filming {name}", i / of))
    if not perfect.exists():
        make_session(perfect, plan.model_copy(update={"noise": NOISELESS}))
    rows = [_fit(perfect, None, progress), *(_fit(filmed, tracker, progress) for tracker in trackers)]
    caption = f"A known swimmer, filmed at {', '.join(map(str, SPEEDS_HZ))} Hz and fitted: error of each coefficient"
    return Table(caption, ("fitted from", "rms px", "marker mm", *FluidCoefficients._fields), tuple(rows))


def _plan() -> SyntheticPlan:
    random = np.random.default_rng(_SEED)
    trials = tuple(
        SyntheticTrial(
            name=trial_name("f", hz),
            frequency_hz=hz,
            commanded_hz=hz,
            seconds=SECONDS,
            phase_rad=round(float(2 * np.pi * random.random()), 3),
            heading_rad=round(float(np.pi + random.uniform(-0.2, 0.2)), 3),
        )
        for hz in SPEEDS_HZ
    )
    return SyntheticPlan(trials=trials, seed=_SEED, camera=SyntheticCamera(width_px=1920, height_px=1080))


def _fit(folder: Path, tracker: TrackerName | None, progress: Progress) -> tuple[str, ...]:
    """Return the origin of the tracks, their error an axis, the mean marker distance, and each coefficient's error."""
    name = tracker or "perfect tracks"

    def report(message: str, share: float | None) -> None:
        progress(f"{name}: {message}", share)

    pipeline = Pipeline(open_session(folder), replace(Options(tracker=tracker), progress=report))
    calibration = pipeline.fits.current()
    errors = (found / true - 1 for found, true in zip(calibration.coefficients, PLAUSIBLE_COEFFICIENTS, strict=True))
    summary = calibration.summary("fit")
    assert summary is not None
    marker_mm = summary.marker_error_mm
    track_px = _measure_rms(pipeline) if tracker else 0.0
    return name, f"{track_px:.3f}", f"{marker_mm:.2f}", *(f"{error:+.1%}" for error in errors)


def _measure_rms(pipeline: Pipeline) -> float:
    """Return the error an axis of the samples that count, over all trials, px."""
    session, squares = pipeline.session, []
    for spec in session.trials:
        seen = pipeline.recordings.videos.tracks(spec)
        truth = np.loadtxt(session.folder / "truth" / f"{spec.name}.csv", delimiter=",", skiprows=1)[:, 1:]
        true_px = truth.reshape(len(truth), -1, 3)[..., :2]
        counts = mask_untrusted(seen).confidence.values > 0
        squares.append(((pixels_of(seen) - true_px) ** 2)[counts].ravel())
    return float(np.sqrt(np.concatenate(squares).mean()))
