"""Simulations of a trial at known coefficients: the crank's phase, the forecast and its errors, starts from rest.

`fit_phase` sets the crank's phase by the first beats of the trial, `forecast` simulates it, and `score` takes the
distances as the public contract defines them. `swims_forward` tells whether a twin swims forward from rest.
"""

from typing import NamedTuple

import numpy as np

from fitting.pool import forward_speed, head_frame
from fitting.trial import MeasuredTrial
from swimcal.errors import SimulationDiverged
from swimcal.mjcf import FluidCoefficients
from swimcal.runs import Runs
from swimcal.twin import Twin, simulate_together
from tracking.head_frame import HeadFrame, select_head

SETTLED_S = 0.25  # time in which the tail forgets its start
BEATS_IN_STEP = 3.0  # beats that set the crank's phase
_REACH_RAD = 0.6  # largest error of the harmonic phase
_TRIES = (7, 5)  # phases tried in each round
_NEXT = 0.6  # reach of the second round, relative to the steps of the first
BEATS = 4.0  # beats simulated, of which the second half counts; 6 would classify 4 of 512 twins otherwise
FRAME_S = 1 / 30  # time between two frames of a start from rest
_FROM_REST_RAD = (0.0, np.pi / 2)  # first angles of the crank: the tail straight, and bent farthest


def swim(
    twin: Twin,
    trial: MeasuredTrial,
    coefficients: np.ndarray,
    phase_rad: np.ndarray,
    frequency_hz: float,
    frames: int | None = None,
) -> HeadFrame:
    """Simulate one trial s times, started with its own velocity.

    Args:
        twin: the twin, with the trial's markers.
        trial: n frames.
        coefficients: (s, 5).
        phase_rad: (s,) crank angle at time 0.
        frequency_hz: frequency of the crank, for all; a trial with a measured turn makes that instead.
        frames: number of frames from the first; default all n.

    Returns:
        Head frames (s, n, m, 2).
    """
    count = len(phase_rad)
    runs = Runs(
        coefficients=np.ascontiguousarray(coefficients),
        frequency_hz=np.full(count, frequency_hz),
        phase_rad=np.asarray(phase_rad, float),
        velocity=np.tile(trial.start_velocity, (count, 1)),
        turns=(trial.turn,) * count,
    )
    trajectories = twin.simulate(runs, trial.time_s[:frames], allow_divergence=True)
    return trial.seen_head(trajectories.marker_m)


def frames_in_step(trial: MeasuredTrial) -> slice:
    """Return the frames that set a trial's crank phase: three beats of its known part, after the start is forgotten.

    They begin where its tail is seen: a camera that was bumped, or a fish that comes in late, leaves the start unseen.
    """
    settled = np.flatnonzero(trial.known & (trial.time_s > SETTLED_S))
    seen = settled[trial.weight[settled][:, list(trial.tail)].any(axis=1)]
    first = seen[0] if len(seen) else settled[0]
    late_s = trial.time_s[first] - trial.time_s[settled[0]]
    end = SETTLED_S + late_s + BEATS_IN_STEP / trial.start_frequency.hz
    frames = settled[(settled >= first) & (trial.time_s[settled] <= end)]
    return slice(int(frames[0]), int(frames[-1]) + 1)


def phase_from_harmonic(twin: Twin, trial: MeasuredTrial, coefficients: np.ndarray, frequency_hz: float) -> np.ndarray:
    """Return the crank phases at time 0 (s,), rad, with which the tails beat in step with the measured one.

    One simulation at phase 0 gives the lag of the tail's first harmonic behind the crank.

    Args:
        twin: the twin.
        trial: the trial.
        coefficients: (s, 5).
        frequency_hz: frequency of the crank.
    """
    frames = frames_in_step(trial)
    simulated = swim(twin, trial, coefficients, np.zeros(len(coefficients)), frequency_hz, frames.stop)
    tail = list(trial.tail)
    turn = np.exp(-1j * trial.crank_rad(trial.time_s[frames], frequency_hz))[:, None]
    weight = trial.weight[frames][:, tail]  # (k, t)

    def harmonic(shape_m: np.ndarray) -> np.ndarray:
        lateral = np.nan_to_num(shape_m[..., frames, tail, 1])  # (..., k, t)
        mean = (weight * lateral).sum(axis=-2, keepdims=True) / np.maximum(weight.sum(axis=0), 1e-12)
        return (weight * (lateral - mean) * turn).sum(axis=-2)

    measured, modelled = harmonic(trial.head.shape_m), harmonic(simulated.shape_m)
    return np.angle((measured * modelled.conj()).sum(axis=-1))


def fit_phase(twin: Twin, trial: MeasuredTrial, coefficients: FluidCoefficients) -> float:
    """Estimate the crank phase at time 0 from the shape of the tail in the known part of the trial, rad.

    The harmonic phase is refined twice on a grid, all simulations of one in a batch, then by a parabola.

    Args:
        twin: the twin.
        trial: the trial.
        coefficients: coefficients of the twin.

    Raises:
        SimulationDiverged: the twin diverged at this frequency.
    """
    hz = trial.start_frequency.hz
    values = np.array([coefficients], float)
    centre, reach = float(phase_from_harmonic(twin, trial, values, hz)[0]), _REACH_RAD
    if not np.isfinite(centre):
        raise SimulationDiverged(f"trial {trial.name}: the twin diverged at {hz:.3g} Hz")
    frames = frames_in_step(trial)
    for count in _TRIES:
        tries = centre + np.linspace(-reach, reach, count)
        simulated = swim(twin, trial, np.repeat(values, count, axis=0), tries, hz, frames.stop)
        misfit = _shape_misfit(trial, simulated, frames)
        centre, reach = float(tries[np.argmin(misfit)]), _NEXT * float(tries[1] - tries[0])
    return _lowest(tries, misfit)


def forecast(twin: Twin, trial: MeasuredTrial, coefficients: FluidCoefficients, phase_rad: float) -> HeadFrame:
    """Simulate one trial at the frequency of its known part, and return the twin's head frame (n, m, 2).

    Args:
        twin: the twin.
        trial: the trial.
        coefficients: coefficients of the twin.
        phase_rad: angle of the crank at time 0.
    """
    values = np.array([coefficients], float)
    return select_head(swim(twin, trial, values, np.array([phase_rad]), trial.start_frequency.hz), 0)


def _lowest(tries: np.ndarray, misfit: np.ndarray) -> float:
    """Return the minimum of the parabola through the least of misfits (s,) at even steps and its neighbours.

    It is the place of the least misfit itself where a neighbour diverged or is no larger.
    """
    best = int(np.clip(np.argmin(misfit), 1, len(tries) - 2))
    before, least, after = misfit[best - 1 : best + 2]
    if not np.isfinite(before + least + after) or before - 2 * least + after <= 0:
        return float(tries[np.argmin(misfit)])
    off = np.clip(0.5 * (before - after) / (before - 2 * least + after), -1.0, 1.0)
    return float(tries[best] + off * (tries[1] - tries[0]))


def _shape_misfit(trial: MeasuredTrial, simulated: HeadFrame, frames: slice) -> np.ndarray:
    """Return the mean distance (s,) of the tail markers relative to the nose over some frames, less their mean offset.

    It is infinite where the twin diverged.
    """
    tail = list(trial.tail)
    weight = trial.weight[frames][:, tail]
    error = simulated.shape_m[:, frames][:, :, tail] - trial.head.shape_m[frames][:, tail]  # (s, k, t, 2)
    lost = ~np.isfinite(simulated.shape_m[:, frames][:, :, tail]).all(axis=(1, 2, 3))
    error = np.nan_to_num(error, nan=1.0)
    share = weight / np.maximum(weight.sum(axis=0), 1e-12)
    error = error - (share[..., None] * error).sum(axis=1, keepdims=True)
    found = (weight * np.linalg.norm(error, axis=-1)).sum(axis=(1, 2)) / weight.sum()
    return np.asarray(np.where(lost, np.inf, found))


# Distances between robot and twin.


class Scores(NamedTuple):
    """Mean marker distances of one trial.

    Attributes:
        marker_error_m: head frame, unflagged samples of the scored 4 s, aligned at the first frame of these, m.
        marker_error_all_m: the same over all samples, flagged ones too, m.
        shape_error_m: unflagged samples, relative to the nose in every frame that shows nose and neck, m.
        launch_free_error_m: marker_error_m without what a launch may do: a slip aside, and a steady turn, m.
        used_fraction: share of the samples that are not flagged.
    """

    marker_error_m: float
    marker_error_all_m: float
    shape_error_m: float
    launch_free_error_m: float
    used_fraction: float


def residuals(trial: MeasuredTrial, simulated: HeadFrame, frames: np.ndarray) -> np.ndarray:
    """Return the simulated minus the measured markers in the head frame, aligned as the trial says.

    Args:
        trial: n frames of m markers.
        simulated: (..., n, m, 2) at the same times; it may end after the last of the frames.
        frames: (n,) which frames.

    Returns:
        (..., k, m, 2) m.
    """
    simulated_frames = frames[: simulated.shape_m.shape[-3]]
    first = trial.aligned
    measured = trial.head.position_m[frames] - trial.head.path_m[first]
    moved = simulated.position_m[..., simulated_frames, :, :] - simulated.path_m[..., first : first + 1, None, :]
    return np.asarray(moved - measured)


def score(trial: MeasuredTrial, simulated: HeadFrame) -> Scores:
    """Return the marker distances of one trial from one simulation of it.

    Args:
        trial: n frames of m markers.
        simulated: (n, m, 2) head frame of the simulation at the same times.
    """
    frames = trial.scored
    error_m, time_s = residuals(trial, simulated, frames), trial.time_s[frames]  # (k, m, 2), (k,)
    distance = np.linalg.norm(error_m, axis=-1)  # (k, m)
    shape = np.linalg.norm(simulated.shape_m[frames] - trial.head.shape_m[frames], axis=-1)
    good, with_head = trial.own_weight[frames] > 0, trial.weight[frames] > 0
    return Scores(
        marker_error_m=_mean(distance, good),
        marker_error_all_m=_mean(distance, np.isfinite(distance)),
        shape_error_m=_mean(shape, with_head),
        launch_free_error_m=_mean(np.linalg.norm(_without_launch(error_m, time_s, good), axis=-1), good),
        used_fraction=float(good.mean()),
    )


def _without_launch(error_m: np.ndarray, time_s: np.ndarray, good: np.ndarray) -> np.ndarray:
    """Remove from errors of markers (k, m, 2), m, what a slip and a steady turn add across the body.

    A slip grows with time, a turn with its square; both are fitted to the mean over the good samples.

    Args:
        error_m: (k, m, 2) along and across the body, aligned in the first frame, m.
        time_s: (k,) s.
        good: (k, m) whether a sample counts.
    """
    since_s = time_s - time_s[0]
    launch = np.stack([since_s, since_s**2], axis=-1)  # (k, 2)
    frames = good.any(axis=1)
    across = np.where(good, error_m[..., 1], 0.0).sum(axis=1) / np.maximum(good.sum(axis=1), 1)  # (k,)
    grown = launch @ np.linalg.lstsq(launch[frames], across[frames], rcond=None)[0]
    return error_m - np.stack([np.zeros_like(grown), grown], axis=-1)[:, None]


def _mean(values: np.ndarray, good: np.ndarray) -> float:
    return float(values[good].mean()) if good.any() else float("nan")


# Starts from rest.


def probed_hz(trials: tuple[MeasuredTrial, ...]) -> float:
    """Return the slowest frequency of the trials, at which twins are started from rest."""
    return min(trial.frequency.hz for trial in trials)


def speed_from_rest(
    twin: Twin, coefficients: np.ndarray, frequency_hz: np.ndarray, phase_rad: float | np.ndarray = 0.0
) -> np.ndarray:
    """Return the forward speed (s, f) after half of some beats from rest, m/s, for s sets of coefficients (s, 5).

    Args:
        twin: the twin.
        coefficients: (s, 5).
        frequency_hz: (f,) frequencies of the crank.
        phase_rad: angle of the crank at first, one for all or (s,); at 0 the tail is straight.
    """
    count, times = len(coefficients), [np.arange(0.0, BEATS / hz, FRAME_S) for hz in frequency_hz]
    phase, values = np.broadcast_to(phase_rad, count).astype(float), np.asarray(coefficients, float)
    runs = [Runs(values, np.full(count, hz), phase) for hz in frequency_hz]
    speeds = np.zeros((count, len(times)))
    for i, swum in enumerate(simulate_together([twin] * len(runs), runs, times)):
        time_s, hz, head = times[i], frequency_hz[i], head_frame(twin.markers, swum.marker_m)
        speeds[:, i] = forward_speed(time_s, head, time_s >= BEATS / 2 / hz, hz)
    return speeds


def swims_forward(twin: Twin, coefficients: np.ndarray, trials: tuple[MeasuredTrial, ...]) -> np.ndarray:
    """Tell whether each set of coefficients (s, 5) swims forward from rest at the slowest of the trials, (s,).

    MuJoCo's fluid model has two steady states for many sets of coefficients: started at the measured speed such a twin
    follows the trials, started from rest it settles swimming backward. No trial that begins mid-swim can separate them,
    but the robot itself does: it starts from rest. In which direction a twin sets off depends on the crank's first
    angle, which nobody knows of the robot: so it is enough that the twin swims forward from one of two.

    It is always True when a trial itself was measured swimming backward.

    Args:
        twin: the twin.
        coefficients: (s, 5).
        trials: the trials.
    """
    if any(trial.speed <= 0 for trial in trials):
        return np.ones(len(coefficients), bool)
    return sets_off_forward(twin, coefficients, probed_hz(trials))


def sets_off_forward(twin: Twin, coefficients: np.ndarray, frequency_hz: float) -> np.ndarray:
    """Tell whether each set of coefficients (s, 5) swims forward from rest, from either angle of the crank, (s,).

    Args:
        twin: the twin.
        coefficients: (s, 5).
        frequency_hz: crank turns a second.
    """
    forward = np.zeros(len(coefficients), bool)
    for phase_rad in _FROM_REST_RAD:
        left = np.flatnonzero(~forward)
        if len(left):
            with np.errstate(invalid="ignore"):
                speed = speed_from_rest(twin, coefficients[left], np.array([frequency_hz]), phase_rad)
            forward[left] = speed[:, 0] > 0
    return forward
