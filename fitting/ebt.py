"""Elongated body theory in three forms, each fitted to the fit trials by the same search over its one free number."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from fitting.speed import forward_speed
from fitting.tail_tip import TailSwim, measured_tail, published_motion, simulated_tail, smoothed_motion, tip_motion
from fitting.trial import MeasuredTrial
from session import Flag
from swimmer import RobotSpec
from swimmer.ebt import BETA_BOUNDS, DRAG_BOUNDS, steady_speed, steady_speed_large
from tracking import HeadFrame

EBT_RATIO_ONLY = "ebt_ratio_only"
"""The flag that names what is not identifiable in elongated body theory; every fit of it has it."""


@dataclass(frozen=True)
class EbtForm:
    """One way to use the theory.

    Attributes:
        name: for results.
        label: for people.
        motion: what it takes from a tail.
        speed: the steady speed (m/s) for that motion, a robot, beta and c_D.
    """

    name: str
    label: str
    motion: Callable[[TailSwim], Any]
    speed: Callable[[Any, RobotSpec, float, float], Any]


PUBLISHED = EbtForm("published", "steady, finite difference (as published)", published_motion, steady_speed)
SMOOTHED = EbtForm("smoothed", "steady, smoothed derivative", smoothed_motion, steady_speed)
LARGE = EbtForm("large", "large amplitude, smoothed derivative", tip_motion, steady_speed_large)
FORMS = (PUBLISHED, SMOOTHED, LARGE)
FROM_TWIN = ", twin's tail"  # after the name of a form that predicts from the tail of the twin


@dataclass(frozen=True)
class EbtFit:
    """Elongated body theory with its two numbers, of which only the ratio is identifiable.

    Attributes:
        form: the way it is used.
        beta: shape factor of the added mass, kept at 1 within its published bounds [0.9, 1.1].
        drag_coefficient: c_D, on the reference area of the robot, within its published bounds [0, 10].
        flags: that only the ratio is identifiable, and others.
    """

    form: EbtForm
    beta: float
    drag_coefficient: float
    flags: tuple[Flag, ...] = ()

    def speed(self, swim: TailSwim, robot: RobotSpec) -> float:
        """The steady speed for a measured or simulated tail, m/s."""
        return float(self.form.speed(self.form.motion(swim), robot, self.beta, self.drag_coefficient))


def fit_ebt(form: EbtForm, swims: Sequence[TailSwim], speeds: np.ndarray, robot: RobotSpec) -> EbtFit:
    """Least squares on the speed of the fit trials, over c_D / beta; trials that do not show the tail tip are left out.

    Args:
        form: the way the theory is used.
        swims: tail of each fit trial.
        speeds: (t,) measured, m/s.
        robot: depth, reference area and water.
    """
    motions = [form.motion(swim) for swim in swims]
    seen = np.array([np.isfinite(float(form.speed(motion, robot, 1.0, 1.0))) for motion in motions])
    if not seen.any():
        message = "EBT: the last two tail markers are usable in no fit trial"
        return EbtFit(form, float("nan"), float("nan"), (Flag(EBT_RATIO_ONLY, message=message),))

    def misfit(ratio: float) -> float:
        predicted = np.array([float(form.speed(motion, robot, 1.0, ratio)) for motion in motions])
        return float(((predicted - speeds)[seen] ** 2).sum())

    highest = DRAG_BOUNDS[1] / BETA_BOUNDS[0]
    grid = np.concatenate([[0.0], np.geomspace(1e-3, highest, 200)])
    best = int(np.argmin([misfit(ratio) for ratio in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(misfit, bounds=(low, high), method="bounded", options={"xatol": 1e-6})
    ratio = float(found.x)
    beta = min(1.0, DRAG_BOUNDS[1] / ratio) if ratio > 0 else 1.0
    return EbtFit(form, beta, ratio * beta, _flags(ratio, highest))


def fit_every_form(trials: Sequence[MeasuredTrial], robot: RobotSpec) -> dict[str, EbtFit]:
    """Each form fitted to the same trials, by its name."""
    tails = [measured_tail(trial, trial.kept) for trial in trials]
    measured = np.array([trial.speed for trial in trials])
    return {form.name: fit_ebt(form, tails, measured, robot) for form in FORMS}


def model_speeds(
    trial: MeasuredTrial, simulated: HeadFrame, ebts: Mapping[str, EbtFit], robot: RobotSpec
) -> dict[str, float]:
    """Forward speed over the kept whole beats of a trial by the name of every model, m/s.

    "twin" is the twin whose simulation (n, m, 2) is given; each form of the theory has its name for the measured tail,
    and "<form>, twin's tail" for that of the twin, as it forecasts without the measured one.
    """
    tails = {
        "": measured_tail(trial, trial.kept),
        FROM_TWIN: simulated_tail(trial.time_s, simulated, trial.tail, trial.kept, trial.frequency.hz),
    }
    twin = float(forward_speed(trial.time_s, simulated.forward_m, trial.kept, trial.frequency.hz))
    theory = {form + whose: ebt.speed(tail, robot) for whose, tail in tails.items() for form, ebt in ebts.items()}
    return {"twin": twin, **theory}


def _flags(ratio: float, highest: float) -> tuple[Flag, ...]:
    only_ratio = "only c_D / beta is identifiable from the speed; beta is kept at 1"
    flags = [Flag(EBT_RATIO_ONLY, message=f"EBT: {only_ratio} (c_D / beta = {ratio:.3g})")]
    if ratio < 1e-3 or ratio > 0.999 * highest:
        flags.append(Flag("at_bound", message=f"EBT: c_D / beta = {ratio:.3g} is at its bound"))
    return tuple(flags)
