"""Distances between measured and simulated markers, as the public contract defines them."""

from typing import NamedTuple

import numpy as np

from fitting.trial import MeasuredTrial
from tracking import HeadFrame


class Scores(NamedTuple):
    """Mean marker distances of one trial.

    Attributes:
        marker_error_m: head frame, unflagged samples of the scored 4 s, aligned at the first kept frame, m.
        marker_error_all_m: the same over all samples, flagged ones too, m.
        shape_error_m: unflagged samples, relative to the nose in every frame, m.
        used_fraction: share of the samples that are not flagged.
    """

    marker_error_m: float
    marker_error_all_m: float
    shape_error_m: float
    used_fraction: float


def residuals(trial: MeasuredTrial, simulated: HeadFrame, frames: np.ndarray) -> np.ndarray:
    """Simulated minus measured in the head frame, aligned at the first of the frames.

    Args:
        trial: n frames of m markers.
        simulated: (..., n, m, 2) at the same times; it may end after the last of the frames.
        frames: (n,) which frames.

    Returns:
        (..., k, m, 2) m.
    """
    simulated_frames = frames[: simulated.shape_m.shape[-3]]
    first = int(np.flatnonzero(frames)[0])
    measured_path = trial.head.path_m[frames] - trial.head.path_m[first]
    simulated_path = simulated.path_m[..., simulated_frames, :] - simulated.path_m[..., first : first + 1, :]
    shape = simulated.shape_m[..., simulated_frames, :, :] - trial.head.shape_m[frames]
    return shape + (simulated_path - measured_path)[..., None, :]


def score(trial: MeasuredTrial, simulated: HeadFrame) -> Scores:
    """The distances of one trial from one simulation of it, (n, m, 2) at the same times."""
    frames = trial.scored
    distance = np.linalg.norm(residuals(trial, simulated, frames), axis=-1)  # (k, m)
    shape = np.linalg.norm(simulated.shape_m[frames] - trial.head.shape_m[frames], axis=-1)
    good = trial.weight[frames] > 0
    return Scores(
        marker_error_m=_mean(distance, good),
        marker_error_all_m=_mean(distance, np.isfinite(distance)),
        shape_error_m=_mean(shape, good),
        used_fraction=float(good.mean()),
    )


def _mean(values: np.ndarray, good: np.ndarray) -> float:
    return float(values[good].mean()) if good.any() else float("nan")
