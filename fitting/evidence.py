"""What stands beside a fit so that it is not taken for more than it is: boxes put right, profiles, other pairs of
trials.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fitting.coefficient_fit import CoefficientFit
from fitting.objective import Swims
from fitting.pairs import PairFit, fit_pairs
from fitting.placed_fit import PlacedFit, fit_placed
from fitting.profile import CoefficientProfiles, profile_objective
from fitting.trial import MeasuredTrial
from session.results import ResultFile
from swimmer import Twin

BEFORE_PAIRS = 0.15  # share of the time that what comes before the pairs takes


@dataclass(frozen=True, eq=False)
class Evidence:
    """What stands beside a fit.

    Attributes:
        placed: the fit with boxes where they most likely were put.
        profiles: the objective along each coefficient.
        pairs: the fit on other pairs of trials; empty with fewer than three swims, or when not asked for.
    """

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
    tell("fitting with boxes put right", 0.0)
    placed = fit_placed(trials, twin, fit)
    tell("profiling the coefficients", 0.1)
    profiles = profile_objective(Swims(twin, fitted), fit)
    if not with_pairs:
        return Evidence(placed, profiles, ())
    pairs = fit_pairs(
        trials, twin, seed, lambda message, share: tell(message, BEFORE_PAIRS + (1 - BEFORE_PAIRS) * share)
    )
    return Evidence(placed, profiles, pairs)
