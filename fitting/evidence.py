"""What stands beside a fit so that it is not taken for more than it is: a free yaw, boxes put right, profiles, other
pairs of trials.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from fitting.coefficient_fit import CoefficientFit
from fitting.coefficients import refine_coefficients
from fitting.objective import Swims
from fitting.pairs import PairFit, fit_pairs
from fitting.placed_fit import PlacedFit, fit_placed
from fitting.profile import CoefficientProfiles, profile_objective
from fitting.search_space import parameters
from fitting.trial import MeasuredTrial
from session.results import ResultFile
from swimmer import FluidCoefficients, Twin

BEFORE_PAIRS = 0.15  # share of the time that what comes before the pairs takes


@dataclass(frozen=True, eq=False)
class YawFit:
    """The fit with one turn of the head frame a trial, beside the plain one and never instead of it.

    Nose and neck boxes are placed by hand, so the measured axis of the head may be off by some degrees; a turn of it
    tilts the measured path as well.

    Attributes:
        coefficients: with the turns.
        mean_distance_m: the objective with them, m.
        yaw_rad: turn of each fit trial's measured head frame by the trial's name, counter-clockwise from above.
        converged: the descent ended before its iterations ran out. It begins at the plain fit, so even
            then `mean_distance_m` is an upper bound: a search of its own could end lower.
    """

    coefficients: FluidCoefficients
    mean_distance_m: float
    yaw_rad: Mapping[str, float]
    converged: bool


@dataclass(frozen=True, eq=False)
class Evidence:
    """What stands beside a fit.

    Attributes:
        yaw: the fit with one yaw a trial.
        placed: the fit with boxes where they most likely were put.
        profiles: the objective along each coefficient.
        pairs: the fit on other pairs of trials; empty with fewer than three swims, or when not asked for.
    """

    yaw: YawFit
    placed: PlacedFit
    profiles: CoefficientProfiles
    pairs: tuple[PairFit, ...]


EVIDENCE = ResultFile("evidence.json", Evidence)


def gather_evidence(
    trials: Sequence[MeasuredTrial],
    twin: Twin,
    fit: CoefficientFit,
    with_pairs: bool = True,
    seed: int = 0,
    tell: Callable[[str, float | None], None] = lambda _message, _share: None,
) -> Evidence:
    """Works out everything beside a fit.

    Args:
        trials: all swims.
        twin: with their markers.
        fit: on the swims whose role is "fit".
        with_pairs: also fit on other pairs, which takes longest.
        seed: of random choices.
        tell: called with what is going on and the share done.
    """
    fitted = tuple(trial for trial in trials if trial.role == "fit")
    tell("fitting with one yaw a trial", 0.0)
    yaw = fit_yaw(fitted, twin, fit)
    tell("fitting with boxes put right", 0.05)
    placed = fit_placed(trials, twin, fit)
    tell("profiling the coefficients", 0.1)
    profiles = profile_objective(Swims(twin, fitted), fit)
    if not with_pairs:
        return Evidence(yaw, placed, profiles, ())
    pairs = fit_pairs(
        trials, twin, seed, lambda message, share: tell(message, BEFORE_PAIRS + (1 - BEFORE_PAIRS) * share)
    )
    return Evidence(yaw, placed, profiles, pairs)


def fit_yaw(fitted: tuple[MeasuredTrial, ...], twin: Twin, fit: CoefficientFit) -> YawFit:
    """The fit with a free yaw a trial, from the plain fit."""
    swims = Swims(twin, fitted, "yaw")
    turned = refine_coefficients(swims, [fit.restarts[0].point], central=False)
    best = turned.restarts[0]
    yaws = swims.yaws(parameters(best.point)[:, None])[0]
    by_name = dict(zip([trial.name for trial in fitted], map(float, yaws), strict=True))
    return YawFit(turned.coefficients, turned.mean_distance_m, by_name, best.converged)
