"""Which dry experiments are believed: a doubtful one is reported, a wrong one must not reach the swims."""

from fitting.dry_run import CrankFit, CrankTrial
from fitting.free_decay import DecayFit
from fitting.free_decay.decay_flags import WORST_SE
from session import Flag

WRONG_DECAY = ("head_moves", "poor_fit", "not_converged")
WRONG_RUN = ("head_moves", "poor_fit")
WRONG_ARM = ("at_bound", "unidentifiable")


def doubt_of_decay(fit: DecayFit) -> str | None:
    """Why a free decay is not believed; None where it is."""
    if doubt := _first(fit.flags, WRONG_DECAY):
        return doubt
    se = fit.stiffness_se_n_m / fit.stiffness_n_m
    return None if se < WORST_SE[0] else f"it tells the stiffness to {100 * se:.0f} % only"


def doubt_of_run(trial: CrankTrial) -> str | None:
    """Why one dry run among others is not believed; None where it is."""
    return _first(trial.flags, WRONG_RUN)


def doubt_of_arm(crank: CrankFit) -> str | None:
    """Why the arm of all dry runs together is not believed; None where it is."""
    return _first(crank.flags, WRONG_ARM)


def _first(flags: tuple[Flag, ...], kinds: tuple[str, ...]) -> str | None:
    return next((flag.message for flag in flags if flag.kind in kinds), None)
