"""The published objective, made smooth: mean marker distance in the head frame over all fit trials jointly.

The parameters are the five coefficients and the crank phase of each trial; the frequency of each trial is the
measured one. Every column of parameters is one simulation of each trial, run in one batch on all cores.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from mujoco.minimize import Norm

from fitting.scoring import residuals
from fitting.trial import MeasuredTrial
from swimmer import Runs, Twin
from tracking import HeadFrame, to_head_frame

COEFFICIENT_BOUNDS = (0.0, 10.0)
SOFTENING_M = 0.004  # below this distance the objective is quadratic, above it grows like the distance
SETTLED_S = 0.25  # the tail has forgotten its start by then
BEATS_IN_STEP = 3.0
LOST_M = 1.0  # distance that stands for a simulation that blew up


Comparison = Literal["published", "shape", "yaw"]


@dataclass(frozen=True, eq=False)
class Swims:
    """The trials a set of parameters is compared with, and the twin that swims them.

    Attributes:
        twin: with the markers of the trials.
        trials: to be compared with.
        comparison: "published": distance in the head frame, aligned at the first scored frame. "shape": relative to
            the nose in every frame, so that a drift of the path does not hide the tail. "yaw": as published, after
            one turn of each trial's head frame about its nose, the best one for the simulation at hand (the nose and
            neck boxes are placed by hand, so the measured axis may be off by some degrees).
    """

    twin: Twin
    trials: tuple[MeasuredTrial, ...]
    comparison: Comparison = "published"

    def simulate(self, parameters: np.ndarray) -> list[HeadFrame]:
        """Head frames (s, k, m, 2) of each trial for s columns of parameters (p, s); what diverges is nan.

        All trials run in one batch, each until the last of its k frames that is scored.
        """
        count, frames = parameters.shape[1], [int(np.flatnonzero(t.scored)[-1]) + 1 for t in self.trials]
        times = [
            np.pad(t.time_s[:n], (0, max(frames) - n), mode="edge") for t, n in zip(self.trials, frames, strict=True)
        ]
        runs = Runs(
            coefficients=np.tile(parameters[:5].T, (len(self.trials), 1)),
            frequency_hz=np.repeat([t.frequency.hz for t in self.trials], count),
            phase_rad=parameters[5:].reshape(-1),
            velocity=np.repeat([t.start_velocity for t in self.trials], count, axis=0),
        )
        markers = self.twin.simulate(runs, np.repeat(times, count, axis=0), allow_divergence=True).marker_m
        parts = np.split(markers, len(self.trials))
        return [head_frame(trial, part[:, :n]) for trial, part, n in zip(self.trials, parts, frames, strict=True)]

    def errors(self, parameters: np.ndarray) -> np.ndarray:
        """(2 e, s) components of the e weighted marker errors, m: x and y of one marker follow each other.

        Args:
            parameters: (p, s) coefficients, then a phase a trial (rad).
        """
        parts = []
        for trial, simulated in zip(self.trials, self.simulate(parameters), strict=True):
            error = self.compare(trial, simulated)[:, trial.weight[trial.scored] > 0]  # (s, e, 2)
            parts.append(np.nan_to_num(error, nan=LOST_M).reshape(len(error), -1).T)
        return np.concatenate(parts)

    def compare(self, trial: MeasuredTrial, simulated: HeadFrame) -> np.ndarray:
        """(s, k, m, 2) simulated minus measured over the k scored frames of one trial, m."""
        if self.comparison == "shape":
            frames = trial.scored[: simulated.shape_m.shape[-3]]
            return simulated.shape_m[..., frames, :, :] - trial.head.shape_m[trial.scored]
        error = residuals(trial, simulated, trial.scored)
        if self.comparison == "published":
            return error
        measured = scored_trajectory(trial)
        turned = turn(measured, best_yaw(error + measured, measured, trial.weight[trial.scored])[:, None, None])
        return error + measured - turned

    def yaws(self, parameters: np.ndarray) -> np.ndarray:
        """(s, t) best turn of each trial's measured head frame for (p, s) parameters, rad, counter-clockwise."""
        angles = []
        for trial, simulated in zip(self.trials, self.simulate(parameters), strict=True):
            measured = scored_trajectory(trial)
            error = residuals(trial, simulated, trial.scored)
            angles.append(best_yaw(error + measured, measured, trial.weight[trial.scored]))
        return np.stack(angles, axis=1)

    @property
    def norm(self) -> "MeanDistance":
        """The objective as a function of the errors: the mean over trials of the mean over samples."""
        weights = [trial.weight[trial.scored] for trial in self.trials]
        return MeanDistance(np.concatenate([w[w > 0] / (len(weights) * w.sum()) for w in weights]))

    def mean_distance(self, parameters: np.ndarray) -> np.ndarray:
        """(s,) the objective itself for (p, s) parameters: mean distance a trial, mean over trials, m."""
        total = np.zeros(parameters.shape[1])
        for trial, simulated in zip(self.trials, self.simulate(parameters), strict=True):
            distance = np.linalg.norm(self.compare(trial, simulated), axis=-1)  # (s, k, m)
            good = trial.weight[trial.scored] > 0
            total += np.nan_to_num(distance[:, good], nan=LOST_M).mean(axis=1)
        return total / len(self.trials)


def swim(
    twin: Twin,
    trial: MeasuredTrial,
    coefficients: np.ndarray,
    phase_rad: np.ndarray,
    frequency_hz: float,
    frames: int | None = None,
) -> HeadFrame:
    """Head frames (s, n, m, 2) of s simulations of one trial, started with its own velocity.

    Args:
        twin: with the trial's markers.
        trial: n frames.
        coefficients: (s, 5).
        phase_rad: (s,) crank angle at time 0.
        frequency_hz: of the crank, for all.
        frames: only so many from the first; default all n.
    """
    count = len(phase_rad)
    runs = Runs(
        coefficients=np.ascontiguousarray(coefficients),
        frequency_hz=np.full(count, frequency_hz),
        phase_rad=np.asarray(phase_rad, float),
        velocity=np.tile(trial.start_velocity, (count, 1)),
    )
    trajectories = twin.simulate(runs, trial.time_s[:frames], allow_divergence=True)
    return head_frame(trial, trajectories.marker_m)


def head_frame(trial: MeasuredTrial, marker_m: np.ndarray) -> HeadFrame:
    """Simulated markers (..., k, m, 2) of a trial in the head frame."""
    return to_head_frame(marker_m, trial.markers.index("nose"), trial.markers.index("neck"))


def scored_trajectory(trial: MeasuredTrial) -> np.ndarray:
    """(k, m, 2) measured markers of the scored frames in the head frame, displacement counted from the first, m."""
    path = trial.head.path_m[trial.scored]
    return trial.head.shape_m[trial.scored] + (path - path[0])[:, None, :]


def best_yaw(simulated: np.ndarray, measured: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(s,) turn of the measured markers (k, m, 2) that brings them closest to simulated ones (s, k, m, 2), rad.

    Closest in mean distance: a weighted Procrustes rotation about the origin, reweighted a few times.
    """
    known, weight = np.nan_to_num(measured), np.where(np.isfinite(measured).all(axis=-1), weight, 0.0)
    angle = np.zeros(len(simulated))
    for _ in range(4):
        distance = np.linalg.norm(simulated - turn(known, angle[:, None, None]), axis=-1)
        pull = np.nan_to_num(weight / np.sqrt(distance**2 + SOFTENING_M**2))
        cross = known[..., 0] * simulated[..., 1] - known[..., 1] * simulated[..., 0]
        dot = (known * simulated).sum(axis=-1)
        angle = np.arctan2((pull * np.nan_to_num(cross)).sum(axis=(1, 2)), (pull * np.nan_to_num(dot)).sum(axis=(1, 2)))
    return angle


def turn(points: np.ndarray, angle_rad: np.ndarray) -> np.ndarray:
    """(..., 2) points turned counter-clockwise about the origin; the angles broadcast against the leading axes."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x, y = points[..., 0], points[..., 1]
    return np.stack([x * cos - y * sin, x * sin + y * cos], axis=-1)


class MeanDistance(Norm):
    """sum of w (sqrt(d^2 + s^2) - s) over weighted distances d: their mean, made smooth where they vanish.

    The curvature handed to Gauss-Newton is that of the reweighted quadratic that touches this function from above,
    so that a full step always descends (iteratively reweighted least squares; Weiszfeld 1937).

    Args:
        weight: (e,) of each error, adding up to 1.
    """

    def __init__(self, weight: np.ndarray) -> None:
        self._weight = weight

    def value(self, r: np.ndarray) -> np.float64:
        """The objective, m, for errors r (2 e, 1), m."""
        smooth = np.sqrt(self._distance_sq(r) + SOFTENING_M**2)
        return np.float64(self._weight @ (smooth - SOFTENING_M))

    def grad_hess(self, r: np.ndarray, proj: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (p, 1) and curvature (p, p) after projection on proj (2 e, p)."""
        pull = np.repeat(self._weight / np.sqrt(self._distance_sq(r) + SOFTENING_M**2), 2)[:, None]
        return proj.T @ (pull * r), proj.T @ (pull * proj)

    def _distance_sq(self, r: np.ndarray) -> np.ndarray:
        return (r.reshape(-1, 2) ** 2).sum(axis=1)


def frames_in_step(trial: MeasuredTrial) -> slice:
    """The frames that set a trial's crank phase: of its known part, after the start is forgotten, three beats."""
    end = SETTLED_S + BEATS_IN_STEP / trial.start_frequency.hz
    frames = np.flatnonzero(trial.known & (trial.time_s > SETTLED_S) & (trial.time_s <= end))
    return slice(int(frames[0]), int(frames[-1]) + 1)


def phase_from_harmonic(twin: Twin, trial: MeasuredTrial, coefficients: np.ndarray, frequency_hz: float) -> np.ndarray:
    """Crank phases at time 0 that bring the twin's tail in step with the measured one.

    One simulation at phase 0 tells how far the tail's first harmonic lags behind the crank.

    Args:
        twin, trial, frequency_hz: as for `swim`.
        coefficients: (s, 5).

    Returns:
        (s,) rad.
    """
    frames = frames_in_step(trial)
    simulated = swim(twin, trial, coefficients, np.zeros(len(coefficients)), frequency_hz, frames.stop)
    tail = list(trial.tail)
    turn = np.exp(-2j * np.pi * frequency_hz * trial.time_s[frames])[:, None]
    weight = trial.weight[frames][:, tail]  # (k, t)

    def harmonic(shape_m: np.ndarray) -> np.ndarray:
        lateral = np.nan_to_num(shape_m[..., frames, tail, 1])  # (..., k, t)
        mean = (weight * lateral).sum(axis=-2, keepdims=True) / np.maximum(weight.sum(axis=0), 1e-12)
        return (weight * (lateral - mean) * turn).sum(axis=-2)

    measured, modelled = harmonic(trial.head.shape_m), harmonic(simulated.shape_m)
    return np.angle((measured * modelled.conj()).sum(axis=-1))
