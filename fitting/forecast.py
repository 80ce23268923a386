"""Forecasts of swims as features: conditional normals, and the tracks they make.

Fitted trials tell of a new one what all trials share: coefficients, marker places, the common discrepancy. Its own
first beats tell what is its own: trim, registration of the head frame, boxes. `forecast_new` conditions on both
(Rasmussen and Williams 2006, A.6); `forecast_repeat` forecasts another trial like a fitted one.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from fitting.covariance import Block, Covariance
from fitting.features import COURSE, SPEED, FeatureReader, advance_phase, marker_part, phase_between
from fitting.mode import Mode, jacobian_at, time_step_errors
from fitting.noise import FeatureNoise
from fitting.phase import SETTLED_S
from fitting.pool import waves
from fitting.trial import HARMONICS, MeasuredTrial
from fitting.trial_model import TrialModel, sensitivities_together, slope_of_phase
from swimcal.errors import NotEnoughData
from tracking.head_frame import HeadFrame

# The model's forecast of one window
NORMAL_90 = 1.645  # half the 90 % interval of a standard normal number
_FEWEST_FRAMES = 24  # least frames of a window
_DRAWS = 200  # draws of tracks, for their bands
_MEDIAN_OF_SQUARE = 0.4549  # median square of a standard normal number


# Forecasts of features, and their tracks.


@dataclass(frozen=True, eq=False)
class FeatureForecast:
    """Normal forecast of the features of a window.

    Attributes:
        window: the window that is forecast.
        mean, covariance: (k,) and (k, k) of its features.
        in_step: whether the forecast is put in step with the measured tail, so that its phase is not uncertain.
    """

    window: TrialModel
    mean: np.ndarray
    covariance: np.ndarray
    in_step: bool = True

    @property
    def speed(self) -> float:
        """Forward speed, m/s."""
        return float(self.mean[SPEED])

    @property
    def speed_sd(self) -> float:
        """Standard deviation of the forward speed, m/s."""
        return float(np.sqrt(self.covariance[SPEED, SPEED]))

    @cached_property
    def head(self) -> HeadFrame:
        """Forecast tracks in the head frame, (n, m, 2), of all frames of the trial."""
        return self.window.trial.seen_head(tracks_of(self.mean[None], self.window)[0])

    def inside(self, frames: np.ndarray, seed: int = 0) -> float:
        """Return the share of the measured samples within the 90 % bands of their tracks.

        Args:
            frames: (n,) frames that count.
            seed: seed of the bands.
        """
        trial = self.window.trial
        noise = np.random.default_rng([seed, 31]).standard_normal((_DRAWS, len(self.mean)))
        drawn = draws_about(self.mean, noise @ root_of(self.covariance))
        if self.in_step:
            drawn = advance_phase(drawn, phase_between(drawn, self.window.measured, list(trial.tail)))
        bands = _align(trial.seen_head(tracks_of(drawn, self.window)), frames)
        low, high = np.quantile(bands, [0.05, 0.95], axis=0)
        measured = _align(trial.head, frames)
        good = (trial.weight[frames] > 0) & np.isfinite(measured).all(axis=-1)
        return float(((measured >= low) & (measured <= high))[good].mean())


def root_of(covariance: np.ndarray) -> np.ndarray:
    """Return a matrix (k, k) whose transpose times itself is the covariance (k, k)."""
    values, vectors = np.linalg.eigh(covariance)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def draws_about(mean: np.ndarray, deviations: np.ndarray) -> np.ndarray:
    """Return features with given means and deviations, their phase turned instead of added.

    A phase is uncertain by half a radian: along its tangent that would make every amplitude larger.

    Args:
        mean: (..., k) means.
        deviations: (..., k) deviations from them.
    """
    tangent = slope_of_phase(mean)
    phase = (deviations * tangent).sum(axis=-1) / np.maximum((tangent**2).sum(axis=-1), 1e-300)
    return advance_phase(mean + deviations - phase[..., None] * tangent, phase)


def tracks_of(features: np.ndarray, window: TrialModel) -> np.ndarray:
    """Return the markers (d, n, m, 2) on the pool that have given features, m.

    Each marker beats about its mean in a frame that goes forward and sideways, and turns, at steady rates.

    Args:
        features: (d, k) features with a course.
        window: window whose trial gives the n frames.
    """
    trial = window.trial
    turn_rad = trial.crank_rad(trial.time_s, trial.frequency.hz)
    columns = np.column_stack([np.ones(len(turn_rad)), waves(turn_rad, HARMONICS)])  # (n, 7)
    beats = np.einsum("nc,dmac->dnma", columns, marker_part(features))
    place = beats[..., 0] + 1j * beats[..., 1]
    sideways, turning = features[:, -len(COURSE) :].T
    heading = np.exp(1j * np.multiply.outer(turning, trial.time_s))  # (d, n)
    speed = (features[:, SPEED] + 1j * sideways)[:, None] * heading
    steps = 0.5 * (speed[:, 1:] + speed[:, :-1]) * np.diff(trial.time_s)
    path = np.concatenate([np.zeros((len(features), 1)), np.cumsum(steps, axis=1)], axis=1)
    position = path[..., None] + place * heading[..., None]
    return np.stack([position.real, position.imag], axis=-1)


# Forecasts of a window, given the fitted trials and its own first beats.


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of a held-out trial at the frequency of its first beats.

    Attributes:
        early: its known part; None where that is too short.
        late: its kept frames.
    """

    early: TrialModel | None
    late: TrialModel

    @classmethod
    def of(cls, mode: Mode, trial: MeasuredTrial) -> "Windows":
        """Divide a trial that was not fitted into its windows.

        Raises:
            NotEnoughData: nose and neck are hardly seen in the kept frames.
        """
        late = mode.model.trials[0].of_other(replace(trial, frequency=trial.start_frequency))
        known = trial.known & (trial.time_s > SETTLED_S)
        early = replace(late, trial=replace(late.trial, kept=known))
        try:
            both = early.reader.read & late.reader.read
        except NotEnoughData:
            _ = late.reader
            return cls(None, late)
        return cls(early if known.sum() >= _FEWEST_FRAMES and both[list(trial.tail)].any() else None, late)


class Scatter(NamedTuple):
    """Scatter of the windows of a trial.

    Attributes:
        noise: squared differences relative to tracking noise, at least 1.
        speed: relative standard deviation of a window's speed.
    """

    noise: float = 1.0
    speed: float = 0.03


EVEN = Scatter()
"""Scatter of a fish of which nothing is known."""


def forecast_repeat(mode: Mode, number: int) -> FeatureForecast:
    """Forecast a repeat of a fitted trial: all that is a trial's own is drawn anew."""
    again = mode.blocks[number]._replace(trial=len(mode.blocks), features=mode.simulated(number))
    rows = len(again.features)
    return _condition(mode, again, mode.jacobian[number * rows :][:rows], None)


def diverges(mode: Mode, trial: MeasuredTrial) -> bool:
    """Tell whether the twin at the mode diverges in a trial that was not fitted, whatever the crank's first angle.

    Args:
        mode: the fit.
        trial: the trial.

    Raises:
        NotEnoughData: nose and neck are hardly seen in the kept frames.
    """
    window = set_off(mode, Windows.of(mode, trial).late)
    return not np.isfinite(window.simulated(mode.coefficients[None])).all()


def set_off(mode: Mode, window: TrialModel) -> TrialModel:
    """Return the window with a twin that goes the trial's way at the mode, else with one that does not diverge.

    Args:
        mode: the fit.
        window: a window of a trial that was not fitted.
    """
    either = (window, replace(window, phase_rad=window.phase_rad + np.pi / 2))
    backward, found = bool(window.trial.start_velocity[0] > 0), []
    for each in either:
        speed = float(each.simulated(mode.coefficients[None])[0, SPEED])
        if np.isfinite(speed) and (speed < 0) == backward:
            return each
        found += [each] if np.isfinite(speed) else []
    return [*found, window][0]


def forecast_new(
    mode: Mode, windows: Windows, scatter: Scatter = EVEN
) -> tuple[FeatureForecast, FeatureForecast | None]:
    """Forecast a new trial from its frequency and the fitted trials; and from its own early window, too.

    Near a second steady state the crank's first angle decides whether a twin swims forward: see `set_off`.

    Args:
        mode: the fit.
        windows: windows of the trial.
        scatter: scatter of windows.

    Returns:
        The forecast without the early window, in step with the trial's tail, and with it; None where there is none.
    """
    window = set_off(mode, windows.late)
    block, jacobian = block_of(mode, window, scatter), jacobian_at([window], mode.coefficients)
    found = _condition(mode, block, jacobian, None)
    if windows.early is None:
        return found, None
    return found, _condition(mode, block, jacobian, _early_block(mode, windows.early, block, scatter))


@lru_cache(maxsize=4)
def scatter_of(mode: Mode) -> Scatter:
    """Estimate the scatter of windows from the fitted trials, each divided after its first two beats.

    For the speed the default counts as one more trial.
    """
    noise, speed = [], [EVEN.speed**2]
    for block in mode.blocks:
        try:
            windows = Windows.of(mode, block.model.trial.with_role("holdout"))
        except NotEnoughData:
            continue
        if windows.early is None:
            continue
        difference = windows.early.measured - windows.late.measured
        of_tracks = np.sum([np.diag(_tracking_noise(mode, each)) for each in (windows.early, windows.late)], axis=0)
        both = windows.early.reader.observed & windows.late.reader.observed
        noise.append(float(np.median(difference[both] ** 2 / of_tracks[both])) / _MEDIAN_OF_SQUARE)
        speed.append(float((difference[SPEED] / block.features[SPEED]) ** 2 / 2))
    return Scatter(max(1.0, float(np.mean(noise))) if noise else 1.0, float(np.sqrt(np.mean(speed))))


def block_of(mode: Mode, window: TrialModel, scatter: Scatter) -> Block:
    """Return the block of a window of a new trial; its features are what the twin simulates.

    Args:
        mode: the fit.
        window: the window.
        scatter: scatter of windows.
    """
    motion = window.trajectories(mode.coefficients[None])
    (sensitivities,) = sensitivities_together([window], mode.coefficients, [motion])
    (time_step,) = time_step_errors([window], mode.coefficients, [motion])
    simulated = window.features_of(motion)[0]
    noise = _noise(mode, window, scatter, simulated)
    return Block(window, sensitivities, noise, time_step, len(mode.blocks), simulated)


def _early_block(mode: Mode, window: TrialModel, late: Block, scatter: Scatter) -> tuple[Block, float]:
    """Return the block of the first beats of a new trial, and their phase ahead of the late window.

    Both are windows of one steady swim: the twin's start, which is not the fish's, is not simulated.
    """
    phase = float(phase_between(late.features, window.measured, list(window.trial.tail)))
    parts = {name: part for name, part in late.sensitivities._asdict().items() if name != "spans"}
    columns = {name: advance_phase(part.T, phase).T for name, part in parts.items()}
    sensitivities = late.sensitivities._replace(**columns)
    features, time_step = (advance_phase(each, phase) for each in (late.features, late.time_step))
    noise = _noise(mode, window, scatter, features)
    return Block(window, sensitivities, noise, time_step, late.trial, features), phase


def _noise(mode: Mode, window: TrialModel, scatter: Scatter, simulated: np.ndarray) -> np.ndarray:
    """Return the covariance (k, k) of a window by noise like the fitted trials' and by the windows' scatter."""
    found = scatter.noise * _tracking_noise(mode, window)
    found[SPEED, SPEED] += (scatter.speed * simulated[SPEED]) ** 2
    return found


def _tracking_noise(mode: Mode, window: TrialModel) -> np.ndarray:
    reader: FeatureReader = window.reader
    return FeatureNoise.typical([block.model.noise for block in mode.blocks], reader.time_s).covariance(reader)


def _condition(mode: Mode, late: Block, jacobian: np.ndarray, early: tuple[Block, float] | None) -> FeatureForecast:
    """Condition a block on the fitted trials and, where there is one, on an early window of its trial.

    The early window is ahead by a phase. The coefficients stay those of the fit, with its covariance: an update of them
    by the wider discrepancy of forecasts would be linear, and leads far off where they are uncertain.
    """
    blocks, rows, residual = [*mode.blocks, late], [mode.jacobian, jacobian], mode.residual
    if early is not None:
        block, phase = early
        blocks, rows = [*blocks, block], [*rows, advance_phase(jacobian.T, phase).T]
        residual = np.append(residual, block.model.measured - block.features)
    total = Covariance.of(blocks, mode.blocks).at(mode.forecast_sizes)
    slopes, count, length = np.vstack(rows), len(mode.residual), len(late.features)
    asked = np.arange(count, count + length)
    known = np.delete(np.arange(len(total)), asked)
    factor = cho_factor(total[np.ix_(known, known)], lower=True)
    gain = cho_solve(factor, total[np.ix_(known, asked)]).T
    covariance = total[np.ix_(asked, asked)] - gain @ total[np.ix_(known, asked)]
    of_coefficients = slopes[asked] - gain @ slopes[known]
    covariance += of_coefficients @ mode.coefficient_covariance @ of_coefficients.T
    return FeatureForecast(late.model, late.features + gain @ residual, covariance, in_step=early is None)


def _align(head: HeadFrame, frames: np.ndarray) -> np.ndarray:
    """Return the positions (..., k, m, 2) in the head frame, displacement counted from the first of the frames (n,)."""
    first = int(np.flatnonzero(frames)[0])
    path = head.path_m[..., frames, :] - head.path_m[..., first : first + 1, :]
    return np.asarray(head.shape_m[..., frames, :, :] + path[..., None, :])
