"""Elongated body theory fitted to the fit trials, and its forecast of a trial's speed from its measured tail."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from fitting.speed import whole_beats
from fitting.trial import MeasuredTrial, tail_markers
from session import Flag
from swimmer import RobotSpec, TailMotion, steady_speed
from swimmer.ebt import BETA_BOUNDS, DRAG_BOUNDS


@dataclass(frozen=True)
class EbtFit:
    """Elongated body theory with its two numbers, of which only the ratio is identifiable.

    Attributes:
        beta: shape factor of the added mass, kept at 1 within its published bounds [0.9, 1.1].
        drag_coefficient: c_D, on the reference area of the robot, within its published bounds [0, 10].
        flags: what is doubtful, the ratio first of all.
    """

    beta: float
    drag_coefficient: float
    flags: tuple[Flag, ...]

    def speed(self, motion: TailMotion, robot: RobotSpec) -> np.ndarray:
        """The steady speed for a tail motion, m/s."""
        return steady_speed(motion, robot, self.beta, self.drag_coefficient)


def fit_ebt(motions: list[TailMotion], speeds: np.ndarray, robot: RobotSpec) -> EbtFit:
    """Least squares on the speed of the fit trials, over c_D / beta.

    Args:
        motions: of each fit trial.
        speeds: (t,) measured, m/s.
        robot: depth, reference area and water.
    """
    motion = TailMotion(*(np.array(column) for column in zip(*motions, strict=True)))

    def misfit(ratio: float) -> float:
        return float(((steady_speed(motion, robot, 1.0, ratio) - speeds) ** 2).sum())

    highest = DRAG_BOUNDS[1] / BETA_BOUNDS[0]
    grid = np.concatenate([[0.0], np.geomspace(1e-3, highest, 200)])
    best = int(np.argmin([misfit(ratio) for ratio in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(misfit, bounds=(low, high), method="bounded", options={"xatol": 1e-6})
    ratio = float(found.x)
    beta = min(1.0, DRAG_BOUNDS[1] / ratio) if ratio > 0 else 1.0
    return EbtFit(beta, ratio * beta, _flags(ratio, highest))


def measured_tail_motion(trial: MeasuredTrial, robot: RobotSpec, frames: np.ndarray) -> TailMotion:
    """<h_t^2> and <h_x^2> of the tail tip over the whole beats of the frames, in the head frame, as published.

    The lateral speed is the finite difference of the last marker between neighbouring frames; the slope is that of
    the line through the last two tail markers. Samples of weight 0 are left out.
    """
    tail = tail_markers(robot, trial.markers)[-2:]
    return tail_motion(trial.time_s, trial.head.shape_m[:, tail], trial.weight[:, tail], frames, trial.frequency.hz)


def tail_motion(
    time_s: np.ndarray, tip_m: np.ndarray, weight: np.ndarray, frames: np.ndarray, frequency_hz: float
) -> TailMotion:
    """Mean squares of the tail tip's lateral speed and slope.

    Args:
        time_s: (n,) s.
        tip_m: (n, 2, 2) the last two markers in the head frame, m.
        weight: (n, 2) 0 leaves a sample out.
        frames: (n,) frames allowed; whole beats of them are used.
        frequency_hz: beats a second.
    """
    used = whole_beats(time_s, frames, frequency_hz)
    good = (weight > 0) & np.isfinite(tip_m).all(axis=-1)
    before, tip = tip_m[:, 0], tip_m[:, 1]
    rate = np.diff(tip[:, 1]) / np.diff(time_s)  # (n - 1,)
    rate_good = used[1:] & used[:-1] & good[1:, 1] & good[:-1, 1]
    step = tip - before
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = step[:, 1] / step[:, 0]
    slope_good = used & good.all(axis=1) & (np.abs(step[:, 0]) > 1e-6)
    return TailMotion(_mean_square(rate[rate_good]), _mean_square(slope[slope_good]))


def _mean_square(values: np.ndarray) -> np.ndarray:
    return np.array((values**2).mean() if len(values) else np.nan)


def _flags(ratio: float, highest: float) -> tuple[Flag, ...]:
    only_ratio = "only c_D / beta is identifiable from the speed; beta is kept at 1"
    flags = [Flag("unidentifiable", message=f"EBT: {only_ratio} (c_D / beta = {ratio:.3g})")]
    if ratio < 1e-3 or ratio > 0.999 * highest:
        flags.append(Flag("at_bound", message=f"EBT: c_D / beta = {ratio:.3g} lies at its bound"))
    return tuple(flags)
