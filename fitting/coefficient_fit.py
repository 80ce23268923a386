"""What a search for the coefficients gives: where each start ended, the best, and what is doubtful about it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.objective import COEFFICIENT_BOUNDS
from session import Flag
from swimmer import FluidCoefficients

NAMES = FluidCoefficients._fields
_AT_BOUND = 1e-3  # of the range
_AS_GOOD = 1.01  # objective within this factor of the best
_APART = 0.5  # difference between coefficients of equally good restarts that is worth a flag
_WIDE, _WIDE_BY = 2.5, 0.5  # factor and difference between the ends of an interval from which it is worth a flag


@dataclass(frozen=True, eq=False)
class Restart:
    """One start of the search and where it ended.

    Attributes:
        start, coefficients: (5,) before and after.
        phase_rad: (t,) crank phase of each trial at its time 0.
        objective_m: softened mean distance at the end, m.
        history_m: (i,) the same after each iteration, m.
        converged: the last step, or simplex, was small enough before iterations or budget ran out.
        swims_forward: the twin swims forward from rest.
    """

    start: np.ndarray
    coefficients: np.ndarray
    phase_rad: np.ndarray
    objective_m: float
    history_m: np.ndarray
    converged: bool
    swims_forward: bool = True

    @property
    def point(self) -> np.ndarray:
        """(p,) where it ended, in the search space."""
        return np.append(np.sqrt(self.coefficients), self.phase_rad)

    def with_trials(self, order: np.ndarray) -> "Restart":
        """The same with the trials in another order (t,)."""
        return replace(self, phase_rad=self.phase_rad[order])


@dataclass(frozen=True, eq=False)
class CoefficientFit:
    """The coefficients and how they were found.

    Attributes:
        coefficients: the best.
        phase_rad: (t,) crank phase of each fit trial.
        mean_distance_m: the published objective there, m.
        restarts: all descents, best first.
        evaluations: how often the fit trials were simulated.
        seconds: wall time.
        flags: bounds hit, not converged, restarts that disagree, coefficients that the data do not determine.
        method: the search, see `fitting.methods`.
        spent_s: seconds simulated.
        trace: (seconds simulated, best mean distance so far in m) at every new best that swims forward.
        interval: (5, 2) 95 % interval of each coefficient from the curvature at the best (see `fitting.precision`);
            None where it was not asked for.
        in_the_middle: the coefficients are the middle of the rough floor around the best restart, not that itself
            (see `fitting.smooth_floor`).
    """

    coefficients: FluidCoefficients
    phase_rad: np.ndarray
    mean_distance_m: float
    restarts: tuple[Restart, ...]
    evaluations: int
    seconds: float
    flags: tuple[Flag, ...]
    method: str = "gradient"
    spent_s: float = 0.0
    trace: tuple[tuple[float, float], ...] = ()
    interval: np.ndarray | None = None
    in_the_middle: bool = False

    def with_trials(self, order: np.ndarray) -> "CoefficientFit":
        """The same with the trials in another order (t,)."""
        restarts = tuple(restart.with_trials(order) for restart in self.restarts)
        return replace(self, phase_rad=self.phase_rad[order], restarts=restarts)


def flags_of(restarts: list[Restart], interval: np.ndarray | None = None) -> tuple[Flag, ...]:
    """What is doubtful about a set of restarts, best first, and about the 95 % intervals (5, 2) of the best."""
    best = restarts[0]
    low, high = COEFFICIENT_BOUNDS
    flags = [
        Flag("at_bound", message=f"{name} = {value:.3g} lies at its bound {bound:g}: the data pull it further")
        for name, value in zip(NAMES, best.coefficients, strict=True)
        for bound in (low, high)
        if abs(value - bound) < _AT_BOUND * (high - low)
    ]
    if not best.converged:
        message = "the best start had not converged when its iterations or its budget ran out: lower points may be near"
        flags.append(Flag("not_converged", message=message))
    flags += _direction_flags(restarts)
    as_good = equals_of(restarts)
    spread = np.ptp([restart.coefficients for restart in as_good], axis=0)  # (5,)
    if apart := [f"{name} (by {s:.2g})" for name, s in zip(NAMES, spread, strict=True) if s > _APART]:
        message = f"{len(as_good)} restarts fit equally well (within 1 %) but differ in {', '.join(apart)}"
        flags.append(Flag("restarts_disagree", message=message))
    return (*flags, *_undetermined(best, interval))


def is_polished(restarts: Sequence[Restart]) -> bool:
    """Whether the first was finished by a simplex (see `fitting.methods`): where it was before comes next."""
    if len(restarts) < 2:
        return False
    best, second = restarts[:2]
    return best.swims_forward == second.swims_forward and np.array_equal(best.start, second.start)


def equals_of(restarts: Sequence[Restart]) -> list[Restart]:
    """Of restarts, best first: the best, and those from other starts that fit as well and swim the same way.

    A simplex finishes the best alone, so the others are held against where that was before.
    """
    best, *others = (r for r in restarts if r.swims_forward == restarts[0].swims_forward)
    reached_m = others.pop(0).objective_m if is_polished(restarts) else best.objective_m
    return [best, *(r for r in others if r.objective_m <= _AS_GOOD * reached_m)]


def _undetermined(best: Restart, interval: np.ndarray | None) -> list[Flag]:
    if interval is None:
        return []
    return [
        Flag("unidentifiable", message=f"{name} = {value:.3g} is not determined: 95 % interval {low:.2g} to {high:.2g}")
        for name, value, (low, high) in zip(NAMES, best.coefficients, interval, strict=True)
        if high > _WIDE * low and high - low > _WIDE_BY
    ]


def _direction_flags(restarts: list[Restart]) -> list[Flag]:
    best, closest = restarts[0], min(restarts, key=lambda r: r.objective_m)
    if not best.swims_forward:
        return [
            Flag(
                "swims_backward",
                message="started from rest, the fitted twin swims backward at some frequencies",
            )
        ]
    if closest.objective_m < best.objective_m:
        message = (
            f"coefficients {100 * (1 - closest.objective_m / best.objective_m):.0f} % closer to the tracks were "
            "rejected: started from rest, that twin swims backward"
        )
        return [Flag("rejected_restart", message=message)]
    return []
