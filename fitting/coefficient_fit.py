"""Fit of the five coefficients: the posterior mode, with the marginal of each.

`fit_coefficients` finds the mode (`fitting.search`) and flags the coefficients that the trials do not determine or that
lie at a bound.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from fitting.features import SPEED
from fitting.forecast import NORMAL_90
from fitting.mode import Mode, SearchEnd
from fitting.progress import Progress
from fitting.search import find_mode, find_mode_near
from fitting.session_model import SessionModel
from fitting.structure import ParameterUncertainty
from fitting.trial import MeasuredTrial
from fitting.trial_model import Roll
from swimcal.flags import Flag
from swimcal.mjcf import COEFFICIENT_BOUNDS, FluidCoefficients
from swimcal.robot import SHORTEST_STEP_S
from swimcal.twin import Twin

# A coefficient is not determined if the ends of its 90 % interval exceed this ratio and this difference.
_WIDE = 2.5
_WIDE_BY = 0.5
_CUT_OFF_SD = 0.37  # standard deviations from a bound within which an interval is cut off by it
NAMES = FluidCoefficients._fields
_STEP_OFF = 0.05  # share of the speed by which the time step may change it
_LEFT_OFF = 0.03  # the finer step leaves about this share
_AT_REST = 0.1  # share of the largest speed below which a twin hardly swims
_AT_BOUND = 1e-3  # share of the range from a bound within which a coefficient is at it


class Marginal(NamedTuple):
    """The marginal posterior of one coefficient.

    Attributes:
        mean, sd: mean and standard deviation.
        q05, q95: ends of the 90 % interval.
        ess_bulk: effective number of draws.
        r_hat: convergence of the chains; 1 is best.
        determined: whether the trials determine it; one that is cut off at a bound is not, however narrow.
    """

    mean: float
    sd: float
    q05: float
    q95: float
    ess_bulk: float
    r_hat: float
    determined: bool

    @property
    def narrow(self) -> bool:
        """Return whether the 90 % interval is narrow, by the trials or by a bound."""
        return self.q95 <= _WIDE * self.q05 or self.q95 - self.q05 <= _WIDE_BY

    @property
    def at_bounds(self) -> tuple[float, ...]:
        """The bounds of the prior that cut it off: its interval reaches them, and would reach further.

        Of a normal distribution these are bounds that shorten the interval by more than a tenth.
        """
        near = zip(COEFFICIENT_BOUNDS, (self.q05, self.q95), strict=True)
        return tuple(float(bound) for bound, end in near if abs(end - bound) < _CUT_OFF_SD * self.sd)


@dataclass(frozen=True, eq=False)
class CoefficientFit:
    """The coefficients and how they were found.

    Attributes:
        coefficients: the five fluid coefficients at the mode.
        interval: (5, 2) 90 % interval of each by the curvature at the mode, by how far steps from points about it lead
            apart, and about other ends of the search that are as likely; within the bounds.
        components: standard deviation of each variance component, by name (see `fitting.covariance`).
        roll: roll of the hull, by which simulated markers swing in the fit; it does not move the calibrated twin.
        ends: where every start of the search ended, the best first.
        simulations: how often the fit trials were simulated.
        seconds: wall time of the search.
        time_step_s: time step of the fitted twin; finer than the robot's where that changes the speed by too much, and
            the robot's file names none.
        flags: bounds hit, not converged, starts that disagree, coefficients that the data do not determine, a time step
            that changes the speed.
    """

    coefficients: FluidCoefficients
    interval: np.ndarray
    components: Mapping[str, float]
    roll: Roll
    ends: tuple[SearchEnd, ...]
    simulations: int
    seconds: float
    time_step_s: float
    flags: tuple[Flag, ...]


@threadpool_limits.wrap(limits=1, user_api="blas")  # the matrices are small: threads cost more than they save
def fit_coefficients(
    trials: Sequence[MeasuredTrial],
    twin: Twin,
    doubts: Sequence[ParameterUncertainty],
    starts: int = 3,
    seed: int = 0,
    progress: Progress = lambda _message, _share: None,
) -> tuple[CoefficientFit, Mode]:
    """Find the posterior mode of the coefficients of fit trials; their order does not matter.

    Args:
        trials: the fit trials.
        twin: the twin.
        doubts: uncertain numbers of the robot.
        starts: number of starts of the search.
        seed: seed of the search.
        progress: takes messages with the share of the work that is done.

    Raises:
        SimulationDiverged: the twin diverged from every start.
    """
    began = time.perf_counter()
    ordered = sorted(trials, key=lambda trial: trial.name)
    mode = find_mode(SessionModel.of(twin, ordered, doubts, with_course=True), starts, seed, progress)
    if (error := TimeStepError.of(mode)).matters and not twin.robot.names_time_step:
        progress(f"{error.sentence}: fitting again with {1000 * error.finer_s:g} ms", 0.9)
        finer = Twin(twin.robot.with_time_step(error.finer_s), twin.markers, workers=twin.workers)
        mode = find_mode_near(SessionModel.of(finer, ordered, doubts, with_course=True), mode, seed)
    reach = NORMAL_90 * np.sqrt(np.diag(mode.coefficient_covariance) + mode.spread**2)
    likely = np.array([mode.coefficients, *(end.coefficients for end in mode.disagree)])
    ends = np.column_stack([likely.min(axis=0) - reach, likely.max(axis=0) + reach])
    interval = np.clip(ends, *COEFFICIENT_BOUNDS)
    fit = CoefficientFit(
        coefficients=FluidCoefficients(*map(float, mode.coefficients)),
        interval=interval,
        components=mode.sizes,
        roll=mode.roll,
        ends=mode.ends,
        simulations=mode.simulations,
        seconds=time.perf_counter() - began,
        time_step_s=mode.model.trials[0].twin.scene.timestep_s,
        flags=(*_flags(mode, interval), *TimeStepError.of(mode).flags),
    )
    return fit, mode


class TimeStepError(NamedTuple):
    """Error of the twin's speed by its time step, in the fit trial where it is largest.

    Attributes:
        trial: name of that trial.
        share: share of the speed by which the twin is too fast, against fine steps.
        step_s: the twin's time step, s.
    """

    trial: str
    share: float
    step_s: float

    @classmethod
    def of(cls, mode: Mode) -> "TimeStepError":
        """Return the error at a mode, as a share of the twin's speed, or of a tenth of its largest where it rests."""
        speeds = np.abs([mode.simulated(number)[SPEED] for number in range(len(mode.blocks))])
        speeds = np.maximum(speeds, _AT_REST * speeds.max())
        lacks = zip(mode.blocks, speeds.tolist(), strict=True)
        share = {each.model.trial.name: float(-each.time_step[SPEED]) / speed for each, speed in lacks}
        worst = max(share, key=lambda name: abs(share[name]))
        return cls(worst, share[worst], mode.model.trials[0].twin.scene.timestep_s)

    @property
    def matters(self) -> bool:
        """Return whether the error is too large to be left."""
        return abs(self.share) >= _STEP_OFF

    @property
    def finer_s(self) -> float:
        """The time step that leaves a small error of the speed, s."""
        slower = min(np.ceil(abs(self.share) / _LEFT_OFF), np.floor(self.step_s / SHORTEST_STEP_S))
        return float(f"{self.step_s / slower:.2g}")

    @property
    def sentence(self) -> str:
        """The error in words."""
        return (
            f"with its time step of {1000 * self.step_s:g} ms the twin is {100 * abs(self.share):.0f} % too "
            f"{'fast' if self.share > 0 else 'slow'} in {self.trial}, against fine steps"
        )

    @property
    def flags(self) -> tuple[Flag, ...]:
        """The flag of an error that matters."""
        if not self.matters:
            return ()
        advice = f"Set time_step_s = {self.finer_s:g} in the robot's file and fit again"
        longer = f"it takes {self.step_s / self.finer_s:.0f} times as long"
        return (Flag("time_step", message=f"{self.sentence}. {advice}; {longer}"),)


def is_no_drag(name: str, bound: float) -> bool:
    """Tell whether a coefficient at this bound is a drag that is absent: below 0 it would push."""
    return bound == 0.0 and name.endswith("_drag")


def _at_bound(name: str, value: float, bound: float) -> str:
    if is_no_drag(name, bound):
        return f"{name} = {value:.3g} is at its physical limit 0: the trials show no such drag, and none is below 0"
    return f"{name} = {value:.3g} is at its bound {bound:g}: the data favour a value beyond it"


def _flags(mode: Mode, interval: np.ndarray) -> tuple[Flag, ...]:
    best, (low, high) = mode.ends[0], COEFFICIENT_BOUNDS
    flags = [
        Flag("at_bound", message=_at_bound(name, value, bound))
        for name, value in zip(NAMES, mode.coefficients, strict=True)
        for bound in (low, high)
        if abs(value - bound) < _AT_BOUND * (high - low)
    ]
    if not best.converged:
        flags.append(Flag("not_converged", message="the best start had not converged: a better fit may be near"))
    if not best.forward:
        message = "started from rest, the fitted twin swims backward at some frequencies"
        flags.append(Flag("swims_backward", message=message))
    elif best.refused or any(not end.forward and end.log_density > best.log_density for end in mode.ends[1:]):
        message = (
            "likelier coefficients were rejected, as their twin swims backward when it starts from rest: the true ones "
            "may be among these"
        )
        flags.append(Flag("rejected_restart", message=message))
    if others := mode.disagree:
        count = "another start is" if len(others) == 1 else f"{len(others)} other starts are"
        message = f"{count} as likely and ended elsewhere: these trials allow several fits"
        flags.append(Flag("restarts_disagree", message=message))
    flags += [
        Flag("unidentifiable", message=f"{name} = {value:.3g} is not determined: 90 % interval {a:.2g} to {b:.2g}")
        for name, value, (a, b) in zip(NAMES, mode.coefficients, interval, strict=True)
        if b > _WIDE * a and b - a > _WIDE_BY
    ]
    return tuple(flags)
